//! Species by other names in `m.amount[S]` and `m[S]`: parameters of laws, functions, things, skills and workflows, members, constants.

use crate::harness::{flat, folder, matterixc, write};

fn checked(name: &str, text: &str) -> (i32, String) {
    let file = write(&folder(&format!("named_species_{name}")), "w.mtx", text);
    let ended = matterixc(&["check", &file]);
    (ended.code, flat(&format!("{}{}", ended.out, ended.err)))
}

/// A text without findings, of which every `expect` holds.
#[track_caller]
fn holds(name: &str, text: &str) {
    let (code, said) = checked(name, text);
    assert!(code == 0 && said.contains("no findings"), "{name}: {said}");
    let file = write(&folder(&format!("named_species_{name}_run")), "w.mtx", text);
    let ran = matterixc(&["run", &file]);
    assert_eq!(ran.code, 0, "{name}: {}{}", ran.out, ran.err);
}

#[test]
fn the_parameter_of_a_law_names_a_species() {
    let text = "mtx 1
use std::glassware::Beaker250mL
fn held_of(m: Mixture, s: Species) -> Amount = m.amount[s]
capability Losing: Container { param slow: Bool = true }
asset Pot: Beaker250mL, Losing {}
caution much_of_one(m: Mixture, s: Species) of m.temperature when m.amount[s] > 1 kmol and m[s] > 1 mol/kg
    \"take less\"
process fading(m: Mixture, s: Species) while s == EtOH and m.amount[s] > 0 mol {
    let q = 0.01 1/s * m.amount[s]
    m.amount[s]' -= q
    m.amount[methoxymethane]' += q
}
species methoxymethane { formula: \"C2H6O\", density: 0.789 g/mL, heat_capacity: 112.3 J/(mol*K) }
lab bench { ambient: 25 degC, pot = Pot at (0, 0, 0) m holding 100 g of water + 10 mmol of EtOH }
workflow w in bench {
    wait 100 s
    expect pot.contents.amount[EtOH] in 3.67 mmol .. 3.69 mmol and held_of(pot.contents, EtOH) == pot.contents.amount[EtOH]
    expect pot.contents.amount[methoxymethane] in 6.31 mmol .. 6.33 mmol
}
";
    holds("law", text);
}

#[test]
fn a_member_names_a_species() {
    let text = "mtx 1
use std::glassware::Beaker250mL
const analyte = EtOH
/// A probe that sees one substance.
capability Probe {
    param probes: Container
    param sees: Species
    reading seen: Amount = probes.contents.amount[sees] { unit: \"mmol\" }
    derived same: Amount = probes.contents.amount[self.sees]
    derived content: AmountPerMass = probes.contents[sees]
    state dose: Amount = 0 mol
    command pulse
        effect dose = probes.contents.amount[sees]
}
asset AlcoholProbe: Probe { sees: EtOH }
asset AnyProbe: Probe {}
skill look(s: Species) at(v: Container) -> Amount { return v.contents.amount[s] }
lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + 10 mmol of EtOH + 20 mmol of acetone
    first = AlcoholProbe { probes: cup }
    second = AnyProbe { probes: cup, sees: acetone }
}
workflow w(s: Species = acetone) in bench {
    pulse second
    let found <- look acetone at cup
    expect first.seen in 9.9 mmol .. 10.1 mmol and second.seen in 19.9 mmol .. 20.1 mmol and first.same == 10 mmol
    expect second.dose == 20 mmol and found == 20 mmol and cup.contents.amount[analyte] == 10 mmol
    expect cup.contents.amount[s] == 20 mmol and cup.contents.amount[first.sees] == 10 mmol
    expect first.content in 0.09 mol/kg .. 0.1 mol/kg
}
";
    holds("member", text);
}

#[test]
fn what_is_no_species_is_called_by_what_it_is() {
    let text = |index: &str| {
        format!(
            "mtx 1
use std::glassware::Beaker250mL
capability Probe {{
    param probes: Container
    param sees: Species
    param limit: Amount = 1 mol
}}
asset AnyProbe: Probe {{ sees: EtOH }}
lab bench {{ ambient: 25 degC, cup = Beaker250mL at (0, 0, 0) m holding 1 g of water, probe = AnyProbe {{ probes: cup }} }}
workflow w(t: Temperature = 25 degC) in bench {{ wait 1 s; expect cup.contents.amount[{index}] >= 0 mol }}
"
        )
    };
    for (name, index, wanted) in [
        ("quantity", "t", "`t` is a point on a scale, not a species"),
        ("thing", "cup", "`cup` is an instance, not a species"),
        ("member", "probe.limit", "expected a species, found a quantity"),
        ("unknown", "ethnol", "unknown species `ethnol`"),
    ] {
        let (code, said) = checked(name, &text(index));
        assert!(code == 1 && said.contains(wanted), "{name}: {said}");
    }
}

#[test]
fn an_ion_stands_wherever_a_value_may() {
    let text = "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
fn total(m: Mixture) -> Amount = sum(s in [Cl-, Na+]: m.amount[s])
fn same_total(m: Mixture) -> Amount = sum(s in m.species: choose(s == Cl- or s == Na+, m.amount[s], 0 mol))
fn is_counter_ion(s: Species) -> Bool = s == Cl-
fn heavier() -> Bool = SO4^2-.molar_mass > HSO4-.molar_mass - 2 * H+.molar_mass
lab bench { ambient: 25 degC, pot = Beaker250mL at (0, 0, 0) mm holding 100 g of water + 20 mmol of NaCl }
workflow w in bench {
    for s in [acetate, H+, OH-] { expect pot.contents.amount[s] < 1 mmol }
    for s in [
        Cl-,
        Na+
    ] {
        expect pot.contents.amount[s] in 19.9 mmol .. 20.1 mmol
    }
    expect total(pot.contents) in 39.9 mmol .. 40.1 mmol
    expect same_total(pot.contents) == total(pot.contents)
    expect is_counter_ion(Cl-) and not is_counter_ion(Na+) and heavier()
    let n = 3
    let m = n- 1
    expect m == 2 and n -1 == 2 and (n-1) == 2 and n^2-1 == 8
}
";
    holds("ion", text);
}
