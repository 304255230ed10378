//! Trees at another place: the same text further on in a file, or in another file.

use std::sync::Arc;

use matterix_ir::mesh::Mesh;
use matterix_ir::robot::Robot;
use matterix_ir::{Diagnostic, Edit, FileId, Fix, Label, Missing, Span};

use crate::ast::*;

/// What has places in it.
pub trait Relocate {
    /// Puts each of them where `put` says.
    fn moved(&mut self, put: &dyn Fn(Span) -> Span);
}

/// Places that are further on by so many bytes, in a file.
pub fn shifted(file: FileId, by: i64) -> impl Fn(Span) -> Span {
    let at = move |place: u32| u32::try_from(i64::from(place) + by).unwrap_or_default();
    move |span| Span { file, start: at(span.start), end: at(span.end) }
}

impl Relocate for Span {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        *self = put(*self);
    }
}

impl<T: Relocate> Relocate for Vec<T> {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        self.iter_mut().for_each(|part| part.moved(put));
    }
}

impl<T: Relocate> Relocate for Option<T> {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        self.iter_mut().for_each(|part| part.moved(put));
    }
}

impl<T: Relocate> Relocate for Box<T> {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        (**self).moved(put);
    }
}

impl<A: Relocate, B: Relocate> Relocate for (A, B) {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        self.0.moved(put);
        self.1.moved(put);
    }
}

/// What has no places in it.
macro_rules! fixed {
    ($($ty:ty)*) => {
        $(impl Relocate for $ty {
            fn moved(&mut self, _: &dyn Fn(Span) -> Span) {}
        })*
    };
}

fixed! { String bool f64 u8 u32 usize matterix_ir::Code matterix_ir::Severity Robot Arc<Mesh> Role AssignOp Unary Binary }

/// What has places in all of its parts; a part that is forgotten here does not compile.
macro_rules! parts {
    ($($ty:ident { $($part:ident)* })*) => {
        $(impl Relocate for $ty {
            fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
                let $ty { $($part),* } = self;
                $($part.moved(put);)*
            }
        })*
    };
}

parts! {
    Label { span text primary }
    Edit { span text }
    Fix { title edits sure asks }
    Missing { module name below list only }
    Diagnostic { code severity headline labels help fixes about missing }
    Name { text span }
    Path { segments span }
    UnitText { text span }
    File { version docs items }
    Item { docs kind span }
    Column { name header ty unit default span }
    Labelled { value species tolerance span }
    Term { coefficient species span }
    Field { key value span }
    AssetLiteral { ty fields span }
    At { position from turned }
    Jointed { name way by }
    Way { slides axis at }
    Grid { name from to literal at pitch row }
    Member { docs kind span }
    Process { name params guard laws }
    Event { name params when delay laws }
    Delay { sustained time }
    Law { kind span }
    Text { parts span }
    Type { paths words argument optional condition span }
    Param { name ty of default }
    Sig { verb params labelled result span }
    Clause { kind span }
    Refusal { failure help because }
    Wire { kind span }
    Exchange { sends expects then until }
    Until { asks expects timeout }
    Pattern { text span }
    LabLine { kind span }
    Fill { from to value at }
    Holding { contents at }
    Block { stmts span }
    Handlers { on finally }
    Stmt { kind span }
    Call { words object labelled options span }
    NamedExpr { name value }
    Arg { name value }
    Expr { kind span }
}

/// The parts of one form.
macro_rules! each {
    ($put:ident: $($part:ident)*) => {{
        $($part.moved($put);)*
    }};
}

impl Relocate for ItemKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            ItemKind::Error => {}
            ItemKind::Use { path, names } => each!(put: path names),
            ItemKind::Dimension { name, point, definition } => each!(put: name point definition),
            ItemKind::Unit { name, dimension, definition, origin, prefixes, aliases } => {
                each!(put: name dimension definition origin prefixes aliases)
            }
            ItemKind::Species { name, fields } => each!(put: name fields),
            ItemKind::Solution { name, fields, labelled } => each!(put: name fields labelled),
            ItemKind::Reaction { name, reactants, reversible, products, fields } => {
                each!(put: name reactants reversible products fields)
            }
            ItemKind::Interaction { name, between, fields } => each!(put: name between fields),
            ItemKind::Equilibrium { name, reactants, products, fields } => each!(put: name reactants products fields),
            ItemKind::ReactiveGroup { name, fields } => each!(put: name fields),
            ItemKind::Material { name, fields } => each!(put: name fields),
            ItemKind::Incompatible { a, b, fields } => each!(put: a b fields),
            ItemKind::Allow { a, b, reason } => each!(put: a b reason),
            ItemKind::Accept { name, reason } => each!(put: name reason),
            ItemKind::Hazard { grave, name, params, of, after, when, help, because } => {
                each!(put: grave name params of after when help because)
            }
            ItemKind::Capability { name, extends, source, members } => each!(put: name extends source members),
            ItemKind::Asset { name, extends, source, lines } => each!(put: name extends source lines),
            ItemKind::Process(a) => each!(put: a),
            ItemKind::Event(a) => each!(put: a),
            ItemKind::Relation { name, params, symmetric, definition } => each!(put: name params symmetric definition),
            ItemKind::Fn { external, name, params, result, body, options } => {
                each!(put: external name params result body options)
            }
            ItemKind::Const { name, ty, value } => each!(put: name ty value),
            // Its rows stand in another file.
            ItemKind::Table { name, source, columns, rows: _ } => each!(put: name source columns),
            ItemKind::Framing { name, fields } => each!(put: name fields),
            ItemKind::Driver { name, device, transport, args, wires } => each!(put: name device transport args wires),
            ItemKind::Lab { name, params, lines } => each!(put: name params lines),
            ItemKind::Skill { external, sig, clauses, body, handlers } => {
                each!(put: external sig clauses body handlers)
            }
            ItemKind::Workflow { name, params, lab, body, handlers } => each!(put: name params lab body handlers),
            ItemKind::Study { name, of, lines } => each!(put: name of lines),
            ItemKind::Fit { name, of, lines } => each!(put: name of lines),
            ItemKind::Test { name, lab, body, handlers } => each!(put: name lab body handlers),
        }
    }
}

impl Relocate for FieldValue {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            FieldValue::Expr(a) => each!(put: a),
            FieldValue::Fields(a) => each!(put: a),
            FieldValue::Literal(a) => each!(put: a),
            FieldValue::Species(a) => each!(put: a),
        }
    }
}

impl Relocate for AssetLine {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            AssetLine::Error(a) => each!(put: a),
            AssetLine::Field(a) => each!(put: a),
            AssetLine::Frame { name, at } => each!(put: name at),
            AssetLine::Solid { shape, at } => each!(put: shape at),
            AssetLine::Joint(a) => each!(put: a),
            AssetLine::Mesh(a, b) => each!(put: a b),
            AssetLine::Robot(a, b) => each!(put: a b),
            AssetLine::Part { name, literal } => each!(put: name literal),
            AssetLine::Grid(a) => each!(put: a),
        }
    }
}

impl Relocate for MemberKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            MemberKind::Error => {}
            MemberKind::Value { role, name, ty, per, value, options } => each!(put: role name ty per value options),
            MemberKind::View { param, ty, value } => each!(put: param ty value),
            MemberKind::Command { sig, clauses } => each!(put: sig clauses),
            MemberKind::Process(a) => each!(put: a),
            MemberKind::Event(a) => each!(put: a),
            MemberKind::Limit { at_end, cond, refusal } => each!(put: at_end cond refusal),
            MemberKind::Frame { name, at } => each!(put: name at),
        }
    }
}

impl Relocate for LawKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            LawKind::Error => {}
            LawKind::Let { name, value } => each!(put: name value),
            LawKind::For { var, set, body } => each!(put: var set body),
            LawKind::If { cond, then, otherwise } => each!(put: cond then otherwise),
            LawKind::Assign { target, op, value } => each!(put: target op value),
            LawKind::Call(a) => each!(put: a),
        }
    }
}

impl Relocate for TextPart {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            TextPart::Plain(a) => each!(put: a),
            TextPart::Value { value, digits, form } => each!(put: value digits form),
        }
    }
}

impl Relocate for ClauseKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            ClauseKind::Needs { cond, refusal } => each!(put: cond refusal),
            ClauseKind::Presumes { ever, cond, refusal } => each!(put: ever cond refusal),
            ClauseKind::Warns { cond, refusal } => each!(put: cond refusal),
            ClauseKind::While(a) => each!(put: a),
            ClauseKind::Fails(a) => each!(put: a),
            ClauseKind::Effect(a) => each!(put: a),
            ClauseKind::Takes { nominal, bounds } => each!(put: nominal bounds),
            ClauseKind::Until(a) => each!(put: a),
            ClauseKind::Option(a) => each!(put: a),
            ClauseKind::Says { text, when } => each!(put: text when),
            ClauseKind::Moves { mover, manner, to, within } => each!(put: mover manner to within),
            ClauseKind::Grips { item, at, by } => each!(put: item at by),
            ClauseKind::Leads { handle, by } => each!(put: handle by),
            ClauseKind::Frees { item, on, by } => each!(put: item on by),
        }
    }
}

impl Relocate for Manner {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            Manner::Free | Manner::Straight | Manner::Driving => {}
            Manner::Upright(a) => each!(put: a),
            Manner::Tilted(a, b) => each!(put: a b),
        }
    }
}

impl Relocate for Goal {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            Goal::Home => {}
            Goal::Frame { at, by } => each!(put: at by),
            Goal::Shift(a) => each!(put: a),
            Goal::Joints(a) => each!(put: a),
        }
    }
}

impl Relocate for Effect {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            Effect::Assign(a, b) => each!(put: a b),
            Effect::Call(a) => each!(put: a),
            Effect::Each { var, set, effects } => each!(put: var set effects),
        }
    }
}

impl Relocate for WireKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            WireKind::Error => {}
            WireKind::Command { sig, exchange } => each!(put: sig exchange),
            WireKind::Reading { path, condition, asks, expects } => each!(put: path condition asks expects),
            WireKind::Hears { path, condition, text, every } => each!(put: path condition text every),
            WireKind::Ignores { text } => each!(put: text),
            WireKind::Reply { text, fails } => each!(put: text fails),
            WireKind::Answers { asked, with } => each!(put: asked with),
            WireKind::Fixed { when, condition, exchange } => each!(put: when condition exchange),
            WireKind::Alive { condition, every, within, by, otherwise } => {
                each!(put: condition every within by otherwise)
            }
        }
    }
}

impl Relocate for LabLineKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            LabLineKind::Error => {}
            LabLineKind::Setting { name, value } => each!(put: name value),
            LabLineKind::Instance { name, literal, relations, holding } => each!(put: name literal relations holding),
            LabLineKind::Include { lab, name, relations, options } => each!(put: lab name relations options),
            LabLineKind::Between { a, b, fields } => each!(put: a b fields),
        }
    }
}

impl Relocate for Contents {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            Contents::Expr(a) => each!(put: a),
            Contents::Places(a) => each!(put: a),
        }
    }
}

impl Relocate for StudyLine {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            StudyLine::Error(a) => each!(put: a),
            StudyLine::Vary { path, range, by } => each!(put: path range by),
            StudyLine::Runs(a) => each!(put: a),
            StudyLine::Report { name, value } => each!(put: name value),
        }
    }
}

impl Relocate for FitLine {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            FitLine::Error(a) => each!(put: a),
            FitLine::Data(a) => each!(put: a),
            FitLine::Estimate { path, range, log } => each!(put: path range log),
            FitLine::Match { value, column, unit, noise } => each!(put: value column unit noise),
        }
    }
}

impl Relocate for StmtKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            StmtKind::Error => {}
            StmtKind::Let { name, ty, value } => each!(put: name ty value),
            StmtKind::Var { name, ty, value } => each!(put: name ty value),
            StmtKind::Set { name, op, value } => each!(put: name op value),
            StmtKind::LetDo { name, call } => each!(put: name call),
            StmtKind::Step { name, body, handlers } => each!(put: name body handlers),
            StmtKind::Wait { duration } => each!(put: duration),
            StmtKind::WaitUntil { cond, timeout, handlers } => each!(put: cond timeout handlers),
            StmtKind::If { cond, then, otherwise } => each!(put: cond then otherwise),
            StmtKind::RepeatWhile { cond, max, body } => each!(put: cond max body),
            StmtKind::Repeat { times, body } => each!(put: times body),
            StmtKind::For { var, set, body } => each!(put: var set body),
            StmtKind::Within { limit, since, body, handlers } => each!(put: limit since body handlers),
            StmtKind::Hold { cond, duration, timeout, handlers } => each!(put: cond duration timeout handlers),
            StmtKind::Keep { cond, body, handlers } => each!(put: cond body handlers),
            StmtKind::Try { alternatives, handlers } => each!(put: alternatives handlers),
            StmtKind::Retry { times } => each!(put: times),
            StmtKind::Claim { assets, body } => each!(put: assets body),
            StmtKind::Sequence { body, handlers } => each!(put: body handlers),
            StmtKind::Parallel { body, handlers } => each!(put: body handlers),
            StmtKind::Start { name, body } => each!(put: name body),
            StmtKind::Await { name } => each!(put: name),
            StmtKind::Fail { name, text } => each!(put: name text),
            StmtKind::Expect { cond } => each!(put: cond),
            StmtKind::Record { value, every } => each!(put: value every),
            StmtKind::Note(a) => each!(put: a),
            StmtKind::Ask(a) => each!(put: a),
            StmtKind::Return { value } => each!(put: value),
            StmtKind::Run { workflow, options } => each!(put: workflow options),
            StmtKind::Call(a) => each!(put: a),
        }
    }
}

impl Relocate for ExprKind {
    fn moved(&mut self, put: &dyn Fn(Span) -> Span) {
        match self {
            ExprKind::Error => {}
            ExprKind::Number(a) => each!(put: a),
            ExprKind::Quantity(a, b) => each!(put: a b),
            ExprKind::Text(a) => each!(put: a),
            ExprKind::Name(a) => each!(put: a),
            ExprKind::Scoped(a) => each!(put: a),
            ExprKind::Member(a, b) => each!(put: a b),
            ExprKind::IndexWord(a, b) => each!(put: a b),
            ExprKind::IndexRange(a, b, c) => each!(put: a b c),
            ExprKind::Index(a, b) => each!(put: a b),
            ExprKind::Call(a, b) => each!(put: a b),
            ExprKind::Fold { fold, var, set, body } => each!(put: fold var set body),
            ExprKind::Prime(a) => each!(put: a),
            ExprKind::Unary(a, b) => each!(put: a b),
            ExprKind::Binary(a, b, c) => each!(put: a b c),
            ExprKind::Of(a, b) => each!(put: a b),
            ExprKind::Range(a, b) => each!(put: a b),
            ExprKind::As(a, b) => each!(put: a b),
            ExprKind::Tuple(a, b) => each!(put: a b),
            ExprKind::List(a) => each!(put: a),
        }
    }
}
