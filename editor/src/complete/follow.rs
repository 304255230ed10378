//! What can follow where something is whole: a value, or a block.

use super::context::{Context, LABELS, Token};
use super::values::Place;
use super::{Offers, steps};

/// Words after which a value is still to come.
const BEFORE_VALUES: &[&str] = &[
    "and", "or", "not", "is", "of", "until", "while", "if", "expect", "hold", "keep", "keeps", "ends", "repeat",
    "within", "for", "timeout", "every", "after", "max", "record", "claim", "return", "await", "start", "step", "let",
    "var", "wait", "note", "ask", "fail", "retry", "when", "needs", "presumes", "warns", "else", "try", "times", "run",
    "include",
];

/// How conditions go on.
const CONDITION: &[&str] = &["and", "or", "in", "is", "as"];

/// Whether a value ends with this token.
pub(crate) fn ends_value(token: &Token<'_>) -> bool {
    let word = token.is_word() && !LABELS.contains(&token.text) && !BEFORE_VALUES.contains(&token.text);
    word || token.is_number() || token.text.starts_with('%') || matches!(token.text, ")" | "]")
}

/// Whether a step of the language begins with a word.
pub(crate) fn begins_step(word: &str) -> bool {
    steps::STEPS.iter().any(|(step, _)| *step == word)
}

impl Place<'_> {
    /// What can stand after a value: how it goes on, and what its step still lacks.
    pub(crate) fn after_value(&self, context: &Context<'_>, out: &mut Offers) {
        let statement = &context.before;
        let has = |word: &str| statement.iter().skip(1).any(|t| t.text == word);
        let second = statement.get(1).map_or("", |t| t.text);
        let (lacks, goes_on): (&[&str], bool) = match statement.first().map_or("", |t| t.text) {
            "wait" if second != "until" => (&[], false),
            "wait" | "hold" if has("timeout") => (&["on"], false),
            "wait" => (&["timeout"], true),
            "hold" if has("for") => (&["timeout"], false),
            "hold" => (&["for"], true),
            "within" if has("after") => (&[], false),
            "within" => (&["after"], false),
            "repeat" if has("times") || has("max") => (&[], false),
            "repeat" if second == "while" => (&["max"], true),
            "repeat" => (&["times"], false),
            "record" if has("every") => (&[], false),
            "record" => (&["every", "as"], false),
            "for" if statement.len() == 2 => (&["in"], false),
            "try" | "sequence" | "parallel" => (&[], false),
            "for" | "step" | "await" | "claim" | "retry" | "note" | "ask" | "fail" => (&[], false),
            "let" if statement.len() == 2 => (&["=", "<-"], false),
            "start" | "var" if statement.len() == 2 => (&["="], false),
            "if" | "expect" | "keep" => (&[], true),
            "let" | "return" => (&["of"], true),
            _ => (&["of", "as"], false),
        };
        let more = lacks.iter().chain(if goes_on { CONDITION } else { &[] });
        more.for_each(|word| self.keyword(word, &format!("{word} "), 40, out));
    }

    /// In the braces of a text: a value, or what can follow one.
    pub(crate) fn in_text(&self, context: &Context<'_>, out: &mut Offers) {
        if context.apart && context.before.last().is_some_and(ends_value) {
            ["as", "of", "and", "or"].iter().for_each(|word| self.keyword(word, &format!("{word} "), 40, out));
            return;
        }
        self.value_offers(&self.wanted(context), out);
    }

    /// What can stand in the line in which a block has ended; whether that is all.
    pub(crate) fn after_block(&self, context: &Context<'_>, out: &mut Offers) -> bool {
        let Some(ended) = context.ended.as_deref().filter(|_| context.before.is_empty()) else { return false };
        let has = |word: &str| ended.iter().any(|t| t.text == word);
        let last_else = ended.iter().rposition(|t| t.text == "else");
        let plain_else = last_else.is_some_and(|at| ended.get(at + 1).is_some_and(|t| t.text == "{"));
        let words: &[&str] = match ended.first().map_or("", |t| t.text) {
            _ if has("finally") => &[],
            "if" if plain_else => &[],
            "if" => &["else", "else if"],
            "try" if !has("on") => &["else", "on", "finally"],
            "try" | "step" | "within" | "hold" | "wait" | "keep" | "sequence" | "parallel" | "workflow" | "test"
            | "skill" => &["on", "finally"],
            _ => &[],
        };
        let thing = ended.get(1).is_some_and(|t| t.text == "=");
        if thing && context.block().is_some_and(|open| open.head.first().is_some_and(|t| t.text == "lab")) {
            ["on", "at", "in", "with", "holding"].iter().for_each(|w| self.keyword(w, &format!("{w} "), 5, out));
            return true;
        }
        for word in words {
            let form = match *word {
                "on" => "on ${1:failure} {\n    $0\n}".to_string(),
                "else if" => "else if ${1:condition} {\n    $0\n}".to_string(),
                word => format!("{word} {{\n    $0\n}}"),
            };
            self.keyword(word, &form, 5, out);
        }
        !words.is_empty()
    }
}
