//! What a package declares, with the least contents of what must not meet, which have to be evaluated.

use matterix_ir::Diagnostic;

use crate::declare::Tables;
use crate::declare::compatibility::Screen;
use crate::eval::lab::Elaborator;
use crate::eval::lab::reach::Reach;
use crate::eval::{Scope, Value};
use crate::names::Names;
use crate::units::Dimension;

/// The tables of a package; findings in declarations are returned beside them.
pub fn declared<'a>(names: &'a Names<'a>) -> (Tables<'a>, Vec<Diagnostic>) {
    Tables::new(names, |tables, found| {
        let (mut lab, mut of_pairs) = (Elaborator::new(tables, Reach::default()), Vec::new());
        let mut constant = |e, module| match lab.expr(e, &mut Scope::module(module)) {
            Value::Error => None,
            Value::Num(n) => Some((n.dimension.clone(), lab.graph.constant(n.node).unwrap_or(f64::NAN))),
            _ => Some((Dimension::one(), f64::NAN)),
        };
        let screen = Screen::new(names, &tables.units, &tables.species, &mut constant, &mut of_pairs);
        of_pairs.into_iter().for_each(|d| lab.report(d));
        found.append(&mut lab.diagnostics);
        screen
    })
}
