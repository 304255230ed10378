//! Stretches of a text that can be folded away; they are found without the grammar, so that a mistake moves none of them.

use std::ops::Range;

/// What a stretch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoldKind {
    /// What stands in brackets.
    Body,
    /// Lines of comments.
    Comment,
    /// Lines of imports.
    Imports,
}

/// A stretch of more than one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// From the first byte to behind the last.
    pub range: Range<usize>,
    /// What it is.
    pub kind: FoldKind,
}

/// All stretches of a text, in order.
pub fn folds(text: &str) -> Vec<Fold> {
    let several = |range: &Range<usize>| text.get(range.clone()).is_some_and(|inside| inside.contains('\n'));
    let bodies = matterix_syntax::groups(text).into_iter().map(|range| Fold { range, kind: FoldKind::Body });
    let mut out: Vec<Fold> = bodies.chain(runs(text)).filter(|fold| several(&fold.range)).collect();
    out.sort_by_key(|fold| (fold.range.start, fold.range.end));
    out
}

/// Runs of lines that are comments, or imports.
fn runs(text: &str) -> Vec<Fold> {
    let mut out: Vec<Fold> = Vec::new();
    let mut open: Option<Fold> = None;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let code = line.trim();
        let kind = match () {
            () if code.starts_with("//") => Some(FoldKind::Comment),
            () if code.starts_with("use ") => Some(FoldKind::Imports),
            () => None,
        };
        let first = at + (line.len() - line.trim_start().len());
        let end = at + line.trim_end().len();
        match (&mut open, kind) {
            (Some(fold), Some(kind)) if fold.kind == kind => fold.range.end = end,
            (_, kind) => out.extend(std::mem::replace(&mut open, kind.map(|kind| Fold { range: first..end, kind }))),
        }
        at += line.len();
    }
    out.extend(open);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_comments_and_imports_fold() {
        let text = "mtx 1\nuse a\nuse b\n// one\n// two\nlab x {\n    y = \"{\"\n}\nfn f() = 1 // no {\n";
        let found: Vec<(&str, FoldKind)> = folds(text).into_iter().map(|f| (&text[f.range], f.kind)).collect();
        assert_eq!(
            found,
            [
                ("use a\nuse b", FoldKind::Imports),
                ("// one\n// two", FoldKind::Comment),
                ("{\n    y = \"{\"\n}", FoldKind::Body),
            ]
        );
    }
}
