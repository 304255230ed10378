//! The numbers of a model that may differ from run to run, and what was decided by them before the runs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;

use matterix_ir::study::{Matched, OverTime, Reported};
use matterix_ir::{Graph, NodeId, Op, Span};

use crate::eval::Num;
use crate::units::Dimension;

/// How a number is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// `above`: more than that.
    Above,
    /// `at_least`: that or more.
    AtLeast,
    /// `at_most`: that or less.
    AtMost,
}

impl Bound {
    /// The options of a parameter, or of a function, that bound it.
    pub const WORDS: [&str; 3] = ["above", "at_least", "at_most"];

    /// What an option of this name says.
    pub fn of(name: &str) -> Option<Self> {
        let all = [Bound::Above, Bound::AtLeast, Bound::AtMost];
        Bound::WORDS.iter().position(|word| *word == name).map(|at| all[at])
    }

    /// Whether a number is within it.
    pub fn holds(self, given: f64, limit: f64) -> bool {
        match self {
            Bound::Above => given > limit,
            Bound::AtLeast => given >= limit,
            Bound::AtMost => given <= limit,
        }
    }

    /// What a number must be, before the limit.
    pub fn words(self) -> &'static str {
        match self {
            Bound::Above => "above",
            Bound::AtLeast => "at least",
            Bound::AtMost => "at most",
        }
    }
}

/// A parameter of the model by its name.
#[derive(Clone, Debug)]
pub struct Named {
    /// Its index.
    pub param: u32,
    /// The dimension of a difference.
    pub dimension: Dimension,
    /// A point on a scale.
    pub point: bool,
    /// Where its value is written.
    pub span: Span,
}

/// What studies and fits of one lab may vary, and what they follow.
#[derive(Debug, Default)]
pub struct FreeParameters {
    named: BTreeMap<String, Vec<Named>>,
    /// Parameters of the workflow that have no value before the runs.
    left: BTreeSet<String>,
    /// What parameters may be, SI.
    bounds: BTreeMap<u32, Vec<(Bound, f64)>>,
    whole: BTreeSet<u32>,
    /// Parameters by which something was decided. A lock: checks of one lab share it between threads.
    fixed: Mutex<BTreeSet<u32>>,
    /// The number of the first value that is kept over a run, while reports are read.
    pub following: Option<u32>,
    /// What is kept over a run.
    pub over_time: Vec<OverTime>,
    /// What is reported.
    pub reports: Vec<Reported>,
    /// What data speak of, with the dimension of each.
    pub matches: Vec<Matched>,
}

impl FreeParameters {
    /// Adds a parameter.
    pub fn add(&mut self, name: &str, param: u32, num: &Num, span: Span) {
        let named = Named { param, dimension: num.dimension.clone(), point: num.point, span };
        self.named.entry(name.to_string()).or_default().push(named);
    }

    /// The parameters of this name.
    pub fn named(&self, name: &str) -> impl Iterator<Item = &Named> {
        self.named.get(name).into_iter().flatten()
    }

    /// The parameter's name, if it has one.
    pub fn name_of(&self, param: u32) -> Option<&str> {
        self.named.iter().find(|(_, all)| all.iter().any(|n| n.param == param)).map(|(name, _)| name.as_str())
    }

    /// All names.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        self.named.keys()
    }

    /// A parameter of the workflow gets its value with each run.
    pub fn leave(&mut self, name: &str) {
        self.left.insert(name.to_string());
    }

    /// Whether a parameter of the workflow gets its value with each run.
    pub fn leaves(&self, name: &str) -> bool {
        self.left.contains(name)
    }

    /// A parameter has a bound, SI.
    pub fn bound(&mut self, op: Op, bound: Bound, limit: f64) {
        if let Op::Param(i) = op {
            self.bounds.entry(i).or_default().push((bound, limit));
        }
    }

    /// What a parameter may be, SI.
    pub fn bounds(&self, param: u32) -> &[(Bound, f64)] {
        self.bounds.get(&param).map_or(&[], Vec::as_slice)
    }

    /// A parameter counts something.
    pub fn whole(&mut self, op: Op) {
        if let Op::Param(i) = op {
            self.whole.insert(i);
        }
    }

    /// Whether a parameter counts something.
    pub fn is_whole(&self, param: u32) -> bool {
        self.whole.contains(&param)
    }

    /// Something is decided by the value of `node`.
    pub fn fix(&self, graph: &Graph, node: NodeId) {
        if graph.constant(node).is_some() {
            return;
        }
        let below = graph.schedule([node]);
        let params = below.into_iter().filter_map(|n| match graph.op(n) {
            Op::Param(i) => Some(i),
            _ => None,
        });
        if let Ok(mut fixed) = self.fixed.lock() {
            fixed.extend(params);
        }
    }

    /// Whether something was decided by a parameter.
    pub fn is_fixed(&self, param: u32) -> bool {
        self.fixed.lock().map_or(true, |fixed| fixed.contains(&param))
    }
}
