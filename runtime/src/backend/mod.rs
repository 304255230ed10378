//! What the executor runs a plan on: devices as start, poll and halt, readings as values, time as a clock to advance.
//!
//! Sequence, failure and resource handling are the executor's business and never a backend's, so that the simulator,
//! the dry run and hardware obey the same plan in the same way.

mod carried;
pub mod dry;
mod moments;
pub mod noise;
pub mod sim;
mod unknown;
mod watch;

use matterix_ir::NodeId;
use matterix_ir::plan::{Operation, StepId};

pub use dry::Dry;
pub use moments::Moments;
pub use sim::{Moves, Sim};
pub use watch::Prepared;

use crate::exec::{Alarm, Listener};
use crate::fault::Fault;
use crate::process::{Advance, Watch};

/// A started operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(pub u64);

/// Where a started operation stands.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// Still going on.
    Running {
        /// Worth asking again at this time, s.
        until: Option<f64>,
        /// Worth asking again when this is not 0.
        watch: Option<NodeId>,
    },
    /// Ended; its effects have been applied.
    Done,
    /// Not done: a person was asked to do it, and did not.
    Declined {
        /// Who, in words.
        text: String,
    },
    /// Ended with one of its declared failures.
    Failed {
        /// Its name.
        name: String,
        /// In words.
        text: String,
    },
}

/// How a condition is followed while time passes.
#[derive(Clone, Debug, PartialEq)]
pub enum Follow {
    /// Watched continuously, by this node.
    Watch(NodeId),
    /// Looked at whenever one of its readings reports: the periods, s.
    Every(Vec<f64>),
    /// Cannot be known here and is assumed to hold.
    Assumed,
}

/// Devices, readings and a clock. Times are seconds since the run began.
pub trait Backend {
    /// The time now.
    fn now(&self) -> f64;

    /// The moment so many seconds after now: sums of many durations are as good as exact.
    fn moment_after(&mut self, duration: f64) -> f64 {
        self.now() + duration
    }

    /// The value now, with readings sampled (and told) now; `None` if it cannot be known here.
    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault>;

    /// The value now, as far as it is seen and not only supposed; `None` if it cannot be known here.
    fn observe(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.value(node, out)
    }

    /// The value of a condition on what a thing is at the end, or at the start; a device says so by what it shows.
    fn ended(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.value(node, out)
    }

    /// Fails where a node has no value now: something is divided by 0, say.
    fn defined(&mut self, _node: NodeId) -> Result<(), Fault> {
        Ok(())
    }

    /// Whether a limit of the plan, by its index and condition, holds now; `None` if it cannot be known here. What does not is
    /// not told again while time passes.
    fn limit(&mut self, _: u32, condition: NodeId, out: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        Ok(self.value(condition, out)?.map(|v| v != 0.0 && !v.is_nan()))
    }

    /// The states that decide how those of a limit of the plan change, by its index: what their rates rest on, then what those of
    /// these rest on, and so on.
    fn decide(&self, _: u32) -> Vec<Vec<u32>> {
        Vec::new()
    }

    /// Whether an operation may change how a condition comes out: it sets what that rests on, or what sets off events that do.
    fn may_change(&self, _operation: &Operation, _condition: NodeId) -> bool {
        false
    }

    /// The limits of the plan that are known to be broken, by their index.
    fn broken(&self) -> Vec<u32> {
        Vec::new()
    }

    /// How to follow a condition from now on.
    fn follow(&mut self, condition: NodeId) -> Follow;

    /// Sets a value that the plan keeps; `None` if it is not known.
    fn set_local(&mut self, local: u32, value: Option<f64>);

    /// Whether a step that acts may begin now. Where one may not, time passes until it may.
    fn admits(&mut self) -> bool {
        true
    }

    /// Puts a question to a person; none where nobody is asked and the answer is taken to be yes, at once.
    fn ask(&mut self, _step: StepId, _text: &str, _out: &mut dyn Listener) -> Result<Option<Ticket>, Fault> {
        Ok(None)
    }

    /// What was answered to a question, once; none while it is open.
    fn answered(&mut self, _question: Ticket, _out: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        Ok(Some(true))
    }

    /// What an operation that is about to begin would bring about and must not, by what is known of the world here.
    fn foresee(&mut self, _step: StepId, _operation: &Operation, _out: &mut dyn Listener) -> Option<Alarm> {
        None
    }

    /// Starts the operation of a step.
    fn start(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault>;

    /// Asks where an operation stands; one that has ended is forgotten.
    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault>;

    /// Whether something has come about by itself that fails the first operation that is asked for.
    fn has_befallen(&self) -> bool {
        false
    }

    /// Abandons an operation, or withdraws a question.
    fn halt(&mut self, ticket: Ticket);

    /// Lets time pass until `until` (finite), until a watch has its value or until a limit of the plan breaks, whichever comes
    /// first; at once if one has.
    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault>;
}

/// The first report after `now` of readings with these periods, s.
pub fn next_report(periods: &[f64], now: f64) -> f64 {
    periods.iter().map(|&p| next_multiple(p, now)).fold(f64::INFINITY, f64::min)
}

/// The first multiple of `period` after `now`; the next number after `now` where the period is lost to rounding.
fn next_multiple(period: f64, now: f64) -> f64 {
    let turns = (now / period).floor();
    [1.0, 2.0].into_iter().map(|k| (turns + k) * period).find(|&t| t > now).unwrap_or_else(|| now.next_up())
}
