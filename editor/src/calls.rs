//! Who calls a skill or a command, and what it calls.

use matterix_ir::Span;

use crate::Index;
use crate::index::{DefId, Kind};

/// Calls between two declarations.
#[derive(Clone, Debug)]
pub struct Calls {
    /// The other one.
    pub def: DefId,
    /// Where the verbs of the calls stand.
    pub places: Vec<Span>,
}

impl Index {
    /// What stands at a place, if it is something that calls or is called.
    pub fn caller_at(&self, file: matterix_ir::FileId, offset: usize) -> Option<DefId> {
        let calls = |d: DefId| matches!(self.def(d).kind, Kind::Skill | Kind::Command | Kind::Workflow | Kind::Test);
        let named = self.def_at(file, offset).filter(|d| calls(*d));
        named.or_else(|| self.region(file, offset).and_then(|r| r.item).filter(|d| calls(*d)))
    }

    /// Who calls it.
    pub fn incoming(&self, def: DefId) -> Vec<Calls> {
        let all = self.calls().filter(|(_, _, called)| *called == def);
        gathered(all.filter_map(|(place, from, _)| Some(((*from)?, *place))))
    }

    /// What it calls.
    pub fn outgoing(&self, def: DefId) -> Vec<Calls> {
        let all = self.calls().filter(|(_, from, _)| *from == Some(def));
        gathered(all.map(|(place, _, called)| (*called, *place)))
    }
}

fn gathered(all: impl Iterator<Item = (DefId, Span)>) -> Vec<Calls> {
    let mut out: Vec<Calls> = Vec::new();
    for (def, place) in all {
        match out.iter_mut().find(|c| c.def == def) {
            Some(calls) if calls.places.contains(&place) => {}
            Some(calls) => calls.places.push(place),
            None => out.push(Calls { def, places: vec![place] }),
        }
    }
    out
}
