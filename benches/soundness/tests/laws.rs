//! What the interpreter says of plans small enough to see through.

use matterix_soundness::explore::{Summary, explore};
use matterix_soundness::plan::{
    ACID, Action, Block, CYAN, Condition, Cup, Handler, Kind, Lab, Plan, Remedy, Stmt, Theme, Thing,
};

fn block(kinds: Vec<Kind>, from: usize) -> Block {
    kinds.into_iter().enumerate().map(|(i, kind)| Stmt { id: from + i, kind }).collect()
}

/// Three cups of 1 mL with 500 uL of red, acid and cyan, an oven, two tokens and two dials.
fn plan(body: Vec<Kind>) -> Plan {
    let cup = |liquid| Cup { max: 1_000, holds: Some((liquid, 500)), cap: None, tin: false, piped: true };
    let cups = vec![cup(0), cup(ACID), cup(CYAN)];
    let lab = Lab { cups, dials: 2, ovens: vec![false], tokens: 2, plates: 0 };
    Plan { theme: Theme::Hazards, lab, declared: None, body: block(body, 0), finally: Vec::new() }
}

fn of(body: Vec<Kind>) -> Summary {
    explore(&plan(body), 1_000, 0)
}

fn codes(summary: &Summary) -> Vec<&'static str> {
    summary.violations.iter().map(|v| v.code).collect()
}

#[test]
fn acid_and_cyanide_are_dangerous_together() {
    let summary = of(vec![Kind::Do(Action::Drip(100, 1, 0)), Kind::Do(Action::Drip(100, 2, 0))]);
    assert_eq!(codes(&summary), ["incompatible-mix"]);
    assert!(!summary.clean && summary.complete && summary.certain);
}

#[test]
fn what_overflows_and_what_is_not_there_is_told_apart() {
    assert_eq!(codes(&of(vec![Kind::Do(Action::Drip(501, 0, 1))])), ["volume-underflow"]);
    assert_eq!(codes(&of(vec![Kind::Do(Action::Tip(501, 0, 1))])), ["transfer-fraction"]);
    let twice = vec![Kind::Do(Action::Drip(400, 0, 1)), Kind::Do(Action::Drip(101, 2, 1))];
    assert_eq!(codes(&of(twice)), ["incompatible-mix"].map(|_| "volume-overflow"));
}

#[test]
fn a_handler_takes_what_it_names() {
    let handler = |on| Handler { on, what: Remedy::Block(block(vec![Kind::Wait(1)], 10)) };
    let guard = |on| Kind::Guard(block(vec![Kind::Do(Action::Drip(501, 0, 1))], 5), vec![handler(on)]);
    assert!(of(vec![guard("volume_underflow")]).clean);
    assert_eq!(codes(&of(vec![guard("volume_overflow")])), ["volume-underflow"]);
}

#[test]
fn crossed_claims_end_in_a_deadlock() {
    let branch = |first, second, at: usize| {
        let inner = block(vec![Kind::Claim(vec![Thing::Token(second)], block(vec![Kind::Wait(10)], at + 3))], at + 2);
        let mut body = block(vec![Kind::Wait(1_000 + at as u32)], at + 1);
        body.extend(inner);
        block(vec![Kind::Claim(vec![Thing::Token(first)], body)], at)
    };
    let summary = of(vec![Kind::Parallel(vec![branch(0, 1, 10), branch(1, 0, 20)])]);
    assert_eq!(codes(&summary), ["deadlock"]);
}

#[test]
fn what_is_left_on_in_one_way_is_seen() {
    let fire = block(vec![Kind::Do(Action::Fire(0))], 5);
    let summary = of(vec![Kind::If(Condition::Dial(0), fire, Vec::new())]);
    assert_eq!(codes(&summary), ["unfinished"]);
    assert!(summary.clean && summary.executions == 2);
}

#[test]
fn a_wait_for_noise_ends_before_and_after_what_goes_on_beside_it() {
    let wait = block(vec![Kind::Until(Condition::Dial(0), 20_000, None), Kind::Do(Action::Drip(100, 1, 0))], 10);
    let other = block(vec![Kind::Wait(4_000), Kind::Do(Action::Drip(100, 0, 2))], 20);
    let summary = of(vec![Kind::Parallel(vec![wait, other])]);
    assert!(summary.complete && codes(&summary).contains(&"incompatible-mix") && summary.clean);
}

#[test]
fn a_job_that_is_begun_again_while_it_runs_fails() {
    let start = Kind::Start(0, block(vec![Kind::Wait(9_000)], 5));
    assert_eq!(codes(&of(vec![Kind::Repeat(2, block(vec![start], 3))])), ["job-still-running"]);
    assert_eq!(codes(&of(vec![Kind::Await(0)])), ["job-not-begun"]);
}

#[test]
fn what_is_claimed_later_is_not_claimed_for_a_job_begun_before() {
    let late = block(vec![Kind::Wait(2_000), Kind::Do(Action::Drip(100, 0, 1))], 10);
    let claim = Kind::Claim(vec![Thing::Cup(1)], block(vec![Kind::Wait(9_000)], 20));
    assert!(!of(vec![Kind::Start(0, late.clone()), claim]).certain);
    let inside = Kind::Claim(vec![Thing::Cup(1)], block(vec![Kind::Start(0, late), Kind::Wait(9_000)], 20));
    assert!(of(vec![inside]).certain);
}

#[test]
fn a_window_takes_what_comes_too_late_within_it() {
    let inner = vec![Kind::Wait(5_000), Kind::Within(0, 1_000, block(vec![Kind::Wait(1)], 20), None)];
    let handler = block(vec![Kind::Wait(1)], 30);
    let step = Kind::Step(0, block(vec![Kind::Wait(10)], 5));
    assert!(of(vec![step, Kind::Within(0, 1_000, block(inner, 10), Some(handler))]).clean);
}

#[test]
fn a_turn_of_a_loop_that_always_fails_is_told_from_one_that_may_not() {
    let drip = |n| vec![Kind::Repeat(n, block(vec![Kind::Do(Action::Drip(300, 0, 1))], 5))];
    let second = of(drip(2));
    assert!(second.fates[&5].always_in_a_turn("volume-underflow"));
    assert!(!of(drip(1)).fates[&5].always_in_a_turn("volume-underflow"));
    assert!(second.fates[&5].clean_of("volume-underflow").next().is_none());
}
