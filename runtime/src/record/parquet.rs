//! The tables as Parquet, in long form: one row a point of a column, as every column has times of its own.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::column::{Cell, Column};
use super::run::{Run, TOOL};
use super::table::record_units;
use matterix_ir::Unit;

/// Rows of a group at most: what a reader must hold at once.
const ROWS: usize = 1 << 16;

/// Field of both tables that has the time, s.
const TIME: &str = "time [s]";
/// Field of both tables that has a number in the unit beside it; null where it is none.
const VALUE: &str = "value";

/// Every point of every state and observable: its column, unit, time, and a number or a word. Columns follow one another.
pub fn states<W: Write + Send>(run: &Run<'_>, out: W) -> Result<()> {
    let fields =
        [text("column", true), text("unit", true), number(TIME, true), number(VALUE, false), text("word", false)];
    let mut table = Table::new(out, "states", fields, run)?;
    let mut rows = Rows::default();
    for column in Column::all(run) {
        for (part, series) in column.parts.iter().enumerate() {
            let (name, unit) = (ByteArray::from(column.part_name(part).as_str()), ByteArray::from(column.symbol()));
            for (time, value) in series.points() {
                rows.add(&name, &unit, time, column.cell(run, value));
                if rows.times.len() == ROWS {
                    table.states(&std::mem::take(&mut rows))?;
                }
            }
        }
    }
    table.states(&rows)?;
    table.finish()
}

/// One row a recorded number: time, name, component from 1, value, unit.
pub fn records<W: Write + Send>(run: &Run<'_>, out: W) -> Result<()> {
    let component = Type::primitive_type_builder("component", Physical::INT32).with_repetition(Repetition::REQUIRED);
    let fields =
        [number(TIME, true), text("record", true), component.build(), number(VALUE, false), text("unit", true)];
    let mut table = Table::new(out, "records", fields, run)?;
    let (units, plain) = (record_units(run), Unit::one());
    let named: BTreeMap<&str, (ByteArray, &Unit, ByteArray)> = units
        .iter()
        .map(|(name, unit)| (*name, (ByteArray::from(*name), *unit, ByteArray::from(unit.symbol.as_str()))))
        .collect();
    let mut rows = Records::default();
    for entry in run.recording.values.iter() {
        let unknown = || (ByteArray::from(entry.name), &plain, ByteArray::from(""));
        let (name, unit, symbol) = named.get(entry.name).cloned().unwrap_or_else(unknown);
        for (component, value) in (1..).zip(entry.values) {
            rows.times.push(entry.time);
            rows.names.push(name.clone());
            rows.components.push(component);
            rows.values.push(Some(unit.of_si(*value)).filter(|v| !v.is_nan()));
            rows.units.push(symbol.clone());
            if rows.times.len() == ROWS {
                table.records(&std::mem::take(&mut rows))?;
            }
        }
    }
    table.records(&rows)?;
    table.finish()
}

/// Rows that wait to be written, field by field.
#[derive(Default)]
struct Rows {
    columns: Vec<ByteArray>,
    units: Vec<ByteArray>,
    times: Vec<f64>,
    values: Vec<Option<f64>>,
    words: Vec<Option<ByteArray>>,
}

impl Rows {
    fn add(&mut self, column: &ByteArray, unit: &ByteArray, time: f64, cell: Cell<'_>) {
        let (value, word) = match cell {
            Cell::Number(value) => (Some(value).filter(|v| !v.is_nan()), None),
            Cell::Bool(truth) => (None, Some(if truth { "true" } else { "false" })),
            Cell::Name(name) => (None, Some(name)),
        };
        self.columns.push(column.clone());
        self.units.push(unit.clone());
        self.times.push(time);
        self.values.push(value);
        self.words.push(word.map(ByteArray::from));
    }
}

/// Recorded numbers that wait to be written, field by field.
#[derive(Default)]
struct Records {
    times: Vec<f64>,
    names: Vec<ByteArray>,
    components: Vec<i32>,
    values: Vec<Option<f64>>,
    units: Vec<ByteArray>,
}

/// A file under way.
struct Table<W: Write + Send> {
    writer: SerializedFileWriter<W>,
}

impl<W: Write + Send> Table<W> {
    fn new(out: W, name: &str, fields: impl IntoIterator<Item = Result<Type>>, run: &Run<'_>) -> Result<Self> {
        let fields = fields.into_iter().map(|field| field.map(Arc::new)).collect::<Result<Vec<_>>>()?;
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let error = KeyValue::new("error".to_owned(), run.recording.error.to_string());
        let properties = WriterProperties::builder()
            .set_created_by(TOOL.to_owned())
            .set_compression(Compression::SNAPPY)
            .set_column_encoding(VALUE.into(), Encoding::BYTE_STREAM_SPLIT)
            .set_column_encoding(TIME.into(), Encoding::BYTE_STREAM_SPLIT)
            .set_key_value_metadata(Some(vec![error]));
        Ok(Table { writer: SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build()))? })
    }

    /// A group of points.
    fn states(&mut self, rows: &Rows) -> Result<()> {
        if rows.times.is_empty() {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        put::<ByteArrayType, _>(&mut group, &rows.columns, None)?;
        put::<ByteArrayType, _>(&mut group, &rows.units, None)?;
        put::<DoubleType, _>(&mut group, &rows.times, None)?;
        optional::<DoubleType, _>(&mut group, rows.values.iter().copied())?;
        optional::<ByteArrayType, _>(&mut group, rows.words.iter().cloned())?;
        group.close().map(drop)
    }

    /// A group of recorded numbers.
    fn records(&mut self, rows: &Records) -> Result<()> {
        if rows.times.is_empty() {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        put::<DoubleType, _>(&mut group, &rows.times, None)?;
        put::<ByteArrayType, _>(&mut group, &rows.names, None)?;
        put::<Int32Type, _>(&mut group, &rows.components, None)?;
        optional::<DoubleType, _>(&mut group, rows.values.iter().copied())?;
        put::<ByteArrayType, _>(&mut group, &rows.units, None)?;
        group.close().map(drop)
    }

    fn finish(self) -> Result<()> {
        self.writer.close().map(drop)
    }
}

/// The next field of a group: values of those rows whose level is 1, or of all.
fn put<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<()> {
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    column.typed::<T>().write_batch(values, levels, None)?;
    column.close()
}

/// The next field of a group, where rows may have none.
fn optional<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<()> {
    let (mut there, mut levels) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        there.extend(value);
    }
    put::<T, W>(group, &there, Some(&levels))
}

fn repetition(is_required: bool) -> Repetition {
    if is_required { Repetition::REQUIRED } else { Repetition::OPTIONAL }
}

fn text(name: &str, is_required: bool) -> Result<Type> {
    Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
        .with_repetition(repetition(is_required))
        .with_logical_type(Some(LogicalType::String))
        .with_converted_type(ConvertedType::UTF8)
        .build()
}

fn number(name: &str, is_required: bool) -> Result<Type> {
    Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(repetition(is_required)).build()
}
