//! One mistake, one message: findings that only follow from another one are left out.

use std::collections::BTreeSet;

use matterix_ir::{Diagnostic, FileId, Sources, codes};

/// Where a finding stands.
struct Place {
    file: FileId,
    line: usize,
    /// First and last line of the declaration around it: from one line without indentation to the next.
    block: (usize, usize),
}

/// Leaves out what follows from a syntax mistake, a misspelt name or a broken declaration.
pub fn without_consequences(diagnostics: Vec<Diagnostic>, sources: &Sources) -> Vec<Diagnostic> {
    if diagnostics.len() > MOST {
        return diagnostics;
    }
    let places: Vec<Place> = diagnostics.iter().map(|d| place(d, sources)).collect();
    let keep: Vec<bool> = (0..diagnostics.len()).map(|i| !follows(i, &diagnostics, &places, sources)).collect();
    diagnostics.into_iter().zip(keep).filter(|(_, keep)| *keep).map(|(d, _)| d).collect()
}

/// So many findings are not compared with each other: the first ones are what a reader mends.
const MOST: usize = 500;

fn place(d: &Diagnostic, sources: &Sources) -> Place {
    let span = d.span();
    let (line, _) = sources.line_column(span);
    let text = sources.get(span.file).map_or("", |s| s.text.as_str());
    let starts = |l: &&str| l.chars().next().is_some_and(|c| !c.is_whitespace() && c != '}' && c != '/');
    let lines: Vec<&str> = text.lines().collect();
    let at = line.min(lines.len());
    let first = (0..at).rev().find(|i| starts(&lines[*i])).map_or(1, |i| i + 1);
    let last = (at..lines.len()).find(|i| starts(&lines[*i])).unwrap_or(lines.len());
    Place { file: span.file, line, block: (first, last) }
}

fn follows(i: usize, all: &[Diagnostic], places: &[Place], sources: &Sources) -> bool {
    let (d, p) = (&all[i], &places[i]);
    let syntax = |e: &Diagnostic| e.code == codes::SYNTAX;
    let others = || all.iter().zip(places).filter(|(e, _)| e.is_error() && !std::ptr::eq(*e, d));
    // A line that could not be read means nothing.
    if !syntax(d) && others().any(|(e, q)| syntax(e) && q.file == p.file && q.line == p.line) {
        return true;
    }
    // What a step that could not be read would have done, and what a lab's line would have put there, nobody knows.
    let followed = matches!(
        d.code.family,
        "X0" | "K3" | "P1" | "V1" | "V2" | "V3" | "V4" | "D2" | "T1" | "T2" | "T3" | "F1" | "F4" | "C1"
    );
    let of_lab = |q: &Place| sources.get(q.file).and_then(|s| s.text.lines().nth(q.block.0.saturating_sub(1)));
    let of_lab = |q: &Place| of_lab(q).is_some_and(|line| line.starts_with("lab "));
    if followed && others().any(|(e, q)| syntax(e) && q.file == p.file && (q.block == p.block || of_lab(q))) {
        return true;
    }
    // Nor what a step would have done, or a thing would have been, whose name is not imported yet.
    if followed && others().any(|(e, q)| e.missing.is_some() && q.file == p.file) {
        return true;
    }
    // A thing of a lab whose line could not be read has nothing.
    if [codes::UNKNOWN_MEMBER, codes::TYPE_MISMATCH, codes::WRONG_DEVICE, codes::WRONG_KIND].contains(&d.code) {
        let used = words(line_text(sources, p));
        let declared = |q: &Place| line_text(sources, q).split([' ', ':', '=']).find(|word| !word.is_empty());
        let broken = |q: &Place| q.file == p.file && q.block != p.block && of_lab(q);
        if others().any(|(e, q)| syntax(e) && broken(q) && declared(q).is_some_and(|name| used.contains(name))) {
            return true;
        }
    }
    // What a broken or misspelt line would have said is missing elsewhere in its declaration.
    if d.code == codes::MISSING_FIELD || d.code == codes::MISSING_PROPERTY {
        let broken = |e: &Diagnostic| syntax(e) || e.code == codes::UNKNOWN_FIELD;
        return others().any(|(e, q)| broken(e) && q.file == p.file && (p.block.0..=p.block.1).contains(&q.line));
    }
    // Nobody knows what a definition declares that could not be read.
    if [codes::UNKNOWN_FIELD, codes::UNKNOWN_MEMBER, codes::UNKNOWN_VERB, codes::WRONG_DEVICE].contains(&d.code)
        && others().any(|(e, _)| e.code == codes::SILA_FILE)
    {
        return true;
    }
    // A name from a line above with a mistake of its own may be fine.
    if let Some(name) = &d.about {
        let names = |e: &Diagnostic| {
            let family = e.code.family;
            if d.code == codes::WRONG_ARGUMENTS { syntax(e) } else { family == "P0" || family == "N0" }
        };
        return others().any(|(e, q)| {
            names(e)
                && q.file == p.file
                && q.line < p.line
                && (words(line_text(sources, q)).contains(name.as_str()) || suggests(e, name))
                && !all.iter().zip(places).any(|(o, r)| o.code == d.code && r.line == q.line && o.about == d.about)
        });
    }
    // That weak acids and bases make no ions is said where these are missing.
    let left_out = |e: &Diagnostic| [codes::WEAK_ACID_LEFT_OUT, codes::WEAK_BASE_LEFT_OUT].contains(&e.code);
    if d.code == codes::REACTION_NEVER_STARTS && !d.is_error() && all.iter().any(left_out) {
        return true;
    }
    // Contents and equations must be right before one can tell what meets.
    if d.code == codes::REACTION_NEVER_STARTS {
        return others().any(|(e, _)| {
            matches!(e.code.family, "P0" | "N0" | "U1" | "U2" | "U3" | "K2") || e.code == codes::INVALID_RECIPE
        });
    }
    false
}

/// Whether a finding's correction brings in a name.
fn suggests(e: &Diagnostic, name: &str) -> bool {
    e.fixes.iter().flat_map(|f| &f.edits).any(|edit| edit.text == name)
}

fn line_text<'s>(sources: &'s Sources, p: &Place) -> &'s str {
    sources.get(p.file).and_then(|s| s.text.lines().nth(p.line.saturating_sub(1))).unwrap_or("")
}

fn words(line: &str) -> BTreeSet<&str> {
    line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use matterix_ir::Span;

    use super::*;

    #[test]
    fn what_a_line_that_cannot_be_read_would_have_said_is_not_missed_as_well() {
        let mut sources = Sources::default();
        let text = "species A {\n    formul \"CO2\"\n}\nspecies B {\n}\n";
        let file = sources.add("text.mtx", text);
        let at = |word: &str| text.find(word).map(|i| Span::new(file, i, i + word.len())).expect("it stands there");
        let error = |code, span, headline: &str| Diagnostic::error(code, span, headline, "here");
        let all = vec![
            error(codes::SYNTAX, at("formul"), "no field"),
            error(codes::MISSING_FIELD, at("A"), "`A` has no formula"),
            error(codes::MISSING_FIELD, at("B"), "`B` has no formula"),
        ];
        let kept = without_consequences(all, &sources);
        assert_eq!(kept.iter().map(|d| d.headline.as_str()).collect::<Vec<_>>(), ["no field", "`B` has no formula"]);
    }
}
