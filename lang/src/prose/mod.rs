//! A workflow as a protocol in Markdown that a person can follow by hand.
//!
//! Steps are told in the order and nesting of the text. How a verb is said stands with the verb (`says`); one without is
//! said as it is called, and a skill of the user's own files becomes a procedure of its own below the steps.

mod calls;
mod list;
mod materials;
mod phrase;
mod steps;
mod words;

use std::collections::BTreeMap;

use matterix_ir::{Program, Sources, Span};

use crate::ast::{Block, Handlers, ItemKind};
use crate::declare::Tables;
use crate::eval::lab::Elaborator;
use crate::eval::lab::reach::Reach;
use crate::eval::{Scope, Value};
use crate::lower::Planner;
use crate::names::DeclId;
use crate::task::{self, Task};
use matterix_ir::listing::joined;

use list::List;

/// The protocol of a workflow that was compiled without errors.
pub fn protocol<'a>(tables: &'a Tables<'a>, sources: &Sources, program: &Program, task: &Task<'a>) -> String {
    let mut lab = Elaborator::new(tables, Reach::default());
    lab.lab(task.lab);
    // Planned once more, to learn which skill or command each call means.
    Planner::new(&mut lab, sources).task(task);
    let id = task::workflow_of(tables, task.item).unwrap_or(task.item);
    let decl = tables.names.decl(id);
    let ItemKind::Workflow { name, params, body, handlers, .. } = &decl.item.kind else { return String::new() };
    let mut scope = Scope { lab: true, ..Scope::module(decl.module) };
    for (param, value) in &program.plan.arguments {
        if let Some(instance) = lab.find_instance(value) {
            scope.bind(param.clone(), Value::Instance(instance));
        }
    }
    let file = tables.names.modules.get(decl.module);
    let mut prose = Prose {
        lab,
        sources,
        program,
        arguments: program.plan.arguments.iter().cloned().collect(),
        scope,
        vars: Vec::new(),
        procedures: Vec::new(),
        file: file.map_or(name.span.file, |m| m.file),
    };
    let mut out = vec![format!("# {}", words::title(&name.text))];
    let docs = |lines: &[String]| Some(words::paragraphs(lines)).filter(|text| !text.is_empty());
    out.extend(file.and_then(|m| docs(&m.tree.docs)));
    out.extend(docs(&decl.item.docs));
    if !params.is_empty() {
        let values: Vec<String> = params.iter().filter_map(|p| prose.parameter(&p.name.text)).collect();
        out.push(format!("With {}.", joined(&values, "and")));
    }
    let source = sources.get(name.span.file).map_or("", |s| s.name.as_str());
    out.push(format!(
        "Workflow `{}` of `{source}`, in the lab `{}`. Line numbers are those of that file.",
        name.text, program.scene.lab
    ));
    prose.materials(&mut out);
    prose.workflow(body, handlers, &mut out);
    prose.procedures(&mut out);
    out.join("\n\n") + "\n"
}

/// What is needed while the text is written.
struct Prose<'a, 'e> {
    lab: Elaborator<'a>,
    sources: &'e Sources,
    program: &'e Program,
    /// Parameters of the workflow with their values as shown.
    arguments: BTreeMap<String, String>,
    scope: Scope,
    /// Names that stand for something else each time: variables of loops, results, parameters of a procedure.
    vars: Vec<String>,
    /// Skills of the user that are told below, in the order of their first use.
    procedures: Vec<DeclId>,
    /// The file of the workflow.
    file: matterix_ir::FileId,
}

impl<'a> Prose<'a, '_> {
    /// The steps, what failures lead to, and what is done in any case.
    fn workflow(&mut self, body: &'a Block, handlers: &'a Handlers, out: &mut Vec<String>) {
        out.push("## Steps".to_string());
        out.push(self.block(body).markdown());
        for (name, block) in &handlers.on {
            out.push(format!("### {}", self.failure(&name.text)));
            out.push(self.block(block).markdown());
        }
        if let Some(finally) = &handlers.finally {
            out.push("### In any case, at the end".to_string());
            out.push("Also after a failure or if the work was stopped:".to_string());
            out.push(self.block(finally).markdown());
        }
    }

    /// The skills of the user that the steps ask for.
    fn procedures(&mut self, out: &mut Vec<String>) {
        let mut next = 0;
        while let Some(id) = self.procedures.get(next).copied() {
            if next == 0 {
                out.push("## Procedures".to_string());
            }
            next += 1;
            let decl = self.lab.tables.names.decl(id);
            let ItemKind::Skill { sig, clauses, body: Some(body), handlers, .. } = &decl.item.kind else { continue };
            self.vars = sig.all_params().map(|p| p.name.text.clone()).collect();
            self.vars.extend(calls::options(clauses).map(|p| p.name.text.clone()));
            let form = calls::form(sig);
            out.push(format!("### To {form} {}", self.place(sig.span)));
            let docs = words::paragraphs(&decl.item.docs);
            if !docs.is_empty() {
                out.push(docs);
            }
            let arguments = std::mem::take(&mut self.arguments);
            let scope = std::mem::replace(&mut self.scope, Scope::module(decl.module));
            let mut list: List = self.block(body);
            list.groups.extend(self.handlers(handlers));
            out.push(list.markdown());
            (self.arguments, self.scope) = (arguments, scope);
        }
    }

    /// `(line 28)`, with the file where it is another one.
    fn place(&self, span: Span) -> String {
        let line = self.sources.line_column(span).0;
        if span.file == self.file {
            return format!("_(line {line})_");
        }
        let name = self.sources.get(span.file).map_or("", |s| s.name.as_str());
        format!("_({name}, line {line})_")
    }
}
