//! The lines of the source with what is wrong with them. Excerpts are drawn by miette.

use std::fmt;

use matterix_ir::{Diagnostic, FileId, Fix, Label, Severity};
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, SourceCode, ThemeCharacters, ThemeStyles};

use super::text::{Text, Texts, harmless_line};
use super::{Look, word};

/// A longer stretch of lines is underlined on its first line only.
const MOST_LINES: usize = 6;

/// Appends headline, excerpts and help.
pub(super) fn render(diagnostic: &Diagnostic, texts: &mut Texts<'_>, look: Look, out: &mut String) {
    header(diagnostic, look, out);
    for (file, labels) in excerpts(diagnostic) {
        if let Some(text) = texts.get(file) {
            excerpt(text, &labels, diagnostic.severity, look, out);
        }
    }
    // A correction that the help has named is for editors only.
    let named = |fix: &&matterix_ir::Fix| {
        let quoted: Vec<String> = fix.edits.iter().map(|e| format!("`{}`", e.text)).collect();
        diagnostic.help.iter().any(|h| h.ends_with(&fix.title) || quoted.iter().all(|q| h.contains(q.as_str())))
    };
    let fixes: Vec<String> = diagnostic.fixes.iter().filter(|f| !named(f)).map(|f| instruction(f, texts)).collect();
    for (i, line) in diagnostic.help.iter().chain(&fixes).enumerate() {
        if !diagnostic.help[..i.min(diagnostic.help.len())].contains(line) {
            paragraph("  help: ", &paint("  help: ", "36", look), line, look, out);
        }
    }
}

fn header(diagnostic: &Diagnostic, look: Look, out: &mut String) {
    let head = format!("{}[{}]: ", word(diagnostic.severity), diagnostic.code.name);
    let color = match diagnostic.severity {
        Severity::Error => "1;31",
        Severity::Warning => "1;33",
        Severity::Advice => "1;34",
    };
    let painted = paint(&head, color, look);
    let mut lines = wrap(&harmless_line(&diagnostic.headline), look.width, head.chars().count(), 2).into_iter();
    out.push_str(&painted);
    out.push_str(&lines.next().unwrap_or_default());
    out.push('\n');
    lines.for_each(|line| out.push_str(&format!("  {line}\n")));
}

/// Labels by excerpt: the file of the cause first; labels that overlap go to excerpts of their own.
fn excerpts(diagnostic: &Diagnostic) -> Vec<(FileId, Vec<&Label>)> {
    let mut groups: Vec<(FileId, Vec<&Label>)> = Vec::new();
    let causes = diagnostic.labels.iter().filter(|l| l.primary);
    for label in causes.chain(diagnostic.labels.iter().filter(|l| !l.primary)) {
        let overlaps = |other: &&Label| {
            let (a, b) = (label.span, other.span);
            a != b && a.start < b.end && b.start < a.end
        };
        match groups.iter_mut().find(|(file, labels)| *file == label.span.file && !labels.iter().any(overlaps)) {
            Some((_, labels)) => labels.push(label),
            None => groups.push((label.span.file, vec![label])),
        }
    }
    groups
}

fn excerpt(text: &Text, labels: &[&Label], severity: Severity, look: Look, out: &mut String) {
    let mut marks: Vec<Mark> = Vec::new();
    for label in labels {
        let (start, end) = text.underlined(label.span, MOST_LINES);
        if !text.showable(start, end) {
            too_long(text, start, &label.text, out);
            continue;
        }
        match marks.iter_mut().find(|m| (m.start, m.end) == (start, end)) {
            Some(mark) => mark.add(&label.text),
            None => marks.push(Mark { start, end, text: harmless_line(&label.text), primary: label.primary }),
        }
    }
    if marks.is_empty() {
        return;
    }
    marks.sort_by_key(|m| m.start);
    let handler = GraphicalReportHandler::new_themed(theme(&marks, severity, look))
        .with_context_lines(1)
        .with_links(false)
        .without_syntax_highlighting()
        .without_cause_chain();
    let mut drawn = String::new();
    // Writing to a string cannot fail, and every mark is inside the text.
    if handler.render_report(&mut drawn, &Excerpt { text, marks }).is_ok() {
        // The first line is the place of the headline, which stands above already.
        let body = drawn.split_once('\n').map_or("", |(_, body)| body);
        body.lines().for_each(|line| out.push_str(&format!("{}\n", line.trim_end())));
    }
}

/// Where a line is too long to be shown, its place and what is wrong there.
fn too_long(text: &Text, start: usize, label: &str, out: &mut String) {
    let (line, column) = text.position(start);
    out.push_str(&format!("  ╭─[{}:{line}:{column}] (a long line, not shown)\n", text.name()));
    out.push_str(&format!("  ╰── {}\n", harmless_line(label)));
}

/// What stands under a range of bytes.
#[derive(Debug)]
struct Mark {
    start: usize,
    end: usize,
    text: String,
    primary: bool,
}

impl Mark {
    fn add(&mut self, text: &str) {
        if !text.is_empty() && self.text != text {
            let separator = if self.text.is_empty() { "" } else { "\n" };
            self.text = format!("{}{separator}{}", self.text, harmless_line(text));
        }
    }
}

/// Labels of one file, as miette wants them.
struct Excerpt<'a> {
    text: &'a Text,
    marks: Vec<Mark>,
}

impl fmt::Debug for Excerpt<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.marks).finish()
    }
}

impl fmt::Display for Excerpt<'_> {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        Ok(())
    }
}

impl std::error::Error for Excerpt<'_> {}

impl miette::Diagnostic for Excerpt<'_> {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.text)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.marks.iter().map(|m| {
            let text = Some(m.text.clone()).filter(|t| !t.is_empty());
            let span = (m.start, m.end - m.start);
            match m.primary {
                true => LabeledSpan::new_primary_with_span(text, span),
                false => LabeledSpan::new_with_span(text, span),
            }
        })))
    }
}

/// The cause in the colour of the severity, the history in another; miette takes one style per label, in order.
fn theme(marks: &[Mark], severity: Severity, look: Look) -> GraphicalTheme {
    let characters = ThemeCharacters::unicode();
    if !look.color {
        return GraphicalTheme { characters, styles: ThemeStyles::none() };
    }
    let base = ThemeStyles::ansi();
    let cause = match severity {
        Severity::Error => base.error,
        Severity::Warning => base.warning,
        Severity::Advice => base.advice,
    };
    let highlights = marks.iter().map(|m| if m.primary { cause } else { base.advice }).collect();
    GraphicalTheme { characters, styles: ThemeStyles { highlights, ..base } }
}

/// A fix in words: its title, and what it writes where the title does not say so.
fn instruction(fix: &Fix, texts: &Texts<'_>) -> String {
    let [edit] = fix.edits.as_slice() else { return fix.title.clone() };
    let (old, new) = (texts.slice(edit.span).trim(), edit.text.trim());
    let said = fix.title.contains(&format!("`{new}`"));
    if new.contains('\n') || old.contains('\n') || said {
        return fix.title.clone();
    }
    match (old.is_empty(), new.is_empty()) {
        (true, true) => fix.title.clone(),
        (true, false) => format!("{}: insert `{new}`", fix.title),
        (false, true) => format!("{}: remove `{old}`", fix.title),
        (false, false) => format!("{}: replace `{old}` with `{new}`", fix.title),
    }
}

fn paragraph(head: &str, painted: &str, text: &str, look: Look, out: &mut String) {
    let indent = head.chars().count();
    let mut first = true;
    for part in text.lines() {
        for line in wrap(&harmless_line(part), look.width, indent, indent) {
            match std::mem::take(&mut first) {
                true => out.push_str(&format!("{painted}{line}\n")),
                false => out.push_str(&format!("{:indent$}{line}\n", "")),
            }
        }
    }
}

/// Breaks at blanks so that no line is wider than `width` after its indent, as far as words allow.
pub fn wrap(text: &str, width: usize, first_indent: usize, indent: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut column = first_indent;
    for word in text.split(' ') {
        let length = word.chars().count();
        let line = lines.last_mut().filter(|l| l.is_empty() || column + 1 + length <= width);
        match line {
            Some(line) => {
                let blank = usize::from(!line.is_empty());
                line.push_str(&" ".repeat(blank));
                line.push_str(word);
                column += length + blank;
            }
            None => {
                lines.push(word.to_string());
                column = indent + length;
            }
        }
    }
    lines
}

fn paint(text: &str, code: &str, look: Look) -> String {
    if look.color { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_string() }
}
