//! Enumerated values: words of which a state, parameter or option is one.

use std::sync::Arc;

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Span, codes};

use super::{Scope, Value};
use crate::ast::{Binary, Expr, ExprKind, MemberKind, Name};
use crate::declare::Type;
use crate::declare::types::list;
use crate::eval::lab::Elaborator;
use crate::eval::lab::grids::Place;
use crate::near;

impl<'a> Elaborator<'a> {
    /// An expression where a type is expected: a word of an enumerated type stands for itself.
    pub fn typed(&mut self, e: &'a Expr, ty: &Type, scope: &mut Scope, what: &str) -> Value {
        let value = self.hinted(e, ty, scope);
        self.coerce(value, ty, e.span, what)
    }

    /// The value of an expression where a type is expected, not yet compared with it.
    pub fn hinted(&mut self, e: &'a Expr, ty: &Type, scope: &mut Scope) -> Value {
        match (ty, &*e.kind) {
            (Type::Enum(words), _) => self.word(e, words, scope),
            (Type::Place, ExprKind::Text(text)) => Value::Place(Name { text: text.clone(), span: e.span }),
            (Type::Place, ExprKind::Name(n)) => self.hinted_name(n, ty, scope),
            (Type::List(inner), ExprKind::List(items)) if matches!(**inner, Type::Enum(_)) => {
                Value::List(items.iter().map(|i| self.hinted(i, inner, scope)).collect())
            }
            _ => self.expr(e, scope),
        }
    }

    /// The value of a bare name where a type is expected, not yet compared with it.
    pub fn hinted_name(&mut self, n: &Name, ty: &Type, scope: &mut Scope) -> Value {
        match ty {
            Type::Enum(words) => self.word_of(n, words, scope),
            Type::Place if Place::parse(&n.text).is_some() && scope.var(&n.text).is_none() => Value::Place(n.clone()),
            _ => self.name_of(n, scope),
        }
    }

    /// An expression where one of these words is expected. They go before other names.
    fn word(&mut self, e: &'a Expr, words: &Arc<[String]>, scope: &mut Scope) -> Value {
        match &*e.kind {
            ExprKind::Name(n) => self.word_of(n, words, scope),
            _ => self.expr(e, scope),
        }
    }

    /// A bare name where one of these words is expected.
    fn word_of(&mut self, n: &Name, words: &Arc<[String]>, scope: &mut Scope) -> Value {
        if let Some(value) = self.word_named(&n.text, words) {
            self.note_value(n.span, &value);
            return value;
        }
        if self.resolves(n, scope) {
            return self.name_of(n, scope);
        }
        let near = near::nearest(&n.text, words.iter());
        let headline = format!("`{}` is not one of {}", n.text, list(words));
        let mut d = near::unknown(n, headline, "unknown word");
        d = near::proposed(d, &near, n.span);
        self.report(d);
        Value::Error
    }

    /// A word as a value.
    pub fn word_named(&mut self, text: &str, words: &Arc<[String]>) -> Option<Value> {
        let index = words.iter().position(|w| w == text)?;
        Some(Value::Enum(self.graph.number(index as f64), words.clone()))
    }

    /// Whether a bare word has a meaning of its own.
    pub fn resolves(&self, n: &Name, scope: &Scope) -> bool {
        const FIXED: &[&str] = &["true", "false", "nothing", "unlimited", "elapsed", "self", "ambient"];
        FIXED.contains(&n.text.as_str())
            || scope.var(&n.text).is_some()
            || scope.this.is_some_and(|this| self.has_member(this, &n.text))
            || self.settings.contains_key(&n.text)
            || self.of_lab(&n.text, scope).is_some()
            || self.tables.names.lookup(scope.module, &n.text).is_some()
    }

    /// Both sides of a comparison: a word takes its meaning from the other side.
    pub fn sides(&mut self, a: &'a Expr, b: &'a Expr, scope: &mut Scope) -> (Value, Value) {
        if let ExprKind::Name(n) = &*a.kind
            && !self.resolves(n, scope)
            && let y @ Value::Enum(..) = self.expr(b, scope)
        {
            let x = self.like(a, &y, scope);
            return (x, y);
        }
        let x = self.expr(a, scope);
        let y = self.like(b, &x, scope);
        (x, y)
    }

    /// An expression beside a value it is compared with.
    pub fn like(&mut self, e: &'a Expr, other: &Value, scope: &mut Scope) -> Value {
        match (other, &*e.kind) {
            (Value::Enum(_, words), ExprKind::List(_)) => {
                let ty = Type::List(Type::Enum(words.clone()).into());
                self.hinted(e, &ty, scope)
            }
            (Value::Enum(_, words), _) => self.word(e, &words.clone(), scope),
            // What is compared with a mistake is not judged.
            (Value::Error, ExprKind::Name(n)) if !self.resolves(n, scope) => Value::Error,
            _ => self.expr(e, scope),
        }
    }

    /// Whether two enumerated values are the same word; a report where they cannot be.
    pub fn same_word(&mut self, a: &Value, b: &Value, at_a: Span, at_b: Span) -> Option<NodeId> {
        let (Value::Enum(x, p), Value::Enum(y, q)) = (a, b) else { return None };
        if p != q {
            self.report(
                Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    at_b,
                    format!("one of {} cannot be compared with one of {}", list(p), list(q)),
                    format!("this is one of {}", list(q)),
                )
                .because(at_a, format!("this is one of {}", list(p))),
            );
            return None;
        }
        Some(self.graph.binary(BinaryOp::Eq, *x, *y))
    }

    /// `x is word` for an instance without such a member: its one enumerated member that knows the word.
    pub fn is_word(&mut self, id: InstanceId, word: &Name) -> Option<Value> {
        let members: Vec<(Name, Vec<String>)> = self
            .all_members(id)
            .iter()
            .filter_map(|m| match &m.member.kind {
                MemberKind::Value { name, ty, .. } if !ty.words.is_empty() => {
                    Some((name.clone(), ty.words.iter().map(|w| w.text.clone()).collect()))
                }
                _ => None,
            })
            .collect();
        let knowing: Vec<&Name> =
            members.iter().filter(|(_, words)| words.contains(&word.text)).map(|m| &m.0).collect();
        if let [member] = knowing.as_slice() {
            let value = self.member(Value::Instance(id), member);
            let Value::Enum(_, words) = &value else { return Some(Value::Error) };
            let wanted = self.word_named(&word.text, words)?;
            self.note_value(word.span, &wanted);
            return Some(self.compare(Binary::Eq, value, wanted, word.span, word.span));
        }
        let name = self.instances[id.0 as usize].name.clone();
        let d = if knowing.is_empty() {
            let near = near::nearest(&word.text, members.iter().flat_map(|(_, words)| words));
            let best = near.first()?.clone();
            let headline = format!("`{name}` has no state `{}`", word.text);
            let d = Diagnostic::about(&name, codes::UNKNOWN_NAME, word.span, headline, "unknown state");
            let d = d.guess(format!("replace with `{best}`"), word.span, best);
            Diagnostic { help: near::question(&near).into_iter().collect(), ..d }
        } else {
            let which: Vec<String> = knowing.iter().map(|m| format!("`{name}.{} is {}`", m.text, word.text)).collect();
            let headline = format!("several states of `{name}` may be `{}`", word.text);
            let d = Diagnostic::error(codes::AMBIGUOUS_NAME, word.span, headline, "ambiguous");
            d.help(format!("write {}", which.join(" or ")))
        };
        self.report(d);
        Some(Value::Error)
    }
}
