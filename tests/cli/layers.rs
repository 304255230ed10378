//! A second liquid: what goes there, what is measured of each layer, and what is said where the model has no layers.

use crate::harness::{flat, folder, matterixc_in, write};

const IODINE: &str =
    "species I2_out { formula: \"I2\", dissolved_in: CHCl3, molar_volume: 50 mL/mol, heat_capacity: 54 J/(mol*K) }";

fn lab(before: &str, holding: &str, steps: &str) -> String {
    format!(
        "mtx 1\nuse std::equilibria\nuse std::glassware::Beaker250mL\n{before}
asset Cup: Beaker250mL {{ contents: {{ activities: ideal }} }}
lab bench {{ ambient: 25 degC, cup = Cup at (0, 0, 0) m holding {holding}, other = Cup at (1, 0, 0) m }}
workflow look in bench {{
    wait 1 s
{steps}}}\n"
    )
}

#[track_caller]
fn runs(name: &str, text: String) {
    let dir = folder(name);
    write(&dir, "cup.mtx", text);
    let ran = matterixc_in(&dir, &["run", "cup.mtx", "--no-cache"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn a_partition_constant_is_a_ratio_of_concentrations() {
    let written = |constant: &str| format!("{IODINE}\nequilibrium out: I2 <-> I2_out {{ {constant} }}");
    // 1.479 g/mL beside 0.997: 121 of concentrations are 81.6 of molalities.
    for constant in ["partition: 121", "log_p: 2.08278537", "constant: 81.567"] {
        let steps = "    expect (cup[I2_out] as mol/L) / (cup[I2] as mol/L) in 118 .. 123
    let out = cup.contents.amount[I2_out] / (20 mL * 1.479 g/mL)
    let left = cup.contents.amount[I2] / (cup.contents.amount[water] * 18.015 g/mol)
    expect out / left in 81.4 .. 81.8\n";
        runs("partition", lab(&written(constant), "100 mL of water + 20 mL of CHCl3 + 0.1 mmol of I2", steps));
    }
    let none = "    expect cup.contents.amount[I2] in 0.099999 mmol .. 0.100001 mmol\n";
    runs("partition_dry", lab(&written("partition: 121"), "100 mL of water + 0.1 mmol of I2", none));
}

#[test]
fn a_metal_goes_out_with_its_ligand_and_comes_back_with_acid() {
    let metal = "species HL_out { formula: \"C9H7NO\", dissolved_in: CHCl3, molar_volume: 120 mL/mol, heat_capacity: 170 J/(mol*K) }
species CuL2_out { formula: \"CuC18H12N2O2\", dissolved_in: CHCl3, molar_volume: 240 mL/mol, heat_capacity: 340 J/(mol*K) }
equilibrium extraction: Cu2+ + 2 HL_out <-> CuL2_out + 2 H+ { log_constant: 1.8, valid: 20 degC .. 30 degC }";
    // [CuL2] [H+]^2 / ([Cu] [HL]^2), by kilograms of each liquid.
    let steps = |least: f64, most: f64| {
        format!(
            "    let water_kg = cup.contents.amount[water] * 18.015 g/mol
    let kg = 50 mL * 1.479 g/mL
    let complex = cup.contents.amount[CuL2_out] / kg / (1 mol/kg)
    let ligand = cup.contents.amount[HL_out] / kg / (1 mol/kg)
    let metal = cup.contents.amount[Cu2+] / water_kg / (1 mol/kg)
    let acid = cup.contents.amount[H+] / water_kg / (1 mol/kg)
    expect complex * acid ^ 2 / (metal * ligand ^ 2) in 62.9 .. 63.3
    expect cup.contents.amount[CuL2_out] in {least} mmol .. {most} mmol\n"
        )
    };
    let holding =
        |acid: &str| format!("100 mL of water + 50 mL of CHCl3 + 1 mmol of CuSO4 + 10 mmol of HL_out + {acid} of HCl");
    runs("copper", lab(metal, &holding("1 mmol"), &steps(0.9, 1.0)));
    runs("copper_back", lab(metal, &holding("300 mmol"), &steps(0.0, 0.1)));
}

#[test]
fn layers_are_not_drawn_one_by_one() {
    let before = format!(
        "{IODINE}\nequilibrium out: I2 <-> I2_out {{ partition: 121 }}
extern skill tip(v: Volume) from(source: Vessel) into(target: Vessel)
    takes 1 s
    effect move(v, from: source, to: target)"
    );
    let poured = |volume: &str, text: &str| {
        let dir = folder("drawn");
        write(&dir, "cup.mtx", lab(&before, text, &format!("    tip {volume} from cup into other\n    wait 1 s\n")));
        flat(&matterixc_in(&dir, &["check", "cup.mtx"]).out)
    };
    let both = "100 mL of water + 20 mL of CHCl3 + 0.1 mmol of I2";
    let half = poured("60 mL", both);
    assert!(half.contains("holds two layers, and this takes 50 % of both") && !half.contains("more CHCl3"), "{half}");
    let water = poured("60 mL", "100 mL of water");
    assert!(water.contains("no findings"), "{water}");
}

#[test]
fn what_cannot_be_is_refused() {
    let dir = folder("layers_wrong");
    let cases = [
        ("species X { formula: \"I-\", dissolved_in: CHCl3 }", "ions stay in water"),
        ("species X { formula: \"I2\", dissolved_in: water }", "needs no `dissolved_in`"),
        ("species X { formula: \"I2\", dissolved_in: X }", "not a liquid"),
        ("species X { formula: \"I2\", dissolved_in: chlorofrom }", "chlorofrom"),
        ("equilibrium x: I2 <-> I2 { partition: 3 }", "`partition` needs the equation of one species"),
        (
            "species L { formula: \"C6H14\", heat_capacity: 200 J/(mol*K) }
species X { formula: \"I2\", dissolved_in: L }\nequilibrium x: I2 <-> X { partition: 3 }",
            "the density of `L` is not known",
        ),
    ];
    for (before, why) in cases {
        write(&dir, "cup.mtx", lab(before, "100 mL of water", ""));
        let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
        assert!(checked.code == 1 && flat(&checked.out).contains(why), "{before}: {}", checked.out);
    }
}

/// What is put in as dissolved in a liquid that is not there is in the water, as with the last trace of that liquid.
#[test]
fn without_its_liquid_a_species_goes_into_the_water() {
    let acid = "species HB { formula: \"C7H6O2\", molar_volume: 96 mL/mol, heat_capacity: 147 J/(mol*K) }
species HB_org { formula: \"C7H6O2\", dissolved_in: CHCl3, molar_volume: 96 mL/mol, heat_capacity: 147 J/(mol*K) }
species B- { formula: \"C7H5O2-\", molar_volume: 96 mL/mol, heat_capacity: 147 J/(mol*K) }
equilibrium extracts: HB <-> HB_org { partition: 10 }
equilibrium splits: HB <-> H+ + B- { pka: 4.2 }";
    let said = "expect acidity(cup.contents) in 2.74 .. 2.77; expect cup.contents.amount[HB_org] < 1 umol";
    runs("none", lab(acid, "100 g of water + 5 mmol of HB_org", said));
    runs("trace", lab(acid, "100 g of water + 1 ug of CHCl3 + 5 mmol of HB_org", said));
}
