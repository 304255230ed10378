//! What the evaluation of a condition comes upon besides its value, for those who ask.

use matterix_ir::plan::Term;
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Span};

use super::{Asked, Compared, Elaborator};
use crate::ast::Name;
use crate::declare::SpeciesId;
use crate::eval::Value;

/// What is bound where something is asked of one of several things: what is asked, and the names with their values.
pub type Bindings = Vec<(NodeId, Vars)>;

/// Names with their values, innermost last.
type Vars = Vec<(String, Value)>;

/// Where it is noted what is bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Noting {
    /// Nowhere.
    #[default]
    Nothing,
    /// Wherever a condition is asked of all of several things in turn: those for which it does not hold are named in words.
    All,
    /// Wherever a hazard asks whether there is any of several.
    Any,
}

/// What an evaluation came upon.
#[derive(Debug, Default)]
pub struct Observed {
    /// What was compared, but not inside of definitions.
    pub compared: Vec<Compared>,
    /// The members that are named, but not inside of definitions.
    pub terms: Vec<Term>,
    /// What is asked of each of several things.
    pub each: Vec<Asked>,
    /// Species that are asked for, and that can never get into the mixture asked.
    pub absent: Vec<(InstanceId, SpeciesId)>,
    /// What is bound where that was to be noted.
    pub bound: Bindings,
    noting: Noting,
}

impl<'a> Elaborator<'a> {
    /// Does something with what its evaluations come upon beside it.
    pub fn observe<R>(&mut self, noting: Noting, work: impl FnOnce(&mut Self) -> R) -> (R, Observed) {
        let outer = self.observed.replace(Box::new(Observed { noting, ..Observed::default() }));
        let result = work(self);
        let observed = std::mem::replace(&mut self.observed, outer);
        (result, observed.map(|own| *own).unwrap_or_default())
    }

    /// Evaluates a definition: what it compares inside is no part of what a condition that uses it compares.
    pub fn define<R>(&mut self, work: impl FnOnce(&mut Self) -> R) -> R {
        let compared = self.observed.as_mut().map(|o| std::mem::take(&mut o.compared));
        let result = work(self);
        if let (Some(observed), Some(compared)) = (&mut self.observed, compared) {
            observed.compared = compared;
        }
        result
    }

    /// Evaluates what `fold` asks of one of several things, whose name is bound to `each` instance: `of` it, in words, where it is asked by
    /// itself. The work gives the value, and what is bound.
    pub fn observe_one(
        &mut self,
        fold: &Name,
        of: Option<String>,
        each: Option<(Span, InstanceId)>,
        work: impl FnOnce(&mut Self) -> (Value, Vars),
    ) -> Value {
        let noting = self.noting();
        let Some(observed) = &mut self.observed else { return work(self).0 };
        let outer = of.is_some().then(|| (std::mem::take(&mut observed.compared), std::mem::take(&mut observed.terms)));
        let (compared, bound) = (observed.compared.len(), observed.bound.len());
        let (value, vars) = work(self);
        let node = match value {
            Value::Bool(node) => Some(node),
            _ => None,
        };
        let is_inner = !self.open_calls.is_empty() || !self.open_members.is_empty();
        let decided = node.and_then(|node| self.graph.constant(node)).map(|value| value != 0.0);
        // What does not hold of a stand-in says nothing of the things that a lab has.
        let is_ruled_out = decided == Some(false) && !self.prototype;
        let Some(observed) = &mut self.observed else { return value };
        if let Some(each) = each {
            observed.compared.iter_mut().skip(compared).for_each(|c| c.each.push(each));
        }
        let decides = match noting {
            Noting::Nothing => false,
            Noting::All => fold.text == "all" && decided != Some(true),
            Noting::Any => fold.text == "any" && !is_ruled_out,
        };
        // The innermost of several, as all is bound there.
        if let Some(node) = node.filter(|_| decides && !is_inner && observed.bound.len() == bound) {
            observed.bound.push((node, vars));
        }
        if let (Some(of), Some((compared, terms))) = (of, outer) {
            let compared = std::mem::replace(&mut observed.compared, compared);
            let terms = std::mem::replace(&mut observed.terms, terms);
            observed.compared.extend(compared.iter().cloned());
            for term in &terms {
                if !observed.terms.iter().any(|t| t.node == term.node) {
                    observed.terms.push(term.clone());
                }
            }
            observed.each.extend(node.map(|node| Asked { of, node, compared, terms }));
        }
        value
    }

    /// What is to be noted of what is bound.
    pub fn noting(&self) -> Noting {
        self.observed.as_ref().map_or(Noting::Nothing, |observed| observed.noting)
    }
}
