//! The blocks of statements.

use matterix_ir::FileId;
use matterix_syntax::ast::{ItemKind, Stmt};
use matterix_syntax::parse;

/// The statements of a workflow.
fn statements(body: &str) -> Vec<Stmt> {
    let text = format!("mtx 1\n\nworkflow w in bench {{\n{body}\n}}\n");
    let (tree, found) = parse(FileId(0), &text);
    assert!(found.is_empty(), "{text}");
    let of_workflow = |kind| match kind {
        ItemKind::Workflow { body, .. } => Some(body.stmts),
        _ => None,
    };
    tree.items.into_iter().find_map(|item| of_workflow(item.kind)).expect("it is a workflow")
}

#[test]
fn every_block_of_a_statement_is_one_of_its_blocks() {
    let cases = [
        ("wait 1 s", 0),
        ("if x { wait 1 s }", 1),
        ("if x { wait 1 s } else { wait 2 s }", 2),
        ("try { wait 1 s } else { wait 2 s } else { wait 3 s }", 3),
        ("step grow { wait 1 s }", 1),
        ("repeat 2 times { wait 1 s }", 1),
        ("repeat while x max 3 { wait 1 s }", 1),
        ("for w in plate.wells { wait 1 s }", 1),
        ("within 5 min after grow.end { wait 1 s }", 1),
        ("keep x { wait 1 s }", 1),
        ("claim plate { wait 1 s }", 1),
        ("sequence { wait 1 s }", 1),
        ("parallel {\n wait 1 s\n wait 2 s\n}", 1),
        ("start job = { wait 1 s }", 1),
        ("start job = heat plate to 50 degC", 1),
        // Handlers are no part of it.
        ("sequence { wait 1 s } on slip { wait 2 s } finally { wait 3 s }", 1),
        ("wait until x timeout 1 s on timeout { wait 2 s }", 0),
    ];
    for (text, count) in cases {
        let all = statements(text);
        assert_eq!(all.len(), 1, "{text}");
        assert_eq!(all[0].kind.blocks().len(), count, "{text}");
    }
}
