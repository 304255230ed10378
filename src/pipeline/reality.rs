//! How closely a run simulates motions, and how the lab really is: what does not go together, and what is drawn.

use matterix_ir::{Diagnostic, Program};
use matterix_runtime::motion::{Store, Unseen, perturb};

use super::motions;
use super::run::Choices;
use crate::args::{Reality, RunFidelity};

impl Reality {
    /// Fails with words for what does not go together.
    pub fn agrees(&self, dry: bool) -> Result<(), String> {
        if self.unseen.is_some() && (self.fidelity == RunFidelity::Process || dry) {
            return Err("`--unseen` needs `--fidelity motion` or `contact`".to_string());
        }
        if self.really.is_some() && (self.fidelity != RunFidelity::Contact || dry) {
            return Err("`--really` needs `--fidelity contact`".to_string());
        }
        Ok(())
    }

    /// Moves the things of a program as the seed has it; what a run of it chooses then.
    pub fn draw(&self, program: &mut Program, seed: u64) -> Result<Choices, String> {
        let moved = match self.perturb {
            Some(by) => perturb(program, by, seed)?,
            None => Vec::new(),
        };
        let unseen = match self.unseen {
            Some(by) => Unseen::drawn(program, by, seed)?,
            None => Unseen::default(),
        };
        let really = self.really.unwrap_or_default();
        Ok(Choices { moved, unseen, really, ..Choices::plain(seed, self.fidelity) })
    }

    /// Whether robots move through space.
    pub fn moves(&self) -> bool {
        self.fidelity != RunFidelity::Process
    }

    /// What is wrong with the motions of a program, where robots move, before a run begins.
    pub fn look(&self, program: &Program, store: &dyn Store) -> Vec<Diagnostic> {
        if self.moves() { motions(program, store) } else { Vec::new() }
    }
}
