//! What a database says.

use std::collections::BTreeSet;

use super::lines::{Line, lines};
use super::{Wanted, interactions};
use crate::Mistake;

/// Joules per calorie.
const CALORIE: f64 = 4.184;

/// The most numbers of an analytic expression, or of one that moves with temperature like it.
pub(super) const TERMS: usize = 6;

/// A database.
#[derive(Clone, Debug, Default)]
pub struct Database {
    /// Reactions of dissolved species, in their order.
    pub species: Vec<Entry>,
    /// Phases.
    pub phases: Vec<Entry>,
    /// What acts on each other.
    pub interactions: interactions::Block,
    /// Blocks of other kinds, with the lines where they begin.
    pub others: Vec<(usize, String)>,
}

/// A reaction with what is said of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Of a phase its name, else the species that the reaction defines.
    pub name: String,
    /// The line of its reaction.
    pub line: usize,
    /// Both sides: how many, and of what.
    pub sides: [Vec<(f64, String)>; 2],
    /// log10 of the constant at 25 degC.
    pub log_k: Option<f64>,
    /// J/mol.
    pub enthalpy: Option<f64>,
    /// `log10 K = A1 + A2 T + A3 / T + A4 log10 T + A5 / T^2 + A6 T^2`.
    pub analytic: Vec<f64>,
    /// Ion size in angstrom, and the slope by ionic strength.
    pub gamma: Option<(f64, f64)>,
    /// Molar volumes: of a phase one, of a species the terms of its apparent volume.
    pub volume: Vec<f64>,
    /// Something said of it that is not understood, and changes its constant.
    pub unread: Option<String>,
}

impl Entry {
    /// Whether it defines nothing: a master species.
    pub fn is_master(&self) -> bool {
        self.sides[0] == self.sides[1]
    }

    /// Names of all species of the reaction.
    pub fn species(&self) -> impl Iterator<Item = &str> {
        self.sides.iter().flatten().map(|(_, name)| name.as_str())
    }
}

impl Database {
    /// Every phase that is wanted is there, and every element.
    pub fn has(&self, wanted: &Wanted) -> Result<(), Mistake> {
        let absent = |what: &str, name: &String| Mistake { line: 0, why: format!("it has no {what} `{name}`") };
        if let Some(name) = wanted.phases.iter().find(|name| !self.phases.iter().any(|p| p.name == **name)) {
            return Err(absent("phase", name));
        }
        let known: BTreeSet<String> = self
            .species
            .iter()
            .flat_map(|e| e.species())
            .filter_map(super::names::formula)
            .flat_map(|f| super::names::elements(&f))
            .collect();
        match wanted.elements.iter().find(|name| !known.contains(*name)) {
            Some(name) => Err(absent("element", name)),
            None => Ok(()),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Block {
    Species,
    Phases,
    Pitzer,
    Other,
}

/// Reads a database.
pub fn read(text: &str) -> Result<Database, Mistake> {
    let mut database = Database::default();
    let mut block = Block::Other;
    // The name of a phase whose reaction comes next.
    let mut phase: Option<Line<'_>> = None;
    for line in lines(text) {
        if let Some(keyword) = line.keyword() {
            block = match keyword {
                "SOLUTION_SPECIES" => Block::Species,
                "PHASES" => Block::Phases,
                "PITZER" => Block::Pitzer,
                _ => Block::Other,
            };
            if let Some(law) = ["LLNL_AQUEOUS_MODEL_PARAMETERS", "SIT"].iter().find(|law| **law == keyword) {
                let why = format!("`{law}`: this model of activity is not supported");
                return Err(mistake(line, why));
            }
            if block == Block::Other && !["SOLUTION_MASTER_SPECIES", "END"].contains(&keyword) {
                database.others.push((line.number, keyword.to_owned()));
            }
            phase = None;
            continue;
        }
        let into = match block {
            Block::Species => &mut database.species,
            Block::Phases => &mut database.phases,
            Block::Pitzer => {
                database.interactions.line(line)?;
                continue;
            }
            Block::Other => continue,
        };
        if let Some((name, rest)) = line.option() {
            let Some(entry) = into.last_mut().filter(|_| phase.is_none()) else {
                return Err(mistake(line, "an option comes before the first reaction"));
            };
            option(entry, line, &name, rest)?;
        } else if line.text.contains('=') {
            let name = phase.take();
            if block == Block::Phases && name.is_none() {
                return Err(mistake(line, "the reaction of a phase needs the name of the phase before it"));
            }
            into.push(reaction(line, name)?);
        } else if block == Block::Phases {
            phase = Some(line);
        } else {
            return Err(mistake(line, "neither a reaction nor an option of one"));
        }
    }
    last_of_each(&mut database.species);
    last_of_each(&mut database.phases);
    match database.species.is_empty() && database.phases.is_empty() {
        true => Err(Mistake {
            line: 0,
            why: "it has no block SOLUTION_SPECIES or PHASES: it is not a database of PHREEQC".into(),
        }),
        false => Ok(database),
    }
}

/// What is defined again counts as it is defined last.
fn last_of_each(all: &mut Vec<Entry>) {
    let mut seen = BTreeSet::new();
    all.reverse();
    all.retain(|entry| seen.insert(entry.name.clone()));
    all.reverse();
}

fn mistake(line: Line<'_>, why: impl Into<String>) -> Mistake {
    Mistake { line: line.number, why: why.into() }
}

fn option(entry: &mut Entry, line: Line<'_>, name: &str, rest: &str) -> Result<(), Mistake> {
    match name {
        "log_k" | "logk" => entry.log_k = Some(numbers(line, rest, 1..=1)?[0]),
        "delta_h" | "deltah" => entry.enthalpy = Some(enthalpy(line, rest)?),
        "gamma" => {
            let all = numbers(line, rest, 1..=2)?;
            entry.gamma = Some((all[0], all.get(1).copied().unwrap_or(0.0)));
        }
        "vm" => entry.volume = leading_numbers(rest.split_whitespace()),
        "add_logk" | "add_constant" | "no_check" | "mole_balance" | "mass_balance" => {
            entry.unread = Some(name.to_owned())
        }
        _ if name.starts_with('a') && "analytical_expression".starts_with(name) || name == "a_e" => {
            entry.analytic = numbers(line, rest, 1..=TERMS)?;
        }
        _ => {}
    }
    Ok(())
}

/// What stands after the numbers is a remark of the database.
pub(super) fn leading_numbers<'w>(words: impl IntoIterator<Item = &'w str>) -> Vec<f64> {
    words.into_iter().map_while(|word| word.parse::<f64>().ok().filter(|v| v.is_finite())).collect()
}

fn numbers(line: Line<'_>, rest: &str, count: std::ops::RangeInclusive<usize>) -> Result<Vec<f64>, Mistake> {
    let mut all = leading_numbers(rest.split_whitespace());
    if !count.contains(&all.len()) && all.len() < *count.start() {
        return Err(mistake(line, format!("`{}` lacks a number", line.text)));
    }
    all.truncate(*count.end());
    Ok(all)
}

/// J/mol; kJ where no unit is given.
fn enthalpy(line: Line<'_>, rest: &str) -> Result<f64, Mistake> {
    let number = numbers(line, rest, 1..=1)?[0];
    let unit = rest.split_whitespace().nth(1).unwrap_or("kJ").to_ascii_lowercase();
    let unit = unit.split('/').next().unwrap_or_default();
    let factor = match unit {
        "kj" | "kjoules" => 1e3,
        "j" | "joules" => 1.0,
        "kcal" | "kcalories" => 1e3 * CALORIE,
        "cal" | "calories" => CALORIE,
        other => return Err(mistake(line, format!("`{other}` is not a unit of enthalpy: use kJ, J, kcal or cal"))),
    };
    Ok(number * factor)
}

fn reaction(line: Line<'_>, phase: Option<Line<'_>>) -> Result<Entry, Mistake> {
    let Some((left, right)) = line.text.split_once('=') else { return Err(mistake(line, "no reaction")) };
    let sides = [side(line, left)?, side(line, right)?];
    // A reaction of dissolved species defines the first one on its right, one of a phase the first one on its left.
    let defined = sides[1].first().map(|(_, name)| name.clone());
    let name = match phase {
        Some(line) => line.text.split_whitespace().next().unwrap_or_default().to_owned(),
        None => defined.ok_or_else(|| mistake(line, "a reaction defines no species"))?,
    };
    Ok(Entry {
        name,
        line: line.number,
        sides,
        log_k: None,
        enthalpy: None,
        analytic: Vec::new(),
        gamma: None,
        volume: Vec::new(),
        unread: None,
    })
}

/// `2 H+ + CO3-2`: a sum of species, each with its number.
fn side(line: Line<'_>, text: &str) -> Result<Vec<(f64, String)>, Mistake> {
    let mut all: Vec<(f64, String)> = Vec::new();
    let (mut factor, mut sign) = (1.0, 1.0);
    for word in text.split_whitespace() {
        match word {
            "+" => sign = 1.0,
            "-" => sign = -1.0,
            _ => {
                let digits = word.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(word.len());
                if digits > 0 {
                    factor = word[..digits].parse().map_err(|_| mistake(line, format!("`{word}` is not a number")))?;
                }
                if digits < word.len() {
                    all.push((sign * factor, word[digits..].to_owned()));
                    factor = 1.0;
                }
            }
        }
    }
    match all.is_empty() {
        true => Err(mistake(line, "a side of the reaction is empty")),
        false => Ok(all),
    }
}
