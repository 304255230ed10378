//! The tables as Parquet, read back.

use std::fs::{self, File};
use std::path::Path;

use matterix_ir::model::Domain;
use matterix_runtime::record::parquet as tables;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};

use super::fixture;

/// Reads a table by way of a file, as others do.
fn rows(name: &str, bytes: &[u8]) -> Vec<Row> {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, bytes).expect("written");
    let reader = SerializedFileReader::new(File::open(path).expect("a file")).expect("a table");
    reader.get_row_iter(None).expect("rows").map(|r| r.expect("a row")).collect()
}

fn field<'r>(row: &'r Row, name: &str) -> &'r Field {
    row.get_column_iter().find(|(found, _)| *found == name).map(|(_, field)| field).expect("the field")
}

#[test]
fn every_point_of_every_column_is_a_row_in_the_unit_shown() {
    let lab = fixture::lab();
    let mut out = Vec::new();
    tables::states(&lab.run(), &mut out).expect("memory");
    let rows = rows("states.parquet", &out);
    for (state, series) in lab.program.model.states.iter().zip(&lab.recording.states) {
        let own: Vec<&Row> = rows.iter().filter(|r| *field(r, "column") == Field::Str(state.name.clone())).collect();
        assert_eq!(own.len(), series.points().count(), "{}", state.name);
        for (row, (time, value)) in own.iter().zip(series.points()) {
            assert_eq!(*field(row, "time [s]"), Field::Double(time));
            match &state.domain {
                Domain::Quantity(unit) => {
                    assert_eq!(*field(row, "value"), Field::Double(unit.of_si(value)));
                    assert_eq!(*field(row, "unit"), Field::Str(unit.symbol.clone()));
                    assert_eq!(*field(row, "word"), Field::Null);
                }
                _ => assert_eq!(*field(row, "value"), Field::Null),
            }
        }
    }
    let last = rows.iter().rfind(|r| *field(r, "column") == Field::Str("beaker.support".into())).expect("a row");
    assert_eq!(*field(last, "word"), Field::Str("hotplate".into()));
    assert!(rows.iter().any(|r| *field(r, "column") == Field::Str("beaker.contents.color.3".into())));
}

#[test]
fn records_are_as_in_the_text() {
    let lab = fixture::lab();
    let mut out = Vec::new();
    tables::records(&lab.run(), &mut out).expect("memory");
    let rows = rows("records.parquet", &out);
    assert_eq!(rows.len(), 201);
    let first: Vec<String> = rows[0].get_column_iter().map(|(name, field)| format!("{name} {field}")).collect();
    assert_eq!(first, ["time [s] 0E0", "record \"probe\"", "component 1", "value 25.0", "unit \"degC\""]);
}
