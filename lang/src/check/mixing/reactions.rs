//! What reactions can make of what has met.

use std::rc::Rc;

use matterix_ir::Span;
use matterix_ir::scene::InstanceId;

use super::state::{Came, Entry, MixtureState};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;

impl MixtureState {
    /// Adds what the reactions of the mixtures can make there, at most as much as their reactants allow.
    pub fn react(&mut self, lab: &Elaborator<'_>, m: InstanceId, step: Span) -> Vec<SpeciesId> {
        let mut made = Vec::new();
        loop {
            let shared = &mut self.mixtures[m.0 as usize];
            let entries = &**shared;
            let mut new: Vec<(SpeciesId, Option<f64>)> = Vec::new();
            let mut used: Vec<SpeciesId> = Vec::new();
            for r in &lab.tables.reactions {
                if r.products.iter().all(|(p, _)| entries.contains_key(p)) {
                    continue;
                }
                let mut least = Some(f64::INFINITY);
                let mut sources = Vec::new();
                let there = r.reactants.iter().all(|(s, n)| {
                    let found = entries.iter().filter_map(|(have, e)| {
                        let def = lab.tables.species.get(*have);
                        let times =
                            if have == s { Some(1.0) } else { def.dissolves.iter().find(|d| d.0 == *s).map(|d| d.1) };
                        times.filter(|_| !e.residue).map(|t| (*have, e.content.map(|c| c * t / n)))
                    });
                    let mut any = false;
                    let mut most = Some(0.0);
                    for (have, content) in found {
                        any = true;
                        sources.push(have);
                        most = most.zip(content).map(|(a, b)| a + b);
                    }
                    least = match (least, most) {
                        (Some(a), Some(b)) => Some(a.min(b)),
                        (a, b) => a.filter(|a| a.is_finite()).or(b),
                    };
                    any
                });
                if there {
                    let products = r.products.iter().filter(|(p, _)| !entries.contains_key(p));
                    new.extend(products.map(|(p, n)| (*p, least.map(|l| l * n))));
                    used.extend(sources);
                }
            }
            if new.is_empty() && used.is_empty() {
                return made;
            }
            let entries = Rc::make_mut(shared);
            for s in used {
                // It may be used up by now.
                if let Some(e) = entries.get_mut(&s) {
                    e.certain = false;
                }
            }
            if new.is_empty() {
                return made;
            }
            for (s, content) in new {
                let came = vec![Came { span: step, into: m }];
                entries.entry(s).or_insert(Entry { content, certain: false, residue: false, came });
                made.push(s);
            }
        }
    }
}
