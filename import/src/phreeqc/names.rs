//! Species of a database by the names of the language.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::FileId;
use matterix_lang::ast::{ExprKind, Field, FieldValue, ItemKind};
use matterix_lang::chem::Formula;
use matterix_lang::library;

/// The species of the library that can be dissolved in water, by formula.
#[derive(Default)]
pub struct Library {
    by_formula: BTreeMap<String, Known>,
}

/// A species of the library.
#[derive(Clone, Debug)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Whether it has a size in the law of Debye and Hueckel, or another number of the law of activity.
    pub has_activity: bool,
}

impl Library {
    /// Reads the species of the library.
    pub fn read() -> Library {
        let mut by_formula = BTreeMap::new();
        for (index, module) in library::MODULES.iter().enumerate() {
            if module.name != "std::species" {
                continue;
            }
            let (file, _) = library::read(index, FileId(u32::MAX));
            for item in &file.items {
                let ItemKind::Species { name, fields } = &item.kind else { continue };
                let has = |key: &str| fields.iter().any(|f| f.key.text == key);
                // A salt, acid or base that splits is not what is dissolved, nor is a pure solid.
                if has("dissolves") || has("same_as") || name.text.ends_with("(s)") {
                    continue;
                }
                if let Some(formula) = formula_of(fields) {
                    let known = Known { name: name.text.clone(), has_activity: has("ion_size") || has("salting") };
                    by_formula.entry(formula.to_string()).or_insert(known);
                }
            }
        }
        Library { by_formula }
    }

    /// The species with a formula.
    pub fn get(&self, formula: &Formula) -> Option<&Known> {
        self.by_formula.get(&formula.to_string())
    }
}

fn formula_of(fields: &[Field]) -> Option<Formula> {
    let field = fields.iter().find(|f| f.key.text == "formula")?;
    let FieldValue::Expr(e) = &field.value else { return None };
    let ExprKind::Text(text) = &*e.kind else { return None };
    Formula::parse(text).ok()
}

/// The formula of a species as a database writes it: `Ca+2`, `CaSO4:2H2O`; none of what has other symbols than those of elements with
/// a molar mass, and of the electron.
pub fn formula(text: &str) -> Option<Formula> {
    Formula::parse(&written(text)).ok().filter(|formula| formula.molar_mass().is_ok())
}

/// The same with the charge where the language has it: `Ca^2+`.
pub fn written(text: &str) -> String {
    let (body, charge) = parts(text);
    let body = body.replace(':', ".");
    let sign = if charge < 0 { '-' } else { '+' };
    match charge.unsigned_abs() {
        0 => body,
        1 if body.ends_with(|c: char| c.is_ascii_digit()) => format!("{body}^{sign}"),
        1 => format!("{body}{sign}"),
        n => format!("{body}^{n}{sign}"),
    }
}

/// What stands before the charge, and the charge: `Ca+2`, `Fe+++`.
fn parts(text: &str) -> (&str, i32) {
    let digits = text.len() - text.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let (signed, number) = text.split_at(text.len() - digits);
    let Some(sign) = signed.chars().last().filter(|c| matches!(c, '+' | '-')) else { return (text, 0) };
    let body = signed.trim_end_matches(sign);
    let signs = (signed.len() - body.len()) as i32;
    let count = number.parse().unwrap_or(signs);
    (body, if sign == '-' { -count } else { count })
}

/// The elements of a formula.
pub fn elements(formula: &Formula) -> BTreeSet<String> {
    formula.elements.keys().map(|e| e.symbol().to_owned()).collect()
}

/// A name for a dissolved species that the library has not: its formula without brackets, `FeO2H2+`, and `(aq)` where it has no charge.
pub fn dissolved(text: &str) -> String {
    let (body, charge) = parts(text);
    let body = flat(body);
    let sign = if charge < 0 { '-' } else { '+' };
    let is_element = body.chars().skip(1).all(|c| c.is_ascii_lowercase());
    match charge.unsigned_abs() {
        0 => format!("{body}(aq)"),
        1 => format!("{body}{sign}"),
        // As the library has `Ca2+`, and `CO3^2-`.
        n if is_element => format!("{body}{n}{sign}"),
        n => format!("{body}^{n}{sign}"),
    }
}

/// Brackets opened: `Fe(OH)2` is `FeO2H2`.
fn flat(body: &str) -> String {
    let mut out = String::new();
    let mut rest = body;
    while let Some(open) = rest.find('(') {
        out.push_str(&rest[..open]);
        let Some(close) = rest[open..].find(')').map(|at| open + at) else { break };
        let inside = &rest[open + 1..close];
        let after = &rest[close + 1..];
        let digits = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let times: u32 = after[..digits].parse().unwrap_or(1);
        out.push_str(&multiplied(inside, times));
        rest = &after[digits..];
    }
    out.push_str(rest);
    out.chars().filter(char::is_ascii_alphanumeric).collect()
}

/// `OH` twice is `O2H2`.
fn multiplied(inside: &str, times: u32) -> String {
    let mut out = String::new();
    let mut chars = inside.chars().peekable();
    while let Some(c) = chars.next() {
        out.push(c);
        while let Some(c) = chars.next_if(char::is_ascii_lowercase) {
            out.push(c);
        }
        let mut digits = String::new();
        while let Some(c) = chars.next_if(char::is_ascii_digit) {
            digits.push(c);
        }
        match digits.parse().unwrap_or(1) * times {
            1 => {}
            n => out.push_str(&n.to_string()),
        }
    }
    out
}

/// A name that the language takes, of letters, digits and underscores.
pub fn word(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '+' => out.push_str("_plus"),
            '-' => out.push_str("_minus"),
            c if c.is_ascii_alphanumeric() => out.push(c),
            _ if out.ends_with('_') => {}
            _ => out.push('_'),
        }
    }
    let out = out.trim_end_matches('_').to_owned();
    if out.starts_with(|c: char| c.is_ascii_digit()) { format!("n{out}") } else { out }
}
