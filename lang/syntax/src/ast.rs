//! The syntax tree: what was written, nothing resolved. Error nodes stand where something could not be read.

use matterix_ir::Span;
use serde::{Deserialize, Serialize};

/// A word as written; for a species with its charge and phase: `EtOH`, `SO4^2-`, `KNO3(s)`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Name {
    /// The text.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// `std::heating::IkaRet`, `jacket`, `left.table`: segments joined by `::` or `.`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// At least one.
    pub segments: Vec<Name>,
    /// Where.
    pub span: Span,
}

/// A unit as written: `degC`, `kg/(mol*s)`, `%w/w`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitText {
    /// The text, without blanks.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// One source file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct File {
    /// The `mtx` header's number; absent where the header is missing (which is reported).
    pub version: Option<u32>,
    /// `//!` lines, without the marker and one blank.
    pub docs: Vec<String>,
    /// In order.
    pub items: Vec<Item>,
}

/// A declaration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// `///` lines, without the marker and one blank.
    pub docs: Vec<String>,
    /// What it declares.
    pub kind: ItemKind,
    /// All of it.
    pub span: Span,
}

/// What an item declares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ItemKind {
    /// Could not be read; reported already.
    Error,
    /// `use std::robots::{FrankaPanda, Robotiq2F85}`; without braces the last segment is the name.
    Use {
        /// The module, or module and name.
        path: Path,
        /// The braces.
        names: Option<Vec<Name>>,
    },
    /// `dimension Velocity = Length / Time`, `dimension Length`, `dimension Temperature = point TemperatureDifference`.
    Dimension {
        /// Its name.
        name: Name,
        /// `point` stands before the definition.
        point: bool,
        /// Absent for a base dimension.
        definition: Option<Expr>,
    },
    /// `unit bar: Pressure = 1e5 Pa with prefixes`, `unit degC: Temperature = 1 K from 273.15 K also °C`.
    Unit {
        /// Its name.
        name: UnitText,
        /// Absent where it follows from the definition.
        dimension: Option<Name>,
        /// Absent for the base unit of its dimension.
        definition: Option<Expr>,
        /// `from`: the value of its zero.
        origin: Option<Expr>,
        /// `with prefixes`: takes SI prefixes.
        prefixes: bool,
        /// `also`: other spellings.
        aliases: Vec<UnitText>,
    },
    /// `species KI { formula: "KI" }`.
    Species {
        /// With charge and phase.
        name: Name,
        /// Its properties.
        fields: Vec<Field>,
    },
    /// `solution S0 { KI: 0.66 g, water: 100 g } labelled 0.04 mol/kg of KI`.
    Solution {
        /// Its name.
        name: Name,
        /// Recipe lines.
        fields: Vec<Field>,
        /// The label.
        labelled: Option<Labelled>,
    },
    /// `reaction r: A + 2 B -> C { rate: ... }`.
    Reaction {
        /// Its name.
        name: Name,
        /// Left side: coefficient (as written, absent for 1) and species.
        reactants: Vec<Term>,
        /// `<->`.
        reversible: bool,
        /// Right side.
        products: Vec<Term>,
        /// Rate, order, window, template, enthalpy.
        fields: Vec<Field>,
    },
    /// `interaction i: Na+ + Cl- { b0: 0.0765 }`.
    Interaction {
        /// Its name.
        name: Name,
        /// What acts on each other.
        between: Vec<Term>,
        /// Its numbers.
        fields: Vec<Field>,
    },
    /// `equilibrium e: HA <-> H+ + A- { pka: 4.756 }`.
    Equilibrium {
        /// Its name.
        name: Name,
        /// Left side.
        reactants: Vec<Term>,
        /// Right side.
        products: Vec<Term>,
        /// Its constant, where that holds, its enthalpy.
        fields: Vec<Field>,
    },
    /// `reactive_group ketone { smarts: ["[#6][CX3](=O)[#6]"], source: "..." }`.
    ReactiveGroup {
        /// Its name.
        name: Name,
        /// Who belongs to it, and where that is published.
        fields: Vec<Field>,
    },
    /// `material polystyrene { source: "..." }`: what a vessel is made of.
    Material {
        /// Its name.
        name: Name,
        /// What is known of it.
        fields: Vec<Field>,
    },
    /// `incompatible ketone with oxidising_acid { consequence: [heat, fire], source: "..." }`.
    Incompatible {
        /// A reactive group, a material or a species.
        a: Name,
        /// The other one.
        b: Name,
        /// What happens, from which content on, and where that is published.
        fields: Vec<Field>,
    },
    /// `allow incompatible acetone with HNO3 "why"`.
    Allow {
        /// A reactive group, a material or a species.
        a: Name,
        /// The other one.
        b: Name,
        /// Why it is meant.
        reason: String,
    },
    /// `allow undissolved "why"`: a hazard or caution that this package accepts.
    Accept {
        /// Its name.
        name: Name,
        /// Why it is meant.
        reason: String,
    },
    /// `hazard closed_vessel_heated(h: Heater & Body, v: Capped) when ... "open it first"`.
    Hazard {
        /// `hazard`, not `caution`: it is an error.
        grave: bool,
        /// Its name.
        name: Name,
        /// Over what.
        params: Vec<Param>,
        /// `of acidity(m)`: the value, or the transfer, at whose use it is looked at.
        of: Option<Expr>,
        /// `after move(share, from: a, to: b)`: the transfer behind which the value's use counts.
        after: Option<Expr>,
        /// When it is there.
        when: Expr,
        /// How to mend it.
        help: Option<String>,
        /// What is so, in words with values; it may name what `any` goes through.
        because: Option<Text>,
    },
    /// `capability Heater: Thermal { ... }`.
    Capability {
        /// Its name.
        name: Name,
        /// Extended capabilities.
        extends: Vec<Path>,
        /// `sila "file"` after `from`.
        source: Option<(Name, Name)>,
        /// In order.
        members: Vec<Member>,
    },
    /// `asset IkaRet: Heater, Stirrer { gain: 70 W/K }`.
    Asset {
        /// Its name.
        name: Name,
        /// Capabilities, or assets it builds on.
        extends: Vec<Path>,
        /// `urdf "file"` and the like after `from`.
        source: Option<(Name, Name)>,
        /// In order.
        lines: Vec<AssetLine>,
    },
    /// `process conduction(a: Thermal, b: Thermal) while touching(a, b) { ... }`.
    Process(Process),
    /// `event ran_dry when source.volume <= 0 mL { running = false }`.
    Event(Event),
    /// `relation touching(a: Body, b: Body) symmetric = a.support == b or b.support == a`.
    Relation {
        /// Its name.
        name: Name,
        /// Between what.
        params: Vec<Param>,
        /// `symmetric` stands after the parameters.
        symmetric: bool,
        /// When it holds.
        definition: Option<Expr>,
    },
    /// `fn clamp(x: Ratio) -> Ratio = ...`, `extern fn exp(x: Ratio) -> Ratio`.
    Fn {
        /// Bound by the runtime.
        external: bool,
        /// Its name.
        name: Name,
        /// Its parameters.
        params: Vec<Param>,
        /// Result type.
        result: Option<Type>,
        /// Its body.
        body: Option<Expr>,
        /// `{ at_least: 0 W/K }`: what a lab may give instead.
        options: Vec<NamedExpr>,
    },
    /// `const R: MolarHeatCapacity = 8.314462618 J/(mol*K)`.
    Const {
        /// Its name.
        name: Name,
        /// Its type.
        ty: Option<Type>,
        /// Its value.
        value: Expr,
    },
    /// `table plan from csv "plan.csv" { well: Place, volume: Volume as uL }`.
    Table {
        /// Its name.
        name: Name,
        /// The format and the file after `from`.
        source: (Name, Name),
        /// Its columns.
        columns: Vec<Column>,
        /// What the file holds: nothing before it is read, or where it cannot be.
        rows: Option<Box<TableRows>>,
    },
    /// `framing stx { carries: text, frame: "\x02{data}\x03" }`.
    Framing {
        /// Its name.
        name: Name,
        /// What stands around messages, and what proves them whole.
        fields: Vec<Field>,
    },
    /// `driver IkaNamur for IkaRet over serial(baud: 9600) { ... }`.
    Driver {
        /// Its name.
        name: Name,
        /// The asset type it drives.
        device: Path,
        /// `serial`, `tcp`, `http`.
        transport: Name,
        /// The transport's settings.
        args: Vec<Arg>,
        /// Its mappings.
        wires: Vec<Wire>,
    },
    /// `lab bench { ... }`.
    Lab {
        /// Its name.
        name: Name,
        /// Its parameters.
        params: Vec<Param>,
        /// In order.
        lines: Vec<LabLine>,
    },
    /// `skill place(item: Graspable) on(target: Surface) ... { }`.
    Skill {
        /// Bound by the runtime, without a body.
        external: bool,
        /// Verb and parameters.
        sig: Sig,
        /// `needs`, `effect`, ...
        clauses: Vec<Clause>,
        /// Its steps.
        body: Option<Block>,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `workflow synthesize(target: Temperature = 76 degC) in bench { } finally { }`.
    Workflow {
        /// Its name.
        name: Name,
        /// Its parameters.
        params: Vec<Param>,
        /// `in any lab` gives no path.
        lab: Option<Path>,
        /// Its steps.
        body: Block,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `study screen of synthesize { ... }`.
    Study {
        /// Its name.
        name: Name,
        /// The workflow.
        of: Path,
        /// In order.
        lines: Vec<StudyLine>,
    },
    /// `fit kinetics of synthesize { ... }`.
    Fit {
        /// Its name.
        name: Name,
        /// The workflow.
        of: Path,
        /// In order.
        lines: Vec<FitLine>,
    },
    /// `test name { run workflow ... }`, `test name in lab { ... }`.
    Test {
        /// Its name.
        name: Name,
        /// Where its own steps are done; none for a test of a workflow.
        lab: Option<Path>,
        /// Its steps.
        body: Block,
        /// Failure handlers and `finally`.
        handlers: Handlers,
    },
}

/// `volume "Transfer volume": Volume as uL = 0 uL`: a column of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Its name.
    pub name: Name,
    /// What its header in the file says, if that is no name.
    pub header: Option<Name>,
    /// Its type.
    pub ty: Type,
    /// The unit of bare numbers.
    pub unit: Option<UnitText>,
    /// What an empty cell stands for.
    pub default: Option<Expr>,
    /// All of it.
    pub span: Span,
}

/// What the file of a table holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableRows {
    /// A figure of the whole text of the file, as `sha256sum` gives it.
    pub sum: String,
    /// In order.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableRow {
    /// Its line in the file, counted from 1.
    pub line: u32,
    /// All of it.
    pub span: Span,
    /// A cell for each column; none where it is empty and its column says what that means.
    pub cells: Vec<Option<Expr>>,
}

/// `labelled 0.04 mol/kg of KI +- 1 %`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Labelled {
    /// The concentration.
    pub value: Expr,
    /// Of what.
    pub species: Name,
    /// Its tolerance.
    pub tolerance: Option<Expr>,
    /// All of it.
    pub span: Span,
}

/// A species with its coefficient in an equation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// 1 where none is written.
    pub coefficient: f64,
    /// The species.
    pub species: Name,
    /// Both.
    pub span: Span,
}

/// `key: value`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// A word or a species.
    pub key: Name,
    /// Its value.
    pub value: FieldValue,
    /// Both.
    pub span: Span,
}

/// What a field holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FieldValue {
    /// `70 W/K`.
    Expr(Expr),
    /// `{ EtOH: 1, HI: 1 }`.
    Fields(Vec<Field>),
    /// `Robotiq2F85 { ... }`.
    Literal(AssetLiteral),
    /// `K+ + 2 I-`: species joined by `+`, in a `dissolves` field.
    Species(Vec<Term>),
}

/// `IkaRet { gain: 70 W/K }`, or the type alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetLiteral {
    /// The type.
    pub ty: Path,
    /// Overrides.
    pub fields: Vec<Field>,
    /// All of it.
    pub span: Span,
}

/// `at (0, 0, 40) mm from grasp with rpy(0 deg, 90 deg, 0 deg)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct At {
    /// Two or three lengths.
    pub position: Expr,
    /// The frame of the same thing it is given in; the thing's own without one.
    pub from: Option<Name>,
    /// Roll, pitch and yaw.
    pub turned: Option<Expr>,
}

/// A joint of an asset and what it follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jointed {
    /// Its name, and that of the part it carries.
    pub name: Name,
    /// How that moves; a joint of the asset's description without it.
    pub way: Option<Way>,
    /// How far it has moved: a length or an angle.
    pub by: Expr,
}

/// How a part of an asset moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// Along its axis instead of about it.
    pub slides: bool,
    /// Three numbers.
    pub axis: Expr,
    /// Where the part is before it has moved; at the origin without it.
    pub at: Option<At>,
}

/// A line of an asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum AssetLine {
    /// Could not be read.
    Error(Span),
    /// `gain: 70 W/K`.
    Field(Field),
    /// `frame place at (0, 0, 130) mm`.
    Frame {
        /// Its name.
        name: Name,
        /// Its pose.
        at: At,
    },
    /// `solid box(20 mm, 400 mm, 600 mm) at (-190, 0, 0) mm`: a piece of its body beside its `shape`.
    Solid {
        /// Like a `shape`.
        shape: Expr,
        /// Its pose; at the origin without one.
        at: Option<At>,
    },
    /// `joint lid turns (1, 0, 0) at (0, 0, 90) mm by choose(lid == open, 100 deg, 0 deg)`: a part of it that moves.
    Joint(Box<Jointed>),
    /// A mesh that a shape of the asset names at this place; none where it cannot be read.
    Mesh(Span, Option<std::sync::Arc<matterix_ir::mesh::Mesh>>),
    /// Links and joints, from the file at this place.
    Robot(Box<matterix_ir::robot::Robot>, Span),
    /// `lid = Lid { ... }`: a child asset.
    Part {
        /// Its name.
        name: Name,
        /// Its type.
        literal: AssetLiteral,
    },
    /// `wells[A1 .. H12] = Well { ... } at (14.38, 74.24) mm pitch (9, 9) mm`: child assets in rows and columns.
    Grid(Grid),
}

/// A grid of child assets, or a part of one: lines with the same name make one grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Its name.
    pub name: Name,
    /// The first place: `A1`, `1`.
    pub from: Name,
    /// The last place, if there are several.
    pub to: Option<Name>,
    /// What stands at each place.
    pub literal: AssetLiteral,
    /// Where the first place is on the asset.
    pub at: Option<Expr>,
    /// From column to column and from row to row.
    pub pitch: Option<Expr>,
    /// For numbered places: how many stand in a row.
    pub row: Option<Expr>,
}

/// A member of a capability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// `///` lines.
    pub docs: Vec<String>,
    /// What it is.
    pub kind: MemberKind,
    /// All of it.
    pub span: Span,
}

/// What a member is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MemberKind {
    /// Could not be read.
    Error,
    /// `param gain: Power`, `state active: Bool = false`, `extensive amount: Amount per Species`.
    Value {
        /// Which of them.
        role: Role,
        /// Its name.
        name: Name,
        /// Its type.
        ty: Type,
        /// `per Species`.
        per: Option<Name>,
        /// Default, initial value or definition.
        value: Option<Expr>,
        /// `{ resolution: 0.01 g }`.
        options: Vec<NamedExpr>,
    },
    /// `view[s: Species]: AmountPerMass = amount[s] / mass`: what `x[S]` means when a unit of this dimension is asked for.
    View {
        /// The index.
        param: Param,
        /// Its type.
        ty: Type,
        /// Its definition.
        value: Expr,
    },
    /// `command heat to(t: Temperature) needs ...`.
    Command {
        /// Verb and parameters.
        sig: Sig,
        /// `needs`, `effect`, ...
        clauses: Vec<Clause>,
    },
    /// A law on the instance itself.
    Process(Process),
    /// An instantaneous change on the instance itself.
    Event(Event),
    /// `keeps volume <= max_volume else volume_overflow "use a larger vessel"`, `ends not active else left_on`.
    Limit {
        /// `ends`, not `keeps`: it is looked at when a workflow has ended, and not before.
        at_end: bool,
        /// What must hold.
        cond: Expr,
        /// The failure raised where it does not.
        refusal: Option<Refusal>,
    },
    /// `frame place at (0, 0, 1) mm`; `frame grasp` without `at` is one that every asset must give.
    Frame {
        /// Its name.
        name: Name,
        /// Its pose.
        at: Option<At>,
    },
}

/// Which kind of value a member is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Fixed for an instance.
    Param,
    /// Changes by commands, events and processes.
    State,
    /// Follows from others.
    Derived,
    /// What the device reports.
    Reading,
    /// A sum of contributions.
    Flow,
    /// A state that a transfer takes a fraction of.
    Extensive,
    /// A sub-instance.
    Part,
}

/// `process NAME(PARAMS) while COND { LAWS }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Process {
    /// Its name.
    pub name: Name,
    /// Over what; empty for the instance itself.
    pub params: Vec<Param>,
    /// When it runs.
    pub guard: Option<Expr>,
    /// Its laws.
    pub laws: Vec<Law>,
}

/// `event NAME(PARAMS) when COND { LAWS }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Its name.
    pub name: Name,
    /// Over what; empty for the instance itself.
    pub params: Vec<Param>,
    /// What sets it off as it becomes true.
    pub when: Expr,
    /// How much later it happens.
    pub delay: Option<Delay>,
    /// What happens.
    pub laws: Vec<Law>,
}

/// `for TIME` or `after TIME` behind the condition of an event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Delay {
    /// `for`: the condition has to hold all the while.
    pub sustained: bool,
    /// How long.
    pub time: Expr,
}

/// A line of a law body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// What it says.
    pub kind: LawKind,
    /// Where.
    pub span: Span,
}

/// What a law line says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LawKind {
    /// Could not be read.
    Error,
    /// `let q = ...`.
    Let {
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
    },
    /// `for s in r.species { }`.
    For {
        /// The variable.
        var: Name,
        /// The finite set.
        set: Expr,
        /// The lines.
        body: Vec<Law>,
    },
    /// `if c { } else { }`.
    If {
        /// Which.
        cond: Expr,
        /// If it holds.
        then: Vec<Law>,
        /// If not.
        otherwise: Vec<Law>,
    },
    /// `x += e`, `x -= e`, `x = e`, `x' += e`, `x' -= e`, `x' = e`; a prime is [`ExprKind::Prime`] on the target.
    Assign {
        /// What changes.
        target: Expr,
        /// How.
        op: AssignOp,
        /// By what.
        value: Expr,
    },
    /// `move(q, from: source, to: sink)`.
    Call(Expr),
}

/// How a law changes its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AssignOp {
    /// `=`
    Set,
    /// `+=`
    Add,
    /// `-=`
    Sub,
}

/// A text with values in braces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Text {
    /// In order.
    pub parts: Vec<TextPart>,
    /// All of it, with its quotes.
    pub span: Span,
}

/// A piece of a [`Text`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TextPart {
    /// As written.
    Plain(String),
    /// `{t as degC :.1}`.
    Value {
        /// What is shown.
        value: Expr,
        /// Digits after the point.
        digits: Option<u8>,
        /// `{t as degC :i16 big}`: another form, which only lines to devices know.
        form: Option<Name>,
    },
}

/// A type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Type {
    /// `Heater & Surface`: one or more.
    pub paths: Vec<Path>,
    /// `open | closed`: its words; there are no paths then.
    pub words: Vec<Name>,
    /// `Range<Temperature>`.
    pub argument: Option<Box<Type>>,
    /// `?`: may be `nothing`; a limit may be `unlimited`.
    pub optional: bool,
    /// `where ...`.
    pub condition: Option<Expr>,
    /// All of it.
    pub span: Span,
}

/// `name: Type = default`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: Option<Type>,
    /// `of source`: the other argument whose functions its value may name.
    pub of: Option<Name>,
    /// Its default.
    pub default: Option<Expr>,
}

/// `place(item: Graspable) on(target: Surface) by(arm: Arm)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sig {
    /// One or more words.
    pub verb: Vec<Name>,
    /// The first group.
    pub params: Vec<Param>,
    /// `on(target: Surface)`: label and its group.
    pub labelled: Vec<(Name, Vec<Param>)>,
    /// `-> Mass`.
    pub result: Option<Type>,
    /// All of it.
    pub span: Span,
}

impl Sig {
    /// The parameters of all groups, in the order of the text.
    pub fn all_params(&self) -> impl Iterator<Item = &Param> {
        self.params.iter().chain(self.labelled.iter().flat_map(|(_, params)| params))
    }

    /// Whether another has the same labels in the same order, with as many parameters each.
    pub fn has_form_of(&self, other: &Sig) -> bool {
        self.params.len() == other.params.len()
            && self.labelled.len() == other.labelled.len()
            && self.labelled.iter().zip(&other.labelled).all(|(a, b)| a.0.text == b.0.text && a.1.len() == b.1.len())
    }
}

/// A clause of a skill or command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clause {
    /// What it says.
    pub kind: ClauseKind,
    /// Where.
    pub span: Span,
}

/// `else too_wide "take a wider one" because "{item} is {item.width} wide"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// The failure raised.
    pub failure: Name,
    /// How to mend it.
    pub help: Option<String>,
    /// What is so, in words with values; it may name what `all` goes through.
    pub because: Option<Text>,
}

/// What a clause says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ClauseKind {
    /// `needs t in limits`, with `else too_hot "cool it first"` a failure of its own.
    Needs {
        /// What must hold.
        cond: Expr,
        /// The failure raised where it does not.
        refusal: Option<Refusal>,
    },
    /// `presumes ever active else never_started`: looked at before the run only.
    Presumes {
        /// Whether it is enough that it held at some moment before.
        ever: bool,
        /// What must hold on some way at least.
        cond: Expr,
        /// What its finding is called.
        refusal: Option<Refusal>,
    },
    /// `warns volume >= volumes.min else below_minimum`: a warning where it does not hold; the run goes on.
    Warns {
        /// What should hold.
        cond: Expr,
        /// What its finding is called.
        refusal: Option<Refusal>,
    },
    /// `while v.temperature < 80 degC`.
    While(Expr),
    /// `fails slip, unreachable`.
    Fails(Vec<Name>),
    /// `effect active = true, target = t`.
    Effect(Vec<Effect>),
    /// `takes 6 s in 4 s .. 30 s`.
    Takes {
        /// Nominal.
        nominal: Expr,
        /// Bounds.
        bounds: Option<Expr>,
    },
    /// `until pumped >= v`.
    Until(Expr),
    /// `option within: Mass = 1 g`: what a call may give in braces.
    Option(Param),
    /// `says "put {item} on {target}"`, `says "with a fresh tip each" when tips == each`: a phrase of a protocol.
    Says {
        /// With parameters in braces.
        text: Text,
        /// When it is said; always without it.
        when: Option<Expr>,
    },
    /// `moves arm to goal`, `moves arm straight by (0, 0, 100) mm`, `moves arm home`, `moves self to well by (0, 0, 50) mm in travel`.
    Moves {
        /// The robot.
        mover: Expr,
        /// How.
        manner: Manner,
        /// Where to.
        to: Goal,
        /// The share of the step's time that is the motion's; all of it without.
        within: Option<Expr>,
    },
    /// `grips item by arm`, `grips item at frame by arm`.
    Grips {
        /// What.
        item: Expr,
        /// Where, if not at its frame `grasp`.
        at: Option<Expr>,
        /// The robot.
        by: Expr,
    },
    /// `leads door.handle by arm`: to where the step's effects put it.
    Leads {
        /// A frame on a part that moves.
        handle: Expr,
        /// The robot.
        by: Expr,
    },
    /// `frees item on target by arm`, `frees item to other by arm`.
    Frees {
        /// What.
        item: Expr,
        /// What carries it then.
        on: Option<Expr>,
        /// The robot.
        by: Expr,
    },
}

impl ClauseKind {
    /// Whether it says what a robot does with its body.
    pub fn is_motion(&self) -> bool {
        matches!(
            self,
            ClauseKind::Moves { .. } | ClauseKind::Grips { .. } | ClauseKind::Frees { .. } | ClauseKind::Leads { .. }
        )
    }
}

/// How a robot moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Manner {
    /// Any way that is free.
    Free,
    /// `straight`.
    Straight,
    /// `driving`: the robot itself, on the floor.
    Driving,
    /// `upright within 20 deg`: what it holds.
    Upright(Expr),
    /// `tilted 75 deg about source.lip`: what it holds, about a point of it.
    Tilted(Expr, Expr),
}

/// Where a robot moves to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    /// `to goal`, `to goal by (0, 0, 50) mm`.
    Frame {
        /// Where.
        at: Expr,
        /// How far from there.
        by: Option<Expr>,
    },
    /// `by (0, 0, 100) mm`.
    Shift(Expr),
    /// `to joints [0 deg, 90 deg]`.
    Joints(Expr),
    /// `home`.
    Home,
}

/// One effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Effect {
    /// `active = true`.
    Assign(Expr, Expr),
    /// `move(v, from: a, to: b)`.
    Call(Expr),
    /// `each(c in channels: rinse(c), c.tip = nothing)`.
    Each {
        /// Stands for one of the set after another.
        var: Name,
        /// A finite set.
        set: Expr,
        /// What is done with each.
        effects: Vec<Effect>,
    },
}

/// A line of a driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wire {
    /// What it maps.
    pub kind: WireKind,
    /// Where.
    pub span: Span,
}

/// What a driver line maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum WireKind {
    /// Could not be read.
    Error,
    /// `heat to(t) sends "OUT_SP_1 {t as degC :.0}", "START_1" expects "*"`.
    Command {
        /// The command's call form.
        sig: Sig,
        /// What is said.
        exchange: Exchange,
    },
    /// `reading temperature asks "IN_PV_2" expects "{degC} 2"`.
    Reading {
        /// The reading.
        path: Path,
        /// It is what the device tells only while this holds.
        condition: Option<Expr>,
        /// What goes out.
        asks: Text,
        /// What comes back.
        expects: Pattern,
    },
    /// `reading temperature hears "T={degC}" every 1 s`: what the device says by itself.
    Hears {
        /// The reading.
        path: Path,
        /// It is what the device tells only while this holds.
        condition: Option<Expr>,
        /// What comes in.
        text: Pattern,
        /// So often.
        every: Expr,
    },
    /// `ignores "BOOT {_}"`: what it says by itself and nobody needs.
    Ignores {
        /// What comes in.
        text: Pattern,
    },
    /// `reply "#" fails blocked`.
    Reply {
        /// What came back.
        text: String,
        /// The failure it means.
        fails: Name,
    },
    /// `answers "I4" with "I4 A \"1\""`: what else an emulator answers.
    Answers {
        /// What comes in.
        asked: Pattern,
        /// What goes out.
        with: Text,
    },
    /// `open sends "1@1"`.
    Fixed {
        /// `identity`, `open`, `close`, `halt`, `safe` or `play`.
        when: Name,
        /// Only of devices of which this holds.
        condition: Option<Expr>,
        /// What is said then.
        exchange: Exchange,
    },
    /// `alive while active every 20 s within 60 s by arm watchdog else disarm watchdog`, or `repeat while active every 5 s by look`.
    Alive {
        /// As long as this holds.
        condition: Expr,
        /// So often.
        every: Expr,
        /// So long a watchdog waits; none where a line only repeats.
        within: Option<Expr>,
        /// The command that is repeated.
        by: Vec<Name>,
        /// The command for when it no longer holds.
        otherwise: Vec<Name>,
    },
}

/// What is said to a device at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exchange {
    /// What goes out, in order.
    pub sends: Vec<Text>,
    /// What comes back: to each, or to the first where `then` has the others.
    pub expects: Option<Pattern>,
    /// What comes back to the second and those after it.
    pub then: Vec<Pattern>,
    /// How its end is known.
    pub until: Option<Box<Until>>,
}

/// `until asks "Q" timeout 1 min`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Until {
    /// What goes out.
    pub asks: Text,
    /// What comes back in the end.
    pub expects: Option<Pattern>,
    /// At most so long.
    pub timeout: Expr,
}

/// What a reply looks like, with units where numbers stand: `"{degC} 2"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pattern {
    /// Unescaped.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// A line of a lab.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabLine {
    /// What it says.
    pub kind: LabLineKind,
    /// Where.
    pub span: Span,
}

/// What a lab line says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LabLineKind {
    /// Could not be read.
    Error,
    /// `ambient: 25 degC`.
    Setting {
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
    },
    /// `beaker = Beaker250mL { } on table at (450, -250) mm holding 10 g of water at 80 degC`.
    Instance {
        /// Its name.
        name: Name,
        /// Its type and overrides.
        literal: AssetLiteral,
        /// `on table`, `at (...)`, `in rack`: label and operand.
        relations: Vec<(Name, Expr)>,
        /// `holding ...`.
        holding: Option<Holding>,
    },
    /// `include bench as left at (0, 0, 0) m`.
    Include {
        /// The other lab.
        lab: Path,
        /// Its name here.
        name: Name,
        /// `at (...)`.
        relations: Vec<(Name, Expr)>,
        /// `{ offset: 5 mm }`: values of its parameters.
        options: Vec<NamedExpr>,
    },
    /// `between hotplate and beaker { conductance: 12.77 W/K }`.
    Between {
        /// One.
        a: Expr,
        /// The other.
        b: Expr,
        /// Pair parameters.
        fields: Vec<Field>,
    },
}

/// What an instance holds at the start, and how warm that is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holding {
    /// What.
    pub contents: Contents,
    /// `at 80 degC` after the whole.
    pub at: Option<Expr>,
}

/// What stands after `holding`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Contents {
    /// `10 g of water + 12 mmol of EtOH`: an `of` sum, shaped as a binary expression.
    Expr(Expr),
    /// `{ A1: 20 mL of buffer, A2 .. A12: 5 mL of dye }`.
    Places(Vec<Fill>),
}

/// What some places of a grid hold at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fill {
    /// The first place.
    pub from: Name,
    /// The last place, if there are several.
    pub to: Option<Name>,
    /// What each of them holds.
    pub value: Expr,
    /// `at 4 degC`.
    pub at: Option<Expr>,
}

/// A line of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum StudyLine {
    /// Could not be read.
    Error(Span),
    /// `vary target in 60 degC .. 90 degC by sobol`.
    Vary {
        /// What varies.
        path: Expr,
        /// Where.
        range: Expr,
        /// How: name and arguments.
        by: Option<(Name, Vec<Arg>)>,
    },
    /// `runs 100000`.
    Runs(Expr),
    /// `report yield = ...`.
    Report {
        /// Its name.
        name: Name,
        /// What.
        value: Expr,
    },
}

/// A line of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FitLine {
    /// Could not be read.
    Error(Span),
    /// `data "run.csv"`.
    Data(Name),
    /// `estimate r.rate.A in 1e7 .. 1e10 log`.
    Estimate {
        /// What.
        path: Expr,
        /// Where.
        range: Expr,
        /// On a logarithmic scale.
        log: bool,
    },
    /// `match x with "column" as mol/kg noise 0.01 mol/kg`.
    Match {
        /// The model's value.
        value: Expr,
        /// The data's column.
        column: Name,
        /// The column's unit.
        unit: Option<UnitText>,
        /// Standard deviation.
        noise: Option<Expr>,
    },
}

/// Steps in braces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Block {
    /// In order.
    pub stmts: Vec<Stmt>,
    /// With the braces.
    pub span: Span,
}

/// `on slip { } finally { }`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Handlers {
    /// In order.
    pub on: Vec<(Name, Block)>,
    /// Always runs.
    pub finally: Option<Block>,
}

/// A step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stmt {
    /// What it does.
    pub kind: StmtKind,
    /// All of it.
    pub span: Span,
}

/// What a step does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum StmtKind {
    /// Could not be read.
    Error,
    /// `let x: T = e`.
    Let {
        /// Its name.
        name: Name,
        /// Its type.
        ty: Option<Type>,
        /// Its value.
        value: Expr,
    },
    /// `var n: T = e`: a value that later steps change.
    Var {
        /// Its name.
        name: Name,
        /// Its type.
        ty: Option<Type>,
        /// Its first value.
        value: Expr,
    },
    /// `n += e`, `n -= e`, `n = e`: another value from here on.
    Set {
        /// The name of the `var`.
        name: Name,
        /// How.
        op: AssignOp,
        /// By what.
        value: Expr,
    },
    /// `let m <- weigh v on scale`.
    LetDo {
        /// Its name.
        name: Name,
        /// The step.
        call: Call,
    },
    /// `step grow { }`.
    Step {
        /// Its name.
        name: Name,
        /// Its steps.
        body: Block,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `wait 10 s`.
    Wait {
        /// How long.
        duration: Expr,
    },
    /// `wait until C timeout D`.
    WaitUntil {
        /// What is waited for.
        cond: Expr,
        /// At most this long.
        timeout: Option<Expr>,
        /// `on timeout { }`.
        handlers: Handlers,
    },
    /// `if c { } else { }`; `else if` is a block of one `if`.
    If {
        /// Which.
        cond: Expr,
        /// If it holds.
        then: Block,
        /// If not.
        otherwise: Option<Block>,
    },
    /// `repeat while C max n { }`.
    RepeatWhile {
        /// Looked at before each turn.
        cond: Expr,
        /// At most this often.
        max: Option<Expr>,
        /// Its steps.
        body: Block,
    },
    /// `repeat n times { }`.
    Repeat {
        /// How often.
        times: Expr,
        /// Its steps.
        body: Block,
    },
    /// `for w in plate.column(1) { }`.
    For {
        /// The variable.
        var: Name,
        /// The finite set.
        set: Expr,
        /// Its steps.
        body: Block,
    },
    /// `within 5 min after grow.end { }`.
    Within {
        /// At most this long.
        limit: Expr,
        /// Since when.
        since: Expr,
        /// Its steps.
        body: Block,
        /// `on late { }`.
        handlers: Handlers,
    },
    /// `hold C for 15 min timeout 1 h`.
    Hold {
        /// What must hold.
        cond: Expr,
        /// For how long.
        duration: Expr,
        /// At most this long in all.
        timeout: Option<Expr>,
        /// `on timeout { }`.
        handlers: Handlers,
    },
    /// `keep C { }`.
    Keep {
        /// What must hold all the time.
        cond: Expr,
        /// Its steps.
        body: Block,
        /// `on broken { }`.
        handlers: Handlers,
    },
    /// `try { } else { }`.
    Try {
        /// In order.
        alternatives: Vec<Block>,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `retry 2`.
    Retry {
        /// How often.
        times: Expr,
    },
    /// `claim a, b { }`.
    Claim {
        /// Which.
        assets: Vec<Expr>,
        /// Its steps.
        body: Block,
    },
    /// `sequence { }`.
    Sequence {
        /// Its steps.
        body: Block,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `parallel { }`: one line, one branch.
    Parallel {
        /// The branches.
        body: Block,
        /// `on`, `finally`.
        handlers: Handlers,
    },
    /// `start job = ...`.
    Start {
        /// Its name.
        name: Name,
        /// What it does: one call is a block of one statement.
        body: Block,
    },
    /// `await job`.
    Await {
        /// Its name.
        name: Name,
    },
    /// `fail slip "text"`.
    Fail {
        /// Its name; absent where only a text is given.
        name: Option<Name>,
        /// In words.
        text: Option<Text>,
    },
    /// `expect C`.
    Expect {
        /// What must hold.
        cond: Expr,
    },
    /// `record x every 1 s`.
    Record {
        /// What.
        value: Expr,
        /// How often.
        every: Expr,
    },
    /// `note "..."`.
    Note(Text),
    /// `ask "..."`.
    Ask(Text),
    /// `return e`: the result of a skill.
    Return {
        /// Its value.
        value: Expr,
    },
    /// `run synthesize { target: 76 degC }`, in a test.
    Run {
        /// The workflow.
        workflow: Path,
        /// Its parameters.
        options: Vec<NamedExpr>,
    },
    /// `heat hotplate to 80 degC`.
    Call(Call),
}

impl StmtKind {
    /// The blocks of a statement, without those of its handlers.
    pub fn blocks(&self) -> Vec<&Block> {
        match self {
            StmtKind::If { then, otherwise, .. } => std::iter::once(then).chain(otherwise).collect(),
            StmtKind::Try { alternatives, .. } => alternatives.iter().collect(),
            StmtKind::Step { body, .. }
            | StmtKind::RepeatWhile { body, .. }
            | StmtKind::Repeat { body, .. }
            | StmtKind::For { body, .. }
            | StmtKind::Within { body, .. }
            | StmtKind::Keep { body, .. }
            | StmtKind::Claim { body, .. }
            | StmtKind::Sequence { body, .. }
            | StmtKind::Parallel { body, .. }
            | StmtKind::Start { body, .. } => vec![body],
            _ => Vec::new(),
        }
    }
}

/// `transfer 100 uL from a to b by p { tips: once }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// Bare words; the longest prefix that is a declared verb is the verb, and at most one word may follow it: the object.
    pub words: Vec<Name>,
    /// The first argument, where it is more than a bare word or stands after two or more words.
    pub object: Option<Expr>,
    /// `to 80 degC`.
    pub labelled: Vec<(Name, Expr)>,
    /// `{ tips: once }`.
    pub options: Vec<NamedExpr>,
    /// All of it.
    pub span: Span,
}

/// `name: value`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedExpr {
    /// The name.
    pub name: Name,
    /// The value.
    pub value: Expr,
}

/// An argument of a function.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arg {
    /// `from:`.
    pub name: Option<Name>,
    /// The value.
    pub value: Expr,
}

/// An expression.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Expr {
    /// What it says.
    pub kind: Box<ExprKind>,
    /// Where.
    pub span: Span,
}

/// What an expression says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ExprKind {
    /// Could not be read; stays silent later.
    Error,
    /// `3`, `0.5`, `1e-3`.
    Number(f64),
    /// `80 degC`.
    Quantity(f64, UnitText),
    /// `"text"`, unescaped.
    Text(String),
    /// A word: `true`, `nothing`, `beaker`, or a species where only one can stand (`K+`).
    Name(Name),
    /// `std::module::name`.
    Scoped(Path),
    /// `beaker.contents`.
    Member(Expr, Name),
    /// `x[EtI]`, `plate[A1]`: one word, which is a species, a well or a variable by the type of `x`.
    IndexWord(Expr, Name),
    /// `plate[A1 .. H12]`.
    IndexRange(Expr, Name, Name),
    /// `list[i - 1]`.
    Index(Expr, Expr),
    /// `f(x, from: y)`, `r.rate(t)`.
    Call(Expr, Vec<Arg>),
    /// `sum(s in r.orders: m[s])`; the function's name is not fixed by the grammar.
    Fold {
        /// `sum`, `product`, `all`, `any`, `min`, `max`.
        fold: Name,
        /// The variable.
        var: Name,
        /// The finite set.
        set: Expr,
        /// What is folded.
        body: Expr,
    },
    /// `x'`.
    Prime(Expr),
    /// `-x`, `not x`.
    Unary(Unary, Expr),
    /// `a + b`, `a in b`, `a is b`.
    Binary(Binary, Expr, Expr),
    /// `10 g of water`.
    Of(Expr, Name),
    /// `a .. b`.
    Range(Expr, Expr),
    /// `x as mol/kg`.
    As(Expr, UnitText),
    /// `(1, 2, 3) mm`; one element in parentheses is the element itself.
    Tuple(Vec<Expr>, Option<UnitText>),
    /// `[a, b]`.
    List(Vec<Expr>),
}

/// Prefix operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unary {
    /// `-`
    Neg,
    /// `not`
    Not,
}

/// Infix operators, loosest first: `or`, `and`, comparisons (with `in`, `is`), `..`, `+-`, `+ -`, `* /`, `^` (to the right).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Binary {
    /// `or`
    Or,
    /// `and`
    And,
    /// `==`
    Eq,
    /// `!=`
    Ne,
    /// `<`
    Lt,
    /// `<=`
    Le,
    /// `>`
    Gt,
    /// `>=`
    Ge,
    /// `in`
    In,
    /// `is`
    Is,
    /// `+-`
    PlusMinus,
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `^`
    Pow,
}
