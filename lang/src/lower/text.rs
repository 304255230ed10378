//! Labels and conditions in the words of the source.

use matterix_ir::plan::{Comparison, Condition, Refusal};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Said, Span};

use super::Planner;
use super::call::Bound;
use super::columns::with_names;
use crate::ast::{self, Call, Clause, ClauseKind, Expr, Name, Param, Sig};
use crate::declare::Type;
use crate::eval::lab::Compared;
use crate::eval::lab::observed::{Bindings, Noting, Observed};
use crate::eval::{Scope, Value};
use crate::names::verb_text;
use crate::near;

impl<'a> Planner<'a, '_> {
    /// The source under a span on one line, shortened; what is written once is asked for at every turn of a loop.
    pub fn text(&self, span: Span) -> String {
        if self.draft {
            return String::new();
        }
        self.texts.borrow_mut().entry(span).or_insert_with(|| self.on_one_line(span)).clone()
    }

    fn on_one_line(&self, span: Span) -> String {
        let text = self.sources.slice(span);
        let blanks = text.starts_with(' ') || text.ends_with(' ') || text.contains("  ");
        if text.len() <= 100 && !blanks && !text.contains(|c: char| c != ' ' && c.is_whitespace()) {
            return text.to_string();
        }
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if text.chars().count() <= 100 { text } else { text.chars().take(97).chain("...".chars()).collect() }
    }

    /// A call in a skill with its arguments in place of the parameters' names; none where that cannot be said before
    /// the run, and outside skills, where the text says it.
    pub fn call_label(
        &self,
        (sig, bound): (&Sig, &Bound),
        (call, scope): (&Call, &Scope),
        device: Option<(InstanceId, bool)>,
    ) -> Option<String> {
        if self.open.is_empty() || self.lab.prototype || self.draft {
            return None;
        }
        let shown = |p: &Param| {
            let (_, value) = bound.values.iter().find(|(name, _)| *name == p.name.text)?;
            match value {
                Value::Num(n) => {
                    // What only a run can tell is shown as the skill writes it.
                    let unit = self.lab.unit_of(n);
                    Some(self.lab.glance(n.node).map_or_else(|| self.as_written(sig, p, call, scope), |v| unit.show(v)))
                }
                Value::Frame(id, frame) if frame.is_empty() => self.lab.spoken(&Value::Instance(*id)),
                Value::Frame(id, frame) => Some(format!("{}.{frame}", self.lab.spoken(&Value::Instance(*id))?)),
                other => self.lab.spoken(other),
            }
        };
        let mut words = vec![verb_text(&sig.verb)];
        for p in &sig.params {
            words.push(shown(p)?);
        }
        for (label, params) in &sig.labelled {
            let p = params.first()?;
            // What is left out is not said.
            if !bound.values.iter().any(|(name, v)| *name == p.name.text && *v == Value::Nothing) {
                words.push(label.text.clone());
                words.push(shown(p)?);
            }
        }
        match device.map(|(id, object)| (self.lab.instances[id.0 as usize].name.clone(), object)) {
            Some((name, true)) => words.insert(1, name),
            Some((name, false)) => words.extend(["by".to_string(), name]),
            None => {}
        }
        Some(words.join(" "))
    }

    /// An argument as the text has it, with things in place of the names that stand for them there; the name of its parameter where
    /// it is left out.
    fn as_written(&self, sig: &Sig, p: &Param, call: &Call, scope: &Scope) -> String {
        let given = |label: &Name| call.labelled.iter().find(|(l, _)| l.text == label.text).map(|(_, e)| e);
        let labelled = || {
            let (label, params) = sig.labelled.iter().find(|(_, params)| params.iter().any(|q| std::ptr::eq(q, p)))?;
            let at = params.iter().position(|q| std::ptr::eq(q, p))?;
            match (&*given(label)?.kind, params.len()) {
                (ast::ExprKind::Tuple(items, None), 2..) => items.get(at).map(|e| e.span),
                _ => given(label).map(|e| e.span),
            }
        };
        let object = || match &call.object {
            Some(e) => Some(e.span),
            None => call.words.last().map(|word| word.span),
        };
        let span = if sig.params.iter().any(|q| std::ptr::eq(q, p)) { object() } else { labelled() };
        let Some(span) = span else { return p.name.text.clone() };
        with_names(&self.text(span), |word| match scope.var(word)? {
            Value::Instance(id) | Value::Qualified(id, _) => Some(self.lab.spoken_name(*id)),
            _ => None,
        })
    }

    /// A condition with what it compares.
    pub fn condition(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Condition> {
        self.condition_with(e, scope, false, Noting::Nothing).map(|(condition, _)| condition)
    }

    /// A condition with what it compares, the names of parameters replaced by those of the instances given where that is `named`.
    /// What is bound where something is asked of one of several things comes with it, where that is noted.
    fn condition_with(
        &mut self,
        e: &'a Expr,
        scope: &mut Scope,
        named: bool,
        noting: Noting,
    ) -> Option<(Condition, Bindings)> {
        let (node, observed) = self.lab.observe(noting, |lab| lab.truth(e, scope));
        let node = node?;
        let Observed { compared, terms, each, absent, bound, .. } = observed;
        if !absent.is_empty() {
            self.lab.absent_in.insert(e.span, absent);
        }
        let given: &[(String, Value)] = if named { &scope.vars } else { &[] };
        let each = each.into_iter().map(|asked| {
            let compared = self.in_words(asked.compared, given);
            let (node, text, terms) = (asked.node, asked.of, asked.terms);
            Condition { node, text, span: e.span, compared, terms, refusal: None, each: Vec::new() }
        });
        let each = each.collect();
        let compared = self.in_words(compared, given);
        let text = self.text(e.span);
        Some((Condition { node, text, span: e.span, compared, terms, refusal: None, each }, bound))
    }

    /// A condition on which steps hang. One of a stand-in that has no value is open, so that the steps are looked at all the
    /// same.
    pub fn deciding(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Condition> {
        let condition = self.condition(e, scope);
        if condition.is_some() || !self.lab.prototype {
            return condition;
        }
        let Value::Bool(node) = self.lab.placeholder(&Type::Bool, "condition") else { return None };
        Some(self.bare(node, e.span))
    }

    /// A condition of which nothing is known but its text.
    pub fn bare(&self, node: NodeId, span: Span) -> Condition {
        let (compared, terms, each) = (Vec::new(), Vec::new(), Vec::new());
        Condition { node, text: self.text(span), span, compared, terms, refusal: None, each }
    }

    /// Comparisons with what is compared as it is written, but for names that folds or parameters give: each makes room for that
    /// of its instance. All do so at once, as an instance may be called as another parameter is.
    fn in_words(&self, compared: Vec<Compared>, given: &[(String, Value)]) -> Vec<Comparison> {
        let words = |c: &Compared| {
            with_names(&self.text(c.span), |word| {
                let of_fold = c.each.iter().find(|(name, _)| self.sources.slice(*name) == word).map(|(_, id)| *id);
                let instance = of_fold.or_else(|| match given.iter().rev().find(|(name, _)| name == word)?.1 {
                    Value::Instance(id) => Some(id),
                    _ => None,
                })?;
                Some(self.lab.spoken_name(instance))
            })
        };
        compared.into_iter().map(|c| Comparison { text: words(&c), ..c.comparison }).collect()
    }

    /// What a `needs`, `presumes` or `warns` clause asks, with the failure and the help it names.
    pub fn need(&mut self, clause: &'a Clause, scope: &mut Scope) -> Option<Condition> {
        let (ClauseKind::Needs { cond, refusal }
        | ClauseKind::Presumes { cond, refusal, .. }
        | ClauseKind::Warns { cond, refusal }) = &clause.kind
        else {
            return None;
        };
        self.demanded(cond, refusal.as_ref(), scope)
    }

    /// A condition with what is said where it does not hold.
    pub fn demanded(
        &mut self,
        cond: &'a Expr,
        refusal: Option<&'a ast::Refusal>,
        scope: &mut Scope,
    ) -> Option<Condition> {
        let words = refusal.and_then(|r| r.because.as_ref()).filter(|_| !self.draft);
        let noting = if words.is_some() { Noting::All } else { Noting::Nothing };
        let (condition, bound) = self.condition_with(cond, scope, true, noting)?;
        let said = words.map(|words| self.said(words, &condition, bound, scope)).unwrap_or_default();
        let refusal = refusal.map(|r| Refusal { failure: r.failure.text.clone(), help: r.help.clone(), said });
        Some(Condition { refusal, ..condition })
    }

    /// Words for each that a condition asks about; for all of it where it asks about nothing in turn.
    fn said(&mut self, words: &'a ast::Text, condition: &Condition, bound: Bindings, scope: &mut Scope) -> Vec<Said> {
        if bound.is_empty() {
            // A list of nothing is asked about in vain, and its elements have no names here.
            let holds = self.lab.graph.constant(condition.node).is_some_and(|v| v != 0.0);
            let text = if holds { None } else { self.lab.filled(words, scope) };
            return text.map(|text| Said { node: condition.node, text }).into_iter().collect();
        }
        self.lab.said_of_each(words, bound, scope)
    }

    /// A failure name in a handler must be one that something can raise.
    pub fn check_failure(&mut self, name: &Name) {
        if self.failures.contains(&name.text) {
            return;
        }
        let near = near::nearest(&name.text, self.failures.iter());
        let mut d = near::unknown(
            name,
            format!("no step can fail with `{}`", name.text),
            "no step or skill declares this failure",
        );
        d = near::proposed(d, &near, name.span);
        if near.is_empty() {
            d = d.help(
                "the language itself raises `timeout`, `late`, `max` and `broken`; `on failure` takes every failure",
            );
        }
        self.lab.report(d);
    }
}
