//! How much work one task may be: expressions evaluated, tuples of instances tried, statements written out.
//!
//! Functions, skills and loops are written out, so a short text can ask for more work than there is time or memory. Each task (a workflow
//! in its lab, a declaration by itself) has a budget of its own, counted in steps rather than in seconds, so that the same text gives the
//! same findings on every machine. The caller may also stop a check from outside ([`Stop`](crate::Stop)).

use matterix_ir::{Diagnostic, Span, codes};

use super::Elaborator;
use crate::eval::Value;
use crate::stop::stopped;

/// Expressions evaluated, tuples tried and statements written out for one task: some seconds of work. A protocol of 1,500 wells that
/// are filled one by one takes under a tenth of it.
const MOST_STEPS: u64 = 10_000_000;

/// Operations of one task's graph, about 50 bytes each.
const MOST_OPERATIONS: usize = 4_000_000;

/// Statements of one plan, up to some kilobytes each.
const MOST_STATEMENTS: usize = 200_000;

/// Expressions inside each other, functions and constants followed: what the stack of a thread bears.
const DEEPEST: u32 = 1_000;

/// Steps that an element of a list counts as: it takes some hundred bytes.
const ELEMENT: u64 = 10;

/// Of this many steps for a caution on one transfer of a plan one is counted: what those of the library ask of each has bounds of its own,
/// and a plan may have thousands of transfers.
const TRANSFER_STEPS: u64 = 8;

/// How many steps are made between two looks at whether the check was stopped.
const LOOK: u64 = 1 << 12;

/// What a task has spent.
#[derive(Debug, Default)]
pub struct Budget {
    steps: u64,
    depth: u32,
    /// The outermost expression, statement or law under way.
    item: Span,
    over: bool,
}

/// Why a task is given up.
enum Reason {
    Steps,
    Operations,
    Statements,
    Depth,
    Stopped,
}

impl Budget {
    /// Whether the task was given up: nothing more is worked out, and what is missing is not reported.
    pub fn is_over(&self) -> bool {
        self.over
    }
}

impl Elaborator<'_> {
    /// Begins an expression, statement or law; false where the task is given up. Each is ended by [`Self::leave`].
    pub fn enter(&mut self, at: Span) -> bool {
        if self.budget.depth == 0 {
            self.budget.item = at;
        }
        self.budget.depth += 1;
        self.budget.steps += 1;
        if self.budget.depth > DEEPEST {
            self.give_up(&Reason::Depth);
        } else if self.budget.steps.is_multiple_of(LOOK) {
            self.take_stock();
        }
        !self.budget.over
    }

    /// The steps that were taken so far.
    pub fn steps_taken(&self) -> u64 {
        self.budget.steps
    }

    /// Counts only a share of the steps that were taken for a transfer since there were so many.
    pub fn count_transfer(&mut self, since: u64) {
        self.budget.steps = since + (self.budget.steps - since).div_ceil(TRANSFER_STEPS);
        self.take_stock();
    }

    /// Ends what was begun last.
    pub fn leave(&mut self) {
        self.budget.depth -= 1;
    }

    /// Adds a step for something that is tried; false where the task is given up.
    pub fn spend_on(&mut self, at: Span) -> bool {
        let going_on = self.enter(at);
        self.leave();
        going_on
    }

    /// Adds steps for the elements of a list that is made.
    pub fn spend_on_items(&mut self, items: usize) {
        self.budget.steps += items as u64 * ELEMENT;
        self.take_stock();
    }

    /// Whether the steps are used up, which was reported.
    pub fn has_spent(&self) -> bool {
        self.budget.over
    }

    /// Adds steps for a list that is copied, with all lists in it.
    pub fn spend_on_list(&mut self, value: &Value) {
        let Value::List(items) = value else { return };
        self.spend_on_items(items.len());
        if !self.budget.over {
            items.iter().for_each(|item| self.spend_on_list(item));
        }
    }

    /// Whether a plan may have one more statement.
    pub fn has_room(&mut self, statements: usize) -> bool {
        if statements >= MOST_STATEMENTS {
            self.give_up(&Reason::Statements);
        }
        !self.budget.over
    }

    fn take_stock(&mut self) {
        if self.budget.steps > MOST_STEPS {
            self.give_up(&Reason::Steps);
        } else if self.graph.ops().len() > MOST_OPERATIONS {
            self.give_up(&Reason::Operations);
        } else if self.tables.stop.asked() {
            self.give_up(&Reason::Stopped);
        }
    }

    fn give_up(&mut self, reason: &Reason) {
        if std::mem::replace(&mut self.budget.over, true) {
            return;
        }
        let d = match reason {
            Reason::Stopped => stopped(self.budget.item),
            Reason::Steps => too_large(
                self.budget.item,
                format!("expanding this takes more than {} million steps", MOST_STEPS / 1_000_000),
            ),
            Reason::Operations => too_large(
                self.budget.item,
                format!("this needs more than {} million operations", MOST_OPERATIONS / 1_000_000),
            ),
            Reason::Statements => {
                too_large(self.budget.item, format!("this workflow expands to more than {MOST_STATEMENTS} steps"))
            }
            Reason::Depth => {
                too_large(self.budget.item, format!("expressions are nested more than {DEEPEST} deep here"))
            }
        };
        self.report(d);
    }
}

fn too_large(at: Span, headline: String) -> Diagnostic {
    Diagnostic::error(codes::BUDGET_SPENT, at, headline, "`check` gives up here").help(
        "every use of a function, skill or `for` is expanded, and a law once for every combination of things that fits it: use `repeat`, a smaller set, or a narrower type",
    )
}
