//! Draws labs and plans.

use std::collections::BTreeSet;

use crate::explore::explore;
use crate::plan::{
    ACID, Action, Block, CYAN, Condition, Cup, Declared, Handler, Id, Ill, Kind, Lab, Plan, Remedy, Stmt, THEMES,
    Theme, Thing, each,
};
use crate::random::Random;

/// Deepest nesting of blocks.
const DEEPEST: usize = 3;

/// Readings that are noise, at most: each doubles the ways through a plan.
const DIALS: usize = 4;

/// Executions that are looked at to see whether a draft has a fault.
const GLANCE: usize = 24;

/// So many drafts are drawn before one that is not as wished is taken.
const DRAFTS: usize = 12;

/// The plan of a seed. Most have no fault, so that both sides of the checker are tried.
pub fn generate(seed: u64) -> Plan {
    let mut random = Random::new(seed);
    let sound = random.chance(60);
    let mut draft = drawn(&mut random);
    for _ in 1..DRAFTS {
        if explore(&draft, GLANCE, seed).violations.is_empty() == sound {
            break;
        }
        draft = drawn(&mut random);
    }
    draft
}

fn drawn(random: &mut Random) -> Plan {
    let theme = random.pick(THEMES).copied().unwrap_or(Theme::Liquids);
    // What an arm does takes times that are a matter of its skills: nothing goes on beside it.
    let beside = if theme == Theme::Arms { 2 } else { 0 };
    let mut draw = Draw { theme, lab: lab(random, theme), random, next: 0, jobs: 0, steps: 0, beside };
    let statements = draw.random.within(2, 5);
    let mut body = draw.block(0, statements);
    if body.is_empty() {
        body.push(draw.stmt(Kind::Wait(1_000)));
    }
    let finally = draw.finally();
    draw.lab.dials = dials(&body);
    let lab = draw.lab;
    Plan { theme, lab, declared: declared(random, theme), body, finally }
}

/// Now and then something is declared that is wrong, or nearly so.
fn declared(random: &mut Random, theme: Theme) -> Option<Declared> {
    match theme {
        Theme::Liquids if random.chance(6) => {
            let is = random.within(20, 80) as u32;
            let label = if random.chance(50) { is } else { random.within(20, 80) as u32 };
            Some(Declared::Label(is, label))
        }
        Theme::Heat if random.chance(6) => Some(Declared::Slab(random.within(2, 30) as u32)),
        Theme::Reaction if random.chance(4) => Some(Declared::Equation(random.within(2, 3) as u32)),
        _ => None,
    }
}

fn dials(body: &Block) -> usize {
    let mut n = 0;
    each(body, &mut |stmt| {
        if let Kind::If(Condition::Dial(d), ..)
        | Kind::While(Condition::Dial(d), ..)
        | Kind::Until(Condition::Dial(d), ..) = stmt.kind
        {
            n = n.max(d + 1);
        }
    });
    n
}

fn lab(random: &mut Random, theme: Theme) -> Lab {
    let mut lab = Lab { cups: Vec::new(), dials: 0, ovens: Vec::new(), tokens: 0, plates: 0 };
    let cups = match theme {
        Theme::Devices | Theme::Claims => 0,
        Theme::Heat => 2,
        Theme::Arms => 2,
        Theme::Hazards => random.within(3, 4),
        _ => random.within(2, 4),
    };
    for i in 0..cups {
        lab.cups.push(cup(random, theme, i));
    }
    let extra = random.chance(20);
    if theme == Theme::Devices || extra {
        let ovens = if theme == Theme::Devices { random.within(1, 2) } else { 1 };
        lab.ovens = (0..ovens).map(|_| random.chance(25)).collect();
    }
    if theme == Theme::Claims || random.chance(15) {
        lab.tokens = random.within(2, 3);
    }
    if theme == Theme::Heat {
        lab.plates = random.within(1, 2);
    }
    lab
}

fn cup(random: &mut Random, theme: Theme, number: usize) -> Cup {
    let liquids: &[usize] = match theme {
        Theme::Hazards => &[0, ACID, CYAN],
        Theme::Reaction => &[0, 0, 1, ACID],
        _ => &[0, 1],
    };
    let liquid = match (theme, number) {
        (Theme::Hazards, 1) => ACID,
        (Theme::Hazards, 2) => CYAN,
        (_, 0) => 0,
        _ => random.pick(liquids).copied().unwrap_or(0),
    };
    let max = random.within(30, 100) * 10;
    let (most, cap) = match theme {
        Theme::Tips => (300, None),
        Theme::Heat | Theme::Arms => (50_000, None),
        _ => (max * 4 / 5, random.chance(25).then(|| random.chance(25))),
    };
    let tin = theme == Theme::Hazards && number > 2 && cap.is_none() && random.chance(70);
    let piped = random.chance(95);
    let filled = number == 0 || theme == Theme::Hazards && number < 3 || random.chance(65);
    let volume = (random.within(most / 8, most) / 10 * 10) as u32;
    let holds = filled.then_some((if tin { 0 } else { liquid }, volume));
    Cup { max: max as u32, holds, cap, tin, piped }
}

/// What is being drawn.
struct Draw<'r> {
    theme: Theme,
    lab: Lab,
    random: &'r mut Random,
    next: Id,
    jobs: usize,
    steps: usize,
    /// How many branches, jobs and handlers are around.
    beside: usize,
}

impl Draw<'_> {
    fn stmt(&mut self, kind: Kind) -> Stmt {
        self.next += 1;
        Stmt { id: self.next - 1, kind }
    }

    fn block(&mut self, depth: usize, statements: usize) -> Block {
        let mut block = Vec::new();
        for _ in 0..statements {
            let simple = depth >= DEEPEST || self.random.chance(if depth == 0 { 50 } else { 68 });
            match simple {
                true => self.leaf(&mut block),
                false => self.construct(depth, &mut block),
            }
        }
        block
    }

    fn inner(&mut self, depth: usize) -> Block {
        let statements = self.random.within(1, 3);
        self.block(depth + 1, statements)
    }

    /// A construct with blocks.
    fn construct(&mut self, depth: usize, into: &mut Block) {
        let kind = match self.random.below(17) {
            13 => return self.window(depth, into),
            14 if !self.lab.ovens.is_empty() => self.keep(depth),
            15 if !self.lab.ovens.is_empty() => self.hold(depth),
            16 if self.random.chance(4) => {
                Kind::Ill(*self.random.pick(&[Ill::Mass, Ill::Volume]).unwrap_or(&Ill::Compared))
            }
            0..=2 => self.branch(depth),
            3 => {
                let times = self.random.within(2, 3) as u32;
                Kind::Repeat(times, self.inner(depth))
            }
            4 => match self.dial() {
                Some(dial) => self.bounded(depth, dial),
                None => return self.leaf(into),
            },
            5 | 6 if self.beside < 2 => {
                self.beside += 1;
                let branches = (0..2).map(|_| self.inner(depth + 1)).collect();
                self.beside -= 1;
                Kind::Parallel(branches)
            }
            7 if self.beside == 0 => return self.job(depth, into),
            8 | 9 => self.guarded(depth),
            10 => {
                let body = self.inner(depth);
                match raises(&body).is_empty() {
                    true => Kind::Repeat(2, body),
                    false => Kind::Try(body, self.handler(depth)),
                }
            }
            11 => match self.things().is_empty() {
                true => return self.leaf(into),
                false => self.claim(depth),
            },
            _ => match self.until(depth) {
                Some(kind) => kind,
                None => return self.leaf(into),
            },
        };
        let stmt = self.stmt(kind);
        into.push(stmt);
    }

    fn branch(&mut self, depth: usize) -> Kind {
        let condition = self.condition();
        let yes = match self.random.chance(12) {
            true => vec![self.stmt(Kind::Fail("odd"))],
            false => self.inner(depth),
        };
        let no = if self.random.chance(40) { self.inner(depth) } else { Vec::new() };
        Kind::If(condition, yes, no)
    }

    /// A loop whose bound is a failure, as a rule with a handler for that.
    fn bounded(&mut self, depth: usize, dial: Condition) -> Kind {
        let most = self.random.within(1, 2) as u32;
        let body = self.inner(depth);
        let kind = Kind::While(dial, most, body);
        match self.random.chance(70) {
            true => {
                let inside = vec![self.stmt(kind)];
                let on = if self.random.chance(70) { "max" } else { "failure" };
                Kind::Guard(inside, vec![Handler { on, what: Remedy::Block(self.handler(depth)) }])
            }
            false => kind,
        }
    }

    /// A job that begins, something beside it, and as a rule the wait for its end.
    fn job(&mut self, depth: usize, into: &mut Block) {
        let job = self.jobs;
        self.jobs += 1;
        self.beside += 1;
        let body = self.inner(depth);
        self.beside -= 1;
        let mut start = self.stmt(Kind::Start(job, body));
        if self.random.chance(8)
            && let Some(dial) = self.dial()
        {
            start = self.stmt(Kind::If(dial, vec![start], Vec::new()));
        }
        into.push(start);
        let beside = self.random.within(0, 2);
        let mut block = self.block(depth + 1, beside);
        into.append(&mut block);
        if self.random.chance(70) {
            let wait = self.stmt(Kind::Await(job));
            into.push(wait);
        }
    }

    /// A step with a name, something behind it, and what must begin soon after it.
    fn window(&mut self, depth: usize, into: &mut Block) {
        let name = self.steps;
        self.steps += 1;
        let body = self.inner(depth);
        let step = self.stmt(Kind::Step(name, body));
        into.push(step);
        let between = self.random.within(0, 2);
        let mut block = self.block(DEEPEST, between);
        into.append(&mut block);
        let limit = self.random.within(100, 12_000) as u32;
        let body = self.inner(depth);
        let handler = self.random.chance(40).then(|| self.handler(depth));
        let within = self.stmt(Kind::Within(name, limit, body, handler));
        into.push(within);
    }

    /// A device that is switched on, as a rule, and has to stay so.
    fn keep(&mut self, depth: usize) -> Kind {
        let oven = self.random.below(self.lab.ovens.len());
        let body = self.inner(depth);
        let handler = self.random.chance(50).then(|| self.handler(depth));
        Kind::Keep(Condition::On(oven), body, handler)
    }

    fn hold(&mut self, depth: usize) -> Kind {
        let oven = self.random.below(self.lab.ovens.len());
        let (span, limit) = (self.time(), self.time() * 3);
        let handler = self.random.chance(60).then(|| self.handler(depth));
        Kind::Hold(Condition::On(oven), span, limit, handler)
    }

    fn guarded(&mut self, depth: usize) -> Kind {
        let body = self.inner(depth);
        let names: Vec<&'static str> = raises(&body).into_iter().collect();
        let Some(on) = self.random.pick(&names).copied() else { return Kind::Repeat(2, body) };
        let on = if self.random.chance(25) { "failure" } else { on };
        let what = match self.random.chance(15) {
            true => Remedy::Retry(1),
            false => Remedy::Block(self.handler(depth)),
        };
        Kind::Guard(body, vec![Handler { on, what }])
    }

    fn handler(&mut self, depth: usize) -> Block {
        self.beside += 2;
        let block = match self.random.chance(50) {
            true => vec![self.stmt(Kind::Wait(330))],
            false => {
                let statements = self.random.within(1, 2);
                self.block((depth + 1).max(DEEPEST - 1), statements)
            }
        };
        self.beside -= 2;
        block
    }

    fn things(&self) -> Vec<Thing> {
        let cups = if matches!(self.theme, Theme::Tips | Theme::Arms) { 0 } else { self.lab.cups.len() };
        let cups = (0..cups).map(Thing::Cup);
        let ovens = (0..self.lab.ovens.len()).map(Thing::Oven);
        cups.chain(ovens).chain((0..self.lab.tokens).map(Thing::Token)).collect()
    }

    fn claim(&mut self, depth: usize) -> Kind {
        let all = self.things();
        let mut things: Vec<Thing> = self.random.pick(&all).copied().into_iter().collect();
        if self.random.chance(35)
            && let Some(other) = self.random.pick(&all).filter(|t| !things.contains(t))
        {
            things.push(*other);
        }
        Kind::Claim(things, self.inner(depth))
    }

    fn until(&mut self, depth: usize) -> Option<Kind> {
        let (condition, ms) = match self.theme {
            Theme::Heat if self.random.chance(60) => {
                let cup = self.random.below(self.lab.plates);
                (Condition::Warm(cup, self.random.within(23, 45) as u32), self.random.within(60, 500) as u32 * 1_003)
            }
            Theme::Reaction if self.random.chance(50) => {
                let cup = self.random.below(self.lab.cups.len());
                (Condition::Made(cup, self.random.within(10, 3_000) as u32), self.random.within(2, 60) as u32 * 1_003)
            }
            Theme::Devices if self.random.chance(40) => {
                let oven = self.random.below(self.lab.ovens.len());
                (Condition::On(oven), self.time())
            }
            _ => (self.dial()?, self.time()),
        };
        let handler = self.random.chance(60).then(|| self.handler(depth));
        Some(Kind::Until(condition, ms, handler))
    }

    fn dial(&mut self) -> Option<Condition> {
        let dial = self.lab.dials;
        (dial < DIALS).then(|| {
            self.lab.dials += 1;
            Condition::Dial(dial)
        })
    }

    fn condition(&mut self) -> Condition {
        let known = self.random.chance(30);
        match self.dial().filter(|_| !known) {
            Some(dial) => dial,
            None if self.theme == Theme::Arms && self.random.chance(50) => {
                Condition::Heavy(self.random.within(1, 60) as u32)
            }
            None if !self.lab.ovens.is_empty() && (self.lab.cups.is_empty() || self.random.chance(30)) => {
                Condition::On(self.random.below(self.lab.ovens.len()))
            }
            None if !self.lab.cups.is_empty() => {
                let most = if matches!(self.theme, Theme::Heat | Theme::Arms) { 40_000 } else { 500 };
                Condition::Fuller(self.random.below(self.lab.cups.len()), self.random.within(0, most) as u32)
            }
            None => Condition::Dial(self.random.below(self.lab.dials.max(1))),
        }
    }

    /// ms, of which hardly two are alike.
    fn time(&mut self) -> u32 {
        match self.theme {
            Theme::Heat => self.random.within(5_000, 200_000) as u32,
            _ => self.random.within(200, 9_000) as u32,
        }
    }

    fn leaf(&mut self, into: &mut Block) {
        if self.random.chance(12) {
            let time = self.time();
            let wait = self.stmt(Kind::Wait(time));
            return into.push(wait);
        }
        let devices = !self.lab.ovens.is_empty() && (self.lab.cups.is_empty() || self.random.chance(25));
        match self.theme {
            _ if devices => {
                let action = self.device();
                self.call(action, into);
            }
            Theme::Tips => self.pipetting(into),
            Theme::Pump if self.random.chance(75) => self.pumping(into),
            Theme::Arms if self.random.chance(70) => {
                let cup = self.random.below(self.lab.cups.len());
                let action = match self.random.below(10) {
                    0..=5 => Action::Place(cup, self.random.below(2)),
                    6 | 7 => Action::Pick(cup),
                    _ => Action::PutBack(cup),
                };
                self.call(action, into);
            }
            Theme::Heat if self.random.chance(70) => {
                let plate = self.random.below(self.lab.plates);
                let goal = self.random.within(25, 90) as u32;
                let action = if self.random.chance(65) { Action::Heat(plate, goal) } else { Action::Cool(plate) };
                self.call(action, into);
            }
            _ if self.lab.cups.is_empty() => {
                let time = self.time();
                let wait = self.stmt(Kind::Wait(time));
                into.push(wait);
            }
            _ => {
                let action = self.transfer();
                self.call(action, into);
            }
        }
    }

    fn call(&mut self, action: Action, into: &mut Block) {
        let stmt = self.stmt(Kind::Do(action));
        into.push(stmt);
    }

    fn device(&mut self) -> Action {
        let oven = self.random.below(self.lab.ovens.len());
        match self.random.below(6) {
            0 | 1 => Action::Fire(oven),
            2 | 3 => Action::Quench(oven),
            4 => Action::Open(oven),
            _ => Action::Close(oven),
        }
    }

    fn transfer(&mut self) -> Action {
        let capped: Vec<usize> = (0..self.lab.cups.len()).filter(|c| self.lab.cups[*c].cap.is_some()).collect();
        if !capped.is_empty() && self.random.chance(25) {
            let cup = self.random.pick(&capped).copied().unwrap_or(0);
            return if self.random.chance(50) { Action::Cap(cup) } else { Action::Uncap(cup) };
        }
        let from = self.random.below(self.lab.cups.len());
        let to = (from + self.random.within(1, self.lab.cups.len() - 1)) % self.lab.cups.len();
        let scale = if matches!(self.theme, Theme::Heat | Theme::Arms) { 500 } else { 10 };
        let volume = (self.random.within(1, 25) * scale) as u32;
        match self.random.below(10) {
            0..=5 => Action::Drip(volume, from, to),
            6 | 7 => Action::Tip(volume, from, to),
            8 => Action::Strain(volume, from, to),
            _ => Action::Double(volume, from, to),
        }
    }

    /// As a rule a tip, something with it, and its end; now and then something of that is missing.
    fn pipetting(&mut self, into: &mut Block) {
        if !self.random.chance(8) {
            self.call(Action::TakeTip, into);
        }
        for _ in 0..self.random.within(1, 2) {
            let from = self.random.below(self.lab.cups.len());
            let to = (from + self.random.within(1, self.lab.cups.len() - 1)) % self.lab.cups.len();
            let least = if self.random.chance(5) { 1 } else { 2 };
            let volume = self.random.within(least, 18) as u32 * 10;
            self.call(Action::Aspirate(volume, from), into);
            match self.random.below(10) {
                0 => {}
                1 => self.call(Action::BlowOut(to), into),
                _ => self.call(Action::Dispense(volume, to), into),
            }
        }
        if !self.random.chance(8) {
            self.call(Action::DropTip, into);
        }
    }

    /// As a rule something is drawn and pushed out elsewhere.
    fn pumping(&mut self, into: &mut Block) {
        let from = self.random.below(self.lab.cups.len());
        let to = (from + self.random.within(1, self.lab.cups.len() - 1)) % self.lab.cups.len();
        let volume = if self.random.chance(4) { 5 } else { self.random.within(2, 20) as u32 * 10 };
        self.call(Action::Draw(volume, from), into);
        if self.random.chance(90) {
            let less = if self.random.chance(20) { 10 } else { 0 };
            self.call(Action::Push(volume.saturating_sub(less).max(5), to), into);
        }
    }

    fn finally(&mut self) -> Block {
        let mut block = Vec::new();
        for oven in 0..self.lab.ovens.len() {
            if self.random.chance(65) {
                self.call(Action::Quench(oven), &mut block);
            }
        }
        for plate in 0..self.lab.plates {
            if self.random.chance(70) {
                self.call(Action::Cool(plate), &mut block);
            }
        }
        block
    }
}

/// Names of failures that a block may raise.
fn raises(block: &Block) -> BTreeSet<&'static str> {
    let mut names = BTreeSet::new();
    each(block, &mut |stmt| match &stmt.kind {
        Kind::Do(action) => names.extend(refusals(action)),
        Kind::Until(_, _, None) => drop(names.insert("timeout")),
        Kind::While(..) => drop(names.insert("max")),
        Kind::Fail(name) => drop(names.insert(name)),
        Kind::Hold(_, _, _, None) => drop(names.insert("timeout")),
        Kind::Within(_, _, _, None) => drop(names.insert("late")),
        Kind::Keep(_, _, None) => drop(names.insert("broken")),
        _ => {}
    });
    names
}

fn refusals(action: &Action) -> &'static [&'static str] {
    match action {
        Action::Drip(..) | Action::Double(..) => &["volume_underflow", "volume_overflow"],
        Action::Tip(..) | Action::Strain(..) => &["volume_overflow"],
        Action::Fire(_) => &["lid_open"],
        Action::Open(_) => &["still_moving"],
        Action::TakeTip => &["tip_on_tip"],
        Action::DropTip => &["no_tip"],
        Action::Aspirate(..) => &["no_tip", "volume_underflow", "contamination"],
        Action::Dispense(..) => &["no_tip", "volume_underflow", "volume_overflow"],
        Action::BlowOut(_) => &["no_tip", "volume_overflow"],
        Action::Pick(_) => &["hand_full"],
        Action::Place(..) => &["hand_full", "occupied", "overload"],
        Action::PutBack(_) => &["not_in_hand"],
        Action::Draw(..) => &["not_piped", "out_of_range", "volume_underflow", "contamination"],
        Action::Push(..) => &["volume_underflow", "volume_overflow", "contamination"],
        _ => &[],
    }
}
