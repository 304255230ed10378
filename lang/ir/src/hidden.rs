//! Characters that change how a text is shown and are not seen themselves: those that turn the direction of writing, and those that a
//! terminal obeys.
//!
//! With the first a text can be shown in another order than it is read, so that a comment seems to be code, or a limit another one
//! ([CVE-2021-42574](https://trojansource.codes), Unicode's UAX #9). With the second whoever is printed writes on the terminal what they like.

use std::borrow::Cow;
use std::fmt::Write;

use crate::{Diagnostic, Edit, FileId, Span, codes};

/// The name of a character that turns the direction of what follows, and whether it does so until it is ended.
fn direction(c: char) -> Option<(&'static str, bool)> {
    Some(match c {
        '\u{61c}' => ("Arabic letter mark", false),
        '\u{200e}' => ("left-to-right mark", false),
        '\u{200f}' => ("right-to-left mark", false),
        '\u{202a}' => ("left-to-right embedding", true),
        '\u{202b}' => ("right-to-left embedding", true),
        '\u{202c}' => ("pop directional formatting", true),
        '\u{202d}' => ("left-to-right override", true),
        '\u{202e}' => ("right-to-left override", true),
        '\u{2066}' => ("left-to-right isolate", true),
        '\u{2067}' => ("right-to-left isolate", true),
        '\u{2068}' => ("first strong isolate", true),
        '\u{2069}' => ("pop directional isolate", true),
        _ => return None,
    })
}

fn holds(c: char) -> bool {
    direction(c).is_some_and(|(_, holds)| holds)
}

/// Whether a character turns the direction of writing.
pub fn is_direction(c: char) -> bool {
    direction(c).is_some()
}

/// Whether a terminal obeys or reorders by a character instead of showing it; line ends and tabs are not among them.
pub fn is_obeyed(c: char) -> bool {
    matches!(c, '\u{2028}' | '\u{2029}') || is_direction(c) || (c.is_control() && !matches!(c, '\n' | '\t'))
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

/// The text with blanks, byte for byte, for every character that turns the direction until it is ended.
pub fn blanked(text: &str) -> Cow<'_, str> {
    if !text.contains(holds) {
        return Cow::Borrowed(text);
    }
    let blank = |c: char| if holds(c) { " ".repeat(c.len_utf8()) } else { c.to_string() };
    Cow::Owned(text.chars().map(blank).collect())
}

/// The lines of a file on which a character turns the direction of writing. One that holds until it is ended is an error; a mark,
/// which texts in Arabic or Hebrew may need, a warning.
pub fn directions(file: FileId, text: &str) -> Vec<Diagnostic> {
    // In UTF-8 they begin with one of these bytes; most texts have neither.
    if !text.as_bytes().contains(&0xe2) && !text.as_bytes().contains(&0xd8) {
        return Vec::new();
    }
    let mut start = 0;
    let mut found = Vec::new();
    for line in text.split_inclusive('\n') {
        let turns: Vec<(usize, char)> = line.char_indices().filter(|(_, c)| is_direction(*c)).collect();
        found.extend(finding(file, start, &turns));
        start += line.len();
    }
    found
}

fn finding(file: FileId, start: usize, turns: &[(usize, char)]) -> Option<Diagnostic> {
    let first = turns.iter().find(|(_, c)| holds(*c)).or(turns.first())?;
    let span = |(at, c): &(usize, char)| Span::new(file, start + at, start + at + c.len_utf8());
    let (name, is_worse) = direction(first.1)?;
    let headline =
        format!("a hidden character (U+{:04X}, {name}) changes the order in which this is shown", u32::from(first.1));
    let label = match turns.len() {
        1 => "here".to_owned(),
        n => format!("here; {n} of them on this line"),
    };
    let report = if is_worse { Diagnostic::error } else { Diagnostic::warning };
    let mut found = report(codes::TEXT_DIRECTION, span(first), headline, label)
        .help("what is shown may not be what is read: look at the line again and remove what is hidden")
        .guess("remove what is hidden", span(first), "");
    if let Some(fix) = found.fixes.last_mut() {
        fix.edits = turns.iter().map(|turn| Edit { span: span(turn), text: String::new() }).collect();
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
    fn every_turn_is_found_once_a_line_with_its_place() {
        let file = FileId(0);
        let found = directions(file, "a\nb \u{202e}c\u{2069}\nd\u{200f}\n— é\n");
        let seen: Vec<_> = found.iter().map(|d| (d.severity, d.span().start, d.fixes[0].edits.len())).collect();
        assert_eq!(seen, [(Severity::Error, 4, 2), (Severity::Warning, 13, 1)]);
        for c in ['\u{61c}', '\u{200e}', '\u{200f}']
            .into_iter()
            .chain('\u{202a}'..='\u{202e}')
            .chain('\u{2066}'..='\u{2069}')
        {
            assert_eq!(directions(file, &format!("x{c}y")).len(), 1, "{c:?}");
        }
        assert!(directions(file, "Ωμέγα, Ø, ﷼, שלום").is_empty(), "other writing is not hidden");
    }
}
