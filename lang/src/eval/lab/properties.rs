//! What is known of species. Every property is declared with its type in the language, as a parameter of a capability
//! `Species`, and a value is typed where it is written.

use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use crate::ast::{Expr, ExprKind, FieldValue, MemberKind};
use crate::declare::SpeciesId;
use crate::declare::Type;
use crate::declare::species::{SpeciesDef, field};
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;

/// The option of a property of weak acids and bases that names what they make in water.
pub const GIVES: &str = "gives";
/// The option that says at which values of the property it does.
pub const GIVES_AT: &str = "gives_at";

/// How far two ways of saying the same may be apart, as a share.
const SAME: f64 = 1e-3;

impl<'a> Elaborator<'a> {
    /// A property that a species states; nothing where it does not.
    pub fn property(&mut self, s: SpeciesId, key: &str) -> Option<Value> {
        let tables = self.tables;
        let def = tables.species.get(s);
        match &field(def.fields, key)?.value {
            FieldValue::Expr(e) => Some(self.property_of(def, key, (e, def.module))),
            _ => None,
        }
    }

    /// What holds of a species that does not state a property: the default of its declaration, where that gives one.
    pub fn property_by_default(&mut self, s: SpeciesId, key: &str) -> Option<Value> {
        let tables = self.tables;
        let m = tables.properties.get(key)?;
        let MemberKind::Value { value: Some(e), .. } = &m.member.kind else { return None };
        Some(self.property_of(tables.species.get(s), key, (e, m.module)))
    }

    /// The number, SI, that a species states; nothing where it states none.
    pub fn property_value(&mut self, s: SpeciesId, key: &str) -> Option<f64> {
        match self.property(s, key)? {
            Value::Num(n) => self.graph.constant(n.node),
            _ => None,
        }
    }

    /// The declared type of a property.
    pub fn property_type(&mut self, key: &str) -> Option<Type> {
        let m = self.tables.properties.get(key).copied()?;
        match &m.member.kind {
            MemberKind::Value { ty, .. } => Some(self.resolve_type(ty, m.module)),
            _ => None,
        }
    }

    /// The value of a property of a species, as its declared type, from an expression of a module.
    fn property_of(&mut self, def: &SpeciesDef<'a>, key: &str, (e, module): (&'a Expr, usize)) -> Value {
        let scope = &mut Scope::module(module);
        let Some(m) = self.tables.properties.get(key).copied() else { return Value::Error };
        let MemberKind::Value { ty, options, .. } = &m.member.kind else { return Value::Error };
        let ty = self.resolve_type(ty, m.module);
        let what = format!("{}.{key}", def.name);
        let value = self.worded(e, &ty, scope);
        let reported = self.diagnostics.len();
        let value = match (value, &ty) {
            // Several numbers of one unit stand in round brackets; one alone is a list of one.
            (Value::Tuple(items), Type::List(_)) => match self.coerce(Value::List(items), &ty, e.span, &what) {
                Value::List(items) => Value::Tuple(items),
                other => other,
            },
            (one @ (Value::Num(_) | Value::Text(_)), Type::List(_)) => {
                self.coerce(Value::List(vec![one]), &ty, e.span, &what)
            }
            (value, _) => {
                let meant = self.other_property(def, &value, &ty);
                let value = self.coerce(value, &ty, e.span, &what);
                if let (Some(d), Some(meant)) = (self.diagnostics.get_mut(reported), meant) {
                    d.help = vec![format!("did you mean `{meant}`?")];
                }
                value
            }
        };
        if let Value::Num(n) = &value
            && !self.graph.constant(n.node).is_some_and(f64::is_finite)
        {
            let headline = format!("`{what}` is not a number");
            self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "not a constant value"));
            return Value::Error;
        }
        let limits = self.diagnostics.len();
        self.check_limits(&value, e.span, &what, &ty, options, (None, m.module));
        if self.diagnostics.len() > limits { Value::Error } else { value }
    }

    /// An expression where words may stand as texts, and texts as words.
    fn worded(&mut self, e: &'a Expr, ty: &Type, scope: &mut Scope) -> Value {
        match (ty, &*e.kind) {
            (Type::Enum(words), ExprKind::Text(text)) => match self.word_named(text, words) {
                Some(word) => word,
                None => Value::Text(text.clone()),
            },
            (Type::Text, ExprKind::Name(n)) if !self.resolves(n, scope) => Value::Text(n.text.clone()),
            (Type::List(inner), ExprKind::List(items)) if matches!(**inner, Type::Text | Type::Enum(_)) => {
                Value::List(items.iter().map(|i| self.worded(i, inner, scope)).collect())
            }
            _ => self.hinted(e, ty, scope),
        }
    }

    /// The one other property that a value of the wrong dimension may be meant for.
    fn other_property(&mut self, def: &SpeciesDef<'a>, value: &Value, ty: &Type) -> Option<&'a str> {
        let (Value::Num(n), Type::Quantity { dimension, .. }) = (value, ty) else { return None };
        if n.dimension.agrees(dimension) || n.dimension.is_one() {
            return None;
        }
        let names: Vec<&'a str> = self.tables.properties.keys().copied().collect();
        let mut fitting = names.into_iter().filter(|key| {
            let fits = matches!(self.property_type(key), Some(Type::Quantity { dimension, point, .. })
                if dimension.agrees(&n.dimension) && point == n.point);
            fits && field(def.fields, key).is_none()
        });
        let one = fitting.next();
        one.filter(|_| fitting.next().is_none())
    }

    /// Looks at everything that a species states, and at what it says twice.
    pub fn check_species(&mut self, id: DeclId) {
        let tables = self.tables;
        let Some(s) = tables.species.of_decl(id) else { return };
        let def = tables.species.get(s);
        if def.decl != id {
            return;
        }
        for f in def.fields {
            if tables.properties.contains_key(f.key.text.as_str()) {
                match &f.value {
                    FieldValue::Expr(e) => drop(self.property_of(def, &f.key.text, (e, def.module))),
                    _ => self.report(Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        f.span,
                        format!("`{}.{}` must be one value", def.name, f.key.text),
                        "not one value",
                    )),
                }
            }
        }
        self.check_molar_mass(s);
        self.check_same(s, "molar_volume", "density", def.molar_mass, |molar_mass, density| molar_mass / density);
        self.check_same(s, "heat_capacity", "specific_heat", def.molar_mass, |molar_mass, heat| molar_mass * heat);
        let neutral = def.formula.as_ref().is_none_or(|f| f.charge == 0);
        let pure = neutral && field(def.fields, "density").is_some();
        if pure && self.property_value(s, "heat_capacity").is_some_and(|v| v <= 0.0) {
            self.not_above_zero(def);
        }
    }

    /// A pure substance takes up heat as it warms.
    fn not_above_zero(&mut self, def: &SpeciesDef<'a>) {
        let Some(f) = field(def.fields, "heat_capacity") else { return };
        let headline = format!("the heat capacity of `{}` must be above zero", def.name);
        let d = Diagnostic::error(codes::OUT_OF_RANGE, f.span, headline, "must be above 0 J/(mol*K)");
        self.report(d.help("only ions and gases dissolved in water may have a negative heat capacity"));
    }

    /// A stated molar mass must agree with the formula.
    fn check_molar_mass(&mut self, s: SpeciesId) {
        let def = self.tables.species.get(s);
        let Some(f) = field(def.fields, "molar_mass") else { return };
        let FieldValue::Expr(e) = &f.value else { return };
        let Some(Value::Num(n)) = self.property(s, "molar_mass") else { return };
        let Some(stated) = self.graph.constant(n.node) else { return };
        let unit = self.unit_of(&Num { literal: true, ..n });
        let headline = match def.formula {
            None => format!("`{}` is declared `by: mass` and has no molar mass", def.name),
            Some(_) if (stated / def.molar_mass - 1.0).abs() <= SAME => return,
            Some(_) => format!("the molar mass of `{}` is {}", def.name, unit.show(def.molar_mass)),
        };
        let place = if def.formula.is_some() { "does not agree with the formula" } else { "has no meaning here" };
        self.report(Diagnostic::error(codes::FORMULA_INVALID, e.span, headline, place));
    }

    /// Two properties of which one follows from the other must agree where both are stated.
    fn check_same(&mut self, s: SpeciesId, key: &str, other: &str, molar_mass: f64, of: impl Fn(f64, f64) -> f64) {
        let (Some(a), Some(b)) = (self.property_value(s, key), self.property_value(s, other)) else { return };
        let def = self.tables.species.get(s);
        let follows = of(molar_mass, b);
        if (a - follows).abs() <= SAME * a.abs().max(follows.abs()) {
            return;
        }
        let (Some(f), Some(g)) = (field(def.fields, key), field(def.fields, other)) else { return };
        let headline = format!("`{key}` and `{other}` of `{}` contradict each other", def.name);
        let d = Diagnostic::error(codes::OUT_OF_RANGE, g.span, headline, "this value");
        self.report(d.because(f.span, "contradicts this one").help("remove one of them: it follows from the other"));
    }
}
