//! Names within labs that are included in others.

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use crate::ast::Name;
use crate::eval::Value;
use crate::near;

impl Elaborator<'_> {
    /// Does something where the names of a lab are those of an included one.
    pub fn within_lab<R>(&mut self, within: &str, does: impl FnOnce(&mut Self) -> R) -> R {
        let outer = std::mem::replace(&mut self.within, within.to_string());
        let result = does(self);
        self.within = outer;
        result
    }

    /// Where the names in a field of an instance are looked up: in its lab for a field that stands there.
    pub fn within_of(&self, id: InstanceId, lab: bool) -> String {
        if lab { self.instances[id.0 as usize].within.clone() } else { self.within.clone() }
    }

    /// The instance or the included lab that a name of the lab stands for.
    pub fn lab_name_of(&self, full: &str) -> Option<Value> {
        if let Some(id) = self.find_instance(full) {
            return Some(Value::Instance(id));
        }
        self.included.contains(full).then(|| Value::Included(full.to_string()))
    }

    /// `left.table`.
    pub fn included_member(&mut self, lab: &str, name: &Name) -> Value {
        let full = format!("{lab}.{}", name.text);
        if let Some(value) = self.lab_name_of(&full) {
            return value;
        }
        let inner = |n: &str| n.strip_prefix(lab).and_then(|n| n.strip_prefix('.')).map(str::to_string);
        let known: Vec<String> = self
            .instances
            .iter()
            .filter(|i| i.owner.is_none())
            .filter_map(|i| inner(&i.name))
            .chain(self.included.iter().filter_map(|n| inner(n)))
            .collect();
        let near = near::nearest(&name.text, known);
        let headline = format!("`{lab}` has no `{}`", name.text);
        let mut d = Diagnostic::error(codes::UNKNOWN_MEMBER, name.span, headline, "not in this lab");
        d = near::proposed(d, &near, name.span);
        self.report(d);
        Value::Error
    }
}
