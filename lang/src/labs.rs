//! In which lab a workflow or a test is done.

use matterix_ir::{Diagnostic, Sources, Span, codes};

use crate::ast::ItemKind;
use crate::declare::Tables;
use crate::eval::Scope;
use crate::eval::lab::Elaborator;
use crate::eval::lab::reach::Reach;
use crate::lower::Planner;
use crate::names::{DeclId, item_name};
use crate::near;
use crate::task::{Given, given, workflow_of};

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
        return Ok(vec![tables.names.find(decl.module, path, "lab", is_lab)?]);
    }
    let given = given(tables, item, outside);
    let id = workflow_of(tables, item)?;
    let workflow = tables.names.decl(id);
    let ItemKind::Workflow { name, params, lab, .. } = &workflow.item.kind else { return Ok(Vec::new()) };
    if let Some(path) = lab {
        return Ok(vec![tables.names.find(workflow.module, path, "lab", is_lab)?]);
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
        let headline = format!("no lab of this file can run `{}`", name.text);
        let mut d = Diagnostic::error(codes::UNBOUND_ROLE, name.span, headline, "needs a lab");
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
            let headline = format!("unknown lab `{wanted}`");
            let mut d = Diagnostic::about(wanted, codes::UNKNOWN_NAME, name.span, headline, "given with `--lab`");
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
            let headline = format!("`{}` can run in {}: choose one", name.text, names.join(" or "));
            let mut d = Diagnostic::error(codes::UNBOUND_ROLE, name.span, headline, "needs a lab");
            for lab in many {
                let span = item_name(tables.names.decl(*lab).item).map_or_else(Span::default, |n| n.1);
                d = d.because(span, "this lab could run it");
            }
            Err(Box::new(d.help(format!("choose with `--lab {}`", names[0].trim_matches('`')))))
        }
    }
}

fn lab_name<'t>(tables: &Tables<'t>, lab: DeclId) -> &'t str {
    match &tables.names.decl(lab).item.kind {
        ItemKind::Lab { name, .. } => &name.text,
        _ => "",
    }
}
