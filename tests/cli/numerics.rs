//! Numbers of the twin that are known in closed form, at every size and however short a time they last.

use crate::harness::{folder, matterixc, matterixc_in, pass_cases, root, run_case, write};

#[test]
fn states_of_any_size_are_followed() {
    pass_cases("numerics/sizes.mtx", &["decays_and_feeds", "swings", "grows", "reacts_in_femtomoles"]);
}

#[test]
fn what_lasts_a_moment_is_not_stepped_over() {
    pass_cases("numerics/moments.mtx", &["counts_crests", "sees_a_pulse"]);
}

#[test]
fn what_passes_between_two_steps_is_seen() {
    pass_cases(
        "numerics/passing.mtx",
        &[
            "meets_a_bell",
            "meets_a_moment",
            "adds_up_beside_others",
            "meets_beside_others",
            "outlives_what_was_fast",
            "dies_out",
        ],
    );
    let (code, text) = run_case("numerics/passing.mtx", "is_dangerous_for_a_second", &[]);
    assert!(code == 1 && text.contains("between_two") && text.contains("at 100 s"), "{text}");
}

#[test]
fn a_law_that_loses_its_value_is_named_where_its_argument_moves_evenly() {
    let (code, text) = run_case("numerics/passing.mtx", "loses_its_value", &[]);
    assert!(code == 1 && text.contains("error[not-a-number]") && text.contains("root(l)"), "{text}");
}

#[test]
fn no_run_goes_on_by_a_condition_that_has_lost_its_value() {
    let file = "numerics/undecided.mtx";
    pass_cases(file, &["safe", "waits_before"]);
    for workflow in ["event", "guard", "choice", "waits", "keeps", "keeps_not", "holds"] {
        let (code, text) = run_case(file, workflow, &[]);
        let at = text.contains("error[not-a-number]") && text.contains("at 10 s");
        assert!(code == 1 && at && text.contains("root") | text.contains("logarithm"), "{text}");
    }
    for (workflow, at) in [("loops", "at 11 s"), ("branches", "at 15 s")] {
        let (code, text) = run_case(file, workflow, &[]);
        assert!(code == 1 && text.contains("error[not-a-number]") && text.contains(at), "{text}");
    }
}

#[test]
fn whole_numbers_of_what_moves_go_up_and_down_in_steps() {
    pass_cases("numerics/stairs.mtx", &["go"]);
}

#[test]
fn what_follows_the_clock_is_met_however_it_is_written() {
    let all = ["counts_down", "waits_for_the_countdown", "ends_with_an_event", "waits_to_the_last_moment", "fades"];
    pass_cases("numerics/clock.mtx", &all);
    pass_cases("numerics/clock.mtx", &["touches"]);
    let (code, text) = run_case("numerics/clock.mtx", "meets", &[]);
    assert!(code == 1 && text.contains("`t.x < 6`"), "{text}");
}

#[test]
fn short_waits_add_up_exactly() {
    pass_cases("numerics/moments.mtx", &["adds_up_waits"]);
}

#[test]
fn a_salt_of_the_library_precipitates_and_dissolves() {
    pass_cases("numerics/precipitation.mtx", &["precipitates", "dissolves"]);
}

#[test]
fn an_acid_that_a_reaction_makes_splits_as_it_is_made() {
    pass_cases("numerics/acid_made.mtx", &["w"]);
}

#[test]
fn a_reaction_waits_for_a_reactant_that_is_not_there() {
    let all = ["comes_later", "on_a_plate", "in_a_tip", "one_of_two", "nothing", "turns_back"];
    pass_cases("numerics/absent.mtx", &all);
}

#[test]
fn a_law_whose_rate_follows_what_is_left_takes_nothing_of_nothing() {
    pass_cases("numerics/drains_what_is_left.mtx", &["go"]);
}

#[test]
fn a_law_that_takes_from_an_empty_vessel_ends_the_run() {
    let (code, text) = run_case("numerics/runs_dry.mtx", "w", &[]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("error[transfer-fraction]: `flow(f)` removes more than `"), "{text}");
    assert!(text.contains("at 11.97"), "{text}");
}

#[test]
fn what_a_feed_of_microlitres_comes_to_is_known_beforehand() {
    let file = root().join("tests/cases/numerics/sizes.mtx");
    let checked = matterixc(&["check", "--contents", file.to_str().expect("text")]);
    assert!(checked.out.contains("fed 30.5 uL"), "{}{}", checked.out, checked.err);
}

#[test]
fn what_is_unlimited_is_shown_as_that() {
    let dir = folder("numerics_endless");
    let text = "mtx 1\nconst a: Length? = unlimited\nlab bench { ambient: 22 degC }\nworkflow w in bench {\n    \
                expect a in 2 m .. 5 m\n    expect a in unlimited .. 5 m\n    expect 1 m in 2 m .. unlimited\n    note \"up to {a}\"\n}\n";
    write(&dir, "endless.mtx", text);
    for command in [["check", "--no-cache", "endless.mtx"].as_slice(), &["run", "endless.mtx"]] {
        let said = matterixc_in(&dir, command);
        let all = said.out + &said.err;
        assert!(said.code == 1 && all.contains("is unlimited, the allowed range is 2 m .. 5 m"), "{all}");
        assert!(all.contains("is unlimited, at most 5 m") && all.contains("is 1 m, at least 2 m"), "{all}");
        assert!(!all.contains("inf"), "{all}");
    }
}

#[test]
fn what_is_unlimited_is_more_than_any_number() {
    let dir = folder("numerics_unlimited");
    let text = "mtx 1\nconst a: Length? = unlimited\nconst b: Length = 5 m\nlab bench { ambient: 22 degC }\nworkflow w in bench {\n    \
                expect a > b and a >= b and b < a and b <= a and a != b\n    \
                expect not (a <= b) and not (a < b) and not (a == b) and not (b > a) and not (b >= a)\n    expect not (a in 1 m .. 2 m)\n    \
                expect a == a and a <= a and not (a < a)\n}\n";
    write(&dir, "unlimited.mtx", text);
    let run = matterixc_in(&dir, &["run", "unlimited.mtx"]);
    assert_eq!(run.code, 0, "{}{}", run.out, run.err);
}
