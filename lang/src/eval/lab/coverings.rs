//! What is seen of an asset and what others run into, where that is not its shape: `mesh` and `collision`.

use matterix_ir::scene::{InstanceId, Pose, Solid};
use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use super::geometry::{Geometry, call};
use crate::ast::{Arg, Expr, ExprKind, FieldValue};
use crate::eval::{Scope, Value};

/// What a piece is given beside its shape.
const PLACE: [&str; 2] = ["at", "with"];

impl<'a> Elaborator<'a> {
    /// Reads `mesh` and `collision`; where an asset has no `shape`, either stands for it.
    pub(super) fn coverings(&mut self, id: InstanceId, out: &mut Geometry) {
        out.visual = self.given_shape(id, "mesh");
        if let Some(setting) = self.instances[id.0 as usize].setting("collision")
            && let FieldValue::Expr(e) = setting.value()
        {
            let mut scope = setting.scope();
            let pieces = match &*e.kind {
                ExprKind::List(pieces) => pieces.iter().collect(),
                _ => vec![e],
            };
            if pieces.is_empty() {
                let headline = "`collision` must be a shape or a list of shapes";
                let d = Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "empty list");
                self.report(d.help("remove it if `shape` is also the shape for collisions"));
            }
            out.collision = pieces.into_iter().filter_map(|piece| self.piece(id, piece, &mut scope)).collect();
        }
        if out.shape.is_none() {
            out.shape = match out.collision.as_slice() {
                [one] if one.pose == Pose::IDENTITY => Some(one.shape.clone()),
                [] => out.visual.clone(),
                _ => None,
            };
        }
    }

    /// Judges what a lab gives for its instances; what their assets give is judged where those are declared.
    pub fn judge_coverings(&mut self) {
        const KEYS: [&str; 3] = ["mesh", "collision", "inertia"];
        for index in 0..self.instances.len() as u32 {
            let id = InstanceId(index);
            let given = |key: &&str| self.instances[index as usize].setting(key).is_some_and(|s| s.lab);
            if KEYS.iter().any(given) {
                let geometry = self.geometry(id);
                self.inertial(id, &geometry);
            }
        }
    }

    /// A shape with the place that is given in it: `box(20 mm, 20 mm, 5 mm, at: (0, 0, 10) mm)`.
    fn piece(&mut self, id: InstanceId, e: &'a Expr, scope: &mut Scope) -> Option<Solid> {
        let shape = self.placed_shape(id, e, scope)?;
        let mut place: [Option<&'a Expr>; 2] = [None, None];
        for arg in placing(call(e).map_or(&[], |(_, args)| args)) {
            let which = usize::from(arg.name.as_ref().is_some_and(|name| name.text == PLACE[1]));
            place[which] = Some(&arg.value);
        }
        let position = match place[0] {
            None => [0.0; 3],
            Some(at) => match self.expr(at, scope) {
                Value::Tuple(items) => self.position(&items, at)?,
                other => {
                    self.expected("a position `(x, y, z) mm`", &other, at.span);
                    return None;
                }
            },
        };
        let rpy = match place[1] {
            None => [0.0; 3],
            Some(turned) => self.turned(turned, scope)?,
        };
        Some(Solid { shape, pose: Pose::turned(position, rpy) })
    }
}

/// The arguments of a shape that say where it is.
fn placing(args: &[Arg]) -> impl Iterator<Item = &Arg> {
    args.iter().filter(|arg| is_place(arg))
}

/// Whether an argument of a shape says where it is.
pub(super) fn is_place(arg: &Arg) -> bool {
    arg.name.as_ref().is_some_and(|name| PLACE.contains(&name.text.as_str()))
}
