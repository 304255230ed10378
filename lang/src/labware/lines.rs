//! A definition as lines of an asset: its shape and its grid, one line for all places that are alike and evenly spaced.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::Span;

use super::definition::{Definition, Opening, Well};
use crate::ast::{Arg, AssetLine, AssetLiteral, At, Expr, ExprKind, Field, FieldValue, Grid, Name, Path, UnitText};
use crate::eval::lab::grids::Place;

/// Unevenness below which places are evenly spaced, mm: definitions are rounded to hundredths.
const EVEN: f64 = 0.02;

/// Walls of tips and the free room about them in their racks, mm, and how wide the end of a tip is of its top: estimates.
const TIP_WALL: f64 = 0.6;
const TIP_PLAY: f64 = 0.2;
const TIP_END: f64 = 0.2;

/// The lines a definition stands for, with its text where a robot takes that; all of them point to where its file is named.
pub(super) fn of(definition: &Definition, text: Option<&str>, at: Span) -> Vec<AssetLine> {
    let write = Writer { definition, at };
    let mut lines: Vec<AssetLine> = definition.size.map(|size| write.body(&size)).into_iter().collect();
    let known_by = definition.uri.clone().map(|uri| write.expr(ExprKind::Text(uri)));
    lines.extend(known_by.map(|uri| AssetLine::Field(write.field("definition", uri))));
    let whole = text.map(|text| write.expr(ExprKind::Text(unbroken(text))));
    lines.extend(whole.map(|whole| AssetLine::Field(write.field("described", whole))));
    lines.extend(write.grids().into_iter().map(AssetLine::Grid));
    lines
}

/// JSON as one word: without blanks between its signs, and with those in its texts, and single quotes, as their numbers.
fn unbroken(json: &str) -> String {
    let (mut out, mut quoted, mut escaped) = (String::with_capacity(json.len()), false, false);
    for c in json.chars() {
        match c {
            ' ' if quoted => out.push_str("\\u0020"),
            '\'' => out.push_str("\\u0027"),
            c if !quoted && c.is_ascii_whitespace() => {}
            c => out.push(c),
        }
        quoted ^= c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
    }
    out
}

struct Writer<'d> {
    definition: &'d Definition,
    at: Span,
}

/// Places with what stands there.
type Places<'d> = BTreeMap<Place, &'d Well>;

impl<'d> Writer<'d> {
    fn grids(&self) -> Vec<Grid> {
        let mut alike: Vec<Places<'d>> = Vec::new();
        let wells = self.definition.wells.iter().filter_map(|(name, well)| Some((Place::parse(name)?, well)));
        for (place, well) in wells.collect::<Places<'d>>() {
            let group = alike.iter_mut().find(|g| g.values().next().is_some_and(|w| w.is_like(well)));
            match group {
                Some(group) => {
                    group.insert(place, well);
                }
                None => alike.push(BTreeMap::from([(place, well)])),
            }
        }
        let mut out = Vec::new();
        for group in alike {
            match self.pitch(&group) {
                Some(pitch) => out.extend(self.line(&group, Some(pitch))),
                None => out.extend(group.into_iter().filter_map(|one| self.line(&BTreeMap::from([one]), None))),
            }
        }
        out
    }

    /// From column to column and row to row, mm, where the places fill an even rectangle.
    fn pitch(&self, group: &Places<'d>) -> Option<[f64; 2]> {
        let rows: BTreeSet<u32> = group.keys().map(|p| p.row.unwrap_or(0)).collect();
        let columns: BTreeSet<u32> = group.keys().map(|p| p.column).collect();
        let (first, last) = (group.first_key_value()?, group.last_key_value()?);
        let across = |set: &BTreeSet<u32>| set.last().zip(set.first()).map_or(0, |(b, a)| b - a);
        let (wide, deep) = (across(&columns), across(&rows));
        let whole = (wide as usize + 1) * (deep as usize + 1) == group.len();
        let [x, y, _] = first.1.at;
        let [right, front, _] = last.1.at;
        let step = |over: f64, count: u32| if count == 0 { 0.0 } else { over / f64::from(count) };
        let pitch = [step(right - x, wide), step(y - front, deep)];
        let even = group.iter().all(|(place, well)| {
            let (column, row) =
                (place.column - first.0.column, place.row.unwrap_or(0) as f64 - first.0.row.unwrap_or(0) as f64);
            let [at_x, at_y, _] = well.at;
            (x + f64::from(column) * pitch[0] - at_x).abs() < EVEN && (y - row * pitch[1] - at_y).abs() < EVEN
        });
        (whole && even).then_some(pitch)
    }

    fn line(&self, group: &Places<'d>, pitch: Option<[f64; 2]>) -> Option<Grid> {
        let ((from, well), (to, _)) = (group.first_key_value()?, group.last_key_value()?);
        let (grid, kind) = if self.definition.has_tips { ("tips", "Tip") } else { ("wells", "Well") };
        let volume = self.quantity(well.volume, "uL");
        let mut fields = vec![self.field("max_volume", volume)];
        fields.extend(self.shapes(well));
        if self.definition.has_tips {
            fields.extend(well.reach.map(|reach| self.field("reach", self.quantity(reach, "mm"))));
        } else {
            let sides = well.opening.map(Opening::sizes);
            fields.extend(sides.map(|[_, deep]| self.field("mouth", self.quantity(deep, "mm"))));
            let oblong = sides.filter(|[wide, deep]| wide != deep);
            fields.extend(oblong.map(|[wide, _]| self.field("breadth", self.quantity(wide, "mm"))));
        }
        let ty = Path { segments: vec![self.name(kind)], span: self.at };
        Some(Grid {
            name: self.name(grid),
            from: self.name(&from.to_string()),
            to: (from != to).then(|| self.name(&to.to_string())),
            literal: AssetLiteral { ty, fields, span: self.at },
            at: Some(self.lengths(&well.at)),
            pitch: pitch.map(|p| self.lengths(&p)),
            row: None,
        })
    }

    /// The hole that a place is; of a tip, its body as well.
    fn shapes(&self, well: &Well) -> Vec<Field> {
        // A bin's definition gives its one place no depth.
        let Some(opening) = well.opening.filter(|_| well.depth > 0.0) else { return Vec::new() };
        match (opening, &well.inside) {
            (Opening::Round(diameter), _) if self.definition.has_tips => self.tip(diameter, well.depth),
            // A hole with its wall: outside and inside are the same.
            (Opening::Round(_), Some(inside)) => {
                let outline = || self.outline(inside.points());
                vec![self.call("room", "turned", vec![outline(), outline()])]
            }
            (Opening::Round(diameter), None) => vec![self.shape("room", "cylinder", &[diameter, well.depth])],
            (Opening::Square([x, y]), inside) => {
                let inside = inside.as_ref().map(|inside| {
                    let outline = || self.outline(inside.points());
                    self.call("inside", "turned", vec![outline(), outline()])
                });
                std::iter::once(self.shape("room", "box", &[x, y, well.depth])).chain(inside).collect()
            }
        }
    }

    /// Radius and height of each point.
    fn outline(&self, points: &[[f64; 2]]) -> Expr {
        self.expr(ExprKind::List(points.iter().map(|point| self.lengths(point)).collect()))
    }

    fn name(&self, text: &str) -> Name {
        Name { text: text.to_string(), span: self.at }
    }

    fn expr(&self, kind: ExprKind) -> Expr {
        Expr { kind: Box::new(kind), span: self.at }
    }

    fn unit(&self, text: &str) -> UnitText {
        UnitText { text: text.to_string(), span: self.at }
    }

    fn quantity(&self, value: f64, unit: &str) -> Expr {
        self.expr(ExprKind::Quantity(value, self.unit(unit)))
    }

    fn lengths(&self, values: &[f64]) -> Expr {
        let items = values.iter().map(|v| self.expr(ExprKind::Number(*v))).collect();
        self.expr(ExprKind::Tuple(items, Some(self.unit("mm"))))
    }

    fn field(&self, key: &str, value: Expr) -> Field {
        Field { key: self.name(key), value: FieldValue::Expr(value), span: self.at }
    }

    /// Its body: in the middle of its place, or beside that.
    fn body(&self, size: &[f64; 3]) -> AssetLine {
        let [x, y] = self.definition.aside;
        if self.definition.aside == [0.0; 2] {
            return AssetLine::Field(self.shape("shape", "box", size));
        }
        let at = At { position: self.lengths(&[x, y, 0.0]), from: None, turned: None };
        AssetLine::Solid { shape: self.form("box", self.sizes(size)), at: Some(at) }
    }

    /// `shape: box(x, y, z)`.
    fn shape(&self, field: &str, kind: &str, sizes: &[f64]) -> Field {
        self.call(field, kind, self.sizes(sizes))
    }

    fn sizes(&self, sizes: &[f64]) -> Vec<Expr> {
        sizes.iter().map(|s| self.quantity(*s, "mm")).collect()
    }

    fn call(&self, field: &str, kind: &str, args: Vec<Expr>) -> Field {
        self.field(field, self.form(kind, args))
    }

    /// `box(x, y, z)`.
    fn form(&self, kind: &str, args: Vec<Expr>) -> Expr {
        let args = args.into_iter().map(|value| Arg { name: None, value }).collect();
        let callee = self.expr(ExprKind::Name(self.name(kind)));
        self.expr(ExprKind::Call(callee, args))
    }

    /// A tip and the hole it stands in: a cone with a wall, open at both ends, as wide inside at its top as its definition
    /// says.
    fn tip(&self, diameter: f64, depth: f64) -> Vec<Field> {
        let (bore, end) = (diameter / 2.0, diameter / 2.0 * TIP_END);
        let outline = |wall: f64| self.outline(&[[end + wall, 0.0], [bore + wall, depth]]);
        let hole = self.shape("room", "cylinder", &[diameter + 2.0 * (TIP_WALL + TIP_PLAY), depth]);
        vec![self.call("shape", "turned", vec![outline(TIP_WALL), outline(0.0)]), hole]
    }
}
