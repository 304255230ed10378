//! How contents begin: what a lab says of them is what runs, bills and protocols make of it.

use crate::harness::{folder, matterixc, matterixc_in, write};

const CASE: &str = "tests/cases/warm_start.mtx";

#[test]
fn contents_begin_and_mix_as_the_lab_says() {
    let ended = matterixc(&["run", CASE]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

#[test]
fn a_study_varies_how_warm_contents_begin() {
    let ended = matterixc(&["study", CASE]);
    assert!(
        ended.out.contains("vary hot.contents.initial_temperature in 60 degC .. 90 degC by grid(4)"),
        "{}",
        ended.out
    );
    assert!(!ended.out.contains("error"), "{}", ended.out);
}

#[test]
fn people_are_told_how_warm_contents_are() {
    let ended = matterixc(&["doc", CASE]);
    assert!(ended.out.contains("Put 100 g of water at 80 °C into **hot**"), "{}", ended.out);
    assert!(ended.out.contains("and 1 mL of silver at 60 °C into **flask**"), "{}", ended.out);
}

#[test]
fn a_density_that_is_worked_out_gives_a_volume() {
    let ended = matterixc(&["bill", CASE]);
    let line = ended.out.lines().find(|line| line.contains("glycol") && line.contains("mol")).unwrap_or_default();
    assert!(line.contains("100 mL"), "{}", ended.out);
}

#[test]
fn the_format_of_a_beginning_stays() {
    let dir = folder("beginnings");
    let text = "mtx 1\n\nuse std::glassware::Beaker50mL\n\nlab bench {\n    ambient: 22 degC\n    a = Beaker50mL at (0, 0, 0) m holding 1 g of water + 1 g of NaCl at 4 degC\n}\n";
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["fmt", "--check", "a.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

#[test]
fn what_follows_from_the_rest_does_not_vary() {
    let dir = folder("derived_path");
    let text = std::fs::read_to_string(crate::harness::root().join(CASE)).expect("the case is there");
    write(&dir, "a.mtx", text.replace("vary hot.contents.initial_temperature", "vary hot.contents.temperature"));
    let ended = matterixc_in(&dir, &["check", "a.mtx"]);
    assert_eq!(ended.code, 1);
    let said = ended.out.replace('\n', " ");
    assert!(said.contains("cannot-vary") && said.contains("say how warm the contents are"), "{}", ended.out);
}
