//! What a formula need not work out: the side of a choice that is not taken, and what follows a condition that settles the whole.
//!
//! An operation on which one side of a choice alone rests stands in the region of that side; one on which several rest, in the innermost
//! region around all of them. The operations of a side stand one after the other, before the choice.

use super::Formula;
use crate::equilibrium::Call;
use crate::graph::{BinaryOp, NodeId, Op};

/// Sides with fewer operations are worked out whether they are needed or not.
const FEWEST: usize = 4;

/// The sides of a choice that is nested deeper than this belong to the region around it.
const DEEPEST: u32 = 32;

/// Operations are left out where a condition comes out in one way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skip {
    /// The first of them.
    pub at: usize,
    /// The condition.
    pub on: NodeId,
    /// How it comes out.
    pub when: bool,
    /// The operation that is next then.
    pub to: usize,
    /// The skip that is next then.
    pub rest: usize,
}

/// Operations that are needed together.
struct Region {
    outer: usize,
    depth: u32,
    /// The condition of the choice, and how it comes out where they are not needed.
    not_for: (NodeId, bool),
    ops: Vec<usize>,
    /// How many they are with those of the regions within.
    count: usize,
}

/// The operands of an operation, each with the condition that makes it needless, and how that comes out.
fn operands(op: Op) -> impl Iterator<Item = (NodeId, Option<(NodeId, bool)>)> {
    let not_for = move |index| match (op, index) {
        (Op::Select(c, ..), 1) => Some((c, false)),
        (Op::Select(c, ..), 2) => Some((c, true)),
        (Op::Binary(BinaryOp::And, a, _), 1) => Some((a, false)),
        (Op::Binary(BinaryOp::Or, a, _), 1) => Some((a, true)),
        _ => None,
    };
    op.operands().enumerate().map(move |(index, operand)| (operand, not_for(index)))
}

/// The formula of operations that stand operands first.
pub(super) fn formula(ops: Vec<Op>, calls: Vec<Call>) -> Formula {
    if !ops.iter().any(|op| operands(*op).any(|(_, not_for)| not_for.is_some())) {
        return Formula { ops: ops.into(), skips: Box::default(), calls: calls.into() };
    }
    let regions = Regions::new(&ops);
    let mut out = Arranged { ops: Vec::with_capacity(ops.len()), skips: Vec::new(), places: vec![0; ops.len()] };
    out.add(&regions, 0, &ops);
    let calls = calls.into_iter().map(|call| out.moved(call)).collect();
    Formula { ops: out.ops.into(), skips: out.skips.into(), calls }
}

/// The regions of a formula; the first one is the whole.
struct Regions {
    all: Vec<Region>,
    /// That of each operation, once something is known to rest on it.
    of: Vec<Option<usize>>,
    /// Those of the sides of each choice, from one to the other.
    sides: Vec<(usize, usize)>,
}

impl Regions {
    fn new(ops: &[Op]) -> Regions {
        let count = ops.len();
        let mut regions = Regions { all: Vec::new(), of: vec![None; count], sides: vec![(0, 0); count] };
        regions.begin(0, 0, (NodeId(0), false));
        for at in (0..count).rev() {
            let own = regions.of[at].unwrap_or_default();
            regions.all[own].ops.push(at);
            let depth = regions.all[own].depth + 1;
            let first = regions.all.len();
            for (operand, not_for) in operands(ops[at]) {
                let region = match not_for.filter(|_| depth <= DEEPEST) {
                    Some(not_for) => regions.begin(own, depth, not_for),
                    None => own,
                };
                let other = regions.of[operand.0 as usize];
                regions.of[operand.0 as usize] = Some(other.map_or(region, |other| regions.around(region, other)));
            }
            regions.sides[at] = (first, regions.all.len());
        }
        for region in (0..regions.all.len()).rev() {
            regions.all[region].count += regions.all[region].ops.len();
            let (outer, count) = (regions.all[region].outer, regions.all[region].count);
            if region > 0 {
                regions.all[outer].count += count;
            }
        }
        regions
    }

    fn begin(&mut self, outer: usize, depth: u32, not_for: (NodeId, bool)) -> usize {
        self.all.push(Region { outer, depth, not_for, ops: Vec::new(), count: 0 });
        self.all.len() - 1
    }

    /// The innermost region around two.
    fn around(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            // Those within are begun later.
            if a > b {
                a = self.all[a].outer;
            } else {
                b = self.all[b].outer;
            }
        }
        a
    }
}

/// Operations in their new order.
struct Arranged {
    ops: Vec<Op>,
    skips: Vec<Skip>,
    /// Where each stands now.
    places: Vec<u32>,
}

impl Arranged {
    fn add(&mut self, regions: &Regions, region: usize, ops: &[Op]) {
        for &at in regions.all[region].ops.iter().rev() {
            let (first, end) = regions.sides[at];
            for side in first..end {
                self.add_side(regions, side, ops);
            }
            let place = |n: NodeId| NodeId(self.places[n.0 as usize]);
            let op = match ops[at] {
                Op::Unary(op, a) => Op::Unary(op, place(a)),
                Op::Binary(op, a, b) => Op::Binary(op, place(a), place(b)),
                Op::Select(c, a, b) => Op::Select(place(c), place(a), place(b)),
                Op::List(a, b) => Op::List(place(a), place(b)),
                Op::Solved(call, list) => Op::Solved(call, place(list)),
                leaf => leaf,
            };
            self.places[at] = self.ops.len() as u32;
            self.ops.push(op);
        }
    }

    /// A call with its arguments where they stand now.
    fn moved(&self, call: Call) -> Call {
        Call { args: call.args.iter().map(|arg| NodeId(self.places[arg.0 as usize])).collect(), ..call }
    }

    fn add_side(&mut self, regions: &Regions, side: usize, ops: &[Op]) {
        let Region { not_for: (on, when), count, .. } = regions.all[side];
        if count < FEWEST {
            return self.add(regions, side, ops);
        }
        let skip = self.skips.len();
        let on = NodeId(self.places[on.0 as usize]);
        self.skips.push(Skip { at: self.ops.len(), on, when, to: 0, rest: 0 });
        self.add(regions, side, ops);
        self.skips[skip].to = self.ops.len();
        self.skips[skip].rest = self.skips.len();
    }
}
