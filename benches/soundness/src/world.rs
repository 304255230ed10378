//! How a lab stands, and the laws by which it changes: written from the texts of the library, not from the twin.

use crate::plan::{ACID, Action, CYAN, Condition, LIQUIDS, Plan, Theme};

/// Volumes and masses below this count as nothing, uL and mg.
pub const NOTHING: f64 = 1e-6;

/// Temperature of the air, degC.
const AMBIENT: f64 = 22.0;

/// Longest step of the integration of heat, s.
const STEP: f64 = 0.25;

/// Between glass and what is in it, W/K.
const WALL: f64 = 0.8;

/// J/K below which what is left counts as nothing.
pub const DROP: f64 = 4e-3;

/// Rate constant of the reaction `turn`, 1/s.
const RATE: f64 = 0.02;

/// Smallest and largest stroke of the pipette, uL.
const STROKES: (f64, f64) = (20.0, 300.0);

/// So many tips a rack has.
const TIPS: usize = 96;

/// g of an empty beaker.
const BEAKER: f64 = 28.0;

/// g that the balance bears.
const RANGE: f64 = 60.0;

/// uL that the syringe holds.
const SYRINGE: f64 = 5_000.0;

/// uL that its pump moves at least.
const LEAST: f64 = 10.0;

/// The share of the first liquid that a transfer which holds back leaves behind.
const STAYS: f64 = 0.75;

/// g/mol of the species of the reaction.
const MOLAR_MASS: f64 = 46.069;

/// A mixture: mg of each liquid, its heat in J above 0 degC, and which liquids it has met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mixture {
    /// mg by liquid.
    pub mass: [f64; 4],
    /// J.
    pub heat: f64,
    /// A bit for each liquid in it or that was in it.
    pub seen: u8,
}

impl Mixture {
    /// uL.
    pub fn volume(&self) -> f64 {
        self.mass.iter().zip(LIQUIDS).map(|(m, l)| m / l.density).sum()
    }

    /// J/K.
    pub fn capacity(&self) -> f64 {
        self.mass.iter().zip(LIQUIDS).map(|(m, l)| m / 1000.0 * l.heat).sum()
    }

    /// degC; that of the air where there is nothing.
    pub fn temperature(&self) -> f64 {
        let capacity = self.capacity();
        if capacity > 0.0 { self.heat / capacity } else { AMBIENT }
    }

    /// Takes a share out.
    fn take(&mut self, share: f64) -> Mixture {
        let mut out = Mixture { seen: self.seen, ..Mixture::default() };
        for (o, m) in out.mass.iter_mut().zip(&mut self.mass) {
            *o = *m * share;
            *m -= *o;
        }
        out.heat = self.heat * share;
        self.heat -= out.heat;
        out
    }

    /// Sets a share of the first liquid aside, as warm as the whole.
    fn hold_back(&mut self, share: f64) -> Mixture {
        let mut out = Mixture { seen: self.seen, ..Mixture::default() };
        let warm = self.temperature();
        out.mass[0] = self.mass[0] * share;
        out.heat = out.capacity() * warm;
        self.mass[0] -= out.mass[0];
        self.heat -= out.heat;
        out
    }

    fn add(&mut self, other: Mixture) {
        for (m, o) in self.mass.iter_mut().zip(other.mass) {
            *m += o;
        }
        self.heat += other.heat;
        self.seen |= other.seen;
    }
}

/// A vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vessel {
    /// What is in it.
    pub contents: Mixture,
    /// To the brim, uL.
    pub max: f64,
    /// Whether its cap is on; none where it has none.
    pub cap: Option<bool>,
    /// Whether it is made of what acid dissolves.
    pub tin: bool,
    /// Temperature of its glass, degC.
    pub glass: f64,
}

impl Vessel {
    /// Whether it holds more than it can.
    pub fn is_over(&self) -> bool {
        self.contents.volume() > self.max + 0.001
    }
}

/// A device with a lid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oven {
    /// Whether its lid is open.
    pub open: bool,
    /// Whether it is on.
    pub burning: bool,
}

/// A hot plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Whether it heats.
    pub hot: bool,
    /// Its set point, degC.
    pub goal: f64,
    /// degC.
    pub temperature: f64,
}

/// The whole lab.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Vessels.
    pub cups: Vec<Vessel>,
    /// Devices with a lid.
    pub ovens: Vec<Oven>,
    /// Hot plates.
    pub plates: Vec<Plate>,
    /// What the tip of the pipette holds, where it has one.
    pub tip: Option<Mixture>,
    tips: usize,
    reacts: bool,
    /// The beaker in hand.
    pub holding: Option<usize>,
    /// Where beakers stand that the arm moves: on the balance, 0, the stand, 1, or the table; by beaker, with where each was taken from.
    places: Vec<(Option<usize>, Option<usize>)>,
    /// The syringe pump.
    pump: Syringe,
}

/// A syringe that a pump drives.
#[derive(Clone, Debug, Default, PartialEq)]
struct Syringe {
    holds: Mixture,
    /// uL.
    drawn: f64,
    soiled: bool,
    rinsed: bool,
    /// By cup.
    piped: Vec<bool>,
}

impl Syringe {
    /// Whether what it holds, or has touched, was never in another mixture.
    fn soils(&self, other: &Mixture) -> bool {
        self.holds.seen & !other.seen != 0
    }

    /// Whether it holds a single substance.
    fn pure(&self) -> bool {
        let all: f64 = self.holds.mass.iter().sum();
        self.holds.mass.iter().any(|m| *m >= 0.999 * all)
    }
}

/// Why a step does not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A failure with a name.
    Failure(&'static str),
    /// Nothing can go on.
    Fault,
}

impl World {
    /// As a plan finds it.
    pub fn new(plan: &Plan) -> Self {
        let tips = plan.theme == Theme::Tips;
        let cups = plan.lab.cups.iter().map(|cup| {
            let mut contents = Mixture::default();
            if let Some((liquid, volume)) = cup.holds {
                contents.mass[liquid] = f64::from(volume) * LIQUIDS[liquid].density;
                contents.heat = contents.capacity() * AMBIENT;
                contents.seen = 1 << liquid;
            }
            let beakers = plan.lab.plates > 0 || plan.theme == Theme::Arms;
            let max = match (tips, beakers) {
                (true, _) => 360.0,
                (_, true) => 70_000.0,
                _ => f64::from(cup.max),
            };
            let cap = if tips || beakers { None } else { cup.cap };
            Vessel { contents, max, cap, tin: cup.tin, glass: AMBIENT }
        });
        World {
            cups: cups.collect(),
            ovens: plan.lab.ovens.iter().map(|&open| Oven { open, burning: false }).collect(),
            plates: vec![Plate { hot: false, goal: AMBIENT, temperature: AMBIENT }; plan.lab.plates],
            tip: None,
            tips: TIPS,
            reacts: plan.theme == Theme::Reaction,
            holding: None,
            places: vec![(None, None); plan.lab.cups.len()],
            pump: Syringe { piped: plan.lab.cups.iter().map(|c| c.piped).collect(), ..Syringe::default() },
        }
    }

    /// g on the balance.
    fn load(&self) -> f64 {
        let there =
            self.places.iter().enumerate().filter(|(cup, (on, _))| *on == Some(0) && self.holding != Some(*cup));
        there.map(|(cup, _)| BEAKER + self.cups[cup].contents.mass.iter().sum::<f64>() / 1000.0).sum()
    }

    /// Whether something stands at a place.
    fn taken(&self, place: usize) -> bool {
        self.places.iter().enumerate().any(|(cup, (on, _))| *on == Some(place) && self.holding != Some(cup))
    }

    /// Takes a beaker in hand. What stood on the balance was taken from where it stood before.
    fn pick(&mut self, cup: usize) {
        let (on, home) = self.places[cup];
        self.places[cup].1 = if on == Some(0) { home } else { on };
        self.holding = Some(cup);
    }

    /// Whether there is more on the balance than it bears.
    pub fn is_overloaded(&self) -> bool {
        self.load() > RANGE
    }

    /// Whether the balance bears what is on it.
    fn borne(&self) -> Result<(), Refusal> {
        if self.is_overloaded() { Err(Refusal::Failure("overload")) } else { Ok(()) }
    }

    /// How long an action lasts, s.
    pub fn duration(action: &Action) -> f64 {
        match *action {
            Action::Drip(..) => 1.13,
            Action::Tip(..) => 0.71,
            Action::Strain(..) => 0.67,
            Action::Double(..) => 0.0,
            Action::Cap(_) | Action::Uncap(_) => 2.3,
            Action::Fire(_) => 1.7,
            Action::Quench(_) => 0.93,
            Action::Open(_) => 1.37,
            Action::Close(_) => 1.51,
            Action::Heat(..) => 1.19,
            Action::Cool(_) => 0.83,
            Action::TakeTip | Action::DropTip => 4.0,
            Action::Aspirate(v, _) | Action::Dispense(v, _) => 1.5 + f64::from(v) / 92.86,
            Action::BlowOut(_) => 1.5,
            // Nothing goes on beside an arm: its times do not matter.
            Action::Pick(_) | Action::Place(..) | Action::PutBack(_) => 5.0,
            Action::Draw(v, _) | Action::Push(v, _) => 0.25 + f64::from(v) / 2500.0,
        }
    }

    /// Whether a condition holds; none where it depends on noise.
    pub fn holds(&self, condition: &Condition) -> Option<bool> {
        match *condition {
            Condition::Dial(_) => None,
            Condition::Fuller(c, v) => Some(self.cups[c].contents.volume() > f64::from(v)),
            Condition::On(o) => Some(self.ovens[o].burning),
            Condition::Warm(c, t) => Some(self.cups[c].contents.temperature() >= f64::from(t)),
            Condition::Made(c, umol) => Some(self.made(c) >= f64::from(umol)),
            Condition::Heavy(grams) => Some(self.load() > f64::from(grams)),
        }
    }

    /// Whether a quantity is so near its limit that rounding decides.
    pub fn close(&self, condition: &Condition) -> bool {
        match *condition {
            Condition::Fuller(c, v) => (self.cups[c].contents.volume() - f64::from(v)).abs() < 1e-3,
            Condition::Warm(c, t) => (self.cups[c].contents.temperature() - f64::from(t)).abs() < 1e-3,
            Condition::Made(c, umol) => (self.made(c) - f64::from(umol)).abs() < 1e-3,
            // Noise of 5 mg, shown in steps of 10 mg.
            Condition::Heavy(grams) => (self.load() - f64::from(grams)).abs() < 0.1,
            _ => false,
        }
    }

    /// umol of what the reaction makes.
    fn made(&self, cup: usize) -> f64 {
        self.cups[cup].contents.mass[1] / MOLAR_MASS * 1000.0
    }

    /// What an action needs when it begins.
    pub fn needs(&self, action: &Action) -> Result<(), Refusal> {
        let need = |holds: bool, name: &'static str| if holds { Ok(()) } else { Err(Refusal::Failure(name)) };
        let uncapped = |c: usize| self.cups[c].cap != Some(true);
        let volume = |c: usize| self.cups[c].contents.volume();
        match *action {
            Action::Drip(v, a, b) => {
                need(volume(a) >= f64::from(v) - NOTHING, "volume_underflow")?;
                need(self.cups[b].max - volume(b) >= f64::from(v) - NOTHING, "volume_overflow")?;
                need(uncapped(a) && uncapped(b), "capped")
            }
            Action::Fire(o) => need(!self.ovens[o].open, "lid_open"),
            Action::Open(o) => need(!self.ovens[o].burning, "still_moving"),
            Action::TakeTip => {
                need(self.tip.is_none(), "tip_on_tip")?;
                need(self.tips > 0, "out_of_tips")
            }
            Action::DropTip => need(self.tip.is_some(), "no_tip"),
            Action::Aspirate(v, c) => {
                let Some(tip) = self.tip else { return Err(Refusal::Failure("no_tip")) };
                let v = f64::from(v);
                need(v >= STROKES.0, "below_minimum")?;
                need(tip.volume() + v <= STROKES.1 + NOTHING, "tip_overflow")?;
                need(volume(c) > NOTHING, "never_filled")?;
                need(volume(c) >= v - NOTHING, "volume_underflow")?;
                need(tip.seen & !self.cups[c].contents.seen == 0, "contamination")
            }
            Action::Dispense(v, c) => {
                let Some(tip) = self.tip else { return Err(Refusal::Failure("no_tip")) };
                let v = f64::from(v);
                need(v >= STROKES.0, "below_minimum")?;
                need(tip.volume() >= v - NOTHING, "volume_underflow")?;
                need(volume(c) + v <= self.cups[c].max + NOTHING, "volume_overflow")
            }
            Action::BlowOut(c) => {
                let Some(tip) = self.tip else { return Err(Refusal::Failure("no_tip")) };
                need(volume(c) + tip.volume() <= self.cups[c].max + NOTHING, "volume_overflow")
            }
            Action::Pick(_) => need(self.holding.is_none(), "hand_full"),
            Action::Place(c, place) => {
                need(self.holding.is_none_or(|held| held == c), "hand_full")?;
                need(!self.taken(place), "occupied")
            }
            Action::PutBack(c) => need(self.holding == Some(c), "not_in_hand"),
            Action::Draw(v, c) => {
                let v = f64::from(v);
                need(self.pump.piped[c], "not_piped")?;
                need(uncapped(c), "capped")?;
                need(v >= LEAST, "out_of_range")?;
                need(volume(c) >= v - NOTHING, "volume_underflow")?;
                need(self.pump.drawn + v <= SYRINGE + NOTHING, "volume_overflow")?;
                let empty = self.pump.holds.volume() <= NOTHING;
                need(empty || !self.pump.soils(&self.cups[c].contents), "contamination")
            }
            Action::Push(v, c) => {
                let v = f64::from(v);
                need(self.pump.piped[c], "not_piped")?;
                need(uncapped(c), "capped")?;
                need(v >= LEAST, "out_of_range")?;
                need(self.pump.drawn >= v - NOTHING, "volume_underflow")?;
                need(self.cups[c].max - volume(c) >= v - NOTHING, "volume_overflow")?;
                need(!self.pump.soiled || self.pump.pure(), "contamination")
            }
            _ => Ok(()),
        }
    }

    /// Whether rounding decides whether an action gets what it needs: the pipettes of the library leave room for that, `drip` does not.
    pub fn hangs_on_rounding(&self, action: &Action) -> bool {
        let Action::Drip(v, a, b) = *action else { return false };
        let [there, room] = [self.cups[a].contents.volume(), self.cups[b].max - self.cups[b].contents.volume()];
        [there, room].iter().any(|limit| (limit - f64::from(v)).abs() < 1e-3)
    }

    /// Whether an action presumes what is not so.
    pub fn presumes_wrongly(&self, action: &Action) -> bool {
        match *action {
            Action::Cap(c) => self.cups[c].cap == Some(true),
            Action::Uncap(c) => self.cups[c].cap == Some(false),
            _ => false,
        }
    }

    /// Whether the effects of an action come at its end: those of an `extern skill` do, those of a command at its start.
    pub fn at_end(action: &Action) -> bool {
        matches!(
            action,
            Action::Drip(..)
                | Action::Tip(..)
                | Action::Strain(..)
                | Action::Pick(_)
                | Action::Place(..)
                | Action::PutBack(_)
                | Action::Draw(..)
                | Action::Push(..)
        )
    }

    /// What an action does.
    pub fn effect(&mut self, action: &Action) -> Result<(), Refusal> {
        match *action {
            Action::Drip(v, a, b) | Action::Tip(v, a, b) => return self.pour(f64::from(v), a, b, 0.0),
            Action::Strain(v, a, b) => return self.pour(f64::from(v), a, b, STAYS),
            Action::Cap(c) => self.cups[c].cap = Some(true),
            Action::Uncap(c) => self.cups[c].cap = Some(false),
            Action::Fire(o) => self.ovens[o].burning = true,
            Action::Quench(o) => self.ovens[o].burning = false,
            Action::Open(o) => self.ovens[o].open = true,
            Action::Close(o) => self.ovens[o].open = false,
            Action::Heat(p, t) => (self.plates[p].hot, self.plates[p].goal) = (true, f64::from(t)),
            Action::Cool(p) => self.plates[p].hot = false,
            Action::TakeTip => (self.tip, self.tips) = (Some(Mixture::default()), self.tips - 1),
            Action::DropTip => self.tip = None,
            Action::Aspirate(v, c) => {
                let volume = self.cups[c].contents.volume();
                let taken = self.cups[c].contents.take((f64::from(v) / volume).min(1.0));
                if let Some(tip) = &mut self.tip {
                    tip.add(taken);
                }
            }
            Action::Dispense(v, c) => {
                let given = self.tip.as_mut().map(|tip| tip.take((f64::from(v) / tip.volume()).min(1.0)));
                self.cups[c].contents.add(given.unwrap_or_default());
            }
            Action::BlowOut(c) => {
                if let Some(tip) = self.tip.as_mut().filter(|t| t.volume() > 0.0) {
                    let given = tip.take(1.0);
                    self.cups[c].contents.add(given);
                }
            }
            Action::Double(..) => {}
            Action::Pick(c) => self.pick(c),
            Action::Place(c, place) => {
                if self.holding.is_none() {
                    self.pick(c);
                }
                self.holding = None;
                self.places[c].0 = Some(place);
                return self.borne();
            }
            Action::PutBack(c) => {
                self.holding = None;
                self.places[c].0 = self.places[c].1;
                if let Some(place) = self.places[c].0
                    && self.places.iter().filter(|(on, _)| *on == Some(place)).count() > 1
                {
                    return Err(Refusal::Failure("occupied"));
                }
                return self.borne();
            }
            Action::Draw(v, c) => {
                let volume = self.cups[c].contents.volume();
                let soils = self.pump.soils(&self.cups[c].contents);
                (self.pump.soiled, self.pump.rinsed) = (!self.pump.rinsed && soils, false);
                self.pump.holds.seen = 0;
                let taken = self.cups[c].contents.take((f64::from(v) / volume).min(1.0));
                self.pump.holds.add(taken);
                self.pump.drawn += f64::from(v);
            }
            Action::Push(v, c) => {
                (self.pump.rinsed, self.pump.soiled) = (self.pump.pure(), false);
                let given = self.pump.holds.take((f64::from(v) / self.pump.drawn).min(1.0));
                self.cups[c].contents.add(given);
                self.pump.drawn = (self.pump.drawn - f64::from(v)).max(0.0);
            }
        }
        Ok(())
    }

    /// Moves a volume without asking, while a share of the first liquid stays; the target may flow over.
    fn pour(&mut self, volume: f64, from: usize, to: usize, stays: f64) -> Result<(), Refusal> {
        let source = &mut self.cups[from].contents;
        let stays = source.hold_back(stays);
        let there = source.volume();
        if there < volume - NOTHING {
            source.add(stays);
            return Err(Refusal::Fault);
        }
        let moved = source.take((volume / there).min(1.0));
        source.add(stays);
        self.cups[to].contents.add(moved);
        match self.cups[to].is_over() || self.cups[from].is_over() {
            true => Err(Refusal::Failure("volume_overflow")),
            false => self.borne(),
        }
    }

    /// Whether acid is in a vessel that it dissolves.
    pub fn is_attacked(&self, cup: usize) -> bool {
        self.cups[cup].tin && self.cups[cup].contents.mass[ACID] > NOTHING
    }

    /// Whether something dangerous has come together in a vessel.
    pub fn is_dangerous(&self, cup: usize) -> bool {
        let contents = &self.cups[cup].contents;
        contents.mass[ACID] > NOTHING && contents.mass[CYAN] > NOTHING
    }

    /// Lets time pass, s; `until` stops it when a condition comes true, and so does a vessel that runs over. Says how much has passed.
    pub fn pass(&mut self, time: f64, until: &[Condition]) -> f64 {
        if self.reacts {
            return self.react_until(time, until);
        }
        if self.plates.is_empty() {
            return time;
        }
        let mut passed = 0.0;
        while passed < time {
            let step = self.stable_step().min(time - passed);
            let before = self.clone();
            self.warm(step);
            if until.iter().any(|c| self.holds(c) == Some(true)) {
                let (mut low, mut high) = (0.0, step);
                for _ in 0..40 {
                    let middle = (low + high) / 2.0;
                    let mut there = before.clone();
                    there.warm(middle);
                    match until.iter().any(|c| there.holds(c) == Some(true)) {
                        true => (*self, high) = (there, middle),
                        false => low = middle,
                    }
                }
                return passed + high;
            }
            passed += step;
        }
        time
    }

    /// The longest step in which the method does not overshoot, s: a drop follows its glass at once.
    fn stable_step(&self) -> f64 {
        let capacities = self.cups.iter().map(|c| c.contents.capacity()).filter(|c| *c > DROP);
        capacities.map(|c| c / WALL).fold(STEP, f64::min)
    }

    /// Lets the reaction go on up to when a condition comes true or a vessel runs over.
    fn react_until(&mut self, time: f64, until: &[Condition]) -> f64 {
        let before = self.clone();
        let after = |time: f64| {
            let mut world = before.clone();
            world.react(time);
            world
        };
        let runs_over = |world: &World| world.cups.iter().zip(&before.cups).any(|(c, b)| c.is_over() && !b.is_over());
        let holds = |world: &World| runs_over(world) || until.iter().any(|c| world.holds(c) == Some(true));
        *self = after(time);
        if !holds(self) {
            return time;
        }
        let (mut low, mut high) = (0.0, time);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if holds(&after(middle)) { high = middle } else { low = middle }
        }
        *self = after(high);
        high
    }

    /// The reaction of first order in closed form.
    fn react(&mut self, time: f64) {
        let tip = self.tip.as_mut();
        for mixture in self.cups.iter_mut().map(|c| &mut c.contents).chain(tip) {
            let turned = mixture.mass[0] * -f64::exp_m1(-RATE * time);
            mixture.mass[0] -= turned;
            mixture.mass[1] += turned;
        }
    }

    /// One step of the method of Runge and Kutta of fourth order.
    fn warm(&mut self, h: f64) {
        let x = self.warmth();
        let moved = |x: &[f64], k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + h * k).collect() };
        let k1 = self.flows(&x);
        let k2 = self.flows(&moved(&x, &k1, h / 2.0));
        let k3 = self.flows(&moved(&x, &k2, h / 2.0));
        let k4 = self.flows(&moved(&x, &k3, h));
        let sum = |i: usize| k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i];
        let x: Vec<f64> = (0..x.len()).map(|i| x[i] + h / 6.0 * sum(i)).collect();
        let plates = self.plates.len();
        for (i, plate) in self.plates.iter_mut().enumerate() {
            plate.temperature = x[i];
        }
        for (i, cup) in self.cups.iter_mut().enumerate() {
            cup.glass = x[plates + 2 * i];
            cup.contents.heat = x[plates + 2 * i + 1];
        }
    }

    /// Temperatures of plates, then of each glass with the heat of what it holds.
    fn warmth(&self) -> Vec<f64> {
        let cups = self.cups.iter().flat_map(|c| [c.glass, c.contents.heat]);
        self.plates.iter().map(|p| p.temperature).chain(cups).collect()
    }

    /// Rates of these: Newton's law of cooling, conduction through the foot and the wall, and the heater.
    fn flows(&self, x: &[f64]) -> Vec<f64> {
        let plates = self.plates.len();
        let mut flows = vec![0.0; x.len()];
        for (i, plate) in self.plates.iter().enumerate() {
            let heater = if plate.hot { (30.0 * (plate.goal - x[i])).clamp(0.0, 200.0) } else { 0.0 };
            flows[i] += heater - 0.3 * (x[i] - AMBIENT);
        }
        for (i, cup) in self.cups.iter().enumerate() {
            let (glass, heat) = (plates + 2 * i, plates + 2 * i + 1);
            flows[glass] -= 0.09 * (x[glass] - AMBIENT);
            if i < plates {
                let q = 0.9 * (x[i] - x[glass]);
                flows[i] -= q;
                flows[glass] += q;
            }
            let capacity = cup.contents.capacity();
            if capacity > DROP {
                let inside = x[heat] / capacity;
                let q = WALL * (x[glass] - inside);
                flows[glass] -= q;
                flows[heat] += q - 0.013 * (inside - AMBIENT);
            }
        }
        for (i, flow) in flows.iter_mut().enumerate() {
            if i < plates {
                *flow /= 300.0;
            } else if (i - plates).is_multiple_of(2) {
                *flow /= 27.0;
            }
        }
        flows
    }
}
