//! What a lab offers to others: ranges, results and texts of its commands.

use matterix_ir::Sources;
use matterix_ir::offer::{Bound, Kind, Offer, Offers};
use matterix_lang::{LibraryOnly, Options, Wires, compile};

const LAB: &str = "mtx 1
use std::heating::IkaRetControl
use std::heating::IkaRctBasic
/// A bench by the window.
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    hot = IkaRctBasic at (1, 0, 0) m
    turner = Turning at (2, 0, 0) m
}
/// Turns things.
capability Turner {
    param limit: Frequency
    state turns: Ratio = 0
    command turn for_a_while with(speed: Frequency)
        option count: Int
        needs speed <= 2 * limit else too_fast \"turn more slowly\"
        needs not (speed <= 0.5 Hz) and turns < 100
        needs count in 1 .. 7
        fails jammed
        says \"turn {self} at {speed}\"
        effect turns = turns + 1
        takes 3 s
}
/// A turner of our own.
asset Turning: Turner { limit: 5 Hz }
/// Warms a plate.
skill warm_up(plate: Heater) to(t: Temperature)
    needs t in plate.limits
{
    heat plate to t
}
skill weigh(scale: Balance) -> Mass
    fails jammed
{
    let seen <- read scale
    return seen
} on out_of_range { fail jammed }
skill count(scale: Balance) -> Int { return 3 }
workflow idle in bench { wait 1 s }
";

fn offers() -> Offers {
    let mut sources = Sources::default();
    let file = sources.add("lab.mtx", LAB);
    let options = Options { wires: Wires::Offered, ..Options::default() };
    let (program, found) = compile(&mut sources, file, &LibraryOnly, &options);
    let found: Vec<_> = found.iter().filter(|d| d.is_error()).collect();
    assert!(found.is_empty(), "{found:?}");
    program.expect("it compiles").offers
}

fn offer<'o>(offers: &'o Offers, verb: &str) -> &'o Offer {
    offers.commands.iter().find(|o| o.verb == verb).unwrap_or_else(|| panic!("`{verb}` is offered"))
}

#[test]
fn needs_with_known_numbers_are_ranges() {
    let offers = offers();
    let end = |number: f64, is_open| Some(Bound { number, is_open });
    let turn = offer(&offers, "turn for_a_while");
    let [speed, count] = turn.parameters.as_slice() else { panic!("{:?}", turn.parameters) };
    assert_eq!((speed.bounds.least, speed.bounds.greatest), (end(0.5, true), end(10.0, false)));
    assert_eq!((count.bounds.least, count.bounds.greatest), (end(1.0, false), end(7.0, false)));
    assert_eq!(speed.declared, "Frequency");
    // Two plates: the range is the wider one, as what the narrower one takes is judged when the command begins.
    let warm = offer(&offers, "warm_up");
    assert_eq!(warm.parameters[1].bounds.greatest, end(340.0 + 273.15, false));
    let heat = offers.commands.iter().filter(|o| o.verb == "heat").map(|o| o.parameters[0].bounds.greatest);
    let limits: Vec<_> = heat.map(|b| b.map(|b| b.number - 273.15)).collect();
    assert_eq!(limits.len(), 2);
    assert!(limits.iter().zip([340.0, 310.0]).all(|(a, b)| a.is_some_and(|a| (a - b).abs() < 1e-9)), "{limits:?}");
}

#[test]
fn what_a_skill_returns_has_its_unit_and_its_local() {
    let offers = offers();
    let weigh = offer(&offers, "weigh");
    assert!(matches!(&weigh.result, Some(Kind::Quantity { unit, .. }) if unit.symbol == "g"), "{:?}", weigh.result);
    assert!(weigh.arrangements.iter().all(|a| a.result.is_some()));
    assert_eq!(offer(&offers, "count").result, Some(Kind::Whole));
    assert_eq!(offer(&offers, "warm_up").result, None);
}

#[test]
fn texts_come_from_the_declarations() {
    let offers = offers();
    let turn = offer(&offers, "turn for_a_while");
    assert_eq!(turn.docs, "Turn it at `speed`.");
    assert_eq!(offer(&offers, "warm_up").docs, "Warms a plate.");
    let fails: Vec<_> = turn.fails.iter().map(|f| (f.name.as_str(), f.help.as_deref())).collect();
    assert_eq!(fails, [("jammed", None), ("too_fast", Some("turn more slowly")), ("need", None)]);
    assert_eq!(offers.docs(None, ""), "A bench by the window.");
    assert_eq!(offers.docs(turn.device, "Turner"), "Turns things.");
    assert_eq!(offers.docs(turn.device, ""), "A turner of our own.");
}
