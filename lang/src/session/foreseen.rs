//! What can get where in the tasks of a file, as it was found when they were looked at last. The next look begins with it, and finds
//! out beside whether it is still so.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::eval::lab::reach::Reach;
use crate::names::{self, Names};
use crate::task::Task;

/// What can get where, task by task.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Foreseen(BTreeMap<String, Reach>);

impl Foreseen {
    /// That of a task; none where it was not looked at.
    pub(crate) fn of(&self, names: &Names<'_>, task: &Task<'_>) -> Option<&Reach> {
        self.0.get(&name(names, task)?)
    }

    /// Keeps that of a task.
    pub(crate) fn keep(&mut self, names: &Names<'_>, task: &Task<'_>, reach: Option<Reach>) {
        if let (Some(name), Some(reach)) = (name(names, task), reach) {
            self.0.insert(name, reach);
        }
    }
}

/// A task and its lab.
fn name(names: &Names<'_>, task: &Task<'_>) -> Option<String> {
    let of = |id| names::item_name(names.decl(id).item).map(|(name, _)| name);
    Some(format!("{} in {}", of(task.item)?, of(task.lab)?))
}
