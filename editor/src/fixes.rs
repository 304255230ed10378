//! Corrections that findings offer.

use matterix_ir::{Diagnostic, Edit, FileId, Fix};

use crate::Analysis;

/// The findings whose cause a range of a file touches, with their corrections.
pub fn fixes_at(analysis: &Analysis, file: FileId, start: usize, end: usize) -> Vec<(&Diagnostic, &Fix)> {
    let touched = analysis.findings.iter().filter(|finding| {
        let span = finding.span();
        span.file == file && span.start as usize <= end && start <= span.end as usize
    });
    touched
        .flat_map(|finding| finding.fixes.iter().map(move |fix| (finding, fix)))
        .filter(|(_, fix)| ours(analysis, fix))
        .collect()
}

/// The edits of all findings in a file that have just one correction, which leaves no doubt; of those that would meet
/// the first.
pub fn all_fixes(analysis: &Analysis, file: FileId) -> Vec<&Edit> {
    let mut edits: Vec<&Edit> = Vec::new();
    for finding in analysis.findings.iter().filter(|finding| finding.span().file == file) {
        let Some(fix) = finding.sure_fix() else { continue };
        let apart = |edit: &Edit| {
            edits
                .iter()
                .all(|o| o.span.file != edit.span.file || o.span.end < edit.span.start || edit.span.end < o.span.start)
        };
        if ours(analysis, fix) && fix.edits.iter().all(apart) {
            edits.extend(&fix.edits);
        }
    }
    edits
}

/// Whether a correction changes nothing but texts of the user's.
fn ours(analysis: &Analysis, fix: &Fix) -> bool {
    fix.edits.iter().all(|edit| analysis.module(edit.span.file).is_some_and(|module| !module.is_library()))
}
