//! The form of the call at a cursor, and which of its parts is being written.

use matterix_ir::FileId;

use super::context::{LABELS, context};
use super::values::Place;
use crate::Index;
use crate::index::{DefId, Kind};

/// The form of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Signature {
    /// What is called.
    pub def: DefId,
    /// The form: `heat PLATE to T`.
    pub label: String,
    /// Where its parts stand in the form, in bytes, and what is said of each.
    pub parts: Vec<(std::ops::Range<usize>, String)>,
    /// The part that is being written.
    pub active: Option<usize>,
}

/// The form of the call at a cursor in the current text of a file.
pub fn signature(index: &Index, file: FileId, text: &str, cursor: usize) -> Option<Signature> {
    let context = context(text, cursor);
    if context.quiet {
        return None;
    }
    let place = Place::of(index, file, text, context.word.0);
    // The innermost function whose brackets are open.
    for (at, open) in context.open.iter().enumerate().rev() {
        if open.bracket == '{' {
            break;
        }
        let Some(name) = open.head.last().filter(|t| open.bracket == '(' && t.is_word() && t.end() == open.at) else {
            continue;
        };
        let Some(def) = place.function(name.text) else { continue };
        let inner = context.open.get(at + 1).map_or(&context.before, |o| &o.head);
        let commas = inner.iter().filter(|t| t.text == ",").count();
        let named = inner.iter().rposition(|t| t.text == ",").map_or(0, |i| i + 1);
        let named = inner.get(named + 1).filter(|t| t.text == ":").map(|_| inner[named].text);
        let mut signature = index.function_form(def);
        let params: Vec<&str> = index.def(def).inside.iter().map(|p| index.def(*p).name.as_str()).collect();
        let active = named.and_then(|n| params.iter().position(|p| *p == n)).unwrap_or(commas);
        signature.active = Some(active).filter(|a| *a < params.len());
        return Some(signature);
    }
    let statement = place.statement(&context);
    let in_options = context.open.last().is_some_and(|o| o.bracket == '{' && place.call(&o.head).is_some());
    let head = context.open.last().filter(|_| in_options).map(|o| o.head.as_slice());
    let tokens = head.unwrap_or(statement);
    let (def, words) = place.call(tokens)?;
    let mut signature = index.call_form_of(def);
    let label = tokens[words..].iter().rev().find(|t| LABELS.contains(&t.text)).map(|t| t.text);
    let params: Vec<DefId> = index.form_params(def);
    let option = head.and_then(|_| context.before.first()).map(|t| t.text);
    signature.active = params.iter().position(|p| match (head, index.def(*p).kind) {
        (Some(_), Kind::Option) => option.is_none_or(|o| index.def(*p).name == o),
        (Some(_), _) | (None, Kind::Option) => false,
        (None, _) => index.def(*p).label.as_deref() == label,
    });
    Some(signature)
}

impl Index {
    /// Parameters and options in the order of the form.
    fn form_params(&self, def: DefId) -> Vec<DefId> {
        let inside = &self.def(def).inside;
        let of = |kind: Kind| inside.iter().copied().filter(move |p| self.def(*p).kind == kind);
        of(Kind::Parameter).chain(of(Kind::Option)).collect()
    }

    /// `name(x: Type, ...) -> Type` with its parts.
    fn function_form(&self, def: DefId) -> Signature {
        let d = self.def(def);
        let mut label = format!("{}(", d.name);
        let mut parts = Vec::new();
        for (i, p) in d.inside.iter().enumerate() {
            label.push_str(if i > 0 { ", " } else { "" });
            let start = label.len();
            label.push_str(&flat(self.text(self.def(*p).whole)));
            parts.push((start..label.len(), self.said_of(*p)));
        }
        label.push(')');
        let result = self.sort_words(&d.sort);
        if !result.is_empty() {
            label.push_str(&format!(" -> {result}"));
        }
        Signature { def, label, parts, active: None }
    }

    /// `heat PLATE to T { limit }` with its parts.
    fn call_form_of(&self, def: DefId) -> Signature {
        let d = self.def(def);
        let mut label = d.name.clone();
        let mut parts = Vec::new();
        let params = self.form_params(def);
        let objects = params.iter().filter(|p| self.def(**p).kind == Kind::Parameter && self.def(**p).label.is_none());
        if d.kind == Kind::Command && objects.count() == 0 {
            label.push_str(" DEVICE");
        }
        let mut before: Option<&str> = None;
        let mut braces = false;
        for p in &params {
            let param = self.def(*p);
            if param.kind == Kind::Option {
                label.push_str(if braces { ", " } else { " { " });
                braces = true;
            } else if param.label.as_deref() != before {
                label.push_str(&format!(" {} ", param.label.as_deref().unwrap_or_default()));
                before = param.label.as_deref();
            } else {
                label.push(' ');
            }
            let start = label.len();
            match param.kind {
                Kind::Option => label.push_str(&param.name),
                _ => label.push_str(&param.name.to_uppercase()),
            }
            parts.push((start..label.len(), self.said_of(*p)));
        }
        if braces {
            label.push_str(" }");
        }
        let result = self.sort_words(&d.sort);
        if !result.is_empty() {
            label.push_str(&format!(" -> {result}"));
        }
        Signature { def, label, parts, active: None }
    }

    /// A parameter with its type, unit and default.
    fn said_of(&self, param: DefId) -> String {
        let p = self.def(param);
        let declared = flat(self.text(p.whole));
        let sort = self.sort_words(&p.sort);
        let docs = if p.docs.is_empty() { String::new() } else { format!("\n\n{}", p.docs.join("\n")) };
        if sort.is_empty() { format!("`{declared}`{docs}") } else { format!("`{declared}`: {sort}{docs}") }
    }
}

/// A text on one line.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
