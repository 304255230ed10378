//! Dimensions and units. The compiler knows the SI prefixes; every unit is declared in the library.

mod called;
pub mod dimension;
pub mod text;

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::{Span, Unit};

pub(crate) use called::called;
pub use dimension::{Dimension, Rational};

/// What a declared dimension name stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DimensionDef {
    /// The dimension.
    pub dimension: Dimension,
    /// A point on a scale (a temperature), of which only differences are quantities.
    pub point: bool,
    /// Its declaration.
    pub span: Span,
}

/// A declared unit.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitDef {
    /// The dimension of a difference.
    pub dimension: Dimension,
    /// SI value of one unit.
    pub factor: f64,
    /// SI value of its zero, for a unit of a point scale.
    pub offset: Option<f64>,
    /// Whether it takes SI prefixes.
    pub prefixes: bool,
    /// What it is called, where its documentation begins like `The litre, ...`: `litre`.
    pub called: Option<Arc<str>>,
    /// Its declaration.
    pub span: Span,
}

/// A unit as used: resolved and ready to convert.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolved {
    /// The dimension of a difference.
    pub dimension: Dimension,
    /// Whether a literal in this unit is a point.
    pub point: bool,
    /// For conversion and display.
    pub unit: Arc<Unit>,
}

/// Every dimension and unit in scope; units have one name space.
#[derive(Clone, Debug, Default)]
pub struct Units {
    bases: Vec<String>,
    dimensions: BTreeMap<String, DimensionDef>,
    units: BTreeMap<String, UnitDef>,
    base_units: BTreeMap<u16, String>,
}

/// SI prefixes with their names, both micro signs and `u`; SI brochure, 9th edition, table 7.
const PREFIXES: &[(&str, &str, f64)] = &[
    ("da", "deca", 1e1),
    ("Q", "quetta", 1e30),
    ("R", "ronna", 1e27),
    ("Y", "yotta", 1e24),
    ("Z", "zetta", 1e21),
    ("E", "exa", 1e18),
    ("P", "peta", 1e15),
    ("T", "tera", 1e12),
    ("G", "giga", 1e9),
    ("M", "mega", 1e6),
    ("k", "kilo", 1e3),
    ("h", "hecto", 1e2),
    ("d", "deci", 1e-1),
    ("c", "centi", 1e-2),
    ("m", "milli", 1e-3),
    ("u", "micro", 1e-6),
    ("µ", "micro", 1e-6),
    ("μ", "micro", 1e-6),
    ("n", "nano", 1e-9),
    ("p", "pico", 1e-12),
    ("f", "femto", 1e-15),
    ("a", "atto", 1e-18),
    ("z", "zepto", 1e-21),
    ("y", "yocto", 1e-24),
    ("r", "ronto", 1e-27),
    ("q", "quecto", 1e-30),
];

impl Units {
    /// Declares a new base dimension.
    pub fn add_base(&mut self, name: &str, span: Span) {
        let index = self.bases.len() as u16;
        self.bases.push(name.to_string());
        let def = DimensionDef { dimension: Dimension::base(index), point: false, span };
        self.dimensions.insert(name.to_string(), def);
    }

    /// Declares a name for a dimension.
    pub fn add_dimension(&mut self, name: &str, def: DimensionDef) {
        self.dimensions.insert(name.to_string(), def);
    }

    /// Declares a unit; the first of factor 1 becomes the symbol of its base dimension.
    pub fn add_unit(&mut self, name: &str, def: UnitDef) {
        if def.factor == 1.0 && def.offset.is_none() {
            for index in 0..self.bases.len() as u16 {
                if def.dimension == Dimension::base(index) {
                    self.base_units.entry(index).or_insert_with(|| name.to_string());
                }
            }
        }
        self.units.insert(name.to_string(), def);
    }

    /// The dimension with this name.
    pub fn dimension(&self, name: &str) -> Option<&DimensionDef> {
        self.dimensions.get(name)
    }

    /// The declared unit with this name, without prefix.
    pub fn declared(&self, name: &str) -> Option<&UnitDef> {
        self.units.get(name)
    }

    /// Names of all dimensions.
    pub fn dimension_names(&self) -> impl Iterator<Item = &str> {
        self.dimensions.keys().map(String::as_str)
    }

    /// Names of all units, without prefixes.
    pub fn unit_names(&self) -> impl Iterator<Item = &str> {
        self.units.keys().map(String::as_str)
    }

    /// A unit name with or without prefix: definition and prefix factor.
    pub fn find(&self, name: &str) -> Option<(&UnitDef, f64)> {
        if let Some(def) = self.units.get(name) {
            return Some((def, 1.0));
        }
        PREFIXES.iter().find_map(|&(prefix, _, factor)| {
            let rest = name.strip_prefix(prefix)?;
            let def = self.units.get(rest)?;
            def.prefixes.then_some((def, factor))
        })
    }

    /// The dimension in words: its declared name with its unit, or the unit alone.
    pub fn describe(&self, dimension: &Dimension, point: bool) -> String {
        if dimension.is_any() {
            return "an unknown quantity".into();
        }
        if dimension.is_one() {
            return "a plain number".into();
        }
        let unit = self.symbol(dimension);
        match self.dimension_name(dimension, point) {
            Some(name) => format!("{name} ({unit})"),
            None => unit,
        }
    }

    /// The shortest declared name of a dimension.
    pub fn dimension_name(&self, dimension: &Dimension, point: bool) -> Option<&str> {
        self.dimensions
            .iter()
            .filter(|(_, d)| d.point == point && d.dimension == *dimension)
            .map(|(n, _)| n.as_str())
            .min_by_key(|n| n.len())
    }

    /// The SI symbol of a dimension: a declared unit of factor 1, or a product of base units.
    pub fn symbol(&self, dimension: &Dimension) -> String {
        let named = self.units.iter().find(|(_, u)| u.factor == 1.0 && u.offset.is_none() && u.dimension == *dimension);
        if let Some((name, _)) = named {
            return name.clone();
        }
        let base = |base: u16| self.base_units.get(&base).cloned().unwrap_or_else(|| self.bases[base as usize].clone());
        // `W/K` says more than `m^2*kg/(s^3*K)`: a named unit over base units, where that is shorter.
        let plain = dimension.show(base);
        let mut best = plain.clone();
        for (name, unit) in self.units.iter().filter(|(_, u)| u.factor == 1.0 && u.offset.is_none()) {
            let rest = dimension.over(&unit.dimension).show(base);
            if unit.dimension.is_one() || !rest.starts_with("1/") {
                continue;
            }
            let text = format!("{name}{}", &rest[1..]);
            if text.len() < best.len() {
                best = text;
            }
        }
        best
    }

    /// The symbols of base units with their exponents; nothing where one is not whole.
    pub fn in_bases(&self, dimension: &Dimension) -> Option<Vec<(String, i32)>> {
        let power = |(base, exponent): (u16, Rational)| {
            let symbol = self.base_units.get(&base)?.clone();
            (exponent.den == 1).then_some((symbol, exponent.num))
        };
        if dimension.is_any() { None } else { dimension.powers().iter().copied().map(power).collect() }
    }

    /// The percent unit of a fraction, in which fractions are shown.
    pub fn percent(&self, dimension: &Dimension) -> Option<Unit> {
        let mut percents = self.units.range("%".to_string()..).take_while(|(n, _)| n.starts_with('%'));
        let (name, def) = percents.find(|(_, u)| u.dimension == *dimension && u.factor == 0.01)?;
        Some(Unit::scaled(name.clone(), def.factor))
    }

    /// The SI unit of a dimension, for display.
    pub fn si(&self, dimension: &Dimension) -> Unit {
        if dimension.is_one() { Unit::one() } else { Unit::scaled(self.symbol(dimension), 1.0) }
    }
}

impl Units {
    /// A declared point unit of a dimension to show points in: the one with an offset, by name.
    pub fn preferred_point(&self, dimension: &Dimension) -> Option<Unit> {
        self.units
            .iter()
            .find(|(_, u)| u.dimension == *dimension && u.factor == 1.0 && u.offset.is_some_and(|o| o != 0.0))
            .map(|(n, u)| Unit { symbol: n.clone(), factor: u.factor, offset: u.offset.unwrap_or(0.0) })
    }

    /// The units that differ from one only by an SI prefix for small amounts: `L`, `mL`, `uL`, `nL` for any of them.
    pub fn prefixed(&self, unit: &Resolved) -> Vec<Unit> {
        let alike = |(name, def): &(&String, &UnitDef)| {
            let prefix = unit.unit.symbol.strip_suffix(name.as_str());
            let known = |p: &str| p.is_empty() || PREFIXES.iter().any(|(q, _, _)| *q == p);
            def.prefixes && def.dimension == unit.dimension && prefix.is_some_and(known)
        };
        let Some((name, _)) = self.units.iter().find(alike) else { return Vec::new() };
        let known = ["", "m", "u", "n"].iter().filter_map(|p| self.resolve(&format!("{p}{name}")).ok());
        known.map(|r| Arc::unwrap_or_clone(r.unit)).collect()
    }

    /// How a found dimension differs from the expected one, where one named quantity makes the difference.
    pub fn hint(&self, found: &Dimension, expected: &Dimension) -> Option<String> {
        if found.times(expected).is_one() {
            return Some("it is inverted: write `1 / ...`".into());
        }
        let missing = expected.over(found);
        if let Some(name) = self.dimension_name(&missing, false) {
            return Some(format!("multiply it by a {name} ({})", self.symbol(&missing)));
        }
        let name = self.dimension_name(&found.over(expected), false)?;
        Some(format!("divide it by a {name} ({})", self.symbol(&found.over(expected))))
    }
}

impl Units {
    /// The dimension with this name, or one that agrees with everything where the library lacks it.
    pub fn named(&self, name: &str) -> Dimension {
        self.dimension(name).map_or_else(Dimension::any, |d| d.dimension.clone())
    }
}
