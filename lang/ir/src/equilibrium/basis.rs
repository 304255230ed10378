//! The masters of a system, and how all other members are formed of them.

use super::{Phase, Written};

/// Below this a coefficient is what rounding left.
const NOTHING: f64 = 1e-9;

/// A member that is made of more than so many of one master makes totals turn over at once.
const STEEP: f64 = 4.0;

/// Equations that cancel: the sum of their logarithms of constants, each by its factor, is 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    /// By equation.
    pub factors: Vec<f64>,
}

/// Why a system has no basis: a solid in an equation is bound to nothing dissolved, or no solvent is present.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unsettled(pub String);

impl std::fmt::Display for Unsettled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// Rows of which only what is not 0 is kept, in one piece.
#[derive(Clone, Debug, Default)]
pub(super) struct Sparse {
    ends: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Sparse {
    /// What is not 0 in a row, by column.
    pub(super) fn row(&self, row: usize) -> &[(usize, f64)] {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        &self.entries[start..self.ends[row]]
    }

    /// All rows.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[(usize, f64)]> {
        (0..self.ends.len()).map(|row| self.row(row))
    }
}

impl<'a, R: Iterator<Item = &'a f64>> FromIterator<R> for Sparse {
    fn from_iter<T: IntoIterator<Item = R>>(rows: T) -> Sparse {
        let mut sparse = Sparse::default();
        for row in rows {
            sparse.entries.extend(row.copied().enumerate().filter(|(_, part)| *part != 0.0));
            sparse.ends.push(sparse.entries.len());
        }
        sparse
    }
}

/// How members follow from masters.
#[derive(Clone, Debug, Default)]
pub(super) struct Basis {
    /// The masters, by member: in the order in which the linear system is eliminated. That which most members are made of comes last, so
    /// that most of the system stays empty.
    pub(super) masters: Vec<usize>,
    /// By member: how much of each master it is made of.
    pub(super) of: Vec<Vec<f64>>,
    /// By member: how much of the solvent.
    pub(super) solvent: Vec<f64>,
    /// By member: all of that which is not 0, masters by their number, the solvent behind them.
    pub(super) parts: Sparse,
    /// The same without the solvent.
    pub(super) masters_of: Sparse,
    /// By member: elementary charges.
    pub(super) charges: Vec<f64>,
    /// By member: how much of which equations forms it.
    pub(super) by: Vec<Vec<(usize, f64)>>,
    /// The solvent, by member.
    pub(super) water: usize,
    /// Dissolved members, in whichever liquid.
    pub(super) solutes: Vec<usize>,
    /// Those in another liquid than the solvent.
    pub(super) extracted: Vec<usize>,
    /// Solids.
    pub(super) solids: Vec<usize>,
    /// Formal members.
    pub(super) formal: Vec<usize>,
    /// Solids that are there, by member: masters of their own, with an activity of 1.
    pub(super) held: Vec<usize>,
    /// By member: how much of each of these.
    pub(super) of_held: Vec<Vec<f64>>,
    /// By master: whether no member takes any of it away, so that its total is at least 0.
    pub(super) is_matter: Vec<bool>,
    /// The masters in the order of their members, another one to eliminate in.
    pub(super) numbered: Vec<usize>,
    /// Whether a member is made of many of one master.
    pub(super) is_steep: bool,
    /// Equations that follow from others.
    pub(super) circles: Vec<Circle>,
}

/// An equation while others are taken out of it.
#[derive(Clone)]
struct Row {
    members: Vec<f64>,
    equations: Vec<f64>,
}

impl Row {
    fn take(&mut self, other: &Row, factor: f64) {
        let less = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to -= factor * from);
        less(&mut self.members, &other.members);
        less(&mut self.equations, &other.equations);
        self.members.iter_mut().filter(|v| v.abs() < NOTHING).for_each(|v| *v = 0.0);
    }

    fn scale(&mut self, factor: f64) {
        self.members.iter_mut().chain(&mut self.equations).for_each(|v| *v *= factor);
    }
}

impl Basis {
    pub(super) fn new(written: &Written) -> Result<Basis, Unsettled> {
        let phase = |i: usize| written.members[i].phase;
        let count = written.members.len();
        let water = (0..count).find(|i| phase(*i) == Phase::Solvent);
        let water = water.ok_or_else(|| Unsettled("no solvent is present".into()))?;
        let (rows, circles) = reduced(written)?;
        let formed: Vec<usize> = rows.iter().map(|(pivot, _)| *pivot).collect();
        let is_dissolved = |i: usize| phase(i).is_dissolved() || phase(i) == Phase::Formal;
        let is_master = |i: &usize| is_dissolved(*i) && !formed.contains(i);
        let masters: Vec<usize> = (0..count).filter(is_master).collect();
        let mut of = vec![vec![0.0; masters.len()]; count];
        let (mut solvent, mut by) = (vec![0.0; count], vec![Vec::new(); count]);
        masters.iter().enumerate().for_each(|(c, i)| of[*i][c] = 1.0);
        solvent[water] = 1.0;
        for (pivot, row) in rows {
            of[pivot] = masters.iter().map(|i| -row.members[*i]).collect();
            solvent[pivot] = -row.members[water];
            by[pivot] = row.equations.into_iter().enumerate().filter(|(_, by)| by.abs() > NOTHING).collect();
        }
        let with = |wanted: Phase| -> Vec<usize> { (0..count).filter(|i| phase(*i) == wanted).collect() };
        let (solids, formal, extracted) = (with(Phase::Solid), with(Phase::Formal), with(Phase::Extracted));
        let solutes = (0..count).filter(|i| phase(*i).is_dissolved()).collect();
        let (held, of_held) = (Vec::new(), vec![Vec::new(); count]);
        let charges = written.members.iter().map(|m| m.charge).collect();
        let basis = Basis {
            masters,
            of,
            solvent,
            by,
            water,
            solutes,
            extracted,
            solids,
            formal,
            held,
            of_held,
            circles,
            charges,
            ..Basis::default()
        };
        Ok(basis.complete())
    }

    /// Whether a member is made of many of one master.
    pub(super) fn is_steep_member(&self, i: usize) -> bool {
        self.of[i].iter().any(|part| part.abs() > STEEP)
    }

    /// With what follows from the rest.
    fn complete(mut self) -> Basis {
        let makes = |c: usize| self.of.iter().filter(|of| of[c] != 0.0).count();
        let mut order: Vec<usize> = (0..self.masters.len()).collect();
        order.sort_by_key(|c| (makes(*c), self.masters[*c]));
        self.masters = order.iter().map(|c| self.masters[*c]).collect();
        self.of.iter_mut().for_each(|of| *of = order.iter().map(|c| of[*c]).collect());
        self.numbered = (0..self.masters.len()).collect();
        self.numbered.sort_by_key(|c| self.masters[*c]);
        self.masters_of = self.of.iter().map(|of| of.iter()).collect();
        self.parts = self.of.iter().zip(&self.solvent).map(|(of, solvent)| of.iter().chain([solvent])).collect();
        self.is_steep = self.masters_of.rows().flatten().any(|(_, part)| part.abs() > STEEP);
        self.is_matter = (0..self.masters.len()).map(|c| self.of.iter().all(|of| of[c] >= 0.0)).collect();
        self
    }

    /// The same with a solid as a master in place of another one; none where it is not made of that.
    pub(super) fn with(&self, solid: usize, replaced: usize) -> Option<Basis> {
        let c = self.masters.iter().position(|i| *i == replaced)?;
        let row = (self.of[solid].clone(), self.solvent[solid], self.of_held[solid].clone(), self.by[solid].clone());
        let whole = row.0[c];
        let mut basis = self.clone();
        if whole.abs() < NOTHING {
            return None;
        }
        basis.held.push(solid);
        for i in 0..basis.of.len() {
            let share = basis.of[i][c] / whole;
            let less =
                |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to -= share * from);
            if share != 0.0 {
                less(&mut basis.of[i], &row.0);
                less(&mut basis.of_held[i], &row.2);
                basis.solvent[i] -= share * row.1;
                basis.by[i] = sum_of(&basis.by[i], &row.3, -share);
            }
            basis.of_held[i].push(share);
            basis.of[i].remove(c);
            let rest = basis.of[i].iter_mut().chain([&mut basis.solvent[i]]);
            rest.filter(|part| part.abs() < NOTHING).for_each(|part| *part = 0.0);
        }
        basis.masters.remove(c);
        Some(basis.complete())
    }

    /// The most that there can be of a member, by what there is of others at most.
    pub(super) fn upper_bound(&self, member: usize, most: impl Fn(usize) -> f64) -> f64 {
        let has = |i: usize, c: usize| self.of[i][c] > 0.0;
        let total =
            |c: usize| -> f64 { (0..self.of.len()).filter(|i| has(*i, c)).map(|i| self.of[i][c] * most(i)).sum() };
        let bounds = (0..self.masters.len()).filter(|c| self.is_matter[*c] && has(member, *c));
        bounds.map(|c| total(c) / self.of[member][c]).fold(f64::INFINITY, f64::min)
    }
}

/// One list of shares, and a multiple of another one.
fn sum_of(to: &[(usize, f64)], from: &[(usize, f64)], factor: f64) -> Vec<(usize, f64)> {
    let mut sum = to.to_vec();
    for (r, by) in from {
        match sum.iter_mut().find(|(known, _)| known == r) {
            Some((_, known)) => *known += factor * by,
            None => sum.push((*r, factor * by)),
        }
    }
    sum.retain(|(_, by)| by.abs() > NOTHING);
    sum
}

/// By what they form, the equations that are left.
type Reduced = (Vec<(usize, Row)>, Vec<Circle>);

/// Equations each of which forms one member that no other one has, and those that follow from others.
fn reduced(written: &Written) -> Result<Reduced, Unsettled> {
    let mut done: Vec<(usize, Row)> = Vec::new();
    let mut circles = Vec::new();
    for (number, equation) in written.equations.iter().enumerate() {
        let mut equations = vec![0.0; written.equations.len()];
        equations[number] = 1.0;
        let mut row = Row { members: equation.coefficients.clone(), equations };
        for (pivot, other) in &done {
            let factor = row.members[*pivot];
            if factor != 0.0 {
                row.take(other, factor);
            }
        }
        if row.members.iter().all(|v| *v == 0.0) {
            circles.push(Circle { factors: row.equations });
            continue;
        }
        let Some(pivot) = pivot(written, &row) else {
            return Err(Unsettled(format!("`{}` contains no dissolved species", equation.name)));
        };
        row.scale(1.0 / row.members[pivot]);
        for (_, other) in &mut done {
            let factor = other.members[pivot];
            if factor != 0.0 {
                other.take(&row, factor);
            }
        }
        done.push((pivot, row));
    }
    let is_formed = |i: usize| done.iter().any(|(pivot, _)| *pivot == i);
    let mut solids = (0..written.members.len()).filter(|i| written.members[*i].phase == Phase::Solid);
    match solids.find(|i| !is_formed(*i)) {
        Some(i) => Err(Unsettled(format!("the dissolved form of `{}` is unknown", written.members[i].name))),
        None => Ok((done, circles)),
    }
}

/// The member that an equation forms: a solid; else that which the fewest equations name, as a complex beside its ions; of several that
/// which stands alone on its side, so that totals of the rest count up.
fn pivot(written: &Written, row: &Row) -> Option<usize> {
    let phase = |i: usize| written.members[i].phase;
    let is_matter = |i: usize| phase(i).is_dissolved() || phase(i) == Phase::Solid;
    let is_there = |i: &usize| row.members[*i] != 0.0 && is_matter(*i);
    let beside = |i: usize| {
        let same = |j: &usize| is_there(j) && phase(*j).is_dissolved() && row.members[*j] * row.members[i] > 0.0;
        (0..row.members.len()).filter(same).count()
    };
    let named = |i: usize| written.equations.iter().filter(|e| e.coefficients[i] != 0.0).count();
    let rank = |i: usize| {
        let alone = beside(i) == 1 && row.members[i].abs() == 1.0;
        (phase(i) != Phase::Solid, named(i), !alone, usize::MAX - i)
    };
    (0..row.members.len()).filter(is_there).min_by_key(|i| rank(*i))
}
