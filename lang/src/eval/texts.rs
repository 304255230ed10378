//! Texts for people, with values in them.

use matterix_ir::{Diagnostic, NodeId, Said, Span, Text, TextPart, codes};

use super::{Scope, Value};
use crate::ast;
use crate::eval::lab::Elaborator;
use crate::eval::lab::observed::Bindings;

impl<'a> Elaborator<'a> {
    /// What is said where a condition holds to beware of: of each that `any` asks about, with what is bound there.
    pub fn said_of_danger(
        &mut self,
        node: NodeId,
        words: &'a ast::Text,
        mut bound: Bindings,
        scope: &mut Scope,
    ) -> Vec<Said> {
        if bound.is_empty() {
            bound.push((node, scope.vars.clone()));
        }
        self.said_of_each(words, bound, scope)
    }

    /// Words for each that is asked about, with what is bound there.
    pub fn said_of_each(&mut self, words: &'a ast::Text, bound: Bindings, scope: &mut Scope) -> Vec<Said> {
        let mut out = Vec::new();
        for (node, vars) in bound {
            let outside = std::mem::replace(&mut scope.vars, vars);
            let text = self.filled(words, scope);
            scope.vars = outside;
            out.extend(text.map(|text| Said { node, text }));
        }
        out
    }

    /// A text with its values as parts.
    pub fn filled(&mut self, text: &'a ast::Text, scope: &mut Scope) -> Option<Text> {
        let mut parts = Vec::new();
        let mut good = true;
        for part in &text.parts {
            match part {
                ast::TextPart::Plain(text) => parts.push(TextPart::Plain(text.clone())),
                ast::TextPart::Value { form: Some(form), .. } => {
                    let headline =
                        "this format is only for messages to devices; a text takes only digits after the point";
                    let d = Diagnostic::error(codes::SYNTAX, form.span, headline, "a format for devices");
                    self.report(d.help("write it as in `{t as degC :.1}`"));
                    good = false;
                }
                ast::TextPart::Value { value, digits, .. } => {
                    let v = self.expr(value, scope);
                    good &= self.fill_in(v, *digits, value.span, &mut parts);
                }
            }
        }
        good.then_some(Text { parts })
    }

    /// Adds a value as a text shows it; false, without a finding, where it has none.
    pub fn showable(&mut self, value: Value, span: Span, out: &mut Vec<TextPart>) -> bool {
        let value = match value {
            Value::Frame(id, frame) if frame.is_empty() => Value::Instance(id),
            Value::Frame(id, frame) => Value::Text(format!("{}.{frame}", self.instances[id.0 as usize].name)),
            other => other,
        };
        let (found, reported) = (self.diagnostics.len(), self.reported);
        let good = self.fill_in(value, None, span, out);
        self.diagnostics.truncate(found);
        self.reported = reported;
        good
    }

    /// Adds a value as a text shows it; false where it has none.
    fn fill_in(&mut self, value: Value, digits: Option<u8>, span: Span, out: &mut Vec<TextPart>) -> bool {
        let plain = |text: &str| TextPart::Plain(text.to_owned());
        if digits.is_some() && !matches!(value, Value::Num(_) | Value::Error) {
            self.expected("a quantity, of which digits can be shown", &value, span);
            return false;
        }
        match value {
            Value::Error => return false,
            Value::Num(n) => {
                let unit = self.unit_of(&n);
                out.push(TextPart::Quantity { value: n.node, unit, digits });
            }
            Value::Bool(n) => out.push(TextPart::Bool(n)),
            Value::Enum(n, words) => out.push(TextPart::Word(n, words.to_vec())),
            Value::InstanceNode(n) => out.push(TextPart::Instance(n)),
            Value::Instance(i) | Value::Qualified(i, _) => {
                out.push(plain(&self.instances[i.0 as usize].name));
            }
            Value::Text(text) => out.push(plain(&text)),
            Value::Place(place) => out.push(plain(&place.text)),
            Value::Nothing => out.push(plain("nothing")),
            Value::Unlimited => out.push(plain("unlimited")),
            Value::Species(s) => out.push(plain(&self.tables.species.get(s).name)),
            Value::Reaction(r) => out.push(plain(&self.tables.reactions[r.0 as usize].name)),
            Value::Range(low, high) => {
                self.fill_in(Value::Num(*low), None, span, out);
                out.push(plain(" .. "));
                self.fill_in(Value::Num(*high), None, span, out);
            }
            Value::Tuple(items) | Value::List(items) => {
                out.push(plain("("));
                for (i, item) in items.into_iter().enumerate() {
                    if i > 0 {
                        out.push(plain(", "));
                    }
                    if !self.fill_in(item, None, span, out) {
                        return false;
                    }
                }
                out.push(plain(")"));
            }
            Value::Concentration(..) => {
                self.kindless(span);
                return false;
            }
            other => {
                self.expected("a value that a text can show", &other, span);
                return false;
            }
        }
        true
    }
}
