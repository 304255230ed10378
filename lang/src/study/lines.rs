//! The lines of a study or a fit, once the model they are about is whole.

use matterix_ir::study::{Draw, Estimated, Fit, Free, MOST_RUNS, Study, Varied};
use matterix_ir::{Diagnostic, Span, codes};

use super::Many;
use super::open::Named;
use crate::ast::{Arg, Expr, FitLine, ItemKind, Name, StudyLine};
use crate::elaborate::Elaborator;
use crate::eval::{Num, Scope, Type, Value};
use crate::names::near;
use crate::task::Task;

/// Columns of a table of runs that reports may not be called.
const TAKEN: &[&str] = &["run", "seed", "outcome", "fault"];

/// Ways to draw.
const DRAWS: &[&str] = &["uniform", "sobol", "grid", "normal"];

/// The paths of a study or a fit.
pub fn paths(kind: &ItemKind) -> Vec<&Expr> {
    match kind {
        ItemKind::Study { lines, .. } => lines
            .iter()
            .filter_map(|l| match l {
                StudyLine::Vary { path, .. } => Some(path),
                _ => None,
            })
            .collect(),
        ItemKind::Fit { lines, .. } => lines
            .iter()
            .filter_map(|l| match l {
                FitLine::Estimate { path, .. } => Some(path),
                _ => None,
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// What a study or a fit asks of its model; none for other tasks, and where a line is wrong.
pub fn resolve<'a>(lab: &mut Elaborator<'a>, task: &Task<'a>) -> Option<Many> {
    let decl = lab.tables.names.decl(task.item);
    let before = lab.reported;
    let mut scope = Scope { lab: true, ..Scope::module(decl.module) };
    let many = match &decl.item.kind {
        ItemKind::Study { name, lines, .. } => Many::Study(study(lab, task, name, lines, &mut scope)),
        ItemKind::Fit { name, lines, .. } => Many::Fit(fit(lab, task, name, lines, &mut scope)?),
        _ => return None,
    };
    (lab.reported == before).then_some(many)
}

/// How many runs a study says it has: by `runs`, else by its grids. What is wrong with it is not said.
pub fn count_of<'a>(lab: &mut Elaborator<'a>, lines: &'a [StudyLine], module: usize) -> Option<u64> {
    let mut scope = Scope::module(module);
    lab.silently(|lab| {
        let runs = lines.iter().find_map(|line| match line {
            StudyLine::Runs(e) => Some(e),
            _ => None,
        });
        if let Some(e) = runs {
            return count(lab, e, &mut scope, "runs");
        }
        let mut all = None;
        for line in lines {
            if let StudyLine::Vary { by: Some((word, args)), .. } = line
                && let ("grid", [n]) = (word.text.as_str(), args.as_slice())
            {
                all = Some(count(lab, &n.value, &mut scope, "n")?.saturating_mul(all.unwrap_or(1)));
            }
        }
        all
    })
}

fn study<'a>(
    lab: &mut Elaborator<'a>,
    task: &Task<'a>,
    name: &'a Name,
    lines: &'a [StudyLine],
    scope: &mut Scope,
) -> Study {
    let mut varied: Vec<Varied> = Vec::new();
    let (mut runs, mut first_runs) = (None, None);
    let (mut wrong, mut asks) = (false, false);
    for line in lines {
        match line {
            StudyLine::Vary { path, range, by } => {
                let free = free(lab, task, path, range, varied.iter().map(|v| &v.free), scope);
                let Some((free, named)) = free else {
                    wrong = true;
                    continue;
                };
                match draw(lab, by.as_ref(), &free, &named, scope) {
                    Some(draw) => varied.push(Varied { free, draw }),
                    None => wrong = true,
                }
            }
            StudyLine::Runs(e) => {
                if let Some(first) = first_runs.replace(e.span) {
                    let d = Diagnostic::error(codes::DUPLICATE_NAME, e.span, "`runs` is given twice", "again");
                    lab.report(d.because(first, "first given here"));
                }
                runs = count(lab, e, scope, "how many runs");
                wrong |= runs.is_none();
            }
            StudyLine::Report { .. } => asks = true,
            StudyLine::Error(_) => wrong = true,
        }
    }
    unique(lab, lines);
    let missing = |lab: &mut Elaborator<'a>, headline: String, help: &str| {
        lab.report(Diagnostic::error(codes::MISSING_FIELD, name.span, headline, "this study").help(help));
    };
    let is_grid = varied.iter().any(|v| matches!(v.draw, Draw::Grid(_)));
    if !wrong && runs.is_none() && !is_grid {
        missing(lab, format!("how many runs has `{}`?", name.text), "add a line such as `runs 1000`");
    }
    if !wrong && !asks {
        missing(lab, format!("`{}` reports nothing", name.text), "add a line such as `report duration = elapsed`");
    }
    if let (false, Some(at)) = (wrong, first_runs) {
        let all = varied.iter().map(|v| match v.draw {
            Draw::Grid(n) => u64::from(n),
            _ => 1,
        });
        let all = all.fold(1u64, u64::saturating_mul);
        if runs.is_some_and(|runs| all > MOST_RUNS || runs % all != 0) {
            let headline = format!("the grids have {all} points, and the runs do not go into them evenly");
            let d = Diagnostic::error(codes::UNUSABLE_NUMBER, at, headline, "not a multiple of the points");
            lab.report(d.help(format!("leave `runs` out, or write a multiple of {all}")));
        }
    }
    Study {
        name: name.text.clone(),
        span: name.span,
        varied,
        runs,
        reports: std::mem::take(&mut lab.open.reports),
        over_time: std::mem::take(&mut lab.open.over_time),
    }
}

/// Reports are called differently from each other and from the columns that every table of runs has.
fn unique(lab: &mut Elaborator<'_>, lines: &[StudyLine]) {
    let names: Vec<&Name> = lines
        .iter()
        .filter_map(|l| match l {
            StudyLine::Report { name, .. } => Some(name),
            _ => None,
        })
        .collect();
    for (i, name) in names.iter().enumerate() {
        let headline = format!("`{}` is reported twice", name.text);
        if let Some(first) = names[..i].iter().find(|o| o.text == name.text) {
            let d = Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "again");
            lab.report(d.because(first.span, "first reported here"));
        } else if TAKEN.contains(&name.text.as_str()) {
            let headline = format!("every table of runs has a column `{}`", name.text);
            let d = Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "this report's name");
            lab.report(d.help("choose another name"));
        }
    }
}

fn fit<'a>(
    lab: &mut Elaborator<'a>,
    task: &Task<'a>,
    name: &'a Name,
    lines: &'a [FitLine],
    scope: &mut Scope,
) -> Option<Fit> {
    let mut estimates: Vec<Estimated> = Vec::new();
    let mut data: Option<&Name> = None;
    let (mut wrong, mut asks) = (false, false);
    for line in lines {
        match line {
            FitLine::Data(file) => {
                if let Some(first) = data.replace(file) {
                    let d = Diagnostic::error(codes::DUPLICATE_NAME, file.span, "there are two files of data", "again");
                    lab.report(d.because(first.span, "the first").help("a fit is to one run: write a fit for each"));
                }
            }
            FitLine::Estimate { path, range, log } => {
                let free = free(lab, task, path, range, estimates.iter().map(|e| &e.free), scope);
                let Some((free, named)) = free else {
                    wrong = true;
                    continue;
                };
                if lab.open.is_whole(named.param) {
                    let headline = format!("`{}` is a whole number and cannot be estimated", free.name);
                    let d = Diagnostic::error(codes::CANNOT_VARY, free.span, headline, "counts something");
                    lab.report(d.help("estimates move in steps as small as they like"));
                } else if *log && free.low <= 0.0 {
                    let headline = "a logarithmic scale has no place for nothing, or less";
                    let d = Diagnostic::error(codes::OUT_OF_RANGE, range.span, headline, "begins at or below 0");
                    lab.report(d.help("begin above 0, or leave `log` out"));
                } else {
                    estimates.push(Estimated { free, log: *log });
                }
            }
            FitLine::Match { .. } => asks = true,
            FitLine::Error(_) => wrong = true,
        }
    }
    let missing = |lab: &mut Elaborator<'a>, headline: String, help: &str| {
        lab.report(Diagnostic::error(codes::MISSING_FIELD, name.span, headline, "this fit").help(help));
    };
    if wrong {
        return None;
    }
    let name_text = &name.text;
    if data.is_none() {
        missing(lab, format!("`{name_text}` has no data"), "add a line such as `data \"run.csv\"`");
    }
    if !lines.iter().any(|l| matches!(l, FitLine::Estimate { .. })) {
        missing(lab, format!("`{name_text}` estimates nothing"), "add a line such as `estimate r.rate.A in 1e6 1/s .. 1e9 1/s log`");
    }
    if !asks {
        missing(lab, format!("`{name_text}` matches nothing"), "add a line such as `match x with \"column\" as mol/L`");
    }
    let matches = std::mem::take(&mut lab.open.matches);
    if matches.len() > 1
        && let Some(without) = matches.iter().find(|m| m.noise.is_none())
    {
        let headline = format!("how much do values of `{}` count against others?", without.column);
        let d = Diagnostic::error(codes::MISSING_FIELD, without.column_span, headline, "without `noise`");
        lab.report(d.help("where data of several columns are matched, each needs its standard deviation: `noise 0.01 mol/L`"));
    }
    let data = data?;
    Some(Fit {
        name: name.text.clone(),
        span: name.span,
        data: data.text.clone(),
        data_span: data.span,
        estimates,
        matches,
        rows: Vec::new(),
    })
}

/// A parameter and where it may lie, or a report.
fn free<'a, 'f>(
    lab: &mut Elaborator<'a>,
    task: &Task<'a>,
    path: &'a Expr,
    range: &'a Expr,
    mut others: impl Iterator<Item = &'f Free>,
    scope: &mut Scope,
) -> Option<(Free, Named)> {
    let lab_name = crate::names::item_name(lab.tables.names.decl(task.lab).item).map(|n| n.0).unwrap_or_default();
    let text = super::paths::written(path).unwrap_or_default();
    if let Some(given) = task.given.iter().find(|g| g.name.text == text) {
        let headline = format!("`{text}` is left open here, and given a value from outside");
        let d = Diagnostic::error(codes::DUPLICATE_NAME, given.name.span, headline, "given here");
        lab.report(d.because(path.span, "left open here"));
        return None;
    }
    let named = lab.free(path, &lab_name)?;
    if let Some(first) = others.find(|o| o.param == named.param) {
        let d = Diagnostic::error(codes::DUPLICATE_NAME, path.span, format!("`{text}` is left open twice"), "again");
        lab.report(d.because(first.span, "first here"));
        return None;
    }
    let ty = Type::Quantity { dimension: named.dimension.clone(), point: named.point, optional: false };
    let value = lab.expr(range, scope);
    if !matches!(value, Value::Range(..) | Value::Error) {
        lab.expected("a range, such as `1 g .. 2 g`", &value, range.span);
        return None;
    }
    let Value::Range(low, high) = lab.coerce(value, &Type::Range(Box::new(ty)), range.span, &text) else { return None };
    let ends = lab.known(low.node).zip(lab.known(high.node)).filter(|(a, b)| a.is_finite() && b.is_finite());
    let Some((from, to)) = ends else {
        let headline = "both ends of this range must be known before the runs";
        lab.report(Diagnostic::error(codes::CANNOT_VARY, range.span, headline, "not known, or without an end"));
        return None;
    };
    if from >= to {
        let headline = format!("nothing is left open of `{text}`: both ends of its range are the same");
        let d = Diagnostic::error(codes::EMPTY_RANGE, range.span, headline, "only one value");
        lab.report(d);
        return None;
    }
    let unit = unit(lab, &low, &high);
    if let Some((least, above)) = lab.open.least(named.param)
        && (from < least || (above && from <= least))
    {
        let headline = format!("`{text}` cannot be {}", unit.show(from));
        let least = unit.show(least);
        let label = if above { format!("must be above {least}") } else { format!("must be at least {least}") };
        lab.report(Diagnostic::error(codes::OUT_OF_RANGE, range.span, headline, label));
        return None;
    }
    Some((Free { name: text, param: named.param, low: from, high: to, unit, span: path.span }, named))
}

fn unit(lab: &Elaborator<'_>, low: &Num, high: &Num) -> matterix_ir::Unit {
    low.unit.clone().or_else(|| high.unit.clone()).unwrap_or_else(|| lab.shown(low))
}

/// How values are drawn, or a report. Without a word they are drawn evenly.
fn draw<'a>(
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
            let n = count(lab, &n.value, scope, "how many values a grid has").filter(|n| {
                if *n < 2 {
                    wrong(lab, word.span, "a grid has two values at least: both ends", "write `grid(2)`, or more");
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
                return wrong(lab, word.span, "a normal distribution has a `mean` and an `sd`", NORMAL);
            };
            let ty = |point| Type::Quantity { dimension: named.dimension.clone(), point, optional: false };
            let Value::Num(mean) = lab.typed(mean, &ty(named.point), scope, "mean") else { return None };
            let Value::Num(spread) = lab.typed(sd, &ty(false), scope, "sd") else { return None };
            let (mean, spread) = lab.known(mean.node).zip(lab.known(spread.node))?;
            if !(spread > 0.0 && spread.is_finite() && mean.is_finite()) {
                let headline = "a standard deviation is above nothing";
                lab.report(Diagnostic::error(codes::OUT_OF_RANGE, sd.span, headline, "not a standard deviation"));
                return None;
            }
            if mean < free.low - 6.0 * spread || mean > free.high + 6.0 * spread {
                let headline = "next to nothing of this distribution lies in the range";
                let d = Diagnostic::error(codes::OUT_OF_RANGE, word.span, headline, "its mean is far outside");
                lab.report(d);
                return None;
            }
            Some(Draw::Normal(mean, spread))
        }
        ("uniform" | "sobol", _) => wrong(lab, word.span, "this way to draw takes no arguments", "write the word alone"),
        ("grid", _) => wrong(lab, word.span, "a grid has a number of values", "write `grid(5)`"),
        ("normal", _) => wrong(lab, word.span, "a normal distribution has a `mean` and an `sd`", NORMAL),
        _ => {
            let near = near::nearest(&word.text, DRAWS.iter().copied());
            let headline = format!("there is no way to draw called `{}`", word.text);
            let mut d = Diagnostic::error(codes::UNKNOWN_NAME, word.span, headline, "not a way to draw");
            d.help.extend(near::question(&near));
            lab.report(d.help("there are `uniform`, `sobol`, `grid(n)` and `normal(mean: ..., sd: ...)`"));
            None
        }
    }
}

const NORMAL: &str = "write `normal(mean: 76 degC, sd: 2 K)`; values outside the range are not drawn";

fn not_whole(lab: &mut Elaborator<'_>, free: &Free, at: Span) -> Option<Draw> {
    let headline = format!("`{}` is a whole number, and these values are not", free.name);
    let d = Diagnostic::error(codes::CANNOT_VARY, at, headline, "between whole numbers");
    lab.report(d.help("write `by grid(n)` with a range and an `n` that give whole numbers: `in 1 .. 5 by grid(5)`"));
    None
}

/// A positive whole number, or a report.
fn count<'a>(lab: &mut Elaborator<'a>, e: &'a Expr, scope: &mut Scope, what: &str) -> Option<u64> {
    let Value::Num(n) = lab.typed(e, &Type::ratio(), scope, what) else { return None };
    let value = lab.known(n.node).filter(|v| *v >= 1.0 && v.fract() == 0.0 && *v <= MOST_RUNS as f64);
    if value.is_none() {
        let headline = format!("{what} is a whole number from 1 to {MOST_RUNS}");
        lab.report(Diagnostic::error(codes::UNUSABLE_NUMBER, e.span, headline, "not such a number"));
    }
    value.map(|v| v as u64)
}
