//! What a lab is provided with, and what of it counts as used, waste or busy: the basis of a bill of materials.

use serde::{Deserialize, Serialize};

use crate::scene::InstanceId;
use crate::{NodeId, Span, Unit};

/// Everything that was brought in before the run, and how to count what becomes of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inventory {
    /// What the mixtures held, line by line of the file.
    pub holdings: Vec<Holding>,
    /// Recipes of the solutions among them and of the solutions those are made of.
    pub recipes: Vec<Recipe>,
    /// The species among them and those that can come of them.
    pub substances: Vec<Substance>,
    /// What to count.
    pub tallies: Vec<Tally>,
    /// Pairs of mixtures, by index into `Model::mixtures`, between which processes move matter all the time.
    pub streams: Vec<(u32, u32)>,
    /// Studies of the workflow and their numbers of runs.
    pub studies: Vec<(String, u64)>,
    /// Reactions, each in the direction in which it is written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reactions: Vec<Reaction>,
}

/// What a reaction makes of what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reaction {
    /// Its name.
    pub name: String,
    /// What it takes: indices into `Model::species` with coefficients.
    pub reactants: Vec<(u32, f64)>,
    /// What it makes.
    pub products: Vec<(u32, f64)>,
}

/// A species that has to be measured out.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredOut {
    /// The species.
    pub substance: String,
    /// The solutions it goes into, as a path from the one that is held; empty where it is held as it is.
    pub within: Vec<String>,
    /// kg.
    pub mass: f64,
}

impl Inventory {
    /// What the holdings are made of, `masses` (kg) being theirs in their order: each species once for each way in.
    pub fn measure_out(&self, masses: &[f64]) -> Vec<MeasuredOut> {
        let mut out = Vec::new();
        for (holding, mass) in self.holdings.iter().zip(masses) {
            self.break_down(&holding.substance, &mut Vec::new(), *mass, &mut out);
        }
        out
    }

    fn break_down(&self, name: &str, within: &mut Vec<String>, mass: f64, out: &mut Vec<MeasuredOut>) {
        // A recipe that contains itself is refused before there is a program.
        let recipe = self.recipe(name).filter(|_| !within.iter().any(|w| w == name));
        let Some(recipe) = recipe else {
            match out.iter_mut().find(|m| m.substance == name && m.within == *within) {
                Some(line) => line.mass += mass,
                None => out.push(MeasuredOut { substance: name.to_owned(), within: within.clone(), mass }),
            }
            return;
        };
        within.push(name.to_owned());
        for part in &recipe.parts {
            self.break_down(&part.substance, within, mass * part.share, out);
        }
        within.pop();
    }

    /// The recipe of a solution.
    pub fn recipe(&self, name: &str) -> Option<&Recipe> {
        self.recipes.iter().find(|r| r.name == name)
    }

    /// What is known of a species.
    pub fn substance(&self, name: &str) -> Option<&Substance> {
        self.substances.iter().find(|s| s.name == name)
    }
}

/// One term of what a vessel held: `10 g of water`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holding {
    /// Index into `Model::mixtures`.
    pub mixture: u32,
    /// The species or solution.
    pub substance: String,
    /// In the dimension it was written in, SI.
    pub amount: NodeId,
    /// As written.
    pub unit: Unit,
    /// kg.
    pub mass: NodeId,
    /// How warm the whole is at the start, K, and the unit that is written, where the lab says so.
    pub start: Option<(NodeId, Unit)>,
    /// Where it is written.
    pub span: Span,
}

/// How a solution is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Its name.
    pub name: String,
    /// In the order of the text.
    pub parts: Vec<Portion>,
    /// Its label as written, if it has one.
    pub label: Option<String>,
    /// Its declaration.
    pub span: Span,
}

/// A line of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Portion {
    /// A species or another solution.
    pub substance: String,
    /// As written: `0.66 g`, `rest`.
    pub text: String,
    /// kg per kg of the solution.
    pub share: f64,
}

/// A species that was brought in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Substance {
    /// Its name.
    pub name: String,
    /// Hill formula; empty for an undefined structure.
    pub formula: String,
    /// kg/mol; absent for a species counted by mass.
    pub molar_mass: Option<f64>,
    /// kg/m^3 of the pure liquid; absent for what is no liquid or not known.
    pub density: Option<f64>,
    /// Hazards it is known for.
    pub hazards: Vec<String>,
    /// Its boiling point and its flash point as written.
    pub boiling_point: Option<String>,
    /// As written.
    pub flash_point: Option<String>,
    /// Its declaration.
    pub span: Span,
}

/// What the value of a member says about its thing. A library says so with the option `counts_as`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Count {
    /// While true, the thing is used up.
    Used,
    /// While true, the thing and what it holds are waste.
    Waste,
    /// While true, the device works.
    Running,
    /// The share of what the vessel holds that cannot be got out.
    Dead,
}

impl Count {
    /// Every way to count with the word for it.
    pub const ALL: [(&'static str, Count); 4] =
        [("used", Count::Used), ("waste", Count::Waste), ("running", Count::Running), ("dead", Count::Dead)];

    /// The way to count that a word means.
    pub fn of_word(word: &str) -> Option<Count> {
        Self::ALL.iter().find(|(w, _)| *w == word).map(|(_, count)| *count)
    }
}

/// A member whose value is counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Whose.
    pub instance: InstanceId,
    /// How.
    pub count: Count,
    /// A truth value, or for [`Count::Dead`] a number from 0 to 1.
    pub value: NodeId,
}
