//! What a file declares, as a tree.

use matterix_ir::Span;
use matterix_lang::names::item_name;
use matterix_syntax::ast::{
    AssetLine, Block, File, Item, ItemKind, LabLine, LabLineKind, Member, MemberKind, Name, Stmt, StmtKind, StudyLine,
};

/// What a symbol is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymbolKind {
    /// A capability.
    Capability,
    /// An asset type.
    Asset,
    /// A lab.
    Lab,
    /// A thing of a lab, or a part of an asset.
    Instance,
    /// A workflow or a test.
    Workflow,
    /// A study or a fit.
    Study,
    /// A skill or a command.
    Skill,
    /// A function or a relation.
    Function,
    /// A process, an event or a hazard.
    Law,
    /// A species, a solution, a material or a reactive group.
    Substance,
    /// A reaction.
    Reaction,
    /// A constant.
    Constant,
    /// A unit or a dimension.
    Unit,
    /// A member of a capability, a setting of a lab, a field of an asset.
    Member,
    /// A frame.
    Frame,
    /// A named step.
    Step,
    /// A driver.
    Driver,
}

/// Something declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Symbol {
    /// Its name, or the words of its verb.
    pub name: String,
    /// What it is in the language's word.
    pub detail: &'static str,
    /// What it is.
    pub kind: SymbolKind,
    /// All of it.
    pub span: Span,
    /// Its name.
    pub name_span: Span,
    /// What is declared inside.
    pub children: Vec<Symbol>,
}

/// The symbols of a file in the order of the text.
pub fn outline(tree: &File) -> Vec<Symbol> {
    tree.items.iter().filter_map(item).collect()
}

fn symbol(name: &Name, detail: &'static str, kind: SymbolKind, span: Span, children: Vec<Symbol>) -> Symbol {
    Symbol { name: name.text.clone(), detail, kind, span, name_span: name.span, children }
}

fn item(item: &Item) -> Option<Symbol> {
    let (detail, kind) = match &item.kind {
        ItemKind::Error
        | ItemKind::Use { .. }
        | ItemKind::Incompatible { .. }
        | ItemKind::Allow { .. }
        | ItemKind::Accept { .. } => return None,
        ItemKind::Dimension { name, .. } => {
            return Some(symbol(name, "dimension", SymbolKind::Unit, item.span, Vec::new()));
        }
        ItemKind::Unit { name, .. } => {
            let name = Name { text: name.text.clone(), span: name.span };
            return Some(symbol(&name, "unit", SymbolKind::Unit, item.span, Vec::new()));
        }
        ItemKind::Species { .. } => ("species", SymbolKind::Substance),
        ItemKind::Solution { .. } => ("solution", SymbolKind::Substance),
        ItemKind::ReactiveGroup { .. } => ("reactive group", SymbolKind::Substance),
        ItemKind::Material { .. } => ("material", SymbolKind::Substance),
        ItemKind::Reaction { .. } => ("reaction", SymbolKind::Reaction),
        ItemKind::Equilibrium { .. } => ("equilibrium", SymbolKind::Reaction),
        ItemKind::Interaction { .. } => ("interaction", SymbolKind::Reaction),
        ItemKind::Hazard { .. } => ("hazard", SymbolKind::Law),
        ItemKind::Process(_) => ("process", SymbolKind::Law),
        ItemKind::Event(_) => ("event", SymbolKind::Law),
        ItemKind::Capability { .. } => ("capability", SymbolKind::Capability),
        ItemKind::Asset { .. } => ("asset", SymbolKind::Asset),
        ItemKind::Relation { .. } => ("relation", SymbolKind::Function),
        ItemKind::Fn { .. } => ("fn", SymbolKind::Function),
        ItemKind::Const { .. } => ("const", SymbolKind::Constant),
        ItemKind::Table { .. } => ("table", SymbolKind::Constant),
        ItemKind::Framing { .. } => ("framing", SymbolKind::Driver),
        ItemKind::Driver { .. } => ("driver", SymbolKind::Driver),
        ItemKind::Lab { .. } => ("lab", SymbolKind::Lab),
        ItemKind::Skill { .. } => ("skill", SymbolKind::Skill),
        ItemKind::Workflow { .. } => ("workflow", SymbolKind::Workflow),
        ItemKind::Test { .. } => ("test", SymbolKind::Workflow),
        ItemKind::Study { .. } => ("study", SymbolKind::Study),
        ItemKind::Fit { .. } => ("fit", SymbolKind::Study),
    };
    let (name, span) = item_name(item)?;
    let children = match &item.kind {
        ItemKind::Capability { members, .. } => members.iter().filter_map(member).collect(),
        ItemKind::Asset { lines, .. } => lines.iter().filter_map(asset_line).collect(),
        ItemKind::Lab { lines, .. } => lines.iter().filter_map(lab_line).collect(),
        ItemKind::Skill { body: Some(body), .. } => steps(body),
        ItemKind::Workflow { body, .. } | ItemKind::Test { body, .. } => steps(body),
        ItemKind::Study { lines, .. } => lines.iter().filter_map(study_line).collect(),
        _ => Vec::new(),
    };
    // What was written out for an item from a file stands in that file.
    let children = children.into_iter().filter(|c| c.span.file == item.span.file).collect();
    Some(symbol(&Name { text: name, span }, detail, kind, item.span, children))
}

fn member(member: &Member) -> Option<Symbol> {
    let leaf = |name, detail, kind| Some(symbol(name, detail, kind, member.span, Vec::new()));
    match &member.kind {
        MemberKind::Value { name, .. } => leaf(name, "member", SymbolKind::Member),
        MemberKind::Command { sig, .. } => {
            let name = Name { text: matterix_lang::names::verb_text(&sig.verb), span: sig.span };
            leaf(&name, "command", SymbolKind::Skill)
        }
        MemberKind::Process(p) => leaf(&p.name, "process", SymbolKind::Law),
        MemberKind::Event(e) => leaf(&e.name, "event", SymbolKind::Law),
        MemberKind::Frame { name, .. } => leaf(name, "frame", SymbolKind::Frame),
        MemberKind::Error | MemberKind::View { .. } | MemberKind::Limit { .. } => None,
    }
}

fn asset_line(line: &AssetLine) -> Option<Symbol> {
    let leaf = |name: &Name, detail, kind, end: Span| Some(symbol(name, detail, kind, name.span.to(end), Vec::new()));
    match line {
        AssetLine::Field(field) => leaf(&field.key, "field", SymbolKind::Member, field.span),
        AssetLine::Frame { name, .. } => leaf(name, "frame", SymbolKind::Frame, name.span),
        AssetLine::Joint(joint) => leaf(&joint.name, "joint", SymbolKind::Instance, joint.name.span),
        AssetLine::Part { name, literal } => leaf(name, "part", SymbolKind::Instance, literal.span),
        AssetLine::Grid(grid) => leaf(&grid.name, "grid", SymbolKind::Instance, grid.literal.span),
        AssetLine::Error(_) | AssetLine::Solid { .. } | AssetLine::Mesh(..) | AssetLine::Robot(..) => None,
    }
}

fn lab_line(line: &LabLine) -> Option<Symbol> {
    let (name, detail, kind) = match &line.kind {
        LabLineKind::Setting { name, .. } => (name, "setting", SymbolKind::Member),
        LabLineKind::Instance { name, .. } => (name, "instance", SymbolKind::Instance),
        LabLineKind::Include { name, .. } => (name, "include", SymbolKind::Lab),
        LabLineKind::Error | LabLineKind::Between { .. } => return None,
    };
    Some(symbol(name, detail, kind, line.span, Vec::new()))
}

fn study_line(line: &StudyLine) -> Option<Symbol> {
    match line {
        StudyLine::Report { name, value } => {
            Some(symbol(name, "report", SymbolKind::Member, name.span.to(value.span), Vec::new()))
        }
        StudyLine::Error(_) | StudyLine::Vary { .. } | StudyLine::Runs(_) => None,
    }
}

/// The named steps of a block, with those inside of them.
fn steps(block: &Block) -> Vec<Symbol> {
    block.stmts.iter().flat_map(step).collect()
}

fn step(stmt: &Stmt) -> Vec<Symbol> {
    match &stmt.kind {
        StmtKind::Step { name, body, .. } => vec![symbol(name, "step", SymbolKind::Step, stmt.span, steps(body))],
        StmtKind::Start { name, body } => vec![symbol(name, "job", SymbolKind::Step, stmt.span, steps(body))],
        kind => kind.blocks().into_iter().flat_map(steps).collect(),
    }
}
