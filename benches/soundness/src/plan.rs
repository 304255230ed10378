//! The abstract plan: a lab and a workflow, as the generator draws them, the printer writes them and the interpreter follows them.

/// Number of a statement, unique in its plan.
pub type Id = usize;

/// Index of a liquid in [`LIQUIDS`].
pub type Liquid = usize;

/// Statements one after the other.
pub type Block = Vec<Stmt>;

/// A liquid that is counted by mass.
pub struct Matter {
    /// Its name in the text.
    pub name: &'static str,
    /// Density, mg/uL.
    pub density: f64,
    /// Specific heat capacity, J/(g*K).
    pub heat: f64,
}

/// What vessels hold. `acid` and `cyan` must never meet.
pub const LIQUIDS: &[Matter] = &[
    Matter { name: "red", density: 1.0, heat: 4.0 },
    Matter { name: "blue", density: 0.8, heat: 2.0 },
    Matter { name: "acid", density: 1.25, heat: 3.0 },
    Matter { name: "cyan", density: 1.0, heat: 4.0 },
];

/// The liquid that gives a toxic gas with [`CYAN`].
pub const ACID: Liquid = 2;

/// The liquid that gives a toxic gas with [`ACID`].
pub const CYAN: Liquid = 3;

/// What a plan is about: which things its lab has and what is done with them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Theme {
    /// Transfers between vessels.
    Liquids,
    /// Transfers of what must not meet.
    Hazards,
    /// Pipettes with tips.
    Tips,
    /// Devices with lids that are switched on and off.
    Devices,
    /// Claims.
    Claims,
    /// Hot plates.
    Heat,
    /// A reaction of first order.
    Reaction,
}

/// All of them.
pub const THEMES: &[Theme] =
    &[Theme::Liquids, Theme::Hazards, Theme::Tips, Theme::Devices, Theme::Claims, Theme::Heat, Theme::Reaction];

/// A vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct Cup {
    /// To the brim, uL.
    pub max: u32,
    /// Its content at the start: liquid and volume, uL.
    pub holds: Option<(Liquid, u32)>,
    /// Whether it has a cap, and whether that is on at the start.
    pub cap: Option<bool>,
}

/// A lab.
#[derive(Clone, Debug, PartialEq)]
pub struct Lab {
    /// Vessels `c0`, `c1`, ...; wells where there is a pipette, beakers where there are hot plates.
    pub cups: Vec<Cup>,
    /// Meters whose reading is noise: `d0`, ...; what depends on one is open before the run.
    pub dials: usize,
    /// Devices with a lid, `o0`, ...: whether it is open at the start.
    pub ovens: Vec<bool>,
    /// Things that are only claimed, `t0`, ...
    pub tokens: usize,
    /// Hot plates `p0`, ...; the beaker of the same number stands on each.
    pub plates: usize,
}

/// A workflow in a lab.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What it is about.
    pub theme: Theme,
    /// Where.
    pub lab: Lab,
    /// What is done.
    pub body: Block,
    /// What is done in the end.
    pub finally: Block,
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub struct Stmt {
    /// Its number.
    pub id: Id,
    /// What it does.
    pub kind: Kind,
}

/// What a statement does.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A call.
    Do(Action),
    /// `wait`, ms.
    Wait(u32),
    /// `wait until`, with a timeout in ms and what is done when it strikes.
    Until(Condition, u32, Option<Block>),
    /// `if`.
    If(Condition, Block, Block),
    /// `repeat n times`.
    Repeat(u32, Block),
    /// `repeat while c max n`.
    While(Condition, u32, Block),
    /// `parallel`, a `sequence` for each branch.
    Parallel(Vec<Block>),
    /// `start jN = { }`.
    Start(usize, Block),
    /// `await jN`.
    Await(usize),
    /// `sequence { } on ...`.
    Guard(Block, Vec<Handler>),
    /// `try { } else { }`.
    Try(Block, Block),
    /// `fail NAME`.
    Fail(&'static str),
    /// `claim a, b { }`.
    Claim(Vec<Thing>, Block),
}

/// `on NAME { }`.
#[derive(Clone, Debug, PartialEq)]
pub struct Handler {
    /// The failure; `failure` takes all.
    pub on: &'static str,
    /// What is done: another go, so many times, or statements.
    pub what: Remedy,
}

/// What a handler does.
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    /// `retry n`.
    Retry(u32),
    /// Statements.
    Block(Block),
}

/// Something that can be claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Thing {
    /// A vessel.
    Cup(usize),
    /// A device with a lid.
    Oven(usize),
    /// Something without a use.
    Token(usize),
    /// A hot plate.
    Plate(usize),
    /// The pipette.
    Pipette,
}

/// A condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Condition {
    /// A reading that is noise is above its middle.
    Dial(usize),
    /// A vessel holds more than so many uL.
    Fuller(usize, u32),
    /// A device is on.
    On(usize),
    /// What a vessel holds is at least this warm, degC.
    Warm(usize, u32),
}

/// A call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Moves uL, after asking whether there is enough and room.
    Drip(u32, usize, usize),
    /// Moves uL without asking.
    Tip(u32, usize, usize),
    /// A skill of two drips with a pause between.
    Double(u32, usize, usize),
    /// Puts a cap on.
    Cap(usize),
    /// Takes a cap off.
    Uncap(usize),
    /// Switches a device on; its lid must be closed.
    Fire(usize),
    /// Switches it off.
    Quench(usize),
    /// Opens a lid; the device must be off.
    Open(usize),
    /// Closes a lid.
    Close(usize),
    /// Heats a plate to so many degC.
    Heat(usize, u32),
    /// Stops heating it.
    Cool(usize),
    /// Takes the next tip.
    TakeTip,
    /// Leaves the tip.
    DropTip,
    /// Takes up uL.
    Aspirate(u32, usize),
    /// Gives off uL.
    Dispense(u32, usize),
    /// Gives off everything.
    BlowOut(usize),
}

impl Plan {
    /// Calls `f` with every statement, from the outside in and in the order of the text.
    pub fn each<'p>(&'p self, f: &mut dyn FnMut(&'p Stmt)) {
        each(&self.body, f);
        each(&self.finally, f);
    }

    /// How many statements it has.
    pub fn size(&self) -> usize {
        let mut n = 0;
        self.each(&mut |_| n += 1);
        n
    }
}

/// Calls `f` with every statement of a block.
pub fn each<'p>(block: &'p [Stmt], f: &mut dyn FnMut(&'p Stmt)) {
    for stmt in block {
        f(stmt);
        for inner in stmt.kind.blocks() {
            each(inner, f);
        }
    }
}

impl Kind {
    /// The blocks in it, in the order of the text.
    pub fn blocks(&self) -> Vec<&Block> {
        match self {
            Kind::Do(_) | Kind::Wait(_) | Kind::Await(_) | Kind::Fail(_) => Vec::new(),
            Kind::Until(_, _, handler) => handler.iter().collect(),
            Kind::If(_, a, b) | Kind::Try(a, b) => vec![a, b],
            Kind::Repeat(_, b) | Kind::While(_, _, b) | Kind::Start(_, b) | Kind::Claim(_, b) => vec![b],
            Kind::Parallel(branches) => branches.iter().collect(),
            Kind::Guard(body, handlers) => std::iter::once(body)
                .chain(handlers.iter().filter_map(|h| match &h.what {
                    Remedy::Block(b) => Some(b),
                    Remedy::Retry(_) => None,
                }))
                .collect(),
        }
    }

    /// The same, to change.
    pub fn blocks_mut(&mut self) -> Vec<&mut Block> {
        match self {
            Kind::Do(_) | Kind::Wait(_) | Kind::Await(_) | Kind::Fail(_) => Vec::new(),
            Kind::Until(_, _, handler) => handler.iter_mut().collect(),
            Kind::If(_, a, b) | Kind::Try(a, b) => vec![a, b],
            Kind::Repeat(_, b) | Kind::While(_, _, b) | Kind::Start(_, b) | Kind::Claim(_, b) => vec![b],
            Kind::Parallel(branches) => branches.iter_mut().collect(),
            Kind::Guard(body, handlers) => std::iter::once(body)
                .chain(handlers.iter_mut().filter_map(|h| match &mut h.what {
                    Remedy::Block(b) => Some(b),
                    Remedy::Retry(_) => None,
                }))
                .collect(),
        }
    }

    /// The construct it is, for reports.
    pub fn construct(&self) -> &'static str {
        match self {
            Kind::Do(action) => action.construct(),
            Kind::Wait(_) => "wait",
            Kind::Until(_, _, None) => "wait until",
            Kind::Until(..) => "wait until, on timeout",
            Kind::If(..) => "if",
            Kind::Repeat(..) => "repeat",
            Kind::While(..) => "repeat while",
            Kind::Parallel(_) => "parallel",
            Kind::Start(..) => "start",
            Kind::Await(_) => "await",
            Kind::Guard(_, handlers) if handlers.iter().any(|h| matches!(h.what, Remedy::Retry(_))) => "handler, retry",
            Kind::Guard(..) => "handler",
            Kind::Try(..) => "try",
            Kind::Fail(_) => "fail",
            Kind::Claim(..) => "claim",
        }
    }
}

impl Action {
    /// The construct it is, for reports.
    pub fn construct(&self) -> &'static str {
        match self {
            Action::Drip(..) => "transfer with needs",
            Action::Tip(..) => "transfer without needs",
            Action::Double(..) => "skill with steps",
            Action::Cap(_) | Action::Uncap(_) => "cap",
            Action::Fire(_) | Action::Quench(_) => "device on, off",
            Action::Open(_) | Action::Close(_) => "lid",
            Action::Heat(..) | Action::Cool(_) => "heat",
            Action::TakeTip | Action::DropTip => "tip",
            Action::Aspirate(..) | Action::Dispense(..) | Action::BlowOut(_) => "pipetting",
        }
    }

    /// What its effects change.
    pub fn uses(&self) -> Vec<Thing> {
        match *self {
            Action::Drip(_, a, b) | Action::Tip(_, a, b) => vec![Thing::Cup(a), Thing::Cup(b)],
            Action::Double(..) => Vec::new(),
            Action::Cap(c) | Action::Uncap(c) => vec![Thing::Cup(c)],
            Action::Fire(o) | Action::Quench(o) | Action::Open(o) | Action::Close(o) => vec![Thing::Oven(o)],
            Action::Heat(p, _) | Action::Cool(p) => vec![Thing::Plate(p)],
            Action::TakeTip | Action::DropTip => vec![Thing::Pipette],
            Action::Aspirate(_, c) | Action::Dispense(_, c) | Action::BlowOut(c) => vec![Thing::Pipette, Thing::Cup(c)],
        }
    }
}
