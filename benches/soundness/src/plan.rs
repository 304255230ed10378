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
    /// A robot arm, with a stand and a balance to put beakers on.
    Arms,
    /// A syringe pump.
    Pump,
}

/// All of them.
pub const THEMES: &[Theme] = &[
    Theme::Liquids,
    Theme::Hazards,
    Theme::Tips,
    Theme::Devices,
    Theme::Claims,
    Theme::Heat,
    Theme::Reaction,
    Theme::Arms,
    Theme::Pump,
];

/// A vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct Cup {
    /// To the brim, uL.
    pub max: u32,
    /// Its content at the start: liquid and volume, uL.
    pub holds: Option<(Liquid, u32)>,
    /// Whether it has a cap, and whether that is on at the start.
    pub cap: Option<bool>,
    /// Whether it is made of what [`ACID`] dissolves.
    pub tin: bool,
    /// Whether a tube leads to it from the pump.
    pub piped: bool,
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

/// A declaration beside the lab that may be wrong, in whole percent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Declared {
    /// A solution with so much red by mass, and the label that it has.
    Label(u32, u32),
    /// A body that gives off heat to the air by so much of what its inside conducts.
    Slab(u32),
    /// A reaction of so many red to one blue.
    Equation(u32),
}

impl Declared {
    /// The code of the finding that should tell what is wrong with it.
    pub fn wrong(&self) -> Option<&'static str> {
        match *self {
            // More than 5 % off.
            Declared::Label(is, label) => (20 * is.abs_diff(label) > is).then_some("label-mismatch"),
            // A Biot number above 0.1.
            Declared::Slab(share) => (share > 10).then_some("not-lumped"),
            // Both sides are of the same formula.
            Declared::Equation(n) => (n != 1).then_some("unbalanced"),
        }
    }
}

/// A workflow in a lab.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What it is about.
    pub theme: Theme,
    /// Where.
    pub lab: Lab,
    /// What is declared besides.
    pub declared: Option<Declared>,
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
    /// `step phaseN { }`.
    Step(usize, Block),
    /// `within t after phaseN.end { }`, with a time in ms and what is done on `late`.
    Within(usize, u32, Block, Option<Block>),
    /// `keep c { }`, with what is done on `broken`.
    Keep(Condition, Block, Option<Block>),
    /// `hold c for t timeout t`, with times in ms and what is done on `timeout`.
    Hold(Condition, u32, u32, Option<Block>),
    /// A statement that no program can have: a mass for a volume, a difference of temperatures for a temperature.
    Ill(Ill),
}

/// What is wrong with a statement that no program can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ill {
    /// A mass is waited for.
    Mass,
    /// A volume is waited for.
    Volume,
    /// A time is compared with a mass.
    Compared,
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
    /// The robot arm.
    Arm,
    /// What the arm puts things on: the balance, the stand.
    Place(usize),
    /// The syringe pump.
    Pump,
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
    /// A vessel holds at least so many umol of what the reaction makes.
    Made(usize, u32),
    /// The balance shows more than so many g.
    Heavy(u32),
}

/// A call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Moves uL, after asking whether there is enough and room.
    Drip(u32, usize, usize),
    /// Moves uL without asking.
    Tip(u32, usize, usize),
    /// Moves uL without asking, of what does not stay: of the first liquid a share does.
    Strain(u32, usize, usize),
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
    /// Takes a beaker in hand.
    Pick(usize),
    /// Puts a beaker on the balance, 0, or the stand, 1; picks it up first if the hand is empty.
    Place(usize, usize),
    /// Puts a beaker back to where it was taken from.
    PutBack(usize),
    /// Draws uL into the syringe.
    Draw(u32, usize),
    /// Pushes uL out of the syringe.
    Push(u32, usize),
}

impl Plan {
    /// Calls `f` with every statement, from the outside in and in the order of the text.
    pub fn each<'p>(&'p self, f: &mut dyn FnMut(&'p Stmt)) {
        each(&self.body, f);
        each(&self.finally, f);
    }

    /// Whether a statement calls a skill with steps.
    pub fn calls_a_skill(&self, id: Id) -> bool {
        let mut calls = false;
        self.each(&mut |stmt| calls |= stmt.id == id && matches!(stmt.kind, Kind::Do(Action::Double(..))));
        calls
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
            Kind::Do(_) | Kind::Wait(_) | Kind::Await(_) | Kind::Fail(_) | Kind::Ill(_) => Vec::new(),
            Kind::Until(_, _, handler) | Kind::Hold(_, _, _, handler) => handler.iter().collect(),
            Kind::If(_, a, b) | Kind::Try(a, b) => vec![a, b],
            Kind::Repeat(_, b) | Kind::While(_, _, b) | Kind::Start(_, b) | Kind::Claim(_, b) | Kind::Step(_, b) => {
                vec![b]
            }
            Kind::Within(_, _, b, handler) | Kind::Keep(_, b, handler) => {
                std::iter::once(b).chain(handler.iter()).collect()
            }
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
            Kind::Do(_) | Kind::Wait(_) | Kind::Await(_) | Kind::Fail(_) | Kind::Ill(_) => Vec::new(),
            Kind::Until(_, _, handler) | Kind::Hold(_, _, _, handler) => handler.iter_mut().collect(),
            Kind::If(_, a, b) | Kind::Try(a, b) => vec![a, b],
            Kind::Repeat(_, b) | Kind::While(_, _, b) | Kind::Start(_, b) | Kind::Claim(_, b) | Kind::Step(_, b) => {
                vec![b]
            }
            Kind::Within(_, _, b, handler) | Kind::Keep(_, b, handler) => {
                std::iter::once(b).chain(handler.iter_mut()).collect()
            }
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
            Kind::Step(..) => "step",
            Kind::Within(..) => "within",
            Kind::Keep(..) => "keep",
            Kind::Hold(..) => "hold",
            Kind::Ill(_) => "wrong dimension",
        }
    }
}

impl Action {
    /// The construct it is, for reports.
    pub fn construct(&self) -> &'static str {
        match self {
            Action::Drip(..) => "transfer with needs",
            Action::Tip(..) => "transfer without needs",
            Action::Strain(..) => "transfer that holds back",
            Action::Double(..) => "skill with steps",
            Action::Cap(_) | Action::Uncap(_) => "cap",
            Action::Fire(_) | Action::Quench(_) => "device on, off",
            Action::Open(_) | Action::Close(_) => "lid",
            Action::Heat(..) | Action::Cool(_) => "heat",
            Action::TakeTip | Action::DropTip => "tip",
            Action::Aspirate(..) | Action::Dispense(..) | Action::BlowOut(_) => "pipetting",
            Action::Pick(_) | Action::Place(..) | Action::PutBack(_) => "arm",
            Action::Draw(..) | Action::Push(..) => "pump",
        }
    }

    /// What its effects change.
    pub fn uses(&self) -> Vec<Thing> {
        match *self {
            Action::Drip(_, a, b) | Action::Tip(_, a, b) | Action::Strain(_, a, b) => {
                vec![Thing::Cup(a), Thing::Cup(b)]
            }
            Action::Double(..) => Vec::new(),
            Action::Cap(c) | Action::Uncap(c) => vec![Thing::Cup(c)],
            Action::Fire(o) | Action::Quench(o) | Action::Open(o) | Action::Close(o) => vec![Thing::Oven(o)],
            Action::Heat(p, _) | Action::Cool(p) => vec![Thing::Plate(p)],
            Action::TakeTip | Action::DropTip => vec![Thing::Pipette],
            Action::Aspirate(_, c) | Action::Dispense(_, c) | Action::BlowOut(c) => vec![Thing::Pipette, Thing::Cup(c)],
            Action::Pick(c) | Action::PutBack(c) => vec![Thing::Arm, Thing::Cup(c)],
            Action::Place(c, p) => vec![Thing::Arm, Thing::Cup(c), Thing::Place(p)],
            Action::Draw(_, c) | Action::Push(_, c) => vec![Thing::Pump, Thing::Cup(c)],
        }
    }
}
