//! What stands beside statements: when a named step begins, and how much is where after something was moved.

use matterix_ir::points::{Fact, Point, Points, Value};
use matterix_ir::{FileId, Span};
use matterix_syntax::ast::{Block, Expr, ExprKind, File, ItemKind, Stmt, StmtKind};

use crate::Analysis;

/// Something to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Hint<'a> {
    /// Where.
    pub offset: usize,
    /// What.
    pub told: Told<'a>,
}

/// What is to be shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Told<'a> {
    /// The time since the beginning at which a step begins.
    Begins(&'a Value),
    /// The beginning of the run.
    BeginsAtOnce,
    /// What is known afterwards of things that a statement has changed, in the kind of quantity it speaks of.
    Holds(Vec<(&'a str, &'a Fact)>),
}

/// The hints of a file in the order of the text, those of the first workflow that knows of a statement.
pub fn hints(analysis: &Analysis, file: FileId) -> Vec<Hint<'_>> {
    let Some(tree) = analysis.tree(file) else { return Vec::new() };
    let mut out = Vec::new();
    for points in &analysis.points {
        let mut walk = Walk { points, text: analysis.text(file), out: &mut out };
        for body in bodies(tree) {
            let own = |point: &Point| inside(point.span, body.span);
            if points.points.iter().any(own) {
                walk.block(body, Some(Since::Start));
            }
        }
    }
    out.sort_by_key(|hint| hint.offset);
    out.dedup_by_key(|hint| hint.offset);
    out
}

/// The bodies of workflows, tests and skills.
fn bodies(tree: &File) -> impl Iterator<Item = &Block> {
    tree.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Workflow { body, .. } | ItemKind::Test { body, .. } => Some(body),
        ItemKind::Skill { body, .. } => body.as_ref(),
        _ => None,
    })
}

/// When a statement begins.
#[derive(Clone, Copy)]
enum Since<'a> {
    /// With the run.
    Start,
    /// When another has ended.
    End(&'a Point),
}

struct Walk<'a, 'o> {
    points: &'a Points,
    text: &'a str,
    out: &'o mut Vec<Hint<'a>>,
}

impl<'a> Walk<'a, '_> {
    /// The statements of a block, which begins at a time as far as there is one.
    fn block(&mut self, block: &Block, mut since: Option<Since<'a>>) {
        for stmt in &block.stmts {
            self.stmt(stmt, since);
            since = self.point(stmt.span).map(Since::End);
        }
    }

    fn stmt(&mut self, stmt: &Stmt, since: Option<Since<'a>>) {
        let point = self.point(stmt.span);
        if let (StmtKind::Step { name, .. }, Some(since)) = (&stmt.kind, since) {
            let told = match since {
                Since::Start => Some(Told::BeginsAtOnce),
                Since::End(point) => point.after.as_ref().map(|after| Told::Begins(&after.elapsed)),
            };
            let reached = point.is_some_and(|p| p.reached && !p.repeated);
            self.out.extend(told.filter(|_| reached).map(|told| Hint { offset: name.span.end as usize, told }));
        }
        if let Some(point) = point.filter(|p| !p.block) {
            self.moved(stmt, point);
        }
        for block in stmt.kind.blocks() {
            match stmt.kind {
                // Branches begin together; what another branch does is not before them.
                StmtKind::Parallel { .. } => block.stmts.iter().for_each(|branch| self.stmt(branch, since)),
                StmtKind::Step { .. }
                | StmtKind::Sequence { .. }
                | StmtKind::If { .. }
                | StmtKind::Claim { .. }
                | StmtKind::Keep { .. } => self.block(block, since),
                _ => self.block(block, None),
            }
        }
    }

    fn point(&self, span: Span) -> Option<&'a Point> {
        self.points.points.iter().find(|point| point.span == span)
    }

    /// How much is where, after a statement that says how much.
    fn moved(&mut self, stmt: &Stmt, point: &'a Point) {
        let Some(after) = &point.after else { return };
        let (StmtKind::Call(call) | StmtKind::LetDo { call, .. }) = &stmt.kind else { return };
        let given = call.object.iter().chain(call.labelled.iter().map(|(_, value)| value));
        let units: Vec<&str> = given.filter_map(unit).collect();
        let mixed = after.things.iter().filter(|thing| thing.species.iter().any(|s| s.changed));
        let held: Vec<(&str, &Fact)> = mixed
            .flat_map(|thing| thing.facts.iter().map(|fact| (thing.name.as_str(), fact)))
            .filter(|(_, fact)| shown_in(&fact.value).is_some_and(|unit| units.iter().any(|u| alike(u, unit))))
            .collect();
        if !held.is_empty() {
            let end = self.text.get(..point.span.end as usize).map_or(0, |text| text.trim_end().len());
            self.out.push(Hint { offset: end, told: Told::Holds(held) });
        }
    }
}

fn inside(inner: Span, outer: Span) -> bool {
    inner.file == outer.file && outer.start <= inner.start && inner.end <= outer.end
}

/// The unit of a quantity that is written out.
fn unit(value: &Expr) -> Option<&str> {
    match &*value.kind {
        ExprKind::Quantity(_, unit) => Some(&unit.text),
        ExprKind::Of(value, _) => unit(value),
        _ => None,
    }
}

fn shown_in(value: &Value) -> Option<&str> {
    match value {
        Value::Exact(_, unit) | Value::OneOf(_, unit) | Value::Between(_, _, unit) => Some(&unit.symbol),
        Value::Words(_) | Value::Unknown => None,
    }
}

/// Whether two symbols are of one unit with prefixes: `uL` and `mL`.
fn alike(a: &str, b: &str) -> bool {
    let bare = |unit: &'_ str| -> String {
        let rest = unit.strip_prefix(['k', 'd', 'c', 'm', 'u', 'µ', 'μ', 'n', 'p']).filter(|rest| !rest.is_empty());
        rest.unwrap_or(unit).to_string()
    };
    !a.is_empty() && (a == b || bare(a) == bare(b) || bare(a) == b || a == bare(b))
}
