//! Amounts at equilibrium: what conserved totals, constants and a heat content make of a mixture.
//!
//! A [`System`] is mathematics alone: members in a solvent or beside it, and equations between them. Its unknowns are the logarithms of
//! the activities of a few **masters**, of which all other members are formed ([`basis`]); its conditions are the totals of the masters,
//! which no equation changes. [`solve`] finds where they are met, with activity coefficients, the temperature and what has
//! precipitated; [`slopes`] says how the result moves with each argument, by the implicit function theorem.
//!
//! *Invariant: a solution is a function of its arguments.* Two ways were compared: to begin where the last solution lies saves iterations,
//! but then the last digits of a run depend on what was asked before, and a run that is taken up again is another one. So each
//! solution begins with the totals, and the last ones are kept ([`memo`]).

mod basis;
mod bounds;
mod linear;
mod memo;
mod slopes;
mod solve;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use basis::Basis;
pub use basis::{Circle, Unsettled};
use solve::Solution;

/// Where a member is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Phase {
    /// It is what others are dissolved in, and its activity is 1. There is one.
    Solvent,
    /// Dissolved: its activity is its molality times a coefficient.
    Solute,
    /// A pure solid: its activity is 1 where there is some of it.
    Solid,
}

/// One of the species of a system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// As it is called in findings.
    pub name: String,
    /// Where it is.
    pub phase: Phase,
    /// Elementary charges.
    pub charge: f64,
}

/// One equation: the sum of the logarithms of activities, each by its coefficient, is that of the constant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equation {
    /// As it is called in findings.
    pub name: String,
    /// By member: products count up, reactants down.
    pub coefficients: Vec<f64>,
}

/// What is written of a system; the rest follows from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Written {
    /// All species of the equations.
    pub members: Vec<Member>,
    /// The equations.
    pub equations: Vec<Equation>,
    /// Molar mass of the solvent, kg/mol.
    pub solvent_mass: f64,
}

/// Equations between members, ready to be solved.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct System {
    written: Written,
    basis: Arc<Basis>,
    fingerprint: u64,
}

impl PartialEq for System {
    fn eq(&self, other: &Self) -> bool {
        self.fingerprint == other.fingerprint && self.written == other.written
    }
}

impl TryFrom<Written> for System {
    type Error = Unsettled;

    fn try_from(written: Written) -> Result<Self, Unsettled> {
        let basis = Arc::new(Basis::new(&written)?);
        let fingerprint = memo::fingerprint(&written);
        Ok(System { written, basis, fingerprint })
    }
}

impl From<System> for Written {
    fn from(system: System) -> Written {
        system.written
    }
}

/// What is asked of a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Part {
    /// The amount of a member, mol.
    Amount(u32),
    /// The natural logarithm of the activity of a member; of a solid, that of its ion product over its constant.
    Activity(u32),
    /// The temperature, K.
    Temperature,
    /// The ionic strength, mol per kg of solvent.
    Strength,
    /// The heat that it took to come from the amounts given to those at equilibrium, J.
    Heat,
    /// By how much the heat capacity has grown by that, J/K.
    Capacity,
}

/// Arguments of a system, in their order: what is the same in all mixtures, then what is of one.
///
/// The equation of energy is `heat = heat of formation + capacity * (T - reference)`; where `capacity` has no end, the temperature is
/// `reference`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    members: usize,
    equations: usize,
}

impl Layout {
    /// Coefficients of activity, as [`Activities`] reads them.
    pub const ACTIVITIES: usize = 7;

    /// How many arguments there are.
    pub fn count(self) -> usize {
        self.reference() + 1
    }

    /// The first coefficient of activity.
    pub fn activities(self) -> usize {
        0
    }

    /// `ln K + enthalpy / (R T)` of an equation, where T is that of its constant.
    pub fn constant(self, equation: usize) -> usize {
        Self::ACTIVITIES + equation
    }

    /// Enthalpy of an equation, J/mol.
    pub fn enthalpy(self, equation: usize) -> usize {
        Self::ACTIVITIES + self.equations + equation
    }

    /// Heat capacity of a member, J/(mol*K).
    pub fn capacity_of(self, member: usize) -> usize {
        Self::ACTIVITIES + 2 * self.equations + member
    }

    /// The amount of a member as it was put there, mol.
    pub fn amount(self, member: usize) -> usize {
        Self::ACTIVITIES + 2 * self.equations + self.members + member
    }

    /// Half the sum of amount times charge squared over the ions that take part in no equation, mol.
    pub fn bystanders(self) -> usize {
        Self::ACTIVITIES + 2 * self.equations + 2 * self.members
    }

    /// Heat content, J.
    pub fn heat(self) -> usize {
        self.bystanders() + 1
    }

    /// Heat capacity of all as it was put there, J/K; without end where the temperature is given.
    pub fn capacity(self) -> usize {
        self.bystanders() + 2
    }

    /// The temperature at which heat contents are 0, K, or the one that is given.
    pub fn reference(self) -> usize {
        self.bystanders() + 3
    }
}

/// The coefficients by which activities follow from the ionic strength I, in mol/kg:
/// `log10 gamma = -A z^2 (sqrt(I) / (1 + b sqrt(I)) - c I)` for ions, with `A = a0 + a1 (T - 298.15) + a2 (T - 298.15)^2`, and
/// `d I` for what has no charge. From `most` on, coefficients are those at `most`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Activities {
    a: [f64; 3],
    b: f64,
    c: f64,
    d: f64,
    most: f64,
}

impl Activities {
    fn of(args: &[f64]) -> Activities {
        Activities { a: [args[0], args[1], args[2]], b: args[3], c: args[4], d: args[5], most: args[6] }
    }
}

impl System {
    /// Its members.
    pub fn members(&self) -> &[Member] {
        &self.written.members
    }

    /// Its equations.
    pub fn equations(&self) -> &[Equation] {
        &self.written.equations
    }

    /// Where each argument stands.
    pub fn layout(&self) -> Layout {
        Layout { members: self.written.members.len(), equations: self.written.equations.len() }
    }

    /// Equations that follow from others, by what each is made of: their constants must agree.
    pub fn circles(&self) -> &[Circle] {
        &self.basis.circles
    }

    /// One number of the solution; not a number where there is none.
    pub fn value(&self, part: Part, args: &[f64]) -> f64 {
        memo::with(self, args, |solution| match solution {
            Some(solution) => self.part(solution, part),
            None => f64::NAN,
        })
    }

    /// How much it grows with each of these arguments.
    pub fn slopes(&self, part: Part, args: &[f64], by: &[usize], out: &mut Vec<f64>) {
        out.clear();
        memo::with_slopes(self, args, |found| match found {
            Some((solution, slopes)) => {
                out.extend(by.iter().map(|arg| slopes.of(self, solution, args, part, *arg)));
            }
            None => out.extend(by.iter().map(|_| f64::NAN)),
        });
    }

    fn part(&self, solution: &Solution, part: Part) -> f64 {
        match part {
            Part::Amount(i) => solution.amounts[i as usize],
            Part::Activity(i) => solution.activities[i as usize],
            Part::Temperature => solution.temperature,
            Part::Strength => solution.strength,
            Part::Heat => solution.heat,
            Part::Capacity => solution.capacity,
        }
    }
}

/// A number of a solution that a graph asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// The system.
    pub system: Arc<System>,
    /// What is asked.
    pub part: Part,
    /// Its arguments, in the order of [`Layout`].
    pub args: Arc<[crate::NodeId]>,
}

impl Call {
    /// Its value, given those of its arguments.
    pub fn value(&self, at: impl Fn(crate::NodeId) -> f64) -> f64 {
        let args: Vec<f64> = self.args.iter().map(|arg| at(*arg)).collect();
        self.system.value(self.part, &args)
    }
}
