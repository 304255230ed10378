//! Corrections that findings offer, made in the text.

use matterix_ir::{Diagnostic, Edit, FileId, Fix, Sources, Span};
use matterix_runtime::motion::Store;

use super::{Advice, Input, check};
use crate::args::Fidelity;

/// Looks at a text at most: a correction may bring the next mistake to light, and none should go round in a ring.
const ROUNDS: usize = 20;

/// Which corrections are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Fixes {
    /// Those that leave no doubt what was meant.
    Sure,
    /// What was probably meant as well: names that are near, brackets. To be read afterwards. Where only a person can choose between
    /// corrections, as between a label and its recipe, none is made.
    All,
}

/// A correction that was made, and where: line and column as they were then.
pub struct Mended {
    /// Line and column, from 1.
    pub at: (usize, usize),
    /// What was done.
    pub title: String,
}

/// A file after its corrections.
pub struct Mending {
    /// With the text as it is now.
    pub input: Input,
    /// What was done, in this order.
    pub done: Vec<Mended>,
    /// The texts that findings are in.
    pub sources: Sources,
    /// What is still found.
    pub found: Vec<Diagnostic>,
}

/// Makes corrections until none is left.
pub fn mend(mut input: Input, which: Fixes, fidelity: Fidelity, store: &dyn Store) -> Mending {
    let mut done = Vec::new();
    let (mut sources, mut found) = check(&input, fidelity, Advice::Given, store);
    for _ in 0..ROUNDS {
        let chosen = choose(&found, which, FileId(0));
        if chosen.is_empty() {
            break;
        }
        let Ok(text) = std::str::from_utf8(&input.bytes) else { break };
        let mended = apply(text, chosen.iter().flat_map(|fix| &fix.edits));
        done.extend(chosen.iter().map(|fix| of(fix, &sources)));
        input.bytes = mended.into_bytes();
        (sources, found) = check(&input, fidelity, Advice::Given, store);
    }
    Mending { input, done, sources, found }
}

/// The text of a file after these corrections of one check, and each with its place; `Err` says in words why they cannot
/// all be made.
pub fn correct(input: Input, sources: &Sources, fixes: &[&Fix]) -> Result<(Input, Vec<Mended>), String> {
    let text = std::str::from_utf8(&input.bytes).map_err(|_| "the file is not UTF-8 text".to_string())?;
    let mut taken: Vec<Span> = Vec::new();
    for fix in fixes {
        for edit in &fix.edits {
            if edit.span.file != FileId(0) {
                return Err(format!("`{}` changes another file", fix.title));
            }
            if !taken.iter().all(|t| apart(*t, edit.span)) {
                return Err(format!("`{}` overlaps another fix; apply them one after the other", fix.title));
            }
        }
        taken.extend(fix.edits.iter().map(|e| e.span));
    }
    let done = fixes.iter().map(|fix| of(fix, sources)).collect();
    let text = apply(text, fixes.iter().flat_map(|fix| &fix.edits));
    Ok((Input { bytes: text.into_bytes(), ..input }, done))
}

fn of(fix: &Fix, sources: &Sources) -> Mended {
    let first = fix.edits.iter().map(|e| e.span).min_by_key(|s| s.start).unwrap_or_default();
    Mended { at: sources.line_column(first), title: fix.title.clone() }
}

/// The first correction of each finding that has one and is in no other's way, by place.
fn choose(found: &[Diagnostic], which: Fixes, file: FileId) -> Vec<&Fix> {
    let mut by_place: Vec<&Diagnostic> = found.iter().collect();
    by_place.sort_by_key(|d| (d.span().start, d.span().end));
    let mut taken: Vec<Span> = Vec::new();
    let mut chosen = Vec::new();
    for diagnostic in by_place {
        let fix = match which {
            Fixes::Sure => diagnostic.sure_fix(),
            Fixes::All => diagnostic.likely_fix(),
        };
        let Some(fix) = fix else { continue };
        let here = fix.edits.iter().all(|e| e.span.file == file);
        let free = fix.edits.iter().all(|e| taken.iter().all(|t| apart(*t, e.span)));
        if here && free {
            taken.extend(fix.edits.iter().map(|e| e.span));
            chosen.push(fix);
        }
    }
    chosen
}

/// Whether two replacements leave each other alone; two at one place would come in no certain order.
fn apart(a: Span, b: Span) -> bool {
    a.end < b.start || b.end < a.start || (a.end == b.start || b.end == a.start) && !a.is_empty() && !b.is_empty()
}

/// A text with replacements that leave each other alone. New lines end as the others do.
fn apply<'e>(text: &str, edits: impl Iterator<Item = &'e Edit>) -> String {
    let returns = text.split_once('\n').is_some_and(|(line, _)| line.ends_with('\r'));
    let mut edits: Vec<&Edit> = edits.collect();
    edits.sort_by_key(|e| e.span.start);
    let mut out = String::with_capacity(text.len());
    let mut done = 0;
    for edit in edits {
        let (start, end) = (edit.span.start as usize, edit.span.end as usize);
        out += text.get(done..start).unwrap_or_default();
        match returns {
            true => out += &edit.text.replace('\n', "\r\n"),
            false => out += &edit.text,
        }
        done = end.max(done);
    }
    out + text.get(done..).unwrap_or_default()
}
