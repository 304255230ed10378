//! Items and their lines.

use super::{
    Sexp,
    exprs::{args, expr, maybe, named, param, path, sig, ty, unit},
    leaf, name, names, node, quoted,
    steps::{block, filled, handlers, labelled},
};
use crate::ast::{
    AssetLine, AssetLiteral, AssignOp, At, Clause, ClauseKind, Contents, Effect, Event, Exchange, Expr, Field,
    FieldValue, Fill, FitLine, Goal, Holding, Item, ItemKind, LabLine, LabLineKind, Labelled, Law, LawKind, Manner,
    Member, MemberKind, Name, Pattern, Process, Refusal, Role, StudyLine, Term, Wire, WireKind,
};

pub(super) fn docs(docs: &[String]) -> Option<Sexp> {
    (!docs.is_empty()).then(|| node("docs").with(docs.iter().map(|line| quoted(line))))
}

fn flag(on: bool, word: &str) -> Option<Sexp> {
    on.then(|| leaf(word))
}

pub(super) fn item(item: &Item) -> Sexp {
    let mut all = item_kind(&item.kind);
    all.parts.extend(docs(&item.docs));
    all
}

fn item_kind(kind: &ItemKind) -> Sexp {
    match kind {
        ItemKind::Error => node("item-error"),
        ItemKind::Use { path: of, names: braces } => {
            node("use").with([path(of)]).with(braces.as_ref().map(|n| node("names").with(names(n))))
        }
        ItemKind::Dimension { name: word, point, definition } => {
            node("dimension").with([name(word)]).with(flag(*point, "point")).with(definition.as_ref().map(expr))
        }
        ItemKind::Unit { name: word, dimension, definition, origin, prefixes, aliases } => node("unit")
            .with([unit(word)])
            .with(dimension.as_ref().map(name))
            .with(definition.as_ref().map(expr))
            .with(maybe("from", origin.as_ref()))
            .with(flag(*prefixes, "prefixes"))
            .with((!aliases.is_empty()).then(|| node("also").with(aliases.iter().map(unit)))),
        ItemKind::Species { name: word, fields: list } => node("species").with([name(word)]).with(fields(list)),
        ItemKind::Solution { name: word, fields: list, labelled } => {
            node("solution").with([name(word)]).with(fields(list)).with(labelled.as_ref().map(label))
        }
        ItemKind::Reaction { name: word, reactants, reversible, products, fields: list } => node("reaction")
            .with([name(word), side(reactants), leaf(if *reversible { "<->" } else { "->" }), side(products)])
            .with(fields(list)),
        ItemKind::Interaction { name: word, between, fields: list } => {
            node("interaction").with([name(word), side(between)]).with(fields(list))
        }
        ItemKind::Equilibrium { name: word, reactants, products, fields: list } => {
            node("equilibrium").with([name(word), side(reactants), leaf("<->"), side(products)]).with(fields(list))
        }
        ItemKind::ReactiveGroup { name: word, fields: list } => {
            node("reactive-group").with([name(word)]).with(fields(list))
        }
        ItemKind::Material { name: word, fields: list } => node("material").with([name(word)]).with(fields(list)),
        ItemKind::Incompatible { a, b, fields: list } => {
            node("incompatible").with([name(a), name(b)]).with(fields(list))
        }
        ItemKind::Allow { a, b, reason } => node("allow").with([name(a), name(b), quoted(reason)]),
        ItemKind::Accept { name: word, reason } => node("accept").with([name(word), quoted(reason)]),
        ItemKind::Hazard { grave, name: word, params, of, after, when, help, because } => {
            node(if *grave { "hazard" } else { "caution" })
                .with([name(word)])
                .with(params.iter().map(param))
                .with(of.as_ref().map(|e| node("of").with([expr(e)])))
                .with(after.as_ref().map(|e| node("after").with([expr(e)])))
                .with([node("when").with([expr(when)])])
                .with(help.iter().map(|h| quoted(h)))
                .with(because.as_ref().map(|words| node("because").with([super::steps::filled(words)])))
        }
        ItemKind::Capability { name: word, extends, source, members } => node("capability")
            .with([name(word)])
            .with(extends.iter().map(path))
            .with(source.as_ref().map(|(kind, file)| node("from").with([name(kind), quoted(&file.text)])))
            .with(members.iter().map(member)),
        ItemKind::Asset { name: word, extends, source, lines } => node("asset")
            .with([name(word)])
            .with(extends.iter().map(path))
            .with(source.as_ref().map(|(kind, file)| node("from").with([name(kind), quoted(&file.text)])))
            .with(lines.iter().map(asset_line)),
        ItemKind::Process(of) => process(of),
        ItemKind::Event(of) => event(of),
        ItemKind::Relation { name: word, params, symmetric, definition } => node("relation")
            .with([name(word)])
            .with(params.iter().map(param))
            .with(flag(*symmetric, "symmetric"))
            .with(definition.as_ref().map(expr)),
        ItemKind::Fn { external, name: word, params, result, body, options } => node("fn")
            .with(flag(*external, "extern"))
            .with([name(word)])
            .with(params.iter().map(param))
            .with(result.as_ref().map(|r| node("result").with([ty(r)])))
            .with(body.as_ref().map(expr))
            .with(named(options)),
        ItemKind::Table { name: word, source: (format, file), columns, .. } => {
            node("table").with([name(word), name(format), quoted(&file.text)]).with(columns.iter().map(|c| {
                node("column")
                    .with([name(&c.name)])
                    .with(c.header.as_ref().map(|h| quoted(&h.text)))
                    .with([ty(&c.ty)])
                    .with(c.unit.as_ref().map(|u| quoted(&u.text)))
                    .with(c.default.as_ref().map(expr))
            }))
        }
        ItemKind::Const { name: word, ty: of, value } => {
            node("const").with([name(word)]).with(of.as_ref().map(ty)).with([expr(value)])
        }
        ItemKind::Framing { name: word, fields: list } => node("framing").with([name(word)]).with(fields(list)),
        ItemKind::Driver { name: word, device, transport, args: list, wires } => node("driver")
            .with([name(word), path(device), node("over").with([name(transport)]).with(args(list))])
            .with(wires.iter().map(wire)),
        ItemKind::Lab { name: word, params, lines } => {
            node("lab").with([name(word)]).with(params.iter().map(param)).with(lines.iter().map(lab_line))
        }
        ItemKind::Skill { external, sig: of, clauses, body, handlers: on } => node("skill")
            .with(flag(*external, "extern"))
            .with([sig(of)])
            .with(clauses.iter().map(clause))
            .with(body.as_ref().map(block))
            .with(handlers(on)),
        ItemKind::Workflow { name: word, params, lab, body, handlers: on } => node("workflow")
            .with([name(word)])
            .with(params.iter().map(param))
            .with([lab.as_ref().map_or_else(|| leaf("any-lab"), path), block(body)])
            .with(handlers(on)),
        ItemKind::Study { name: word, of, lines } => {
            node("study").with([name(word), path(of)]).with(lines.iter().map(study_line))
        }
        ItemKind::Fit { name: word, of, lines } => {
            node("fit").with([name(word), path(of)]).with(lines.iter().map(fit_line))
        }
        ItemKind::Test { name: word, lab, body, handlers: on } => {
            node("test").with([name(word)]).with(lab.as_ref().map(path)).with([block(body)]).with(handlers(on))
        }
    }
}

fn label(label: &Labelled) -> Sexp {
    node("labelled").with([expr(&label.value), name(&label.species)]).with(maybe("+-", label.tolerance.as_ref()))
}

fn side(terms: &[Term]) -> Sexp {
    let term = |t: &Term| node("term").with([leaf(format!("{:?}", t.coefficient)), name(&t.species)]);
    node("side").with(terms.iter().map(term))
}

fn fields(fields: &[Field]) -> Vec<Sexp> {
    fields.iter().map(field).collect()
}

fn field(field: &Field) -> Sexp {
    let value = match &field.value {
        FieldValue::Expr(value) => expr(value),
        FieldValue::Fields(inner) => node("fields").with(fields(inner)),
        FieldValue::Literal(of) => literal(of),
        FieldValue::Species(terms) => side(terms),
    };
    node(format!("{}:", field.key.text)).with([value])
}

fn literal(literal: &AssetLiteral) -> Sexp {
    node("literal").with([path(&literal.ty)]).with(fields(&literal.fields))
}

fn asset_line(line: &AssetLine) -> Sexp {
    match line {
        AssetLine::Error(_) => leaf("error"),
        AssetLine::Field(of) => field(of),
        AssetLine::Frame { name: word, at } => node("frame").with([name(word)]).with(place(at)),
        AssetLine::Joint(joint) => {
            let way = joint.way.iter().map(|way| {
                node(if way.slides { "slides" } else { "turns" })
                    .with([expr(&way.axis)])
                    .with(way.at.iter().flat_map(place))
            });
            node("joint").with([name(&joint.name)]).with(way).with(maybe("by", Some(&joint.by)))
        }
        AssetLine::Mesh(_, mesh) => node("mesh").with(mesh.iter().map(|mesh| quoted(&mesh.name))),
        AssetLine::Robot(robot, _) => node("robot").with([quoted(&robot.name)]),
        AssetLine::Solid { shape, at } => node("solid").with([expr(shape)]).with(at.iter().flat_map(place)),
        AssetLine::Grid(of) => node("grid")
            .with([name(&of.name), name(&of.from)])
            .with(of.to.as_ref().map(|to| node("to").with([name(to)])))
            .with([literal(&of.literal)])
            .with(maybe("at", of.at.as_ref()))
            .with(maybe("pitch", of.pitch.as_ref()))
            .with(maybe("by", of.row.as_ref())),
        AssetLine::Part { name: word, literal: of } => node("part").with([name(word), literal(of)]),
    }
}

fn member(of: &Member) -> Sexp {
    let all = match &of.kind {
        MemberKind::Error => leaf("error"),
        MemberKind::Value { role, name: word, ty: kind, per, value, options } => node(role_word(*role))
            .with([name(word), ty(kind)])
            .with(per.as_ref().map(|p| node("per").with([name(p)])))
            .with(maybe("=", value.as_ref()))
            .with(named(options)),
        MemberKind::View { param: index, ty: kind, value } => node("view").with([param(index), ty(kind), expr(value)]),
        MemberKind::Command { sig: of, clauses } => node("command").with([sig(of)]).with(clauses.iter().map(clause)),
        MemberKind::Process(of) => process(of),
        MemberKind::Limit { at_end, cond, refusal } => {
            demand(if *at_end { "ends" } else { "keeps" }, cond, refusal.as_ref())
        }
        MemberKind::Event(of) => event(of),
        MemberKind::Frame { name: word, at } => node("frame").with([name(word)]).with(at.iter().flat_map(place)),
    };
    all.with(docs(&of.docs))
}

fn role_word(role: Role) -> &'static str {
    match role {
        Role::Param => "param",
        Role::State => "state",
        Role::Derived => "derived",
        Role::Reading => "reading",
        Role::Flow => "flow",
        Role::Extensive => "extensive",
        Role::Part => "part",
    }
}

fn demand(word: &str, cond: &Expr, refusal: Option<&Refusal>) -> Sexp {
    let named = refusal.map(|r| {
        let because = r.because.as_ref().map(|text| node("because").with([super::steps::filled(text)]));
        node("else").with([name(&r.failure)]).with(r.help.as_deref().map(quoted)).with(because)
    });
    node(word).with([expr(cond)]).with(named)
}

fn place(at: &At) -> Vec<Sexp> {
    let from = at.from.as_ref().map(|f| node("from").with([name(f)]));
    std::iter::once(expr(&at.position)).chain(from).chain(maybe("with", at.turned.as_ref())).collect()
}

fn effect(of: &Effect) -> Sexp {
    match of {
        Effect::Assign(target, value) => node("=").with([expr(target), expr(value)]),
        Effect::Call(call) => expr(call),
        Effect::Each { var, set, effects } => {
            node("each").with([name(var), expr(set)]).with(effects.iter().map(effect))
        }
    }
}

fn clause(clause: &Clause) -> Sexp {
    match &clause.kind {
        ClauseKind::Needs { cond, refusal } => demand("needs", cond, refusal.as_ref()),
        ClauseKind::Presumes { ever, cond, refusal } => {
            let word = if *ever { "presumes ever" } else { "presumes" };
            demand(word, cond, refusal.as_ref())
        }
        ClauseKind::Warns { cond, refusal } => demand("warns", cond, refusal.as_ref()),
        ClauseKind::While(cond) => node("while").with([expr(cond)]),
        ClauseKind::Fails(all) => node("fails").with(names(all)),
        ClauseKind::Effect(effects) => node("effect").with(effects.iter().map(effect)),
        ClauseKind::Takes { nominal, bounds } => node("takes").with([expr(nominal)]).with(maybe("in", bounds.as_ref())),
        ClauseKind::Until(cond) => node("until").with([expr(cond)]),
        ClauseKind::Says { text, when } => {
            node("says").with([super::steps::filled(text)]).with(maybe("when", when.as_ref()))
        }
        ClauseKind::Moves { mover, manner, to, within } => {
            let moves = match manner {
                Manner::Free => node("moves").with([expr(mover)]),
                Manner::Straight => node("moves straight").with([expr(mover)]),
                Manner::Driving => node("moves driving").with([expr(mover)]),
                Manner::Upright(within) => node("moves upright").with([expr(mover), expr(within)]),
                Manner::Tilted(angle, about) => node("moves tilted").with([expr(mover), expr(angle), expr(about)]),
            };
            let moves = match to {
                Goal::Frame { at, by } => moves.with(maybe("to", Some(at))).with(maybe("by", by.as_ref())),
                Goal::Shift(by) => moves.with(maybe("by", Some(by))),
                Goal::Joints(to) => moves.with(maybe("to joints", Some(to))),
                Goal::Home => moves.with([node("home")]),
            };
            moves.with(maybe("in", within.as_ref()))
        }
        ClauseKind::Grips { item, at, by } => {
            node("grips").with([expr(item)]).with(maybe("at", at.as_ref())).with([expr(by)])
        }
        ClauseKind::Leads { handle, by } => node("leads").with([expr(handle), expr(by)]),
        ClauseKind::Frees { item, on, by } => {
            node("frees").with([expr(item)]).with(maybe("on", on.as_ref())).with([expr(by)])
        }
        ClauseKind::Option(of) => node("option").with([param(of)]),
    }
}

fn process(of: &Process) -> Sexp {
    node("process")
        .with([name(&of.name)])
        .with(of.params.iter().map(param))
        .with(maybe("while", of.guard.as_ref()))
        .with([laws(&of.laws)])
}

fn event(of: &Event) -> Sexp {
    node("event")
        .with([name(&of.name)])
        .with(of.params.iter().map(param))
        .with([node("when").with([expr(&of.when)])])
        .with(of.delay.as_ref().map(|d| node(if d.sustained { "for" } else { "after" }).with([expr(&d.time)])))
        .with([laws(&of.laws)])
}

fn laws(laws: &[Law]) -> Sexp {
    node("laws").with(laws.iter().map(law))
}

fn law(law: &Law) -> Sexp {
    match &law.kind {
        LawKind::Error => leaf("error"),
        LawKind::Let { name: word, value } => node("let").with([name(word), expr(value)]),
        LawKind::For { var, set, body } => node("for").with([name(var), expr(set), laws(body)]),
        LawKind::If { cond, then, otherwise } => node("if").with([expr(cond), laws(then), laws(otherwise)]),
        LawKind::Assign { target, op, value } => {
            let op = match op {
                AssignOp::Set => "=",
                AssignOp::Add => "+=",
                AssignOp::Sub => "-=",
            };
            node(op).with([expr(target), expr(value)])
        }
        LawKind::Call(call) => expr(call),
    }
}

fn wire(wire: &Wire) -> Sexp {
    let verb = |word: &str, names: &[Name]| node(word).with(names.iter().map(name));
    match &wire.kind {
        WireKind::Error => leaf("error"),
        WireKind::Command { sig: of, exchange: said } => node("command").with([sig(of)]).with(exchange(said)),
        WireKind::Reading { path: of, condition, asks, expects } => node("reading")
            .with([path(of)])
            .with(maybe("while", condition.as_ref()))
            .with([filled(asks), quoted(&expects.text)]),
        WireKind::Hears { path: of, condition, text, every } => node("hears")
            .with([path(of)])
            .with(maybe("while", condition.as_ref()))
            .with([quoted(&text.text), expr(every)]),
        WireKind::Ignores { text } => node("ignores").with([quoted(&text.text)]),
        WireKind::Reply { text, fails } => node("reply").with([quoted(text), name(fails)]),
        WireKind::Answers { asked, with } => node("answers").with([quoted(&asked.text), filled(with)]),
        WireKind::Fixed { when, condition, exchange: said } => {
            node(&when.text).with(maybe("while", condition.as_ref())).with(exchange(said))
        }
        WireKind::Alive { condition, every, within, by, otherwise } => node("alive")
            .with([expr(condition), expr(every)])
            .with(maybe("within", within.as_ref()))
            .with([verb("by", by), verb("else", otherwise)]),
    }
}

fn exchange(said: &Exchange) -> Vec<Sexp> {
    let expects = |p: &Pattern| node("expects").with([quoted(&p.text)]);
    let mut out = vec![node("sends").with(said.sends.iter().map(filled))];
    out.extend(said.expects.as_ref().into_iter().chain(&said.then).map(expects));
    out.extend(said.until.as_ref().map(|u| {
        let asks = node("until").with([filled(&u.asks)]);
        asks.with(u.expects.as_ref().map(expects)).with([expr(&u.timeout)])
    }));
    out
}

fn places(fill: &Fill) -> Sexp {
    node("places")
        .with([name(&fill.from)])
        .with(fill.to.as_ref().map(|to| node("to").with([name(to)])))
        .with([expr(&fill.value)])
        .with(warm(fill.at.as_ref()))
}

/// How warm what is held is.
fn warm(at: Option<&Expr>) -> Option<Sexp> {
    at.map(|at| node("at").with([expr(at)]))
}

fn lab_line(line: &LabLine) -> Sexp {
    match &line.kind {
        LabLineKind::Error => leaf("error"),
        LabLineKind::Setting { name: word, value } => node("setting").with([name(word), expr(value)]),
        LabLineKind::Instance { name: word, literal: of, relations, holding } => node("instance")
            .with([name(word), literal(of)])
            .with(labelled(relations))
            .with(holding.as_ref().map(|Holding { contents, at }| {
                match contents {
                    Contents::Expr(value) => node("holding").with([expr(value)]),
                    Contents::Places(list) => node("holding").with(list.iter().map(places)),
                }
                .with(warm(at.as_ref()))
            })),
        LabLineKind::Include { lab, name: word, relations, options } => {
            node("include").with([path(lab), name(word)]).with(labelled(relations)).with(named(options))
        }
        LabLineKind::Between { a, b, fields: list } => node("between").with([expr(a), expr(b)]).with(fields(list)),
    }
}

fn study_line(line: &StudyLine) -> Sexp {
    match line {
        StudyLine::Error(_) => leaf("error"),
        StudyLine::Vary { path: of, range, by } => node("vary")
            .with([expr(of), expr(range)])
            .with(by.as_ref().map(|(how, list)| node("by").with([name(how)]).with(args(list)))),
        StudyLine::Runs(count) => node("runs").with([expr(count)]),
        StudyLine::Report { name: word, value } => node("report").with([name(word), expr(value)]),
    }
}

fn fit_line(line: &FitLine) -> Sexp {
    match line {
        FitLine::Error(_) => leaf("error"),
        FitLine::Data(file) => node("data").with([quoted(&file.text)]),
        FitLine::Estimate { path: of, range, log } => {
            node("estimate").with([expr(of), expr(range)]).with(flag(*log, "log"))
        }
        FitLine::Match { value, column, unit: of, noise } => node("match")
            .with([expr(value), quoted(&column.text)])
            .with(of.as_ref().map(|u| node("as").with([unit(u)])))
            .with(maybe("noise", noise.as_ref())),
    }
}
