//! Amounts at equilibrium: what conserved totals, constants and a heat content make of a mixture.
//!
//! A [`System`] is mathematics alone: members in a solvent or beside it, and equations between them. Its unknowns are the logarithms of
//! the activities of a few **masters**, of which all other members are formed (`basis`); its conditions are the totals of the masters,
//! which no equation changes. `solve` finds where they are met, with activity coefficients, the temperature and what has
//! precipitated, by Newton's method (`newton`) on what follows from the unknowns (`state`); `slopes` says how the result moves with each argument, by the implicit function theorem.
//!
//! *Invariant: a solution is a function of its arguments.* Two ways were compared: to begin where the last solution lies saves iterations,
//! but then the last digits of a run depend on what was asked before, and a run that is taken up again is another one. So each
//! solution begins with the totals, and the last ones are kept (`memo`).

mod activity;
mod basis;
mod bounds;
mod formal;
mod linear;
mod memo;
mod mixing;
mod newton;
mod pitzer;
mod problem;
#[cfg(test)]
mod sketch;
mod slopes;
mod solve;
mod state;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use activity::{Activities, Coefficients};
use basis::Basis;
pub use basis::{Circle, Unsettled};
use pitzer::Virial;
pub use pitzer::{Interaction, Interactions};
use solve::Solution;
pub use solve::{STANDARD, rises, terms};

/// Where a member is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Phase {
    /// It is what others are dissolved in. There is one.
    Solvent,
    /// Dissolved: its activity is its molality times a coefficient.
    Solute,
    /// Dissolved in another liquid, which stands beside the solvent and which no equation changes: its activity is its amount per mass of
    /// that. It has no charge.
    Extracted,
    /// A pure solid: its activity is 1 where there is some of it.
    Solid,
    /// A formal one, as the electron of half-cells is: it has an activity, but there is never any of it.
    Formal,
}

impl Phase {
    /// Whether a member is in a liquid, whichever.
    pub(crate) fn is_dissolved(self) -> bool {
        matches!(self, Phase::Solute | Phase::Extracted)
    }
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
    /// The law of Pitzer in place of that of [`Coefficients`]; none where these hold.
    pub interactions: Option<Interactions>,
}

/// Equations between members, ready to be solved.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct System {
    written: Written,
    basis: Arc<Basis>,
    virial: Option<Arc<Virial>>,
    rest: Option<formal::Rest>,
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
        let rest = formal::Rest::of(&written);
        let virial = Virial::of(&written).map(Arc::new);
        Ok(System { written, basis, virial, rest, fingerprint })
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

/// Arguments of a system, in their order: what is the same for all, then what is of an equation, of an interaction, of a member, then
/// other liquids and the heat.
///
/// The constant of an equation follows from six terms, as a number of an interaction does, with the temperature T in K:
/// `ln K = k0 + k1 / T + k2 ln T + k3 T + k4 / T^2 + k5 T^2`. The equation of energy is
/// `heat = heat of formation + capacity * (T - reference)`; where `capacity` has no end, the temperature is `reference`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    members: usize,
    equations: usize,
    /// Numbers of [`Interactions`].
    interactions: usize,
    /// Members in other liquids.
    extracted: usize,
}

impl Layout {
    /// Numbers of [`Activities`], which come first.
    pub const ACTIVITIES: usize = 7;

    /// Numbers of [`Coefficients`], of each member.
    pub const COEFFICIENTS: usize = 4;

    /// Terms of which the logarithm of a constant is the sum.
    pub const TERMS: usize = 6;

    /// How many arguments there are.
    pub fn count(self) -> usize {
        self.reference() + 1
    }

    /// The terms of the constant of an equation begin here.
    pub fn constant(self, equation: usize) -> usize {
        Self::ACTIVITIES + Self::TERMS * equation
    }

    /// Enthalpy of an equation at the reference temperature, J/mol.
    pub fn enthalpy(self, equation: usize) -> usize {
        self.constant(self.equations) + equation
    }

    /// The terms of a number of [`Interactions`] begin here: all numbers of the first one, then those of the next.
    pub fn interaction(self, number: usize) -> usize {
        self.enthalpy(self.equations) + Self::TERMS * number
    }

    /// The numbers of [`Coefficients`] of a member begin here.
    pub fn coefficients(self, member: usize) -> usize {
        self.interaction(self.interactions) + Self::COEFFICIENTS * member
    }

    /// Heat capacity of a member, J/(mol*K).
    pub fn capacity_of(self, member: usize) -> usize {
        self.coefficients(self.members) + member
    }

    /// The amount of a member as it was put there, mol.
    pub fn amount(self, member: usize) -> usize {
        self.capacity_of(self.members) + member
    }

    /// The mass of the liquid that a member is in, counted among [`Phase::Extracted`] ones, kg.
    pub fn liquid(self, extracted: usize) -> usize {
        self.amount(self.members) + extracted
    }

    /// Half the sum of amount times charge squared over the ions that take part in no equation, mol.
    pub fn bystanders(self) -> usize {
        self.liquid(self.extracted)
    }

    /// The amount of these, mol.
    pub fn bystander_amount(self) -> usize {
        self.bystanders() + 1
    }

    /// Heat content, J.
    pub fn heat(self) -> usize {
        self.bystanders() + 2
    }

    /// Heat capacity of all as it was put there, J/K; without end where the temperature is given.
    pub fn capacity(self) -> usize {
        self.bystanders() + 3
    }

    /// The temperature at which heat contents are 0, K, or the one that is given.
    pub fn reference(self) -> usize {
        self.bystanders() + 4
    }

    /// What an argument is.
    fn role(self, arg: usize) -> Role {
        let within = |start: usize, each: usize| ((arg - start) / each, (arg - start) % each);
        if arg < Self::ACTIVITIES {
            Role::Activities(arg)
        } else if arg < self.enthalpy(0) {
            let (equation, term) = within(self.constant(0), Self::TERMS);
            Role::Constant(equation, term)
        } else if arg < self.interaction(0) {
            Role::Enthalpy(arg - self.enthalpy(0))
        } else if arg < self.coefficients(0) {
            let (number, term) = within(self.interaction(0), Self::TERMS);
            Role::Interaction(number, term)
        } else if arg < self.capacity_of(0) {
            let (member, number) = within(self.coefficients(0), Self::COEFFICIENTS);
            Role::Coefficient(member, number)
        } else if arg < self.amount(0) {
            Role::CapacityOf(arg - self.capacity_of(0))
        } else if arg < self.liquid(0) {
            Role::Amount(arg - self.amount(0))
        } else if arg < self.bystanders() {
            Role::Liquid(arg - self.liquid(0))
        } else {
            let last = [Role::Bystanders, Role::BystanderAmount, Role::Heat, Role::Capacity, Role::Reference];
            last[arg - self.bystanders()]
        }
    }
}

/// What an argument is, with the number of the equation or member that it is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Activities(usize),
    Constant(usize, usize),
    Enthalpy(usize),
    Interaction(usize, usize),
    Coefficient(usize, usize),
    CapacityOf(usize),
    Amount(usize),
    Liquid(usize),
    Bystanders,
    BystanderAmount,
    Heat,
    Capacity,
    Reference,
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
        let interactions = self.virial.as_ref().map_or(0, |virial| virial.count());
        let extracted = self.basis.extracted.len();
        Layout { members: self.written.members.len(), equations: self.written.equations.len(), interactions, extracted }
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
