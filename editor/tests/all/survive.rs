//! Any text at any byte.

use matterix_editor::complete::{complete, signature};
use matterix_editor::references::references;
use matterix_editor::rename::rename;

use crate::names::LAB;
use crate::support::{Files, analysed};

#[test]
fn a_text_that_is_cut_anywhere_is_answered() {
    let (analysis, index) = analysed("cook.mtx", LAB, &Files::default());
    for at in (0..=LAB.len()).filter(|at| LAB.is_char_boundary(*at)) {
        let text = &LAB[..at];
        complete(&index, analysis.root, text, at);
        signature(&index, analysis.root, text, at);
        index.about(analysis.root, at);
        index.type_of(analysis.root, at);
        index.definition(analysis.root, at);
        references(&[], &index, analysis.root, at, true);
        let _ = rename(&[], &index, analysis.root, at, "other");
    }
    for at in (0..=LAB.len()).step_by(61).filter(|at| LAB.is_char_boundary(*at)) {
        let (analysis, index) = analysed("cook.mtx", &LAB[..at], &Files::default());
        complete(&index, analysis.root, &LAB[..at], at);
        index.about(analysis.root, at.saturating_sub(1));
    }
}

#[test]
fn strange_texts_are_answered() {
    for text in [
        "",
        "\u{feff}mtx 1",
        "é",
        "\"",
        "{{{{",
        "}}}}",
        "mtx 1\nlab µ {°} 😀 \r\n a.b.c[",
        "mtx 1\nuse ::::",
        "$",
        "note \"{",
    ] {
        let (analysis, index) = analysed("a.mtx", text, &Files::default());
        for at in 0..=text.len() + 3 {
            complete(&index, analysis.root, text, at);
            signature(&index, analysis.root, text, at);
            index.about(analysis.root, at);
        }
    }
}
