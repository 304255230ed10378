//! The module that a database makes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use matterix_ir::FileId;
use matterix_ir::equilibrium::STANDARD;
use matterix_lang::chem::Formula;
use matterix_lang::syntax::fmt::format;

use super::Wanted;
use super::database::{Database, Entry};
use super::names::{self, Library};
use crate::{Imported, LeftOut, Mistake};

/// The pressure at which molar volumes hold, bar.
const PRESSURE: f64 = 1.013_25;

/// cm3*bar/cal, and the Born coefficient of water at 25 degC, 1/bar (Johnson, Oelkers and Helgeson, Comput. Geosci. 18 (1992) 899).
const CALORIES: f64 = 41.84;
const BORN: f64 = 5.903e-7;

/// Writes the module; `title` is how it calls the database.
pub fn module(database: &Database, title: &str, wanted: &Wanted) -> Result<Imported, Mistake> {
    let mut writer = Writer { library: Library::read(), ..Writer::default() };
    writer.dissolved(database, wanted);
    writer.solids(database, wanted);
    writer.interactions(database, wanted);
    for (line, keyword) in &database.others {
        writer.leave_out(*line, keyword, "blocks of this kind are not imported");
    }
    writer.left_out.sort_by_key(|left| left.line);
    let text = writer.text(title);
    let text = format(FileId(0), &text).map_err(|found| {
        let why = found.first().map_or_else(String::new, |d| d.headline.clone());
        Mistake { line: 0, why: format!("the written file cannot be read: {why}") }
    })?;
    Ok(Imported { text, left_out: writer.left_out, files: Vec::new() })
}

#[derive(Default)]
struct Writer {
    library: Library,
    /// By the name in the database, that in the language.
    known: BTreeMap<String, String>,
    species: String,
    equilibria: String,
    solids: String,
    interactions: String,
    /// Species of the library without numbers for their activity, which the database has.
    without_activity: Vec<String>,
    left_out: Vec<LeftOut>,
}

impl Writer {
    fn leave_out(&mut self, line: usize, name: &str, why: impl Into<String>) {
        self.left_out.push(LeftOut { line, name: name.to_owned(), why: why.into() });
    }

    fn dissolved(&mut self, database: &Database, wanted: &Wanted) {
        // A species may be used before it is defined.
        let defined = database.species.iter().filter(|entry| entry.name != "e-");
        let declared: Vec<&Entry> = defined.filter(|entry| self.declare(entry, wanted)).collect();
        for entry in declared.into_iter().filter(|entry| !entry.is_master()) {
            if entry.species().any(|s| s == "e-") {
                self.leave_out(entry.line, &entry.name, "its reaction contains electrons");
                continue;
            }
            let Some(sides) = self.sides(entry, None) else { continue };
            let name = format!("forms_{}", names::word(&entry.name));
            if let Some(item) = self.equilibrium(&name, &sides, entry) {
                self.equilibria.push_str(&item);
            }
        }
    }

    /// Declares the species that an entry defines, where the library has none; false where it cannot be had.
    fn declare(&mut self, entry: &Entry, wanted: &Wanted) -> bool {
        let Some(formula) = names::formula(&entry.name) else {
            self.leave_out(entry.line, &entry.name, "its formula contains symbols that are not elements");
            return false;
        };
        if !is_wanted(&formula, wanted) {
            return false;
        }
        if formula.to_string() == "H2O" {
            self.known.insert(entry.name.clone(), "water".to_owned());
            return true;
        }
        if let Some(known) = self.library.get(&formula) {
            if entry.gamma.is_some() && !known.has_activity {
                self.without_activity.push(known.name.clone());
            }
            self.known.insert(entry.name.clone(), known.name.clone());
            return true;
        }
        let name = names::dissolved(&entry.name);
        let volume = round(if entry.volume.is_empty() { 0.0 } else { apparent_volume(&entry.volume) }, 2);
        let mut more = String::new();
        if let Some((size, slope)) = entry.gamma {
            if size > 0.0 && formula.charge != 0 {
                let _ = writeln!(more, "    ion_size: {} nm", number(round(size * 0.1, 6)));
            }
            let _ = writeln!(more, "    salting: {}", number(slope));
        }
        let head = format!("Line {} of the database", entry.line);
        self.species.push_str(&species(&head, &name, &entry.name, volume, &more));
        self.known.insert(entry.name.clone(), name);
        true
    }

    fn solids(&mut self, database: &Database, wanted: &Wanted) {
        for phase in &database.phases {
            if phase.name.ends_with("(g)") {
                self.leave_out(phase.line, &phase.name, "it is a gas");
                continue;
            }
            if !wanted.phases.contains(&phase.name) {
                self.leave_out(phase.line, &phase.name, "it is not among the requested phases");
                continue;
            }
            let Some((_, text)) = phase.sides[0].first() else { continue };
            if names::formula(text).is_none() {
                self.leave_out(phase.line, &phase.name, "its formula contains symbols that are not elements");
                continue;
            }
            let solid = format!("{}(s)", names::word(&phase.name));
            let Some(sides) = self.sides(phase, Some((text, &solid))) else { continue };
            let Some(item) = self.equilibrium(&format!("{}_dissolves", names::word(&phase.name)), &sides, phase) else {
                continue;
            };
            let volume = phase.volume.first().copied().unwrap_or(0.0);
            let head = format!("{}, line {} of the database", phase.name, phase.line);
            self.solids.push_str(&species(&head, &solid, text, volume, ""));
            self.solids.push_str(&item);
        }
    }

    fn interactions(&mut self, database: &Database, wanted: &Wanted) {
        for (line, name) in &database.interactions.unread {
            self.leave_out(*line, name, "this option of the block PITZER is not imported");
        }
        for interaction in &database.interactions.found {
            let unknown = interaction.species.iter().find(|s| !self.known.contains_key(*s));
            if let Some(unknown) = unknown {
                if wanted.elements.is_empty() {
                    let name = interaction.species.join(" ");
                    self.leave_out(interaction.line, &name, format!("`{unknown}` is not imported"));
                }
                continue;
            }
            let written: Vec<&str> = interaction.species.iter().map(|s| self.known[s].as_str()).collect();
            let name: Vec<String> = interaction.species.iter().map(|s| names::word(s)).collect();
            let terms = |terms: &[f64]| match terms {
                [one] => number(*one),
                many => list(many),
            };
            let mut fields: Vec<String> =
                interaction.numbers.iter().map(|(key, of)| format!("{key}: {}", terms(of))).collect();
            if !interaction.reach.is_empty() {
                fields.push(format!("reach: {}", terms(&interaction.reach)));
            }
            let _ = writeln!(
                self.interactions,
                "interaction between_{}: {} {{ {} }}",
                name.join("_"),
                written.join(" + "),
                fields.join(", ")
            );
        }
    }

    /// Both sides of a reaction in names of the language, one of them given; none where one is not known.
    fn sides(&mut self, entry: &Entry, given: Option<(&str, &str)>) -> Option<String> {
        let mut sides = [Vec::new(), Vec::new()];
        let mut unknown = None;
        for (from, to) in entry.sides.iter().zip(&mut sides) {
            for (count, text) in from {
                let name = match given {
                    Some((of, name)) if of == text => name,
                    _ => match self.known.get(text) {
                        Some(name) => name,
                        None => {
                            unknown = Some(text.clone());
                            continue;
                        }
                    },
                };
                to.push((*count, name.to_owned()));
            }
        }
        if let Some(text) = unknown {
            self.leave_out(entry.line, &entry.name, format!("`{text}` is not imported"));
            return None;
        }
        // What is taken away on one side is added on the other.
        let [left, right] = sides;
        let (mut out, mut other): (Vec<_>, Vec<_>) = (Vec::new(), Vec::new());
        let mut sort = |side: Vec<(f64, String)>, is_left: bool| {
            for (count, name) in side {
                let here = if (count > 0.0) == is_left { &mut out } else { &mut other };
                here.push((count.abs(), name));
            }
        };
        sort(left, true);
        sort(right, false);
        let joined = |side: Vec<(f64, String)>| {
            let term = |(count, name): &(f64, String)| match *count == 1.0 {
                true => name.clone(),
                false => format!("{} {name}", number(*count)),
            };
            side.iter().map(term).collect::<Vec<_>>().join(" + ")
        };
        Some(format!("{} <-> {}", joined(out), joined(other)))
    }

    fn equilibrium(&mut self, name: &str, sides: &str, entry: &Entry) -> Option<String> {
        if let Some(option) = &entry.unread {
            self.leave_out(entry.line, &entry.name, format!("`-{option}` is not imported"));
            return None;
        }
        let constant = match (&entry.analytic[..], entry.log_k) {
            ([], None) => {
                self.leave_out(entry.line, &entry.name, "it has no constant");
                return None;
            }
            ([], Some(log_k)) => {
                let enthalpy = entry.enthalpy.map(|h| format!(", enthalpy: {} kJ/mol", number(round(h * 1e-3, 6))));
                format!("log_constant: {}{}", number(log_k), enthalpy.unwrap_or_default())
            }
            (terms, _) => {
                format!("analytic: {}", list(terms))
            }
        };
        Some(format!("/// Line {} of the database.\nequilibrium {name}: {sides} {{ {constant} }}\n\n", entry.line))
    }

    fn text(&self, title: &str) -> String {
        let mut out = String::from("mtx 1\n");
        let _ = writeln!(
            out,
            "//! Equilibria of {title}, a database of PHREEQC (Parkhurst and Appelo, U.S. Geological Survey).\n//!"
        );
        out.push_str("//! Constants are at 25 degC and an ionic strength of 0. A species that the library lacks has the volume of the\n");
        out.push_str("//! database, or none if the database gives none; its heat capacity counts as 0, because the database has none.\n");
        if !self.without_activity.is_empty() {
            let names: BTreeSet<&String> = self.without_activity.iter().collect();
            let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
            out.push_str(
                "//!\n//! The database has activity coefficients of these species, but the library does not:\n",
            );
            let mut line = String::from("//!");
            for name in names {
                if line.len() + name.len() > 110 {
                    out.push_str(&line);
                    out.push('\n');
                    line = String::from("//!");
                }
                let _ = write!(line, " {name}");
            }
            out.push_str(&line);
            out.push('\n');
        }
        out.push('\n');
        for (head, part) in [
            ("dissolved species", &self.species),
            ("equilibria", &self.equilibria),
            ("solids", &self.solids),
            ("interactions", &self.interactions),
        ] {
            if !part.is_empty() {
                let _ = write!(out, "// ---- {head}\n\n{part}");
            }
        }
        out
    }
}

/// An item of a species, its formula as the database writes it and its volume in mL/mol, with further lines.
fn species(head: &str, name: &str, formula: &str, volume: f64, more: &str) -> String {
    format!(
        "/// {head}.\nspecies {name} {{\n    formula: \"{}\"\n    molar_volume: {} mL/mol\n    heat_capacity: 0 J/(mol*K)\n{more}}}\n\n",
        names::written(formula),
        number(volume)
    )
}

/// Whether all elements of a species are wanted.
fn is_wanted(formula: &Formula, wanted: &Wanted) -> bool {
    let always = |e: &String| e == "H" || e == "O";
    wanted.elements.is_empty() || names::elements(formula).iter().all(|e| always(e) || wanted.elements.contains(e))
}

/// Molar volume at infinite dilution, mL/mol, at 25 degC and 1 atm, by the terms of Helgeson, Kirkham and Flowers as PHREEQC has them.
pub fn apparent_volume(terms: &[f64]) -> f64 {
    let of = |i: usize| terms.get(i).copied().unwrap_or(0.0);
    let (pressure, warm) = (2600.0 + PRESSURE, STANDARD - 228.0);
    let structure = of(0) * 0.1 + of(1) * 100.0 / pressure + of(2) / warm + of(3) * 1e4 / (pressure * warm);
    CALORIES * (structure - of(4) * 1e5 * BORN)
}

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    (value * scale).round() / scale
}

/// Numbers as the language lists them.
fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
}

/// A number as the language writes it.
fn number(value: f64) -> String {
    let value = if value == 0.0 { 0.0 } else { value };
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-4..1e7).contains(&size) => format!("{value:e}"),
        _ => format!("{value}"),
    }
}
