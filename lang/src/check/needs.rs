//! P1 and D1: a need that parameters alone decide, such as a set point outside the device's range.

use matterix_ir::plan::{Condition, Plan, Step};
use matterix_ir::{Diagnostic, Env, Op, codes};

use crate::elaborate::Elaborator;

/// Reports needs that cannot hold whatever happens in the run.
pub fn constant(lab: &mut Elaborator<'_>, plan: &Plan) {
    let params: Vec<f64> = lab.params.iter().map(|p| p.value).collect();
    for step in &plan.steps {
        let needs: &[Condition] = match &step.step {
            Step::Operation(o) => &o.needs,
            Step::Skill { needs, .. } => needs,
            _ => continue,
        };
        for need in needs {
            let live = |op: &Op| matches!(op, Op::State(_) | Op::Time | Op::Reading(_) | Op::Local(_));
            // A parameter that only a run will have is not a number yet.
            let open = |op: &Op| matches!(op, Op::Param(i) if params[*i as usize].is_nan());
            if lab.graph.depends(need.node, live) || lab.graph.depends(need.node, open) {
                continue;
            }
            let env = Env { time: 0.0, states: &[], params: &params, locals: &[], readings: &[] };
            if lab.graph.eval(need.node, env) != 0.0 {
                continue;
            }
            let mut d = Diagnostic::error(
                codes::NEED_UNMET,
                step.span,
                format!("`{}` can never be done: it needs `{}`", step.label, need.text),
                "not possible",
            )
            .because(need.span, "needed here");
            for c in &need.compared {
                let at = |n| lab.graph.eval(n, env);
                let value = c.unit.show(at(c.value));
                let limits = match (c.low.map(at), c.high.map(at)) {
                    (Some(l), Some(h)) => format!("{} .. {}", c.unit.show(l), c.unit.show(h)),
                    (Some(l), None) => format!("at least {}", c.unit.show(l)),
                    (None, Some(h)) => format!("at most {}", c.unit.show(h)),
                    (None, None) => continue,
                };
                d = d.help(format!("`{}` is {value}, allowed is {limits}", c.text));
            }
            lab.report(d);
        }
    }
}
