//! Every declaration of a file by itself, on stand-ins for the instances it is about.

use matterix_ir::{Diagnostic, Sources, codes};

use super::{ignored, returns};
use crate::ast::{AssetLine, Field, FieldValue, Grid, Item, ItemKind, MemberKind, Param, Role};
use crate::declare::Tables;
use crate::declare::Type;
use crate::declare::types::unsupported;
use crate::eval::lab::Elaborator;
use crate::eval::lab::Mode;
use crate::eval::lab::budget::Budget;
use crate::eval::lab::reach::Reach;
use crate::eval::{Scope, Value};
use crate::lower::{Planner, script};
use crate::names::{DeclId, module_candidates, verb_text};
use crate::semantic_index::Seeing;

/// Checks the declarations of one module.
pub fn declarations(tables: &Tables<'_>, sources: &Sources, module: usize) -> Vec<Diagnostic> {
    declarations_and(tables, sources, module, &mut None)
}

/// Checks the declarations of one module, and notes what names mean where that is asked for.
pub fn declarations_and(tables: &Tables<'_>, sources: &Sources, module: usize, seeing: &mut Seeing) -> Vec<Diagnostic> {
    let stand_in = || {
        let mut lab = Elaborator::new(tables, Reach::default());
        lab.prototype = true;
        lab
    };
    let mut out = Vec::new();
    // Constants need no stand-ins of instances: what one of them is worth, the next one knows.
    let mut constants = stand_in();
    let mut budget = Budget::default();
    // So are the circles of constants, which are those of the whole file.
    let mut circles = None;
    for id in tables.names.declared_by(module) {
        let mut own = stand_in();
        let constant = matches!(tables.names.decl(id).item.kind, ItemKind::Const { .. });
        let lab = if constant { &mut constants } else { &mut own };
        lab.meanings = seeing.take();
        lab.budget = std::mem::take(&mut budget);
        lab.circles = circles.take();
        declaration(lab, sources, id, module);
        budget = std::mem::take(&mut lab.budget);
        circles = lab.circles.take();
        *seeing = lab.meanings.take();
        out.append(&mut lab.diagnostics);
    }
    constants.circles = circles;
    // What accepts a hazard, or uses a module, declares no name.
    for item in &tables.names.modules[module].tree.items {
        match &item.kind {
            ItemKind::Accept { name, .. } => constants.check_accepted(name, module),
            ItemKind::Use { path, names } if !tables.equilibria.is_empty() => {
                let is_it = |name: &String| tables.names.modules.iter().position(|m| m.name == *name);
                let used = module_candidates(path, names.is_some()).iter().find_map(is_it);
                if let (Some(used), Some(first), Some(last)) = (used, path.segments.first(), path.segments.last()) {
                    constants.check_circles_of_module(used, first.span.to(last.span));
                }
            }
            _ => {}
        }
    }
    out.append(&mut constants.diagnostics);
    out
}

fn declaration<'a>(lab: &mut Elaborator<'a>, sources: &Sources, id: DeclId, module: usize) {
    let item: &'a Item = lab.tables.names.decl(id).item;
    match &item.kind {
        ItemKind::Capability { .. } => capability(lab, id, module),
        ItemKind::Asset { .. } => asset(lab, id, item, module),
        ItemKind::Process(p) => {
            let mut scope = Scope::module(module);
            bind(lab, &p.params, module, &mut scope);
            lab.check_process(p, &mut scope);
        }
        ItemKind::Event(e) => {
            let mut scope = Scope::module(module);
            bind(lab, &e.params, module, &mut scope);
            lab.check_event(e, &mut scope);
        }
        ItemKind::Hazard { params, .. } => {
            let mut scope = Scope::module(module);
            bind(lab, params, module, &mut scope);
            lab.check_hazard(&item.kind, &mut scope);
        }
        ItemKind::Fn { params, body, external, name, result, options } => {
            report(lab, ignored::function(params.len(), options));
            let mut scope = Scope::module(module);
            bind(lab, params, module, &mut scope);
            if let Some(body) = body {
                let ty = result.as_ref().map_or(Type::Any, |ty| lab.resolve_type(ty, module));
                lab.hinted(body, &ty, &mut scope);
            } else if *external && !crate::eval::external::is_bound(&name.text) {
                lab.report(
                    Diagnostic::error(
                        codes::UNBOUND_EXTERN,
                        name.span,
                        format!("the compiler has no function `{}`", name.text),
                        "declared `extern`",
                    )
                    .help("only the standard library declares external functions; give it a body with `= ...`"),
                );
            }
        }
        ItemKind::Relation { params, definition: Some(body), .. } => {
            let mut scope = Scope::module(module);
            bind(lab, params, module, &mut scope);
            lab.truth(body, &mut scope);
        }
        ItemKind::Const { name, .. } => drop(lab.declared(id, name)),
        ItemKind::Table { .. } => lab.check_table(id),
        ItemKind::Solution { .. } => {
            lab.composition(id);
            lab.check_label(id);
        }
        ItemKind::Reaction { name, .. } => {
            for (index, r) in lab.tables.reactions.iter().enumerate() {
                if r.module == module && r.name.trim_end_matches(".reverse") == name.text {
                    lab.check_rate(crate::declare::ReactionId(index as u32));
                    lab.check_at_rest(crate::declare::ReactionId(index as u32));
                }
            }
        }
        ItemKind::Equilibrium { name, .. } => {
            let equilibria = &lab.tables.equilibria;
            let is_it = |e: &usize| equilibria[*e].module == module && equilibria[*e].span == name.span;
            if let Some(e) = (0..equilibria.len()).find(is_it) {
                lab.check_equilibrium(e);
                lab.check_circles(e);
            }
        }
        ItemKind::Interaction { name, .. } => {
            let interactions = &lab.tables.interactions;
            let is_it = |k: &usize| interactions[*k].module == module && interactions[*k].span == name.span;
            if let Some(k) = (0..interactions.len()).find(is_it) {
                lab.check_interaction(k);
            }
        }
        ItemKind::Species { .. } => lab.check_species(id),
        ItemKind::Material { fields, .. } => material(lab, fields, module),
        ItemKind::Skill { sig, body, handlers, .. } => {
            if let (Some(_), Some(body)) = (&sig.result, body) {
                report(lab, returns::check(&verb_text(&sig.verb), sig.span, body, handlers));
            }
            let mut planner = Planner::new(lab, sources);
            planner.check_skill(id);
        }
        ItemKind::Framing { .. } => drop(Planner::new(lab, sources).frames(id)),
        ItemKind::Driver { transport, .. } if script::is_known(transport) => {
            Planner::new(lab, sources).check_script(id);
        }
        ItemKind::Driver { device, .. } => {
            if let Some(kind) = lab.kind_named(device, module) {
                let this = lab.prototype_of(vec![kind], lab.tables.kind_name(kind));
                lab.use_lines(this);
                Planner::new(lab, sources).driver(id, this);
            }
        }
        _ => {}
    }
}

/// The friction of a material is a plain number that is not negative.
fn material<'a>(lab: &mut Elaborator<'a>, fields: &'a [Field], module: usize) {
    for f in fields.iter().filter(|f| f.key.text == "friction") {
        let FieldValue::Expr(e) = &f.value else { continue };
        let value = lab.typed(e, &Type::ratio(), &mut Scope::module(module), "friction");
        if let Value::Num(n) = &value
            && !lab.graph.constant(n.node).is_some_and(|v| v.is_finite() && v >= 0.0)
        {
            let headline = "`friction` must be a constant of 0 or more";
            lab.report(Diagnostic::error(codes::OUT_OF_RANGE, e.span, headline, "not such a number"));
        }
    }
}

fn report(lab: &mut Elaborator<'_>, found: Vec<Diagnostic>) {
    found.into_iter().for_each(|d| lab.report(d));
}

/// Binds parameters to stand-ins of their types.
pub fn bind<'a>(lab: &mut Elaborator<'a>, params: &'a [Param], module: usize, scope: &mut Scope) {
    for p in params {
        let v = match &p.ty {
            Some(ty) => {
                let ty = lab.resolve_type(ty, module);
                lab.placeholder(&ty, &p.name.text)
            }
            None => Value::Error,
        };
        scope.bind(p.name.text.clone(), v);
    }
}

fn capability<'a>(lab: &mut Elaborator<'a>, id: DeclId, module: usize) {
    let this = lab.prototype_of(vec![id], lab.tables.kind_name(id));
    for m in lab.all_members(this).iter().copied() {
        if m.owner != id {
            continue;
        }
        match &m.member.kind {
            MemberKind::Value { role, name, ty, options, per, value } => {
                report(lab, ignored::options(*role, options));
                let ty = lab.resolve_type(ty, module);
                if let Some(d) = ignored::matter(lab, *role, per.is_some(), &ty, options) {
                    lab.report(d);
                }
                if *role == Role::Flow {
                    continue;
                }
                let at_start = matches!(role, Role::State | Role::Extensive);
                let mode = Mode { at_start, reported: *role == Role::Reading, pooled: false };
                lab.in_mode(mode, |lab| match *role == Role::Extensive && per.is_some() {
                    true => drop(lab.state_value(this, m, &name.text, &ty, value.as_ref())),
                    false => drop(lab.member_value(this, m, name.span)),
                });
                let state = matches!(role, Role::State | Role::Extensive);
                if state
                    && !matches!(
                        ty,
                        Type::Bool
                            | Type::Int
                            | Type::Quantity { .. }
                            | Type::Instance { .. }
                            | Type::Enum(_)
                            | Type::Any
                    )
                {
                    let shown = lab.tables.type_name(&ty);
                    lab.report(unsupported(name.span, &format!("states that hold {shown}")));
                }
            }
            MemberKind::View { param, ty, value } => {
                let ty = lab.resolve_type(ty, module);
                let mut scope = Scope::of_member(this, m);
                bind(lab, std::slice::from_ref(param), module, &mut scope);
                let v = lab.expr(value, &mut scope);
                lab.coerce(v, &ty, value.span, "view");
            }
            MemberKind::Process(p) => lab.check_process(p, &mut Scope::of_member(this, m)),
            MemberKind::Event(e) => lab.check_event(e, &mut Scope::of_member(this, m)),
            MemberKind::Command { sig, clauses } => {
                let mut planner = Planner::new(lab, &EMPTY);
                planner.check_command(this, sig, clauses, m);
            }
            MemberKind::Limit { cond, .. } => drop(lab.truth(cond, &mut Scope::of_member(this, m))),
            MemberKind::Frame { .. } | MemberKind::Error => {}
        }
    }
}

/// Labels of a declaration checked by itself are never shown.
static EMPTY: std::sync::LazyLock<Sources> = std::sync::LazyLock::new(Sources::default);

fn asset<'a>(lab: &mut Elaborator<'a>, id: DeclId, item: &'a Item, module: usize) {
    let ItemKind::Asset { lines, source, .. } = &item.kind else { return };
    if let Some((word, _)) = source
        && !crate::import::is_known(word)
    {
        lab.report(unsupported(word.span, "assets from files"));
    }
    for line in lines {
        let literal = match line {
            AssetLine::Field(f) => {
                lab.check_fields_of(id, std::slice::from_ref(f), true);
                lab.check_nested(id, f, module);
                continue;
            }
            AssetLine::Part { literal, .. } | AssetLine::Grid(Grid { literal, .. }) => literal,
            _ => continue,
        };
        if let Some(kind) = lab.kind_named(&literal.ty, module) {
            lab.check_fields(kind, &literal.fields);
        }
    }
    let this = lab.prototype_of(vec![id], lab.tables.kind_name(id));
    lab.use_lines(this);
    let geometry = lab.geometry(this);
    lab.inertial(this, &geometry);
    let moving = geometry.moving;
    lab.articulation(this, moving);
    for m in lab.all_members(this).iter().copied() {
        if let MemberKind::Value { role: Role::Param, name, .. } = &m.member.kind {
            lab.member_value(this, m, name.span);
        }
        lab.redefinition(this, m, lines);
    }
}
