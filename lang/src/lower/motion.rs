//! What a robot does with its body in a primitive: `moves`, `grips`, `frees`, `leads`.

use matterix_ir::plan::Motion;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, codes};

use super::Planner;
use crate::ast::{ClauseKind, Expr};
use crate::eval::{Scope, Type, Value};

impl<'a> Planner<'a, '_> {
    /// The motion of a clause; none where it has a mistake, which is reported.
    pub(super) fn motion(&mut self, clause: &'a ClauseKind, scope: &mut Scope) -> Option<Motion> {
        match clause {
            ClauseKind::Moves { mover, straight, to, by, within } => {
                let (mover, straight) = (self.thing(mover, scope)?, *straight);
                let shift = match by {
                    Some(shift) => Some(self.shift(shift, scope)?),
                    None => None,
                };
                let Some(to) = to else { return Some(Motion::By { mover, shift: shift?, straight }) };
                let within = match within {
                    Some(within) => Some(self.duration_node(within, scope, "in")?),
                    None => None,
                };
                let (goal, frame, choice) = match self.lab.expr(to, scope) {
                    Value::InstanceNode(node) => {
                        let first = self.lab.picks.get(&node).and_then(|all| all.first()).copied();
                        (first.unwrap_or(mover), String::new(), Some(node))
                    }
                    value => {
                        let (goal, frame) = self.place(value, to)?;
                        (goal, frame, None)
                    }
                };
                Some(Motion::To { mover, goal, frame, choice, shift, straight, within })
            }
            ClauseKind::Grips { item, by } => {
                Some(Motion::Grip { item: self.thing(item, scope)?, by: self.thing(by, scope)? })
            }
            ClauseKind::Frees { item, on, by } => {
                let on = match on {
                    Some(on) => Some(self.thing(on, scope)?),
                    None => None,
                };
                Some(Motion::Free { item: self.thing(item, scope)?, on, by: self.thing(by, scope)? })
            }
            ClauseKind::Leads { handle, by } => {
                let (item, frame) = self.goal(handle, scope)?;
                if !self.lab.prototype && self.lab.rides_on(item, &frame).is_none() {
                    let name = &self.lab.instances[item.0 as usize].name;
                    let at = self.lab.calls.first().copied().unwrap_or(handle.span);
                    let found = Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        at,
                        format!("`{name}` has no part that moves at its frame `{frame}`"),
                        "a hand would take nothing along",
                    );
                    self.lab.report(found.help(format!(
                        "give the frame `from` a joint of the asset: `frame {frame} at (0, 0, 0) mm from lid`"
                    )));
                    return None;
                }
                Some(Motion::Lead { item, frame, by: self.thing(by, scope)? })
            }
            _ => None,
        }
    }

    fn thing(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<InstanceId> {
        match self.lab.expr(e, scope) {
            Value::Instance(id) | Value::Qualified(id, _) => Some(id),
            other => {
                self.lab.expected("a thing of the lab", &other, e.span);
                None
            }
        }
    }

    fn goal(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<(InstanceId, String)> {
        let value = self.lab.expr(e, scope);
        self.place(value, e)
    }

    fn place(&mut self, value: Value, e: &'a Expr) -> Option<(InstanceId, String)> {
        match value {
            Value::Frame(id, frame) => Some((id, frame)),
            Value::Instance(id) | Value::Qualified(id, _) => Some((id, String::new())),
            other => {
                self.lab.expected("a frame", &other, e.span);
                None
            }
        }
    }

    fn shift(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<[matterix_ir::NodeId; 3]> {
        let ty = Type::Quantity { dimension: self.lab.tables.units.named("Length"), point: false, optional: false };
        let value = self.lab.expr(e, scope);
        let Value::Tuple(items) = value else {
            self.lab.expected("a shift `(x, y, z) mm`", &value, e.span);
            return None;
        };
        let mut nodes = Vec::new();
        for item in items {
            let Value::Num(n) = self.lab.coerce(item, &ty, e.span, "by") else { return None };
            nodes.push(n.node);
        }
        let found = <[matterix_ir::NodeId; 3]>::try_from(nodes);
        if found.is_err() {
            self.lab.expected("a shift `(x, y, z) mm`", &Value::Tuple(Vec::new()), e.span);
        }
        found.ok()
    }
}
