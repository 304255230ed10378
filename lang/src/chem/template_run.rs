//! Running a template on arrangements of reactants; only the structure crate's outcomes, no judgement.

use std::collections::BTreeMap;

use chematic::core::Molecule;
use chematic::rxn::{
    RdkitProfileOutcome, ReactionTransformLimits, RxnError, TransformError, run_reactants_traced_rdkit_2026_03_6,
    run_reactants_with_limits,
};
use chematic::smiles::{rdkit_added_hs_molecule, rdkit_hydrogen_suppressed};

use super::structure::{Structure, guarded};
use super::template::TemplateError;

/// Every distinct set of products, by their sorted canonical SMILES.
pub(crate) type Outcomes = BTreeMap<Vec<String>, Vec<Structure>>;

/// Most molecules on the left side of a template.
const MAX_SLOTS: usize = 8;
/// Most ways to give the reactants to the left side.
const MAX_ARRANGEMENTS: usize = 2_000;
/// Most ways to match one arrangement.
const LIMITS: ReactionTransformLimits = ReactionTransformLimits { max_matches: 2_000 };
/// Most bytes of a template.
const MAX_LENGTH: usize = 2_000;

/// How many molecules the left side of a template has, 1 or more.
pub(crate) fn slots(template: &str) -> Result<usize, TemplateError> {
    if template.len() > MAX_LENGTH {
        return Err(TemplateError::Unsupported);
    }
    if let Some((offset, c)) = template.char_indices().find(|(_, c)| !c.is_ascii_graphic()) {
        let detail = format!("unexpected character '{}'", c.escape_default());
        return Err(TemplateError::Unreadable { detail, offset: Some(offset) });
    }
    // Without reactants the crate reads the template and then says how many it wants.
    match guarded(|| run_reactants_traced_rdkit_2026_03_6(template, &[], &LIMITS)) {
        Some(Err(TransformError::ReactantCountMismatch { expected, .. })) if (1..=MAX_SLOTS).contains(&expected) => {
            Ok(expected)
        }
        Some(Err(TransformError::ReactantCountMismatch { expected, .. })) => {
            Err(TemplateError::ReactantCount(expected))
        }
        Some(Err(TransformError::SmirksParse(error))) => Err(unreadable(template, &error)),
        Some(Ok(_)) => Err(TemplateError::ReactantCount(0)),
        Some(Err(TransformError::ResourceLimit { .. })) | None => Err(TemplateError::Unsupported),
    }
}

/// Runs a template on every arrangement of `stock`, each structure used at most as often as stated. With implicit
/// hydrogens first; where that matches nothing and the template writes hydrogen atoms, with all hydrogens written.
pub(crate) fn outcomes(template: &str, slots: usize, stock: &[(&Structure, usize)]) -> Result<Outcomes, TemplateError> {
    let arrangements = arrangements(slots, &stock.iter().map(|(_, times)| *times).collect::<Vec<_>>())?;
    let run = || {
        let implicit: Vec<Molecule> = stock
            .iter()
            .map(|(s, _)| rdkit_hydrogen_suppressed(&s.molecule).unwrap_or_else(|| s.molecule.clone()))
            .collect();
        match outcomes_of(template, &arrangements, &implicit) {
            Err(TemplateError::NoMatch) if template.contains("[H") => {
                let explicit: Vec<Molecule> =
                    implicit.iter().map(|m| rdkit_added_hs_molecule(m).unwrap_or_else(|| m.clone())).collect();
                outcomes_of(template, &arrangements, &explicit)
            }
            found => found,
        }
    };
    guarded(run).unwrap_or(Err(TemplateError::Unsupported))
}

/// All sequences of `slots` indices in which index `i` stands at most `times[i]` times.
fn arrangements(slots: usize, times: &[usize]) -> Result<Vec<Vec<usize>>, TemplateError> {
    let mut found: Vec<Vec<usize>> = vec![vec![]];
    for _ in 0..slots {
        let longer = |start: &Vec<usize>| -> Vec<Vec<usize>> {
            let fits = |i: &usize| start.iter().filter(|used| *used == i).count() < times[*i];
            (0..times.len()).filter(fits).map(|i| [start.as_slice(), &[i]].concat()).collect()
        };
        found = found.iter().flat_map(longer).collect();
        if found.len() > MAX_ARRANGEMENTS {
            return Err(TemplateError::Unsupported);
        }
    }
    Ok(found)
}

fn outcomes_of(template: &str, arrangements: &[Vec<usize>], molecules: &[Molecule]) -> Result<Outcomes, TemplateError> {
    let mut outcomes = Outcomes::new();
    let mut rejected = false;
    for arrangement in arrangements {
        let reactants: Vec<&Molecule> = arrangement.iter().map(|i| &molecules[*i]).collect();
        let (sets, some_rejected) = run(template, &reactants)?;
        rejected |= some_rejected;
        for set in sets {
            let read: Result<Vec<Structure>, _> = set.into_iter().map(Structure::made).collect();
            let Ok(mut structures) = read else {
                rejected = true;
                continue;
            };
            structures.sort_by(|a, b| a.canonical.cmp(&b.canonical));
            outcomes.insert(structures.iter().map(|s| s.canonical.clone()).collect(), structures);
        }
    }
    match outcomes.is_empty() {
        false => Ok(outcomes),
        true if rejected => Err(TemplateError::Impossible),
        true => Err(TemplateError::NoMatch),
    }
}

/// The product sets of one arrangement, and whether some were dropped for an impossible valence.
fn run(template: &str, reactants: &[&Molecule]) -> Result<(Vec<Vec<Molecule>>, bool), TemplateError> {
    match run_reactants_traced_rdkit_2026_03_6(template, reactants, &LIMITS).map_err(|e| failed(template, e))? {
        RdkitProfileOutcome::Report(report) => {
            let sets = report.products.into_iter().map(|set| set.into_iter().map(|p| p.molecule).collect()).collect();
            Ok((sets, report.diagnostics.valence_rejected_matches > 0))
        }
        RdkitProfileOutcome::Unsupported(_) => {
            let sets = run_reactants_with_limits(template, reactants, &LIMITS).map_err(|e| failed(template, e))?;
            Ok((sets, false))
        }
    }
}

fn failed(template: &str, error: TransformError) -> TemplateError {
    match error {
        TransformError::SmirksParse(error) => unreadable(template, &error),
        TransformError::ResourceLimit { .. } | TransformError::ReactantCountMismatch { .. } => {
            TemplateError::Unsupported
        }
    }
}

fn unreadable(template: &str, error: &RxnError) -> TemplateError {
    let boundary = |c: Option<u8>| matches!(c, None | Some(b'.' | b'>'));
    let place = |part: &str| {
        let bytes = template.as_bytes();
        let alone = |start: &usize| {
            boundary(start.checked_sub(1).map(|i| bytes[i])) && boundary(bytes.get(start + part.len()).copied())
        };
        template.match_indices(part).map(|(start, _)| start).find(alone).or_else(|| template.find(part))
    };
    let (detail, offset) = match error {
        RxnError::MissingArrow => ("a template must have the form `reactants>>products`".to_string(), None),
        RxnError::SmilesParse { part, source } | RxnError::SmartsParse { part, source } => {
            let (detail, position) = without_position(source);
            (detail, place(part).map(|start| (start + position).min(template.len())))
        }
        RxnError::UnsupportedReactantTemplate { part, reason } => (reason.to_string(), place(part)),
        RxnError::UnsupportedAtomicNumberPrimitive { primitive }
        | RxnError::UnsupportedProductPrimitive { primitive } => {
            (format!("`{primitive}` is not allowed here"), place(primitive))
        }
        RxnError::ResourceLimit { .. } | RxnError::AtomicNumberExpansionLimit { .. } => ("too large".into(), None),
    };
    TemplateError::Unreadable { detail, offset }
}

/// The reader's message without ` at position N` and what follows in parentheses, and that position.
fn without_position(message: &str) -> (String, usize) {
    let message = message.split(" (as SMILES").next().unwrap_or(message);
    let Some((before, after)) = message.split_once(" at position ") else { return (message.to_string(), 0) };
    let rest = after.trim_start_matches(|c: char| c.is_ascii_digit());
    let position = after[..after.len() - rest.len()].parse().unwrap_or(0);
    (format!("{before}{rest}"), position)
}
