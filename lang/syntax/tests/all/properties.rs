//! Any text is read without a panic; findings point into it; what is read can be formatted.

use matterix_ir::FileId;
use matterix_syntax::fmt::format;
use matterix_syntax::{decode, dump, parse};
use proptest::prelude::*;

use crate::{generator, spec::spec_files};

/// A text as pieces: words, blanks, texts, comments and single signs.
fn pieces(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let class = |c: char| (c.is_alphanumeric() || c == '_', c == ' ');
        let len = match class(first) {
            (false, false) => first.len_utf8(),
            kind => rest.find(|c| class(c) != kind).unwrap_or(rest.len()),
        };
        let (piece, tail) = rest.split_at(len);
        pieces.push(piece);
        rest = tail;
    }
    pieces
}

/// Checks everything that holds for any text.
fn check(text: &str) -> Result<(), TestCaseError> {
    let (tree, found) = parse(FileId(0), text);
    for finding in &found {
        for span in
            finding.labels.iter().map(|l| l.span).chain(finding.fixes.iter().flat_map(|f| &f.edits).map(|e| e.span))
        {
            prop_assert!(text.get(span.start as usize..span.end as usize).is_some(), "{finding:?} in {text:?}");
        }
    }
    let before = dump(&tree);
    match format(FileId(0), text) {
        Err(refused) => prop_assert_eq!(refused, found, "{:?}", text),
        Ok(formatted) => {
            prop_assert_eq!(&found, &[]);
            let (tree, found) = parse(FileId(0), &formatted);
            prop_assert_eq!(found, [], "{:?}", formatted);
            prop_assert_eq!(dump(&tree), before, "{:?}", formatted);
            prop_assert_eq!(format(FileId(0), &formatted), Ok(formatted));
        }
    }
    Ok(())
}

#[derive(Clone, Debug)]
enum Mutation {
    Delete,
    Duplicate,
    Swap(usize),
    Insert(&'static str),
}

const INSERTS: &[&str] = &[
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    "\"",
    "\n",
    " ",
    ",",
    ";",
    ":",
    "=",
    "==",
    "+",
    "-",
    "->",
    "..",
    "'",
    "^",
    "of ",
    " to ",
    " in ",
    " not ",
    "3",
    "2 g",
    "µ",
    "°C",
    "\u{a0}",
    "\0",
    "// c\n",
    "/// d\n",
    "/*",
    "else",
    "on",
    "let ",
    "workflow",
    "\r\n",
    "\t",
    "K+",
    "\n}\n",
    "\nlab x {\n",
];

fn mutation() -> impl Strategy<Value = Mutation> {
    prop_oneof![
        Just(Mutation::Delete),
        Just(Mutation::Duplicate),
        any::<usize>().prop_map(Mutation::Swap),
        prop::sample::select(INSERTS).prop_map(Mutation::Insert),
    ]
}

/// A phase is tight: with a blank in it, a species would look like a call, and the formatter takes the blank out.
#[test]
fn a_loose_phase_is_no_call() {
    let file = |key: &str| format!("mtx 1\n\nworkflow w in l {{\n    let x = m.amount[{key}]\n}}\n");
    assert_eq!(parse(FileId(0), &file("Parac(s)")).1, []);
    for key in ["Parac( s)", "Parac(\ts)", "Parac(s )", "Parac(\ns)", "Parac(\n aq\n)"] {
        assert_eq!(parse(FileId(0), &file(key)).1.len(), 1, "{key:?}");
    }
    assert_eq!(parse(FileId(0), &file("Parac(x)")).1, []);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_files_are_read(which in any::<usize>(), mutations in prop::collection::vec((any::<usize>(), mutation()), 1..6)) {
        let files = spec_files();
        let text = &files[which % files.len()].1;
        let mut pieces = pieces(text);
        for (at, mutation) in mutations {
            let at = at % pieces.len();
            match mutation {
                Mutation::Delete => drop(pieces.remove(at)),
                Mutation::Duplicate => pieces.insert(at, pieces[at]),
                Mutation::Swap(with) => {
                    let with = with % pieces.len();
                    pieces.swap(at, with);
                }
                Mutation::Insert(text) => pieces.insert(at, text),
            }
        }
        check(&pieces.concat())?;
    }

    #[test]
    fn blanks_and_comments_are_layout(
        which in any::<usize>(),
        changes in prop::collection::vec((any::<usize>(), prop::sample::select(&["  ", "\t", "\n", "\n\n\n", " // a note\n", "// b\n// c\n", "\r\n"][..])), 1..12),
    ) {
        let files = spec_files();
        let text = &files[which % files.len()].1;
        let mut pieces = pieces(text);
        for (at, insert) in changes {
            // Behind a blank or a line end nothing is torn apart.
            let places: Vec<usize> = (0..pieces.len()).filter(|i| pieces[*i].trim().is_empty()).collect();
            pieces.insert(places[at % places.len()] + 1, insert);
        }
        check(&pieces.concat())?;
    }

    #[test]
    fn soup_of_pieces_is_read(soup in prop::collection::vec(prop::sample::select(INSERTS), 0..60), head in any::<bool>()) {
        check(&format!("{}{}", if head { "mtx 1\nworkflow w in l {\n" } else { "" }, soup.concat()))?;
    }

    #[test]
    fn bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(text) = decode(&bytes) {
            check(&text)?;
        }
        check(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn generated_files_have_no_mistakes(text in generator::file()) {
        let (_, found) = parse(FileId(0), &text);
        prop_assert_eq!(found, [], "{}", text);
        check(&text)?;
    }
}
