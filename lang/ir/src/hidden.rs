//! Characters that change how a text is shown and are not seen themselves: those that turn the direction of writing, and those that a
//! terminal obeys.
//!
//! With the first a text can be shown in another order than it is read, so that a comment seems to be code, or a limit another one
//! ([CVE-2021-42574](https://trojansource.codes), Unicode's UAX #9). With the second a line can be hidden or written over, and whoever is
//! printed writes on the terminal what they like.

use std::borrow::Cow;
use std::fmt::Write;

use crate::{Diagnostic, Edit, FileId, Span, codes};

/// The name of a character that turns the direction of what follows.
fn direction(c: char) -> Option<&'static str> {
    Some(match c {
        '\u{61c}' => "Arabic letter mark",
        '\u{200e}' => "left-to-right mark",
        '\u{200f}' => "right-to-left mark",
        '\u{202a}' => "left-to-right embedding",
        '\u{202b}' => "right-to-left embedding",
        '\u{202c}' => "pop directional formatting",
        '\u{202d}' => "left-to-right override",
        '\u{202e}' => "right-to-left override",
        '\u{2066}' => "left-to-right isolate",
        '\u{2067}' => "right-to-left isolate",
        '\u{2068}' => "first strong isolate",
        '\u{2069}' => "pop directional isolate",
        _ => return None,
    })
}

/// The same of other characters that are not seen.
fn name(c: char) -> &'static str {
    match c {
        '\u{8}' => "backspace",
        '\r' => "carriage return without a line feed",
        '\u{1b}' => "escape",
        '\u{9b}' => "control sequence introducer",
        _ => direction(c).unwrap_or("a control character"),
    }
}

/// Whether a character can hide or move what stands around it: marks cannot, and other control characters are only not seen.
fn hides(c: char) -> bool {
    matches!(c, '\u{8}' | '\r' | '\u{1b}' | '\u{9b}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Whether a terminal obeys or reorders by a character instead of showing it; line ends and tabs are not among them.
pub fn is_obeyed(c: char) -> bool {
    matches!(c, '\u{2028}' | '\u{2029}') || direction(c).is_some() || (c.is_control() && !matches!(c, '\n' | '\t'))
}

/// The text with each such character in letters, `\u001b`. In JSON that is the same text.
pub fn visible(text: &str) -> Cow<'_, str> {
    // All of them are among the first bytes, or take several.
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_obeyed(c) {
            // Writing to a text cannot fail.
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// The text with blanks, byte for byte, for every character that is an error in it; line ends stay.
pub fn blanked(text: &str) -> Cow<'_, str> {
    let is_error = |c: char| hides(c) && c != '\r';
    if !text.contains(is_error) {
        return Cow::Borrowed(text);
    }
    let blank = |c: char| if is_error(c) { " ".repeat(c.len_utf8()) } else { c.to_string() };
    Cow::Owned(text.chars().map(blank).collect())
}

/// The lines of a file that are not shown as they are read. A character that hides or moves others is an error; a mark, which texts in
/// Arabic or Hebrew may need, or one that is only not seen, a warning.
pub fn characters(file: FileId, text: &str) -> Vec<Diagnostic> {
    let mut start = 0;
    let mut found = Vec::new();
    for line in text.split_inclusive('\n') {
        let shown = line.strip_suffix("\r\n").unwrap_or(line);
        if !shown.bytes().all(|b| (0x20..0x7f).contains(&b)) {
            let hidden: Vec<(usize, char)> = shown.char_indices().filter(|(_, c)| is_hidden(*c)).collect();
            found.extend(finding(file, start, &hidden));
        }
        start += line.len();
    }
    found
}

/// A substitute (U+001A) has a finding of its own.
fn is_hidden(c: char) -> bool {
    direction(c).is_some() || (c.is_control() && !matches!(c, '\n' | '\t' | '\u{1a}'))
}

fn finding(file: FileId, start: usize, hidden: &[(usize, char)]) -> Option<Diagnostic> {
    let first = hidden.iter().find(|(_, c)| hides(*c)).or(hidden.first())?;
    let span = |(at, c): &(usize, char)| Span::new(file, start + at, start + at + c.len_utf8());
    let headline = format!(
        "a hidden character (U+{:04X}, {}) changes how this line is displayed",
        u32::from(first.1),
        name(first.1)
    );
    let label = match hidden.len() {
        1 => "here".to_owned(),
        n => format!("here; {n} on this line"),
    };
    let report = if hides(first.1) { Diagnostic::error } else { Diagnostic::warning };
    let mut found = report(codes::HIDDEN_CHARACTER, span(first), headline, label)
        .help("the program may read the line differently from its display: remove the hidden characters and read it again")
        .guess("remove the hidden characters", span(first), "");
    if let Some(fix) = found.fixes.last_mut() {
        fix.edits = hidden.iter().map(|one| Edit { span: span(one), text: String::new() }).collect();
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;

    #[test]
    fn what_a_terminal_obeys_is_shown_in_letters() {
        assert_eq!(visible("3 µL\tof\nwater"), "3 µL\tof\nwater");
        assert_eq!(visible("\u{1b}[2J\r\u{7f}\u{9b}1m\u{202e}"), "\\u001b[2J\\u000d\\u007f\\u009b1m\\u202e");
        assert!(matches!(visible("é – ≥"), Cow::Borrowed(_)));
    }

    #[test]
    fn blanks_take_as_many_bytes() {
        let text = "a\u{202e}é\u{200f}\u{2069}b";
        assert_eq!(blanked(text), "a   é\u{200f}   b");
        assert_eq!(blanked(text).len(), text.len());
    }

    #[test]
    fn what_writes_over_a_line_is_found_and_line_ends_are_not() {
        let found = |text: &str| characters(FileId(0), text).iter().map(|d| d.severity).collect::<Vec<_>>();
        assert_eq!(found("a\r\nb\tc\r\n"), []);
        for c in ['\r', '\u{1b}', '\u{8}', '\u{9b}'] {
            assert_eq!(found(&format!("heat // {c}stop\r\n")), [Severity::Error], "{c:?}");
        }
        assert_eq!(found("a\u{c}\n\u{2}\u{7f}"), [Severity::Warning; 2]);
    }

    #[test]
    fn every_turn_is_found_once_a_line_with_its_place() {
        let file = FileId(0);
        let found = characters(file, "a\nb \u{202e}c\u{2069}\nd\u{200f}\n— é\n");
        let seen: Vec<_> = found.iter().map(|d| (d.severity, d.span().start, d.fixes[0].edits.len())).collect();
        assert_eq!(seen, [(Severity::Error, 4, 2), (Severity::Warning, 13, 1)]);
        for c in ['\u{61c}', '\u{200e}', '\u{200f}']
            .into_iter()
            .chain('\u{202a}'..='\u{202e}')
            .chain('\u{2066}'..='\u{2069}')
        {
            assert_eq!(characters(file, &format!("x{c}y")).len(), 1, "{c:?}");
        }
        assert!(characters(file, "Ωμέγα, Ø, ﷼, שלום").is_empty(), "other writing is not hidden");
    }
}
