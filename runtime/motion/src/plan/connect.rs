//! Two trees that grow towards each other: RRT-Connect (Kuffner and LaValle, 2000) with balanced trees (2005) and
//! dynamic domains (Jaillet and others, 2005).

use super::Settings;
use super::nearest::Cloud;
use super::path::{Way, gap};
use crate::spheres::Checker;

struct Grown {
    cloud: Cloud,
    parents: Vec<u32>,
    /// How far from each node samples are taken up; infinite until an extension failed there.
    domains: Vec<f32>,
}

impl Grown {
    fn new(root: &[f32]) -> Self {
        let mut tree = Self { cloud: Cloud::new(root.len()), parents: Vec::new(), domains: Vec::new() };
        tree.push(root, 0);
        tree
    }

    fn push(&mut self, point: &[f32], parent: usize) -> usize {
        self.cloud.push(point);
        self.parents.push(parent as u32);
        self.domains.push(f32::INFINITY);
        self.parents.len() - 1
    }

    /// From a node to the root.
    fn trace(&self, mut at: usize, dims: usize) -> Way {
        let mut way = Way::new(dims);
        loop {
            way.push(self.cloud.point(at));
            let parent = self.parents[at] as usize;
            if parent == at {
                return way;
            }
            at = parent;
        }
    }
}

/// What came of a search.
pub(crate) struct Search {
    /// The way found, if any.
    pub way: Option<Way>,
    /// How many samples were drawn.
    pub iterations: usize,
}

/// Searches a way between two free configurations.
pub(crate) fn connect(checker: &mut Checker, start: &[f32], goal: &[f32], settings: &Settings) -> Search {
    let dims = start.len();
    let mut vector = vec![0.0; dims];
    let direct = gap(start, goal, &mut vector);
    if checker.is_clear(start, &vector, direct) {
        let mut way = Way::new(dims);
        way.push(start);
        way.push(goal);
        return Search { way: Some(way), iterations: 0 };
    }
    let last = checker.effort().saturating_add(settings.effort);
    let range = settings.range as f32;
    let mut halton = checker.figure().samples().draw();
    let mut trees = [Grown::new(start), Grown::new(goal)];
    let mut visits = Vec::with_capacity(32);
    let mut grows = 1;
    let [mut sample, mut near, mut next, mut other] = [0; 4].map(|_| vec![0.0_f32; dims]);
    for iteration in 1..=settings.iterations {
        if checker.effort() >= last {
            return Search { way: None, iterations: iteration };
        }
        let (a, b) = (trees[grows].cloud.len() as f32, trees[1 - grows].cloud.len() as f32);
        if (a - b).abs() < a {
            grows = 1 - grows;
        }
        let [first, second] = &mut trees;
        let (tree, aim) = if grows == 0 { (first, second) } else { (second, first) };
        halton.next_into(&mut sample);
        let (index, distance) = tree.cloud.nearest(&sample, &mut visits);
        if tree.domains[index] < distance || distance == 0.0 {
            continue;
        }
        near.copy_from_slice(tree.cloud.point(index));
        let reach = distance.min(range);
        let share = if distance < range { 1.0 } else { range / distance };
        for (v, (s, n)) in vector.iter_mut().zip(sample.iter().zip(&near)) {
            *v = (s - n) * share;
        }
        if !checker.is_clear(&near, &vector, reach) {
            let domain = tree.domains[index];
            tree.domains[index] = if domain == f32::INFINITY {
                settings.domain as f32
            } else {
                (domain * (1.0 - settings.shrink as f32)).max(settings.least_domain as f32)
            };
            continue;
        }
        if tree.domains[index] != f32::INFINITY {
            tree.domains[index] *= 1.0 + settings.shrink as f32;
        }
        for (x, (n, v)) in next.iter_mut().zip(near.iter().zip(&vector)) {
            *x = n + v;
        }
        let mut tip = tree.push(&next, index);
        // Towards the other tree, as far as the way is free.
        let (target, distance) = aim.cloud.nearest(&next, &mut visits);
        other.copy_from_slice(aim.cloud.point(target));
        let strides = (distance / range).ceil().max(1.0);
        for (v, (o, n)) in vector.iter_mut().zip(other.iter().zip(&next)) {
            *v = (o - n) / strides;
        }
        let mut taken = 0.0;
        while taken < strides && checker.is_clear(&next, &vector, distance / strides) {
            taken += 1.0;
            for (x, v) in next.iter_mut().zip(&vector) {
                *x += v;
            }
            tip = tree.push(&next, tip);
        }
        if taken == strides {
            let mut way = tree.trace(tip, dims);
            way.reverse();
            way.replace_last(&aim.trace(target, dims));
            if grows == 1 {
                way.reverse();
            }
            return Search { way: Some(way), iterations: iteration };
        }
    }
    Search { way: None, iterations: settings.iterations }
}
