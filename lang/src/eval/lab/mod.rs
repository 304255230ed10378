//! A lab in the making, as far as expressions ask for it: its instances with their places, parameters and states, which are made when they are
//! first looked at.

pub mod budget;
pub mod candidates;
pub mod choices;
pub mod coverings;
pub mod extents;
pub mod flows;
pub mod free;
pub mod geometry;
pub mod given;
pub mod grids;
pub mod held;
pub mod inertia;
pub mod instances;
pub mod lineage;
pub mod links;
pub mod mode;
pub mod observed;
pub mod origin;
pub mod properties;
pub mod reach;
pub mod standing;
pub mod states;
pub mod substances;
pub mod targets;
pub mod verbs;
pub mod walls;
mod within;
pub mod written;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, RwLock};

use matterix_ir::equilibrium::{Circle, System, Unsettled};
use matterix_ir::model;
use matterix_ir::plan::{Comparison, StepId, Term};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Graph, Leaves, NodeId, Op, Span};
use rustc_hash::{FxHashMap, FxHashSet};

use self::budget::Budget;
use crate::ast::{self, Expr, FieldValue};
use crate::declare::{MemberRef, ReactionId, SpeciesId, Tables, Type};
use crate::eval::Value;
use crate::eval::call::KnownCall;
use crate::eval::equilibrium::Speciation;
use crate::names::DeclId;
use crate::units::Dimension;

pub use instances::Instance;
pub use mode::Mode;

/// Systems of equilibria by their species and equations.
pub type Systems = BTreeMap<(Vec<SpeciesId>, Vec<usize>, Vec<u64>), Option<Arc<System>>>;

/// A member in one way of looking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MemberKey {
    /// Where its declaration is in memory, which stays there.
    declared: usize,
    mode: Mode,
}

impl MemberKey {
    /// That of a member as it is looked at in a mode.
    pub fn of(m: MemberRef<'_>, mode: Mode) -> Self {
        MemberKey { declared: std::ptr::from_ref(m.member).addr(), mode }
    }
}

/// A pair parameter as a lab gives it: `between a and b { name: value }`.
#[derive(Debug)]
pub struct Pair<'a> {
    /// The first argument.
    pub a: InstanceId,
    /// The second.
    pub b: InstanceId,
    /// It is declared symmetric: it holds in either order.
    pub symmetric: bool,
    /// The function it overrides.
    pub name: String,
    /// Its value.
    pub value: &'a Expr,
    /// The lab's module.
    pub module: usize,
    /// The included lab it is of: empty, or `left.`.
    pub within: String,
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
    /// Its line.
    pub span: Span,
}

/// A process on its instances.
#[derive(Clone, Debug)]
pub struct ProcessInstance {
    /// `conduction(hotplate, beaker)`.
    pub name: String,
    /// When it runs; absent for always.
    pub guard: Option<NodeId>,
    /// The reaction it is about, if it is about one.
    pub reaction: Option<ReactionId>,
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
    /// For quantities of each species.
    pub species: Option<SpeciesId>,
    /// Whether it is matter: an amount of the species.
    pub matter: bool,
}

impl ExtensiveKey {
    /// The species of which it is the amount; nothing where it is no matter.
    pub fn matter(&self) -> Option<SpeciesId> {
        self.species.filter(|_| self.matter)
    }
}

/// A comparison, not yet in words.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Where what is compared is written.
    pub span: Span,
    /// The comparison.
    pub comparison: Comparison,
    /// Names that folds around it give, as written there, with the instances they stand for.
    pub each: Vec<(Span, InstanceId)>,
}

/// What a condition asks of one of several things.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The thing.
    pub of: String,
    /// Not 0 if it holds.
    pub node: NodeId,
    /// What is compared.
    pub compared: Vec<Compared>,
    /// The members that are named.
    pub terms: Vec<Term>,
}

/// Instances, and of how many they were chosen.
type Counted = (usize, Arc<[InstanceId]>);

/// Working state of the elaboration of one lab (or of a prototype).
pub struct Elaborator<'a> {
    /// What is declared.
    pub tables: &'a Tables<'a>,
    /// Every expression.
    pub graph: Graph,
    /// Findings so far.
    pub diagnostics: Vec<Diagnostic>,
    /// How often something was found, known findings included.
    pub reported: usize,
    /// What writing it out has taken so far.
    pub budget: Budget,
    /// Types without findings, by their place in the tree and the module that reads them.
    types: FxHashMap<(usize, usize), Type>,
    /// Instances; parts after owners.
    pub instances: Vec<Instance<'a>>,
    /// Those without an owner, by name.
    pub top_level: FxHashMap<String, InstanceId>,
    /// Those of them that hold matter, in order.
    pub mixtures: Vec<InstanceId>,
    /// Where the lab's name stands.
    pub lab_name: Span,
    /// Settings of the lab, such as `ambient`.
    pub settings: BTreeMap<String, Value>,
    /// Which states say what has touched a mixture, by mixture, then by reagent.
    pub lineage: BTreeMap<InstanceId, BTreeMap<String, u32>>,
    /// Terms of what vessels hold at the start, in the order of the text.
    pub held: Vec<held::Held>,
    /// What the verbs of calls were found to mean, by the place of the call.
    pub verbs: BTreeMap<Span, verbs::Verb<'a>>,
    /// Something asks for lineage.
    pub follows_lineage: bool,
    /// What names of the lab begin with while the text of an included one is read: empty, or `left.`.
    pub within: String,
    /// Full names of included labs.
    pub included: BTreeSet<String>,
    /// Parameters of labs, by what the lab's names begin with and their own name.
    pub lab_values: BTreeMap<(String, String), Value>,
    /// Where included labs stand: their names' beginning, their places, the beginning and the module of those.
    #[allow(clippy::type_complexity)]
    pub places: Vec<(String, &'a [(ast::Name, Expr)], String, usize)>,
    /// A lab is checked by itself: its parameters may have any value.
    pub open_parameters: bool,
    /// Parameters of the workflow that have only their default, by index.
    pub defaulted: BTreeSet<u32>,
    /// Truth values and words among the parameters of the workflow that have only their default.
    pub choices: Vec<choices::Choice>,
    /// Pair parameters.
    pub pairs: Vec<Pair<'a>>,
    /// Parameters of the model.
    pub params: Vec<model::Param>,
    /// What studies and fits may vary.
    pub open: free::FreeParameters,
    /// States of the model.
    pub states: Vec<model::State>,
    /// What states that hold an instance may point at.
    pub targets: targets::Targets,
    /// Extensive quantities by place.
    pub extensive: BTreeMap<ExtensiveKey, u32>,
    /// Amounts that lie outside of all mixtures, as what a gas phase has taken: of which species, and their states.
    pub outside: Vec<(SpeciesId, u32)>,
    /// Names of all fields that are given in the lab, once they were asked for.
    pub given: Option<FxHashSet<&'a str>>,
    /// How devices are spoken to, where that was asked for.
    pub drivers: Vec<matterix_ir::wire::Driver>,
    /// What the lab offers to others.
    pub offers: matterix_ir::offer::Offers,
    /// Readings taken by the plan.
    pub readings: Vec<model::Reading>,
    /// Species that can get into each mixture.
    pub reach: Arc<reach::Reach>,
    /// Species that laws and effects write into mixtures that have no state for them yet.
    pub written: BTreeSet<(InstanceId, SpeciesId)>,
    /// Transfers found between mixtures.
    pub moves: BTreeSet<(InstanceId, InstanceId)>,
    /// What has touched what another thing has touched, without a transfer: from, to.
    pub soiled: BTreeSet<(InstanceId, InstanceId)>,
    /// Transfers that processes make: the process, from, to, and whether anything flows while the process runs.
    pub streams: BTreeMap<(usize, InstanceId, InstanceId), NodeId>,
    /// Where each substance that something holds at the start is written, by the name of what holds it.
    pub held_at: BTreeMap<(String, SpeciesId), Span>,
    /// The instance each state belongs to.
    pub state_owner: Vec<InstanceId>,
    /// What each complete flow is made of, by the node of its sum.
    pub flow_sums: BTreeMap<NodeId, Vec<Contribution>>,
    /// The sum of each complete flow that was read.
    pub flows_read: BTreeMap<(InstanceId, DeclId, String), NodeId>,
    /// Where operations stand that may have no value, as they are written first.
    pub written_at: BTreeMap<NodeId, Span>,
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
    pub view_values: BTreeMap<(InstanceId, SpeciesId), BTreeMap<(DeclId, Dimension), Value>>,
    /// The equilibria of mixtures that were asked for, as they are and with all salts dissolved.
    pub speciations: BTreeMap<(InstanceId, bool), Option<Arc<Speciation>>>,
    /// Systems of equilibria by their species and equations.
    pub systems: Systems,
    /// Where constants of all equilibria of the file follow from each other, once that was asked for.
    pub circles: Option<Arc<Result<Vec<Circle>, Unsettled>>>,
    /// What evaluations come upon besides values, where somebody asks: see [`Elaborator::observe`].
    pub observed: Option<Box<observed::Observed>>,
    /// Where a call says of what it takes something, and its sources are looked into.
    pub looked_into: BTreeSet<Span>,
    /// The species that a condition asks for, and that can never get into the mixture asked, by the place of the condition.
    pub absent_in: BTreeMap<Span, Vec<(InstanceId, SpeciesId)>>,
    /// Conditions of the workflow's own branches that read its parameters, by their place.
    pub by_parameters: BTreeSet<Span>,
    /// How values are looked at.
    mode: Mode,
    /// A declaration is checked by itself, on stand-ins.
    pub prototype: bool,
    /// Only what goes where is asked for: laws that move nothing are left out.
    pub draft: bool,
    /// While a rate is evaluated: the name its arguments get as parameters.
    pub rate_prefix: Option<String>,
    /// Calls of skills being written out, outermost first.
    pub calls: Vec<Span>,
    /// Kinds of which the text of the lab or the workflow goes through all instances.
    pub gone_through: BTreeSet<DeclId>,
    /// Tables that the lab or the plan is made of.
    pub tables_used: BTreeSet<DeclId>,
    /// Turns of the plan for rows of a table: where the row stands.
    pub rows: BTreeMap<StepId, Span>,
    /// What a node that picks an instance may give.
    pub picks: BTreeMap<NodeId, Vec<InstanceId>>,
    /// Values of functions of instances, as far as they were asked for.
    pub known_calls: FxHashMap<KnownCall, Value>,
    /// Values of properties of species, as far as they were asked for.
    pub known_properties: FxHashMap<SpeciesId, Vec<(Box<str>, Value)>>,
    /// What names that modules see stand for, as far as they were looked up, by module.
    pub looked_up: Vec<FxHashMap<Box<str>, DeclId>>,
    /// What parts of things that are alike are shaped like.
    pub known_geometries: FxHashMap<geometry::Alike, geometry::Geometry>,
    /// What vessels keep when they are tilted, by the outlines of their insides.
    pub known_tilts: FxHashMap<Vec<u64>, crate::eval::Tilts>,
    /// Instances by kind, and how many there were when they were looked for.
    pub by_kind: RwLock<BTreeMap<DeclId, Counted>>,
    /// Members being evaluated.
    pub open_members: Vec<(InstanceId, MemberKey)>,
    /// Functions being evaluated.
    pub open_calls: Vec<DeclId>,
    /// Constants being evaluated.
    pub open_consts: Vec<DeclId>,
    /// What names and expressions were found to mean, where that is asked for.
    pub meanings: Option<Box<crate::semantic_index::Meanings>>,
    /// Constants that were evaluated without a finding.
    pub known_consts: FxHashMap<DeclId, Value>,
}

impl<'a> Elaborator<'a> {
    /// An empty lab.
    pub fn new(tables: &'a Tables<'a>, reach: reach::Reach) -> Self {
        Elaborator {
            tables,
            graph: Graph::default(),
            diagnostics: Vec::new(),
            reported: 0,
            budget: Budget::default(),
            types: FxHashMap::default(),
            instances: Vec::new(),
            top_level: FxHashMap::default(),
            mixtures: Vec::new(),
            lab_name: Span::default(),
            settings: BTreeMap::new(),
            lineage: BTreeMap::new(),
            held: Vec::new(),
            verbs: BTreeMap::new(),
            follows_lineage: false,
            within: String::new(),
            included: BTreeSet::new(),
            lab_values: BTreeMap::new(),
            places: Vec::new(),
            open_parameters: false,
            defaulted: BTreeSet::new(),
            choices: Vec::new(),
            pairs: Vec::new(),
            params: Vec::new(),
            open: free::FreeParameters::default(),
            states: Vec::new(),
            targets: targets::Targets::default(),
            extensive: BTreeMap::new(),
            outside: Vec::new(),
            drivers: Vec::new(),
            offers: matterix_ir::offer::Offers::default(),
            readings: Vec::new(),
            reach: Arc::new(reach),
            written: BTreeSet::new(),
            moves: BTreeSet::new(),
            soiled: BTreeSet::new(),
            streams: BTreeMap::new(),
            held_at: BTreeMap::new(),
            state_owner: Vec::new(),
            flow_sums: BTreeMap::new(),
            flows_read: BTreeMap::new(),
            written_at: BTreeMap::new(),
            flows: BTreeMap::new(),
            rates: BTreeMap::new(),
            processes: Vec::new(),
            flows_sealed: false,
            touched_flow: false,
            speciations: BTreeMap::new(),
            systems: BTreeMap::new(),
            circles: None,
            view_values: BTreeMap::new(),
            observed: None,
            looked_into: BTreeSet::new(),
            absent_in: BTreeMap::new(),
            by_parameters: BTreeSet::new(),
            mode: Mode::default(),
            prototype: false,
            draft: false,
            rate_prefix: None,
            calls: Vec::new(),
            gone_through: BTreeSet::new(),
            tables_used: BTreeSet::new(),
            rows: BTreeMap::new(),
            picks: BTreeMap::new(),
            known_calls: FxHashMap::default(),
            known_properties: FxHashMap::default(),
            looked_up: Vec::new(),
            known_geometries: FxHashMap::default(),
            known_tilts: FxHashMap::default(),
            by_kind: RwLock::default(),
            open_members: Vec::new(),
            given: None,
            open_calls: Vec::new(),
            open_consts: Vec::new(),
            meanings: None,
            known_consts: FxHashMap::default(),
        }
    }

    /// Adds a finding, once.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        self.reported += 1;
        if !self.diagnostics.contains(&diagnostic) {
            self.diagnostics.push(diagnostic);
        }
    }

    /// Resolves a type as written in a module.
    pub fn resolve_type(&mut self, ty: &'a ast::Type, module: usize) -> Type {
        self.resolve(ty, module, Tables::resolve_type)
    }

    /// Resolves the type of a parameter, without its `where`.
    pub fn resolve_parameter_type(&mut self, ty: &'a ast::Type, module: usize) -> Type {
        self.resolve(ty, module, Tables::resolve_parameter_type)
    }

    /// A type as it was resolved before, or as `how` resolves it: the same few stand in all calls of a command.
    fn resolve(
        &mut self,
        ty: &'a ast::Type,
        module: usize,
        how: fn(&Tables<'a>, &ast::Type, usize, &mut Vec<Diagnostic>) -> Type,
    ) -> Type {
        let key = (std::ptr::from_ref(ty).addr(), module);
        if let Some(known) = self.types.get(&key) {
            return known.clone();
        }
        let mut found = Vec::new();
        let resolved = how(self.tables, ty, module, &mut found);
        if found.is_empty() && ty.condition.is_none() {
            self.types.insert(key, resolved.clone());
        }
        for d in found {
            self.report(d);
        }
        resolved
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

    /// The value of a node that depends on nothing but parameters, for a decision: it stays as it is, whatever the
    /// parameters are in a run.
    pub fn known(&self, node: NodeId) -> Option<f64> {
        self.open.fix(&self.graph, node);
        self.glance(node)
    }

    /// The same for what is only said or judged.
    pub fn glance(&self, node: NodeId) -> Option<f64> {
        if self.graph.leaves(node).meets(Leaves::LIVE) {
            return None;
        }
        Some(self.graph.eval_on(node, |leaf| match leaf {
            Op::Const(v) => v,
            Op::Param(i) => self.params[i as usize].value,
            _ => f64::NAN,
        }))
    }

    /// A diagnostic-free look at a field that must be an expression.
    pub fn field_expr(field: &'a FieldValue) -> Option<&'a Expr> {
        match field {
            FieldValue::Expr(e) => Some(e),
            _ => None,
        }
    }
}
