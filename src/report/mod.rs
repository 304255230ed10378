//! Findings shown to people and tools: one file per form, all over the same [`Diagnostic`].

mod concise;
mod human;
mod json;
pub mod points;
mod sarif;
mod text;

use std::collections::BTreeSet;
use std::fmt;

use matterix_ir::hidden::visible;
use matterix_ir::{Diagnostic, Severity, Sources};

pub use human::wrap;
use text::Texts;

/// The form in which findings are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// The lines of the source with what is wrong with them.
    Human,
    /// One line each: `file:line:column: error[code]: headline`.
    Concise,
    /// One JSON object per line, described in `docs/diagnostics-json.md`.
    Json,
    /// One document in SARIF 2.1.0, for systems that collect findings.
    Sarif,
}

/// How the human form is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Whether to use terminal colours.
    pub color: bool,
    /// Columns available for running text.
    pub width: usize,
}

/// How many findings of each severity there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Errors.
    pub errors: usize,
    /// Warnings.
    pub warnings: usize,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        match (self.errors, self.warnings) {
            (0, 0) => f.write_str("no findings"),
            (e, 0) => f.write_str(&count(e, "error")),
            (0, w) => f.write_str(&count(w, "warning")),
            (e, w) => write!(f, "{}, {}", count(e, "error"), count(w, "warning")),
        }
    }
}

/// Most findings of one file shown in the human form; the others are counted only.
const MOST_SHOWN: usize = 50;

/// Renders the findings of any number of compilations, each finding once.
pub struct Reporter {
    format: Format,
    look: Look,
    tally: Tally,
    seen: BTreeSet<(String, u32, u32, &'static str, String)>,
    log: sarif::Log,
}

impl Reporter {
    /// A reporter that has seen nothing.
    pub fn new(format: Format, look: Look) -> Self {
        Reporter { format, look, tally: Tally::default(), seen: BTreeSet::new(), log: sarif::Log::default() }
    }

    /// What was found so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The new findings among `diagnostics`, by file and position, ready to print.
    pub fn render(&mut self, sources: &Sources, diagnostics: Vec<Diagnostic>) -> String {
        let fresh = self.arrange(sources, diagnostics);
        let mut texts = Texts::new(sources);
        let mut out = String::new();
        match self.format {
            Format::Concise => fresh.iter().for_each(|d| concise::render(d, &mut texts, &mut out)),
            Format::Json => {
                fresh.iter().for_each(|d| json::render(d, &mut texts, &mut out));
                out = visible(&out).into_owned();
            }
            Format::Sarif => fresh.iter().for_each(|d| self.log.push(d, &mut texts)),
            Format::Human => {
                for diagnostic in fresh.iter().take(MOST_SHOWN) {
                    human::render(diagnostic, &mut texts, self.look, &mut out);
                    out.push('\n');
                }
                if fresh.len() > MOST_SHOWN {
                    let rest = fresh.len() - MOST_SHOWN;
                    out.push_str(&format!("... and {rest} more; `--format concise` shows all\n\n"));
                }
            }
        }
        out
    }

    /// The last line: how many there were; empty for tools, and where a quiet form found nothing. A document stands for
    /// all that was found.
    pub fn summary(&self) -> String {
        match self.format {
            Format::Sarif => visible(&self.log.document()).into_owned(),
            Format::Json => String::new(),
            Format::Concise if self.tally == Tally::default() => String::new(),
            _ => format!("{}\n", self.tally),
        }
    }

    /// The new findings among `diagnostics`, by file and position.
    pub fn arrange(&mut self, sources: &Sources, mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
        diagnostics.sort_by(|a, b| {
            let key = |d: &Diagnostic| (d.span().file, d.span().start, d.span().end, d.severity, d.code.name);
            key(a).cmp(&key(b)).then_with(|| a.headline.cmp(&b.headline))
        });
        diagnostics.retain(|d| {
            let span = d.span();
            let file = sources.get(span.file).map_or_else(String::new, |s| s.name.clone());
            self.seen.insert((file, span.start, span.end, d.code.name, d.headline.clone()))
        });
        for diagnostic in &diagnostics {
            match diagnostic.severity {
                Severity::Error => self.tally.errors += 1,
                Severity::Warning | Severity::Advice => self.tally.warnings += 1,
            }
        }
        diagnostics
    }
}

/// A finding as `--format json` writes it.
pub fn object(diagnostic: &Diagnostic, sources: &Sources) -> serde_json::Value {
    json::object(diagnostic, &mut Texts::new(sources))
}

/// How bad it is with `--strict`.
pub fn stricter(severity: Severity) -> Severity {
    match severity {
        Severity::Error | Severity::Warning => Severity::Error,
        Severity::Advice => Severity::Warning,
    }
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Advice => "advice",
    }
}

#[cfg(test)]
mod tests;
