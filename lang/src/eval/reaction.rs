//! What a law can ask of a reaction: `r.rate(T)`, `r.order(s)`, `r.coefficient(s)`, `r.valid`, `r.basis(m)`.

use matterix_ir::{Diagnostic, Span, codes};

use super::{Num, Scope, Value};
use crate::ast::{Field, FieldValue, MemberKind, Name, Role};
use crate::declare::species::field;
use crate::declare::{ReactionId, SpeciesId, Type};
use crate::eval::lab::Elaborator;
use crate::units::{Dimension, Rational};

impl<'a> Elaborator<'a> {
    /// `r.name`.
    pub fn reaction_member(&mut self, r: ReactionId, name: &Name) -> Value {
        let def = &self.tables.reactions[r.0 as usize];
        let list = |ids: &mut dyn Iterator<Item = SpeciesId>| {
            let mut out: Vec<Value> = Vec::new();
            for s in ids {
                if !out.contains(&Value::Species(s)) {
                    out.push(Value::Species(s));
                }
            }
            Value::List(out)
        };
        match name.text.as_str() {
            "species" => list(&mut def.reactants.iter().chain(&def.products).map(|t| t.0)),
            "reactants" => list(&mut def.reactants.iter().map(|t| t.0)),
            "products" => list(&mut def.products.iter().map(|t| t.0)),
            "orders" => {
                let orders = self.orders(r);
                Value::List(orders.into_iter().map(|(s, _)| Value::Species(s)).collect())
            }
            "unordered" => {
                let orders = self.orders(r);
                let reactants = self.tables.reactions[r.0 as usize].reactants.clone();
                let without = reactants.into_iter().filter(|(s, _)| !orders.iter().any(|(o, n)| o == s && *n > 0.0));
                Value::List(without.map(|(s, _)| Value::Species(s)).collect())
            }
            "limiting" => {
                let orders = self.orders(r);
                let reactants = self.tables.reactions[r.0 as usize].reactants.clone();
                let slows = |s: &SpeciesId| orders.iter().any(|(o, n)| o == s && *n >= 1.0);
                list(&mut reactants.into_iter().map(|t| t.0).filter(|s| !slows(s)))
            }
            "valid" => self.window(r),
            "enthalpy" => self.reaction_enthalpy(r),
            "rate" | "order" | "coefficient" | "basis" | "requires" => {
                Value::Method(Box::new(Value::Reaction(r)), name.text.clone())
            }
            _ => {
                let known = [
                    "species",
                    "reactants",
                    "products",
                    "orders",
                    "unordered",
                    "limiting",
                    "valid",
                    "enthalpy",
                    "rate",
                    "order",
                    "coefficient",
                    "basis",
                    "requires",
                ];
                let near = crate::near::nearest(&name.text, known);
                let mut d = Diagnostic::error(
                    codes::UNKNOWN_MEMBER,
                    name.span,
                    format!("a reaction has no member `{}`", name.text),
                    "not a member",
                );
                d.help.extend(crate::near::question(&near));
                self.report(d);
                Value::Error
            }
        }
    }

    /// The window in which the rate law holds; everywhere where none is given.
    fn window(&mut self, r: ReactionId) -> Value {
        let def = &self.tables.reactions[r.0 as usize];
        let (module, name) = (def.module, def.name.clone());
        let temperature =
            self.tables.units.dimension("Temperature").map_or_else(Dimension::any, |d| d.dimension.clone());
        let ty = Type::Quantity { dimension: temperature.clone(), point: true, optional: false };
        let Some(Field { value: FieldValue::Expr(e), .. }) = field(def.fields, "valid") else {
            let end = |this: &mut Self, v: f64| Num {
                node: this.graph.number(v),
                dimension: temperature.clone(),
                point: true,
                unit: None,
                literal: false,
            };
            let (low, high) = (end(self, f64::NEG_INFINITY), end(self, f64::INFINITY));
            return Value::Range(Box::new(low), Box::new(high));
        };
        let v = self.expr(e, &mut Scope::module(module));
        match self.coerce(v, &Type::Range(ty.into()), e.span, "valid") {
            Value::Range(a, b) => {
                let low = self.name_param(&format!("{name}.valid.min"), *a, e.span);
                let high = self.name_param(&format!("{name}.valid.max"), *b, e.span);
                Value::Range(Box::new(low), Box::new(high))
            }
            other => other,
        }
    }

    fn reaction_enthalpy(&mut self, r: ReactionId) -> Value {
        let def = &self.tables.reactions[r.0 as usize];
        let (module, name, reverse) = (def.module, def.name.clone(), def.reverse);
        let dimension = self.tables.units.named("Energy").over(&self.tables.units.named("Amount"));
        let Some(Field { value: FieldValue::Expr(e), .. }) = field(def.fields, "enthalpy") else {
            return self.number(0.0, dimension, false);
        };
        let v = self.expr(e, &mut Scope::module(module));
        let v = self.coerce(v, &Type::Quantity { dimension, point: false, optional: false }, e.span, "enthalpy");
        match v {
            Value::Num(n) => {
                let n = self.name_param(&format!("{name}.enthalpy"), n, e.span);
                if reverse { self.negative(Value::Num(n)) } else { Value::Num(n) }
            }
            other => other,
        }
    }

    /// Orders in the species the rate depends on, in order of the text.
    pub fn orders(&mut self, r: ReactionId) -> Vec<(SpeciesId, f64)> {
        let def = &self.tables.reactions[r.0 as usize];
        let (module, key) = (def.module, if def.reverse { "reverse_order" } else { "order" });
        let Some(Field { value: FieldValue::Fields(lines), .. }) = field(def.fields, key) else { return Vec::new() };
        let mut out = Vec::new();
        for line in lines {
            let species = match self.order_of(r, line) {
                Ok(s) => s,
                Err(d) => {
                    self.report(*d);
                    continue;
                }
            };
            let FieldValue::Expr(e) = &line.value else { continue };
            let v = self.expr(e, &mut Scope::module(module));
            if let Value::Num(n) = self.coerce(v, &Type::ratio(), e.span, "order")
                && let Some(order) = self.graph.constant(n.node)
            {
                out.push((species, order));
            }
        }
        out
    }

    /// The species of a line of orders: one of the equation's.
    fn order_of(&self, r: ReactionId, line: &Field) -> Result<SpeciesId, Box<Diagnostic>> {
        let def = &self.tables.reactions[r.0 as usize];
        let species = self.tables.species.lookup(self.tables.names, def.module, &line.key)?;
        if def.reactants.iter().chain(&def.products).any(|(s, _)| *s == species) {
            return Ok(species);
        }
        let headline = format!("the equation of `{}` does not contain `{}`", def.name, line.key.text);
        let d = Diagnostic::error(codes::UNKNOWN_FIELD, line.key.span, headline, "not one of its species");
        Err(Box::new(d.help("write a catalyst on both sides: `A + C -> B + C`")))
    }

    /// Whether the order of each species is known; where one is not, nor is the unit of the rate constant.
    fn has_orders(&self, r: ReactionId) -> bool {
        let def = &self.tables.reactions[r.0 as usize];
        match field(def.fields, if def.reverse { "reverse_order" } else { "order" }) {
            Some(Field { value: FieldValue::Fields(lines), .. }) => lines.iter().all(|l| self.order_of(r, l).is_ok()),
            _ => true,
        }
    }

    /// A method of a reaction, with its arguments evaluated.
    pub fn reaction_method(
        &mut self,
        r: ReactionId,
        name: &str,
        values: Vec<Value>,
        span: Span,
        scope: &Scope,
    ) -> Value {
        match (name, values.as_slice()) {
            // What is wrong with the orders is said where they stand.
            ("rate", [Value::Num(_)]) if !self.has_orders(r) => Value::Error,
            ("rate", [Value::Num(t)]) => self.rate(r, t.clone()),
            ("order", [Value::Species(s)]) => {
                let order = self.orders(r).iter().find(|(o, _)| o == s).map_or(0.0, |(_, n)| *n);
                self.number(order, Dimension::one(), false)
            }
            ("coefficient", [Value::Species(s)]) => {
                let n = self.coefficient(r, *s);
                self.number(n, Dimension::one(), false)
            }
            ("requires", [Value::Instance(m)]) => self.requires(r, *m),
            ("basis", [Value::Instance(m)]) => self.basis(r, *m, span, scope),
            _ => self.wrong_arguments(name, span),
        }
    }

    /// The condition on a mixture, whose members it names, under which the reaction goes on; always where none is given.
    pub fn requires(&mut self, r: ReactionId, m: matterix_ir::scene::InstanceId) -> Value {
        let def = &self.tables.reactions[r.0 as usize];
        let module = def.module;
        match field(def.fields, "requires") {
            Some(Field { value: FieldValue::Expr(e), .. }) => {
                self.truth(e, &mut Scope::of(m, module)).map_or(Value::Error, Value::Bool)
            }
            _ => Value::Bool(self.graph.number(1.0)),
        }
    }

    /// Net coefficient: products count up, reactants down.
    pub fn coefficient(&self, r: ReactionId, s: SpeciesId) -> f64 {
        let def = &self.tables.reactions[r.0 as usize];
        let sum = |side: &[(SpeciesId, f64)]| side.iter().filter(|t| t.0 == s).map(|t| t.1).sum::<f64>();
        sum(&def.products) - sum(&def.reactants)
    }

    /// The rate constant at an absolute temperature, which the rate's expression knows as `T`.
    fn rate(&mut self, r: ReactionId, t: Num) -> Value {
        let def = &self.tables.reactions[r.0 as usize];
        let (module, name, span) = (def.module, def.name.clone(), def.span);
        let key = if def.reverse { "reverse" } else { "rate" };
        let Some(Field { value: FieldValue::Expr(e), .. }) = field(def.fields, key) else {
            self.report(
                Diagnostic::error(
                    codes::MISSING_FIELD,
                    span,
                    format!("`{name}` has no `{key}`"),
                    "its rate is unknown",
                )
                .help(format!("add `{key}: 0.6 L/(mol*s)` or `{key}: arrhenius(A: ..., Ea: ...)`")),
            );
            return Value::Error;
        };
        let mut scope = Scope::module(module);
        scope.bind("T", Value::Num(t));
        let prefix = format!("{}.{key}", name.trim_end_matches(".reverse"));
        self.rate_prefix = Some(prefix.clone());
        let v = self.expr(e, &mut scope);
        self.rate_prefix = None;
        match v {
            Value::Num(n) => Value::Num(self.name_param(&prefix, n, e.span)),
            Value::Error => Value::Error,
            other => self.expected("a rate constant", &other, e.span),
        }
    }

    /// The dimension `X` such that the rate constant is `1/s * (X/mol)^(order - 1)`; none where the order is 1.
    pub fn basis_dimension(&mut self, r: ReactionId) -> Option<Dimension> {
        let order: f64 = self.orders(r).iter().map(|o| o.1).sum();
        let t = self.placeholder_kelvin();
        let Value::Num(k) = self.rate(r, t) else { return None };
        let n = Rational::approximate(order)?;
        let less = Rational::new(n.num - n.den, n.den);
        if less.num == 0 || k.dimension.is_any() {
            return None;
        }
        let power = Rational::new(less.den, less.num);
        let per_second = k.dimension.times(&self.duration());
        Some(per_second.power(power).times(&self.tables.units.named("Amount")))
    }

    fn placeholder_kelvin(&mut self) -> Num {
        let dimension = self.tables.units.named("TemperatureDifference");
        Num { node: self.graph.number(298.15), dimension, point: false, unit: None, literal: false }
    }

    /// The size of a mixture in the basis of the rate constant: its mass for `kg/(mol*s)`, its volume for `L/(mol*s)`.
    fn basis(&mut self, r: ReactionId, m: matterix_ir::scene::InstanceId, span: Span, _: &Scope) -> Value {
        let wanted = self.basis_dimension(r);
        for member in self.derived_members(m) {
            let MemberKind::Value { role: Role::Derived, ty, .. } = &member.member.kind else { continue };
            let ty = self.resolve_type(ty, member.module);
            let Type::Quantity { dimension, point: false, .. } = &ty else { continue };
            let fits = match &wanted {
                Some(w) => w == dimension,
                // Of first order every basis gives the same: the first extensive one serves.
                None => *dimension == self.tables.units.named("Mass"),
            };
            if fits {
                return self.member_value(m, member, span);
            }
        }
        Value::Error
    }

    /// The rate constant's unit must fit the order: per mass, per volume or of first order. Says so once per reaction.
    pub fn check_rate(&mut self, r: ReactionId) {
        let def = &self.tables.reactions[r.0 as usize];
        let (name, key, fields) = (def.name.clone(), if def.reverse { "reverse" } else { "rate" }, def.fields);
        let Some(Field { value: FieldValue::Expr(e), .. }) = field(fields, key) else {
            let t = self.placeholder_kelvin();
            self.rate(r, t);
            return;
        };
        let order_key = if self.tables.reactions[r.0 as usize].reverse { "reverse_order" } else { "order" };
        if field(fields, order_key).is_none() {
            let span = self.tables.reactions[r.0 as usize].span;
            self.report(
                Diagnostic::error(codes::MISSING_FIELD, span, format!("`{name}` has no `{order_key}`"), "its rate law is incomplete")
                    .help(format!("give the orders: `{order_key}: {{ A: 1, B: 1 }}`; orders are measured and do not follow from the equation")),
            );
            return;
        }
        let mixture = self.tables.kinds.values().find(|k| k.matter.is_some()).map(|k| k.id);
        if let (true, Some(mixture)) = (self.prototype, mixture) {
            let stand_in = self.prototype_of(vec![mixture], "mixture");
            self.requires(r, stand_in);
        }
        let t = self.placeholder_kelvin();
        let Value::Num(k) = self.rate(r, t) else { return };
        let orders = self.orders(r);
        if let Some(Field { value: FieldValue::Fields(lines), .. }) = field(fields, order_key)
            && lines.len() != orders.len()
        {
            return;
        }
        if self.glance(k.node).is_some_and(|v| v < 0.0) {
            self.report(
                Diagnostic::error(codes::RATE_UNIT, e.span, "a rate constant cannot be negative", "negative")
                    .help("write the reaction in the opposite direction, or with `<->` and `reverse`"),
            );
            return;
        }
        let order: f64 = orders.iter().map(|o| o.1).sum();
        let bases = [self.tables.units.named("Mass"), self.tables.units.named("Volume")];
        let found = self.basis_dimension(r);
        let first = (order - 1.0).abs() < 1e-12;
        let right = if first {
            k.dimension.agrees(&Dimension::one().over(&self.duration()))
        } else {
            k.dimension.is_any() || found.as_ref().is_some_and(|f| bases.contains(f))
        };
        if right {
            return;
        }
        let expected: Vec<String> = if first {
            vec!["1/s".into()]
        } else {
            let Some(n) = Rational::approximate(order) else { return };
            bases.iter().map(|basis| self.rate_unit(n, basis)).collect()
        };
        let found = k.unit.as_ref().map_or_else(|| self.describe(&k), |u| u.symbol.clone());
        let mut d = Diagnostic::error(
            codes::RATE_UNIT,
            e.span,
            format!(
                "a rate constant of order {} cannot have the unit `{found}`",
                matterix_ir::quantity::show_number(order)
            ),
            format!("has the unit `{found}`"),
        )
        .help(format!(
            "for order {} use {}",
            matterix_ir::quantity::show_number(order),
            expected.iter().map(|u| format!("`{u}`")).collect::<Vec<_>>().join(" or ")
        ));
        if let Some(f) = field(fields, order_key) {
            d = d.because(f.span, format!("the orders sum to {}", matterix_ir::quantity::show_number(order)));
        }
        self.report(d);
    }

    /// The unit of a rate constant of this order on a basis, as it can be written: units have whole powers, so that a root stands beside them.
    fn rate_unit(&self, order: Rational, basis: &Dimension) -> String {
        let (amount, second) = (self.tables.units.named("Amount"), self.duration());
        let less = Rational::new(order.num - order.den, order.den);
        let symbol = |d: &Dimension| self.tables.units.symbol(d).replace("m^3", "L");
        if less.den != 2 {
            return symbol(&basis.over(&amount).power(less).over(&second));
        }
        let whole = match less.num / 2 {
            0 => "1/s".to_owned(),
            whole => symbol(&basis.over(&amount).power(Rational::new(whole, 1)).over(&second)),
        };
        let root = if less.num > 0 { basis.over(&amount) } else { amount.over(basis) };
        format!("1e-3 {whole} * sqrt(1 {})", symbol(&root))
    }
}
