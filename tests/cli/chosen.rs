//! What is known before the run is decided before it: elements by number, things that are chosen, words.

use crate::harness::{folder, matterixc_in, write};

const DECK: &str = "mtx 1
use std::opentrons::{Corning96, OT2, P10Single, P50Single, TipRack300}
asset TipRack10 from labware \"opentrons_96_tiprack_10ul\"
table picks from csv \"picks.csv\" { well: Place, volume: Volume, k: Int }
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P50Single, right: P10Single } at (0, 0, 0) m
    small = TipRack10 on ot2.slot[7]
    tips = TipRack300 on ot2.slot[10]
    stock = Corning96 on ot2.slot[2] holding { A1 .. H12: 300 uL of water }
    plate = Corning96 on ot2.slot[1]
}
";

fn of(name: &str, command: &[&str], items: &str) -> (i32, String) {
    let dir = folder(name);
    write(&dir, "picks.csv", "well,volume,k\nA1,10 uL,1\nA2,40 uL,2\n");
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let ended = matterixc_in(&dir, &[command, &["a.mtx"]].concat());
    (ended.code, format!("{}{}", ended.out, ended.err))
}

#[track_caller]
fn met(name: &str, items: &str) {
    let (code, said) = of(name, &["run"], items);
    assert_eq!(code, 0, "{items}: {said}");
}

/// The findings, a line each, without the place.
fn found(name: &str, items: &str) -> Vec<String> {
    let (_, said) = of(name, &["check", "--format", "concise"], items);
    let lines = said.lines().filter(|line| line.contains("a.mtx:"));
    lines.map(|line| line.splitn(4, ':').last().unwrap_or_default().trim().to_owned()).collect()
}

#[test]
fn an_element_may_have_any_number_known_before_the_run() {
    const HEADS: [&str; 3] =
        ["var wells = plate.row(1)", "let wells = plate.row(1)", "var wells = []; wells += plate.row(1)"];
    let right = [("n", "A3"), ("2 * n + 1", "A6"), ("picks[1].k", "A3"), ("picks.count + n", "A5")];
    let mut steps = String::from("expect [1 s, 2 s, 3 s][n] == 3 s\n");
    for head in HEADS {
        let met = right.map(|(index, well)| format!("wells[{index}] == plate[{well}]")).join(" and ");
        steps.push_str(&format!("sequence {{ {head}; expect {met}; transfer 30 uL from stock[A1] to wells[n] by ot2.left using tips {{ tips: once }} }}\n"));
    }
    met(
        "chosen_element",
        &format!("workflow w(n: Int = 2) in deck {{\n{steps}expect plate[A3].contents.volume in 89 uL .. 91 uL\n}}\n"),
    );
    let wrong = [
        ("6 * n", "counted from 0: there is no number 12"),
        ("n / 4", "there is no number 0.5"),
        ("n - 3", "there is no number -1"),
        ("floor(stock[A1].contents.volume / 100 uL)", "must be known before the run"),
    ];
    let one = |(i, (head, (index, _))): (usize, (&str, (&str, &str)))| {
        format!("workflow w{i}(n: Int = 2) in deck {{ {head}; note \"{{wells[{index}]}}\" }}\n")
    };
    let all: Vec<_> = HEADS.into_iter().flat_map(|head| wrong.map(|w| (head, w))).collect();
    let said = found("chosen_element", &all.iter().copied().enumerate().map(one).collect::<String>());
    assert_eq!(said.len(), all.len(), "{said:#?}");
    for ((_, (index, words)), line) in all.iter().zip(&said) {
        assert!(line.contains(words), "{index}: {line}");
    }
}

#[test]
fn a_parameter_without_a_value_is_not_out_of_range() {
    let places = [
        "plate.wells[n]",
        "plate.row(1)[n]",
        "plate.well(n)",
        "plate.row(n)",
        "plate.row(1).first(n)",
        "nth(plate.row(1), n)",
    ];
    let one = |(i, place): (usize, &str)| {
        format!(
            "workflow w{i}(n: Int) in deck {{ transfer 30 uL from stock[A1] to {place} by ot2.left using tips {{ tips: once }} }}\n"
        )
    };
    let items: String = places.into_iter().enumerate().map(one).collect();
    assert_eq!(found("chosen_later", &items), Vec::<String>::new());
    let items = "workflow w(n: Int) in deck { let l = [1 s, 2 s]; wait l[n] }
study s of w { vary n in 0 .. 1 by grid(2); report t = elapsed }\n";
    let said = found("chosen_later", items);
    assert!(said.len() == 1 && said[0].contains("`n` cannot vary"), "{said:?}");
}

#[test]
fn a_thing_chosen_before_the_run_is_like_any_other() {
    let items = "skill place(v: Volume) from(s: Vessel) to(t: Vessel) with(left: Pipette, right: Pipette, large: TipRack, little: TipRack) {
    let pipette = choose(v <= 10 uL, right, left)
    let rack = choose(v <= 10 uL, little, large)
    expect v <= pipette.volumes.max
    transfer v from s to t by pipette using rack { tips: each }
}
workflow w(large: Bool = true, limit: Volume = 10 uL) in deck {
    for row in picks {
        let pipette = choose(row.volume <= limit, ot2.right, ot2.left)
        let rack = choose(row.volume <= 10 uL, small, tips)
        let target = choose(row.volume <= 10 uL, plate[B1], plate[B2])
        transfer row.volume from stock[row.well] to target by pipette using rack { tips: each }
        pick up tip from rack by pipette
        drop tip by pipette
        expect row.volume <= pipette.volumes.max
        place row.volume from stock[row.well] to plate[C1] with (ot2.left, ot2.right, tips, small)
    }
    let kit = choose(large, (ot2.left, tips), (ot2.right, small))
    transfer 10 uL from stock[A1] to choose(not large, plate.wells, plate[D1 .. D2]) by kit[0] using kit[1] { tips: once }
    expect plate[B1].contents.volume in 9 uL .. 11 uL and plate[B2].contents.volume in 39 uL .. 41 uL
    expect plate[C1].contents.volume in 49 uL .. 51 uL and plate[D1].contents.volume > 9 uL and plate[A1].contents.volume < 1 uL
}
";
    met("chosen_thing", items);
    // Another value gives another pipette: 40 uL are too much for the small one.
    let (code, said) = of("chosen_thing", &["run", "--set", "limit=50 uL"], items);
    assert!(code == 1 && said.contains("ot2.right"), "{said}");
}

#[test]
fn a_thing_that_only_the_run_chooses_is_refused_in_one_form() {
    let chosen = |step: &str| {
        format!(
            "workflow w in deck {{\n    let measured = stock[A1].contents.volume\n    \
             let pipette = choose(measured > 10 uL, ot2.left, ot2.right)\n    let rack = choose(measured > 10 uL, tips, small)\n    {step}\n}}\n"
        )
    };
    for (step, what) in [
        ("drop tip by pipette", "`pipette`"),
        ("pick up tip from rack by ot2.left", "`rack`"),
        ("transfer 10 uL from stock[A1] to plate[A1] by pipette using tips { tips: each }", "`pipette`"),
        (
            "transfer 10 uL from stock[A1] to choose(measured > 10 uL, plate[A1], plate[A2]) by ot2.left using tips { tips: each }",
            "`targets`",
        ),
        ("expect pipette.volumes.max > 1 uL", "the thing whose `volumes` is used"),
        ("claim pipette { wait 1 s }", "`pipette`"),
    ] {
        let said = found("chosen_by_run", &chosen(step));
        let wanted = format!("{what} must be known before the run");
        assert!(
            said.iter().any(|line| line.starts_with("error[unsupported]") && line.ends_with(&wanted)),
            "{step}: {said:?}"
        );
        assert!(said.len() == 1, "{step}: {said:?}");
    }
    let (_, said) = of("chosen_by_run", &["check"], &chosen("drop tip by pipette"));
    assert!(said.contains("use `if` with the step in each branch"), "{said}");
}

#[test]
fn a_word_may_be_the_first_argument() {
    let items = "skill give(reagent: water | mix | primer) by(p: Pipette) { note \"gives {reagent}\" }
skill give both(reagent: water | mix | primer, n: Int) by(p: Pipette) { note \"gives {reagent} {n}\" }
skill mark(spot: Place) in(p: WellPlate) { note \"marks {spot}\" }
";
    let steps = "workflow w(r: water | mix | primer = mix) in deck {
    give primer by ot2.left
    give water by ot2.left
    give r by ot2.left
    give both (water, 3) by ot2.left
    mark A1 in plate
    mark \"B2\" in plate
}
";
    let (code, said) = of("chosen_word", &["run"], &format!("{items}{steps}"));
    assert_eq!(code, 0, "{said}");
    for words in ["gives primer", "gives water", "gives mix", "gives water 3", "marks A1", "marks B2"] {
        assert!(said.lines().any(|line| line.trim_end().ends_with(words)), "{words}: {said}");
    }
    let wrong = |step: &str| found("chosen_word", &format!("{items}workflow w in deck {{ {step} by ot2.left }}\n"));
    let said = wrong("give primr");
    assert!(said.len() == 1 && said[0].ends_with("`primr` is not one of `water`, `mix`, `primer`"), "{said:?}");
    let said = wrong("give 3");
    assert!(said.len() == 1 && said[0].contains("`reagent` expects one of"), "{said:?}");
}

#[test]
fn of_behind_a_sum_means_all_of_it() {
    let said = |amount: &str, held: &str| {
        let items = format!(
            "solution dye {{ NaCl: 1 g, water: 99 g }}\nlab two {{\n    ambient: 22 degC\n    ot2 = OT2 {{ left: P50Single }} at (0, 0, 0) m\n    \
             tips = TipRack300 on ot2.slot[10]\n    stock = Corning96 on ot2.slot[2] holding {{ A1: 300 uL of {held} }}\n    \
             plate = Corning96 on ot2.slot[1]\n}}\nworkflow w(volume: Volume = 50 uL, share: Volume = 20 uL) in two {{\n    \
             transfer {amount} from stock[A1] to plate[A1] by ot2.left using tips {{ tips: each }}\n}}\n"
        );
        found("chosen_of", &items)
    };
    for amount in
        ["volume - share of dye", "(volume - share) of dye", "20 uL of dye + 10 uL of dye", "2 * share of dye"]
    {
        assert_eq!(said(amount, "dye"), Vec::<String>::new(), "{amount}");
        let wrong = said(amount, "EtOH");
        assert!(wrong.len() == 1 && wrong[0].starts_with("error[wrong-reagent]"), "{amount}: {wrong:?}");
    }
    for amount in ["volume of dye - share", "volume of dye - share of water"] {
        let part = said(amount, "dye");
        assert!(
            part.len() == 1 && part[0].ends_with("is only a part of the amount: `of dye` is not checked"),
            "{part:?}"
        );
    }
}
