//! A plan in a lab of some lines, for those who test a single check.

use matterix_ir::model::{Derivative, Event};
use matterix_ir::plan::Plan;
use matterix_ir::{Diagnostic, Sources};

use super::Subject;
use crate::ast::ItemKind;
use crate::declare::Tables;
use crate::eval::lab::Elaborator;
use crate::fixpoint::{Purpose, Settled, settled};
use crate::load::load;
use crate::loader::LibraryOnly;
use crate::names::{DeclId, Names};
use crate::session::Session;
use crate::task::Task;
use crate::{labs, parallel};

/// The first workflow of a text, written out.
pub(super) struct Bench<'l, 'a> {
    pub(super) lab: &'l mut Elaborator<'a>,
    pub(super) tables: &'l Tables<'a>,
    /// The text's own module, and its lab.
    pub(super) at: (usize, DeclId),
    sources: &'l Sources,
    plan: &'l Plan,
    derivatives: &'l [Derivative],
    events: &'l [Event],
}

impl<'a> Bench<'_, 'a> {
    pub(super) fn subject(&self) -> Subject<'_, 'a> {
        let Bench { lab, sources, plan, derivatives, events, .. } = self;
        Subject { lab, sources, plan, derivatives, events }
    }
}

fn headlines(found: &[Diagnostic]) -> Vec<&str> {
    found.iter().map(|d| d.headline.as_str()).collect()
}

/// What a check of the first workflow of a text finds, as `code: headline`.
pub(super) fn found(text: &str, check: impl FnOnce(Bench<'_, '_>) -> Vec<Diagnostic> + Send) -> Vec<String> {
    let run = || {
        let mut sources = Sources::default();
        let file = sources.add("bench.mtx", format!("mtx 1\n{text}"));
        let (modules, found) = load(&mut sources, file, &LibraryOnly, &mut Session::default());
        assert!(found.is_empty(), "{:?}", headlines(&found));
        let (names, found) = Names::new(&modules);
        assert!(found.is_empty(), "{:?}", headlines(&found));
        let (tables, found) = crate::elaborate::declared(&names);
        assert!(found.is_empty(), "{:?}", headlines(&found));
        let root = modules.iter().position(|module| module.file == file).expect("the text is a module");
        let is_workflow = |id: &_| matches!(names.decl(*id).item.kind, ItemKind::Workflow { .. });
        let item = names.declared_by(root).find(is_workflow).expect("a workflow");
        let lab = labs::labs(&tables, &sources, root, item, &[]).expect("its lab")[0];
        let task = Task { item, lab, given: Vec::new(), supposed: None };
        let Settled { mut lab, plan, events, .. } =
            settled(&tables, &sources, &task, Purpose::default(), None, &|| false).expect("nothing stops it");
        assert!(lab.diagnostics.is_empty(), "{:?}", headlines(&lab.diagnostics));
        let (derivatives, _) = lab.close();
        let bench = Bench {
            lab: &mut lab,
            tables: &tables,
            at: (root, task.lab),
            sources: &sources,
            plan: &plan,
            derivatives: &derivatives,
            events: &events,
        };
        check(bench).iter().map(|d| format!("{}: {}", d.code.name, d.headline)).collect()
    };
    // As deep as the command's own threads.
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(parallel::STACK).spawn_scoped(scope, run);
        thread.expect("a thread").join().expect("the check ends")
    })
}
