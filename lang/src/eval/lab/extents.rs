//! How large a shape may be.

use matterix_ir::{Diagnostic, Span, codes};

use super::Elaborator;
use crate::ast::Expr;
use crate::declare::Type;
use crate::eval::{Scope, Value};

/// The longest that a side, diameter or height may be, m: no laboratory holds more, and what moves among shapes is looked
/// at in steps of millimetres.
pub(super) const LONGEST: f64 = 100.0;

/// What the lengths of a shape are, in order; the last stands for those that follow.
fn words(shape: &str) -> &'static [&'static str] {
    match shape {
        "box" => &["a side"],
        "cylinder" => &["the diameter", "the height"],
        "vessel" => &["the diameter", "the height", "the wall", "the floor"],
        "mesh" => &["one unit"],
        _ => &["the diameter"],
    }
}

impl<'a> Elaborator<'a> {
    /// A length of a shape, the one with this index, above 0 and no longer than a laboratory, m.
    pub(super) fn extent(&mut self, e: &'a Expr, shape: &str, index: usize, scope: &mut Scope) -> Option<f64> {
        let (value, shown) = self.figure_shown(e, "Length", shape, scope)?;
        let words = words(shape);
        let what = words.get(index).or(words.last()).copied().unwrap_or("a length");
        let (headline, label) = match value {
            v if v > 0.0 && v <= LONGEST => return Some(v),
            v if v > LONGEST => (format!("{what} of `{shape}` is {shown}"), format!("must be at most {LONGEST} m")),
            _ => (format!("{what} of `{shape}` is {shown}"), "must be above 0".to_string()),
        };
        self.report(Diagnostic::error(codes::OUT_OF_RANGE, e.span, headline, label));
        None
    }

    /// Whether a mesh has a size that a body can have; else that is said.
    pub(super) fn is_of_size(&mut self, name: &str, size: [f64; 3], span: Span) -> bool {
        let most = size.iter().copied().fold(0.0, f64::max);
        let label = match size.iter().all(|side| *side > 0.0) {
            true if most <= LONGEST => return true,
            true => format!("must be at most {LONGEST} m"),
            false => "it has no volume".to_string(),
        };
        let headline = format!("`{name}` is {most:.3e} m long with this unit");
        self.report(Diagnostic::error(codes::OUT_OF_RANGE, span, headline, label));
        false
    }

    /// A number of a dimension that is known before the run, in SI.
    pub(super) fn figure(&mut self, e: &'a Expr, dimension: &str, what: &str, scope: &mut Scope) -> Option<f64> {
        self.figure_shown(e, dimension, what, scope).map(|(value, _)| value)
    }

    /// As [`Elaborator::figure`], and how it is written in the unit it was given in.
    fn figure_shown(&mut self, e: &'a Expr, dimension: &str, what: &str, scope: &mut Scope) -> Option<(f64, String)> {
        let ty = Type::Quantity { dimension: self.tables.units.named(dimension), point: false, optional: false };
        let value = self.expr(e, scope);
        let Value::Num(n) = self.coerce(value, &ty, e.span, what) else { return None };
        let Some(value) = self.known(n.node) else {
            let headline = "a size cannot change during a run";
            self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "changes during the run"));
            return None;
        };
        let unit = self.unit_of(&n);
        Some((value, unit.show(value)))
    }
}
