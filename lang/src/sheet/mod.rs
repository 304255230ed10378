//! Tables: `table plan from csv "plan.csv" { well: Place, volume: Volume as uL }`. The file is read when the text is compiled; each cell
//! becomes an expression that stands in the file, so that what is wrong with it is shown there.

mod cells;
mod csv;

use std::fmt::Write;

use matterix_ir::{Diagnostic, FileId, Sources, Span, codes, hidden};
use sha2::{Digest, Sha256};

use self::csv::{Cell, Record};
use crate::ast::{Column, File, ItemKind, Name, TableRow, TableRows};
use crate::loader::Loader;
use crate::near;
use crate::units::Units;

/// More rows than any plan has: a plate of 1536 wells filled six times.
const MOST_ROWS: usize = 10_000;

/// Findings about one file that are told.
const MOST_TOLD: usize = 10;

/// Whether a module has tables.
pub fn has_tables(tree: &File) -> bool {
    tree.items.iter().any(|item| matches!(item.kind, ItemKind::Table { .. }))
}

/// Reads the file of each table of a module.
pub fn read(
    tree: &mut File,
    from: FileId,
    units: &Units,
    sources: &mut Sources,
    loader: &dyn Loader,
) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut known: Vec<(String, FileId)> = Vec::new();
    for item in &mut tree.items {
        let ItemKind::Table { name, source: (format, path), columns, rows } = &mut item.kind else { continue };
        if format.text != "csv" {
            let headline = format!("a table cannot be read from `{}`", format.text);
            let d = Diagnostic::error(codes::TABLE_FILE, format.span, headline, "not a format for tables");
            found.push(d.help("save it as comma-separated text: `from csv \"plan.csv\"`"));
            continue;
        }
        let text = match loader.file(from, &path.text) {
            Ok(text) => text,
            Err(reason) => {
                let headline = format!("cannot read `{}`: {reason}", path.text);
                let d = Diagnostic::error(codes::TABLE_FILE, path.span, headline, "this file");
                found.push(d.help("paths are relative to the folder of the file given to the command"));
                continue;
            }
        };
        let file = match known.iter().find(|(known, _)| *known == path.text) {
            Some((_, file)) => *file,
            None => {
                let file = sources.add(&path.text, text.clone());
                known.push((path.text.clone(), file));
                file
            }
        };
        let mut sheet = Sheet { text: &text, file, name, path, units, found: Vec::new(), untold: 0 };
        *rows = sheet.rows(columns).map(|rows| Box::new(TableRows { sum: sum(&text), rows }));
        found.extend(sheet.told());
    }
    found
}

/// The SHA-256 of a text, as `sha256sum` writes it.
fn sum(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().fold(String::new(), |mut out, byte| {
        let _ = write!(out, "{byte:02x}");
        out
    })
}

/// A table that is read.
struct Sheet<'t> {
    text: &'t str,
    file: FileId,
    /// The table.
    name: &'t Name,
    /// Its file as named.
    path: &'t Name,
    units: &'t Units,
    found: Vec<Diagnostic>,
    /// How many findings were left out.
    untold: usize,
}

/// Where a column stands in the file, and the unit of its bare numbers.
struct Place {
    index: usize,
    unit: Option<String>,
}

impl Sheet<'_> {
    /// The rows, if all of them can be read.
    fn rows(&mut self, columns: &[Column]) -> Option<Vec<TableRow>> {
        let shown = self.text.trim_start_matches('\u{feff}');
        let before = self.text.len() - shown.len();
        if let Some(mut hidden) = hidden::characters(self.file, shown).into_iter().find(Diagnostic::is_error) {
            hidden.labels.iter_mut().for_each(|label| {
                label.span.start += before as u32;
                label.span.end += before as u32;
            });
            self.found.push(hidden);
            return None;
        }
        let records = match csv::records(self.text) {
            Ok(records) => records,
            Err((at, headline)) => {
                self.wrong(self.span(&at), headline.to_owned(), "this cell", None);
                return None;
            }
        };
        let Some((header, body)) = records.split_first() else {
            let headline = format!("`{}` contains no table", self.path.text);
            let d = Diagnostic::error(codes::TABLE_FILE, self.path.span, headline, "empty");
            self.found.push(d.help("its first row names the columns"));
            return None;
        };
        if body.len() > MOST_ROWS {
            let headline = format!("this table has {} rows; a plan has at most {MOST_ROWS}", body.len());
            self.wrong(self.span(&body[MOST_ROWS].at), headline, "one too many", Some("divide the table".to_owned()));
            return None;
        }
        let places = self.places(columns, header)?;
        let rows: Vec<TableRow> = body.iter().filter_map(|record| self.row(record, header, columns, &places)).collect();
        let is_whole = self.untold == 0 && !self.found.iter().any(Diagnostic::is_error);
        is_whole.then_some(rows)
    }

    /// Where the columns stand.
    fn places(&mut self, columns: &[Column], header: &Record) -> Option<Vec<Place>> {
        if let [only] = header.cells.as_slice()
            && let Some(sign) = [';', '\t'].into_iter().find(|sign| only.text.contains(*sign))
        {
            let sign = if sign == ';' { "semicolons" } else { "tabs" };
            let help = "save it as \"CSV UTF-8 (comma delimited)\", with decimal points";
            self.wrong(
                self.span(&header.at),
                format!("the cells of this table are separated by {sign}"),
                "not by commas",
                Some(help.to_owned()),
            );
            return None;
        }
        let mut places = Vec::new();
        let mut good = true;
        for (i, column) in columns.iter().enumerate() {
            if let Some(first) = columns[..i].iter().find(|c| c.name.text == column.name.text) {
                let headline = format!("two columns have the name `{}`", column.name.text);
                let d = Diagnostic::error(codes::DUPLICATE_NAME, column.name.span, headline, "declared again");
                self.found.push(d.because(first.name.span, "declared here"));
                good = false;
            }
            match self.place(column, header) {
                Some(place) => places.push(place),
                None => good = false,
            }
        }
        for (index, cell) in header.cells.iter().enumerate() {
            if good && !cell.text.is_empty() && !places.iter().any(|place| place.index == index) {
                let span = self.span(&cell.at);
                let headline = format!("the table `{}` leaves out the column `{}`", self.name.text, cell.text);
                let d = Diagnostic::warning(codes::TABLE_FILE, span, headline, "not declared")
                    .because(self.path.span, "this table");
                let help = match crate::syntax::is_name(&cell.text) {
                    true => format!("declare it, `{}: Text`, or delete it", cell.text),
                    false => format!("declare it, `name \"{}\": Text`, or delete it", cell.text),
                };
                self.found.push(d.help(help));
            }
        }
        good.then_some(places)
    }

    fn place(&mut self, column: &Column, header: &Record) -> Option<Place> {
        let wanted = column.header.as_ref().unwrap_or(&column.name);
        let heads: Vec<(&str, Option<&str>)> = header.cells.iter().map(|cell| self.head(&cell.text)).collect();
        let of = |fits: &dyn Fn(usize) -> bool| (0..heads.len()).filter(|i| fits(*i)).collect::<Vec<usize>>();
        let mut fitting = of(&|i| header.cells[i].text == wanted.text || heads[i].0 == wanted.text);
        if fitting.is_empty() {
            fitting = of(&|i| heads[i].0.eq_ignore_ascii_case(&wanted.text));
        }
        match fitting.as_slice() {
            [] => {
                let headline = format!("`{}` has no column `{}`", self.path.text, wanted.text);
                let d = Diagnostic::error(codes::TABLE_FILE, wanted.span, headline, "not in the table");
                let near = near::nearest(&wanted.text, heads.iter().map(|(name, _)| *name));
                let all: Vec<String> =
                    heads.iter().filter(|(name, _)| !name.is_empty()).map(|(name, _)| format!("`{name}`")).collect();
                let help = match near.first() {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!(
                        "it has {}; a header that is no name is given in quotes: `well \"Dest. well\": Place`",
                        all.join(", ")
                    ),
                };
                self.found.push(d.because(self.span(&header.at), "its first row").help(help));
                None
            }
            [_, second, ..] => {
                let headline = format!("two columns of `{}` are called `{}`", self.path.text, wanted.text);
                let d = Diagnostic::error(codes::TABLE_FILE, self.span(&header.cells[*second].at), headline, "again");
                self.found
                    .push(d.because(wanted.span, "read here").help("delete one of them, or give them different names"));
                None
            }
            [one] => {
                let written = heads[*one].1.map(str::to_owned);
                let asked = column.unit.as_ref().map(|unit| unit.text.clone());
                if let (Some(written), Some(asked)) = (&written, &asked)
                    && !self.is_same_unit(written, asked)
                {
                    let headline =
                        format!("the column `{}` is in `{written}`, but it is read as `{asked}`", wanted.text);
                    let d = Diagnostic::error(
                        codes::TABLE_FILE,
                        self.span(&header.cells[*one].at),
                        headline,
                        "the unit of the column",
                    );
                    let read = column.unit.as_ref().map_or(column.span, |unit| unit.span);
                    self.found.push(d.because(read, "read here").help("the header and `as` must give the same unit"));
                    return None;
                }
                Some(Place { index: *one, unit: asked.or(written) })
            }
        }
    }

    fn is_same_unit(&self, a: &str, b: &str) -> bool {
        let (Ok(a), Ok(b)) = (self.units.resolve(a), self.units.resolve(b)) else { return a == b };
        a.dimension == b.dimension && a.unit.to_si(0.0) == b.unit.to_si(0.0) && a.unit.to_si(1.0) == b.unit.to_si(1.0)
    }

    /// A header without the unit in brackets behind it, and that unit: `volume [uL]`, `Volume (uL)`.
    fn head<'h>(&self, text: &'h str) -> (&'h str, Option<&'h str>) {
        let parts = |open, close| text.strip_suffix(close).and_then(|rest: &str| rest.rsplit_once(open));
        if let Some((name, unit)) = parts('[', ']') {
            return (name.trim_end(), Some(unit.trim()));
        }
        match parts('(', ')') {
            Some((name, unit)) if self.units.resolve(unit.trim()).is_ok() => (name.trim_end(), Some(unit.trim())),
            _ => (text, None),
        }
    }

    fn row(&mut self, record: &Record, header: &Record, columns: &[Column], places: &[Place]) -> Option<TableRow> {
        let span = self.span(&record.at);
        let extra = record.cells.iter().skip(header.cells.len()).any(|cell| !cell.text.is_empty());
        if record.cells.len() < header.cells.len() || extra {
            let (own, all) = (record.cells.len(), header.cells.len());
            let headline = format!("this row has {own} cells, but the first row has {all}");
            let help = "a cell with a comma in it stands in quotes: `\"1,2-dichloroethane\"`";
            self.wrong(span, headline, "this row", Some(help.to_owned()));
            return None;
        }
        let cells: Vec<Option<crate::ast::Expr>> = columns
            .iter()
            .zip(places)
            .map(|(column, place)| self.cell(&record.cells[place.index], column, place))
            .collect();
        Some(TableRow { line: record.line, span, cells })
    }

    fn cell(&mut self, cell: &Cell, column: &Column, place: &Place) -> Option<crate::ast::Expr> {
        let span = self.span(&cell.at);
        if cell.text.is_empty() {
            let is_text =
                column.ty.paths.first().is_some_and(|path| path.segments.len() == 1 && path.segments[0].text == "Text");
            if column.default.is_none() && !is_text {
                let name = &column.name.text;
                let help = format!("fill it in, or say what an empty cell of `{name}` stands for: `{name}: ... = ...`");
                self.wrong(span, format!("this cell of the column `{name}` is empty"), "empty", Some(help));
            }
            if column.default.is_none() {
                return Some(crate::ast::Expr { kind: Box::new(crate::ast::ExprKind::Text(String::new())), span });
            }
            return None;
        }
        match cells::expression(&cell.text, column, place.unit.as_deref(), span) {
            Ok(expression) => Some(expression),
            Err((headline, help)) => {
                self.wrong(span, headline, "this cell", Some(help));
                None
            }
        }
    }

    fn span(&self, at: &std::ops::Range<usize>) -> Span {
        Span::new(self.file, at.start, at.end)
    }

    /// A finding in the file.
    fn wrong(&mut self, span: Span, headline: String, label: &str, help: Option<String>) {
        if self.found.len() >= MOST_TOLD {
            self.untold += 1;
            return;
        }
        let mut d = Diagnostic::error(codes::TABLE_FILE, span, headline, label).because(self.path.span, "this table");
        d.help.extend(help);
        self.found.push(d);
    }

    /// The findings, the last of which says how many more there are.
    fn told(self) -> Vec<Diagnostic> {
        let mut found = self.found;
        if let (1.., Some(last)) = (self.untold, found.last_mut()) {
            last.help.push(format!("{} more cells or rows of this table are wrong", self.untold));
        }
        found
    }
}
