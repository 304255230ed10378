//! Who rests on what, found once: so that a change finds what it concerns and nothing else is looked at.

use std::collections::BTreeMap;

use matterix_ir::model::Model;
use matterix_ir::undefined::Doubts;
use matterix_ir::{Graph, NodeId, Op};

/// What a part of the graph decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Root {
    /// The rate of a state, by the state's index.
    Rate(u32),
    /// Whether a process runs, by its index.
    Guard(u32),
    /// Whether an event happens, by its index.
    Event(u32),
    /// Whether a limit holds, by its index.
    Limit(u32),
    /// What an observer looks at at all times.
    Attended,
    /// What only the caller asks for, for a time.
    Watch,
}

/// Lists, one for each of many, in one piece of memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists<T> {
    first: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Lists<T> {
    /// `count` lists of what `pairs` assigns to them, each in the order of the pairs.
    fn new(count: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut first = vec![0; count + 1];
        pairs.clone().for_each(|(list, _)| first[list as usize + 1] += 1);
        for i in 0..count {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut items = pairs.clone().next().map_or(Vec::new(), |(_, any)| vec![any; first[count] as usize]);
        for (list, item) in pairs {
            let slot = &mut next[list as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Lists { first, items }
    }

    /// One of the lists; empty beyond the last.
    pub(super) fn at(&self, list: usize) -> &[T] {
        match self.first.get(list..list + 2) {
            Some(&[from, to]) => &self.items[from as usize..to as usize],
            _ => &[],
        }
    }
}

/// Who uses each operation of a graph.
pub(super) fn users(graph: &Graph) -> Lists<NodeId> {
    let uses = graph.ops().iter().enumerate();
    let uses = uses.flat_map(|(i, op)| op.operands().map(move |o| (o.0, NodeId(i as u32))));
    Lists::new(graph.ops().len(), uses)
}

/// Walks over the graph write down where they have been.
#[derive(Clone, Debug, Default)]
struct Walk {
    seen: Vec<u32>,
    walk: u32,
    todo: Vec<NodeId>,
}

/// The law's roots, and how they hang on the leaves of the graph.
#[derive(Clone, Debug)]
pub(super) struct Index {
    /// Who uses each operation.
    pub(super) users: Lists<NodeId>,
    roots: Vec<(Root, NodeId)>,
    /// By operation, its roots of the model.
    of_node: Lists<u32>,
    /// The same of those that were asked for later.
    asked: BTreeMap<NodeId, Vec<u32>>,
    /// Whether an operation is below a root.
    is_law: Vec<bool>,
    /// By state, the root of its rate.
    rate_of: Vec<Option<u32>>,
    /// By state, its operations.
    states: Lists<NodeId>,
    /// Values of the plan, which need not be there at all, with their operations, in order.
    locals: Vec<(u32, NodeId)>,
    /// Readings with their operations, in order.
    readings: Vec<(u32, NodeId)>,
    walk: Walk,
    /// The comparisons that may be neither true nor false.
    pub(super) doubts: Doubts,
}

impl Index {
    /// Of the rates, guards and events of `model`, and of conditions that must hold all the time.
    pub(super) fn new(model: &Model, kept: impl IntoIterator<Item = NodeId>) -> Self {
        let (graph, size) = (&model.graph, model.graph.ops().len());
        let rates = model.derivatives.iter().map(|d| (Root::Rate(d.state), d.rate));
        let guards = model.processes.iter().enumerate().filter_map(|(i, p)| Some((Root::Guard(i as u32), p.guard?)));
        let events = model.events.iter().enumerate().map(|(i, e)| (Root::Event(i as u32), e.when));
        let limits = kept.into_iter().enumerate().map(|(i, node)| (Root::Limit(i as u32), node));
        let roots: Vec<(Root, NodeId)> = rates.chain(guards).chain(events).chain(limits).collect();
        let of_node = Lists::new(size, roots.iter().enumerate().map(|(i, (_, node))| (node.0, i as u32)));
        let mut rate_of = vec![None; model.states.len()];
        for (i, (root, _)) in roots.iter().enumerate() {
            if let Root::Rate(state) = root {
                rate_of[*state as usize] = Some(i as u32);
            }
        }
        let leaves = |of: fn(Op) -> Option<u32>| {
            let ops = graph.ops().iter().enumerate();
            let mut found: Vec<(u32, NodeId)> = ops.filter_map(|(i, op)| Some((of(*op)?, NodeId(i as u32)))).collect();
            found.sort_unstable();
            found
        };
        let states = leaves(|op| if let Op::State(i) = op { Some(i) } else { None });
        let states = Lists::new(model.states.len(), states.into_iter());
        let locals = leaves(|op| if let Op::Local(i) = op { Some(i) } else { None });
        let readings = leaves(|op| if let Op::Reading(i) = op { Some(i) } else { None });
        let mut is_law = vec![false; size];
        let all = roots.iter().map(|(_, node)| *node).collect();
        below(graph, all, &mut is_law);
        let walk = Walk { seen: vec![0; size], ..Walk::default() };
        Index {
            users: users(graph),
            roots,
            of_node,
            asked: BTreeMap::new(),
            is_law,
            rate_of,
            states,
            locals,
            readings,
            walk,
            doubts: Doubts::new(graph),
        }
    }

    /// How many roots there are.
    pub(super) fn len(&self) -> u32 {
        self.roots.len() as u32
    }

    /// What a root decides, and by which operation.
    pub(super) fn root(&self, root: u32) -> (Root, NodeId) {
        self.roots[root as usize]
    }

    /// The root of the rate of a state.
    pub(super) fn rate_of(&self, state: u32) -> Option<u32> {
        self.rate_of[state as usize]
    }

    /// The operations that are this state.
    pub(super) fn leaves(&self, state: u32) -> &[NodeId] {
        self.states.at(state as usize)
    }

    /// The operations that are this value of the plan, or this reading.
    pub(super) fn heard(&self, leaf: Op) -> Vec<NodeId> {
        let (all, index) = match leaf {
            Op::Local(i) => (&self.locals, i),
            Op::Reading(i) => (&self.readings, i),
            _ => return Vec::new(),
        };
        let first = all.partition_point(|(i, _)| *i < index);
        all[first..].iter().take_while(|(i, _)| *i == index).map(|(_, node)| *node).collect()
    }

    /// The root of a condition that is asked for later, for `what`.
    pub(super) fn ask(&mut self, graph: &Graph, what: Root, node: NodeId) -> u32 {
        let known = self.asked.entry(node).or_default();
        if let Some(root) = known.iter().find(|root| self.roots[**root as usize].0 == what) {
            return *root;
        }
        let root = self.roots.len() as u32;
        known.push(root);
        self.roots.push((what, node));
        below(graph, vec![node], &mut self.is_law);
        root
    }

    /// Walks up from `seeds` over the law; `visit` is told each operation, `found` each root.
    pub(super) fn above(&mut self, seeds: &[NodeId], visit: &mut dyn FnMut(NodeId), found: &mut dyn FnMut(u32, Root)) {
        let Walk { seen, walk, todo } = &mut self.walk;
        *walk += 1;
        todo.extend(seeds);
        while let Some(node) = todo.pop() {
            let at = node.0 as usize;
            if !self.is_law[at] || std::mem::replace(&mut seen[at], *walk) == *walk {
                continue;
            }
            visit(node);
            let asked = self.asked.get(&node).into_iter().flatten();
            for root in self.of_node.at(at).iter().chain(asked) {
                found(*root, self.roots[*root as usize].0);
            }
            todo.extend(self.users.at(at));
        }
    }
}

/// Marks what `todo` depends on.
fn below(graph: &Graph, mut todo: Vec<NodeId>, marks: &mut [bool]) {
    while let Some(node) = todo.pop() {
        if !std::mem::replace(&mut marks[node.0 as usize], true) {
            todo.extend(graph.op(node).operands());
        }
    }
}
