//! What the glassware of the library holds by its shapes.

use std::f64::consts::PI;

use matterix_ir::Sources;
use matterix_ir::scene::Shape;
use matterix_lang::{LibraryOnly, Options, compile};

const GLASSWARE: &str = include_str!("../../stdlib/glassware.mtx");

/// Names of all vessels with the volume they are filled to at most, mL.
fn vessels() -> Vec<(&'static str, f64)> {
    let assets = GLASSWARE.split("\nasset ").skip(1);
    let number = |text: &str| text.split(' ').next().and_then(|n| n.parse().ok());
    let vessel = |text: &'static str| {
        let (_, volume) = text.split_once("max_volume: ")?;
        Some((text.split(':').next()?, number(volume)?))
    };
    assets.map(|text| vessel(text).expect(text)).collect()
}

/// The room within an outline of radius and height turned about its axis, mL.
fn room(inside: &[[f64; 2]]) -> f64 {
    let slice = |step: &[[f64; 2]]| {
        let ([a, low], [b, high]) = (step[0], step[1]);
        PI / 3.0 * (high - low) * (a * a + a * b + b * b) * 1e6
    };
    inside.windows(2).map(slice).sum()
}

#[test]
fn shapes_hold_what_vessels_are_filled_to_and_little_more() {
    let vessels = vessels();
    assert!(vessels.len() >= 15, "{vessels:?}");
    for (name, most) in vessels {
        let text = format!(
            "mtx 1\nuse std::glassware::{name}\nlab bench {{ ambient: 20 degC, it = {name} at (0, 0, 0) m }}\n\
             workflow look in bench {{ wait 1 s }}\n"
        );
        let mut sources = Sources::default();
        let file = sources.add("bench.mtx", text);
        let (program, found) = compile(&mut sources, file, &LibraryOnly, &Options::default());
        let program = program.unwrap_or_else(|| panic!("{name}: {found:?}"));
        let it = program.scene.get(program.scene.find("it").expect("it"));
        let Some(Shape::Turned { outside, inside }) = &it.shape else { panic!("{name} has no inside") };
        let volume = room(inside);
        assert!((most..=1.1 * most).contains(&volume), "{name} holds {volume} mL, is filled to {most} mL");
        assert!(room(outside) > volume, "{name} has walls");
        // What a vessel is called by finds room in it.
        let nominal: String = name.chars().filter(char::is_ascii_digit).collect();
        if let (true, Ok(nominal)) = (name.ends_with("mL"), nominal.parse::<f64>()) {
            assert!(nominal <= most, "{name}");
        }
    }
}
