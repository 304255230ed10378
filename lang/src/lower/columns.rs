//! Names of what a plan records: the value as it is written, with what a turn of a loop or a call stands for in place of its
//! name there, so that each column has a name of its own.

use matterix_ir::Span;

use super::Planner;
use crate::eval::{Scope, Value};

impl Planner<'_, '_> {
    /// A name that no other column has.
    pub(super) fn column(&mut self, value: Span, scope: &Scope) -> String {
        let name = with_names(&self.text(value), |word| self.stands_for(word, scope));
        let mut free = name.clone();
        let mut count = 1;
        while !self.columns.insert(free.clone()) {
            count += 1;
            free = format!("{name} ({count})");
        }
        free
    }

    /// What a name stands for that has not the same meaning each time the text is carried out, where that can be said before
    /// the run.
    fn stands_for(&self, word: &str, scope: &Scope) -> Option<String> {
        let (position, (_, value)) = scope.vars.iter().enumerate().rev().find(|(_, (name, _))| name == word)?;
        let changes = !self.open.is_empty() || Scope::read_bit(position) & self.turns != 0;
        match value {
            _ if !changes => None,
            Value::Num(n) => Some(self.lab.unit_of(n).show(self.lab.glance(n.node)?)),
            Value::Enum(n, words) => words.get(self.lab.glance(*n)? as usize).cloned(),
            Value::Species(s) => Some(self.lab.tables.species.get(*s).name.to_string()),
            Value::Qualified(i, _) => self.lab.spoken(&Value::Instance(*i)),
            other => self.lab.spoken(other),
        }
    }
}

/// A text with names in it replaced by what they stand for; members called the same stay, and so do units.
pub(super) fn with_names(text: &str, stands_for: impl Fn(&str) -> Option<String>) -> String {
    let of_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(of_name) {
        let (before, from) = rest.split_at(start);
        let (word, after) = from.split_at(from.find(|c| !of_name(c)).unwrap_or(from.len()));
        out += before;
        let behind = out.trim_end().chars().next_back();
        let free = behind.is_none_or(|c| c != '.' && !c.is_ascii_digit());
        out += &stands_for(word).filter(|_| free).unwrap_or_else(|| word.to_owned());
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::with_names;

    #[test]
    fn names_are_replaced_but_not_members_and_units() {
        let stands = |word: &str| match word {
            "v" => Some("cup".to_owned()),
            "s" => Some("NaCl".to_owned()),
            _ => None,
        };
        assert_eq!(with_names("v.contents[s] / 2 s", stands), "cup.contents[NaCl] / 2 s");
        assert_eq!(with_names("a.v + vv - v", stands), "a.v + vv - cup");
    }
}
