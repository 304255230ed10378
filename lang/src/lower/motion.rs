//! What a robot does with its body in a primitive: `moves`, `grips`, `frees`, `leads`.

use matterix_ir::plan::Motion;
use matterix_ir::scene::{InstanceId, frame};
use matterix_ir::{Diagnostic, NodeId, Span, codes};

use super::Planner;
use crate::ast::{ClauseKind, Expr, Goal, Manner};
use crate::declare::Type;
use crate::eval::{Scope, Value};

/// The member of a thing that moves which says how far something hangs below it.
const HANGING: &str = "hanging";

impl<'a> Planner<'a, '_> {
    /// The motion of a clause; none where it has a mistake, which is reported.
    pub(super) fn motion(&mut self, clause: &'a ClauseKind, scope: &mut Scope) -> Option<Motion> {
        match clause {
            ClauseKind::Moves { mover, manner, to, within } => self.moves(mover, manner, to, within.as_ref(), scope),
            ClauseKind::Grips { item, at, by } => {
                let by = self.thing(by, scope)?;
                Some(match self.load(item, scope)? {
                    Some(item) => {
                        let frame = match at {
                            Some(at) => self.frame_of(item, at, scope)?,
                            None => frame::GRASP.to_string(),
                        };
                        Motion::Grip { item, frame, by }
                    }
                    None => Motion::Fingers { by, open: false },
                })
            }
            ClauseKind::Frees { item, on: None, by } if self.load(item, scope)?.is_none() => {
                Some(Motion::Fingers { by: self.thing(by, scope)?, open: true })
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
                        format!("`{name}` has no moving part at its frame `{frame}`"),
                        "the gripper would move nothing",
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

    fn moves(
        &mut self,
        mover: &'a Expr,
        manner: &'a Manner,
        to: &'a Goal,
        within: Option<&'a Expr>,
        scope: &mut Scope,
    ) -> Option<Motion> {
        let mover = self.thing(mover, scope)?;
        let straight = *manner == Manner::Straight;
        match (to, manner) {
            (Goal::Frame { at, by }, Manner::Free | Manner::Straight) => {
                let shift = match by {
                    Some(by) => Some(self.shift(by, scope)?),
                    None => None,
                };
                let within = match within {
                    Some(within) => Some(self.duration_node(within, scope, "in")?),
                    None => None,
                };
                let (goal, frame, choice) = match self.lab.expr(at, scope) {
                    Value::InstanceNode(node) => {
                        let first = self.lab.picks.get(&node).and_then(|all| all.first()).copied();
                        (first.unwrap_or(mover), String::new(), Some(node))
                    }
                    value => {
                        let (goal, frame) = self.place(value, at)?;
                        (goal, frame, None)
                    }
                };
                let hanging = self.hanging(mover);
                Some(Motion::To { mover, goal, frame, choice, shift, hanging, straight, within })
            }
            (_, manner) if within.is_some() && !matches!(manner, Manner::Tilted(..)) => {
                self.mismatched(within.map_or_else(Span::default, |e| e.span))
            }
            (Goal::Frame { by: Some(by), .. }, manner) if !matches!(manner, Manner::Tilted(..)) => {
                self.mismatched(by.span)
            }
            (Goal::Frame { at, by }, manner) => {
                let (goal, frame) = self.goal(at, scope)?;
                Some(match manner {
                    Manner::Free | Manner::Straight => return None,
                    Manner::Driving => Motion::Drive { mover, goal, frame },
                    Manner::Upright(within) => {
                        Motion::Upright { mover, goal, frame, within: self.quantity(within, "Angle", scope)? }
                    }
                    Manner::Tilted(angle, about) => {
                        let angle = self.quantity(angle, "Angle", scope)?;
                        let within = match within {
                            Some(within) => Some(self.duration_node(within, scope, "in")?),
                            None => None,
                        };
                        let shift = match by {
                            Some(by) => Some(self.shift(by, scope)?),
                            None => None,
                        };
                        Motion::Tilted { mover, about: self.goal(about, scope)?, goal, frame, angle, shift, within }
                    }
                })
            }
            (Goal::Shift(shift), Manner::Free | Manner::Straight) => {
                Some(Motion::By { mover, shift: self.shift(shift, scope)?, straight })
            }
            (Goal::Joints(positions), Manner::Free) => {
                Some(Motion::Joints { mover, positions: self.positions(positions, scope)? })
            }
            (Goal::Home, Manner::Free) => Some(Motion::Home { mover }),
            (Goal::Shift(at) | Goal::Joints(at), Manner::Upright(by) | Manner::Tilted(by, _)) => {
                self.mismatched(by.span.to(at.span))
            }
            (Goal::Joints(at), Manner::Straight | Manner::Driving) | (Goal::Shift(at), Manner::Driving) => {
                self.mismatched(at.span)
            }
            (Goal::Home, Manner::Upright(by) | Manner::Tilted(by, _)) => self.mismatched(by.span),
            (Goal::Home, Manner::Straight | Manner::Driving) => {
                let at = self.lab.instances[mover.0 as usize].span;
                self.mismatched(at)
            }
        }
    }

    /// How far something hangs below a thing that moves: its member of that name, if it has one that is a length.
    fn hanging(&mut self, mover: InstanceId) -> Option<NodeId> {
        let member = match *self.lab.members_of(mover, HANGING) {
            [member] => member,
            _ => return None,
        };
        let length = self.lab.tables.units.named("Length");
        let at = self.lab.instances[mover.0 as usize].span;
        match self.lab.member_value(mover, member, at) {
            Value::Num(n) if n.dimension.agrees(&length) => Some(n.node),
            _ => None,
        }
    }

    /// A manner that only a way to a frame can have.
    fn mismatched(&mut self, at: Span) -> Option<Motion> {
        self.lab.report(Diagnostic::error(
            codes::MISPLACED,
            at,
            "a move to joint positions takes no manner",
            "only a move to a frame can be `straight`, `driving`, `upright` or `tilted`, and a shift only `straight`",
        ));
        None
    }

    /// What is gripped or let go; nothing for `nothing`.
    fn load(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Option<InstanceId>> {
        match self.lab.expr(e, scope) {
            Value::Nothing => Some(None),
            Value::Instance(id) | Value::Qualified(id, _) => Some(Some(id)),
            other => {
                self.lab.expected("a thing of the lab, or `nothing`", &other, e.span);
                None
            }
        }
    }

    fn quantity(&mut self, e: &'a Expr, dimension: &str, scope: &mut Scope) -> Option<NodeId> {
        let ty = Type::Quantity { dimension: self.lab.tables.units.named(dimension), point: false, optional: false };
        let value = self.lab.expr(e, scope);
        match self.lab.coerce(value, &ty, e.span, dimension) {
            Value::Num(n) => Some(n.node),
            _ => None,
        }
    }

    /// Positions of joints: angles, or lengths of those that slide.
    fn positions(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Vec<NodeId>> {
        let value = self.lab.expr(e, scope);
        let (Value::List(items) | Value::Tuple(items)) = value else {
            self.lab.expected("positions of joints `[0 deg, 90 deg]`", &value, e.span);
            return None;
        };
        let [angle, length] = ["Angle", "Length"].map(|name| self.lab.tables.units.named(name));
        let mut out = Vec::new();
        for item in items {
            let slides = matches!(&item, Value::Num(n) if n.dimension.agrees(&length));
            let dimension = if slides { length.clone() } else { angle.clone() };
            let ty = Type::Quantity { dimension, point: false, optional: false };
            let Value::Num(n) = self.lab.coerce(item, &ty, e.span, "joints") else { return None };
            out.push(n.node);
        }
        Some(out)
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

    /// The name of a frame of a thing.
    fn frame_of(&mut self, thing: InstanceId, e: &'a Expr, scope: &mut Scope) -> Option<String> {
        let (owner, frame) = self.goal(e, scope)?;
        if owner != thing || frame.is_empty() {
            self.lab.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                "a thing must be gripped at one of its own frames",
                "a frame of another thing",
            ));
            return None;
        }
        Some(frame)
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

    fn shift(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<[NodeId; 3]> {
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
        let found = <[NodeId; 3]>::try_from(nodes);
        if found.is_err() {
            self.lab.expected("a shift `(x, y, z) mm`", &Value::Tuple(Vec::new()), e.span);
        }
        found.ok()
    }
}
