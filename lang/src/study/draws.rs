//! How a study draws its values: `by sobol`, `by grid(5)`, `by normal(mean: 76 degC, sd: 2 K)`.

use matterix_ir::study::{Draw, Free, MOST_RUNS};
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Arg, Expr, Name};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::free::Named;
use crate::eval::{Scope, Value};
use crate::near;

/// Ways to draw.
const DRAWS: &[&str] = &["uniform", "sobol", "grid", "normal"];

/// How values are drawn, or a report. Without a word they are drawn evenly.
pub(super) fn draw<'a>(
    lab: &mut Elaborator<'a>,
    by: Option<&'a (Name, Vec<Arg>)>,
    free: &Free,
    named: &Named,
    scope: &mut Scope,
) -> Option<Draw> {
    let whole = lab.open.is_whole(named.param);
    let Some((word, args)) = by else {
        return if whole { not_whole(lab, free, free.span) } else { Some(Draw::Uniform) };
    };
    let wrong = |lab: &mut Elaborator<'a>, span: Span, headline: &str, help: &str| {
        lab.report(Diagnostic::error(codes::WRONG_ARGUMENTS, span, headline, "wrong arguments").help(help));
        None
    };
    match (word.text.as_str(), args.as_slice()) {
        ("uniform" | "sobol", []) if whole => not_whole(lab, free, word.span),
        ("uniform", []) => Some(Draw::Uniform),
        ("sobol", []) => Some(Draw::Sobol),
        ("grid", [n]) if n.name.as_ref().is_none_or(|name| name.text == "n") => {
            let n = count(lab, &n.value, scope, "the number of values of a grid").filter(|n| {
                if *n < 2 {
                    wrong(lab, word.span, "a grid needs at least two values, both ends", "write `grid(2)`, or more");
                }
                *n >= 2
            })?;
            let step = (free.high - free.low) / (n - 1) as f64;
            if whole && (free.low.fract() != 0.0 || step.fract() != 0.0) {
                return not_whole(lab, free, word.span);
            }
            Some(Draw::Grid(u32::try_from(n).unwrap_or(u32::MAX)))
        }
        ("normal", [mean, sd]) => {
            if whole {
                return not_whole(lab, free, word.span);
            }
            let at = |name: &str, place: &'a Arg, other: &'a Arg| match &place.name {
                None => Some(&place.value),
                Some(n) if n.text == name => Some(&place.value),
                Some(_) => other.name.as_ref().filter(|n| n.text == name).map(|_| &other.value),
            };
            let (Some(mean), Some(sd)) = (at("mean", mean, sd), at("sd", sd, mean)) else {
                return wrong(lab, word.span, "a normal distribution needs a `mean` and an `sd`", NORMAL);
            };
            let ty = |point| Type::Quantity { dimension: named.dimension.clone(), point, optional: false };
            let Value::Num(mean) = lab.typed(mean, &ty(named.point), scope, "mean") else { return None };
            let Value::Num(spread) = lab.typed(sd, &ty(false), scope, "sd") else { return None };
            let (mean, spread) = lab.known(mean.node).zip(lab.known(spread.node))?;
            if !(spread > 0.0 && spread.is_finite() && mean.is_finite()) {
                let headline = "a standard deviation must be above 0";
                lab.report(Diagnostic::error(codes::OUT_OF_RANGE, sd.span, headline, "not a standard deviation"));
                return None;
            }
            if mean < free.low - 6.0 * spread || mean > free.high + 6.0 * spread {
                let headline = "almost none of this distribution lies in the range";
                let d = Diagnostic::error(codes::OUT_OF_RANGE, word.span, headline, "its mean is far outside");
                lab.report(d);
                return None;
            }
            Some(Draw::Normal(mean, spread))
        }
        ("uniform" | "sobol", _) => {
            wrong(lab, word.span, "this distribution takes no arguments", "write the word alone")
        }
        ("grid", _) => wrong(lab, word.span, "a grid needs the number of its values", "write `grid(5)`"),
        ("normal", _) => wrong(lab, word.span, "a normal distribution needs a `mean` and an `sd`", NORMAL),
        _ => {
            let near = near::nearest(&word.text, DRAWS.iter().copied());
            let headline = format!("unknown distribution `{}`", word.text);
            let mut d = near::unknown(word, headline, "not a distribution");
            d.help.extend(near::question(&near));
            lab.report(d.help("use `uniform`, `sobol`, `grid(n)` or `normal(mean: ..., sd: ...)`"));
            None
        }
    }
}

const NORMAL: &str = "write `normal(mean: 76 degC, sd: 2 K)`; values outside the range are not drawn";

fn not_whole(lab: &mut Elaborator<'_>, free: &Free, at: Span) -> Option<Draw> {
    let headline = format!("`{}` must be a whole number, but these values are not", free.name);
    let d = Diagnostic::error(codes::CANNOT_VARY, at, headline, "values between whole numbers");
    lab.report(d.help("write `by grid(n)` with a range and an `n` that give whole numbers: `in 1 .. 5 by grid(5)`"));
    None
}

/// A positive whole number, or a report.
pub(super) fn count<'a>(lab: &mut Elaborator<'a>, e: &'a Expr, scope: &mut Scope, what: &str) -> Option<u64> {
    let Value::Num(n) = lab.typed(e, &Type::ratio(), scope, what) else { return None };
    let value = lab.known(n.node).filter(|v| *v >= 1.0 && v.fract() == 0.0 && *v <= MOST_RUNS as f64);
    if value.is_none() {
        let headline = format!("{what} must be a whole number from 1 to {MOST_RUNS}");
        lab.report(Diagnostic::error(codes::UNUSABLE_NUMBER, e.span, headline, "not such a number"));
    }
    value.map(|v| v as u64)
}
