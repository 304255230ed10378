//! Conditions that are neither true nor false, as one that compares the root of a negative number: no run goes on by such a one.

use matterix_ir::{NodeId, Span};

use super::Engine;
use super::index::Root;
use crate::fault::Fault;

impl Engine<'_> {
    /// The operation that leaves what `node` rests on neither true nor false now.
    fn undecided(&self, node: NodeId) -> Option<NodeId> {
        let doubts = &self.index.doubts;
        if !doubts.concern(node) {
            return None;
        }
        doubts.undecided(&self.model.graph, node, &|n| self.eval(n))
    }

    /// Whether a condition is neither true nor false now.
    pub(super) fn is_undecided(&self, condition: NodeId) -> bool {
        self.undecided(condition).is_some()
    }

    /// Fails where the condition of `law` is neither true nor false now.
    pub(super) fn decided(&self, condition: NodeId, law: &str, span: Span) -> Result<(), Fault> {
        match self.undecided(condition) {
            Some(operation) => {
                Err(self.without_value("the condition has no value".to_owned(), operation, Some(law), span))
            }
            None => Ok(()),
        }
    }

    /// Fails where a condition that decides over this root is neither true nor false now. Whoever asks for more than the model does finds
    /// out as it looks.
    pub(super) fn decided_at(&self, root: u32) -> Result<(), Fault> {
        let (kind, node) = self.index.root(root);
        let model = self.model;
        match kind {
            Root::Event(i) => self.decided(node, &model.events[i as usize].name, model.events[i as usize].span),
            Root::Guard(i) => self.decided(node, &model.processes[i as usize].name, model.processes[i as usize].span),
            Root::Rate(state) => match self.undecided(node) {
                Some(operation) => Err(self.undecided_rate(state, operation)),
                None => Ok(()),
            },
            Root::Attended => {
                let danger = model.dangers.iter().find(|danger| danger.when == node);
                danger.map_or(Ok(()), |danger| self.decided(node, &danger.name, danger.span))
            }
            Root::Limit(_) | Root::Watch => Ok(()),
        }
    }

    /// The fault of a rate that rests on a condition which an operation leaves neither true nor false.
    fn undecided_rate(&self, state: u32, operation: NodeId) -> Fault {
        let name = &self.model.states[state as usize].name;
        let headline = format!("a condition in the rate of `{name}` has no value");
        let (law, span) = self.user_of(operation).unwrap_or((name, self.model.states[state as usize].span));
        self.without_value(headline, operation, Some(law), span)
    }
}
