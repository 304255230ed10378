//! One style for all files: blanks, indentation, empty lines and separators. What is written, and the lines that it stands on, stay.

mod gap;
mod layout;

use matterix_ir::{Diagnostic, FileId, Span, codes};

use crate::tokens::{Kind, Token, tokens};
use gap::Gap;

/// The text in the one style; the findings where it has syntax mistakes.
pub fn format(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    let before = tokens(file, text)?;
    let formatted = layout::layout(text, &before);
    let same = tokens(file, &formatted).is_ok_and(|after| {
        words(text, &before) == words(&formatted, &after) && comments(text, &before) == comments(&formatted, &after)
    });
    if same {
        return Ok(formatted);
    }
    let place = Span::new(file, 0, 0);
    let headline = "this file cannot be formatted without changing it";
    Err(vec![
        Diagnostic::error(codes::SYNTAX, place, headline, "the file is unchanged")
            .help("this is a bug in the formatter: please report it with the file"),
    ])
}

/// What the tokens say, without those that only separate.
fn words<'a>(text: &'a str, tokens: &[Token]) -> Vec<&'a str> {
    let kept = tokens.iter().filter(|token| !matches!(token.kind, Kind::Comma | Kind::Separator));
    kept.map(|token| text.get(token.start..token.end).unwrap_or_default()).collect()
}

/// All comments in order.
fn comments<'a>(text: &'a str, tokens: &[Token]) -> Vec<&'a str> {
    let mut end = 0;
    let mut all = Vec::new();
    for (start, next) in tokens.iter().map(|token| (token.start, token.end)).chain([(text.len(), text.len())]) {
        let gap = Gap::of(text.get(end..start).unwrap_or_default());
        all.extend(gap.comments.into_iter().map(|comment| comment.text));
        end = next;
    }
    all
}
