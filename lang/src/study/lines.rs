//! The lines of a study or a fit, once the model they are about is whole.

use matterix_ir::study::{Draw, Estimated, Fit, Free, MOST_RUNS, Study, Varied};
use matterix_ir::{Diagnostic, codes};

use super::Many;
use super::draws::{count, draw};
use crate::ast::{Expr, FitLine, ItemKind, Name, StudyLine};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::free::{Bound, Named};
use crate::eval::{Num, Scope, Value};
use crate::task::Task;

/// Columns of a table of runs that reports may not be called.
const TAKEN: &[&str] = &["run", "seed", "outcome", "fault"];

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
                runs = count(lab, e, scope, "the number of runs");
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
        missing(lab, format!("`{}` has no number of runs", name.text), "add a line such as `runs 1000`");
    }
    if !wrong && !asks {
        missing(lab, format!("`{}` has no `report`", name.text), "add a line such as `report duration = elapsed`");
    }
    if let (false, Some(at)) = (wrong, first_runs) {
        let all = varied.iter().map(|v| match v.draw {
            Draw::Grid(n) => u64::from(n),
            _ => 1,
        });
        let all = all.fold(1u64, u64::saturating_mul);
        if runs.is_some_and(|runs| all > MOST_RUNS || runs % all != 0) {
            let headline = format!("the grids have {all} points: the number of runs must be a multiple of this");
            let d = Diagnostic::error(codes::UNUSABLE_NUMBER, at, headline, "not a multiple of the points");
            lab.report(d.help(format!("remove `runs`, or write a multiple of {all}")));
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
            let headline = format!("`{}` is already a column of every table of runs", name.text);
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
                    let d = Diagnostic::error(codes::DUPLICATE_NAME, file.span, "this fit has two data files", "again");
                    lab.report(
                        d.because(first.span, "the first")
                            .help("a fit uses the data of one run: write one fit for each"),
                    );
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
                    let d = Diagnostic::error(codes::CANNOT_VARY, free.span, headline, "a count");
                    lab.report(d.help("an estimate can take any value in its range"));
                } else if *log && free.low <= 0.0 {
                    let headline = "a logarithmic scale cannot include 0 or negative values";
                    let d = Diagnostic::error(codes::OUT_OF_RANGE, range.span, headline, "starts at or below 0");
                    lab.report(d.help("start above 0, or remove `log`"));
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
        missing(
            lab,
            format!("`{name_text}` has no `estimate`"),
            "add a line such as `estimate r.rate.A in 1e6 1/s .. 1e9 1/s log`",
        );
    }
    if !asks {
        missing(lab, format!("`{name_text}` has no `match`"), "add a line such as `match x with \"column\" as mol/L`");
    }
    let matches = std::mem::take(&mut lab.open.matches);
    if matches.len() > 1
        && let Some(without) = matches.iter().find(|m| m.noise.is_none())
    {
        let headline = format!("the weight of the values of `{}` is unknown", without.column);
        let d = Diagnostic::error(codes::MISSING_FIELD, without.column_span, headline, "without `noise`");
        lab.report(d.help("if several columns are matched, each needs its standard deviation: `noise 0.01 mol/L`"));
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
        let headline = format!("`{text}` varies here, but is also given a value");
        let d = Diagnostic::error(codes::DUPLICATE_NAME, given.name.span, headline, "given here");
        lab.report(d.because(path.span, "varies here"));
        return None;
    }
    let named = lab.free(path, &lab_name)?;
    if let Some(first) = others.find(|o| o.param == named.param) {
        let d = Diagnostic::error(codes::DUPLICATE_NAME, path.span, format!("`{text}` varies twice"), "again");
        lab.report(d.because(first.span, "first here"));
        return None;
    }
    let ty = Type::Quantity { dimension: named.dimension.clone(), point: named.point, optional: false };
    let value = lab.expr(range, scope);
    if !matches!(value, Value::Range(..) | Value::Error) {
        lab.expected("a range, such as `1 g .. 2 g`", &value, range.span);
        return None;
    }
    let Value::Range(low, high) = lab.coerce(value, &Type::Range(ty.into()), range.span, &text) else { return None };
    let ends = lab.known(low.node).zip(lab.known(high.node)).filter(|(a, b)| a.is_finite() && b.is_finite());
    let Some((from, to)) = ends else {
        let headline = "both ends of this range must be known before the runs";
        lab.report(Diagnostic::error(codes::CANNOT_VARY, range.span, headline, "unknown or infinite"));
        return None;
    };
    if from >= to {
        let headline = format!("`{text}` cannot vary: both ends of its range are equal");
        let d = Diagnostic::error(codes::EMPTY_RANGE, range.span, headline, "only one value");
        lab.report(d);
        return None;
    }
    let unit = unit(lab, &low, &high);
    let end = |bound: &Bound| if *bound == Bound::AtMost { to } else { from };
    let beyond = |(bound, limit): &&(Bound, f64)| !bound.holds(end(bound), *limit);
    if let Some((bound, limit)) = lab.open.bounds(named.param).iter().find(beyond).copied() {
        let headline = format!("`{text}` cannot be {}", unit.show(end(&bound)));
        let label = format!("must be {} {}", bound.words(), unit.show(limit));
        lab.report(Diagnostic::error(codes::OUT_OF_RANGE, range.span, headline, label));
        return None;
    }
    Some((Free { name: text, param: named.param, low: from, high: to, unit, span: path.span }, named))
}

fn unit(lab: &Elaborator<'_>, low: &Num, high: &Num) -> matterix_ir::Unit {
    match low.unit {
        Some(_) => lab.unit_of(low),
        None => high.unit.as_deref().cloned().unwrap_or_else(|| lab.shown(low)),
    }
}
