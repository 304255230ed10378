//! Labware from the library: `matterixc labware`, and assets by the names of its definitions.

use serde_json::Value;

use crate::harness::{folder, matterixc, matterixc_in, write};

fn asked(args: &[&str]) -> String {
    let ended = matterixc(&[&["labware"], args].concat());
    assert_eq!((ended.code, ended.err.as_str()), (0, ""), "{args:?}");
    ended.out
}

/// One of each category, as it was read.
const PAGES: &[&str] = &[
    "biorad_96_wellplate_200ul_pcr
  title     Bio-Rad 96 Well Plate 200 µL PCR
  kind      WellPlate
  places    96 of 200 uL
  inside    by sections
  versions  1, 2, 3, 4 and 5
  to use it asset NAME from labware \"biorad_96_wellplate_200ul_pcr\"
",
    "axygen_1_reservoir_90ml
  title     Axygen 1 Well Reservoir 90 mL
  kind      Reservoir
  places    1 of 90 mL
  inside    by sections
  versions  1, 2 and 3
  to use it asset NAME from labware \"axygen_1_reservoir_90ml\"
",
    "opentrons_10_tuberack_falcon_4x50ml_6x15ml_conical
  title     Opentrons 10 Tube Rack with Falcon 4x50 mL, 6x15 mL Conical
  kind      TubeRack
  places    6 of 15 mL and 4 of 50 mL
  inside    by sections
  versions  1, 2 and 3
  to use it asset NAME from labware \"opentrons_10_tuberack_falcon_4x50ml_6x15ml_conical\"
",
    "geb_96_tiprack_10ul
  title     GEB 96 Tip Rack 10 µL
  kind      TipRack
  places    96 of 10 uL
  versions  1
  to use it asset NAME from labware \"geb_96_tiprack_10ul\"
",
    "opentrons_1_trash_850ml_fixed
  title     Opentrons Short Fixed Trash
  kind      Trash
  places    1 of 850 mL
  inside    straight, as wide as its opening
  versions  1
  to use it asset NAME from labware \"opentrons_1_trash_850ml_fixed\"
",
    "opentrons_24_aluminumblock_nest_2ml_snapcap
  title     Opentrons 24 Well Aluminum Block with NEST 2 mL Snapcap
  kind      AluminumBlock
  places    24 of 2 mL
  inside    by sections
  versions  1, 2 and 3
  to use it asset NAME from labware \"opentrons_24_aluminumblock_nest_2ml_snapcap\"
",
    "opentrons_96_pcr_adapter
  title     Opentrons 96 PCR Heater-Shaker Adapter
  kind      Adapter
  places    no places
  versions  1
  to use it asset NAME from labware \"opentrons_96_pcr_adapter\"
",
    "corning_96_wellplate_360ul_lid
  title     Corning 96 Wellplate 360ul Lid
  kind      Lid
  places    no places
  versions  1 and 2
  to use it asset NAME from labware \"corning_96_wellplate_360ul_lid\"
",
];

#[test]
fn a_name_has_a_page() {
    for page in PAGES {
        let name = page.lines().next().expect("a name");
        assert_eq!(asked(&[name]), *page);
    }
    // An older version has the sections of the newest; without any the bottom says how the inside is.
    let older = asked(&["opentrons/biorad_96_wellplate_200ul_pcr/1"]);
    assert!(older.contains("inside    by sections"), "{older}");
    let block = asked(&["opentrons_96_aluminumblock_biorad_wellplate_200ul"]);
    assert!(block.contains("inside    by its bottom and its volume: an estimate"), "{block}");
    let flat = asked(&["milliplex_r_96_well_microtiter_plate"]);
    assert!(flat.contains("straight, as wide as its opening"), "{flat}");
    assert!(older.ends_with("asset NAME from labware \"biorad_96_wellplate_200ul_pcr/1\"\n"), "{older}");
}

#[test]
fn words_are_looked_for_in_names_titles_and_kinds() {
    let all = asked(&[]);
    assert_eq!(all.lines().count(), 163);
    let lids = asked(&["Lid", "corning"]);
    assert!(lids.lines().count() >= 2 && lids.lines().all(|line| line.contains("Lid, no places")), "{lids}");
    let json: Value = serde_json::from_str(&asked(&["usascientific", "--format", "json"])).expect("JSON");
    let names: Vec<&str> = json.as_array().expect("a list").iter().filter_map(|one| one["name"].as_str()).collect();
    assert_eq!(names, ["usascientific_12_reservoir_22ml", "usascientific_96_wellplate_2.4ml_deep"]);
    assert_eq!(json[1]["places"], serde_json::json!([{ "count": 96, "volume": 2400.0 }]));
    for (words, help) in [
        (&["biorad_96_wellplate_200ul_pcl"][..], "did you mean `biorad_96_wellplate_200ul_pcr`"),
        (&["axygen_1_reservoir_90ml/7"], "it has version 1, 2 and 3"),
        (&["nothing", "of", "the", "sort"], "give words of a name"),
    ] {
        let ended = matterixc(&[&["labware"], words].concat());
        assert!(ended.code == 1 && ended.out.is_empty() && ended.err.contains(help), "{words:?}: {}", ended.err);
    }
}

#[test]
fn a_definition_is_printed_for_one_of_ones_own() {
    let dir = folder("labware_own");
    let text = asked(&["axygen_1_reservoir_90ml", "--format", "definition"]);
    write(&dir, "mine.json", text.replace("\"totalLiquidVolume\": 90000", "\"totalLiquidVolume\": 80000"));
    let bench = "mtx 1
asset Mine from labware \"mine.json\"
asset Theirs from labware \"axygen_1_reservoir_90ml\"
lab l {
    ambient: 22 degC
    mine = Mine at (0, 0, 0) m
    theirs = Theirs at (1, 0, 0) m
}
workflow w in l {
    expect mine[A1].max_volume in 79.99 mL .. 80.01 mL and theirs[A1].max_volume in 89.99 mL .. 90.01 mL
}
";
    write(&dir, "bench.mtx", bench);
    let ended = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

/// The only finding of a file with this asset.
fn finding(dir: &std::path::Path, labware: &str) -> Value {
    let text = format!(
        "mtx 1\nasset It from labware \"{labware}\"\nlab l {{\n    ambient: 22 degC\n    it = It at (0, 0, 0) m\n}}\n\
         workflow w in l {{ wait 1 s }}\n"
    );
    write(dir, "it.mtx", text);
    let ended = matterixc_in(dir, &["check", "it.mtx", "--format", "json"]);
    let lines: Vec<Value> = ended.out_lines().into_iter().filter(|line| line["code"] == "labware-file").collect();
    assert_eq!(lines.len(), 1, "{labware}: {}", ended.out);
    lines[0].clone()
}

#[test]
fn a_name_that_is_not_there_has_near_ones() {
    let dir = folder("labware_names");
    let misspelt = finding(&dir, "biorad_96_welplate_200ul_pcr");
    assert_eq!(misspelt["headline"], "the library has no labware definition `biorad_96_welplate_200ul_pcr`");
    assert!(misspelt["help"].to_string().contains("did you mean `biorad_96_wellplate_200ul_pcr`"), "{misspelt}");
    let ended = matterixc_in(&dir, &["check", "it.mtx", "--fix=all"]);
    let mended = std::fs::read_to_string(dir.join("it.mtx")).expect("the file");
    assert!(mended.contains("from labware \"biorad_96_wellplate_200ul_pcr\"\n"), "{mended}{}", ended.out);
    let version = finding(&dir, "biorad_96_wellplate_200ul_pcr/9");
    assert!(version["help"].to_string().contains("it has version 1, 2, 3, 4 and 5"), "{version}");
    let file = finding(&dir, "biorad_96_wellplate_200ul_pcr.json");
    assert!(file["headline"].as_str().is_some_and(|h| h.starts_with("cannot read")), "{file}");
    assert!(file["help"].to_string().contains("named without `.json`"), "{file}");
    // A file may be called anything.
    write(&dir, "mine", asked(&["axygen_1_reservoir_90ml", "--format", "definition"]));
    write(&dir, "it.mtx", "mtx 1\nasset It from labware \"mine\"\n");
    assert_eq!(matterixc_in(&dir, &["check", "it.mtx"]).code, 0);
}

const STACKS: &str = "mtx 1
use std::opentrons
asset PcrPlate from labware \"opentrons_96_wellplate_200ul_pcr_full_skirt\"
asset Block from labware \"opentrons_96_well_aluminum_block\"
asset Cover from labware \"opentrons_tough_universal_lid\"
asset Deep from labware \"nest_96_wellplate_2ml_deep\"
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P20Single { } } at (0, 0, 0) m
    tips = TipRack20 on ot2.slot[1]
    block = Block on ot2.slot[2]
    plate = PcrPlate on block holding { A1 .. A2: 100 uL of water }
    deep = Deep on ot2.slot[3] holding { A1: 1 mL of water }
    LID
}
";

#[test]
fn a_lid_keeps_pipettes_out() {
    let dir = folder("labware_lids");
    let steps = "workflow w in deck {
    pick up tip from tips by ot2.left
    aspirate 10 uL from plate[A1] by ot2.left
    dispense 10 uL into plate[A1] by ot2.left
    drop tip by ot2.left
}
";
    let bench = |lid: &str| format!("{}{steps}", STACKS.replace("LID", lid));
    for (lid, wanted) in [("", None), ("lid = Cover on plate", Some("under a closed lid"))] {
        write(&dir, "bench.mtx", bench(lid));
        let ended = matterixc_in(&dir, &["check", "bench.mtx"]);
        match wanted {
            None => assert_eq!(ended.code, 0, "{}", ended.out),
            Some(text) => assert!(ended.code == 1 && ended.out.contains(text), "{}", ended.out),
        }
    }
}

#[test]
fn labware_stands_on_labware_in_protocols() {
    let dir = folder("labware_stacks");
    let steps = "workflow w in deck {
    pick up tip from tips by ot2.left
    aspirate 10 uL from plate[A1] by ot2.left
    dispense 10 uL into plate[A2] by ot2.left
    drop tip by ot2.left
}
";
    write(&dir, "bench.mtx", format!("{}{steps}", STACKS.replace("LID", "")));
    let ended = matterixc_in(&dir, &["emit", "bench.mtx", "--target", "opentrons-python"]);
    assert!(
        ended.out.contains("plate = block.load_labware(\"opentrons_96_wellplate_200ul_pcr_full_skirt\""),
        "{}{}",
        ended.out,
        ended.err
    );
    assert!(
        ended.out.contains("block = protocol.load_adapter(\"opentrons_96_well_aluminum_block\", \"2\", namespace="),
        "{}",
        ended.out
    );
    let ended = matterixc_in(&dir, &["emit", "bench.mtx", "--target", "opentrons-json"]);
    let document: Value = serde_json::from_str(&ended.out).expect("JSON");
    let commands = document["commands"].as_array().expect("commands");
    let plate = commands.iter().find(|c| c["params"]["labwareId"] == "plate").expect("the plate");
    assert_eq!(plate["params"]["location"], serde_json::json!({ "labwareId": "block" }));
}

/// By hand from the sections of the definitions. Of the plate: a cap of 0.8 mm of a sphere of 1.25 mm, then a cone from 2.33 mm to 5.5 mm
/// across, up to 11.35 mm. Of the bath: 96 pyramids of 2 mm, which hold 6534 uL, under one of 106.8 x 70.6 to 107.3 x 71.3 mm.
#[test]
fn liquids_stand_as_high_as_the_inside_has_it() {
    let dir = folder("labware_heights");
    let steps = "workflow w in deck {
    expect standing_height(plate[A1], 100 uL) in 9.65 mm .. 9.73 mm
    expect standing_height(plate[A1], 20 uL) in 3.72 mm .. 3.79 mm
    expect standing_height(plate[A1], 0 uL) == 0 mm
    expect standing_height(plate[A1], 1 mL) in 14.94 mm .. 14.96 mm
    expect standing_height(bath[A1], 100 mL) in 14.3 mm .. 14.4 mm
}
";
    let lab = STACKS.replace("LID", "bath = Bath on ot2.slot[5]");
    let lab = lab.replace("lab deck", "asset Bath from labware \"nest_1_reservoir_195ml\"\nlab deck");
    write(&dir, "bench.mtx", format!("{lab}{steps}"));
    let ended = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

#[test]
fn modules_heat_wells_through_adapters_and_blocks_but_not_in_racks() {
    let dir = folder("labware_adapters");
    let text = "mtx 1
use std::opentrons
asset Flat from labware \"opentrons_universal_flat_adapter\"
asset Tubes from labware \"opentrons_24_aluminumblock_nest_2ml_screwcap\"
asset Rack from labware \"opentrons_24_tuberack_nest_2ml_screwcap\"
lab deck {
    ambient: 22 degC
    ot2 = OT2 at (0, 0, 0) m
    shaker = HeaterShaker on ot2.slot[1]
    HOLDER
}
workflow w in deck {
    close latch shaker
    heat shaker to 60 degC
    wait 40 min
    expect WELL.contents.temperature in 58 degC .. 60.5 degC
    stop heating shaker
}
";
    for (holder, well, cold) in [
        ("adapter = Flat on shaker, plate = Corning96 on adapter holding { A1: 100 uL of water }", "plate[A1]", false),
        ("block = Tubes on shaker holding { A1: 1 mL of water }", "block[A1]", false),
        ("rack = Rack on shaker holding { A1: 1 mL of water }", "rack[A1]", true),
    ] {
        write(&dir, "bench.mtx", text.replace("HOLDER", holder).replace("WELL", well));
        let checked = matterixc_in(&dir, &["check", "bench.mtx", "--no-cache"]);
        assert_eq!(checked.out.contains("wells-stay-cold"), cold, "{well}: {}", checked.out);
        let ran = matterixc_in(&dir, &["run", "bench.mtx"]);
        assert_eq!(ran.code, i32::from(cold), "{well}: {}{}", ran.out, ran.err);
    }
}
