//! The nearest of many configurations: a tree of halves whose leaves are searched eight points at a time.

use crate::lanes::{Kernel, Lanes, Row, WIDTH, dispatch};

/// How many rows of eight points a leaf has.
const BLOCKS: usize = 16;
/// How many points a leaf has.
const LEAF: usize = BLOCKS * WIDTH;
/// Axes beyond these do not narrow a search down.
const AXES: usize = 8;

/// A half of space: below and above a coordinate.
#[derive(Clone, Copy, Debug)]
struct Fork {
    axis: usize,
    at: f32,
    halves: [Branch; 2],
}

#[derive(Clone, Copy, Debug)]
enum Branch {
    Fork(u32),
    Leaf(u32),
}

/// A growing set of configurations.
#[derive(Clone, Debug)]
pub(crate) struct Cloud {
    dims: usize,
    /// All points in the order they came.
    points: Vec<f32>,
    root: Branch,
    forks: Vec<Fork>,
    /// The points of each leaf, by their indices.
    leaves: Vec<Vec<u32>>,
    /// For every eight points of a leaf, a row of each coordinate; places not taken are infinitely far.
    rows: Vec<Row>,
}

impl Cloud {
    pub fn new(dims: usize) -> Self {
        let mut cloud = Self {
            dims,
            points: Vec::with_capacity(64 * dims),
            root: Branch::Leaf(0),
            forks: Vec::new(),
            leaves: Vec::new(),
            rows: Vec::new(),
        };
        cloud.leaf(Vec::new());
        cloud
    }

    pub fn len(&self) -> usize {
        self.points.len() / self.dims.max(1)
    }

    pub fn point(&self, index: usize) -> &[f32] {
        &self.points[index * self.dims..][..self.dims]
    }

    pub fn push(&mut self, point: &[f32]) {
        let index = self.len() as u32;
        self.points.extend_from_slice(point);
        let mut parent = None;
        let mut at = self.root;
        loop {
            match at {
                Branch::Fork(f) => {
                    let fork = &self.forks[f as usize];
                    let side = usize::from(point[fork.axis] >= fork.at);
                    parent = Some((f as usize, side));
                    at = fork.halves[side];
                }
                Branch::Leaf(leaf) => {
                    self.write(leaf as usize, self.leaves[leaf as usize].len(), index);
                    self.leaves[leaf as usize].push(index);
                    if self.leaves[leaf as usize].len() == LEAF {
                        self.split(leaf as usize, parent);
                    }
                    return;
                }
            }
        }
    }

    fn write(&mut self, leaf: usize, place: usize, index: u32) {
        let from = (leaf * BLOCKS + place / WIDTH) * self.dims;
        let point = &self.points[index as usize * self.dims..][..self.dims];
        for (row, &x) in self.rows[from..].iter_mut().zip(point) {
            row.0[place % WIDTH] = x;
        }
    }

    /// Adds a leaf with these points.
    fn leaf(&mut self, points: Vec<u32>) -> u32 {
        let leaf = self.leaves.len();
        self.rows.resize(self.rows.len() + BLOCKS * self.dims, Row([f32::INFINITY; WIDTH]));
        for (place, &index) in points.iter().enumerate() {
            self.write(leaf, place, index);
        }
        self.leaves.push(points);
        leaf as u32
    }

    /// Makes two leaves of one where its points are farthest apart: half of them each, whatever their places.
    fn split(&mut self, leaf: usize, parent: Option<(usize, usize)>) {
        let mut points = std::mem::take(&mut self.leaves[leaf]);
        let value = |index: u32, axis: usize| self.points[index as usize * self.dims + axis];
        let spread = |axis: usize| {
            let (least, most) = points.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &p| {
                let x = value(p, axis);
                (if x < a { x } else { a }, if x > b { x } else { b })
            });
            most - least
        };
        let spreads: Vec<f32> = (0..self.dims).map(spread).collect();
        let axis = (0..self.dims).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
        let order = |a: &u32, b: &u32| value(*a, axis).total_cmp(&value(*b, axis)).then(a.cmp(b));
        points.select_nth_unstable_by(LEAF / 2, order);
        let at = value(points[LEAF / 2], axis);
        let upper = points.split_off(LEAF / 2);
        let from = leaf * BLOCKS * self.dims;
        self.rows[from..from + BLOCKS * self.dims].fill(Row([f32::INFINITY; WIDTH]));
        for (place, &index) in points.iter().enumerate() {
            self.write(leaf, place, index);
        }
        self.leaves[leaf] = points;
        let above = self.leaf(upper);
        let fork = self.forks.len() as u32;
        self.forks.push(Fork { axis, at, halves: [Branch::Leaf(leaf as u32), Branch::Leaf(above)] });
        match parent {
            Some((p, side)) => self.forks[p].halves[side] = Branch::Fork(fork),
            None => self.root = Branch::Fork(fork),
        }
    }

    /// Index and distance of the point nearest to this one.
    pub fn nearest(&self, to: &[f32], visits: &mut Vec<Visit>) -> (usize, f32) {
        dispatch(Search { cloud: self, to, visits })
    }
}

/// A part of the tree still to be searched, and how far from it the asked point is along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    branch: Branch,
    square: f32,
    apart: [f32; AXES],
}

struct Search<'a, 'v> {
    cloud: &'a Cloud,
    to: &'a [f32],
    visits: &'v mut Vec<Visit>,
}

impl Kernel for Search<'_, '_> {
    type Output = (usize, f32);
    #[inline(always)]
    fn run<L: Lanes>(self) -> (usize, f32) {
        match self.cloud.dims {
            6 => search::<L, 6>(self),
            7 => search::<L, 7>(self),
            _ => search::<L, 0>(self),
        }
    }
}

/// `D` is the number of dimensions where it is known beforehand, else 0.
#[inline(always)]
fn search<L: Lanes, const D: usize>(search: Search) -> (usize, f32) {
    let Search { cloud, to, visits } = search;
    let dims = if D > 0 { D } else { cloud.dims };
    let to = &to[..dims];
    let mut best = L::splat(f32::INFINITY);
    let mut which = L::splat(0.0);
    let mut least = f32::INFINITY;
    visits.clear();
    let mut first = Some(Visit { branch: cloud.root, square: 0.0, apart: [0.0; AXES] });
    while let Some(mut visit) = first.take().or_else(|| visits.pop()) {
        if visit.square >= least {
            continue;
        }
        let leaf = loop {
            match visit.branch {
                Branch::Leaf(leaf) => break leaf as usize,
                Branch::Fork(fork) => {
                    let fork = &cloud.forks[fork as usize];
                    let by = to[fork.axis] - fork.at;
                    let side = usize::from(by >= 0.0);
                    let mut other = Visit { branch: fork.halves[1 - side], ..visit };
                    if let Some(apart) = other.apart.get_mut(fork.axis) {
                        other.square += by * by - *apart * *apart;
                        *apart = by;
                    }
                    if other.square < least {
                        visits.push(other);
                    }
                    visit.branch = fork.halves[side];
                }
            }
        };
        let taken = cloud.leaves[leaf].len().div_ceil(WIDTH);
        let rows = &cloud.rows[leaf * BLOCKS * dims..][..taken * dims];
        let mut number = L::splat((leaf * BLOCKS) as f32);
        for block in rows.chunks_exact(dims) {
            let mut square = L::splat(0.0);
            for (row, &x) in block.iter().zip(to) {
                let d = L::load(row) - L::splat(x);
                square = d.mul_add(d, square);
            }
            which = square.pick_below(best, number, which);
            best = square.min(best);
            number = number + L::splat(1.0);
        }
        if !visits.is_empty() {
            least = lowest(best);
        }
    }
    least = lowest(best);
    let mut blocks = Row::default();
    which.store(&mut blocks);
    // The first lane that is not above the least.
    let lane = (!L::splat(least).below(best)).trailing_zeros() as usize % WIDTH;
    let block = blocks.0[lane] as usize;
    let index = cloud.leaves[block / BLOCKS].get(block % BLOCKS * WIDTH + lane).copied().unwrap_or(0);
    (index as usize, least.sqrt())
}

/// The least of eight numbers.
#[inline(always)]
fn lowest<L: Lanes>(numbers: L) -> f32 {
    let mut row = Row::default();
    numbers.store(&mut row);
    let [a, b, c, d, e, f, g, h] = row.0;
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    lesser(lesser(lesser(a, b), lesser(c, d)), lesser(lesser(e, f), lesser(g, h)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_a_plain_search_finds() {
        for dims in [2, 6, 7, 9] {
            let mut halton = crate::halton::Halton::new(&vec![[-1.0, 1.0]; dims]);
            let (mut cloud, mut visits) = (Cloud::new(dims), Vec::new());
            let mut point = vec![0.0; dims];
            let square = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
            for count in 0..1500 {
                halton.next_into(&mut point);
                cloud.push(&point);
                halton.next_into(&mut point);
                let (_, distance) = cloud.nearest(&point, &mut visits);
                let plain = (0..=count).map(|i| square(cloud.point(i), &point)).fold(f32::INFINITY, f32::min);
                assert!((distance - plain.sqrt()).abs() < 1e-5, "{dims} {count}: {distance} {}", plain.sqrt());
            }
        }
    }

    #[test]
    fn the_same_point_many_times_is_no_trouble() {
        let (mut cloud, mut visits) = (Cloud::new(3), Vec::new());
        for _ in 0..500 {
            cloud.push(&[1.0, 2.0, 3.0]);
        }
        assert_eq!(cloud.nearest(&[1.0, 2.0, 4.0], &mut visits).1, 1.0);
    }
}
