//! What reactions made, and what their scarcest reactant would have allowed.

use matterix_ir::inventory::Reaction;
use matterix_ir::model::{Content, Mixture};

use super::YieldLine;
use super::follow::Follower;

/// Of what could be there at most, so little is none.
const NOTHING: f64 = 1e-9;

/// mmol per mol.
const MILLI: f64 = 1e3;

impl Follower<'_> {
    /// Of each vessel and reaction what it made there. A product that was there from the start somewhere is left out, and so is one that a
    /// reaction takes: what of it a reaction made is not known by then.
    pub(super) fn yields(&self) -> Vec<YieldLine> {
        let mixtures = self.program.model.mixtures.iter().enumerate();
        let reactions = &self.program.inventory.reactions;
        mixtures.flat_map(|(i, m)| reactions.iter().flat_map(move |r| self.made(i, m, r))).collect()
    }

    fn made(&self, index: usize, mixture: &Mixture, reaction: &Reaction) -> Vec<YieldLine> {
        let there = |species: u32| {
            let (number, content) = mixture.contents.iter().enumerate().find(|(_, c)| c.species == species)?;
            self.amount(index, number, content).map(|n| n.max(0.0))
        };
        let left: Option<Vec<(u32, f64, f64)>> =
            reaction.reactants.iter().map(|(s, n)| Some((*s, there(*s)?, *n))).collect();
        let turns = |r: &&(u32, f64, f64)| r.1 / r.2;
        let scarcest = left.as_deref().unwrap_or_default().iter().min_by(|a, b| turns(a).total_cmp(&turns(b)));
        let Some(scarcest) = scarcest else { return Vec::new() };
        let line = |(product, n): &(u32, f64)| {
            let made = there(*product).filter(|_| !self.is_brought(*product) && !self.is_taken(*product))?;
            let at_most = made + n * turns(&scarcest);
            (made > NOTHING * at_most && at_most > 0.0).then(|| YieldLine {
                vessel: self.program.scene.get(self.holder(index)).name.clone(),
                reaction: reaction.name.clone(),
                product: self.species(*product),
                made: made * MILLI,
                at_most: at_most * MILLI,
                limiting: self.species(scarcest.0),
                left: scarcest.1 * MILLI,
            })
        };
        reaction.products.iter().filter_map(line).collect()
    }

    /// Whether there was any of a species when the run began.
    fn is_brought(&self, species: u32) -> bool {
        let contents = self.program.model.mixtures.iter().flat_map(|m| &m.contents);
        let first = |c: &Content| self.first.get(c.state as usize).copied().unwrap_or(0.0);
        contents.filter(|c| c.species == species).any(|c| first(c) > 0.0)
    }

    fn is_taken(&self, species: u32) -> bool {
        self.program.inventory.reactions.iter().any(|r| r.reactants.iter().any(|(s, _)| *s == species))
    }

    fn species(&self, index: u32) -> String {
        self.program.model.species.get(index as usize).map_or_else(String::new, |s| s.name.clone())
    }
}
