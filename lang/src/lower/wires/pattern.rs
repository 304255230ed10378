//! What replies look like: words with units where numbers stand.

use std::sync::Arc;

use matterix_ir::wire::{Pattern, Slot};
use matterix_ir::{Diagnostic, Unit, codes};

use crate::ast::{self, UnitText};
use crate::elaborate::units::unit_error;
use crate::lower::Planner;
use crate::units::Dimension;

/// What stands for anything.
const ANY: &str = "_";

impl Planner<'_, '_> {
    /// A pattern with the dimensions of its numbers, in order.
    pub(super) fn pattern(&mut self, of: &ast::Pattern) -> Option<(Pattern, Vec<Dimension>)> {
        let (mut slots, mut dimensions) = (Vec::new(), Vec::new());
        let mut plain = String::new();
        let mut rest = of.text.as_str();
        while let Some(at) = rest.find(['{', '}']) {
            plain.push_str(&rest[..at]);
            rest = &rest[at..];
            if rest.starts_with("{{") || rest.starts_with("}}") {
                plain.push_str(&rest[..1]);
                rest = &rest[2..];
                continue;
            }
            let Some(close) = rest.find('}').filter(|_| rest.starts_with('{')) else {
                let headline = "a brace in a reply stands for a number or, as `{_}`, for anything";
                let d = Diagnostic::error(codes::DRIVER_LINE, of.span, headline, "not closed, or not opened");
                self.lab.report(d.help("a brace itself is written `{{` or `}}`"));
                return None;
            };
            if !plain.is_empty() {
                slots.push(Slot::Plain(std::mem::take(&mut plain)));
            }
            let inner = rest[1..close].trim();
            rest = &rest[close + 1..];
            slots.push(match inner {
                ANY => Slot::Any,
                "" => {
                    dimensions.push(Dimension::one());
                    Slot::Number(Unit::one())
                }
                unit => match self.lab.tables.unit(unit) {
                    Ok(resolved) => {
                        dimensions.push(resolved.dimension);
                        Slot::Number(Arc::unwrap_or_clone(resolved.unit))
                    }
                    Err(error) => {
                        let d = unit_error(&UnitText { text: unit.to_owned(), span: of.span }, error);
                        self.lab.report(Diagnostic { fixes: Vec::new(), ..d });
                        return None;
                    }
                },
            });
        }
        plain.push_str(rest);
        if !plain.is_empty() {
            slots.push(Slot::Plain(plain));
        }
        let beside = slots.windows(2).any(|w| !w.iter().any(|s| matches!(s, Slot::Plain(_))));
        if beside {
            let headline = "what a reply says between two values must be known";
            self.lab.report(Diagnostic::error(codes::DRIVER_LINE, of.span, headline, "two values touch"));
            return None;
        }
        Some((Pattern { slots, span: of.span }, dimensions))
    }
}
