//! Did you mean.

/// The candidates closest to `word`, best first, at most three; none where nothing is close.
pub fn nearest<S: AsRef<str>>(word: &str, candidates: impl IntoIterator<Item = S>) -> Vec<String> {
    let lower = word.to_lowercase();
    let mut scored: Vec<(usize, String)> = candidates
        .into_iter()
        .filter_map(|c| {
            let c = c.as_ref();
            if c == word {
                return None;
            }
            let candidate = c.to_lowercase();
            // A word cut short, such as `temp`, is far by its letters and yet plain.
            if lower.len() >= 3 && candidate.starts_with(&lower) {
                return Some((1, c.to_string()));
            }
            let distance = strsim::damerau_levenshtein(&lower, &candidate);
            let candidate = c.to_lowercase();
            let limit = match word.chars().count() {
                // Any two letters are one change apart: only another case, a longer or a shorter form is near.
                0..=2 if candidate.starts_with(&lower) || lower.starts_with(&candidate) => 9,
                0..=2 => 0,
                3..=5 => 2,
                n => n / 3 + 1,
            };
            (distance <= limit).then(|| (distance, c.to_string()))
        })
        .collect();
    scored.sort();
    scored.dedup();
    scored.truncate(3);
    scored.into_iter().map(|(_, c)| c).collect()
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
