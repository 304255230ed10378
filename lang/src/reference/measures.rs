//! Dimensions with a unit for each: the first that the library declares for it, else one put together by its definition.

use std::collections::BTreeMap;

use crate::ast::{self, Binary, Expr, ExprKind, ItemKind, Type};

use super::Module;
use super::markdown;

/// Units by dimension.
pub struct Measures {
    definitions: BTreeMap<String, Option<Expr>>,
    units: BTreeMap<String, Vec<String>>,
}

/// Units with their powers, in the order in which they come.
type Factors = Vec<(String, i32)>;

impl Measures {
    /// Those that these modules declare.
    pub fn of<'a>(files: impl Iterator<Item = &'a ast::File>) -> Self {
        let (mut definitions, mut units) = (BTreeMap::new(), BTreeMap::<String, Vec<String>>::new());
        for item in files.flat_map(|f| &f.items) {
            match &item.kind {
                ItemKind::Dimension { name, point, definition } => {
                    let definition = definition.clone().filter(|_| !point);
                    definitions.insert(name.text.clone(), definition);
                }
                ItemKind::Unit { name, dimension: Some(dimension), .. } => {
                    units.entry(dimension.text.clone()).or_default().push(name.text.clone());
                }
                _ => {}
            }
        }
        Measures { definitions, units }
    }

    /// A unit in which a quantity of this dimension can be written; none for plain numbers and what is no dimension.
    pub fn unit(&self, dimension: &str) -> Option<String> {
        let factors = self.factors(dimension)?;
        let power = |(unit, n): &(String, i32)| match n.abs() {
            1 => unit.clone(),
            n => format!("{unit}^{n}"),
        };
        let over: Vec<String> = factors.iter().filter(|f| f.1 > 0).map(power).collect();
        let under: Vec<String> = factors.iter().filter(|f| f.1 < 0).map(power).collect();
        let over = if over.is_empty() { "1".to_string() } else { over.join("*") };
        match under.as_slice() {
            [] if factors.is_empty() => None,
            [] => Some(over),
            [one] => Some(format!("{over}/{one}")),
            several => Some(format!("{over}/({})", several.join("*"))),
        }
    }

    /// The unit of a type that is a dimension, a range or a list of one.
    pub fn of_type(&self, ty: &Type) -> Option<String> {
        match (&ty.argument, ty.paths.as_slice()) {
            (Some(inner), _) => self.of_type(inner),
            (None, [path]) => self.unit(&path.segments.last()?.text),
            _ => None,
        }
    }

    fn factors(&self, dimension: &str) -> Option<Factors> {
        let definition = self.definitions.get(dimension)?;
        if let Some(unit) = self.units.get(dimension).and_then(|units| units.first()) {
            return Some(vec![(unit.clone(), 1)]);
        }
        let mut out = Factors::new();
        self.collect(definition.as_ref()?, 1, &mut out)?;
        out.retain(|(_, n)| *n != 0);
        Some(out)
    }

    fn collect(&self, e: &Expr, power: i32, out: &mut Factors) -> Option<()> {
        match &*e.kind {
            ExprKind::Number(_) => Some(()),
            ExprKind::Name(name) => {
                for (unit, n) in self.factors(&name.text)? {
                    match out.iter_mut().find(|(u, _)| *u == unit) {
                        Some(known) => known.1 += n * power,
                        None => out.push((unit, n * power)),
                    }
                }
                Some(())
            }
            ExprKind::Binary(Binary::Mul, a, b) => {
                self.collect(a, power, out)?;
                self.collect(b, power, out)
            }
            ExprKind::Binary(Binary::Div, a, b) => {
                self.collect(a, power, out)?;
                self.collect(b, -power, out)
            }
            ExprKind::Binary(Binary::Pow, a, n) => match &*n.kind {
                ExprKind::Number(n) => self.collect(a, power * *n as i32, out),
                _ => None,
            },
            ExprKind::Tuple(elements, None) => match elements.as_slice() {
                [one] => self.collect(one, power, out),
                _ => None,
            },
            _ => None,
        }
    }
}

/// The dimensions of a module, each with its units, as a list.
pub fn list(module: &Module, measures: &Measures) -> String {
    let mut out = String::new();
    for item in &module.tree.items {
        let ItemKind::Dimension { name, .. } = &item.kind else { continue };
        let declared = measures.units.get(&name.text).map(|units| units.iter().map(String::as_str).collect::<Vec<_>>());
        let units = match declared {
            Some(units) => markdown::codes(units),
            None => measures.unit(&name.text).map(|unit| markdown::code(&unit)).unwrap_or_default(),
        };
        out += &format!("| `{}` | {units} |\n", name.text);
    }
    out
}
