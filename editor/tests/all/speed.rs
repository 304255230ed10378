//! How soon names are answered in a file of 1,000 lines: `cargo test --release -p matterix-editor --test all -- --ignored soon --nocapture`.

use std::time::Instant;

use matterix_editor::Index;
use matterix_editor::complete::complete;

use crate::names::LAB;
use crate::support::{Files, analysed};

/// A file of a thousand lines.
fn long() -> String {
    let mut text = LAB.to_string();
    for n in 0.. {
        if text.lines().count() >= 1000 {
            return text;
        }
        text.push_str(&format!(
            "workflow cook{n}(target: Temperature = warm) in bench {{\n    let rise = target - ambient\n    bring beaker to target with plate {{ limit: 2 h }}\n    swing crate to open\n    for x in [1 s, 2 s] {{ wait x }}\n    expect crate.lid == open and rise > 1 K\n}}\n"
        ));
    }
    text
}

#[test]
#[ignore = "a measurement"]
#[expect(clippy::disallowed_methods, reason = "to measure is what it is for")]
fn names_are_answered_soon() {
    let text = long();
    let (analysis, index) = analysed("long.mtx", &text, &Files::default());
    let time = |what: &str, mut run: Box<dyn FnMut(usize)>| {
        let mut times: Vec<f64> = (0..50)
            .map(|n| {
                let began = Instant::now();
                run(n);
                began.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{what:<24} median {:.2} ms, at most {:.2} ms", times[25], times[49]);
    };
    println!("{} lines", text.lines().count());
    time("index", Box::new(|_| drop(Index::of(&analysis))));
    for (what, mark) in [
        ("step", "    swing "),
        ("object", "ring beaker"),
        ("value", "to target"),
        ("unit", "h }"),
        ("member", "lid =="),
        ("lab", "Crate at"),
        ("expression", "rise > 1"),
    ] {
        let places: Vec<usize> = text
            .match_indices(mark)
            .map(|(at, _)| at + mark.find(' ').map_or(0, |i| if what == "member" { 0 } else { i + 1 }))
            .collect();
        let (index, file, text) = (&index, analysis.root, &text);
        time(
            &format!("completion of a {what}"),
            Box::new(move |n| drop(complete(index, file, text, places[n * 7 % places.len()]))),
        );
    }
    let places: Vec<usize> = text.match_indices("target").map(|(at, _)| at).collect();
    time("hover", Box::new(|n| drop(index.about(analysis.root, places[n * 7 % places.len()]))));
    time("definition", Box::new(|n| drop(index.definition(analysis.root, places[n * 7 % places.len()]))));
    time(
        "references",
        Box::new(|n| drop(index.def_at(analysis.root, places[n * 7 % places.len()]).map(|d| index.references(d)))),
    );
}
