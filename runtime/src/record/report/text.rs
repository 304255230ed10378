//! Aligned tables of text.

use matterix_ir::quantity::show_number;

/// How a column is aligned.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    /// Names.
    Left,
    /// Numbers.
    Right,
}

/// Rows of cells under an optional head.
pub(crate) struct Table {
    columns: Vec<Align>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// No rows yet.
    pub(crate) fn new(columns: &[Align]) -> Self {
        Table { columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row.
    pub(crate) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The rows, indented by two blanks, columns two blanks apart.
    pub(crate) fn print(&self) -> String {
        let width = |c: usize| self.rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut out = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for ((cell, &width), &align) in row.iter().zip(&widths).zip(&self.columns) {
                if width == 0 {
                    continue;
                }
                // Texts may be longer than what a format fills up to.
                let blanks = " ".repeat(width - cell.chars().count());
                match align {
                    Align::Left => line += &format!("  {cell}{blanks}"),
                    Align::Right => line += &format!("  {blanks}{cell}"),
                }
            }
            out += line.trim_end();
            out.push('\n');
        }
        out
    }
}

/// A number and its unit.
pub(crate) fn quantity(value: f64, unit: &str) -> String {
    if unit.is_empty() { show_number(value) } else { format!("{} {unit}", show_number(value)) }
}

/// Seconds to a hundredth.
pub(crate) fn seconds(time: f64) -> String {
    format!("{time:.2}")
}

/// Amount of substance in the prefix that suits it.
pub(crate) fn amount(mol: f64) -> String {
    scaled(mol, &[(1.0, "mol"), (1e-3, "mmol"), (1e-6, "µmol"), (1e-9, "nmol")])
}

/// Mass, given in g, in the prefix that suits it.
pub(crate) fn mass(g: f64) -> String {
    scaled(g, &[(1000.0, "kg"), (1.0, "g"), (1e-3, "mg"), (1e-6, "µg")])
}

fn scaled(value: f64, units: &[(f64, &str)]) -> String {
    let smallest = units.last().copied().unwrap_or((1.0, ""));
    if value == 0.0 || value.abs() < smallest.0 * 1e-3 {
        return "0".into();
    }
    // As it will be shown: 999.96 µmol is 1 mmol.
    let shown: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    let (factor, symbol) = units.iter().copied().find(|(f, _)| shown.abs() >= *f).unwrap_or(smallest);
    format!("{} {symbol}", digits(value / factor))
}

/// Four significant digits.
pub(crate) fn digits(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    show_number(rounded)
}
