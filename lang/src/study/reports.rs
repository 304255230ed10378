//! What is looked at of every run: reports, matches, and quantities that are followed over it.

use matterix_ir::plan::StepId;
use matterix_ir::study::{Keep, Matched, OverTime, Reported};
use matterix_ir::{Diagnostic, Op, Span, Unit, codes};

use crate::ast::{FitLine, ItemKind, StudyLine};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::{Num, Scope, Value};
use crate::lower::Planner;
use crate::task::{self, Task};

impl<'a> Planner<'a, '_> {
    /// The workflow that a study or a fit runs, and then what is looked at of it.
    pub fn many(&mut self, task: &Task<'a>, scope: &mut Scope, shown: &mut Vec<(String, String)>) -> StepId {
        let decl = self.lab.tables.names.decl(task.item);
        let workflow = match task::workflow_of(self.lab.tables, task.item) {
            Ok(workflow) => workflow,
            Err(d) => {
                self.lab.report(*d);
                return self.add("nothing", decl.item.span, matterix_ir::plan::Step::Sequence(Vec::new()));
            }
        };
        if let ItemKind::Workflow { params, .. } = &self.lab.tables.names.decl(workflow).item.kind {
            let left = super::lines::paths(&decl.item.kind).into_iter().filter_map(super::paths::written);
            for name in left.filter(|name| params.iter().any(|p| p.name.text == *name)) {
                self.lab.open.leave(&name);
            }
        }
        scope.module = self.lab.tables.names.decl(workflow).module;
        let root = self.workflow(workflow, &task.given, scope, shown);
        scope.module = decl.module;
        let first = self.locals.len() as u32;
        self.lab.open.following = Some(first);
        match &decl.item.kind {
            ItemKind::Study { lines, .. } => self.reported(|plan| plan.reports(lines, scope)),
            ItemKind::Fit { lines, .. } => self.reported(|plan| plan.matches(lines, scope)),
            _ => {}
        }
        self.lab.open.following = None;
        for _ in 0..self.lab.open.over_time.len() {
            self.local("over time", Unit::one());
        }
        root
    }

    fn reports(&mut self, lines: &'a [StudyLine], scope: &mut Scope) {
        for line in lines {
            let StudyLine::Report { name, value } = line else { continue };
            let (node, unit) = match self.lab.expr(value, scope) {
                Value::Num(n) => (n.node, self.lab.unit_of(&n)),
                Value::Bool(node) => (node, Unit::one()),
                Value::Concentration(..) => {
                    self.lab.kindless(value.span);
                    continue;
                }
                other => {
                    self.lab.expected("a quantity to report", &other, value.span);
                    continue;
                }
            };
            self.lab.open.reports.push(Reported { name: name.text.clone(), value: node, unit, span: name.span });
        }
    }

    fn matches(&mut self, lines: &'a [FitLine], scope: &mut Scope) {
        for line in lines {
            let FitLine::Match { value, column, unit, noise } = line else { continue };
            let found = self.lab.expr(value, scope);
            let found = match unit {
                Some(unit) => self.lab.as_unit(found, unit, value.span),
                None => found,
            };
            let n = match found {
                Value::Num(n) => n,
                Value::Concentration(..) => {
                    self.lab.kindless(value.span);
                    continue;
                }
                other => {
                    self.lab.expected("a quantity to match", &other, value.span);
                    continue;
                }
            };
            let in_unit = match (unit, &n.unit) {
                (Some(_), Some(unit)) => Unit::clone(unit),
                _ if n.dimension.is_one() => Unit::one(),
                _ => {
                    let symbol = self.lab.shown(&n).symbol;
                    let headline = format!("the column `{}` needs a unit", column.text);
                    let d = Diagnostic::error(codes::MISSING_FIELD, column.span, headline, "numbers without a unit");
                    self.lab.report(d.help(format!("write it after the column: `as {symbol}`")));
                    continue;
                }
            };
            let noise = match noise {
                None => None,
                Some(e) => {
                    let ty = Type::Quantity { dimension: n.dimension.clone(), point: false, optional: false };
                    let given = self.lab.typed(e, &ty, scope, "noise");
                    let Value::Num(noise) = given else { continue };
                    let sigma = self.lab.known(noise.node).filter(|s| *s > 0.0 && s.is_finite());
                    if sigma.is_none() {
                        let headline = "`noise` is a standard deviation: it must be above 0";
                        let d = Diagnostic::error(codes::OUT_OF_RANGE, e.span, headline, "not a standard deviation");
                        self.lab.report(d.help("remove it to estimate it from the residuals of the fit"));
                        continue;
                    }
                    sigma
                }
            };
            let text = self.sources.slice(value.span).to_string();
            self.lab.open.matches.push(Matched {
                text,
                value: n.node,
                column: column.text.clone(),
                column_span: column.span,
                unit: in_unit,
                noise,
            });
        }
    }
}

impl Elaborator<'_> {
    /// `max_over_time(x)`: a value that is there when a run has ended.
    pub(crate) fn over_time(&mut self, keep: Keep, n: &Num, name: &str, at: Span) -> Value {
        if self.prototype {
            return Value::Num(Num { literal: false, ..n.clone() });
        }
        let Some(first) = self.open.following else {
            let headline = format!("`{name}` is known only after a run");
            let d = Diagnostic::error(codes::MISPLACED, at, headline, "not in a report");
            self.report(d.help("use it in the `report` of a `study`"));
            return Value::Error;
        };
        if self.graph.depends(n.node, |op| matches!(op, Op::Local(i) if *i >= first)) {
            let headline = format!("`{name}` cannot use a value that is itself known only after the run");
            let d = Diagnostic::about(name, codes::WRONG_ARGUMENTS, at, headline, "nested in another one");
            self.report(d);
            return Value::Error;
        }
        let known = self.open.over_time.iter().find(|o| o.value == n.node && o.keep == keep).map(|o| o.local);
        let local = known.unwrap_or(first + self.open.over_time.len() as u32);
        if known.is_none() {
            self.open.over_time.push(OverTime { local, value: n.node, keep });
        }
        let node = self.graph.add(Op::Local(local));
        Value::Num(Num { node, literal: false, ..n.clone() })
    }
}
