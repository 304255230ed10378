//! Whether amounts are those at equilibrium, judged by the equations alone.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::equilibrium::{Layout, Part, Phase, System};

use super::sketch::LN_10;

/// By how much a solution is off.
#[derive(Clone, Copy, Default)]
pub struct Gaps {
    /// The logarithm of a product of activities against that of its constant.
    pub equations: f64,
    /// Atoms of an element, as a share of all of it.
    pub atoms: f64,
    /// Charge, as a share of all charges.
    pub charge: f64,
}

/// By element, how many atoms of it a member has. `Ac` counts as an element.
pub fn elements(system: &System) -> Vec<Vec<f64>> {
    let all: Vec<BTreeMap<String, f64>> = system.members().iter().map(|m| atoms(&m.name)).collect();
    let names: BTreeSet<&String> = all.iter().flat_map(BTreeMap::keys).collect();
    names.into_iter().map(|name| all.iter().map(|has| has.get(name).copied().unwrap_or(0.0)).collect()).collect()
}

/// The atoms of a formula such as `Ag(NH3)2+`.
fn atoms(formula: &str) -> BTreeMap<String, f64> {
    let formula = if formula == "water" { "H2O" } else { formula.trim_end_matches("(s)").trim_end_matches(['+', '-']) };
    let letters: Vec<char> = formula.chars().collect();
    let mut open = vec![BTreeMap::new()];
    let mut at = 0;
    while let Some(letter) = letters.get(at) {
        at += 1;
        let mut found = BTreeMap::new();
        match letter {
            '(' => {
                open.push(BTreeMap::new());
                continue;
            }
            ')' => found = open.pop().unwrap_or_default(),
            letter => {
                let small: String = letters[at..].iter().take_while(|c| c.is_ascii_lowercase()).collect();
                at += small.len();
                found.insert(format!("{letter}{small}"), 1.0);
            }
        }
        let digits: String = letters[at..].iter().take_while(|c| c.is_ascii_digit()).collect();
        at += digits.len();
        let count = digits.parse().unwrap_or(1.0);
        if let Some(into) = open.last_mut() {
            found.into_iter().for_each(|(name, n)| *into.entry(name).or_insert(0.0) += count * n);
        }
    }
    open.pop().unwrap_or_default()
}

/// By how much the solution of a system is off; none where there is none. An amount below a share `trace` of the solvent is none.
pub fn gaps(system: &System, args: &[f64], elements: &[Vec<f64>], trace: f64) -> Option<Gaps> {
    let layout = system.layout();
    let members = system.members();
    let part = |part| Some(system.value(part, args)).filter(|v: &f64| v.is_finite());
    let temperature = part(Part::Temperature)?;
    let amounts: Vec<f64> = (0..members.len()).map(|i| part(Part::Amount(i as u32))).collect::<Option<_>>()?;
    let given = |i: usize| args[layout.amount(i)];
    let mass = amounts[0] * 0.018_015;
    let solutes = || (0..members.len()).filter(|i| members[*i].phase == Phase::Solute);
    let charge = |i: usize| members[i].charge;
    let strength: f64 = solutes().map(|i| 0.5 * charge(i) * charge(i) * amounts[i]).sum::<f64>() / mass;
    let molality: f64 = solutes().map(|i| amounts[i]).sum::<f64>() / mass;
    let t = temperature - 298.15;
    let a = args[0] + args[1] * t + args[2] * t * t;
    let felt = strength.min(args[Layout::ACTIVITIES - 2]);
    let activity = |i: usize| {
        let root = felt.sqrt();
        let own = match charge(i) {
            0.0 => 0.1 * felt,
            z => -a * z * z * (root / (1.0 + root) - 0.3 * felt),
        };
        match members[i].phase {
            Phase::Solvent => -args[Layout::ACTIVITIES - 1] * molality,
            Phase::Solid => 0.0,
            Phase::Formal => system.value(Part::Activity(i as u32), args),
            Phase::Solute => (amounts[i] / mass).ln() + LN_10 * own,
            Phase::Extracted => {
                let before = members[..i].iter().filter(|m| m.phase == Phase::Extracted).count();
                (amounts[i] / args[layout.liquid(before)]).ln()
            }
        }
    };
    let mut found = Gaps::default();
    for (r, equation) in system.equations().iter().enumerate() {
        let involved: Vec<usize> = (0..members.len()).filter(|i| equation.coefficients[*i] != 0.0).collect();
        let k = args[layout.constant(r)] + args[layout.constant(r) + 1] / temperature;
        let product: f64 = involved.iter().map(|i| equation.coefficients[*i] * activity(*i)).sum();
        let is_solid = |i: &&usize| members[**i].phase == Phase::Solid;
        let absent: Vec<usize> = involved
            .iter()
            .copied()
            .filter(|i| amounts[*i] <= trace * amounts[0] && members[*i].phase != Phase::Formal)
            .collect();
        let off = match absent.as_slice() {
            [] => (product - k).abs(),
            // A solid that is not there would dissolve: the product of its ions does not exceed its constant.
            [one] if involved.iter().find(is_solid) == Some(one) => {
                (k - product) * equation.coefficients[*one].signum()
            }
            _ => 0.0,
        };
        found.equations = found.equations.max(off);
    }
    for element in elements {
        let sum = |of: &dyn Fn(usize) -> f64| element.iter().enumerate().map(|(i, by)| by * of(i)).sum::<f64>();
        let (there, all) = (sum(&|i| amounts[i]), sum(&given));
        if all > 0.0 {
            found.atoms = found.atoms.max((there - all).abs() / all);
        }
    }
    let all: f64 = (0..members.len()).map(|i| (charge(i) * amounts[i]).abs().max((charge(i) * given(i)).abs())).sum();
    if all > 0.0 {
        let sum: f64 = (0..members.len()).map(|i| charge(i) * (amounts[i] - given(i))).sum();
        found.charge = sum.abs() / all;
    }
    Some(found)
}
