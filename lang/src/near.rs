//! Names that are not known, and did you mean.

use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::Name;

/// A name that stands for nothing where it is written, whose label says `label`.
pub fn unknown(name: &Name, headline: impl Into<String>, label: impl Into<String>) -> Diagnostic {
    Diagnostic::about(&name.text, codes::UNKNOWN_NAME, name.span, headline, label)
}

/// The candidates closest to `word`, best first, at most three; none where nothing is close.
pub fn nearest<S: AsRef<str>>(word: &str, candidates: impl IntoIterator<Item = S>) -> Vec<String> {
    let lower = word.to_lowercase();
    let mut scored: Vec<(usize, bool, String)> = candidates
        .into_iter()
        .filter_map(|c| {
            let c = c.as_ref();
            if c == word {
                return None;
            }
            let candidate = c.to_lowercase();
            // Capitals are easily mistaken.
            if candidate == lower {
                return Some((0, false, c.to_string()));
            }
            // A word cut short, such as `temp`, is far by its letters and yet plain.
            if lower.len() >= 3 && candidate.starts_with(&lower) {
                return Some((1, true, c.to_string()));
            }
            let distance = strsim::damerau_levenshtein(&lower, &candidate);
            let limit = match word.chars().count() {
                // Any two letters are one change apart: only another case, a longer or a shorter form is near.
                0..=2 if candidate.starts_with(&lower) || lower.starts_with(&candidate) => 9,
                0..=2 => 0,
                // Further apart, as `seal` and `read` are, words have little in common. The first letter is hardly ever a slip.
                4..=5 if candidate.chars().next() == lower.chars().next() => 2,
                n => (n / 3).max(1),
            };
            // Of equally near ones that with the same letters in another order is the likelier.
            (distance <= limit).then(|| (distance, !same_letters(&lower, &candidate), c.to_string()))
        })
        .collect();
    scored.sort();
    scored.dedup();
    // The same letters are hardly ever there by chance.
    if scored.first().is_some_and(|best| !best.1) {
        scored.retain(|other| !other.1);
    }
    scored.truncate(3);
    scored.into_iter().map(|(_, _, c)| c).collect()
}

/// Whether two words differ at most in the order of their letters.
pub fn same_letters(a: &str, b: &str) -> bool {
    let sorted = |word: &str| {
        let mut letters: Vec<char> = word.chars().collect();
        letters.sort_unstable();
        letters
    };
    a.len() == b.len() && sorted(a) == sorted(b)
}

/// `did you mean `a` or `b`?`, or nothing.
pub fn question(near: &[String]) -> Option<String> {
    match near {
        [] => None,
        [a] => Some(format!("did you mean `{a}`?")),
        [a, b] => Some(format!("did you mean `{a}` or `{b}`?")),
        [a, b, c, ..] => Some(format!("did you mean `{a}`, `{b}` or `{c}`?")),
    }
}

/// A finding with what may be meant by what stands at `at`: a question, and the nearest of all as a correction.
pub fn proposed(mut d: Diagnostic, near: &[String], at: Span) -> Diagnostic {
    d.help.extend(question(near));
    match near.first() {
        Some(best) => d.guess(format!("replace with `{best}`"), at, best.as_str()),
        None => d,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_that_changed_places_say_enough() {
        assert_eq!(nearest("wiat", ["heat", "what", "wait"]), ["wait"]);
        assert_eq!(nearest("temp", ["time", "temperature"]), ["temperature", "time"]);
    }

    #[test]
    fn words_that_differ_in_much_of_their_length_are_not_near() {
        assert_eq!(nearest("dissolve", ["dispose", "dispense"]), [""; 0]);
        assert_eq!(nearest("seal", ["read", "heat"]), [""; 0]);
        assert_eq!(nearest("decant", ["dispose", "dim"]), [""; 0]);
        assert_eq!(nearest("wate", ["wait", "heat"]), ["wait"]);
        assert_eq!(nearest("trnasfer", ["transfer", "transport"]), ["transfer"]);
    }
}
