//! How the lab evolves: states, derivatives, events, mixtures and their ledgers, flattened over the instances.

use serde::{Deserialize, Serialize};

use crate::equilibrium::{Part, Phase};
use crate::scene::InstanceId;
use crate::{Code, Graph, NodeId, Op, Said, Severity, Span, Unit};

/// What the numbers of a discrete or continuous state mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Domain {
    /// A quantity, with the unit it is shown in.
    Quantity(Unit),
    /// 1 or 0.
    Bool,
    /// An instance by index, or -1 for nothing.
    Instance,
    /// One of these words by index.
    Enum(Vec<String>),
}

/// One entry of the state vector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// `hotplate.target`, `beaker.contents.amount[EtI]`.
    pub name: String,
    /// What it means and how it is shown.
    pub domain: Domain,
    /// Its value when the run begins; depends on parameters and constants only.
    pub initial: NodeId,
    /// Magnitude below which differences do not matter, SI, where that is declared: the absolute error tolerance is derived
    /// from it, and elsewhere from the values that the state has.
    #[serde(default)]
    pub scale: Option<f64>,
    /// Its declaration.
    pub span: Span,
}

/// A number that may be varied without compiling again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Param {
    /// `hotplate.gain`, `ethyl_iodide.rate.Ea`, `target`.
    pub name: String,
    /// SI.
    pub value: f64,
    /// As the user wrote it.
    pub unit: Unit,
    /// Where its value is given.
    pub span: Span,
}

/// `d state / dt = rate`, already summed over the processes, each zero while its condition is false.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Derivative {
    /// Index into [`Model::states`].
    pub state: u32,
    /// SI per second.
    pub rate: NodeId,
    /// What it is the sum of; empty where that is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<Contribution>,
}

impl Derivative {
    /// A rate of which nobody knows what it is the sum of.
    pub fn new(state: u32, rate: NodeId) -> Self {
        Derivative { state, rate, terms: Vec::new() }
    }
}

/// What one line of a process adds to a rate or a flow while the process runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Contribution {
    /// Index into [`Model::processes`].
    pub process: u32,
    /// SI; without the condition of the process.
    pub node: NodeId,
    /// Its line: `heat_flow -= q`.
    pub span: Span,
}

/// A sum that processes add up and that others use: heat that flows into a body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flow {
    /// `beaker.heat_flow`.
    pub name: String,
    /// The sum.
    pub node: NodeId,
    /// What it is the sum of.
    pub terms: Vec<Contribution>,
}

/// Where an operation stands that may leave a number without a value: a quotient, a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// The operation.
    pub node: NodeId,
    /// Its text, where it is written first.
    pub span: Span,
}

/// One process on its instances, for time lines: the derivative already contains it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Process {
    /// `conduction(hotplate, beaker)`, `mass_action(beaker.contents, ethyl_iodide)`.
    pub name: String,
    /// While this is not 0 the process runs; absent if it always does.
    pub guard: Option<NodeId>,
    /// Its declaration.
    pub span: Span,
}

/// An instantaneous change of the state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// `state = value`.
    Assign {
        /// Index into [`Model::states`].
        state: u32,
        /// Evaluated when the action's turn comes.
        value: NodeId,
        /// Its statement.
        span: Span,
    },
    /// Moves the fraction `fraction` of every extensive quantity, but of what stays behind, from one mixture to another.
    Move {
        /// 0 to 1; outside is a fault.
        fraction: NodeId,
        /// What is held back; of all other quantities of the source nothing is.
        #[serde(default, skip_serializing_if = "<[Kept]>::is_empty")]
        but: Box<[Kept]>,
        /// Index into [`Model::mixtures`].
        from: u32,
        /// Index into [`Model::mixtures`].
        to: u32,
        /// Its statement.
        span: Span,
    },
}

/// What a transfer leaves behind of one extensive quantity of its source, whatever fraction of the rest it takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// The quantity, an index into [`Model::states`].
    pub state: u32,
    /// How much of it stays.
    pub stays: Stays,
}

/// How much of a quantity stays behind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stays {
    /// This share of it, 0 to 1.
    Share(NodeId),
    /// So much of it.
    Amount(NodeId),
}

impl Stays {
    /// The node that it takes its value from.
    pub fn source(self) -> NodeId {
        match self {
            Stays::Share(node) | Stays::Amount(node) => node,
        }
    }

    /// How much stays of a quantity that is `now`, where the node is worth `value`.
    pub fn of(self, now: f64, value: f64) -> f64 {
        match self {
            Stays::Share(_) => value * now,
            Stays::Amount(_) => value,
        }
    }
}

impl Kept {
    /// What stays of the quantity where [`Stays::source`] is worth `value`, if that can be: a share is 0 to 1, to rounding.
    pub fn amount(&self, now: f64, value: f64) -> Option<f64> {
        let possible = match self.stays {
            Stays::Share(_) => (-SHARE_ROUNDING..=1.0 + SHARE_ROUNDING).contains(&value),
            Stays::Amount(_) => value.is_finite(),
        };
        let value = if matches!(self.stays, Stays::Share(_)) { value.clamp(0.0, 1.0) } else { value };
        possible.then(|| self.stays.of(now, value))
    }
}

/// A share that stays behind is outside 0 to 1 only if it is so by more than this.
pub const SHARE_ROUNDING: f64 = 1e-9;

impl Action {
    /// The node that it takes its value from; what it leaves behind has [others](Action::but).
    pub fn source(&self) -> NodeId {
        match self {
            Action::Assign { value, .. } => *value,
            Action::Move { fraction, .. } => *fraction,
        }
    }

    /// All nodes that it takes values from.
    pub fn sources(&self) -> impl Iterator<Item = NodeId> + '_ {
        std::iter::once(self.source()).chain(self.but().iter().map(|kept| kept.stays.source()))
    }

    /// What a transfer leaves behind.
    pub fn but(&self) -> &[Kept] {
        match self {
            Action::Assign { .. } => &[],
            Action::Move { but, .. } => but,
        }
    }

    /// The state that it assigns.
    pub fn assigned(&self) -> Option<u32> {
        match self {
            Action::Assign { state, .. } => Some(*state),
            Action::Move { .. } => None,
        }
    }
}

/// Actions that happen, in order, each time `when` becomes true; true at the start counts as becoming true.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// `dissolution(beaker.contents, KI)`.
    pub name: String,
    /// The condition.
    pub when: NodeId,
    /// What happens.
    pub actions: Vec<Action>,
    /// Its declaration.
    pub span: Span,
}

/// What a device reports of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// `scale.mass`.
    pub name: String,
    /// The device.
    pub instance: InstanceId,
    /// What is measured; without imperfection.
    pub value: NodeId,
    /// Steps of the display, SI.
    pub resolution: Option<f64>,
    /// Standard deviation of the noise, SI.
    pub noise: Option<f64>,
    /// Time between two reports, s; conditions on a reading are looked at this often.
    pub period: Option<f64>,
    /// As shown.
    pub unit: Unit,
    /// Its declaration.
    pub span: Span,
}

/// A chemical species that occurs in the program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Species {
    /// `EtI`, `SO4^2-`, `KNO3(s)`.
    pub name: String,
    /// Hill formula; empty for an undefined structure kept by mass.
    pub formula: String,
    /// Atoms per unit, by element symbol.
    pub elements: Vec<(String, f64)>,
    /// Elementary charges.
    pub charge: i32,
    /// kg/mol. For a species kept by mass 1 kg/mol, so that its "amount" in mol is its mass in kg.
    pub molar_mass: f64,
    /// Whether it has no defined structure and is counted by mass.
    pub by_mass: bool,
    /// Its declaration.
    pub span: Span,
}

/// The amount of one species in one mixture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Index into [`Model::species`].
    pub species: u32,
    /// Index into [`Model::states`]; mol. Where equilibria have the species, this is what was put there.
    pub state: u32,
    /// Index into [`Model::observables`]: what there is of it at equilibrium.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settled: Option<u32>,
}

/// A mixture: what a transfer takes a fraction of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mixture {
    /// The instance, as in `beaker.contents`.
    pub instance: InstanceId,
    /// Every extensive quantity by its key (`enthalpy`, `amount[EtI]`), sorted by key; index into [`Model::states`].
    pub extensive: Vec<(String, u32)>,
    /// The extensive quantities that are amounts of species.
    pub contents: Vec<Content>,
    /// Properties worth reporting (mass, volume, temperature, color); index into [`Model::observables`].
    pub properties: Vec<u32>,
    /// The library's concentration of each entry of `contents`; index into [`Model::observables`].
    pub concentrations: Vec<u32>,
}

impl Model {
    /// Whether equilibria have what stands for a content as a pure solid.
    pub fn is_solid(&self, content: &Content) -> bool {
        let settled = content.settled.and_then(|i| self.observables.get(i as usize)?.value.first());
        let Some(Op::Solved(call, _)) = settled.map(|node| self.graph.op(*node)) else { return false };
        let call = self.graph.call(call);
        let Part::Amount(member) = call.part else { return false };
        call.system.members().get(member as usize).is_some_and(|m| m.phase == Phase::Solid)
    }
}

/// What stands behind a number outside the range of its model, wherever numbers are shown.
pub const OUTSIDE: &str = " (outside its model)";

/// A named quantity that follows from the state, recorded beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observable {
    /// `beaker.contents.temperature`, `beaker.contents[EtI]`.
    pub name: String,
    /// One node, or several for a tuple such as a colour.
    pub value: Vec<NodeId>,
    /// As shown.
    pub unit: Unit,
    /// Index into [`Model::observables`] of the condition under which its model holds: 1 where it does, 0 elsewhere. Absent where it always does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid: Option<u32>,
}

/// What a process does to a sum that it should not change, where its form does not show that this is nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// Index into [`Model::processes`].
    pub process: u32,
    /// The state that integrates it.
    pub state: u32,
}

/// A sum over the whole lab that changes only by what crosses its boundary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    /// `energy`, `element C`, `charge`, `mass`.
    pub name: String,
    /// The sum.
    pub total: NodeId,
    /// What came in through the boundary since the start (negative: went out), as states that integrate each process.
    pub exchanges: Vec<u32>,
    /// As shown.
    pub unit: Unit,
    /// Magnitude against which the error is judged, SI: the sum of the magnitudes of the terms.
    pub magnitude: NodeId,
    /// The states that are added up, each with its factor.
    #[serde(default)]
    pub terms: Vec<(u32, f64)>,
    /// Processes that may make or lose some.
    #[serde(default)]
    pub doubts: Vec<Doubt>,
}

/// A temperature that a law or effect of the user's own may spoil.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suspect {
    /// `cup.contents.temperature`.
    pub name: String,
    /// Its value, K.
    pub value: NodeId,
    /// The law: `over(still)`.
    pub law: String,
    /// Its place in the text.
    pub span: Span,
    /// The law carries matter without its heat, and nothing else makes or takes heat there but contact.
    pub heatless: bool,
}

/// What a run watches where laws or effects of the user's own change mixtures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Temperatures {
    /// What is watched.
    pub suspects: Vec<Suspect>,
    /// All others, K.
    pub others: Vec<NodeId>,
    /// Amounts that laws of the user's own may take more of than there is.
    #[serde(default)]
    pub drained: Vec<Drained>,
}

/// An amount that a law or effect of the user's own may bring below nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drained {
    /// Index into [`Model::states`].
    pub state: u32,
    /// The law: `over(still)`.
    pub law: String,
    /// Its place in the text.
    pub span: Span,
}

/// Ions by their index into [`Model::species`], with their number.
pub type Ions = Vec<(u32, f64)>;

/// Two species that should not be in one mixture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Incompatible {
    /// Index into [`Model::species`].
    pub species: (u32, u32),
    /// The ions of each by their index and number, where it dissolves: where all of them are, it counts as there.
    pub ions: (Ions, Ions),
    /// Content of each from which on it counts, mol per kg of mixture (kg per kg where it is counted by mass).
    pub least: (f64, f64),
    /// How bad it is.
    pub severity: Severity,
    /// What happens: `toxic gas`.
    pub words: String,
    /// Why, and where that is published.
    pub help: Vec<String>,
}

/// A hazard or caution of a library or file, on its instances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Danger {
    /// What it is declared as, by which handlers take it.
    #[serde(default)]
    pub name: String,
    /// The kind of finding.
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// It is there while this is not 0.
    pub when: NodeId,
    /// `above boiling point: `plate` and `beaker``.
    pub headline: String,
    /// What is so, for each that it asks about: the first whose node holds counts, before the headline.
    #[serde(default)]
    pub said: Vec<Said>,
    /// The first thing it is about.
    #[serde(default)]
    pub about: Option<InstanceId>,
    /// How to mend it.
    pub help: Vec<String>,
    /// Its declaration.
    pub span: Span,
}

/// How what a robot holds may be moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// The thing.
    pub instance: InstanceId,
    /// The volume of its contents that is free to run out over its rim, m3; 0 where nothing can.
    pub loose: Option<NodeId>,
    /// The share of what the grip on it bears that an acceleration, of gravity or of a motion, of 1 m/s2 takes up.
    pub taxed: Option<NodeId>,
    /// Its mass with what it contains, kg, where that may change.
    #[serde(default)]
    pub gross: Option<NodeId>,
    /// The volume of what it contains, m3, closed up or not.
    #[serde(default)]
    pub filling: Option<NodeId>,
}

/// How fast a robot goes, where that is not as fast as its joints can.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// The robot.
    pub robot: InstanceId,
    /// How many times as long its motions take.
    pub slowness: Option<NodeId>,
    /// The greatest speed of its tip, m/s.
    pub tip_speed: Option<NodeId>,
}

/// The flattened model of one lab.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Every expression of the model and of the plan.
    pub graph: Graph,
    /// Numbers that may be varied.
    pub params: Vec<Param>,
    /// The state vector.
    pub states: Vec<State>,
    /// At most one per state; a state without one changes only by actions.
    pub derivatives: Vec<Derivative>,
    /// Sums that processes add up and that derivatives use.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flows: Vec<Flow>,
    /// Operations that may have no value, by their node, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<Place>,
    /// For time lines.
    pub processes: Vec<Process>,
    /// In the order in which they fire within an instant.
    pub events: Vec<Event>,
    /// What devices report.
    pub readings: Vec<Reading>,
    /// Species of the program.
    pub species: Vec<Species>,
    /// Mixtures of the lab.
    pub mixtures: Vec<Mixture>,
    /// How things may be moved that robots hold; only in labs with robots.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Robots that go slower than they can.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paces: Vec<Pace>,
    /// Derived quantities to record.
    pub observables: Vec<Observable>,
    /// Sums that must close.
    pub balances: Vec<Balance>,
    /// Temperatures that must stay physical.
    #[serde(default)]
    pub temperatures: Temperatures,
    /// What should not meet, of what may be in one mixture of the lab.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub incompatible: Vec<Incompatible>,
    /// What should not come about.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dangers: Vec<Danger>,
}
