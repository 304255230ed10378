//! Grids of child assets: their places, what stands there, and what `plate[A1]`, `plate[A1 .. H1]` and `plate.rows` mean.

use std::collections::BTreeMap;
use std::fmt;

use matterix_ir::quantity::show_number;
use matterix_ir::scene::{InstanceId, Pose};
use matterix_ir::{Diagnostic, Span, codes};

use super::Elaborator;
use super::instances::Setting;
use crate::ast::{self, AssetLine, Expr, FieldValue, Name};
use crate::declare::Type;
use crate::eval::{Decided, Scope, Value};
use crate::names::DeclId;

/// More places than any plate has; what is beyond is a slip of the pen.
const MOST: u32 = 2000;

/// More things than any lab has: a grid of grids of grids grows fast.
const MOST_PARTS: usize = 20_000;

/// A place of a grid. Places are ordered by columns, as pipettes with eight channels work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// From 0, left to right.
    pub column: u32,
    /// From 0, back to front; none where places are only numbered.
    pub row: Option<u32>,
}

impl Place {
    /// `A1`, `H12`, `AF48`, or a number alone.
    pub fn parse(text: &str) -> Option<Place> {
        let letters = text.len() - text.trim_start_matches(|c: char| c.is_ascii_uppercase()).len();
        let (row, column) = text.split_at(letters);
        let number = column.bytes().all(|b| b.is_ascii_digit()) && !column.starts_with('0') && column.len() <= 4;
        let column: u32 = column.parse().ok().filter(|c| number && *c > 0)?;
        let row = match row.len() {
            0 => None,
            1 | 2 => Some(row.bytes().fold(0, |n, b| n * 26 + u32::from(b - b'A') + 1) - 1),
            _ => return None,
        };
        Some(Place { column: column - 1, row })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = |n: u32| char::from(b'A' + (n % 26) as u8);
        match self.row {
            Some(row) if row >= 26 => write!(f, "{}{}", letter(row / 26 - 1), letter(row))?,
            Some(row) => write!(f, "{}", letter(row))?,
            None => {}
        }
        write!(f, "{}", self.column + 1)
    }
}

/// The children of an instance in one grid.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    /// Its name.
    pub name: String,
    /// What stands where, column by column.
    pub children: BTreeMap<Place, InstanceId>,
}

impl Grid {
    /// Whether places are lettered and numbered, not only numbered.
    fn lettered(&self) -> bool {
        self.children.keys().next().is_some_and(|p| p.row.is_some())
    }

    /// `A1 .. H12`.
    fn extent(&self) -> String {
        match (self.children.keys().next(), self.children.keys().next_back()) {
            (Some(first), Some(last)) if first != last => format!("{first} .. {last}"),
            (Some(only), _) => only.to_string(),
            _ => "nothing".into(),
        }
    }

    /// Everything, column by column.
    pub fn all(&self) -> Vec<InstanceId> {
        self.children.values().copied().collect()
    }

    /// The children in groups, each with its number from 1.
    fn groups(&self, of: impl Fn(&Place) -> u32) -> Vec<Vec<InstanceId>> {
        let mut out: BTreeMap<u32, Vec<InstanceId>> = BTreeMap::new();
        for (place, child) in &self.children {
            out.entry(of(place)).or_default().push(*child);
        }
        out.into_values().collect()
    }

    fn rows(&self) -> Vec<Vec<InstanceId>> {
        self.groups(|p| p.row.unwrap_or(0))
    }

    fn columns(&self) -> Vec<Vec<InstanceId>> {
        self.groups(|p| p.column)
    }
}

fn list(children: Vec<InstanceId>) -> Value {
    Value::List(children.into_iter().map(Value::Instance).collect())
}

fn lists(groups: Vec<Vec<InstanceId>>) -> Value {
    Value::List(groups.into_iter().map(list).collect())
}

impl<'a> Elaborator<'a> {
    /// Makes the children of one grid line of an instance.
    pub fn make_grid(&mut self, id: InstanceId, module: usize, line: &'a ast::Grid) {
        let Some(places) = self.line_places(line) else { return };
        let Some(kind) = self.kind_named(&line.literal.ty, module) else { return };
        if self.leads_back(id, kind, line.literal.ty.span) {
            return;
        }
        let Some(layout) = self.layout(id, module, line) else { return };
        if self.instances.len() + places.len() > MOST_PARTS {
            let headline = format!("a lab has at most {MOST_PARTS} things and parts");
            self.report(Diagnostic::error(
                codes::OUT_OF_RANGE,
                line.name.span,
                headline,
                "too many together with these",
            ));
            return;
        }
        let given = self.given_to_all(id, &line.name, kind);
        let position = self.instances[id.0 as usize].grids.iter().position(|g| g.name == line.name.text);
        let index = position.unwrap_or_else(|| {
            let grids = &mut self.instances[id.0 as usize].grids;
            grids.push(Grid { name: line.name.text.clone(), children: BTreeMap::new() });
            grids.len() - 1
        });
        let owner = self.instances[id.0 as usize].name.clone();
        let (corner, many, mut twice) = (places[0], places.len() > 1, None);
        for place in places {
            let name = match place.row {
                Some(_) if index == 0 => format!("{owner}[{place}]"),
                _ => format!("{owner}.{}[{place}]", line.name.text),
            };
            let of = Some(id);
            let mut settings = given.clone();
            settings.extend(line.literal.fields.iter().map(|field| Setting { module, field, lab: false, of }));
            let child = self.instantiate(name, vec![kind], settings, of, line.literal.span);
            self.instances[child.0 as usize].pose = layout.pose(corner, place);
            self.instances[child.0 as usize].at = line.at.as_ref().map(|at| at.span);
            self.instances[child.0 as usize].one_of_many = many;
            if self.instances[id.0 as usize].grids[index].children.insert(place, child).is_some() {
                twice = Some(place);
            }
        }
        if let Some(place) = twice {
            self.report(Diagnostic::error(
                codes::DUPLICATE_NAME,
                line.name.span,
                format!("`{}[{place}]` is declared twice", line.name.text),
                "declared again here",
            ));
        }
    }

    /// `wells: { max_volume: 300 uL }` of an instance: fields for all children of a grid, stronger than those of its line.
    fn given_to_all(&mut self, id: InstanceId, grid: &Name, kind: DeclId) -> Vec<Setting<'a>> {
        let mut given = Vec::new();
        let settings = self.instances[id.0 as usize].settings.iter().filter(|s| s.field.key.text == grid.text);
        for setting in settings.copied().collect::<Vec<_>>() {
            match setting.value() {
                FieldValue::Fields(fields) => {
                    self.check_fields(kind, fields);
                    given.extend(fields.iter().map(|field| Setting { field, ..setting }));
                }
                _ => self.report(
                    Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        setting.field.span,
                        format!("`{}` is a grid: it takes fields, not one value", grid.text),
                        "not fields",
                    )
                    .help(format!("give fields for all of its children: `{}: {{ ... }}`", grid.text)),
                ),
            }
        }
        given
    }

    /// `part wells: List<Well>` asks for a grid of that name; a stand-in gets one of one place.
    pub fn check_grid(&mut self, id: InstanceId, name: &Name, kinds: &[DeclId]) {
        let instance = &self.instances[id.0 as usize];
        let found = instance.grids.iter().find(|g| g.name == name.text).map(Grid::all);
        let Some(children) = found else {
            let (owner, span) = (instance.name.clone(), instance.span);
            if self.prototype {
                let place = Place { column: 0, row: Some(0) };
                let child = self.instantiate(format!("{owner}[{place}]"), kinds.to_vec(), Vec::new(), Some(id), span);
                let grid = Grid { name: name.text.clone(), children: BTreeMap::from([(place, child)]) };
                self.instances[id.0 as usize].grids.push(grid);
                return;
            }
            // A line that is wrong is said there.
            let lines = instance.kinds.iter().filter_map(|k| self.tables.kinds.get(k)).flat_map(|k| &k.lines);
            if lines.into_iter().any(|(_, l)| matches!(l, AssetLine::Grid(g) if g.name.text == name.text)) {
                return;
            }
            let kind = self.kind_names(id);
            self.report(
                Diagnostic::error(codes::MISSING_FIELD, span, format!("`{kind}` has no `{}`", name.text), "not given")
                    .because(name.span, "required here")
                    .help(format!("give them in the asset: `{}[A1 .. H12] = Well {{ ... }}`", name.text)),
            );
            return;
        };
        let wrong = children.into_iter().find_map(|c| Some((c, *kinds.iter().find(|k| !self.instance_is(c, **k))?)));
        if let Some((child, missing)) = wrong {
            let (found, wanted) = (self.kind_names(child), self.tables.kind_name(missing).to_string());
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                self.instances[child.0 as usize].span,
                format!("`{}` expects {wanted}, but `{found}` is not one", name.text),
                format!("not {wanted}"),
            ));
        }
    }

    /// An asset that contains itself has no end.
    pub fn leads_back(&mut self, id: InstanceId, kind: DeclId, at: Span) -> bool {
        let mut above = Some(id);
        while let Some(i) = above {
            let instance = &self.instances[i.0 as usize];
            if instance.kinds.contains(&kind) {
                let name = self.tables.kind_name(kind);
                let headline = format!("`{name}` contains itself");
                self.report(Diagnostic::error(codes::CIRCULAR, at, headline, "leads back to it"));
                return true;
            }
            above = instance.owner;
        }
        false
    }

    /// The places a grid line declares; none where that is no grid.
    fn line_places(&mut self, line: &ast::Grid) -> Option<Vec<Place>> {
        let from = self.place_named(&line.from)?;
        let Some(last) = &line.to else { return Some(vec![from]) };
        let to = self.place_named(last)?;
        let places = self.rectangle(from, to, &line.from, last)?;
        if places.len() as u32 > MOST {
            self.report(Diagnostic::error(
                codes::OUT_OF_RANGE,
                line.from.span.to(last.span),
                format!("a grid has at most {MOST} places"),
                "too many",
            ));
            return None;
        }
        Some(places)
    }

    fn place_named(&mut self, name: &Name) -> Option<Place> {
        let place = Place::parse(&name.text);
        if place.is_none() && !name.text.is_empty() {
            self.report(
                Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    name.span,
                    format!("`{}` is not a place of a grid", name.text),
                    "not a place",
                )
                .help("a place is a row and a column, such as `A1`, or a number"),
            );
        }
        place
    }

    /// All places between two corners, column by column.
    fn rectangle(&mut self, from: Place, to: Place, at: &Name, end: &Name) -> Option<Vec<Place>> {
        let span = at.span.to(end.span);
        let rows = match (from.row, to.row) {
            (Some(a), Some(b)) => Some((a, b)),
            (None, None) => None,
            _ => {
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    span,
                    format!("`{}` and `{}` cannot be corners of one grid", at.text, end.text),
                    "only one of them has a row",
                ));
                return None;
            }
        };
        if to.column < from.column || rows.is_some_and(|(a, b)| b < a) {
            self.report(
                Diagnostic::error(
                    codes::EMPTY_RANGE,
                    span,
                    format!("the range `{} .. {}` is empty", at.text, end.text),
                    "its last place comes before its first",
                )
                .help("write a range from the back left corner to the front right corner"),
            );
            return None;
        }
        let mut out = Vec::new();
        for column in from.column..=to.column {
            match rows {
                Some((a, b)) => out.extend((a..=b).map(|row| Place { column, row: Some(row) })),
                None => out.push(Place { column, row: None }),
            }
            // What is far beyond any grid need not be listed to be refused.
            if out.len() as u32 > 4 * MOST {
                break;
            }
        }
        Some(out)
    }

    fn layout(&mut self, id: InstanceId, module: usize, line: &'a ast::Grid) -> Option<Layout> {
        let mut layout = Layout::default();
        let read = |this: &mut Self, e: &'a Expr| match this.expr(e, &mut Scope::of(id, module)) {
            Value::Error => None,
            Value::Tuple(items) => this.position(&items, e),
            other => {
                this.expected("two lengths `(x, y) mm`", &other, e.span);
                None
            }
        };
        if let Some(e) = &line.at {
            layout.origin = read(self, e)?;
        }
        if let Some(e) = &line.pitch {
            layout.pitch = read(self, e)?;
        }
        if let Some(e) = &line.row {
            let v = self.expr(e, &mut Scope::of(id, module));
            let Value::Num(n) = self.coerce(v, &Type::ratio(), e.span, "by") else { return None };
            let count = self.known(n.node).filter(|v| *v >= 1.0 && v.fract() == 0.0);
            let Some(count) = count else {
                let headline = "the number of places in a row must be a whole number";
                self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "not a whole number"));
                return None;
            };
            layout.row = Some(count as u32);
            if Place::parse(&line.from.text).is_some_and(|p| p.row.is_some()) {
                let headline = "these places have letters for their rows";
                self.report(Diagnostic::error(codes::MISPLACED, e.span, headline, "only for numbered places"));
            }
        }
        Some(layout)
    }

    /// The children at a place or a range of places of the grid of an instance, column by column.
    pub fn children_at(
        &mut self,
        id: InstanceId,
        grid: usize,
        from: &Name,
        to: Option<&Name>,
    ) -> Option<Vec<InstanceId>> {
        if let Some(any) = self.stand_in_place(id, grid)
            && [Some(from), to].into_iter().flatten().all(|name| Place::parse(&name.text).is_some())
        {
            return Some(vec![any]);
        }
        let first = self.child_at(id, grid, from)?;
        let Some(end) = to else { return Some(vec![first.1]) };
        let last = self.child_at(id, grid, end)?;
        let places = self.rectangle(first.0, last.0, from, end)?;
        let found: Result<Vec<InstanceId>, Place> = places
            .into_iter()
            .map(|p| self.instances[id.0 as usize].grids[grid].children.get(&p).copied().ok_or(p))
            .collect();
        match found {
            Ok(found) => Some(found),
            Err(hole) => {
                let name = Name { text: hole.to_string(), span: from.span.to(end.span) };
                self.no_place(id, grid, &name);
                None
            }
        }
    }

    /// The one place that stands for all in a grid of a stand-in, of which it is not known how many it has.
    fn stand_in_place(&self, id: InstanceId, grid: usize) -> Option<InstanceId> {
        let children = &self.instances[id.0 as usize].grids[grid].children;
        children.values().next().copied().filter(|_| self.prototype && children.len() == 1)
    }

    fn child_at(&mut self, id: InstanceId, grid: usize, name: &Name) -> Option<(Place, InstanceId)> {
        let children = &self.instances[id.0 as usize].grids[grid].children;
        let found = Place::parse(&name.text).and_then(|p| children.get(&p).map(|child| (p, *child)));
        if found.is_none() {
            self.no_place(id, grid, name);
        }
        found
    }

    fn no_place(&mut self, id: InstanceId, grid: usize, name: &Name) {
        let instance = &self.instances[id.0 as usize];
        let of = &instance.grids[grid];
        let (extent, lettered) = (of.extent(), of.lettered());
        let (thing, declared) = (self.grid_name(id, grid), instance.span);
        let mut d = Diagnostic::error(
            codes::UNKNOWN_MEMBER,
            name.span,
            format!("`{thing}` has no `{}`: it has {extent}", name.text),
            "no such place",
        );
        if !self.prototype {
            d = d.because(declared, format!("`{}` is declared here", instance.name));
        }
        if let Some(upper) = Some(name.text.to_ascii_uppercase()).filter(|u| *u != name.text)
            && Place::parse(&upper).is_some_and(|p| self.instances[id.0 as usize].grids[grid].children.contains_key(&p))
        {
            d = d.fix(format!("write `{upper}`"), name.span, upper);
        } else if lettered && Place::parse(&name.text).is_none_or(|p| p.row.is_none()) {
            d = d.help(format!("write a place as printed, such as `A1`; the n-th place is `{thing}.well(n)`"));
        }
        self.report(d);
    }

    /// The first place of a grid and what stands there, for examples.
    pub fn first_place(&self, id: InstanceId, grid: usize) -> Option<(Place, InstanceId)> {
        self.instances[id.0 as usize].grids[grid].children.iter().next().map(|(place, child)| (*place, *child))
    }

    /// A grid as the user writes it: the asset's name for its first, `ot2.slot` for others and numbered ones.
    fn grid_name(&self, id: InstanceId, grid: usize) -> String {
        let instance = &self.instances[id.0 as usize];
        let of = &instance.grids[grid];
        if grid == 0 && of.lettered() { instance.name.clone() } else { format!("{}.{}", instance.name, of.name) }
    }

    /// `x[A1]`, `x[A1 .. H1]` for a grid or an instance that has one; none where it has not.
    pub fn grid_index(&mut self, base: &Value, from: &Name, to: Option<&Name>) -> Option<Value> {
        let (id, grid) = self.grid_of(base)?;
        let found = self.children_at(id, grid, from, to);
        Some(match (found, to) {
            (None, _) => Value::Error,
            (Some(found), Some(_)) => list(found),
            (Some(found), None) => found.first().map_or(Value::Error, |child| Value::Instance(*child)),
        })
    }

    /// Whether a grid has a place of this name.
    pub fn is_place(&self, base: &Value, name: &str) -> bool {
        let children = self.grid_of(base).map(|(id, grid)| &self.instances[id.0 as usize].grids[grid].children);
        Place::parse(name).is_some_and(|place| children.is_some_and(|children| children.contains_key(&place)))
    }

    /// `x[e]` for a grid or an instance that has one, by the value of an expression: the number that a place has; of `plate.wells`, the
    /// position in this list.
    pub fn grid_at(&mut self, base: &Value, at: Value, span: Span) -> Value {
        let Some((id, grid)) = self.grid_of(base) else { return self.expected("a plate or another grid", base, span) };
        if let Value::Place(name) = &at {
            let told = self.diagnostics.len();
            let found = self.grid_index(base, name, None).unwrap_or(Value::Error);
            if let Some(d) = self.diagnostics[told..].first_mut().filter(|_| name.span != span) {
                *d = d.clone().because(span, "used here");
            }
            return found;
        }
        let Value::Num(n) = self.coerce(at, &Type::ratio(), span, "place") else { return Value::Error };
        if let Some(child) = self.stand_in_place(id, grid) {
            return Value::Instance(child);
        }
        let Decided::Now(number) = self.number_before_run(n.node, "a place", span) else { return Value::Error };
        if self.is_numbered(base) {
            let name = Name { text: number.to_string(), span };
            return self.grid_index(base, &name, None).unwrap_or(Value::Error);
        }
        let of = &self.instances[id.0 as usize].grids[grid];
        let whole = number >= 0.0 && number.fract() == 0.0;
        if let Some(child) = of.children.values().nth(number as usize).filter(|_| whole) {
            return Value::Instance(*child);
        }
        let (thing, count) = (self.grid_name(id, grid), self.instances[id.0 as usize].grids[grid].children.len());
        let headline = format!("`{thing}` has {count} places, counted from 0: this is number {}", show_number(number));
        self.report(Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "out of range (the first is 0)"));
        Value::Error
    }

    /// Whether what stands in `[ ]` behind a value is the name of a place, even where it is a number: not so in `plate.wells[3]`.
    pub fn is_numbered(&self, base: &Value) -> bool {
        let is_list = |id: &InstanceId, grid: &usize| self.instances[id.0 as usize].grids[*grid].lettered();
        self.grid_of(base).is_some() && !matches!(base, Value::Grid(id, grid) if is_list(id, grid))
    }

    /// The grid that a value means.
    pub fn grid_of(&self, base: &Value) -> Option<(InstanceId, usize)> {
        match base {
            Value::Grid(id, grid) => Some((*id, *grid)),
            Value::Instance(id) | Value::Qualified(id, _) if !self.instances[id.0 as usize].grids.is_empty() => {
                Some((*id, 0))
            }
            _ => None,
        }
    }

    /// A grid as the list of its children; anything else as it is.
    pub fn listed(&self, value: Value) -> Value {
        match value {
            Value::Grid(id, grid) => list(self.instances[id.0 as usize].grids[grid].all()),
            other => other,
        }
    }

    /// `plate.rows`, `plate.column`, as far as it is one of the ways to look at a grid.
    pub fn grid_member(&self, id: InstanceId, grid: usize, name: &str) -> Option<Value> {
        let of = &self.instances[id.0 as usize].grids[grid];
        Some(match name {
            "rows" => lists(of.rows()),
            "columns" => lists(of.columns()),
            "row" | "column" | "well" => Value::Method(Box::new(Value::Grid(id, grid)), name.into()),
            _ => return None,
        })
    }

    /// `plate.row(1)`, `plate.well(5)`: counted from 1, like the labels.
    pub fn grid_call(&mut self, id: InstanceId, grid: usize, name: &str, number: f64, at: Span) -> Value {
        let of = &self.instances[id.0 as usize].grids[grid];
        let mut groups = match name {
            "row" => of.rows(),
            "column" => of.columns(),
            _ => of.all().into_iter().map(|child| vec![child]).collect(),
        };
        let count = groups.len();
        if number >= 1.0 && number.fract() == 0.0 && number <= count as f64 {
            let group = groups.swap_remove(number as usize - 1);
            return match (name, group.as_slice()) {
                ("well", [one]) => Value::Instance(*one),
                _ => list(group),
            };
        }
        if let Some(any) = self.stand_in_place(id, grid).filter(|_| number >= 1.0 && number.fract() == 0.0) {
            return if name == "well" { Value::Instance(any) } else { list(vec![any]) };
        }
        let thing = self.grid_name(id, grid);
        self.report(Diagnostic::error(
            codes::UNKNOWN_MEMBER,
            at,
            format!("`{thing}` has {count} {name}{}", if count == 1 { "" } else { "s" }),
            "out of range (the first is 1)",
        ));
        Value::Error
    }
}

/// Where the places of a grid are on the asset, m.
#[derive(Clone, Copy, Debug, Default)]
struct Layout {
    origin: [f64; 3],
    pitch: [f64; 3],
    /// For numbered places: how many stand in a row, the next row behind it.
    row: Option<u32>,
}

impl Layout {
    /// Rows go to the front, columns to the right, from the first place of the line.
    fn pose(self, corner: Place, place: Place) -> Pose {
        let columns = place.column - corner.column;
        let (right, back) = match (place.row, corner.row, self.row) {
            (Some(row), Some(first), _) => (f64::from(columns), -f64::from(row - first)),
            (_, _, Some(count)) => (f64::from(columns % count), f64::from(columns / count)),
            _ => (f64::from(columns), 0.0),
        };
        let [x, y, z] = self.origin;
        Pose::at([x + right * self.pitch[0], y + back * self.pitch[1], z])
    }
}
