//! The numbers of a model that may differ from run to run, and what was decided by them before the runs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;

use matterix_ir::study::{Matched, OverTime, Reported};
use matterix_ir::{Graph, NodeId, Op, Span};

use crate::eval::Num;
use crate::units::Dimension;

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
    /// The least value of a parameter, SI, and whether it must be above it.
    least: BTreeMap<u32, (f64, bool)>,
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

    /// A parameter has a least value, SI.
    pub fn bound(&mut self, op: Op, least: f64, above: bool) {
        if let Op::Param(i) = op {
            self.least.insert(i, (least, above));
        }
    }

    /// The least value of a parameter, SI, and whether it must be above it.
    pub fn least(&self, param: u32) -> Option<(f64, bool)> {
        self.least.get(&param).copied()
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
