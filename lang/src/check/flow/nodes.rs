//! What is known of nodes and derivatives by themselves, whatever the states are: found when it is asked for, once for all the orders
//! in which a plan is followed.

use std::rc::Rc;

use matterix_ir::NodeId;
use matterix_ir::values::Formulas;
use rustc_hash::FxHashMap;

use super::{bonds, eval, even, fluxes, totals};

/// What was found so far.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// The states that a node depends on.
    pub parts: Vec<Option<Rc<eval::Parts>>>,
    /// The operations below a node, operands first.
    pub orders: Vec<Option<Rc<[NodeId]>>>,
    /// What nodes are made of.
    pub formulas: Formulas,
    /// By node, whether time or a law may move it; empty until it is asked for.
    pub moving: Vec<bool>,
    /// What goes on by the laws.
    pub stoichiometry: Option<Rc<fluxes::Stoichiometry>>,
    /// What may move evenly.
    pub tracks: Option<Rc<even::Tracks>>,
    /// Derivatives as sums of what goes on.
    pub terms: FxHashMap<u32, totals::Terms>,
    /// Nodes as sums of states.
    pub forms: FxHashMap<NodeId, Option<Rc<bonds::Form>>>,
    /// Operations of a node that depend on a state.
    pub parts_on: FxHashMap<(NodeId, u32), Rc<[NodeId]>>,
    /// What nodes rest on.
    pub inputs: FxHashMap<NodeId, Rc<eval::Inputs>>,
    /// Operations of a node that depend on another one; none where that was asked for once only.
    pub above: FxHashMap<(NodeId, NodeId), Option<Rc<[NodeId]>>>,
}

impl Nodes {
    /// Nothing yet, of so many nodes.
    pub fn new(count: usize) -> Self {
        Nodes { parts: vec![None; count], orders: vec![None; count], ..Nodes::default() }
    }
}
