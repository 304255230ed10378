//! Identifiers of the standard, `SetTargetTemperature`, and words of the language, `set_target_temperature`.

/// The words of an identifier, in lower case: `SetPH7Target` is `set`, `ph7`, `target`.
pub fn words(identifier: &str) -> Vec<String> {
    let chars: Vec<char> = identifier.chars().collect();
    let mut out: Vec<String> = Vec::new();
    for (i, c) in chars.iter().enumerate() {
        let before = i.checked_sub(1).and_then(|b| chars.get(b));
        let after = chars.get(i + 1);
        let begins =
            c.is_uppercase() && before.is_none_or(|b| !b.is_uppercase() || after.is_some_and(|a| a.is_lowercase()));
        match out.last_mut() {
            Some(last) if !begins => last.extend(c.to_lowercase()),
            _ => out.push(c.to_lowercase().collect()),
        }
    }
    out
}

/// As a name of a member: `set_target_temperature`.
pub fn name(identifier: &str) -> String {
    words(identifier).join("_")
}

/// Words as an identifier: `stop heating` and `stop_heating` are `StopHeating`. What no identifier holds is left out.
pub fn identifier(words: &str) -> String {
    let mut out = String::new();
    for word in words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()) {
        let mut chars = word.chars();
        out.extend(chars.next().map(|c| c.to_ascii_uppercase()));
        out.push_str(chars.as_str());
    }
    if out.starts_with(|c: char| c.is_ascii_uppercase()) { out } else { format!("X{out}") }
}
