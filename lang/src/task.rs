//! What is judged or run: a workflow or a test, in a lab, with values of its parameters.

use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Expr, ItemKind, Name, NamedExpr, Stmt, StmtKind};
use crate::declare::Tables;
use crate::eval::lab::choices::Choice;
use crate::names::DeclId;
use crate::near;

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
        d.help(format!("a test with its own steps starts with `test {} in LAB {{ }}`", name.text))
    };
    let mut stmts = body.stmts.iter().enumerate().filter(|(_, s)| !matches!(s.kind, StmtKind::Error));
    let Some((at, first)) = stmts.next() else {
        let headline = format!("the test `{}` has no steps", name.text);
        let d = misplaced(name.span, headline, "no steps");
        return Err(Box::new(d.help("start with the workflow: `run NAME { parameter: value }`")));
    };
    let StmtKind::Run { workflow, options } = &first.kind else {
        let d =
            misplaced(first.span, "a test must start with the workflow that it runs".to_string(), "no `run WORKFLOW`");
        return Err(Box::new(d));
    };
    for (_, stmt) in stmts {
        if !matches!(
            stmt.kind,
            StmtKind::Expect { .. }
                | StmtKind::Let { .. }
                | StmtKind::Var { .. }
                | StmtKind::Set { .. }
                | StmtKind::Note(_)
        ) {
            let headline = "after the run of its workflow a test can only `expect`".to_string();
            return Err(Box::new(misplaced(stmt.span, headline, "not an `expect`")));
        }
    }
    if handlers.finally.is_some() || !handlers.on.is_empty() {
        let headline = "a test of a workflow cannot have failure handlers".to_string();
        return Err(Box::new(misplaced(name.span, headline, "this test")));
    }
    let workflow = tables.names.find(decl.module, workflow, "workflow", |k| matches!(k, ItemKind::Workflow { .. }))?;
    Ok(Some(Tested { workflow, options, rest: &body.stmts[at + 1..] }))
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
        return tables.names.find(decl.module, of, "workflow", |k| matches!(k, ItemKind::Workflow { .. }));
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
