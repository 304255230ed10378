//! A species name as written, taken apart: `SO4^2-`, `Ca2+`, `KNO3(s)`.

use super::elements::Element;

/// The phase that a name states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// `(s)`
    Solid,
    /// `(l)`
    Liquid,
    /// `(g)`
    Gas,
    /// `(aq)`
    Aqueous,
}

impl Phase {
    /// All phases with their suffix.
    const SUFFIXES: [(&'static str, Phase); 4] =
        [("(s)", Phase::Solid), ("(l)", Phase::Liquid), ("(g)", Phase::Gas), ("(aq)", Phase::Aqueous)];

    /// `(s)`, `(l)`, `(g)` or `(aq)`.
    pub fn suffix(self) -> &'static str {
        match self {
            Phase::Solid => "(s)",
            Phase::Liquid => "(l)",
            Phase::Gas => "(g)",
            Phase::Aqueous => "(aq)",
        }
    }

    /// The text before a phase suffix and the phase.
    pub fn split(text: &str) -> (&str, Option<Phase>) {
        Phase::SUFFIXES
            .iter()
            .find_map(|(suffix, phase)| text.strip_suffix(suffix).map(|rest| (rest, Some(*phase))))
            .filter(|(rest, _)| !rest.is_empty())
            .unwrap_or((text, None))
    }
}

/// The parts of a species name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpeciesName<'a> {
    /// What remains: `SO4`, `Ca`, `KNO3`, `acetate`.
    pub base: &'a str,
    /// In elementary charges.
    pub charge: i32,
    /// Absent where none is written.
    pub phase: Option<Phase>,
}

impl<'a> SpeciesName<'a> {
    /// Takes a name apart. A text without charge or phase is its own base; nothing is rejected.
    pub fn split(text: &'a str) -> SpeciesName<'a> {
        let (rest, phase) = Phase::split(text);
        let (base, charge) = split_charge(rest);
        SpeciesName { base, charge, phase }
    }
}

/// The text before a charge and the charge.
///
/// After `^` digits are the charge. Without it they are the charge of a single element (`Ca2+`, `O2-`) unless it is
/// hydrogen or a halogen, whose ions carry one charge (`I3-`, `H2+`); everywhere else they count atoms (`NH4+`, `NO3-`).
pub(crate) fn split_charge(text: &str) -> (&str, i32) {
    let Some((body, sign)) =
        text.strip_suffix('+').map(|b| (b, 1)).or_else(|| text.strip_suffix(['-', '\u{2212}']).map(|b| (b, -1)))
    else {
        return (text, 0);
    };
    let before = body.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &body[before.len()..];
    let marked = before.strip_suffix('^');
    let base = marked.unwrap_or(before);
    if base.is_empty() {
        return (text, 0);
    }
    let charge = if digits.is_empty() { Some(1) } else { digits.parse::<i32>().ok().filter(|c| (1..=999).contains(c)) };
    match (marked, charge) {
        (Some(_), Some(charge)) => (base, sign * charge),
        (Some(_), None) => (text, 0),
        (None, Some(charge)) if carries_many_charges(before) => (before, sign * charge),
        (None, _) => (body, sign),
    }
}

fn carries_many_charges(symbol: &str) -> bool {
    Element::from_symbol(symbol).is_some_and(|element| !element.forms_single_charges())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(text: &str) -> (&str, i32, Option<Phase>) {
        let name = SpeciesName::split(text);
        (name.base, name.charge, name.phase)
    }

    #[test]
    fn names_are_taken_apart() {
        assert_eq!(parts("SO4^2-"), ("SO4", -2, None));
        assert_eq!(parts("I-"), ("I", -1, None));
        assert_eq!(parts("Ca2+"), ("Ca", 2, None));
        assert_eq!(parts("KNO3(s)"), ("KNO3", 0, Some(Phase::Solid)));
        assert_eq!(parts("Cl-(aq)"), ("Cl", -1, Some(Phase::Aqueous)));
        assert_eq!(parts("H2O(l)"), ("H2O", 0, Some(Phase::Liquid)));
        assert_eq!(parts("CO2(g)"), ("CO2", 0, Some(Phase::Gas)));
        assert_eq!(parts("EtOH"), ("EtOH", 0, None));
        assert_eq!(parts("acetate-"), ("acetate", -1, None));
    }

    #[test]
    fn digits_before_the_sign() {
        assert_eq!(parts("NH4+"), ("NH4", 1, None));
        assert_eq!(parts("H3O+"), ("H3O", 1, None));
        assert_eq!(parts("NO3-"), ("NO3", -1, None));
        assert_eq!(parts("I3-"), ("I3", -1, None));
        assert_eq!(parts("O2-"), ("O", -2, None));
        assert_eq!(parts("O2^-"), ("O2", -1, None));
        assert_eq!(parts("Hg2^2+"), ("Hg2", 2, None));
        assert_eq!(parts("Fe3+"), ("Fe", 3, None));
        assert_eq!(parts("Fe(CN)6^3-"), ("Fe(CN)6", -3, None));
    }

    #[test]
    fn what_is_no_charge_stays_in_the_base() {
        for text in ["", "+", "-", "2+", "^2-", "(s)", "a^0-", "x^99999999999-"] {
            assert_eq!(parts(text), (text, 0, None));
        }
    }
}
