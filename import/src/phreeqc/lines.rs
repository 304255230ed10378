//! The lines of a database.

/// A line without its comment, or the part of one between semicolons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'t> {
    /// Its number in the file, from 1.
    pub number: usize,
    /// Trimmed, and not empty.
    pub text: &'t str,
}

/// All lines that say something.
pub fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.lines().enumerate().flat_map(|(i, line)| {
        let said = line.split('#').next().unwrap_or_default();
        said.split(';').map(str::trim).filter(|text| !text.is_empty()).map(move |text| Line { number: i + 1, text })
    })
}

impl<'t> Line<'t> {
    /// The keyword that begins a block: `SOLUTION_SPECIES`.
    pub fn keyword(self) -> Option<&'t str> {
        let word = self.text.split_whitespace().next()?;
        let is_keyword = |c: char| c.is_ascii_uppercase() || c == '_';
        (word.len() > 2 && word.chars().all(is_keyword)).then_some(word)
    }

    /// The name of an option and the rest of the line: `-log_k -14`, or `log_k -14`.
    pub fn option(self) -> Option<(String, &'t str)> {
        let (word, rest) = self.text.split_once(char::is_whitespace).unwrap_or((self.text, ""));
        let bare = word.strip_prefix('-').filter(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()));
        let name = bare.unwrap_or(word).to_ascii_lowercase();
        (bare.is_some() || KNOWN.contains(&name.as_str())).then(|| (name, rest.trim()))
    }
}

/// Options, which stand without a dash too.
const KNOWN: &[&str] = &[
    "log_k",
    "logk",
    "delta_h",
    "deltah",
    "analytic",
    "analytical",
    "analytical_expression",
    "a_e",
    "gamma",
    "llnl_gamma",
    "co2_llnl_gamma",
    "add_logk",
    "add_constant",
    "vm",
    "dw",
    "viscosity",
    "millero",
    "activity_water",
    "erm_ddl",
    "no_check",
    "check",
    "mole_balance",
    "mass_balance",
    "t_c",
    "p_c",
    "omega",
];
