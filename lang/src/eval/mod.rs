//! Evaluation of expressions: names to values, quantities to nodes of the graph.
//!
//! The same evaluator checks a declaration (on prototypes of the instances it is about) and flattens it (on the lab's
//! own), so that what was checked is what runs.

mod adding;
pub mod arith;
pub mod call;
mod choose;
pub mod coerce;
pub mod compare;
mod decided;
pub mod equilibrium;
pub mod expr;
pub mod external;
mod filling;
pub mod interactions;
pub mod lab;
pub mod lists;
mod measures;
pub mod member;
mod notes;
pub mod reaction;
mod rows;
mod slices;
mod table;
mod texts;
mod tilting;
pub mod value;
pub mod words;

use std::cell::Cell;

use matterix_ir::scene::InstanceId;

use crate::declare::Type;

pub use choose::known_too_late;
pub use decided::Decided;
pub use lab::Elaborator;
pub use tilting::Tilts;
pub use value::{Num, Value};

/// What names mean at one place of the text.
#[derive(Clone, Debug, Default)]
pub struct Scope {
    /// The module whose names are seen.
    pub module: usize,
    /// The instance whose members are seen without a dot.
    pub this: Option<InstanceId>,
    /// The capability whose text this is: of several members with one name, it means its own.
    pub owner: Option<crate::names::DeclId>,
    /// Whether the lab's instances are seen.
    pub lab: bool,
    /// Local names, innermost last.
    pub vars: Vec<(String, Value)>,
    /// Which of them later steps may change, by position, with their types.
    pub variables: Vec<(usize, Type)>,
    /// Which of them were read, by position: a bit each, the last one for all that are further in.
    pub reads: Cell<u64>,
}

impl Scope {
    /// The names of a module only.
    pub fn module(module: usize) -> Self {
        Scope { module, ..Scope::default() }
    }

    /// The members of an instance, then the names of a module.
    pub fn of(this: InstanceId, module: usize) -> Self {
        Scope { module, this: Some(this), ..Scope::default() }
    }

    /// The names seen by the text of a member of an instance.
    pub fn of_member(this: InstanceId, member: crate::declare::tables::MemberRef<'_>) -> Self {
        Scope { owner: Some(member.owner), ..Scope::of(this, member.module) }
    }

    /// The innermost local with this name.
    pub fn var(&self, name: &str) -> Option<&Value> {
        let at = self.vars.iter().rposition(|(n, _)| n == name)?;
        self.reads.set(self.reads.get() | Self::read_bit(at));
        Some(&self.vars[at].1)
    }

    /// The bit in `reads` of a position.
    pub fn read_bit(position: usize) -> u64 {
        1 << position.min(63)
    }

    /// Notes what was read of its locals in a scope that began as a copy of this one.
    pub fn note_reads_of(&self, inner: &Scope) {
        let own = (0..self.vars.len()).fold(0, |bits, at| bits | Self::read_bit(at));
        self.reads.set(self.reads.get() | inner.reads.get() & own);
    }

    /// Lets later steps change the innermost local.
    pub fn vary(&mut self, ty: Type) {
        self.variables.push((self.vars.len() - 1, ty));
    }

    /// The position and type of the innermost local with this name, if later steps may change it.
    pub fn variable(&self, name: &str) -> Option<(usize, Type)> {
        let at = self.vars.iter().rposition(|(n, _)| n == name)?;
        self.variables.iter().find(|(position, _)| *position == at).cloned()
    }

    /// Adds a local.
    pub fn bind(&mut self, name: impl Into<String>, value: Value) {
        let depth = self.vars.len();
        while self.variables.last().is_some_and(|(position, _)| *position >= depth) {
            self.variables.pop();
        }
        self.vars.push((name.into(), value));
    }
}
