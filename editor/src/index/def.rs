//! What names stand for.

use matterix_ir::Span;
use matterix_lang::semantic_index::Sort;

/// A declaration, by its number in an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DefId(pub u32);

/// What is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Kind {
    Dimension,
    Unit,
    Species,
    Solution,
    Reaction,
    Equilibrium,
    Interaction,
    Group,
    Material,
    Hazard,
    Capability,
    Asset,
    Process,
    Event,
    Relation,
    Function,
    Constant,
    Table,
    Column,
    Framing,
    Driver,
    Lab,
    Skill,
    Workflow,
    Study,
    Fit,
    Test,
    Member,
    Command,
    Frame,
    Part,
    Grid,
    Joint,
    Thing,
    Included,
    Setting,
    Parameter,
    Option,
    Variable,
    Step,
    Job,
    Failure,
    Report,
    Word,
}

impl Kind {
    /// In words, for people.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Dimension => "dimension",
            Kind::Unit => "unit",
            Kind::Species => "species",
            Kind::Solution => "solution",
            Kind::Reaction => "reaction",
            Kind::Equilibrium => "equilibrium",
            Kind::Interaction => "interaction",
            Kind::Group => "reactive group",
            Kind::Material => "material",
            Kind::Hazard => "hazard",
            Kind::Capability => "capability",
            Kind::Asset => "asset",
            Kind::Process => "process",
            Kind::Event => "event",
            Kind::Relation => "relation",
            Kind::Function => "function",
            Kind::Constant => "constant",
            Kind::Table => "table",
            Kind::Column => "column of a table",
            Kind::Framing => "framing",
            Kind::Driver => "driver",
            Kind::Lab => "lab",
            Kind::Skill => "skill",
            Kind::Workflow => "workflow",
            Kind::Study => "study",
            Kind::Fit => "fit",
            Kind::Test => "test",
            Kind::Member => "member",
            Kind::Command => "command",
            Kind::Frame => "frame",
            Kind::Part => "part",
            Kind::Grid => "grid of parts",
            Kind::Joint => "joint",
            Kind::Thing => "thing in a lab",
            Kind::Included => "included lab",
            Kind::Setting => "setting of a lab",
            Kind::Parameter => "parameter",
            Kind::Option => "option",
            Kind::Variable => "variable",
            Kind::Step => "step",
            Kind::Job => "job",
            Kind::Failure => "failure",
            Kind::Report => "report",
            Kind::Word => "word of a state",
        }
    }
}

/// A declaration.
#[derive(Clone, Debug)]
pub struct Def {
    /// Its name; the words of a verb with blanks between them.
    pub name: String,
    /// What it declares.
    pub kind: Kind,
    /// Where its name stands.
    pub span: Span,
    /// All of it.
    pub whole: Span,
    /// The part that says what it is, without a body.
    pub head: Span,
    /// What is written about it, a line each.
    pub docs: Vec<String>,
    /// What kind of value it stands for.
    pub sort: Sort,
    /// The words it may be, where it is one of some.
    pub words: Vec<DefId>,
    /// What it belongs to.
    pub owner: Option<DefId>,
    /// Its members: parameters of a function or skill, members of a capability, lines of an asset, things in a lab.
    pub inside: Vec<DefId>,
    /// For parameters of a skill or command: the preposition they stand behind.
    pub label: Option<String>,
}

/// What stands at a place where a name is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Something that is declared.
    Def(DefId),
    /// A module, by its number.
    Module(u32),
    /// Something the language itself knows, with a word for what it is.
    Language(&'static str),
    /// A member of something whose kind is not known here, such as a parameter without a type.
    Open,
    /// Nothing that is known.
    Unknown,
}

/// A name in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// Where.
    pub span: Span,
    /// What it stands for.
    pub meaning: Meaning,
}

/// Where a local name is seen.
#[derive(Clone, Copy, Debug)]
pub struct Local {
    /// From its declaration to the end of the block.
    pub span: Span,
    /// What it is.
    pub def: DefId,
}

/// A text and what can be named in it beside the names of its module.
#[derive(Clone, Debug, Default)]
pub struct Region {
    /// All of it.
    pub span: Span,
    /// Labs whose things are seen.
    pub labs: Vec<DefId>,
    /// The thing whose members are seen, by its kinds.
    pub this: Option<DefId>,
    /// The item.
    pub item: Option<DefId>,
}
