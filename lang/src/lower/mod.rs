//! Lowering: a workflow becomes the plan, skills written out where they are called.

mod call;
mod operation;
mod stmt;
mod text;

use std::collections::BTreeSet;

use matterix_ir::plan::{Local, Plan, PlanStep, Step, StepId};
use matterix_ir::{Sources, Span, Unit};

use crate::ast::{Block, Handlers, ItemKind};
use crate::elaborate::Elaborator;
use crate::eval::{Scope, Type, Value};
use crate::names::DeclId;

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
    /// Skills being written out, outermost first.
    pub open: Vec<DeclId>,
    /// Where `return` puts the result, while a skill's body is lowered.
    pub results: Vec<Option<ResultSlot>>,
    /// The plan is to be run: parameters without a default must have been given.
    pub to_run: bool,
    /// Depth of failure handlers around.
    pub handlers: usize,
    /// Failures that something declares or raises.
    pub failures: BTreeSet<String>,
    /// Jobs started so far.
    pub jobs: BTreeSet<String>,
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
    scope.vars.extend(inner.into_iter().filter(|(_, v)| matches!(v, Value::Step(..))));
}

impl<'a, 'e> Planner<'a, 'e> {
    /// An empty plan over a lab.
    pub fn new(lab: &'e mut Elaborator<'a>, sources: &'e Sources) -> Self {
        let failures = text::declared_failures(lab.tables.names);
        Planner {
            lab,
            sources,
            steps: Vec::new(),
            locals: Vec::new(),
            open: Vec::new(),
            results: Vec::new(),
            to_run: false,
            handlers: 0,
            failures,
            jobs: BTreeSet::new(),
        }
    }

    /// Lowers a workflow; `arguments` are values of its parameters, by name, that were given from outside.
    pub fn workflow(mut self, id: DeclId, arguments: &[(String, DeclId)]) -> Plan {
        let decl = self.lab.tables.names.decl(id);
        let ItemKind::Workflow { name, params, body, handlers, .. } = &decl.item.kind else {
            let root = self.add("nothing", Span::default(), Step::Sequence(Vec::new()));
            return Plan {
                workflow: String::new(),
                arguments: Vec::new(),
                steps: self.steps,
                root,
                locals: self.locals,
            };
        };
        let mut scope = Scope { lab: true, ..Scope::module(decl.module) };
        let shown = self.workflow_parameters(params, arguments, &mut scope);
        self.lab.readings_live = true;
        let root = self.guarded(&name.text, name.span, body, handlers, &mut scope);
        self.lab.readings_live = false;
        Plan { workflow: name.text.clone(), arguments: shown, steps: self.steps, root, locals: self.locals }
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
        let steps = self.statements(block, scope);
        leave(scope, depth);
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
        let inner = self.block(body, scope);
        self.with_handlers(label, span, inner, handlers, scope)
    }
}
