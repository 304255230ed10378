//! Units as one word: `kg/(mol*s)`, `W/(m^2*K)`, `1/s`, `%w/w`, `µL`.

use matterix_ir::Unit;

use super::{Dimension, Rational, Resolved, Units};
use crate::near::nearest;

/// Why a unit could not be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UnitError {
    /// No such unit; with the nearest declared names.
    Unknown {
        /// As written.
        name: String,
        /// Nearest spellings, best first.
        near: Vec<String>,
    },
    /// A point unit (`degC`) inside a derived unit; the fix is the whole text with its difference unit.
    PointInDerived {
        /// The point unit.
        name: String,
        /// The mended text, if the difference has a unit.
        mended: Option<String>,
    },
    /// Not of the form of a unit.
    Malformed,
}

impl Units {
    /// Resolves a unit as written.
    pub fn resolve(&self, text: &str) -> Result<Resolved, UnitError> {
        if let Some((def, factor)) = self.find(text) {
            let unit =
                Unit { symbol: text.to_string(), factor: def.factor * factor, offset: def.offset.unwrap_or(0.0) };
            return Ok(Resolved { dimension: def.dimension.clone(), point: def.offset.is_some(), unit: unit.into() });
        }
        let mut reader = Reader { units: self, text, at: 0 };
        let (dimension, factor) = reader.product()?;
        if reader.at != text.len() {
            return Err(UnitError::Malformed);
        }
        Ok(Resolved { dimension, point: false, unit: Unit::scaled(text, factor).into() })
    }

    fn unknown(&self, name: &str) -> UnitError {
        let mut near = self.known_as(name);
        if near.is_empty() {
            near = nearest(name, self.unit_names().flat_map(|unit| self.spellings(unit, name)));
        }
        UnitError::Unknown { name: name.to_string(), near }
    }

    /// The unit alone and, where it takes them, with the prefixes people use that are a slip away from what was written.
    fn spellings(&self, unit: &str, written: &str) -> Vec<String> {
        let mut out = vec![unit.to_string()];
        if self.units.get(unit).is_some_and(|u| u.prefixes) {
            let prefixed = ["k", "m", "u", "n"].iter().map(|p| format!("{p}{unit}"));
            out.extend(
                prefixed.filter(|p| strsim::damerau_levenshtein(&p.to_lowercase(), &written.to_lowercase()) <= 1),
            );
        }
        out
    }
}

struct Reader<'a> {
    units: &'a Units,
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn eat(&mut self, what: char) -> bool {
        let found = self.rest().starts_with(what);
        if found {
            self.at += what.len_utf8();
        }
        found
    }

    fn product(&mut self) -> Result<(Dimension, f64), UnitError> {
        let mut value = if self.rest().starts_with("1/") {
            self.at += 1;
            (Dimension::one(), 1.0)
        } else {
            self.factor()?
        };
        loop {
            let up = self.rest().starts_with('*');
            if !up && !self.rest().starts_with('/') {
                return Ok(value);
            }
            self.at += 1;
            let (dimension, factor) = self.factor()?;
            value = if up {
                (value.0.times(&dimension), value.1 * factor)
            } else {
                (value.0.over(&dimension), value.1 / factor)
            };
        }
    }

    fn factor(&mut self) -> Result<(Dimension, f64), UnitError> {
        let (dimension, factor) = if self.eat('(') {
            let inner = self.product()?;
            if !self.eat(')') {
                return Err(UnitError::Malformed);
            }
            inner
        } else {
            self.word()?
        };
        match self.exponent()? {
            Some(e) => {
                let power = f64::from(e.num) / f64::from(e.den);
                Ok((dimension.power(e), matterix_ir::math::pow(factor, power)))
            }
            None => Ok((dimension, factor)),
        }
    }

    fn word(&mut self) -> Result<(Dimension, f64), UnitError> {
        let rest = self.rest();
        let end = if rest.starts_with('%') {
            let fraction = rest.char_indices().nth(2).is_some_and(|(_, c)| c == '/');
            if fraction { rest.char_indices().nth(4).map_or(rest.len(), |(i, _)| i) } else { 1 }
        } else {
            rest.find(['*', '/', '(', ')', '^']).unwrap_or(rest.len())
        };
        let name = rest[..end].to_string();
        if name.is_empty() {
            return Err(UnitError::Malformed);
        }
        let Some((def, prefix)) = self.units.find(&name) else { return Err(self.units.unknown(&name)) };
        if def.offset.is_some() {
            let difference = self.units.symbol(&def.dimension);
            let mended = (def.factor == 1.0).then(|| self.text.replace(&name, &difference));
            return Err(UnitError::PointInDerived { name, mended });
        }
        let value = (def.dimension.clone(), def.factor * prefix);
        self.at += end;
        Ok(value)
    }

    fn exponent(&mut self) -> Result<Option<Rational>, UnitError> {
        if !self.eat('^') {
            return Ok(None);
        }
        let sign = if self.eat('-') { -1 } else { 1 };
        let num = self.whole()?;
        let over_digit = self.rest().starts_with('/') && self.rest()[1..].starts_with(|c: char| c.is_ascii_digit());
        let den = if over_digit {
            self.at += 1;
            self.whole()?
        } else {
            1
        };
        if den == 0 {
            return Err(UnitError::Malformed);
        }
        Ok(Some(Rational::new(sign * num, den)))
    }

    fn whole(&mut self) -> Result<i32, UnitError> {
        let digits = self.rest().len() - self.rest().trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let value = self.rest()[..digits].parse::<i32>().ok().filter(|v| *v < 100).ok_or(UnitError::Malformed)?;
        self.at += digits;
        Ok(value)
    }
}
