//! How much of the mass of every mixture came from which holding.

use matterix_ir::inventory::Inventory;
use matterix_ir::model::{Mixture, Model};

/// Masses below this share of the largest holding are rounding.
pub(super) const NOTHING: f64 = 1e-12;

/// Mass by mixture and holding, kg. A transfer takes the same share of everything, and reactions keep mass, so that the
/// sum over the holdings is the mass of the mixture.
#[derive(Clone, Debug, Default)]
pub(super) struct Origins {
    /// By mixture, then by holding.
    pub(super) mass: Vec<Vec<f64>>,
    /// Whether anything ever got in or out.
    pub(super) touched: Vec<bool>,
    /// Whether anything was ever taken from it.
    pub(super) gave: Vec<bool>,
}

impl Origins {
    /// What the mixtures hold at the start: `masses` by holding, kg.
    pub(super) fn new(stock: &Inventory, mixtures: usize, masses: &[f64]) -> Self {
        let mut mass = vec![vec![0.0; stock.holdings.len()]; mixtures];
        for (i, holding) in stock.holdings.iter().enumerate() {
            if let Some(slot) = mass.get_mut(holding.mixture as usize).and_then(|row| row.get_mut(i)) {
                *slot = masses.get(i).copied().unwrap_or(0.0);
            }
        }
        Origins { mass, touched: vec![false; mixtures], gave: vec![false; mixtures] }
    }

    /// A fraction of one mixture moves into another.
    pub(super) fn carry(&mut self, from: usize, to: usize, fraction: f64) {
        if from == to || fraction <= 0.0 || self.mass.len() <= from.max(to) {
            return;
        }
        let moved: Vec<f64> = self.mass[from].iter().map(|m| m * fraction).collect();
        if moved.iter().all(|m| *m == 0.0) {
            return;
        }
        for (slot, m) in self.mass[from].iter_mut().zip(&moved) {
            *slot -= m;
        }
        for (slot, m) in self.mass[to].iter_mut().zip(&moved) {
            *slot += m;
        }
        self.gave[from] = true;
        self.touched[from] = true;
        self.touched[to] = true;
    }

    /// Mass of a mixture, kg.
    pub(super) fn total(&self, mixture: usize) -> f64 {
        self.mass.get(mixture).map_or(0.0, |row| row.iter().sum())
    }

    /// Follows the streams between two samples: what each brought follows from the change of the masses of the mixtures
    /// (`now`, kg), leaf by leaf; of streams that run in a ring only the sum of both ways is known.
    pub(super) fn stream(&mut self, streams: &[(u32, u32)], now: &[f64]) {
        let mut lacking: Vec<f64> = now.iter().enumerate().map(|(i, m)| m - self.total(i)).collect();
        let mut open: Vec<(usize, usize)> = Vec::new();
        for (a, b) in streams.iter().map(|(a, b)| (*a as usize, *b as usize)) {
            let known = |(x, y): &(usize, usize)| (*x, *y) == (a, b) || (*x, *y) == (b, a);
            if a != b && a.max(b) < lacking.len() && !open.iter().any(known) {
                open.push((a, b));
            }
        }
        let mut carried = Vec::new();
        while !open.is_empty() {
            let degree = |m: usize| open.iter().filter(|(a, b)| *a == m || *b == m).count();
            let leaf = open.iter().position(|(a, b)| degree(*a) == 1 || degree(*b) == 1).unwrap_or(0);
            let (a, b) = open.remove(leaf);
            // Positive: from `a` to `b`.
            let single = !open.iter().any(|(x, y)| *x == b || *y == b);
            let net = if single { lacking[b] } else { -lacking[a] };
            lacking[a] += net;
            lacking[b] -= net;
            carried.push(if net >= 0.0 { (a, b, net) } else { (b, a, -net) });
        }
        // What a mixture passes on must have come in first.
        carried.sort_by_key(|(from, _, _)| carried_depth(*from, streams));
        for (from, to, mass) in carried {
            let there = self.total(from);
            if there > 0.0 && mass > there * NOTHING {
                self.carry(from, to, (mass / there).min(1.0));
            }
        }
    }
}

/// How many streams lie before a mixture, at most as many as there are.
fn carried_depth(mixture: usize, streams: &[(u32, u32)]) -> usize {
    let mut front = vec![mixture];
    for depth in 0..=streams.len() {
        let before: Vec<usize> =
            streams.iter().filter(|(_, to)| front.contains(&(*to as usize))).map(|(from, _)| *from as usize).collect();
        if before.is_empty() {
            return depth;
        }
        front = before;
    }
    streams.len()
}

/// Mass of a mixture by its states, kg.
pub(super) fn mass_of(model: &Model, mixture: &Mixture, state: impl Fn(u32) -> f64) -> f64 {
    let one = |c: &matterix_ir::model::Content| {
        let molar_mass = model.species.get(c.species as usize).map_or(0.0, |s| s.molar_mass);
        molar_mass * state(c.state)
    };
    mixture.contents.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(mass: Vec<Vec<f64>>) -> Origins {
        let n = mass.len();
        Origins { mass, touched: vec![false; n], gave: vec![false; n] }
    }

    #[test]
    fn what_is_carried_keeps_its_origin() {
        let mut all = two(vec![vec![1.0, 0.0], vec![0.0, 2.0]]);
        all.carry(0, 1, 0.5);
        all.carry(1, 0, 0.1);
        assert_eq!(all.mass, [[0.55, 0.2], [0.45, 1.8]]);
        assert!(all.gave[0] && all.gave[1]);
    }

    #[test]
    fn a_chain_of_streams_is_followed_by_the_masses() {
        let mut all = two(vec![vec![3.0], vec![0.0], vec![0.0]]);
        all.stream(&[(0, 1), (1, 2)], &[1.0, 0.5, 1.5]);
        let masses: Vec<f64> = (0..3).map(|i| all.total(i)).collect();
        assert_eq!(masses, [1.0, 0.5, 1.5]);
    }
}
