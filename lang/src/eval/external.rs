//! The functions the library declares with `extern fn`, bound by name in one table.

use std::collections::BTreeSet;

use matterix_ir::equilibrium::Part;
use matterix_ir::scene::InstanceId;
use matterix_ir::study::Keep;
use matterix_ir::{BinaryOp, Diagnostic, Span, UnaryOp, codes};

use super::{Num, Scope, Value};
use crate::ast::ItemKind;
use crate::declare::interactions::InteractionDef;
use crate::declare::{SpeciesId, Type};
use crate::eval::lab::Elaborator;
use crate::names::DeclId;
use crate::units::Dimension;

/// How an external function is computed.
#[derive(Clone, Copy)]
enum Bound {
    /// One quantity to one.
    Unary(UnaryOp),
    /// Two of one dimension to one of it.
    Extreme(BinaryOp),
    /// A number held between two limits.
    Clamp,
    /// Square root: the dimension halves.
    Sqrt,
    /// Magnitude: the dimension stays.
    Abs,
    /// The absolute value of a point on a scale.
    Absolute,
    /// One of two values by a condition.
    Choose,
    /// A value read off the lines between points.
    Interpolate,
    /// The species of a set that state a property.
    Having,
    /// The species that split into some of a set, and water, alone.
    Salts,
    /// The parts of an instance, and theirs, that are of a kind.
    Parts,
    /// An instance and what it is a part of, as far as they are of a kind.
    Wholes,
    /// What an instance is a part of.
    Owner,
    /// The number of an element of a list, from 1.
    Position,
    /// The element of a list with a number from 1 that may be known only when running.
    Nth,
    /// How a thing is called in the grid that it is in.
    Label,
    /// One of the parts of a text between signs, by its number.
    Parted,
    /// A thing if it is of a kind.
    OfKind,
    /// Each of one list with each of another.
    Paired,
    /// A list in groups of a number.
    Firsts,
    Grouped,
    /// Where a part of a thing is, seen from another part of it.
    Displacement,
    /// How far the centre of mass of a thing is inside what bears it where it is put down.
    Footing,
    /// How large an instance is in one way, if its shape is known.
    Measures,
    /// The volume that a tilted vessel keeps.
    Kept,
    /// The tilt at which a volume comes to the lip of a vessel.
    Brink,
    /// How far below its lip a tilted vessel reaches.
    Droop,
    /// From the bottom of the inside of a vessel to its rim.
    Depth,
    /// The volume that a vessel holds up to a height.
    Below,
    /// How high a volume stands in a vessel.
    StandingHeight,
    /// A number that a material states; without end where it states none.
    Stated,
    /// What the lab placed the instance on, by one of these prepositions.
    Placed,
    /// Whether one mixture has touched something that another has not.
    Soils,
    Spread,
    /// The activity of a species at equilibrium.
    Activity,
    /// Whether an equilibrium of the file has a species.
    Balanced,
    /// Whether the equilibria of a mixture have a species.
    Settles,
    /// Whether an equilibrium of the file has a species as a pure solid.
    Solid,
    /// Whether an equilibrium is between a species and other uncharged ones without water.
    Isomerises,
    /// Whether the equilibria that have a species say nothing of their heat.
    LacksHeat,
    /// The solids that dissolve as a species whole.
    SolidsOf,
    /// The heat that a mole of such a solid takes up as it dissolves.
    HeatOfSolid,
    /// The amount of a species that was put into a mixture.
    Put,
    /// The amount of a species at equilibrium once all salts have dissolved.
    Ready,
    /// Whether an equilibrium of the file has two species on different sides, or on the same.
    Opposed(bool),
    /// Whether an interaction of the file is between two species.
    Interacts,
    /// Whether a species attacks the wall around a mixture.
    AttacksWall,
    /// The temperature at equilibrium.
    Settled,
    /// A value by what was put into mixtures, whatever equilibria make of it.
    AsPut,
    /// The heat of coming to equilibrium from what is there.
    HeatOfSettling,
    /// What a value would be with a share of one mixture added to another.
    Adding,
    /// The ionic strength that equilibria leave.
    IonicStrength,
    /// Whether equilibria have constants at a temperature.
    EquilibriaHold,
    /// Whether those that have a species do.
    ConstantsHold,
    /// The activity that a gas has where it is at rest with a mixture.
    GasActivity,
    /// The gases of the file's equilibria.
    Gases,
    /// The species of the equilibrium of a gas, beside it.
    GasBecomes,
    /// How much of a species a mole of a gas becomes as it dissolves.
    GasGives,
    /// The constant of the equilibrium of a gas at a temperature.
    Henry,
    /// The heat that a mole of gas takes up as it dissolves at a temperature.
    HeatOfGas,
    /// Whether the equilibrium of a gas has a constant at a temperature.
    GasHolds,
    /// What is kept of a quantity over a whole run.
    OverTime(Keep),
}

/// The function whose argument is taken by what was put in.
pub const AS_PUT: &str = "as_put";

const TABLE: &[(&str, Bound)] = &[
    ("activity", Bound::Activity),
    ("balanced", Bound::Balanced),
    ("settles", Bound::Settles),
    ("is_solid", Bound::Solid),
    ("isomerises", Bound::Isomerises),
    ("lacks_heat", Bound::LacksHeat),
    ("solids_of", Bound::SolidsOf),
    ("heat_of_solid", Bound::HeatOfSolid),
    ("put_in", Bound::Put),
    ("ready", Bound::Ready),
    ("opposed", Bound::Opposed(true)),
    ("alongside", Bound::Opposed(false)),
    ("interacts", Bound::Interacts),
    ("attacks_wall", Bound::AttacksWall),
    ("settled_temperature", Bound::Settled),
    (AS_PUT, Bound::AsPut),
    ("heat_of_settling", Bound::HeatOfSettling),
    ("after_adding", Bound::Adding),
    ("settled_strength", Bound::IonicStrength),
    ("equilibria_hold", Bound::EquilibriaHold),
    ("constants_hold", Bound::ConstantsHold),
    ("gas_activity", Bound::GasActivity),
    ("gases", Bound::Gases),
    ("gas_becomes", Bound::GasBecomes),
    ("gas_gives", Bound::GasGives),
    ("henry", Bound::Henry),
    ("heat_of_gas", Bound::HeatOfGas),
    ("gas_holds", Bound::GasHolds),
    ("exp", Bound::Unary(UnaryOp::Exp)),
    ("ln", Bound::Unary(UnaryOp::Ln)),
    ("sin", Bound::Unary(UnaryOp::Sin)),
    ("cos", Bound::Unary(UnaryOp::Cos)),
    ("arctan", Bound::Unary(UnaryOp::Atan)),
    ("floor", Bound::Unary(UnaryOp::Floor)),
    ("min", Bound::Extreme(BinaryOp::Min)),
    ("max", Bound::Extreme(BinaryOp::Max)),
    ("clamp", Bound::Clamp),
    ("sqrt", Bound::Sqrt),
    ("abs", Bound::Abs),
    ("brink", Bound::Brink),
    ("depth", Bound::Depth),
    ("held_below", Bound::Below),
    ("kept", Bound::Kept),
    ("kelvin", Bound::Absolute),
    ("choose", Bound::Choose),
    ("displacement", Bound::Displacement),
    ("droop", Bound::Droop),
    ("footing", Bound::Footing),
    ("firsts", Bound::Firsts),
    ("grouped", Bound::Grouped),
    ("having", Bound::Having),
    ("interpolate", Bound::Interpolate),
    ("measures", Bound::Measures),
    ("nth", Bound::Nth),
    ("label", Bound::Label),
    ("of_kind", Bound::OfKind),
    ("owner", Bound::Owner),
    ("parted", Bound::Parted),
    ("paired", Bound::Paired),
    ("parts", Bound::Parts),
    ("position", Bound::Position),
    ("placed", Bound::Placed),
    ("salts", Bound::Salts),
    ("soils", Bound::Soils),
    ("spread", Bound::Spread),
    ("standing_height", Bound::StandingHeight),
    ("stated", Bound::Stated),
    ("max_over_time", Bound::OverTime(Keep::Largest)),
    ("min_over_time", Bound::OverTime(Keep::Smallest)),
    ("mean_over_time", Bound::OverTime(Keep::Mean)),
    ("whole", Bound::Owner),
    ("wholes", Bound::Wholes),
];

/// Whether the compiler provides an external function of this name.
pub fn is_bound(name: &str) -> bool {
    TABLE.iter().any(|(n, _)| *n == name)
}

impl Elaborator<'_> {
    /// Calls an external function; the values are coerced to the parameters' types already.
    pub fn external(
        &mut self,
        name: &str,
        values: Vec<Value>,
        result: Option<Type>,
        at: Span,
        params: &[Span],
    ) -> Value {
        let Some((_, bound)) = TABLE.iter().find(|(n, _)| *n == name) else {
            let declared = params.first().copied().unwrap_or(at);
            self.report(
                Diagnostic::error(
                    codes::UNBOUND_EXTERN,
                    at,
                    format!("the compiler has no function `{name}`"),
                    "called here",
                )
                .because(declared, "declared `extern` here"),
            );
            return Value::Error;
        };
        let computed = match (bound, values.as_slice()) {
            (Bound::Unary(op), [Value::Num(n)]) => {
                let node = self.graph.unary(*op, n.node);
                self.note_place(node, at);
                self.num(node, Dimension::any())
            }
            (Bound::Extreme(op), [a, b]) => self.extreme(*op, a.clone(), b.clone(), at),
            (Bound::Clamp, [x, low, high]) => {
                let raised = self.extreme(BinaryOp::Max, x.clone(), low.clone(), at);
                self.extreme(BinaryOp::Min, raised, high.clone(), at)
            }
            (Bound::Sqrt, [Value::Num(n)]) => {
                let node = self.graph.unary(UnaryOp::Sqrt, n.node);
                self.note_place(node, at);
                self.num(node, n.dimension.power(crate::units::Rational::new(1, 2)))
            }
            (Bound::Abs, [Value::Num(n)]) if !n.point => {
                let node = self.graph.unary(UnaryOp::Abs, n.node);
                Value::Num(Num { node, literal: false, ..n.clone() })
            }
            (Bound::Absolute, [Value::Num(n)]) => {
                Value::Num(Num { point: false, unit: None, literal: false, ..n.clone() })
            }
            (Bound::Choose, [Value::Bool(c), a, b]) => self.choose(*c, a.clone(), b.clone(), at),
            (Bound::Interpolate, [Value::Num(x), Value::List(points)]) => self.interpolate(x, points, at),
            (Bound::Having, [Value::List(set), Value::Text(property)]) => {
                let states = |v: &Value| match v {
                    Value::Species(s) => {
                        let fields = self.tables.species.get(*s).fields;
                        crate::declare::species::field(fields, property).is_some()
                    }
                    _ => false,
                };
                Value::List(set.iter().filter(|v| states(v)).cloned().collect())
            }
            (Bound::Salts, [Value::List(set)]) => {
                let species = &self.tables.species;
                let set: BTreeSet<SpeciesId> = set
                    .iter()
                    .filter_map(|v| match v {
                        Value::Species(s) => Some(*s),
                        _ => None,
                    })
                    .collect();
                let there = |ion: &SpeciesId| set.contains(ion) || species.get(*ion).is_water;
                let made = |s: &SpeciesId| species.get(*s).dissolves.iter().all(|(ion, _)| there(ion));
                Value::List(species.salts().filter(made).map(Value::Species).collect())
            }
            (Bound::Parts, [Value::Instance(i), Value::Kind(kind)]) => {
                let mut found = Vec::new();
                self.parts_below(*i, *kind, &mut found);
                Value::List(found.into_iter().map(Value::Instance).collect())
            }
            (Bound::Wholes, [Value::Instance(i), Value::Kind(kind)]) => {
                let all = std::iter::successors(Some(*i), |i| self.instances[i.0 as usize].owner);
                Value::List(all.filter(|i| self.instance_is(*i, *kind)).map(Value::Instance).collect())
            }
            (Bound::Owner, [Value::Instance(i)]) => match (self.instances[i.0 as usize].owner, &result) {
                (None, Some(ty)) if self.prototype => self.placeholder(ty, name),
                (None, None) if self.prototype => Value::Instance(*i),
                (owner, _) => owner.map_or(Value::Nothing, Value::Instance),
            },
            (Bound::Label, [thing]) => self.label(thing, at),
            (Bound::Parted, [Value::Text(text), Value::Text(sign), Value::Num(n)]) => {
                let number = self.known(n.node).filter(|n| *n >= 1.0).map(|n| n as usize - 1);
                match number.and_then(|n| text.split(sign.as_str()).nth(n)) {
                    Some(part) => Value::Text(part.to_owned()),
                    None if self.prototype => Value::Text("1".to_owned()),
                    None => Value::Nothing,
                }
            }
            (Bound::OfKind, [Value::Instance(i), Value::Kind(kind)]) if self.instance_is(*i, *kind) => {
                values[0].clone()
            }
            (Bound::OfKind, [Value::Instance(_) | Value::Nothing, Value::Kind(kind)]) if self.prototype => {
                let kind = *kind;
                let name = self.tables.kind_name(kind);
                Value::Instance(self.prototype_of(vec![kind], name))
            }
            (Bound::OfKind, [Value::Instance(_) | Value::Nothing, Value::Kind(_)]) => Value::Nothing,
            (Bound::Parted, [Value::Nothing, ..]) => Value::Nothing,
            (Bound::Position, [Value::List(items), item]) => match items.iter().position(|i| i == item) {
                Some(at) => self.number(at as f64 + 1.0, Dimension::one(), false),
                None if self.prototype => self.number(1.0, Dimension::one(), false),
                None => self.expected("an element of the list", item, at),
            },
            (Bound::Nth, [Value::List(items), Value::Num(n)]) => self.nth(items, n.node, at),
            (Bound::Paired, [Value::List(a), Value::List(b)]) => self.paired(a, b, at),
            (Bound::Grouped, [Value::List(items), Value::Num(n)]) => self.grouped(items, n.node, at),
            (Bound::Firsts, [Value::List(items), Value::Num(n)]) => self.firsts(items, n.node, at),
            (Bound::Spread, [Value::List(items), Value::Num(n)]) => self.spread(items, n.node, at),
            (Bound::Displacement, [Value::Instance(a), Value::Instance(b)]) => self.displacement(*a, *b),
            (Bound::Displacement, [Value::Frame(a, from), Value::Frame(b, to)]) => {
                self.between_frames((*a, from), (*b, to))
            }
            (Bound::Footing, [Value::Instance(thing), Value::Instance(on)]) => self.footings(*thing, *on),
            (Bound::Measures, [Value::Instance(i), Value::Text(what)]) => self.measures(*i, what, at),
            (Bound::Kept, [Value::Instance(i), Value::Num(tilt)]) => self.kept(*i, tilt),
            (Bound::Brink, [Value::Instance(i), Value::Num(volume)]) => self.brink(*i, volume),
            (Bound::StandingHeight, [Value::Instance(i), Value::Num(volume)]) => self.standing_height(*i, volume),
            (Bound::Droop, [Value::Instance(i), Value::Num(tilt), Value::Num(behind)]) => self.droop(*i, tilt, behind),
            (Bound::Depth, [Value::Instance(i)]) => self.depth(*i),
            (Bound::Below, [Value::Instance(i), Value::Num(height)]) => self.held_below(*i, height),
            (Bound::Placed, [Value::Instance(i), Value::Text(words)]) => self.placed(*i, words),
            (Bound::Placed, [Value::Nothing, Value::Text(_)]) => Value::Nothing,
            (Bound::Soils, [Value::Instance(a), Value::Instance(b)]) => Value::Bool(self.soils(*a, *b)),
            (Bound::Activity, [Value::Instance(m), Value::Species(s), Value::Num(otherwise)]) => {
                self.activity_of(*m, *s, otherwise)
            }
            (Bound::Balanced, [Value::Species(s)]) => {
                let is_balanced = self.tables.equilibria.iter().any(|e| e.involves(*s));
                self.certain(is_balanced)
            }
            (Bound::Settles, [Value::Instance(m), Value::Species(s)]) => {
                let has = self.speciation(*m).is_some_and(|speciation| speciation.place(*s).is_some());
                self.certain(has)
            }
            (Bound::Solid, [Value::Species(s)]) => {
                let is_solid = self.is_solid(*s);
                self.certain(is_solid)
            }
            (Bound::Isomerises, [Value::Species(s)]) => {
                let does = self.isomerises(*s);
                self.certain(does)
            }
            (Bound::LacksHeat, [Value::Species(s)]) => {
                let lacks = self.lacks_heat(*s);
                self.certain(lacks)
            }
            (Bound::SolidsOf, [Value::Species(s)]) => {
                let solids = self.tables.equilibria.iter().filter_map(|e| e.dissolving_whole(|_, other| other == *s));
                Value::List(solids.map(|(solid, _)| Value::Species(solid)).collect())
            }
            (Bound::HeatOfSolid, [Value::Species(s)]) => {
                let node = self.heat_of_solid(*s);
                self.num(node, self.tables.units.named("Energy").over(&self.tables.units.named("Amount")))
            }
            (Bound::Put, [Value::Instance(m), Value::Species(s)]) => {
                let node = self.put_in(*m, *s);
                self.num(node, self.tables.units.named("Amount"))
            }
            (Bound::Ready, [Value::Instance(m), Value::Species(s)]) => {
                let node = self.ready_amount(*m, *s);
                self.num(node, self.tables.units.named("Amount"))
            }
            (Bound::Opposed(apart), [Value::Species(a), Value::Species(b)]) => {
                let holds = self.tables.equilibria.iter().any(|e| e.sides(*a, *b).is_some_and(|same| same != *apart));
                self.certain(holds)
            }
            (Bound::Interacts, [Value::Species(a), Value::Species(b)]) => {
                let is_between = |def: &InteractionDef<'_>| {
                    def.members.len() == 2 && def.members.contains(a) && def.members.contains(b)
                };
                let acts = self.tables.interactions.iter().any(is_between);
                self.certain(acts)
            }
            (Bound::AttacksWall, [Value::Instance(m), Value::Species(s)]) => {
                let attacks = self.attacks_wall(*m, *s);
                self.certain(attacks)
            }
            (Bound::Settled, [Value::Instance(m), Value::Num(otherwise)]) => {
                let node = self.settled(*m, |_| Some(Part::Temperature)).unwrap_or(otherwise.node);
                Value::Num(Num { node, literal: false, ..otherwise.clone() })
            }
            (Bound::AsPut, [Value::Num(n)]) => Value::Num(n.clone()),
            (Bound::Adding, [Value::Num(n), Value::Num(share), Value::Instance(from), Value::Instance(to)]) => {
                let node = self.after_adding(n.node, share.node, (*from, *to));
                Value::Num(Num { node, literal: false, ..n.clone() })
            }
            (Bound::Adding, [Value::Concentration(..), ..]) => {
                self.kindless(at);
                Value::Error
            }
            (Bound::IonicStrength, [Value::Instance(m), Value::Num(otherwise)]) => {
                let node = self.settled(*m, |_| Some(Part::Strength)).unwrap_or(otherwise.node);
                Value::Num(Num { node, literal: false, ..otherwise.clone() })
            }
            (Bound::EquilibriaHold, [Value::Instance(m), Value::Num(t)]) => {
                Value::Bool(self.equilibria_hold(*m, None, t.node))
            }
            (Bound::ConstantsHold, [Value::Instance(m), Value::Species(s), Value::Num(t)]) => {
                Value::Bool(self.equilibria_hold(*m, Some(*s), t.node))
            }
            (Bound::HeatOfSettling, [Value::Instance(m), Value::Num(t)]) => {
                let node = self.heat_of_settling(*m, t.node);
                let node = node.unwrap_or_else(|| self.graph.number(0.0));
                self.num(node, self.tables.units.named("Energy"))
            }
            (Bound::GasActivity, [Value::Instance(m), Value::Species(g)]) => {
                let Some(e) = self.of_gas(*g) else { return self.without_gas(*g, at) };
                let node = self.activity_of_gas(*m, e).unwrap_or_else(|| self.graph.number(0.0));
                self.num(node, Dimension::one())
            }
            (Bound::Gases, []) => {
                let gases = self.tables.equilibria.iter().filter_map(|e| Some(Value::Species(e.gas?.0)));
                Value::List(gases.collect())
            }
            (Bound::GasBecomes, [Value::Species(g)]) => {
                let terms = self.of_gas(*g).map(|e| self.tables.equilibria[e].terms.as_slice());
                let others = terms.into_iter().flatten().filter(|(s, _)| s != g);
                Value::List(others.map(|(s, _)| Value::Species(*s)).collect())
            }
            (Bound::GasGives, [Value::Species(g), Value::Species(s)]) => {
                let terms = self.of_gas(*g).map(|e| self.tables.equilibria[e].terms.as_slice());
                let count = terms.into_iter().flatten().find(|(other, _)| other == s).map_or(0.0, |(_, n)| *n);
                self.number(count, Dimension::one(), false)
            }
            (Bound::Henry, [Value::Species(g), Value::Num(t)]) => {
                let ln = self.of_gas(*g).and_then(|e| self.constant_at(e, |_| Some(t.node)));
                let node = match ln {
                    Some(ln) => self.graph.unary(UnaryOp::Exp, ln),
                    None => return self.without_gas(*g, at),
                };
                self.num(node, Dimension::one())
            }
            (Bound::HeatOfGas, [Value::Species(g), Value::Num(t)]) => {
                let Some(node) = self.of_gas(*g).and_then(|e| self.enthalpy_at(e, t.node)) else {
                    return self.without_gas(*g, at);
                };
                self.num(node, self.tables.units.named("Energy").over(&self.tables.units.named("Amount")))
            }
            (Bound::GasHolds, [Value::Species(g), Value::Num(t)]) => match self.of_gas(*g) {
                Some(e) => Value::Bool(self.gas_holds(e, t.node)),
                None if self.prototype => self.certain(true),
                None => self.without_gas(*g, at),
            },
            (Bound::Stated, [Value::Material(id), Value::Text(what)]) => self.stated(*id, what),
            (Bound::Stated, [Value::Nothing, Value::Text(_)]) => Value::Unlimited,
            (Bound::OverTime(keep), [Value::Num(n)]) => self.over_time(*keep, n, name, at),
            (Bound::OverTime(_), [Value::Concentration(..)]) => {
                self.kindless(at);
                Value::Error
            }
            (_, values) if values.contains(&Value::Error) => Value::Error,
            _ => self.wrong_arguments(name, at),
        };
        match result {
            Some(ty) => self.coerce(computed, &ty, at, name),
            None => computed,
        }
    }

    /// A species is asked for as a gas of which no equilibrium says how much dissolves.
    fn without_gas(&mut self, s: SpeciesId, at: Span) -> Value {
        if self.prototype {
            return self.number(1.0, Dimension::any(), false);
        }
        let at = self.calls.first().copied().unwrap_or(at);
        let name = self.tables.species.get(s).name.clone();
        let headline = format!("no equilibrium of this file contains `{name}` as a gas");
        let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, at, headline, "used here");
        self.report(
            d.help("declare its solubility: `equilibrium dissolves: CO2(g) <-> CO2 { log_constant: -1.47 }`, or `use std::gases`"),
        );
        Value::Error
    }

    /// A truth that is known before anything runs.
    fn certain(&mut self, truth: bool) -> Value {
        Value::Bool(self.graph.number(f64::from(u8::from(truth))))
    }

    fn stated(&mut self, id: DeclId, what: &str) -> Value {
        let names = self.tables.names;
        let ItemKind::Material { fields, .. } = &names.decl(id).item.kind else { return Value::Error };
        let field = fields.iter().find(|f| f.key.text == what);
        match field.and_then(|f| Self::field_expr(&f.value)) {
            Some(e) => self.expr(e, &mut Scope::module(names.decl(id).module)),
            None => Value::Unlimited,
        }
    }

    fn parts_below(&self, id: InstanceId, kind: DeclId, out: &mut Vec<InstanceId>) {
        for part in self.instances[id.0 as usize].children() {
            if self.instance_is(part, kind) {
                out.push(part);
            }
            self.parts_below(part, kind, out);
        }
    }

    /// `A1` of `plate[A1]`; of one of several, known only when running, as a word.
    fn label(&mut self, thing: &Value, at: Span) -> Value {
        let of = |this: &Self, id: InstanceId| {
            let name = &this.instances[id.0 as usize].name;
            name.rsplit_once('[').map(|(_, label)| label.trim_end_matches(']').to_owned())
        };
        match thing {
            Value::Nothing | Value::Instance(_) if self.prototype => Value::Text("1".to_owned()),
            Value::Nothing => Value::Nothing,
            Value::Instance(id) => of(self, *id).map_or(Value::Nothing, Value::Text),
            Value::InstanceNode(node) => {
                let picked = self.picks.get(node);
                let last = picked.map_or(self.instances.len() as u32, |p| p.iter().max().map_or(0, |id| id.0 + 1));
                let may_be = |i: InstanceId| picked.is_none_or(|p| p.contains(&i));
                let word = |i: InstanceId| of(self, i).filter(|_| may_be(i)).unwrap_or_default();
                Value::Enum(*node, (0..last).map(InstanceId).map(word).collect())
            }
            Value::Error => Value::Error,
            other => self.expected("an instance", other, at),
        }
    }

    fn placed(&self, id: InstanceId, words: &str) -> Value {
        let inst = &self.instances[id.0 as usize];
        inst.placed
            .iter()
            .find(|(label, _)| words.split(' ').any(|w| w == label))
            .map_or(Value::Nothing, |(_, on)| Value::Instance(*on))
    }
}
