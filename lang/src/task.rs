//! What is judged or run: a workflow or a test, in a lab, with values of its parameters.

use matterix_ir::{Diagnostic, Sources, Span, codes};

use crate::ast::{Expr, ItemKind, Name, NamedExpr, Path, Stmt, StmtKind};
use crate::elaborate::reach::Reach;
use crate::elaborate::{Elaborator, Tables};
use crate::eval::Scope;
use crate::lower::Planner;
use crate::names::{DeclId, near};

/// A value of a parameter from outside: `--set`, or the options of `run` in a test.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    /// The parameter.
    pub name: &'a Name,
    /// Its value.
    pub value: &'a Expr,
    /// Where names in it are looked up, after those of the lab.
    pub module: usize,
}

/// A workflow or a test in its lab.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// The workflow or test.
    pub item: DeclId,
    /// The lab.
    pub lab: DeclId,
    /// Values of parameters.
    pub given: Vec<Given<'a>>,
    /// Another value than its default that one of the workflow's parameters is supposed to have.
    pub supposed: Option<Choice>,
}

/// A value of a parameter that is a truth value or a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The parameter.
    pub name: String,
    /// The word it has: `true` and `false` for a truth value.
    pub word: String,
    /// All words it may have, in their order.
    pub words: Vec<String>,
}

/// The workflow that a test runs: `run synthesize { target: 76 degC }`.
#[derive(Clone, Copy, Debug)]
pub struct Tested<'a> {
    /// The workflow.
    pub workflow: DeclId,
    /// Values of its parameters.
    pub options: &'a [NamedExpr],
    /// What is judged at its end.
    pub rest: &'a [Stmt],
}

/// The workflow a test runs; none for a test with steps of its own, which stands `in` a lab.
pub fn tested<'a>(tables: &Tables<'a>, test: DeclId) -> Result<Option<Tested<'a>>, Box<Diagnostic>> {
    let decl = tables.names.decl(test);
    let ItemKind::Test { name, lab: None, body, handlers } = &decl.item.kind else { return Ok(None) };
    let misplaced = |span: Span, headline: String, label: &str| {
        let d = Diagnostic::error(codes::MISPLACED, span, headline, label);
        d.help(format!("steps of its own stand in `test {} in LAB {{ }}`", name.text))
    };
    let mut stmts = body.stmts.iter().enumerate().filter(|(_, s)| !matches!(s.kind, StmtKind::Error));
    let Some((at, first)) = stmts.next() else {
        let headline = format!("`{}` tests nothing", name.text);
        let d = misplaced(name.span, headline, "no steps");
        return Err(Box::new(d.help("begin with the workflow: `run NAME { parameter: value }`")));
    };
    let StmtKind::Run { workflow, options } = &first.kind else {
        let d = misplaced(first.span, "a test begins with the workflow it runs".to_string(), "no `run WORKFLOW`");
        return Err(Box::new(d));
    };
    for (_, stmt) in stmts {
        if !matches!(stmt.kind, StmtKind::Expect { .. } | StmtKind::Let { .. } | StmtKind::Note(_)) {
            let headline = "after the run of its workflow a test only judges".to_string();
            return Err(Box::new(misplaced(stmt.span, headline, "not an `expect`")));
        }
    }
    if handlers.finally.is_some() || !handlers.on.is_empty() {
        let headline = "a test of a workflow handles no failures".to_string();
        return Err(Box::new(misplaced(name.span, headline, "this test")));
    }
    let workflow = find(tables, decl.module, workflow, "workflow", |k| matches!(k, ItemKind::Workflow { .. }))?;
    Ok(Some(Tested { workflow, options, rest: &body.stmts[at + 1..] }))
}

/// The item of a kind that a path names.
pub fn find(
    tables: &Tables<'_>,
    module: usize,
    path: &Path,
    what: &str,
    fits: impl Fn(&ItemKind) -> bool,
) -> Result<DeclId, Box<Diagnostic>> {
    let Some(word) = path.segments.last() else {
        return Err(Box::new(Diagnostic::error(codes::SYNTAX, path.span, format!("a {what} is missing"), "here")));
    };
    match tables.names.lookup(module, &word.text) {
        Some(id) if fits(&tables.names.decl(id).item.kind) => Ok(id),
        _ => Err(Box::new(tables.names.unknown(module, word, what, fits))),
    }
}

/// What a workflow or test is given: that from outside or, for a test, what it says itself.
pub fn given<'a>(tables: &Tables<'a>, item: DeclId, outside: &[Given<'a>]) -> Vec<Given<'a>> {
    match tested(tables, item) {
        Ok(Some(tested)) => {
            let module = tables.names.decl(item).module;
            tested.options.iter().map(|o| Given { name: &o.name, value: &o.value, module }).collect()
        }
        _ => outside.to_vec(),
    }
}

/// The workflow behind a task: itself, or the one that a test, a study or a fit runs.
pub fn workflow_of(tables: &Tables<'_>, item: DeclId) -> Result<DeclId, Box<Diagnostic>> {
    let decl = tables.names.decl(item);
    if let ItemKind::Study { of, .. } | ItemKind::Fit { of, .. } = &decl.item.kind {
        return find(tables, decl.module, of, "workflow", |k| matches!(k, ItemKind::Workflow { .. }));
    }
    Ok(tested(tables, item)?.map_or(item, |t| t.workflow))
}

/// Reports values for parameters that the workflow does not have.
pub fn check_given(tables: &Tables<'_>, item: DeclId, given: &[Given<'_>]) -> Vec<Diagnostic> {
    let Ok(workflow) = workflow_of(tables, item) else { return Vec::new() };
    let ItemKind::Workflow { params, name, .. } = &tables.names.decl(workflow).item.kind else { return Vec::new() };
    let mut out = Vec::new();
    for (i, g) in given.iter().enumerate() {
        let key = &g.name.text;
        if let Some(first) = given[..i].iter().find(|o| o.name.text == *key) {
            let d = Diagnostic::error(codes::DUPLICATE_NAME, g.name.span, format!("`{key}` is given twice"), "again");
            out.push(d.because(first.name.span, "first given here"));
        } else if !params.iter().any(|p| p.name.text == *key) {
            let near = near::nearest(key, params.iter().map(|p| &p.name.text));
            let headline = format!("`{}` has no parameter `{key}`", name.text);
            let mut d = Diagnostic::error(codes::UNKNOWN_PARAMETER, g.name.span, headline, "not a parameter");
            d = d.because(name.span, "this workflow");
            d = near::proposed(d, &near, g.name.span);
            out.push(d);
        }
    }
    out
}

/// The labs a workflow or test can be done in: the one it names, or each in which its roles can be taken.
pub fn labs<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    root: usize,
    item: DeclId,
    outside: &[Given<'a>],
) -> Result<Vec<DeclId>, Box<Diagnostic>> {
    let is_lab = |k: &ItemKind| matches!(k, ItemKind::Lab { .. });
    let decl = tables.names.decl(item);
    if let ItemKind::Test { lab: Some(path), .. } = &decl.item.kind {
        return Ok(vec![find(tables, decl.module, path, "lab", is_lab)?]);
    }
    let given = given(tables, item, outside);
    let id = workflow_of(tables, item)?;
    let workflow = tables.names.decl(id);
    let ItemKind::Workflow { name, params, lab, .. } = &workflow.item.kind else { return Ok(Vec::new()) };
    if let Some(path) = lab {
        return Ok(vec![find(tables, workflow.module, path, "lab", is_lab)?]);
    }
    let mut labs: Vec<DeclId> =
        tables.names.visible(root).map(|(_, id)| id).filter(|id| is_lab(&tables.names.decl(*id).item.kind)).collect();
    labs.sort();
    labs.dedup();
    let mut fitting = Vec::new();
    let mut reasons = Vec::new();
    for lab in labs {
        let mut elaborator = Elaborator::new(tables, Reach::default());
        elaborator.lab(lab);
        let mut scope = Scope { lab: true, ..Scope::module(workflow.module) };
        let lacking = Planner::new(&mut elaborator, sources).lacking(params, &given, &mut scope);
        if lacking.is_empty() {
            fitting.push(lab);
        }
        reasons.extend(lacking.first().map(|reason| format!("`{}`: {reason}", lab_name(tables, lab))));
    }
    if fitting.is_empty() {
        let headline = format!("there is no lab in which `{}` can be done", name.text);
        let mut d = Diagnostic::error(codes::UNBOUND_ROLE, name.span, headline, "in any lab");
        if reasons.is_empty() {
            d = d.help("declare a lab in this file, or import one with `use`");
        }
        d.help.extend(reasons);
        return Err(Box::new(d));
    }
    Ok(fitting)
}

/// The one lab a workflow or test is done in; `wanted` names it where the workflow runs in any.
pub fn lab<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    root: usize,
    item: DeclId,
    outside: &[Given<'a>],
    wanted: Option<&str>,
) -> Result<DeclId, Box<Diagnostic>> {
    let workflow = workflow_of(tables, item)?;
    let (name, named) = match &tables.names.decl(workflow).item.kind {
        ItemKind::Workflow { name, lab, .. } => (name, lab.as_ref()),
        ItemKind::Test { name, lab, .. } => (name, lab.as_ref()),
        _ => return Err(Box::new(Diagnostic::error(codes::NO_WORKFLOW, Span::default(), "nothing to run", "here"))),
    };
    if let (Some(wanted), None) = (wanted, named) {
        let is_lab = |k: &ItemKind| matches!(k, ItemKind::Lab { .. });
        let found = tables.names.lookup(root, wanted).filter(|id| is_lab(&tables.names.decl(*id).item.kind));
        return found.ok_or_else(|| {
            let all = tables.names.visible(root).filter(|(_, id)| is_lab(&tables.names.decl(*id).item.kind));
            let near = near::nearest(wanted, all.map(|(n, _)| n));
            let headline = format!("there is no lab `{wanted}`");
            let mut d = Diagnostic::error(codes::UNKNOWN_NAME, name.span, headline, "asked for with `--lab`");
            d.help.extend(near::question(&near));
            Box::new(d)
        });
    }
    let labs = labs(tables, sources, root, item, outside)?;
    if let (Some(wanted), [one]) = (wanted, labs.as_slice())
        && lab_name(tables, *one) != wanted
    {
        let headline = format!("`{}` runs in `{}`, not in `{wanted}`", name.text, lab_name(tables, *one));
        let d = Diagnostic::error(codes::UNBOUND_ROLE, name.span, headline, "names its lab");
        return Err(Box::new(d.help("leave `--lab` out, or write `in any lab`")));
    }
    match labs.as_slice() {
        [one] => Ok(*one),
        many => {
            let names: Vec<String> = many.iter().map(|lab| format!("`{}`", lab_name(tables, *lab))).collect();
            let headline = format!("`{}` can be done in {}: which one?", name.text, names.join(" or "));
            let mut d = Diagnostic::error(codes::UNBOUND_ROLE, name.span, headline, "in any lab");
            for lab in many {
                let span = crate::names::item_name(tables.names.decl(*lab).item).map_or_else(Span::default, |n| n.1);
                d = d.because(span, "this lab fits");
            }
            Err(Box::new(d.help(format!("say which with `--lab {}`", names[0].trim_matches('`')))))
        }
    }
}

fn lab_name<'t>(tables: &Tables<'t>, lab: DeclId) -> &'t str {
    match &tables.names.decl(lab).item.kind {
        ItemKind::Lab { name, .. } => &name.text,
        _ => "",
    }
}
