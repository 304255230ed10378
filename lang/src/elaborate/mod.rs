//! Elaboration: a lab's instances, their parameters and states, and the laws that hold over them, as one flat model.

pub mod balances;
pub mod contents;
pub mod fields;
pub mod instances;
pub mod lab;
pub mod laws;
pub mod prune;
pub mod reach;
pub mod reactions;
pub mod solutions;
pub mod species;
pub mod states;
pub mod tables;
pub mod units;

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model;
use matterix_ir::plan::Comparison;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Env, Graph, NodeId, Op, Span};

use crate::ast::{self, Expr, FieldValue};
pub use crate::eval::SpeciesId;
use crate::eval::{Type, Value};
use crate::names::DeclId;
use crate::units::Dimension;

pub use instances::Instance;
pub use tables::Tables;

/// A member in one way of looking: capability, name, initial value or current one, readings or true values.
pub type MemberKey = (DeclId, String, bool, bool);

/// A pair parameter as a lab gives it: `between a and b { name: value }`.
#[derive(Debug)]
pub struct Pair<'a> {
    /// One.
    pub a: InstanceId,
    /// The other.
    pub b: InstanceId,
    /// The function it overrides.
    pub name: String,
    /// Its value.
    pub value: &'a Expr,
    /// The lab's module.
    pub module: usize,
    /// Its value once evaluated.
    pub resolved: Option<Value>,
}

/// One contribution of a process to a flow or a derivative, without the process's condition.
#[derive(Clone, Debug)]
pub struct Contribution {
    /// Index into [`Elaborator::processes`].
    pub process: usize,
    /// SI.
    pub node: NodeId,
}

/// A process on its instances.
#[derive(Clone, Debug)]
pub struct ProcessInstance {
    /// `conduction(hotplate, beaker)`.
    pub name: String,
    /// When it runs; absent for always.
    pub guard: Option<NodeId>,
    /// Its declaration.
    pub span: Span,
}

/// A quantity that a transfer moves, and where.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExtensiveKey {
    /// The mixture.
    pub instance: InstanceId,
    /// `enthalpy`, `amount`.
    pub member: String,
    /// For amounts per species.
    pub species: Option<SpeciesId>,
}

/// Working state of the elaboration of one lab (or of a prototype).
pub struct Elaborator<'a> {
    /// What is declared.
    pub tables: &'a Tables<'a>,
    /// Every expression.
    pub graph: Graph,
    /// Findings so far.
    pub diagnostics: Vec<Diagnostic>,
    /// Instances; parts after owners.
    pub instances: Vec<Instance<'a>>,
    /// Where the lab's name stands.
    pub lab_name: Span,
    /// Settings of the lab, such as `ambient`.
    pub settings: BTreeMap<String, Value>,
    /// Pair parameters.
    pub pairs: Vec<Pair<'a>>,
    /// Parameters of the model.
    pub params: Vec<model::Param>,
    /// States of the model.
    pub states: Vec<model::State>,
    /// For states that hold an instance: what they may hold, copied states included.
    pub holds: BTreeMap<u32, BTreeSet<i64>>,
    /// Copies between states that hold instances: to, from.
    pub copies: BTreeSet<(u32, u32)>,
    /// Extensive quantities by place.
    pub extensive: BTreeMap<ExtensiveKey, u32>,
    /// Readings taken by the plan.
    pub readings: Vec<model::Reading>,
    /// Species that can get into each mixture.
    pub reach: reach::Reach,
    /// Transfers found between mixtures.
    pub moves: BTreeSet<(InstanceId, InstanceId)>,
    /// The instance each state belongs to.
    pub state_owner: Vec<InstanceId>,
    /// What each complete flow is made of, by the node of its sum.
    pub flow_sums: BTreeMap<NodeId, Vec<Contribution>>,
    /// Contributions to flows.
    pub flows: BTreeMap<(InstanceId, DeclId, String), Vec<Contribution>>,
    /// Contributions to derivatives, by state.
    pub rates: BTreeMap<u32, Vec<Contribution>>,
    /// Processes found so far.
    pub processes: Vec<ProcessInstance>,
    /// Flows are complete: they may be read.
    pub flows_sealed: bool,
    /// A flow was read while it was not complete.
    pub touched_flow: bool,
    /// Concentrations by mixture, species, capability and kind.
    pub view_values: BTreeMap<(InstanceId, SpeciesId, DeclId, Dimension), Value>,
    /// What the expression evaluated last compared.
    pub comparisons: Vec<(Span, Comparison)>,
    /// Values are those at the start of the run.
    pub initial_mode: bool,
    /// Readings are what the device reports, not the true values behind them.
    pub readings_live: bool,
    /// A declaration is checked by itself, on stand-ins.
    pub prototype: bool,
    /// While a rate is evaluated: the name its arguments get as parameters.
    pub rate_prefix: Option<String>,
    /// Members being evaluated.
    pub open_members: Vec<(InstanceId, MemberKey)>,
    /// Functions being evaluated.
    pub open_calls: Vec<DeclId>,
    /// Constants being evaluated.
    pub open_consts: Vec<DeclId>,
}

impl<'a> Elaborator<'a> {
    /// An empty lab.
    pub fn new(tables: &'a Tables<'a>, reach: reach::Reach) -> Self {
        Elaborator {
            tables,
            graph: Graph::default(),
            diagnostics: Vec::new(),
            instances: Vec::new(),
            lab_name: Span::default(),
            settings: BTreeMap::new(),
            pairs: Vec::new(),
            params: Vec::new(),
            states: Vec::new(),
            holds: BTreeMap::new(),
            copies: BTreeSet::new(),
            extensive: BTreeMap::new(),
            readings: Vec::new(),
            reach,
            moves: BTreeSet::new(),
            state_owner: Vec::new(),
            flow_sums: BTreeMap::new(),
            flows: BTreeMap::new(),
            rates: BTreeMap::new(),
            processes: Vec::new(),
            flows_sealed: false,
            touched_flow: false,
            view_values: BTreeMap::new(),
            comparisons: Vec::new(),
            initial_mode: false,
            readings_live: false,
            prototype: false,
            rate_prefix: None,
            open_members: Vec::new(),
            open_calls: Vec::new(),
            open_consts: Vec::new(),
        }
    }

    /// Adds a finding, once.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        if !self.diagnostics.contains(&diagnostic) {
            self.diagnostics.push(diagnostic);
        }
    }

    /// Resolves a type as written in a module.
    pub fn resolve_type(&mut self, ty: &ast::Type, module: usize) -> Type {
        let mut found = Vec::new();
        let ty = self.tables.resolve_type(ty, module, &mut found);
        for d in found {
            self.report(d);
        }
        ty
    }

    /// A setting of the lab; on prototypes `ambient` stands for any temperature.
    pub fn setting(&mut self, name: &str) -> Option<Value> {
        if let Some(v) = self.settings.get(name) {
            return Some(v.clone());
        }
        if self.prototype && name == "ambient" {
            let dimension = self.tables.units.dimension("Temperature")?.dimension.clone();
            let ty = Type::Quantity { dimension, point: true, optional: false };
            let v = self.placeholder(&ty, name);
            self.settings.insert(name.to_string(), v.clone());
            return Some(v);
        }
        None
    }

    /// The value of a node that depends on nothing but parameters.
    pub fn known(&self, node: NodeId) -> Option<f64> {
        let live = |op: &Op| matches!(op, Op::State(_) | Op::Time | Op::Reading(_) | Op::Local(_));
        if self.graph.depends(node, live) {
            return None;
        }
        let params: Vec<f64> = self.params.iter().map(|p| p.value).collect();
        let env = Env { time: 0.0, states: &[], params: &params, locals: &[], readings: &[] };
        Some(self.graph.eval(node, env))
    }

    /// A diagnostic-free look at a field that must be an expression.
    pub fn field_expr(field: &'a FieldValue) -> Option<&'a Expr> {
        match field {
            FieldValue::Expr(e) => Some(e),
            _ => None,
        }
    }
}
