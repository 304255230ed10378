//! The table of a fit's data: comma-separated, a header, a column `time` and one for each match. Lines that begin with
//! `#` are remarks; an empty cell is a value that was not taken.

use std::sync::Arc;

use matterix_ir::study::{DataRow, Fit};
use matterix_ir::{Diagnostic, FileId, Sources, Span, Unit, codes, hidden};

use crate::declare::Tables;
use crate::loader::Loader;
use crate::near;

/// Reads the data of a fit into it.
pub fn read(
    fit: &mut Fit,
    tables: &Tables<'_>,
    sources: &mut Sources,
    loader: &dyn Loader,
) -> Result<(), Box<Diagnostic>> {
    let about = |headline: String, label: &str| Diagnostic::error(codes::DATA_FILE, fit.data_span, headline, label);
    let text = loader.file(fit.data_span.file, &fit.data).map_err(|reason| {
        let d = about(format!("cannot read `{}`: {reason}", fit.data), "named here");
        Box::new(d.help("paths are relative to the folder of the checked file"))
    })?;
    let file = sources.add(&fit.data, text.clone());
    if let Some(hidden) = hidden::characters(file, &text).into_iter().find(Diagnostic::is_error) {
        return Err(Box::new(hidden));
    }
    let table = Table { text: &text, file, named: fit.data_span };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut records = Vec::new();
    for record in reader.records() {
        records.push(record.map_err(|e| Box::new(table.broken(&e)))?);
    }
    let Some((header, body)) = records.split_first() else {
        return Err(Box::new(about(format!("`{}` contains no table", fit.data), "named here")));
    };
    let columns: Vec<Header<'_>> = header.iter().map(Header::of).collect();
    let time = table.time(&columns, header, tables)?;
    let mut matched = Vec::new();
    for m in &fit.matches {
        matched.push(table.column(&columns, header, &m.column, m.column_span, &m.unit)?);
    }
    let mut rows: Vec<DataRow> = Vec::new();
    for record in body {
        let at = table.number(record, time.0)?;
        let Some(at) = at.map(|v| time.1.to_si(v)) else {
            return Err(Box::new(table.at(record, time.0, "this row has no time", "empty")));
        };
        if at < 0.0 {
            return Err(Box::new(table.at(
                record,
                time.0,
                "the time of this row is before the start of the run",
                "negative",
            )));
        }
        let mut values = Vec::new();
        for (m, column) in fit.matches.iter().zip(&matched) {
            values.push(table.number(record, *column)?.map(|v| m.unit.to_si(v)));
        }
        if values.iter().any(Option::is_some) {
            rows.push(DataRow { time: at, values });
        }
    }
    rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    let values = rows.iter().flat_map(|r| &r.values).flatten().count();
    // Where the noise is learnt from what is left over, something must be left over.
    let least = fit.estimates.len() + usize::from(fit.matches.iter().any(|m| m.noise.is_none()));
    if values < least {
        let headline = format!("too few values: {values} values for {} parameters", fit.estimates.len());
        let d = about(headline, "has too few").help(format!("at least {least} values are needed"));
        return Err(Box::new(d));
    }
    fit.rows = rows;
    Ok(())
}

/// A column's name, and the unit behind it in brackets: `time [s]`.
struct Header<'t> {
    whole: &'t str,
    name: &'t str,
    unit: Option<&'t str>,
}

impl<'t> Header<'t> {
    fn of(whole: &'t str) -> Self {
        let parts = whole.strip_suffix(']').and_then(|rest| rest.rsplit_once(" ["));
        let (name, unit) = parts.map_or((whole, None), |(name, unit)| (name.trim_end(), Some(unit)));
        Header { whole, name, unit }
    }
}

/// A table as it was read, for places in it.
struct Table<'t> {
    text: &'t str,
    file: FileId,
    /// Where the file is named.
    named: Span,
}

impl Table<'_> {
    /// The number in a cell; none where it is empty.
    fn number(&self, record: &csv::StringRecord, column: usize) -> Result<Option<f64>, Box<Diagnostic>> {
        let cell = record.get(column).unwrap_or_default();
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => {
                let d = self.at(record, column, &format!("`{cell}` is not a number"), "not a number");
                Err(Box::new(d.help(
                    "use a decimal point, no unit and no thousands separator: `0.913`; leave missing values empty",
                )))
            }
        }
    }

    /// The column of times and its unit.
    fn time(
        &self,
        columns: &[Header<'_>],
        header: &csv::StringRecord,
        tables: &Tables<'_>,
    ) -> Result<(usize, Unit), Box<Diagnostic>> {
        let Some(index) = columns.iter().position(|c| c.name == "time") else {
            let d = self.at(header, 0, "this table has no column `time`", "the first row must name the columns");
            return Err(Box::new(d.help("call it `time`, in seconds, or `time [min]`")));
        };
        let Some(symbol) = columns[index].unit else { return Ok((index, Unit::scaled("s", 1.0))) };
        let duration = tables.units.dimension("Duration").map(|d| d.dimension.clone());
        match tables.unit(symbol) {
            Ok(found) if !found.point && Some(&found.dimension) == duration.as_ref() => {
                Ok((index, Arc::unwrap_or_clone(found.unit)))
            }
            _ => {
                let headline = format!("`{symbol}` is not a unit of time");
                Err(Box::new(self.at(header, index, &headline, "in brackets").help("write `time [s]` or `time [min]`")))
            }
        }
    }

    /// The column of a match.
    fn column(
        &self,
        columns: &[Header<'_>],
        header: &csv::StringRecord,
        wanted: &str,
        asked: Span,
        unit: &Unit,
    ) -> Result<usize, Box<Diagnostic>> {
        let exact: Vec<usize> = (0..columns.len()).filter(|i| columns[*i].whole == wanted).collect();
        let by_name = || (0..columns.len()).filter(|i| columns[*i].name == wanted).collect();
        let found: Vec<usize> = if exact.is_empty() { by_name() } else { exact };
        match found.as_slice() {
            [one] => match columns[*one].unit {
                Some(symbol) if symbol != unit.symbol => {
                    let headline =
                        format!("the column `{wanted}` is in `{symbol}`, but it is read as `{}`", unit.symbol);
                    let d = self.at(header, *one, &headline, "the unit of the column");
                    Err(Box::new(d.because(asked, "read here").help("the header and `as` must give the same unit")))
                }
                _ => Ok(*one),
            },
            [] => {
                let near = near::nearest(wanted, columns.iter().map(|c| c.name));
                let headline = format!("this table has no column `{wanted}`");
                let mut d = Diagnostic::error(codes::DATA_FILE, asked, headline, "not in the table");
                d = d.because(self.named, "the table");
                d.help.extend(near::question(&near));
                if near.is_empty() {
                    let all: Vec<String> = columns.iter().map(|c| format!("`{}`", c.name)).collect();
                    d = d.help(format!("it has {}", all.join(", ")));
                }
                Err(Box::new(d))
            }
            [_, second, ..] => {
                let headline = format!("two columns have the name `{wanted}`");
                Err(Box::new(self.at(header, *second, &headline, "again").because(asked, "used here")))
            }
        }
    }

    /// A finding in a cell.
    fn at(&self, record: &csv::StringRecord, column: usize, headline: &str, label: &str) -> Diagnostic {
        let span = self.cell(record, column);
        Diagnostic::error(codes::DATA_FILE, span, headline, label).because(self.named, "these data")
    }

    /// Where a cell stands: exactly where no cell before it in its row is in quotes, else its row.
    fn cell(&self, record: &csv::StringRecord, column: usize) -> Span {
        let start = record.position().map_or(0, |p| p.byte() as usize);
        let skipped = self.text.get(start..).map_or(0, |rest| rest.len() - rest.trim_start_matches(['\n', '\r']).len());
        let start = start + skipped;
        let row = self.text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or_default();
        let mut from = 0;
        if !row.contains('"') {
            for (i, cell) in row.split(',').enumerate() {
                if i == column && !cell.trim().is_empty() {
                    let lead = cell.len() - cell.trim_start().len();
                    return Span::new(self.file, start + from + lead, start + from + lead + cell.trim().len());
                }
                from += cell.len() + 1;
            }
        }
        Span::new(self.file, start, start + row.len())
    }

    /// A row with too many or too few cells, or none that can be read.
    fn broken(&self, error: &csv::Error) -> Diagnostic {
        let (line, headline) = match error.kind() {
            csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
                let headline = format!("this row has {len} cells, but the first row has {expected_len}");
                (pos.as_ref().map(csv::Position::byte), headline)
            }
            csv::ErrorKind::Utf8 { pos, .. } => (pos.as_ref().map(csv::Position::byte), "this row is not text".into()),
            _ => (None, "this table cannot be read".to_string()),
        };
        let start = line.unwrap_or(0) as usize;
        let rest = self.text.get(start..).unwrap_or_default();
        let start = start + rest.len() - rest.trim_start_matches(['\n', '\r']).len();
        let row = self.text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or_default();
        let span = Span::new(self.file, start, start + row.len());
        Diagnostic::error(codes::DATA_FILE, span, headline, "this row").because(self.named, "these data")
    }
}
