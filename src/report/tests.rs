//! Every shape of finding in every form, against `tests/golden`; `MATTERIX_UPDATE=1` rewrites the files.

use std::fs;
use std::path::Path;

use matterix_ir::{Diagnostic, Sources, Span, codes};

use super::{Format, Look, Reporter};

const PLAIN: Look = Look { color: false, width: 80 };

const RECIPE: &str = "mtx 1
use std::heating::IkaRetControl

lab bench {
    ambient: 25 degC
    plate = IkaRetControl { gain: 70 W/degC }
}

workflow warm in bench {
\theat plate to 20 µL
    wait 5
}
";

const LIBRARY: &str = "/// A device that heats.
capability Heater {
    param gain: ThermalConductance
    command heat to(t: Temperature)
}
";

/// A text and the findings in it.
struct Case {
    sources: Sources,
    found: Vec<Diagnostic>,
}

impl Case {
    fn new(name: &str, text: &str) -> Self {
        let mut sources = Sources::default();
        sources.add(name, text);
        Case { sources, found: Vec::new() }
    }

    /// The `nth` place, from 0, where `part` stands in a file.
    fn at(&self, file: u32, part: &str, nth: usize) -> Span {
        let id = matterix_ir::FileId(file);
        let text = &self.sources.get(id).unwrap().text;
        let start = text.match_indices(part).nth(nth).unwrap().0;
        Span::new(id, start, start + part.len())
    }

    fn with(mut self, found: Diagnostic) -> Self {
        self.found.push(found);
        self
    }

    fn render(&self, format: Format, look: Look) -> String {
        let mut reporter = Reporter::new(format, look);
        let body = reporter.render(&self.sources, self.found.clone());
        body + &reporter.summary()
    }

    /// Compares all three forms with the golden file.
    fn golden(&self, name: &str) {
        let forms = [Format::Human, Format::Concise, Format::Json].map(|f| self.render(f, PLAIN));
        compare(name, &forms.join("--------\n"));
    }
}

fn compare(name: &str, actual: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.txt"));
    if std::env::var_os("MATTERIX_UPDATE").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, actual).unwrap();
    }
    let expected = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(expected == actual, "{} differs; it is now\n{actual}", path.display());
}

#[test]
fn one_label_with_help_and_fix() {
    let case = Case::new("warm.mtx", RECIPE);
    let unit = case.at(0, "W/degC", 0);
    let found = Diagnostic::error(
        codes::UNSUPPORTED,
        unit,
        "`degC` cannot be part of a derived unit",
        "a point, not a difference",
    )
    .help(
        "a temperature in degC has an offset, so a rate per degree is written with K; both degrees have the same size",
    )
    .fix("write the unit with K", unit, "W/K");
    case.with(found).golden("one_label");
}

#[test]
fn history_in_the_same_file() {
    let case = Case::new("warm.mtx", RECIPE);
    let (verb, volume, lab) = (case.at(0, "heat", 1), case.at(0, "20 µL", 0), case.at(0, "plate", 0));
    let found = Diagnostic::error(codes::SYNTAX, volume, "`to` of `heat` is a temperature, not a volume", "a volume")
        .because(verb, "this command takes a temperature")
        .because(lab, "`plate` is declared here");
    case.with(found).golden("history");
}

#[test]
fn labels_in_several_files() {
    let mut case = Case::new("warm.mtx", RECIPE);
    case.sources.add("std::heating", LIBRARY);
    let (volume, declared) = (case.at(0, "20 µL", 0), case.at(1, "t: Temperature", 0));
    let found = Diagnostic::error(codes::SYNTAX, volume, "`to` of `heat` is a temperature, not a volume", "a volume")
        .because(declared, "declared as a temperature");
    case.with(found).golden("several_files");
}

#[test]
fn several_findings_are_sorted_and_counted_once() {
    let case = Case::new("warm.mtx", RECIPE);
    let bare = case.at(0, "5", 1);
    let late = Diagnostic::error(codes::SYNTAX, bare, "`wait` needs a time", "a plain number").fix(
        "insert a unit",
        Span { start: bare.end, ..bare },
        " s",
    );
    let early =
        Diagnostic::warning(codes::UNSUPPORTED, case.at(0, "ambient", 0), "`ambient` is not used", "never read");
    case.with(late.clone()).with(late).with(early).golden("several");
}

#[test]
fn labels_on_one_line() {
    let case = Case::new("warm.mtx", RECIPE);
    let (device, volume) = (case.at(0, "plate", 1), case.at(0, "20 µL", 0));
    let found = Diagnostic::error(codes::SYNTAX, volume, "a volume cannot be a set point", "a volume")
        .because(device, "takes a temperature")
        .because(volume, "read as 2e-8 m³");
    case.with(found).golden("one_line");
}

#[test]
fn a_label_inside_another() {
    let case = Case::new("warm.mtx", RECIPE);
    let (call, volume) = (case.at(0, "heat plate to 20 µL", 0), case.at(0, "20 µL", 0));
    let found = Diagnostic::error(codes::SYNTAX, call, "this step cannot be done", "needs a temperature")
        .because(volume, "this is a volume");
    case.with(found).golden("nested");
}

#[test]
fn a_block_of_lines() {
    let case = Case::new("warm.mtx", RECIPE);
    let block = case.at(0, "lab bench {\n    ambient: 25 degC\n    plate = IkaRetControl { gain: 70 W/degC }\n}", 0);
    let found = Diagnostic::warning(codes::SYNTAX, block, "the lab has no table", "all of its instances");
    case.with(found).golden("block");
    let all = Span::new(matterix_ir::FileId(0), 6, RECIPE.len());
    let case = Case::new("warm.mtx", RECIPE);
    case.with(Diagnostic::error(codes::SYNTAX, all, "nothing here is right", "from here on")).golden("long_block");
}

#[test]
fn an_insertion_at_the_end() {
    let text = "workflow warm in bench {\n    wait 5 s\n";
    let end = Span::new(matterix_ir::FileId(0), text.len(), text.len());
    let found = Diagnostic::error(codes::SYNTAX, end, "a `}` is missing", "expected `}` before the end of the file")
        .because(Span::new(end.file, 23, 24), "this `{` is never closed")
        .fix("close the block", end, "}\n");
    Case::new("open.mtx", text).with(found.clone()).golden("end_of_file");

    let text = text.trim_end();
    let end = Span::new(end.file, text.len(), text.len());
    let mut found = found;
    found.labels[0].span = end;
    found.fixes[0].edits[0].span = end;
    Case::new("open.mtx", text).with(found).golden("end_without_newline");
}

#[test]
fn an_empty_file() {
    let found = Diagnostic::error(codes::SYNTAX, Span::default(), "the file is empty", "expected `mtx 1`");
    Case::new("empty.mtx", "").with(found).golden("empty_file");
}

#[test]
fn carriage_returns_and_tabs() {
    let case = Case::new("dos.mtx", "mtx 1\r\n\r\nlab bench {\r\n\t\tplate\t= IkaRet {\tgain: 5 µW }\r\n}\r\n");
    let found = Diagnostic::error(codes::SYNTAX, case.at(0, "5 µW", 0), "`gain` is a conductance", "a power")
        .because(case.at(0, "plate", 0), "of this plate");
    case.with(found).golden("crlf_tabs");
}

#[test]
fn wide_characters() {
    let case = Case::new("wide.mtx", "note \"加熱 the 🧪\" note 5\n");
    let found = Diagnostic::error(codes::SYNTAX, case.at(0, "5", 0), "`note` needs a text", "a number");
    case.with(found).golden("wide");
}

#[test]
fn what_a_terminal_would_obey_is_not_passed_on() {
    let case = Case::new("evil\x1b[2J.mtx", "note \x1b[31mred\x07 \u{202e}back\u{0}\rx 5\n");
    let found = Diagnostic::error(codes::SYNTAX, case.at(0, "5", 0), "odd \x1b[5m text", "a\x1b number");
    let case = case.with(found);
    for format in [Format::Human, Format::Concise] {
        let shown = case.render(format, PLAIN);
        assert!(!shown.chars().any(|c| c.is_control() && c != '\n' || c == '\u{202e}'), "{shown:?}");
    }
}

#[test]
fn a_long_line_is_named_only() {
    let case = Case::new("garbage.mtx", &format!("mtx 1\n{}5\n", "x".repeat(100_000)));
    let found = Diagnostic::error(codes::SYNTAX, case.at(0, "5", 0), "this is no item", "expected an item");
    case.with(found).golden("long_line");
}

#[test]
fn places_outside_the_text_do_no_harm() {
    let wild = [(0, 900, 1000), (0, 8, 3), (7, 0, 4), (0, u32::MAX, u32::MAX)];
    for (file, start, end) in wild {
        let span = Span { file: matterix_ir::FileId(file), start, end };
        for text in ["", "µ", "a\nb", "\r\n\r\n"] {
            let found =
                Diagnostic::error(codes::SYNTAX, span, "wild", "here").because(span, "there").fix("mend", span, "x");
            let case = Case::new("wild.mtx", text).with(found);
            for format in [Format::Human, Format::Concise, Format::Json] {
                assert!(case.render(format, PLAIN).contains("wild"));
            }
        }
    }
}

#[test]
fn every_span_of_a_text_can_be_shown() {
    let text = "a µ\r\n\n\tb\r c\n";
    for start in 0..=text.len() + 1 {
        for end in start..=text.len() + 1 {
            let found = Diagnostic::error(codes::SYNTAX, Span::new(matterix_ir::FileId(0), start, end), "here", "this");
            let shown = Case::new("spans.mtx", text).with(found).render(Format::Human, PLAIN);
            assert!(shown.contains("this"), "{start}..{end}:\n{shown}");
        }
    }
}

#[test]
fn colours_only_when_asked_for() {
    let case = Case::new("warm.mtx", RECIPE);
    let found =
        Diagnostic::error(codes::SYNTAX, case.at(0, "20 µL", 0), "a volume", "here").help("write a temperature");
    let case = case.with(found);
    assert!(!case.render(Format::Human, PLAIN).contains('\x1b'));
    let colored = case.render(Format::Human, Look { color: true, ..PLAIN });
    assert!(colored.contains("\x1b[1;31merror[syntax]: \x1b[0m"), "{colored:?}");
}

#[test]
fn many_findings_are_cut_short_for_people_only() {
    let mut case = Case::new("warm.mtx", RECIPE);
    for i in 0..60 {
        let span = Span::new(matterix_ir::FileId(0), i, i + 1);
        case.found.push(Diagnostic::error(codes::SYNTAX, span, format!("finding {i}"), ""));
    }
    assert!(
        case.render(Format::Human, PLAIN).ends_with("... and 10 more; `--format concise` shows all\n\n60 errors\n")
    );
    assert_eq!(case.render(Format::Concise, PLAIN).lines().count(), 61);
    assert_eq!(case.render(Format::Json, PLAIN).lines().count(), 60);
}
