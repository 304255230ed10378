//! Lowering: a workflow becomes the plan, skills written out where they are called.

mod barred;
mod call;
mod clauses;
mod columns;
mod holds;
mod limits;
mod motion;
mod operation;
pub mod roles;
pub mod script;
mod stmt;
mod text;
mod variables;
pub mod wires;

pub use crate::declare::failures::FAILURES;
pub use wires::Wires;

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::Arc;

use matterix_ir::plan::{Condition, Local, Plan, PlanStep, Step, StepId};
use matterix_ir::script::Wiring;
use matterix_ir::{Sources, Span, Unit};
use rustc_hash::{FxHashMap, FxHashSet};

use self::clauses::Clauses;
use self::variables::Undecided;
use crate::ast::{Block, Clause, Handlers, ItemKind};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::Mode;
use crate::eval::lab::choices::Choice;
use crate::eval::lab::verbs::Verb;
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::task::{self, Given, Task};

/// Working state of the lowering of one workflow.
pub struct Planner<'a, 'e> {
    /// The lab.
    pub lab: &'e mut Elaborator<'a>,
    /// Source texts, for labels.
    pub sources: &'e Sources,
    /// Nodes so far.
    pub steps: Vec<PlanStep>,
    /// Kept values so far.
    pub locals: Vec<Local>,
    /// Skills written out while a declaration is checked by itself.
    written: FxHashSet<DeclId>,
    /// Skills being written out, outermost first.
    pub open: Vec<DeclId>,
    /// Where `return` puts the result, while a skill's body is lowered.
    pub results: Vec<Option<ResultSlot>>,
    /// The plan is to be run: parameters without a default must have been given.
    pub to_run: bool,
    /// Another value than its default that a parameter of the workflow is supposed to have.
    pub supposed: Option<Choice>,
    /// Depth of failure handlers around.
    pub handlers: usize,
    /// Failures that something declares or raises.
    pub failures: Arc<BTreeSet<String>>,
    /// Jobs started so far.
    pub jobs: BTreeSet<String>,
    /// Names of what is recorded so far.
    columns: BTreeSet<String>,
    /// Positions of the names that stand for a turn's thing in the workflow, as [`Scope::reads`] has them.
    turns: u64,
    /// Positions of the workflow's parameters.
    parameters: u64,
    /// Blocks around, innermost last, that only the run decides about.
    barriers: Vec<variables::Barrier>,
    /// What the call that is being written out says of its sources.
    pub said: Vec<Condition>,
    /// Only what the plan moves where is asked for, not how it reads or what it needs.
    pub draft: bool,
    /// Whether the plan is of no use any more: then no more of it is written out.
    pub of_no_use: &'e dyn Fn() -> bool,
    /// What is asked of drivers.
    pub wires: wires::Wires,
    /// What the framing of the driver at hand lets its messages say.
    pub(crate) speech: wires::Speech,
    /// What is to be sent may be missing: then a driver has nothing to do with the device.
    lenient: bool,
    /// Drivers of the lab, with their declarations.
    drivers: Vec<(DeclId, matterix_ir::wire::Driver)>,
    /// What the lab offers to others.
    offers: matterix_ir::offer::Offers,
    /// What is said over a wire, where that is asked for.
    pub wiring: Option<Wiring>,
    clauses: Clauses,
    /// What the verb of a call can mean, and how many words it has.
    meanings: FxHashMap<Span, (Arc<[Verb<'a>]>, usize)>,
    texts: RefCell<FxHashMap<Span, String>>,
    /// Clauses and limits that a draft has looked at.
    drafted: FxHashSet<Span>,
    /// Conditions that a draft looks at once it knows all that the plan moves, each as its names stand there.
    deferred: Vec<(&'a Clause, Scope)>,
}

/// Where a skill's result goes.
#[derive(Clone, Debug)]
pub struct ResultSlot {
    /// Type of the result.
    pub ty: Type,
    /// Index of its local.
    pub local: u32,
    /// The value as seen by the caller, once returned.
    pub value: Option<Value>,
}

/// Ends the names declared since `depth`, but for those of steps.
pub fn leave(scope: &mut Scope, depth: usize) {
    let inner = scope.vars.split_off(depth);
    scope.variables.retain(|(position, _)| *position < depth);
    scope.vars.extend(inner.into_iter().filter(|(_, v)| matches!(v, Value::Step(..))));
}

impl<'a, 'e> Planner<'a, 'e> {
    /// An empty plan over a lab.
    pub fn new(lab: &'e mut Elaborator<'a>, sources: &'e Sources) -> Self {
        let failures = lab.tables.failures();
        Planner {
            lab,
            sources,
            steps: Vec::new(),
            locals: Vec::new(),
            written: FxHashSet::default(),
            open: Vec::new(),
            results: Vec::new(),
            to_run: false,
            supposed: None,
            handlers: 0,
            failures,
            jobs: BTreeSet::new(),
            columns: BTreeSet::new(),
            turns: 0,
            parameters: 0,
            barriers: Vec::new(),
            said: Vec::new(),
            draft: false,
            of_no_use: &|| false,
            wires: wires::Wires::Off,
            speech: wires::Speech::default(),
            lenient: false,
            drivers: Vec::new(),
            offers: matterix_ir::offer::Offers::default(),
            wiring: None,
            clauses: Clauses::default(),
            meanings: FxHashMap::default(),
            texts: RefCell::default(),
            drafted: FxHashSet::default(),
            deferred: Vec::new(),
        }
    }

    /// Lowers a workflow or a test.
    pub fn task(mut self, task: &Task<'a>) -> (Plan, Option<Wiring>) {
        let decl = self.lab.tables.names.decl(task.item);
        let mut scope = Scope { lab: true, ..Scope::module(decl.module) };
        self.supposed.clone_from(&task.supposed);
        self.begin_wires();
        if self.wires == wires::Wires::Offered {
            self.reported(|plan| {
                plan.begin_offers(task.lab);
                plan.offer_skills(decl.module);
            });
        }
        let mut arguments = Vec::new();
        let root = match &decl.item.kind {
            _ if self.wires == wires::Wires::Offered => {
                self.add("nothing", Span::default(), Step::Sequence(Vec::new()))
            }
            ItemKind::Test { name, lab: Some(_), body, handlers } => {
                self.reported(|plan| plan.guarded(&name.text, name.span, body, handlers, &mut scope))
            }
            ItemKind::Test { name, .. } => {
                let tested = match task::tested(self.lab.tables, task.item) {
                    Ok(tested) => tested,
                    Err(d) => {
                        self.lab.report(*d);
                        None
                    }
                };
                let mut steps = Vec::new();
                if let Some(tested) = tested {
                    scope.module = self.lab.tables.names.decl(tested.workflow).module;
                    steps.push(self.workflow(tested.workflow, &task.given, &mut scope, &mut arguments));
                    scope.module = decl.module;
                    let rest = |plan: &mut Self| tested.rest.iter().filter_map(|s| plan.stmt(s, &mut scope)).collect();
                    let rest: Vec<StepId> = self.reported(rest);
                    steps.extend(rest);
                }
                self.add(format!("test {}", name.text), name.span, Step::Sequence(steps))
            }
            ItemKind::Study { .. } | ItemKind::Fit { .. } => self.many(task, &mut scope, &mut arguments),
            _ => self.workflow(task.item, &task.given, &mut scope, &mut arguments),
        };
        let item = match &decl.item.kind {
            ItemKind::Study { .. } | ItemKind::Fit { .. } => task::workflow_of(self.lab.tables, task.item).ok(),
            _ => None,
        };
        let item = item.map_or(decl.item, |workflow| self.lab.tables.names.decl(workflow).item);
        let name = crate::names::item_name(item).map(|n| n.0).unwrap_or_default();
        if self.draft {
            self.catch_up();
        }
        let limits = self.limits(false);
        if !self.draft {
            self.ask_for_barred();
            self.note_limits(&limits);
        }
        // A test may leave things as it likes.
        let ends = if matches!(decl.item.kind, ItemKind::Workflow { .. }) { self.limits(true) } else { Vec::new() };
        let wiring = self.wired();
        self.lab.offers = self.offers;
        self.lab.drivers = self.drivers.into_iter().map(|(_, driver)| driver).collect();
        arguments.extend(self.lab.data_used());
        let plan = Plan { workflow: name, arguments, steps: self.steps, root, locals: self.locals, limits, ends };
        (plan, wiring)
    }

    /// The steps of a workflow; what its parameters are bound to goes into `shown`. Its parameters that a study or a fit
    /// leaves open have no value.
    pub fn workflow(
        &mut self,
        id: DeclId,
        given: &[Given<'a>],
        scope: &mut Scope,
        shown: &mut Vec<(String, String)>,
    ) -> StepId {
        let ItemKind::Workflow { name, params, body, handlers, .. } = &self.lab.tables.names.decl(id).item.kind else {
            return self.add("nothing", Span::default(), Step::Sequence(Vec::new()));
        };
        let first = scope.vars.len();
        *shown = self.workflow_parameters(params, given, scope);
        self.parameters = (first..scope.vars.len()).fold(0, |all, position| all | Scope::read_bit(position));
        self.reported(|plan| plan.guarded(&name.text, name.span, body, handlers, scope))
    }

    /// Does something where readings are what devices report.
    pub fn reported<R>(&mut self, work: impl FnOnce(&mut Self) -> R) -> R {
        let outer = self.lab.enter_mode(Mode::REPORTED);
        let result = work(self);
        self.lab.enter_mode(outer);
        result
    }

    /// Whether a draft need not look at a clause or limit: it has seen it elsewhere, which tells it what is asked for.
    fn is_drafted(&mut self, clause: Span) -> bool {
        self.draft && !self.drafted.insert(clause)
    }

    /// Adds a node.
    pub fn add(&mut self, label: impl Into<String>, span: Span, step: Step) -> StepId {
        let id = StepId(self.steps.len() as u32);
        self.steps.push(PlanStep { label: label.into(), span, step });
        id
    }

    /// Adds a kept value.
    pub fn local(&mut self, name: impl Into<String>, unit: Unit) -> u32 {
        self.locals.push(Local { name: name.into(), unit });
        self.locals.len() as u32 - 1
    }

    /// A block as a sequence. Names end with it, but for those of its steps: `grow.end` is asked for afterwards.
    pub fn block(&mut self, block: &'a Block, scope: &mut Scope) -> StepId {
        let depth = scope.vars.len();
        let turns = self.turns;
        let steps = self.statements(block, scope);
        leave(scope, depth);
        self.turns = turns;
        self.add("sequence", block.span, Step::Sequence(steps))
    }

    /// The statements of a block, one node each; names they declare stay in scope.
    pub fn statements(&mut self, block: &'a Block, scope: &mut Scope) -> Vec<StepId> {
        block.stmts.iter().filter_map(|s| self.stmt(s, scope)).collect()
    }

    /// A block with its failure handlers.
    pub fn guarded(
        &mut self,
        label: &str,
        span: Span,
        body: &'a Block,
        handlers: &'a Handlers,
        scope: &mut Scope,
    ) -> StepId {
        let inner = self.handled(body, handlers, scope);
        self.with_handlers(label, span, inner, handlers, scope)
    }

    /// A block with its failure handlers, if it has any, before these.
    pub(super) fn handled(&mut self, body: &'a Block, handlers: &'a Handlers, scope: &mut Scope) -> StepId {
        if handlers.on.is_empty() && handlers.finally.is_none() {
            return self.block(body, scope);
        }
        self.undecided(Undecided::Guarded, body.span, scope, |plan, scope| plan.block(body, scope))
    }
}
