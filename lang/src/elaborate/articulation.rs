//! Links and joints of an asset that comes from a description of a robot, and how it is set up.

use matterix_ir::robot::{Joint, JointKind, Robot};
use matterix_ir::scene::{Articulation, InstanceId, Solid};
use matterix_ir::{Diagnostic, Span, codes};

use super::joints::clothe;
use crate::ast::{AssetLine, ExprKind, FieldValue};
use crate::declare::Type;
use crate::eval::Value;
use crate::eval::lab::Elaborator;
use crate::eval::lab::instances::Setting;
use crate::near::{nearest, question};

impl<'a> Elaborator<'a> {
    /// Whether anything in the lab has links and joints.
    pub fn has_robots(&self) -> bool {
        let lines = |kind| self.tables.kinds.get(kind).into_iter().flat_map(|k| &k.lines);
        let mut kinds = self.instances.iter().flat_map(|i| &i.kinds);
        kinds.any(|kind| lines(kind).any(|(_, line)| matches!(line, AssetLine::Robot(..))))
    }

    /// What moves the links of an instance, if it has any; `solids` are those of its body that are on links.
    pub fn articulation(&mut self, id: InstanceId, solids: Vec<(u32, Solid)>) -> Option<Articulation> {
        let mut found = match self.declared_tree(id) {
            Some(robot) => {
                let home = vec![0.0; robot.joints.len()];
                Articulation { robot, tip: 0, home, base: 0, follows: Vec::new() }
            }
            None => self.imported(id)?,
        };
        clothe(&mut found.robot, solids);
        found.follows = self.follows(id, &found.robot);
        Some(found)
    }

    /// What moves the links that a description gives.
    fn imported(&mut self, id: InstanceId) -> Option<Articulation> {
        let kinds = self.instances[id.0 as usize].kinds.clone();
        let (robot, at) =
            kinds.iter().filter_map(|k| self.tables.kinds.get(k)).flat_map(|k| &k.lines).find_map(|(_, line)| {
                match line {
                    AssetLine::Robot(robot, at) => Some((&**robot, *at)),
                    _ => None,
                }
            })?;
        let last = (robot.links.len() as u32).saturating_sub(1);
        let tip = self.link(id, "tip", robot, last)?;
        // What a description carries beyond the tip, such as another gripper, is no part of the asset.
        let name = robot.links[tip as usize].name.clone();
        let robot = robot.cut_after(tip);
        let tip = robot.link(&name)?;
        let base = self.link(id, "base", &robot, 0)?;
        Some(Articulation { tip, home: self.home(id, &robot, at)?, base, follows: Vec::new(), robot })
    }

    /// The link that a field names.
    fn link(&mut self, id: InstanceId, field: &str, robot: &Robot, otherwise: u32) -> Option<u32> {
        let Some(setting) = self.instances[id.0 as usize].setting(field) else { return Some(otherwise) };
        let FieldValue::Expr(e) = setting.value() else { return None };
        let ExprKind::Text(text) = &*e.kind else {
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                format!(
                    "`{field}` must name a link: `{field}: \"{}\"`",
                    robot.links.last().map_or("tool0", |l| &l.name)
                ),
                "not a text",
            ));
            return None;
        };
        let found = robot.link(text);
        if found.is_none() {
            let close = nearest(text, robot.links.iter().map(|l| l.name.as_str()));
            let headline = format!("`{}` has no link `{text}`", robot.name);
            let d = Diagnostic::about(&robot.name, codes::UNKNOWN_NAME, e.span, headline, "no link of this robot");
            self.report(match question(&close) {
                Some(asked) => d.help(asked),
                None => d,
            });
        }
        found
    }

    /// Positions of the joints that move by themselves when the run begins.
    fn home(&mut self, id: InstanceId, robot: &Robot, at: Span) -> Option<Vec<f64>> {
        let moving: Vec<&Joint> =
            robot.joints.iter().filter(|j| j.kind != JointKind::Fixed && j.mimic.is_none()).collect();
        let setting = self.instances[id.0 as usize].setting("home");
        let (positions, span) = match setting {
            Some(setting) => (self.positions(setting, &moving)?, setting.field.span),
            None => (vec![0.0; moving.len()], at),
        };
        for (joint, position) in moving.iter().zip(&positions) {
            let Some(limits) = joint.limits.filter(|_| joint.kind != JointKind::Continuous) else { continue };
            if *position >= limits.lower && *position <= limits.upper {
                continue;
            }
            let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
            let range = format!("{} .. {} {unit}", limits.lower, limits.upper);
            self.report(match setting {
                Some(_) => Diagnostic::error(
                    codes::OUT_OF_RANGE,
                    span,
                    format!("joint `{}` cannot be at {position} {unit}", joint.name),
                    format!("its limits are {range}"),
                ),
                None => Diagnostic::error(
                    codes::MISSING_FIELD,
                    span,
                    format!("`home` is missing: joint `{}` cannot be at 0 {unit}", joint.name),
                    format!("its limits are {range}"),
                )
                .help("give the positions of all moving joints, in the order of the file: `home: (0, -45) deg`"),
            });
            return None;
        }
        Some(positions)
    }

    fn positions(&mut self, setting: Setting<'a>, moving: &[&Joint]) -> Option<Vec<f64>> {
        let FieldValue::Expr(e) = setting.value() else { return None };
        let items = match self.expr(e, &mut setting.scope()) {
            Value::Tuple(items) | Value::List(items) => items,
            Value::Error => return None,
            one => vec![one],
        };
        if items.len() != moving.len() {
            let names: Vec<&str> = moving.iter().map(|j| j.name.as_str()).collect();
            self.report(
                Diagnostic::error(
                    codes::WRONG_ARGUMENTS,
                    e.span,
                    format!("`home` gives {} positions for {} moving joints", items.len(), moving.len()),
                    "the numbers differ",
                )
                .help(format!("in this order: {}", names.join(", "))),
            );
            return None;
        }
        let mut out = Vec::new();
        for (item, joint) in items.into_iter().zip(moving) {
            let dimension = if joint.kind == JointKind::Prismatic { "Length" } else { "Angle" };
            let ty = Type::Quantity { dimension: self.tables.units.named(dimension), point: false, optional: false };
            let Value::Num(n) = self.coerce(item, &ty, e.span, "home") else { return None };
            out.push(self.known(n.node)?);
        }
        Some(out)
    }
}
