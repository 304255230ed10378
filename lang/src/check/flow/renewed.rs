//! Bounds for all time to come that stay where little has changed. A box that the laws keep needs another look only at the faces
//! of what has changed: where these hold still, at the place where they would come to rest again, all others do, and what
//! began to move is bounded within the box. Filling one of 384 wells on a block so costs what that well and the block take.

use std::collections::BTreeSet;

use super::Interpreter;
use super::evolve::{AT_REST, InvariantBox, Kind, Making, Wall};
use super::fluxes::Row;
use super::state::AbstractState;

/// So many derivatives are looked at before a box is made anew.
const MOST_LOOKS: usize = 64;

/// A known box and what of it is found anew.
struct Renewal<'f> {
    facts: &'f AbstractState,
    making: Making,
    /// Derivatives that are bounded anew.
    anew: BTreeSet<u32>,
}

impl Interpreter<'_, '_> {
    /// A known box with what has changed since; the box as it was where more of it would become another one, or where matter moves.
    pub(super) fn renewed(
        &mut self,
        known: InvariantBox,
        facts: &mut AbstractState,
    ) -> Result<InvariantBox, InvariantBox> {
        if facts.bonds.is_some() || known.bonds.is_some() || known.states.is_empty() {
            return Err(known);
        }
        match self.renewal(&known, facts) {
            None => Err(known),
            Some((making, redone)) => {
                #[cfg(test)]
                let before = facts.clone();
                let renewed = self.renew(known, making, redone, facts);
                #[cfg(test)]
                tests::compare(self, &renewed, before);
                Ok(renewed)
            }
        }
    }

    /// What of a known box becomes another one; none where that is not only what has changed.
    fn renewal(&mut self, known: &InvariantBox, facts: &AbstractState) -> Option<(Making, BTreeSet<u32>)> {
        let mut making = Making::around(facts);
        let mut due = facts.unsettled.clone();
        let mut anew: BTreeSet<u32> = due.union(&facts.moving).copied().collect();
        for (state, faces) in &known.states {
            let of = self.derivative_of(*state).filter(|of| facts.moving.contains(of))?;
            if known.contains(*state, facts) {
                anew.remove(&of);
                making.take_over(of, *state, *faces);
            } else {
                anew.insert(of);
            }
        }
        due.extend(&anew);
        due.extend(anew.iter().flat_map(|i| self.rates_on(*i)));
        if due.len() > MOST_LOOKS {
            return None;
        }
        let mut redone = due.clone();
        let mut renewal = Renewal { facts, making, anew };
        let mut rounds = 0;
        // What moves first, then what must hold still beside it: a block so is looked at once, and not before its well too.
        while let Some(i) = due.iter().copied().find(|i| renewal.anew.contains(i)).or_else(|| due.first().copied()) {
            due.remove(&i);
            rounds += 1;
            if rounds > MOST_LOOKS {
                return None;
            }
            due.extend(self.look_again(i, &mut renewal)?);
        }
        let Renewal { mut making, anew, .. } = renewal;
        let walls: Vec<Wall> = anew.intersection(&making.moving).map(|i| Wall::Whole(*i)).collect();
        self.narrow(&walls, facts, &mut making);
        redone.extend(anew.iter().flat_map(|i| self.rates_on(*i)));
        Some((making, redone))
    }

    /// The derivatives that rest on the state of one.
    fn rates_on(&self, i: u32) -> impl Iterator<Item = u32> {
        self.rates_of.get(&self.derivatives[i as usize].state).into_iter().flatten().copied()
    }

    /// Looks at a derivative that has changed: what has to be looked at for it; none where more of the box becomes another one.
    fn look_again(&mut self, i: u32, renewal: &mut Renewal) -> Option<BTreeSet<u32>> {
        let mut crossed = BTreeSet::new();
        let kind = self.kind(i);
        if let Kind::Matter(row) = &kind {
            return self.is_still(i, row, renewal).then_some(crossed);
        }
        if renewal.anew.contains(&i) {
            self.push_out(i, &kind, false, renewal.facts, &mut renewal.making, &mut crossed);
            // At once, so that no face pushes another one out that would come in again.
            self.narrow(&[Wall::Whole(i)], renewal.facts, &mut renewal.making);
            return Some(crossed);
        }
        // What has come to where its faces are may stand still; what goes on towards them is looked at there first.
        let has_come = self.begins(Wall::Whole(i), renewal.facts) == self.faces(Wall::Whole(i), &renewal.making);
        if !has_come && self.stands(i, renewal) {
            return Some(crossed);
        }
        if !self.stops(i, renewal) {
            return (has_come && self.stands(i, renewal)).then_some(crossed);
        }
        let state = self.derivatives[i as usize].state;
        renewal.making.within.states[state as usize] = renewal.facts.states[state as usize].clone();
        renewal.making.moving.remove(&i);
        renewal.anew.insert(i);
        crossed.extend(self.rates_on(i));
        Some(crossed)
    }

    /// Whether none of the fluxes that change an amount goes on.
    fn is_still(&mut self, i: u32, row: &Row, renewal: &Renewal) -> bool {
        let stoichiometry = self.stoichiometry();
        let still = self.still(self.derivatives[i as usize].state, renewal.facts);
        row.fluxes.iter().all(|(flux, c)| {
            let (low, high) = self.flux(&stoichiometry.fluxes[*flux], &renewal.making.within);
            (low * c).abs() <= still && (high * c).abs() <= still
        })
    }

    /// Whether a state no longer moves from where it is.
    fn stops(&mut self, i: u32, renewal: &mut Renewal) -> bool {
        let state = self.derivatives[i as usize].state;
        let still = self.still(state, renewal.facts);
        let here = renewal.facts.states[state as usize].clone();
        let before = std::mem::replace(&mut renewal.making.within.states[state as usize], here);
        let (slow, fast) = self.rate(i, &renewal.making.within);
        renewal.making.within.states[state as usize] = before;
        slow.abs() <= still && fast.abs() <= still
    }

    /// Whether the faces of a state are where they would come to rest again.
    fn stands(&mut self, i: u32, renewal: &mut Renewal) -> bool {
        let wall = Wall::Whole(i);
        let making = &mut renewal.making;
        let (low, high) = self.faces(wall, making);
        let begins = self.begins(wall, renewal.facts);
        let (slow, fast) = self.rate(i, &making.within);
        if self.crossings(wall, making) != (false, false) {
            return false;
        }
        let state = self.derivatives[i as usize].state;
        // A counter: nothing slows it down.
        let counts = !self.parts(self.derivatives[i as usize].rate).states.contains(&state);
        let slack = AT_REST * (high - low);
        let mut rests = |near: f64, far: f64, side: f64| match far.is_finite() {
            true if slack.is_finite() => {
                (far - near).abs() <= slack || self.outwards(wall, far - side * slack, side, making) > 0.0
            }
            true => near == far,
            false => counts && if side > 0.0 { fast > 0.0 } else { slow < 0.0 },
        };
        rests(begins.0, low, -1.0) && rests(begins.1, high, 1.0)
    }

    /// The known box with what has become of it.
    fn renew(
        &mut self,
        mut known: InvariantBox,
        making: Making,
        redone: BTreeSet<u32>,
        facts: &mut AbstractState,
    ) -> InvariantBox {
        for i in redone {
            let derivative = &self.derivatives[i as usize];
            known.ties.remove(&i);
            if making.moving.contains(&i) {
                let bounds = making.within.states[derivative.state as usize].bounds();
                known.states.insert(derivative.state, bounds);
                known.rates.insert(i, self.eval(derivative.rate, &making.within).bounds());
            } else {
                known.states.remove(&derivative.state);
                known.rates.remove(&i);
            }
        }
        facts.moving = making.moving;
        known
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::{AbstractState, Interpreter, InvariantBox};
    use crate::check::tests::found;

    /// Boxes that were renewed and compared.
    static COMPARED: AtomicUsize = AtomicUsize::new(0);

    /// A renewed box is the one that is found without the known one.
    pub(super) fn compare(flow: &mut Interpreter<'_, '_>, renewed: &InvariantBox, mut facts: AbstractState) {
        let anew = flow.enclosed(&BTreeSet::new(), &mut facts);
        let near = |a: f64, b: f64, width: f64| a == b || (a - b).abs() <= 1e-4 * width;
        for (state, (low, high)) in &anew.states {
            let faces = renewed.states.get(state).unwrap_or_else(|| panic!("a state that moves is missing: {state}"));
            let width = if (high - low).is_finite() { high - low } else { 1.0 };
            let are = near(faces.0, *low, width) && near(faces.1, *high, width);
            assert!(are, "state {state}: {faces:?} renewed, {low} to {high} anew");
        }
        for (state, faces) in &renewed.states {
            let here = facts.states[*state as usize].bounds();
            assert!(anew.states.contains_key(state), "state {state} stands still at {here:?} and is within {faces:?}");
        }
        COMPARED.fetch_add(1, Ordering::Relaxed);
    }

    /// Pots on a hob, which they warm and cool, beside one that warms nothing.
    const KITCHEN: &str = r#"
capability Hob {
    state warmth: Temperature = 20 degC
    state power: TemperatureRate = 0 K/s
    command heat(rise: TemperatureRate)
        takes 1 s
        effect power = rise
    process loses { warmth' += power - (warmth - 20 degC) / 300 s }
}
capability Pot {
    state warmth: Temperature = 20 degC
    state wear: Ratio = 0
    command fill(warm: Temperature)
        takes 2 s
        effect warmth = warm
    process wears { wear' += exp((warmth - 20 degC) / 10 K) / 100 h }
}
asset H: Hob {}
asset P: Pot {}
process warms(p: Pot, h: Hob) {
    p.warmth' -= (p.warmth - h.warmth) / 40 s
    h.warmth' += (p.warmth - h.warmth) / 900 s
}
lab kitchen {
    ambient: 20 degC
    hob = H
    a = P
    b = P
    c = P
    d = P
}
"#;

    #[test]
    fn what_is_renewed_is_what_would_be_found_anew() {
        let pots = ["a", "b", "c", "d"];
        let mut random = 1u64;
        let mut next = |below: u64| {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (random >> 33) % below
        };
        for _ in 0..80 {
            let steps: Vec<String> = (0..16)
                .map(|_| match next(6) {
                    0 => format!("heat {} K/s by hob", next(3)),
                    1 => format!("wait {} s", [1, 30, 3000][next(3) as usize]),
                    2 => format!("expect {}.warmth <= {} degC", pots[next(4) as usize], [21, 60, 90][next(3) as usize]),
                    _ => format!("fill {} degC by {}", [4, 20, 21, 60, 95][next(5) as usize], pots[next(4) as usize]),
                })
                .collect();
            let text = format!("{KITCHEN}workflow w in kitchen {{\n{}\n}}\n", steps.join("\n"));
            found(&text, |bench| crate::check::flow::check(bench.subject(), &[], None).found);
        }
        let compared = COMPARED.load(Ordering::Relaxed);
        assert!(compared > 50, "only {compared} boxes were renewed");
    }
}
