//! Tables, and the files of a run.

use std::fs;
use std::path::PathBuf;

use matterix_ir::model::Domain;
use matterix_runtime::record::{self, Outputs, Report, table};

use super::fixture;

fn read(bytes: &[u8]) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_reader(bytes);
    let head = reader.headers().expect("head").iter().map(str::to_owned).collect();
    let rows = reader.records().map(|r| r.expect("row").iter().map(str::to_owned).collect()).collect();
    (head, rows)
}

#[test]
fn the_table_reads_back_to_the_last_bit() {
    let lab = fixture::lab();
    let mut out = Vec::new();
    table::states(&lab.run(), &mut out).expect("memory");
    let (head, rows) = read(&out);
    assert_eq!(
        head[..5],
        ["time [s]", "hotplate.temperature [degC]", "hotplate.target [degC]", "hotplate.active", "beaker.support"]
    );
    assert!(head.contains(&"beaker.contents.color.3".to_owned()), "{head:?}");
    let samples = fixture::samples();
    // Before 2 s all rests.
    assert_eq!(rows.len(), samples.len() - 2);
    for row in &rows {
        let time: f64 = row[0].parse().expect("a time");
        let sample = samples.iter().find(|sample| sample.time == time).expect("it was sampled");
        for (state, value) in lab.program.model.states.iter().zip(sample.states) {
            let at = head
                .iter()
                .position(|h| *h == state.name || h.starts_with(&format!("{} [", state.name)))
                .expect("column");
            match &state.domain {
                Domain::Quantity(unit) => {
                    assert_eq!(row[at].parse::<f64>(), Ok(unit.of_si(value)), "{}", state.name)
                }
                Domain::Bool => assert_eq!(row[at], if value == 1.0 { "true" } else { "false" }),
                Domain::Enum(words) => assert_eq!(row[at], words[value as usize]),
                Domain::Instance => assert_eq!(row[at], if value == 1.0 { "hotplate" } else { "table" }),
            }
        }
    }
}

#[test]
fn names_with_commas_are_quoted_and_nothing_is_said_so() {
    let mut lab = fixture::lab();
    lab.program.model.states[3].name = "near(a, \"b\")".into();
    lab.recording.states[3] = fixture::series(&[(0.0, -1.0), (8.0, 1.0)]);
    let mut out = Vec::new();
    table::states(&lab.run(), &mut out).expect("memory");
    let (head, rows) = read(&out);
    assert_eq!((head[4].as_str(), rows[0][4].as_str()), ("near(a, \"b\")", "nothing"));
}

#[test]
fn records_are_in_long_form() {
    let lab = fixture::lab();
    let mut out = Vec::new();
    table::records(&lab.run(), &mut out).expect("memory");
    let (head, rows) = read(&out);
    assert_eq!(head, ["time [s]", "record", "component", "value", "unit"]);
    assert_eq!(rows[0], ["0", "probe", "1", "25", "degC"]);
    assert_eq!(rows.len(), 201);
}

fn scratch(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn all_files_are_written_whole_and_alike() {
    let lab = fixture::lab();
    let report = Report::new(&lab.run());
    let [first, second] = ["first", "second"].map(|name| {
        let dir = scratch(&format!("record-{name}"));
        let paths = record::write_all(&dir, &lab.run(), &report, Outputs::ALL).expect("written");
        let names: Vec<_> =
            paths.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned()).collect();
        assert_eq!(
            names,
            [
                "recording.mcap",
                "states.parquet",
                "records.parquet",
                "states.csv",
                "records.csv",
                "plot.svg",
                "report.json",
            ]
        );
        assert_eq!(fs::read_dir(&dir).expect("folder").count(), names.len(), "nothing else is left");
        paths.iter().map(|p| fs::read(p).expect("file")).collect::<Vec<_>>()
    });
    assert!(first == second);
}

#[test]
fn an_error_names_the_file() {
    let lab = fixture::lab();
    let report = Report::new(&lab.run());
    let dir = scratch("record-blocked");
    fs::create_dir_all(dir.join("report.json")).expect("folder");
    let outputs = Outputs { recording: false, tables: false, csv: false, plot: false };
    let error = record::write_all(&dir, &lab.run(), &report, outputs).expect_err("a folder is in the way");
    assert!(error.path.ends_with("report.json"));
    assert!(error.to_string().starts_with("cannot write `"));
    assert_eq!(fs::read_dir(&dir).expect("folder").count(), 1, "the partial file is gone");
}
