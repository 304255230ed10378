//! Types of a feature as types and units of the language.

use matterix_sila::Feature;
use matterix_sila::feature::{Basic, Constraints, DataType, SiUnit};

use crate::units::{Resolved, Units};

/// Symbols of the base units, in the order in which the standard names them.
const SYMBOLS: [&str; 8] = ["", "m", "kg", "s", "A", "K", "mol", "cd"];

/// Two factors are the same within this.
const CLOSE: f64 = 1e-9;

/// What a parameter is given.
pub(super) struct Given {
    /// Of the option.
    pub ty: String,
    /// What stands in the text that is sent.
    pub piece: String,
    /// What must hold.
    pub needs: Vec<String>,
}

/// What is told.
pub(super) struct Told {
    /// Of the reading.
    pub ty: String,
    /// What stands in braces in the reply.
    pub unit: String,
}

/// Types of one feature.
pub(super) struct Types<'f> {
    feature: &'f Feature,
    units: &'f Units,
    capability: String,
    /// Units that the library does not have, with their declarations.
    declared: Vec<(SiUnit, String, String)>,
}

/// A unit as the language has it.
struct Counted {
    ty: String,
    unit: String,
}

impl<'f> Types<'f> {
    pub fn new(feature: &'f Feature, units: &'f Units, capability: &str) -> Self {
        Types { feature, units, capability: capability.to_owned(), declared: Vec::new() }
    }

    /// Units that are declared beside the capability.
    pub fn declarations(&self) -> String {
        self.declared.iter().map(|(_, _, line)| format!("{line}\n")).collect()
    }

    /// The basic type behind a type, with what constrains it.
    fn basic(&self, ty: &DataType) -> Result<(Basic, Constraints), String> {
        let of = self.feature.resolved(ty).ok_or("is of a type that is not defined")?;
        match of {
            DataType::Basic(basic) => Ok((*basic, Constraints::default())),
            DataType::Constrained(inner, outer) => {
                let (basic, inner) = self.basic(inner)?;
                Ok((basic, outer.over(&inner)))
            }
            DataType::Identifier(_) => self.basic(of),
            DataType::List(_) => Err("is a list".to_owned()),
            DataType::Structure(_) => Err("is a structure".to_owned()),
        }
    }

    /// A parameter of a command.
    pub fn given(&mut self, option: &str, ty: &DataType) -> Result<Given, String> {
        let (basic, constraints) = self.basic(ty)?;
        let plain = |ty: &str, piece: String| Given { ty: ty.to_owned(), piece, needs: Vec::new() };
        Ok(match basic {
            Basic::Boolean => plain("Bool", format!("{{{option}}}")),
            Basic::String if constraints.set.len() > 1 => {
                if let Some(word) = constraints.set.iter().find(|w| !matterix_syntax::is_name(w)) {
                    return Err(format!("may be `{word}`, which is not a name of the language"));
                }
                plain(&constraints.set.join(" | "), format!("{{{option}}}"))
            }
            // Moments are written as texts: `2026-11-23+01:00`.
            Basic::String | Basic::Date | Basic::Time | Basic::Timestamp => {
                plain("Text", format!("\\\"{{{option}}}\\\""))
            }
            // The path of a file with the bytes.
            Basic::Binary => plain("Text", format!("file \\\"{{{option}}}\\\"")),
            Basic::Real | Basic::Integer => {
                let whole = basic == Basic::Integer;
                let (ty, unit, piece) = match &constraints.unit {
                    None if whole => ("Int".to_owned(), String::new(), format!("{{{option}}}")),
                    None => ("Ratio".to_owned(), String::new(), format!("{{{option}}}")),
                    Some(unit) => {
                        let counted = self.counted(unit)?;
                        let digits = if whole { " :.0" } else { "" };
                        let piece = format!("{{{option} as {}{digits}}}", counted.unit);
                        (counted.ty, format!(" {}", counted.unit), piece)
                    }
                };
                let bound = |bound: Option<(f64, bool)>, than: &str| {
                    let (number, out) = bound?;
                    let (sign, size) = (if number < 0.0 { "-" } else { "" }, number.abs());
                    Some(format!("{option} {than}{} {sign}{size}{unit}", if out { "" } else { "=" }))
                };
                let needs = [bound(constraints.least, ">"), bound(constraints.greatest, "<")];
                Given { ty, piece, needs: needs.into_iter().flatten().collect() }
            }
            Basic::Any => return Err(format!("is of type {}", basic.name())),
        })
    }

    /// A property or an answer.
    pub fn told(&mut self, ty: &DataType) -> Result<Told, String> {
        let (basic, constraints) = self.basic(ty)?;
        let unit = constraints.unit;
        Ok(match (basic, unit) {
            (Basic::Real | Basic::Integer, Some(unit)) => {
                let Counted { ty, unit } = self.counted(&unit)?;
                Told { ty, unit }
            }
            (Basic::Real | Basic::Integer | Basic::Boolean, None) => {
                Told { ty: "Ratio".to_owned(), unit: String::new() }
            }
            (other, _) => return Err(format!("is of type {}", other.name())),
        })
    }

    /// A unit of the standard as one of the language; one is declared where there is none like it.
    fn counted(&mut self, of: &SiUnit) -> Result<Counted, String> {
        let symbol = symbol(of);
        if symbol.is_empty() && of.factor == 1.0 && of.offset == 0.0 {
            return Err(format!("is counted in `{}`, which does not define a quantity", of.label));
        }
        let si = self.units.resolve(&symbol).map_err(|_| format!("is counted in `{}`", of.label))?;
        let is_it = |unit: &Resolved| {
            let unit = &unit.unit;
            (unit.factor - of.factor).abs() <= CLOSE * of.factor.abs()
                && (unit.offset - of.offset).abs() <= CLOSE * of.offset.abs()
        };
        let names = std::iter::once(of.label.clone()).chain(std::iter::once(symbol.clone()));
        let names = names.chain(self.units.unit_names().map(str::to_owned));
        let found = names.filter_map(|n| self.units.resolve(&n).ok()).find(|u| u.dimension == si.dimension && is_it(u));
        // A temperature is a point also where it is counted in kelvins.
        let point = found.as_ref().is_some_and(|u| u.point) || of.offset != 0.0 || symbol == "K";
        let ty = self.units.dimension_name(&si.dimension, point).or(self.units.dimension_name(&si.dimension, false));
        let ty = ty
            .ok_or_else(|| format!("is counted in `{}`, for which the language has no quantity", of.label))?
            .to_owned();
        if let Some(found) = found {
            return Ok(Counted { ty, unit: found.unit.symbol.clone() });
        }
        if of.offset != 0.0 {
            return Err(format!("is counted in `{}`, for which the language has no such scale", of.label));
        }
        if let Some((_, name, _)) = self.declared.iter().find(|(unit, ..)| unit == of) {
            return Ok(Counted { ty, unit: name.clone() });
        }
        let name = format!("{}_unit{}", self.capability, (b'a' + self.declared.len().min(25) as u8) as char);
        let line = format!("/// `{}`.\nunit {name}: {ty} = {} {symbol}", of.label.replace('\n', " "), of.factor);
        self.declared.push((of.clone(), name.clone(), line));
        Ok(Counted { ty, unit: name })
    }
}

/// A product of base units: `kg*m/s^2`.
fn symbol(of: &SiUnit) -> String {
    let power = |base: usize, exponent: i32| match exponent {
        1 => SYMBOLS[base].to_owned(),
        n => format!("{}^{n}", SYMBOLS[base]),
    };
    let over: Vec<String> = of.components.iter().filter(|(_, e)| *e > 0).map(|(b, e)| power(*b, *e)).collect();
    let under: Vec<String> = of.components.iter().filter(|(_, e)| *e < 0).map(|(b, e)| power(*b, -e)).collect();
    match (over.join("*"), under.as_slice()) {
        (over, []) => over,
        (over, [one]) => format!("{}/{one}", if over.is_empty() { "1" } else { over.as_str() }),
        (over, many) => format!("{}/({})", if over.is_empty() { "1" } else { over.as_str() }, many.join("*")),
    }
}
