//! The page of plots.

use super::fixture;

fn texts(svg: &str) -> Vec<String> {
    let page = roxmltree::Document::parse(svg).expect("well-formed");
    page.descendants()
        .filter(|n| n.has_tag_name("text"))
        .filter_map(|n| n.text())
        .map(|t| t.trim().to_owned())
        .collect()
}

#[test]
fn the_page_is_well_formed_and_says_what_it_shows() {
    let lab = fixture::lab();
    let svg = matterix_runtime::record::plot::page(&lab.run()).expect("drawn");
    if let Ok(path) = std::env::var("PLOT_OUT") {
        std::fs::write(path, &svg).expect("written");
    }
    let texts = texts(&svg);
    for wanted in [
        "synthesize in bench",
        "temperature, target [degC]",
        "beaker.contents [mol/kg]",
        "EtI",
        "hotplate.active",
        "beaker.support",
        "heating(hotplate)",
        "wait 2 s",
        "time [s]",
        "beaker.contents.color",
    ] {
        assert!(texts.iter().any(|t| t.trim_start_matches("· ") == wanted), "{wanted}: {texts:#?}");
    }
    assert!(
        !texts.iter().any(|t| t.contains("enthalpy") || t.contains("convection")),
        "what does not change or only counts"
    );
    assert_eq!(svg, matterix_runtime::record::plot::page(&fixture::lab().run()).expect("drawn"));
}

#[test]
fn an_empty_run_has_a_page() {
    let mut lab = fixture::lab();
    lab.recording = matterix_runtime::record::Recording::new(&lab.program);
    let svg = matterix_runtime::record::plot::page(&lab.run()).expect("drawn");
    assert!(texts(&svg).contains(&"synthesize in bench".to_owned()));
}

#[test]
fn values_that_are_no_numbers_are_left_out() {
    let mut lab = fixture::lab();
    lab.recording.states[0] = fixture::series(&[(0.0, 300.0), (7.0, f64::NAN), (8.0, 301.0), (9.0, f64::INFINITY)]);
    let svg = matterix_runtime::record::plot::page(&lab.run()).expect("drawn");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn more_lines_than_colours_are_said_in_words() {
    let mut lab = fixture::lab();
    let (state, column) = (lab.program.model.states[0].clone(), lab.recording.states[0].clone());
    for i in 0..9 {
        let name = format!("body{i}.temperature");
        lab.program.model.states.push(matterix_ir::model::State { name, ..state.clone() });
        let points: Vec<_> = column.points().map(|(t, v)| (t, v * (1.0 + 0.01 * f64::from(i)))).collect();
        lab.recording.states.push(fixture::series(&points));
    }
    let svg = matterix_runtime::record::plot::page(&lab.run()).expect("drawn");
    assert!(texts(&svg).iter().any(|t| t.starts_with("not shown: ")), "the rest is named");
}
