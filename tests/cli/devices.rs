//! Devices with lids, latches and caps, arms and bins: each fault alone, and its twin without.

use crate::harness::{folder, matterixc, write};

/// Line of the first step in [`bench`].
const FIRST: u64 = 28;

/// A bench with one of everything, and steps.
fn bench(params: &str, steps: &[&str]) -> String {
    let steps: String = steps.iter().map(|s| format!("    {s}\n")).collect();
    format!(
        "mtx 1

use std::centrifuges::MiniSpin
use std::glassware::Beaker50mL
use std::heating::{{BinderEd56, IkaRetControl}}
use std::opentrons::{{Corning96, HeaterShaker, OT2, P300Single, TipRack300, TrashBin}}
use std::robots::FrankaPanda
use std::vials::{{Vial20mL, Vial2mL}}
lab bench {{
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    arm = FrankaPanda on table
    bin = TrashBin on table
    hotplate = IkaRetControl on table
    oven = BinderEd56 on table
    spinner = MiniSpin on table
    robot = OT2 {{ left: P300Single }} on table
    tips = TipRack300 on robot.slot[1]
    plate = Corning96 on robot.slot[2] holding {{ A1: 100 uL of water }}
    shaker = HeaterShaker on robot.slot[7]
    vial = Vial2mL {{ cap: on }} on spinner.places[1] holding 1 mL of water
    twin = Vial2mL {{ cap: on }} on spinner.places[7] holding 1 mL of water
    jar = Vial20mL {{ cap: on }} on hotplate holding 10 mL of water
    cup = Beaker50mL on table holding 20 g of water
    mug = Beaker50mL on table holding 10 g of water
}}
workflow run{params} in bench {{
{steps}}}
"
    )
}

/// Code, severity and line of every finding.
fn findings(name: &str, text: &str) -> Vec<(String, String, u64)> {
    let path = write(&folder(&format!("devices_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    let line = |v: &serde_json::Value| v["span"]["start"]["line"].as_u64().unwrap_or_default();
    // What these few steps leave on or in hand is not what is tried here.
    let meant = lines.iter().filter(|l| l["code"] != "unfinished");
    meant.map(|l| (text(&l["code"]), text(&l["severity"]), line(l))).collect()
}

/// The last step yields one error of this code, and nothing else.
fn wrong(code: &str, steps: &[&str]) {
    let name = format!("{code}_{}", steps.len());
    let expected = vec![(code.to_string(), "error".to_string(), FIRST + steps.len() as u64 - 1)];
    assert_eq!(findings(&name, &bench("", steps)), expected, "{steps:?}");
}

fn clean(name: &str, steps: &[&str]) {
    assert_eq!(findings(name, &bench("", steps)), [], "{steps:?}");
}

#[test]
fn a_lid_is_closed_to_run_and_open_to_load() {
    wrong("lid-open", &["open lid spinner", "spin spinner at 5000 rpm using 1 min"]);
    wrong("lid-closed", &["pick vial by arm"]);
    wrong("lid-closed", &["place cup on oven by arm"]);
    wrong("lid-open", &["open lid oven", "place cup on oven by arm", "heat oven to 60 degC"]);
    clean("centrifuge", &["spin spinner at 5000 rpm using 1 min", "open lid spinner", "pick vial by arm"]);
    clean(
        "oven",
        &[
            "open lid oven",
            "place cup on oven by arm",
            "close lid oven",
            "heat oven to 60 degC",
            "stop heating oven",
            "open lid oven",
            "place cup on table by arm",
        ],
    );
}

#[test]
fn a_latch_is_closed_to_shake_and_open_to_load() {
    wrong("latch-open", &["place plate on shaker by arm", "shake shaker at 500 rpm"]);
    wrong("latch-closed", &["close latch shaker", "place plate on shaker by arm"]);
    let shaken = ["place plate on shaker by arm", "close latch shaker", "shake shaker at 500 rpm"];
    let then = |more: &[&'static str]| [&shaken[..], more].concat();
    wrong("still-moving", &then(&["open latch shaker"]));
    let transfer = "transfer 30 uL from plate[A1] to plate[A2] by robot.left using tips { tips: once }";
    wrong("still-moving", &then(&[transfer]));
    let rest = ["stop shaking shaker", transfer, "open latch shaker", "place plate on robot.slot[3] by arm"];
    clean("latch", &then(&rest));
}

#[test]
fn devices_keep_to_their_limits() {
    wrong("out-of-range", &["spin spinner at 14000 rpm using 1 min"]);
    wrong("out-of-range", &["close latch shaker", "shake shaker at 100 rpm"]);
    wrong("out-of-range", &["heat shaker to 30 degC"]);
    wrong("out-of-range", &["stir hotplate at 2000 rpm"]);
    wrong(
        "unbalanced-rotor",
        &["open lid spinner", "pick vial by arm", "close lid spinner", "spin spinner at 5000 rpm"],
    );
    clean("limits", &["spin spinner at 13400 rpm", "stop spinning spinner", "heat shaker to 37 degC"]);
}

#[test]
fn a_cap_is_on_to_spin_and_off_to_pipette() {
    let reach = ["open lid spinner", "pick vial by arm", "place vial on table by arm"];
    let transfer = "transfer 50 uL from vial to plate[A2] by robot.left using tips { tips: once }";
    let then = |more: &[&'static str]| [&reach[..], more].concat();
    wrong("capped", &then(&[transfer]));
    clean("uncapped", &then(&["uncap vial by arm", transfer, "cap vial"]));
    wrong("lid-closed", &["uncap vial", transfer]);
    wrong("uncapped", &["uncap vial", "spin spinner at 5000 rpm using 1 min"]);
    wrong("closed-vessel-heated", &["heat hotplate to 120 degC"]);
    let doubled = bench("", &["cap vial"]);
    assert_eq!(findings("doubled", &doubled), [("no-effect".into(), "warning".into(), FIRST)]);
}

#[test]
fn an_arm_holds_one_thing_and_puts_it_where_there_is_room() {
    wrong("hand-full", &["pick cup by arm", "pick mug by arm"]);
    wrong("hand-full", &["pick cup by arm", "uncap jar by arm"]);
    wrong("not-in-hand", &["put back cup by arm"]);
    wrong("occupied", &["place cup on hotplate by arm"]);
    clean("hand", &["pick cup by arm", "put back cup by arm", "pick mug by arm", "place mug on table by arm"]);
}

#[test]
fn two_things_do_not_start_on_one_place() {
    let text = bench("", &["wait 1 s"])
        .replace("shaker = HeaterShaker on robot.slot[7]", "shaker = HeaterShaker on robot.slot[2]");
    assert_eq!(findings("start", &text), [("occupied".into(), "error".into(), 20)]);
}

#[test]
fn what_was_never_started_is_not_stopped() {
    wrong("never-started", &["heat hotplate to 60 degC", "stop stirring hotplate"]);
    wrong("never-started", &["stop heating oven"]);
    wrong("never-started", &["stop shaking shaker"]);
    wrong("never-started", &["stop spinning spinner"]);
    clean("stopped_twice", &["stir hotplate at 100 rpm", "stop stirring hotplate", "stop stirring hotplate"]);
    clean("on_some_ways", &["if hotplate.weight > 1 g { stir hotplate at 100 rpm }", "stop stirring hotplate"]);
    let text = bench("", &["heat hotplate to 60 degC"]);
    let text = text.trim_end().to_string() + " finally { stop heating hotplate; stop stirring hotplate }\n";
    assert_eq!(findings("finally", &text), []);
}

#[test]
fn what_is_gone_stays_gone() {
    let transfer = "transfer 30 uL from plate[A1] to plate[A2] by robot.left using tips { tips: once }";
    let gone = "used-after-disposal";
    wrong(gone, &["dispose cup into bin", "pick cup by arm"]);
    wrong(gone, &["dispose plate into bin by arm", transfer]);
    wrong(gone, &["dispose jar into bin", "uncap jar"]);
    wrong(gone, &["dispose tips into bin", transfer]);
    wrong("disposed-twice", &["dispose cup into bin by arm", "dispose cup into bin"]);
    wrong("in-hand", &["pick cup by arm", "dispose cup into bin"]);
    clean("gone", &[transfer, "dispose plate into bin by arm", "pick cup by arm", "dispose cup into bin by arm"]);
    let on_one_way = ["if hotplate.weight > 1 g { dispose plate into bin }", transfer];
    wrong(gone, &on_one_way);
    let with_a_value = bench("(bad: Ratio = 0)", &["if bad > 0.5 { dispose plate into bin }", transfer]);
    assert_eq!(findings("value", &with_a_value), [(gone.into(), "error".into(), FIRST + 1)]);
    let either = ["if bad > 0.5 { dispose plate into bin }", "if bad <= 0.5 { wait 1 s", transfer, "}"];
    assert_eq!(findings("either", &bench("(bad: Ratio = 0)", &either)), []);
}

#[test]
fn a_command_of_ones_own_goes_by_its_device() {
    let text = "mtx 1
capability Jar { state top: on | off = on
    command uncap
        effect top = off
}
asset Pot: Jar
lab bench { ambient: 22 degC, pot = Pot }
workflow run in bench { uncap pot }
";
    assert_eq!(findings("own", text), []);
}

#[test]
fn only_commands_presume() {
    let text = "mtx 1
skill rest(t: Duration) presumes t > 0 s { wait t }
lab bench { ambient: 22 degC }
workflow run in bench { rest 1 s }
";
    let codes: Vec<_> = findings("misplaced", text).into_iter().map(|f| f.0).collect();
    assert_eq!(codes.first().map(String::as_str), Some("misplaced"));
}

#[test]
fn a_run_that_leaves_something_on_does_not_pass() {
    let text = "mtx 1\nuse std::heating::IkaRetControl\n\
        lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }\n\
        workflow w in bench {\n    heat plate to 30 degC\n    wait 1 s\n}\n";
    let path = write(&folder("devices_left_on"), "bench.mtx", text);
    let ended = matterixc(&["run", &path, "--format", "json"]);
    let found = ended.err_lines();
    let last = found.last().expect("a finding");
    assert_eq!((ended.code, &last["code"], &last["severity"]), (1, &"unfinished".into(), &"error".into()));
    assert_eq!(last["span"]["start"]["line"], 5);
    let mended = text.replace("wait 1 s\n}", "wait 1 s\n} finally { stop heating plate }");
    let path = write(&folder("devices_switched_off"), "bench.mtx", mended);
    assert_eq!(matterixc(&["run", &path]).code, 0);
}
