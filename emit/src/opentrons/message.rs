//! A message of a driver: the name of a command and its fields, `aspirate well=plate[A1] volume=100`.

use matterix_ir::Diagnostic;

use super::form::{self, Form};
use crate::finding::wrong_message;
use crate::performance::Said;

/// A message, taken apart.
#[derive(Debug)]
pub(super) struct Message<'s> {
    /// The command.
    pub(super) form: &'static Form,
    /// What it says, in the order of the text.
    pub(super) fields: Vec<(&'s str, String)>,
    /// As it was said.
    pub(super) said: &'s Said,
}

impl<'s> Message<'s> {
    /// Reads a message, or says what is wrong with the driver's text.
    pub(super) fn read(said: &'s Said) -> Result<Message<'s>, Diagnostic> {
        let wrong = |headline: String| wrong_message(said.span, headline, format!("sends `{}`", said.text));
        let mut words = said.text.split(' ');
        let name = words.next().unwrap_or_default();
        let form = form::find(name).ok_or_else(|| wrong(format!("unknown Opentrons command `{name}`")))?;
        let mut fields: Vec<(&str, String)> = Vec::new();
        for word in words.filter(|w| !w.is_empty()) {
            let field = word.split_once('=').filter(|(name, _)| form.field(name).is_some());
            match (field, fields.last_mut()) {
                (Some((name, value)), _) => fields.push((name, value.to_owned())),
                (None, Some((_, value))) if !word.contains('=') => {
                    value.push(' ');
                    value.push_str(word);
                }
                _ => {
                    let field = word.split_once('=').map_or(word, |(name, _)| name);
                    return Err(wrong(format!("`{name}` has no field `{field}`")));
                }
            }
        }
        for (i, (field, _)) in fields.iter().enumerate() {
            if fields[..i].iter().any(|(f, _)| f == field) {
                return Err(wrong(format!("`{name}` has the field `{field}` twice")));
            }
        }
        if let Some((missing, _)) = form.needs.iter().find(|(n, _)| !fields.iter().any(|(f, _)| f == n)) {
            return Err(wrong(format!("`{name}` needs the field `{missing}`")));
        }
        Ok(Message { form, fields, said })
    }

    /// What a field says.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|(n, _)| *n == name).map(|(_, value)| value.as_str())
    }

    /// A finding about what it says.
    pub(super) fn wrong(&self, headline: String) -> Diagnostic {
        wrong_message(self.said.span, headline, format!("sends `{}`", self.said.text))
    }
}

/// The names in `(a, b)`, or the one name.
pub(super) fn names(list: &str) -> Vec<&str> {
    let inner = list.strip_prefix('(').and_then(|l| l.strip_suffix(')')).unwrap_or(list);
    inner.split(", ").filter(|n| !n.is_empty()).collect()
}
