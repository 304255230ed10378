//! Where things are and how they are shaped: poses, frames, shapes.

use std::sync::Arc;

use matterix_ir::mesh::Mesh;
use matterix_ir::outline::{radius_at, sticks_out};
use matterix_ir::quantity::show_number;
use matterix_ir::scene::{Frame, InstanceId, Pose, Shape, Solid, frame};
use matterix_ir::{Diagnostic, Span, codes};

use super::Elaborator;
use super::coverings::is_place;
use super::extents::LONGEST;
use super::instances::Setting;
use crate::ast::{Arg, AssetLine, At, Expr, ExprKind, FieldValue, MemberKind, Name};
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::near::{nearest, question, unknown};

/// The shapes and what they are given.
const SHAPES: &[(&str, &str)] = &[
    ("box", "three lengths: `box(x, y, z)`"),
    ("cylinder", "diameter and height: `cylinder(70 mm, 95 mm)`"),
    ("sphere", "a diameter: `sphere(20 mm)`"),
    ("mesh", "a file and how long one unit of it is: `mesh(\"bottle.stl\", 1 mm)`"),
    ("vessel", "diameter, height, wall and floor: `vessel(70 mm, 95 mm, 1.5 mm, 2 mm)`"),
    (
        "turned",
        "radius and height along the outside and the inside: `turned([(0, 0) mm, (35, 0) mm, (35, 95) mm], [])`",
    ),
];

/// Points that every shape has: the middle of its top, of its body, and of the edge of its top in the direction of x.
const POINTS: &[&str] = &["top", "middle", "rim"];

/// What an asset's body is made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Named points.
    pub frames: Vec<Frame>,
    /// The main shape.
    pub shape: Option<Shape>,
    /// More of it.
    pub solids: Vec<Solid>,
    /// What it takes out of what it is a part of.
    pub room: Option<Shape>,
    /// A turned shape with an inside as wide at every height as its own, which is not round.
    pub inside: Option<Shape>,
    /// More of it on links that move, by index.
    pub moving: Vec<(u32, Solid)>,
    /// What others run into instead of shape and solids.
    pub collision: Vec<Solid>,
    /// What is seen instead of them.
    pub visual: Option<Shape>,
}

/// What parts of things are alike by: how many instances there were, their kinds, the lab they stand in, and the places of the
/// fields given for them, each with its module, whether it stands in a lab, and the instance whose names it sees, if that is
/// another one.
pub type Alike = (usize, Vec<DeclId>, String, Vec<(usize, usize, bool, Option<Option<InstanceId>>)>);

impl<'a> Elaborator<'a> {
    /// Frames and shapes of an instance; found once for all wells of a plate, as they have them from the same text.
    pub fn geometry(&mut self, id: InstanceId) -> Geometry {
        let alike = self.shaped_like(id);
        if let Some(known) = alike.as_ref().and_then(|alike| self.known_geometries.get(alike)) {
            return known.clone();
        }
        let reported = self.reported;
        let found = self.find_geometry(id);
        if let Some(alike) = alike.filter(|_| self.reported == reported) {
            self.known_geometries.insert(alike, found.clone());
        }
        found
    }

    /// What of a part of something its geometry depends on.
    fn shaped_like(&self, id: InstanceId) -> Option<Alike> {
        let instance = &self.instances[id.0 as usize];
        let told = |s: &Setting<'a>| {
            let of = s.of.map(|of| if of == id { None } else { Some(of) });
            (std::ptr::from_ref(s.field) as usize, s.module, s.lab, of)
        };
        instance.owner?;
        let settings = instance.settings.iter().map(told).collect();
        Some((self.instances.len(), instance.kinds.clone(), instance.within.clone(), settings))
    }

    fn find_geometry(&mut self, id: InstanceId) -> Geometry {
        let mut out = Geometry::default();
        out.room = self.given_shape(id, "room");
        out.inside = self.given_shape(id, "inside");
        // What is nothing but room has its points where that is.
        out.shape = self.given_shape(id, "shape").or_else(|| out.room.clone());
        self.coverings(id, &mut out);
        out.frames = self.frames(id, out.shape.as_ref());
        for (module, line) in self.lines(id) {
            let AssetLine::Solid { shape, at } = line else { continue };
            let mut scope = Scope::of(id, module);
            let Some(shape) = self.shape(id, shape, &mut scope) else { continue };
            let place = match at {
                Some(at) => self.pose(id, at, &out, &mut scope),
                None => Some((Pose::IDENTITY, false, None)),
            };
            match place {
                Some((pose, _, Some(link))) => out.moving.push((link, Solid { shape, pose })),
                Some((pose, ..)) => out.solids.push(Solid { shape, pose }),
                None => {}
            }
        }
        out
    }

    /// The shape that a field gives.
    pub(super) fn given_shape(&mut self, id: InstanceId, field: &str) -> Option<Shape> {
        let setting = self.instances[id.0 as usize].setting(field)?;
        let FieldValue::Expr(e) = setting.value() else { return None };
        self.shape(id, e, &mut setting.scope())
    }

    /// The lines of an asset and of those it builds on.
    pub fn lines(&self, id: InstanceId) -> Vec<(usize, &'a AssetLine)> {
        let kinds = &self.instances[id.0 as usize].kinds;
        kinds.iter().filter_map(|k| self.tables.kinds.get(k)).flat_map(|k| k.lines.iter().copied()).collect()
    }

    /// The frames of an asset's lines, then those its capabilities give where it gives none.
    fn frames(&mut self, id: InstanceId, shape: Option<&Shape>) -> Vec<Frame> {
        let mut given: Vec<(usize, &'a Name, &'a At)> = Vec::new();
        for (module, line) in self.lines(id) {
            if let AssetLine::Frame { name, at } = line {
                given.push((module, name, at));
            }
        }
        for m in self.all_members(id).iter().copied() {
            if let MemberKind::Frame { name, at: Some(at) } = &m.member.kind {
                given.push((m.module, name, at));
            }
        }
        let mut first: Vec<(usize, &'a Name, &'a At)> = Vec::new();
        for one in given {
            if !first.iter().any(|f| f.1.text == one.1.text) {
                first.push(one);
            }
        }
        // A frame may be given in one that stands further down: as many rounds as there are frames settle all.
        let mut done = Geometry { shape: shape.cloned(), ..Geometry::default() };
        let mut waiting = first;
        while !waiting.is_empty() {
            let before = waiting.len();
            let (ready, rest): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|(_, _, at)| {
                let given = |from: &Name| from.text == frame::STAND || done.frames.iter().any(|f| f.name == from.text);
                at.from.as_ref().is_none_or(|from| given(from) || self.link_of(id, from).is_some())
            });
            for (module, name, at) in ready {
                if let Some((pose, stand, link)) = self.pose(id, at, &done, &mut Scope::of(id, module)) {
                    done.frames.push(Frame { name: name.text.clone(), pose, stand, link });
                }
            }
            waiting = rest;
            if waiting.len() == before {
                break;
            }
        }
        for (_, name, at) in &waiting {
            let next = |name: &str| {
                let (.., at) = waiting.iter().find(|(_, n, _)| n.text == name)?;
                at.from.as_ref().map(|from| from.text.as_str())
            };
            let leads = std::iter::successors(next(&name.text), |n| next(n)).take(waiting.len());
            if let Some(from) = at.from.as_ref().filter(|_| leads.into_iter().any(|n| n == name.text)) {
                self.report(Diagnostic::error(
                    codes::CIRCULAR,
                    from.span,
                    format!("the position of `{}` depends on itself", name.text),
                    "leads back to it",
                ));
                continue;
            }
            // Without an asset's own lines, the frame it starts from may be one that only an asset gives.
            if let Some(from) = at.from.as_ref().filter(|f| self.frame_is_missing(id, f)) {
                let close = nearest(&from.text, done.frames.iter().map(|f| f.name.as_str()));
                let d = unknown(from, format!("no frame `{}` to start from", from.text), "not a frame of this asset");
                self.report(match question(&close) {
                    Some(asked) => d.help(asked),
                    None => d,
                });
            }
        }
        done.frames
    }

    /// Whether nothing declares a frame.
    fn frame_is_missing(&self, id: InstanceId, name: &Name) -> bool {
        self.frame(id, &name.text).is_none()
            && !self
                .all_members(id)
                .iter()
                .any(|m| matches!(&m.member.kind, MemberKind::Frame { name: n, .. } if n.text == name.text))
    }

    /// A pose in the frame it names, whether that is where the thing last stood, and the link that it is on.
    fn pose(
        &mut self,
        id: InstanceId,
        at: &'a At,
        of: &Geometry,
        scope: &mut Scope,
    ) -> Option<(Pose, bool, Option<u32>)> {
        let local = self.local(at, of, scope)?;
        match &at.from {
            None => Some((local, false, None)),
            Some(from) if from.text == frame::STAND => Some((local, true, None)),
            Some(from) => match of.frames.iter().find(|f| f.name == from.text) {
                Some(base) => Some((base.pose.then(local), base.stand, base.link)),
                None => self.link_of(id, from).map(|link| (local, false, Some(link))),
            },
        }
    }

    /// A pose in whatever frame it is given in.
    pub fn local(&mut self, at: &'a At, of: &Geometry, scope: &mut Scope) -> Option<Pose> {
        let position = match (&*at.position.kind, &of.shape) {
            (ExprKind::Name(name), shape) if POINTS.contains(&name.text.as_str()) => {
                let shape = shape.as_ref()?;
                let height = shape.size()[2];
                match name.text.as_str() {
                    "top" => [0.0, 0.0, height],
                    "rim" => [shape.rim(), 0.0, height],
                    _ => [0.0, 0.0, height / 2.0],
                }
            }
            _ => match self.expr(&at.position, scope) {
                Value::Tuple(items) => self.position(&items, &at.position)?,
                other => {
                    self.expected("a position `(x, y, z) mm`, `top`, `middle` or `rim`", &other, at.position.span);
                    return None;
                }
            },
        };
        let rpy = match &at.turned {
            Some(turned) => self.turned(turned, scope)?,
            None => [0.0; 3],
        };
        Some(Pose::turned(position, rpy))
    }

    /// `rpy(0 deg, 0 deg, 90 deg)`: roll, pitch and yaw in rad.
    pub fn turned(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<[f64; 3]> {
        let wrong = |this: &mut Self| {
            this.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                "expected roll, pitch and yaw: `rpy(0 deg, 0 deg, 90 deg)`",
                "not a rotation",
            ));
            None
        };
        let Some(("rpy", args)) = call(e) else { return wrong(self) };
        if args.len() != 3 {
            return wrong(self);
        }
        let mut out = [0.0; 3];
        for (slot, arg) in out.iter_mut().zip(args) {
            *slot = self.figure(&arg.value, "Angle", "rpy", scope)?;
        }
        Some(out)
    }

    pub(super) fn shape(&mut self, id: InstanceId, e: &'a Expr, scope: &mut Scope) -> Option<Shape> {
        if let Some(arg) = call(e).and_then(|(_, args)| args.iter().find(|arg| is_place(arg))) {
            let headline = "only pieces of `collision` take a place";
            let d = Diagnostic::error(codes::WRONG_ARGUMENTS, arg.value.span, headline, "not here");
            self.report(d.help("a line `solid box(...) at (x, y, z) mm` adds a piece somewhere else"));
            return None;
        }
        self.placed_shape(id, e, scope)
    }

    /// A shape; what its arguments say of its place is left to the caller.
    pub(super) fn placed_shape(&mut self, id: InstanceId, e: &'a Expr, scope: &mut Scope) -> Option<Shape> {
        let found = call(e).and_then(|(name, args)| {
            let known = SHAPES.iter().find(|(n, _)| *n == name);
            known.map(|(name, given)| (*name, *given, args.iter().filter(|arg| !is_place(arg)).collect::<Vec<_>>()))
        });
        let Some((name, given, args)) = found else {
            let names: Vec<String> = SHAPES.iter().map(|(n, _)| format!("`{n}`")).collect();
            self.report(
                Diagnostic::error(codes::TYPE_MISMATCH, e.span, "expected a shape", "not a shape")
                    .help(format!("one of {}", names.join(", "))),
            );
            return None;
        };
        let shape = match name {
            "mesh" => match args.as_slice() {
                [file] => return self.mesh(id, e.span, &file.value, None),
                [file, unit] => {
                    let unit = self.extent(&unit.value, name, 0, scope)?;
                    return self.mesh(id, e.span, &file.value, Some(unit));
                }
                _ => None,
            },
            "turned" => match args.as_slice() {
                [outside, inside] => {
                    let (outside, within) = (self.outline(&outside.value, scope)?, inside.value.span);
                    let inside = self.outline(&inside.value, scope)?;
                    if let Some(point) = sticks_out(&outside, &inside) {
                        self.sticks_out(point, &outside, within);
                        return None;
                    }
                    Some(Shape::Turned { outside, inside })
                }
                _ => None,
            },
            _ => {
                let mut lengths = Vec::new();
                for (index, arg) in args.into_iter().enumerate() {
                    lengths.push(self.extent(&arg.value, name, index, scope)?);
                }
                match (name, lengths.as_slice()) {
                    ("box", [x, y, z]) => Some(Shape::Box([*x, *y, *z])),
                    ("cylinder", [d, h]) => Some(Shape::Cylinder([*d, *h])),
                    ("sphere", [d]) => Some(Shape::Sphere(*d)),
                    ("vessel", [d, h, wall, floor]) => return self.vessel([*d, *h, *wall, *floor], e.span),
                    _ => None,
                }
            }
        };
        if shape.is_none() {
            self.report(Diagnostic::about(
                name,
                codes::WRONG_ARGUMENTS,
                e.span,
                format!("`{name}` takes {given}"),
                "other arguments",
            ));
        }
        shape
    }

    /// The mesh in a file, of which one unit is so long, m.
    pub(super) fn mesh(&mut self, id: InstanceId, span: Span, file: &'a Expr, unit: Option<f64>) -> Option<Shape> {
        let ExprKind::Text(name) = &*file.kind else {
            let d = Diagnostic::error(codes::TYPE_MISMATCH, file.span, "`mesh` needs the name of a file", "not a text");
            self.report(d.help("`mesh(\"bottle.stl\", 1 mm)`"));
            return None;
        };
        let read = self.lines(id).into_iter().find_map(|(_, line)| match line {
            AssetLine::Mesh(at, mesh) if *at == file.span => Some(mesh.as_ref()),
            _ => None,
        });
        let Some(read) = read else {
            let headline = "a mesh must be given in the declaration of its asset";
            self.report(Diagnostic::error(codes::UNSUPPORTED, file.span, headline, "not here"));
            return None;
        };
        // What cannot be read has been reported.
        let mesh = read?;
        let unit = match (unit, matterix_mesh::is_metric(name)) {
            (Some(unit), _) => unit,
            (None, Some(true)) => 1.0,
            (None, _) => {
                let d = Diagnostic::about(
                    name,
                    codes::WRONG_ARGUMENTS,
                    span,
                    format!("the file `{name}` does not give its unit of length"),
                    "the length of one unit is missing",
                );
                self.report(d.help(format!("write `mesh(\"{name}\", 1 mm)` if it is drawn in millimetres")));
                return None;
            }
        };
        let mesh = Mesh::clone(mesh).scaled([unit; 3]).grounded();
        self.is_of_size(name, mesh.size(), span).then(|| Shape::Mesh(Arc::new(mesh)))
    }

    /// A straight beaker: an open cylinder with a wall and a floor.
    fn vessel(&mut self, [d, h, wall, floor]: [f64; 4], span: Span) -> Option<Shape> {
        let (r, hole) = (d / 2.0, d / 2.0 - wall);
        if hole <= 0.0 || floor >= h {
            self.report(Diagnostic::error(
                codes::OUT_OF_RANGE,
                span,
                "its wall and floor leave no room inside",
                "no room inside",
            ));
            return None;
        }
        Some(Shape::Turned {
            outside: vec![[0.0, 0.0], [r, 0.0], [r, h]],
            inside: vec![[0.0, floor], [hole, floor], [hole, h]],
        })
    }

    /// Reports an inside that is wider or taller than what is around it.
    fn sticks_out(&mut self, [r, z]: [f64; 2], outside: &[[f64; 2]], span: Span) {
        let mm = |v: f64| show_number((v * 1e6).round() / 1e3);
        let label = match radius_at(outside, z) {
            Some(around) => format!(
                "at a height of {} mm its radius is {} mm, but that of the outside is {} mm",
                mm(z),
                mm(r),
                mm(around)
            ),
            None => format!("it has a point at a height of {} mm, above or below the outside", mm(z)),
        };
        let headline = "the inside of this shape is wider or taller than its outside";
        let d = Diagnostic::error(codes::OUT_OF_RANGE, span, headline, label);
        self.report(d.help("write each point as radius and height, the outside first"));
    }

    /// Points of radius and height, m, no radius below 0, from the bottom up.
    fn outline(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Vec<[f64; 2]>> {
        let ExprKind::List(points) = &*e.kind else {
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                "expected a list of points: `[(0, 0) mm, (35, 0) mm, (35, 95) mm]`",
                "not a list",
            ));
            return None;
        };
        let mut out: Vec<[f64; 2]> = Vec::new();
        for point in points {
            let Value::Tuple(items) = self.expr(point, scope) else { return None };
            let [r, z, _] = self.position(&items, point)?;
            if r.abs().max(z.abs()) > LONGEST {
                let headline = format!("this point of an outline is more than {LONGEST} m away");
                self.report(Diagnostic::error(codes::OUT_OF_RANGE, point.span, headline, "too far away"));
                return None;
            }
            if r < 0.0 || items.len() != 2 || out.last().is_some_and(|last| z < last[1]) {
                self.report(Diagnostic::error(
                    codes::OUT_OF_RANGE,
                    point.span,
                    "write each point of an outline as radius and height, from the bottom up",
                    "not such a point",
                ));
                return None;
            }
            out.push([r, z]);
        }
        Some(out)
    }
}

/// `NAME(...)`.
pub(super) fn call(e: &Expr) -> Option<(&str, &[Arg])> {
    let ExprKind::Call(callee, args) = &*e.kind else { return None };
    let ExprKind::Name(name) = &*callee.kind else { return None };
    Some((name.text.as_str(), args))
}
