//! Equilibria of a mixture: the system of those whose species can be there, and the numbers that it rests on.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::equilibrium::{
    Circle, Equation, Interactions, Layout, Member, Part, Phase, STANDARD, System, Unsettled, Written, rises,
    terms as terms_at,
};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, UnaryOp, codes};

use super::{Num, Scope, Value};
use crate::ast::{Expr, ExprKind, Field, FieldValue, MemberKind, NamedExpr};
use crate::chem::constants::{ANALYTIC, CONSTANTS, HEAT, LOG_PARTITION, PARTITION, POTENTIAL};
use crate::declare::species::field;
use crate::declare::tables::ReactionDef;
use crate::declare::{ReactionId, SpeciesId, Type};
use crate::eval::interactions::Acting;
use crate::eval::lab::{Elaborator, Mode};
use crate::names::DeclId;
use crate::units::Dimension;
use matterix_ir::listing::joined;
use matterix_ir::quantity::show_number;

/// Gas constant, J/(mol*K).
const GAS: f64 = 8.314_462_618_153_24;

/// Charge of a mole of electrons, C/mol (CODATA 2018).
const FARADAY: f64 = 96_485.332_123_310_02;

const LN_10: f64 = std::f64::consts::LN_10;

/// The option of an amount of matter that says what its equilibria rest on besides it: heat content, heat capacity, the temperature at
/// which heat contents are 0, and the coefficients of [`matterix_ir::equilibrium::Activities`].
pub const EQUILIBRIUM: &str = "equilibrium";

/// The option that names the property of species which is their heat capacity.
pub const CAPACITY: &str = "capacity_by";

/// The option that names the function of a mixture and a species whose numbers are [`matterix_ir::equilibrium::Coefficients`].
pub const COEFFICIENTS: &str = "coefficients_by";

/// The first items of that are the heat content and the heat capacity.
const HEAT_AND_CAPACITY: usize = 2;

/// The constant of an equilibrium.
struct Constant {
    /// The terms of its logarithm, as [`Layout`] has them.
    terms: [NodeId; Layout::TERMS],
    /// Enthalpy at the standard temperature, J/mol.
    enthalpy: NodeId,
}

/// The equilibria of one mixture.
#[derive(Debug)]
pub struct Speciation {
    /// They, and their species.
    pub system: Arc<System>,
    /// Its species, in the order of the members.
    pub members: Vec<SpeciesId>,
    /// So many of them, the first ones, are in its equations; the others are there for their activities alone.
    pub moved: usize,
    /// Which of all equilibria they are.
    pub equilibria: Vec<usize>,
    /// What it rests on, in the order of [`Layout`].
    pub args: Arc<[NodeId]>,
}

impl<'a> Elaborator<'a> {
    /// The amount of a species at equilibrium; none where it takes part in none.
    pub fn settled_amount(&mut self, id: InstanceId, s: SpeciesId) -> Option<NodeId> {
        self.settled(id, |speciation| Some(Part::Amount(speciation.place(s)?)))
    }

    /// A number of the equilibria of a mixture; none where it has none.
    pub fn settled(&mut self, id: InstanceId, part: impl FnOnce(&Speciation) -> Option<Part>) -> Option<NodeId> {
        let speciation = self.speciation(id)?;
        let part = part(&speciation)?;
        Some(self.graph.solved(&speciation.system, part, &speciation.args))
    }

    /// The amount of a species at equilibrium once all salts there have dissolved.
    pub fn ready_amount(&mut self, id: InstanceId, s: SpeciesId) -> NodeId {
        let place = self.speciation_with(id, true).and_then(|made| Some((made.place(s)?, made)));
        match place {
            Some((place, made)) => self.graph.solved(&made.system, Part::Amount(place), &made.args),
            None => self.held(id, s, true),
        }
    }

    /// The equilibria of a mixture; made once.
    pub fn speciation(&mut self, id: InstanceId) -> Option<Arc<Speciation>> {
        self.speciation_with(id, false)
    }

    /// The same, where `split` with all salts dissolved that there may still be.
    fn speciation_with(&mut self, id: InstanceId, split: bool) -> Option<Arc<Speciation>> {
        if self.tables.equilibria.is_empty() || self.prototype || self.mode().at_start || self.mode().pooled {
            return None;
        }
        if let Some(known) = self.speciations.get(&(id, split)) {
            return known.clone();
        }
        let made = self.in_mode(Mode { pooled: true, ..Mode::default() }, |lab| lab.make_speciation(id, None, split));
        let made = made.map(Arc::new);
        self.speciations.insert((id, split), made.clone());
        made
    }

    /// The heat that it takes to come to equilibrium at a temperature from what a mixture holds once its salts have dissolved, with the heat of the change in heat capacity; none where there are no equilibria.
    pub fn heat_of_settling(&mut self, id: InstanceId, temperature: NodeId) -> Option<NodeId> {
        if self.tables.equilibria.is_empty() || self.prototype {
            return None;
        }
        let mode = Mode { at_start: self.mode().at_start, pooled: true, ..Mode::default() };
        let made = self.in_mode(mode, |lab| lab.make_speciation(id, Some(temperature), true))?;
        let heat = self.graph.solved(&made.system, Part::Heat, &made.args);
        let capacity = self.graph.solved(&made.system, Part::Capacity, &made.args);
        let reference = self.in_mode(mode, |lab| lab.surroundings(id))?[2];
        let warmer = self.graph.binary(BinaryOp::Sub, temperature, reference);
        let warm = self.graph.binary(BinaryOp::Mul, capacity, warmer);
        Some(self.graph.binary(BinaryOp::Add, heat, warm))
    }

    /// Writes out the system of a mixture; at a temperature that is given, or at the one that its heat content makes; where `split` with
    /// what salts, acids and bases will give that have not dissolved yet.
    fn make_speciation(&mut self, id: InstanceId, temperature: Option<NodeId>, split: bool) -> Option<Speciation> {
        let here: BTreeMap<SpeciesId, u32> = self.amounts_in(id).collect();
        let equilibria: Vec<usize> = (0..self.tables.equilibria.len())
            .filter(|e| {
                let def = &self.tables.equilibria[*e];
                def.gas.is_none() && def.terms.iter().all(|(s, _)| here.contains_key(s) || self.is_formal(*s))
            })
            .collect();
        let water = here.keys().copied().find(|s| self.tables.species.get(*s).is_water)?;
        let mut members = vec![water];
        for e in &equilibria {
            for (s, _) in &self.tables.equilibria[*e].terms {
                if !members.contains(s) {
                    members.push(*s);
                }
            }
        }
        let moved = members.len();
        // What gases dissolve as has an activity, whether an equation moves it or not.
        let dissolved = self.tables.equilibria.iter().filter_map(|e| Some(e.gas?.1));
        for s in dissolved.filter(|s| here.contains_key(s)).collect::<BTreeSet<_>>() {
            if !members.contains(&s) {
                members.push(s);
            }
        }
        if members.len() == 1 {
            return None;
        }
        let acting = match self.spread_of_interactions(id) {
            Some(spread) => {
                let charge = |s: &SpeciesId| self.tables.species.get(*s).charge();
                let acts = |s: &SpeciesId| {
                    let mut interactions = self.tables.interactions.iter();
                    interactions.any(|i| i.members.contains(s) && i.members.iter().all(|m| here.contains_key(m)))
                };
                let others = here.keys().filter(|s| charge(s) != 0 || acts(s));
                let others: Vec<SpeciesId> = others.copied().filter(|s| !members.contains(s)).collect();
                members.extend(others);
                Some(self.acting(id, &members, spread)?)
            }
            None => None,
        };
        let system = self.system_of(&members, &equilibria, acting.as_ref().map(|acting| &acting.written))?;
        let args = self.numbers_of(id, &members, &equilibria, &system, (temperature, split))?;
        let args = match acting {
            Some(acting) => self.with_interactions(args, &acting, system.layout())?,
            None => args.into(),
        };
        Some(Speciation { system, members, moved, equilibria, args })
    }

    fn is_formal(&self, s: SpeciesId) -> bool {
        self.tables.species.get(s).is_electron
    }

    /// The system of some equilibria; made once for all mixtures that have the same.
    fn system_of(
        &mut self,
        members: &[SpeciesId],
        equilibria: &[usize],
        acting: Option<&Interactions>,
    ) -> Option<Arc<System>> {
        let numbers = |all: &Interactions| {
            let reach = all.each.iter().flat_map(|each| each.reach.map(f64::to_bits));
            [all.spread.to_bits()].into_iter().chain(reach).collect()
        };
        let key = (members.to_vec(), equilibria.to_vec(), acting.map_or_else(Vec::new, numbers));
        if let Some(known) = self.systems.get(&key) {
            return known.clone();
        }
        let mut written = self.written_system(members, equilibria);
        written.interactions = acting.cloned();
        let made = System::try_from(written).ok().map(Arc::new);
        self.systems.insert(key, made.clone());
        made
    }

    fn written_system(&self, members: &[SpeciesId], equilibria: &[usize]) -> Written {
        let tables = self.tables;
        let is_solid = |s: &SpeciesId| equilibria.iter().any(|e| tables.equilibria[*e].solids.contains(s));
        let member = |s: &SpeciesId| {
            let def = tables.species.get(*s);
            let phase = match (def.is_water, is_solid(s)) {
                (true, _) => Phase::Solvent,
                (_, true) => Phase::Solid,
                _ if def.is_electron => Phase::Formal,
                _ if def.liquid.is_some() => Phase::Extracted,
                _ => Phase::Solute,
            };
            Member { name: def.name.clone(), phase, charge: f64::from(def.charge()) }
        };
        let equation = |e: &usize| {
            let def = &tables.equilibria[*e];
            let of = |s: &SpeciesId| def.terms.iter().find(|(t, _)| t == s).map_or(0.0, |(_, n)| *n);
            Equation { name: def.name.clone(), coefficients: members.iter().map(of).collect() }
        };
        let solvent_mass = members.first().map_or(0.0, |s| tables.species.get(*s).molar_mass);
        let (members, equations) = (members.iter().map(member).collect(), equilibria.iter().map(equation).collect());
        Written { members, equations, solvent_mass, interactions: None }
    }

    fn numbers_of(
        &mut self,
        id: InstanceId,
        members: &[SpeciesId],
        equilibria: &[usize],
        system: &System,
        (temperature, split): (Option<NodeId>, bool),
    ) -> Option<Vec<NodeId>> {
        let layout = system.layout();
        let around = self.surroundings(id)?;
        let none = self.graph.number(0.0);
        let mut args = vec![none; layout.count()];
        let [heat, capacity, reference, activities @ ..] = around.as_slice() else { return None };
        for (i, node) in activities.iter().enumerate() {
            *args.get_mut(i).filter(|_| i < Layout::ACTIVITIES)? = *node;
        }
        for (r, e) in equilibria.iter().enumerate() {
            let Constant { terms, enthalpy } = self.constant_of(*e)?;
            args[layout.constant(r)..layout.constant(r + 1)].copy_from_slice(&terms);
            args[layout.enthalpy(r)] = enthalpy;
        }
        let law = self.law_of_activity(id);
        let property = self.capacity_property(id);
        for (i, s) in members.iter().enumerate() {
            args[layout.amount(i)] = self.held(id, *s, split);
            if let Some(capacity) = property.as_ref().and_then(|p| self.number_of(*s, p)) {
                args[layout.capacity_of(i)] = capacity;
            }
            if let Some(law) = law {
                let at = layout.coefficients(i);
                args[at..at + Layout::COEFFICIENTS].copy_from_slice(&self.coefficients_of(id, *s, law)?);
            }
        }
        let liquids = members.iter().filter_map(|s| self.tables.species.get(*s).liquid);
        for (k, liquid) in liquids.collect::<Vec<_>>().into_iter().enumerate() {
            let amount = self.held(id, liquid, split);
            args[layout.liquid(k)] = self.multiple(self.tables.species.get(liquid).molar_mass, amount);
        }
        let ions = self.bystanders(id, members);
        args[layout.bystanders()] = self.weighed(id, &ions, split, |charge| 0.5 * charge * charge);
        args[layout.bystander_amount()] = self.weighed(id, &ions, split, |_| 1.0);
        match temperature {
            Some(temperature) => {
                args[layout.capacity()] = self.graph.number(f64::INFINITY);
                args[layout.reference()] = temperature;
            }
            None => {
                (args[layout.heat()], args[layout.capacity()]) = (*heat, *capacity);
                args[layout.reference()] = *reference;
            }
        }
        Some(args)
    }

    /// Fills in the numbers of interactions.
    fn with_interactions(&mut self, mut args: Vec<NodeId>, acting: &Acting, layout: Layout) -> Option<Arc<[NodeId]>> {
        let mut next = 0;
        for interaction in &acting.which {
            for terms in self.numbers_of_interaction(*interaction)? {
                args[layout.interaction(next)..layout.interaction(next + 1)].copy_from_slice(&terms);
                next += 1;
            }
        }
        Some(args.into())
    }

    /// What is there of a species; where `split` with what salts, acids and bases will give of it, as far as there is water: a dry hydrate keeps
    /// its own.
    fn held(&mut self, id: InstanceId, s: SpeciesId, split: bool) -> NodeId {
        let here: Vec<(SpeciesId, u32)> = self.amounts_in(id).collect();
        let is_water = |s: &SpeciesId| self.tables.species.get(*s).is_water;
        let water = here.iter().find(|(s, _)| is_water(s)).map(|(_, state)| *state);
        let mut sum = self.graph.number(0.0);
        let mut to_come = self.graph.number(0.0);
        for (other, state) in here {
            let count = match other == s {
                true => 1.0,
                false if split && self.splits(other) && !self.is_precipitate(other) => {
                    let ions = &self.tables.species.get(other).dissolves;
                    ions.iter().filter(|(ion, _)| *ion == s).map(|(_, n)| *n).sum()
                }
                false => 0.0,
            };
            if count == 0.0 {
                continue;
            }
            let amount = self.as_put(state);
            let count = self.graph.number(count);
            let part = self.graph.binary(BinaryOp::Mul, count, amount);
            let of = if other == s { &mut sum } else { &mut to_come };
            *of = self.graph.binary(BinaryOp::Add, *of, part);
        }
        let nothing = self.graph.number(0.0);
        let Some(water) = water.filter(|_| to_come != nothing) else { return sum };
        let water = self.as_put(water);
        let is_wet = self.graph.binary(BinaryOp::Lt, nothing, water);
        let to_come = self.graph.select(is_wet, to_come, nothing);
        self.graph.binary(BinaryOp::Add, sum, to_come)
    }

    /// The ions that are in no equilibrium, with their charges.
    fn bystanders(&self, id: InstanceId, members: &[SpeciesId]) -> Vec<(SpeciesId, f64)> {
        let charge = |s: SpeciesId| self.tables.species.get(s).charge();
        let others = self.amounts_in(id).filter(|(s, _)| !members.contains(s));
        others.map(|(s, _)| (s, f64::from(charge(s)))).filter(|(_, charge)| *charge != 0.0).collect()
    }

    /// The sum of amounts, each by a weight of its charge.
    fn weighed(
        &mut self,
        id: InstanceId,
        ions: &[(SpeciesId, f64)],
        split: bool,
        weight: impl Fn(f64) -> f64,
    ) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for (s, charge) in ions {
            let amount = self.held(id, *s, split);
            let part = self.multiple(weight(*charge), amount);
            sum = self.graph.binary(BinaryOp::Add, sum, part);
        }
        sum
    }

    /// What the equilibria of a mixture rest on besides its amounts, as its kind declares.
    fn surroundings(&mut self, id: InstanceId) -> Option<Vec<NodeId>> {
        let (option, member) = self.matter_option(id, EQUILIBRIUM)?;
        let ExprKind::Tuple(items, _) = &*option.value.kind else { return None };
        let none = self.graph.number(0.0);
        let mut scope = Scope::of_member(id, member);
        let mut found = Vec::with_capacity(items.len());
        for (i, item) in items.iter().enumerate() {
            // At the start the temperature is given, and the heat content follows from it.
            let is_left_out = i < HEAT_AND_CAPACITY && self.mode().at_start;
            let node = if is_left_out {
                none
            } else {
                let value = self.expr(item, &mut scope);
                self.value_node(&value)?
            };
            found.push(node);
        }
        Some(found)
    }

    /// An option of the amount of matter of a mixture, and the member that declares it.
    pub fn matter_option(&self, id: InstanceId, name: &str) -> Option<(&'a NamedExpr, crate::declare::MemberRef<'a>)> {
        let member = self.all_members(id).iter().copied().find(|m| self.is_matter(id, *m))?;
        let MemberKind::Value { options, .. } = &member.member.kind else { return None };
        Some((options.iter().find(|o| o.name.text == name)?, member))
    }

    /// The function whose numbers the activity coefficients of a mixture follow.
    fn law_of_activity(&mut self, id: InstanceId) -> Option<DeclId> {
        let (option, member) = self.matter_option(id, COEFFICIENTS)?;
        let ExprKind::Text(name) = &*option.value.kind else { return None };
        self.lookup(member.module, name)
    }

    fn coefficients_of(&mut self, id: InstanceId, s: SpeciesId, law: DeclId) -> Option<[NodeId; Layout::COEFFICIENTS]> {
        let Value::List(numbers) = self.call_with(law, vec![Value::Instance(id), Value::Species(s)])? else {
            return None;
        };
        let nodes: Vec<NodeId> = numbers.iter().map(|n| self.value_node(n)).collect::<Option<_>>()?;
        nodes.try_into().ok()
    }

    fn capacity_property(&self, id: InstanceId) -> Option<String> {
        let (option, _) = self.matter_option(id, CAPACITY)?;
        match &*option.value.kind {
            ExprKind::Text(text) => Some(text.clone()),
            _ => None,
        }
    }

    fn number_of(&mut self, s: SpeciesId, property: &str) -> Option<NodeId> {
        let name = crate::ast::Name { text: property.to_owned(), span: self.tables.species.get(s).span };
        match self.member(Value::Species(s), &name) {
            Value::Num(n) => Some(n.node),
            _ => None,
        }
    }

    fn constant_of(&mut self, e: usize) -> Option<Constant> {
        let def = &self.tables.equilibria[e];
        let (name, fields, module) = (def.name.clone(), def.fields, def.module);
        let (key, given) = CONSTANTS.iter().find_map(|key| Some((*key, expr_of(fields, key)?)))?;
        if key == ANALYTIC {
            let constant = self.analytic(given, module)?;
            let enthalpy = self.enthalpy_of(e, HEAT).unwrap_or(constant.enthalpy);
            return Some(Constant { enthalpy, ..constant });
        }
        let v = self.expr(given, &mut Scope::module(module));
        let ty = if key == POTENTIAL { self.voltage() } else { Type::ratio() };
        let Value::Num(n) = self.coerce(v, &ty, given.span, key) else { return None };
        let n = self.name_param(&format!("{name}.{key}"), n, given.span);
        let ln_k = match key {
            POTENTIAL => {
                // The law of Nernst: R T ln K = n F E.
                let at = self.given_at(e)?;
                let charge = self.multiple(self.electrons_of(e) * FARADAY / GAS, n.node);
                self.graph.binary(BinaryOp::Div, charge, at)
            }
            "constant" | "ksp" => {
                let node = self.graph.unary(UnaryOp::Ln, n.node);
                self.note_place(node, given.span);
                node
            }
            "log_constant" => self.multiple(LN_10, n.node),
            PARTITION | LOG_PARTITION => {
                let ln = match key {
                    PARTITION => self.graph.unary(UnaryOp::Ln, n.node),
                    _ => self.multiple(LN_10, n.node),
                };
                self.note_place(ln, given.span);
                let shift = self.per_kilogram(e)?;
                self.graph.binary(BinaryOp::Add, ln, shift)
            }
            _ => self.multiple(-LN_10, n.node),
        };
        let mut terms = [self.graph.number(0.0); Layout::TERMS];
        terms[0] = ln_k;
        let Some(enthalpy) = self.enthalpy_of(e, "enthalpy").or_else(|| self.heat_of_its_solid(e)) else {
            return Some(Constant { enthalpy: terms[1], terms });
        };
        // The law of van 't Hoff: ln K = ln K(at) + enthalpy / R (1 / at - 1 / T).
        let at = self.given_at(e)?;
        let gas = self.graph.number(GAS);
        let scale = self.graph.binary(BinaryOp::Mul, gas, at);
        let shift = self.graph.binary(BinaryOp::Div, enthalpy, scale);
        terms[0] = self.graph.binary(BinaryOp::Add, ln_k, shift);
        terms[1] = self.multiple(-1.0 / GAS, enthalpy);
        Some(Constant { terms, enthalpy })
    }

    /// What turns the logarithm of a ratio of concentrations in two liquids into that of molalities: that of the density of water over the
    /// other one's.
    fn per_kilogram(&mut self, e: usize) -> Option<NodeId> {
        let species = self.tables.equilibria[e].terms.iter().map(|(s, _)| *s);
        let liquid = species.filter_map(|s| self.tables.species.get(s).liquid).next()?;
        let water = self.tables.species.iter().map(|(s, _)| s).find(|s| self.tables.species.get(*s).is_water)?;
        let [of_water, of_liquid] = [water, liquid].map(|s| self.number_of(s, "density"));
        let ratio = self.graph.binary(BinaryOp::Div, of_water?, of_liquid?);
        Some(self.graph.unary(UnaryOp::Ln, ratio))
    }

    /// `log10 K = A1 + A2 T + A3 / T + A4 log10 T + A5 / T^2 + A6 T^2`, with the temperature T in K; those that are left out are 0.
    fn analytic(&mut self, given: &'a Expr, module: usize) -> Option<Constant> {
        let v = self.expr(given, &mut Scope::module(module));
        let Value::List(numbers) = self.coerce(v, &Type::List(Type::ratio().into()), given.span, ANALYTIC) else {
            return None;
        };
        if numbers.is_empty() || numbers.len() > Layout::TERMS {
            let headline = format!("`analytic` takes 1 to {} numbers, not {}", Layout::TERMS, numbers.len());
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, given.span, headline, "coefficients of log10 K");
            self.report(d.help("log10 K = A1 + A2 T + A3 / T + A4 log10 T + A5 / T^2 + A6 T^2, with T in K"));
            return None;
        }
        // Where each stands among the terms of ln K, and what it is multiplied by.
        let places = [(0, LN_10), (3, LN_10), (1, LN_10), (2, 1.0), (4, LN_10), (5, LN_10)];
        let mut terms = [self.graph.number(0.0); Layout::TERMS];
        for (number, (place, factor)) in numbers.iter().zip(places) {
            let node = self.value_node(number)?;
            terms[place] = self.multiple(factor, node);
        }
        // What each term adds to the enthalpy, R T^2 d(ln K) / dT.
        let mut enthalpy = self.graph.number(0.0);
        for (term, rise) in terms.into_iter().zip(rises(STANDARD)) {
            let part = self.multiple(GAS * STANDARD * STANDARD * rise, term);
            enthalpy = self.graph.binary(BinaryOp::Add, enthalpy, part);
        }
        Some(Constant { terms, enthalpy })
    }

    fn multiple(&mut self, factor: f64, node: NodeId) -> NodeId {
        let factor = self.graph.number(factor);
        self.graph.binary(BinaryOp::Mul, factor, node)
    }

    fn voltage(&self) -> Type {
        Type::Quantity { dimension: self.tables.units.named("Voltage"), point: false, optional: false }
    }

    /// How many electrons a half-cell takes up.
    fn electrons_of(&self, e: usize) -> f64 {
        let terms = &self.tables.equilibria[e].terms;
        -terms.iter().filter(|(s, _)| self.is_formal(*s)).map(|(_, n)| n).sum::<f64>()
    }

    fn enthalpy_of(&mut self, e: usize, key: &str) -> Option<NodeId> {
        let def = &self.tables.equilibria[e];
        let (name, given, module) = (def.name.clone(), expr_of(def.fields, key)?, def.module);
        let dimension = self.tables.units.named("Energy").over(&self.tables.units.named("Amount"));
        let v = self.expr(given, &mut Scope::module(module));
        let ty = Type::Quantity { dimension, point: false, optional: false };
        match self.coerce(v, &ty, given.span, key) {
            Value::Num(n) => Some(self.name_param(&format!("{name}.{key}"), n, given.span).node),
            _ => None,
        }
    }

    /// The temperature of the constant.
    fn given_at(&mut self, e: usize) -> Option<NodeId> {
        let def = &self.tables.equilibria[e];
        let module = def.module;
        let Some(given) = expr_of(def.fields, "at") else { return Some(self.graph.number(STANDARD)) };
        let v = self.expr(given, &mut Scope::module(module));
        let ty = self.temperature_type();
        match self.coerce(v, &ty, given.span, "at") {
            Value::Num(n) => Some(n.node),
            _ => None,
        }
    }

    fn temperature_type(&self) -> Type {
        let dimension = self.tables.units.dimension("Temperature").map_or_else(Dimension::any, |d| d.dimension.clone());
        Type::Quantity { dimension, point: true, optional: false }
    }

    /// Checks an equilibrium by itself: its numbers, and that its constant is above 0.
    pub fn check_equilibrium(&mut self, e: usize) {
        let (at, valid) = {
            let fields = self.tables.equilibria[e].fields;
            (expr_of(fields, "at"), expr_of(fields, "valid"))
        };
        if at.is_some() {
            self.given_at(e);
        }
        if let Some(valid) = valid {
            let module = self.tables.equilibria[e].module;
            let v = self.expr(valid, &mut Scope::module(module));
            let ty = Type::Range(self.temperature_type().into());
            self.coerce(v, &ty, valid.span, "valid");
        }
        let fields = self.tables.equilibria[e].fields;
        let Some(Constant { terms, .. }) = self.constant_of(e) else { return };
        if terms.iter().all(|term| self.glance(*term).is_none_or(f64::is_finite)) {
            return self.check_size(e, &terms);
        }
        let span =
            CONSTANTS.iter().find_map(|key| expr_of(fields, key)).map_or(self.tables.equilibria[e].span, |e| e.span);
        let headline = "the constant of an equilibrium must be above 0";
        let d = Diagnostic::error(codes::OUT_OF_RANGE, span, headline, "not above 0");
        self.report(d.help("for a complete reaction give a large constant: `constant: 1e20`"));
    }

    /// A constant that is no constant of anything is a slip: 161 V for 1.61 V, a pKa of 475.
    fn check_size(&mut self, e: usize, terms: &[NodeId]) {
        let t = self.graph.number(STANDARD);
        let node = self.constant_of_terms(terms, t);
        let Some(ln) = self.glance(node) else { return };
        let fields = self.tables.equilibria[e].fields;
        let electrons = self.electrons_of(e).abs();
        let name = &self.tables.equilibria[e].name;
        let (size, most, headline) = match expr_of(fields, POTENTIAL) {
            Some(_) => {
                let volts = ln * GAS * STANDARD / (electrons * FARADAY);
                (volts, MOST_VOLTS, format!("the potential of `{name}` is {} V", show_number(volts)))
            }
            None => {
                let power = ln / LN_10;
                let headline = format!("the constant of `{name}` is 10^{} at 25 degC", show_number(power));
                (power / electrons.max(1.0), MOST_POWERS, headline)
            }
        };
        if size.abs() <= most {
            return;
        }
        let span =
            CONSTANTS.iter().find_map(|key| expr_of(fields, key)).map_or(self.tables.equilibria[e].span, |e| e.span);
        let d = Diagnostic::error(codes::OUT_OF_RANGE, span, headline, "no equilibrium in water has that");
        self.report(d.help(
            "is a digit, a sign or a unit wrong? half-cells are between -5 and 5 V, constants between 1e-300 and 1e300",
        ));
    }

    /// An equilibrium that follows from those before it must agree with them: each circle of constants closes.
    pub fn check_circles(&mut self, last: usize) {
        let all = self.known_circles();
        match &*all {
            Ok(circles) => circles
                .iter()
                .filter(|circle| circle.factors.iter().rposition(|f| f.abs() > NO_PART) == Some(last))
                .for_each(|circle| self.check_circle(&circle.factors, None)),
            Err(why) => {
                let def = &self.tables.equilibria[last];
                if why.0.contains(&format!("`{}`", def.name)) {
                    let headline = format!("this equilibrium cannot be solved: {why}");
                    let d =
                        Diagnostic::error(codes::EQUILIBRIUM_FORM, def.equation, headline, "needs dissolved species");
                    self.report(d.help("an equilibrium relates species dissolved in water, or a solid and its ions"));
                }
            }
        }
    }

    fn known_circles(&mut self) -> Arc<Result<Vec<Circle>, Unsettled>> {
        match self.circles.clone() {
            Some(known) => known,
            None => {
                let found = Arc::new(self.all_circles());
                self.circles.insert(found).clone()
            }
        }
    }

    /// A module of the library must agree with the others that a file uses: some have the same salts with other constants.
    pub fn check_circles_of_module(&mut self, module: usize, used: Span) {
        let all = self.known_circles();
        let Ok(circles) = &*all else { return };
        for circle in circles {
            let part: Vec<usize> = (0..circle.factors.len()).filter(|e| circle.factors[*e].abs() > NO_PART).collect();
            let of = |e: &usize| self.tables.equilibria[*e].module;
            let is_here = part.iter().any(|e| of(e) == module) && part.iter().any(|e| of(e) != module);
            // It is told where the last of its modules is used.
            if is_here && part.iter().all(|e| self.is_of_library(*e)) && part.iter().map(of).max() == Some(module) {
                self.check_circle(&circle.factors, Some(used));
            }
        }
    }

    fn is_of_library(&self, e: usize) -> bool {
        self.tables.names.modules[self.tables.equilibria[e].module].is_library()
    }

    /// The circles of all equilibria of the file.
    fn all_circles(&self) -> Result<Vec<Circle>, Unsettled> {
        let (all, members) = self.solved_together();
        let system = System::try_from(self.written_system(&members, &all))?;
        let of_all = |circle: &Circle| {
            let mut factors = vec![0.0; self.tables.equilibria.len()];
            all.iter().zip(&circle.factors).for_each(|(e, factor)| factors[*e] = *factor);
            Circle { factors }
        };
        Ok(system.circles().iter().map(of_all).collect())
    }

    /// All equilibria of the file but those of gases, each of which stands in one equation alone; and their species, water first.
    fn solved_together(&self) -> (Vec<usize>, Vec<SpeciesId>) {
        let is_dissolved = |e: &usize| self.tables.equilibria[*e].gas.is_none();
        let all: Vec<usize> = (0..self.tables.equilibria.len()).filter(is_dissolved).collect();
        let water = self.tables.species.iter().map(|(s, _)| s).find(|s| self.tables.species.get(*s).is_water);
        let mut members: Vec<SpeciesId> = water.into_iter().collect();
        let mut known: BTreeSet<SpeciesId> = members.iter().copied().collect();
        let terms = all.iter().flat_map(|e| self.tables.equilibria[*e].terms.iter().map(|(s, _)| *s));
        members.extend(terms.filter(|s| known.insert(*s)));
        (all, members)
    }

    /// A reaction that equilibria of the file make up is at rest at every moment: whatever its rate says, it would give off heat for ever.
    pub fn check_at_rest(&mut self, reaction: ReactionId) {
        let def = &self.tables.reactions[reaction.0 as usize];
        let mut net: BTreeMap<SpeciesId, f64> = BTreeMap::new();
        def.products.iter().for_each(|(s, n)| *net.entry(*s).or_default() += n);
        def.reactants.iter().for_each(|(s, n)| *net.entry(*s).or_default() -= n);
        net.retain(|_, n| *n != 0.0);
        let (all, members) = self.solved_together();
        if def.reverse || net.is_empty() || net.keys().any(|s| !members.contains(s)) {
            return;
        }
        let mut written = self.written_system(&members, &all);
        let coefficients = members.iter().map(|s| net.get(s).copied().unwrap_or(0.0)).collect();
        written.equations.push(Equation { name: def.name.clone(), coefficients });
        let Ok(system) = System::try_from(written) else { return };
        let is_of_it = |circle: &&Circle| circle.factors.last().is_some_and(|f| f.abs() > NO_PART);
        let Some(circle) = system.circles().iter().find(is_of_it) else { return };
        let part = all.iter().zip(&circle.factors).filter(|(_, f)| f.abs() > NO_PART);
        let names: Vec<String> = part.map(|(e, _)| format!("`{}`", self.tables.equilibria[*e].name)).collect();
        let headline = format!("`{}` is always at equilibrium because of {}", def.name, joined(&names, "and"));
        let d = Diagnostic::error(codes::REACTION_AT_EQUILIBRIUM, def.span, headline, "its rate would have no effect");
        self.report(d.help("remove the reaction, or the equilibria if you want to follow its rate"));
    }

    /// Whether a circle closes; told where the last of its equilibria stands, or at a place that is given.
    fn check_circle(&mut self, factors: &[f64], at: Option<Span>) {
        let part: Vec<(usize, f64)> = factors.iter().copied().enumerate().filter(|(_, f)| f.abs() > NO_PART).collect();
        // Where enthalpies contradict each other, the circle is open at other temperatures.
        let mut sums = [0.0; 2];
        for (e, factor) in &part {
            let Some(Constant { terms, .. }) = self.constant_of(*e) else { return };
            let Some(terms) = terms.iter().map(|term| self.glance(*term)).collect::<Option<Vec<f64>>>() else { return };
            for (sum, t) in sums.iter_mut().zip([STANDARD, WARM]) {
                *sum += factor * terms.iter().zip(terms_at(t)).map(|(term, of)| term * of).sum::<f64>();
            }
        }
        let [off, off_where_warm] = sums.map(|sum| (sum / LN_10).abs());
        let label = match (off <= CLOSED, off_where_warm <= CLOSED) {
            (true, true) => return,
            (false, _) => format!("differs by {off:.2} in log10 K from the value that the others imply"),
            _ => format!("agrees with the others at 25 degC, but differs by {off_where_warm:.2} in log10 K at 60 degC"),
        };
        let names: Vec<String> = part.iter().map(|(e, _)| format!("`{}`", self.tables.equilibria[*e].name)).collect();
        let Some((last, _)) = part.last() else { return };
        let last = &self.tables.equilibria[*last];
        let headline = format!("the constants of {} contradict each other", joined(&names, "and"));
        let mut d = Diagnostic::error(codes::EQUILIBRIA_CONTRADICT, at.unwrap_or(last.equation), headline, label);
        for (e, _) in &part[..part.len() - 1] {
            let other = &self.tables.equilibria[*e];
            d = d.because(other.equation, format!("`{}` is one of the others", other.name));
        }
        // One of the library gives way to one of the file with its name.
        let theirs = part.iter().map(|(e, _)| *e).find(|e| self.is_of_library(*e));
        let help = match theirs.filter(|_| part.iter().any(|(e, _)| !self.is_of_library(*e))) {
            Some(e) => format!(
                "remove one of them, as it follows from the rest; to replace the library's, call yours `{}`",
                self.tables.equilibria[e].name
            ),
            None => "remove one of them, as it follows from the rest".to_owned(),
        };
        self.report(d.help(help));
    }

    /// Whether a salt, acid or base splits by itself: one in an equilibrium dissolves by that.
    pub fn splits(&self, s: SpeciesId) -> bool {
        let is_balanced = self.tables.equilibria.iter().any(|e| e.involves(s));
        !is_balanced && !self.tables.species.get(s).dissolves.is_empty()
    }

    /// Whether a reaction of the file makes a salt of all its ions: it is a solid then, and does not split.
    fn is_precipitate(&self, s: SpeciesId) -> bool {
        let ions = &self.tables.species.get(s).dissolves;
        let has = |all: &[(SpeciesId, f64)], s: SpeciesId| all.iter().any(|(other, _)| *other == s);
        let makes = |r: &ReactionDef<'_>| has(&r.products, s) && ions.iter().all(|(ion, _)| has(&r.reactants, *ion));
        self.tables.reactions.iter().any(makes)
    }

    /// Whether equilibria have a species as a solid of its own.
    pub fn is_solid(&self, s: SpeciesId) -> bool {
        self.tables.equilibria.iter().any(|e| e.solids.contains(&s))
    }

    /// The heat of an equilibrium by which a mole of a solid with a `heat_of_solution` dissolves, if it is that.
    fn heat_of_its_solid(&mut self, e: usize) -> Option<NodeId> {
        let way = self.way_of_solid(e)?;
        let heat = self.number_of(*self.tables.equilibria[e].solids.first()?, HEAT_OF_SOLUTION)?;
        Some(self.multiple(way, heat))
    }

    /// 1 where a mole of a solid with a `heat_of_solution` dissolves from left to right, -1 where it does from right to left; none elsewhere.
    fn way_of_solid(&self, e: usize) -> Option<f64> {
        let def = &self.tables.equilibria[e];
        let [solid] = def.solids.as_slice() else { return None };
        let (_, count) = def.terms.iter().find(|(s, _)| s == solid)?;
        let is_stated = field(self.tables.species.get(*solid).fields, HEAT_OF_SOLUTION).is_some();
        (count.abs() == 1.0 && is_stated).then_some(-count.signum())
    }

    /// Whether an equilibrium is between a species and other uncharged ones that are dissolved with it, without water.
    pub fn isomerises(&self, s: SpeciesId) -> bool {
        let is_plain = |(s, _): &(SpeciesId, f64)| {
            let def = self.tables.species.get(*s);
            def.charge() == 0 && !def.is_water && !def.is_electron && def.liquid.is_none()
        };
        let mut of = self.tables.equilibria.iter().filter(|e| e.gas.is_none() && e.solids.is_empty() && e.involves(s));
        of.any(|e| e.terms.iter().all(is_plain))
    }

    /// Whether all equilibria that a species is in, and there are some, say nothing of their heat.
    pub fn lacks_heat(&self, s: SpeciesId) -> bool {
        let mut of = (0..self.tables.equilibria.len())
            .filter(|e| self.tables.equilibria[*e].gas.is_none() && self.tables.equilibria[*e].involves(s))
            .peekable();
        let says = |e: usize| {
            let fields = self.tables.equilibria[e].fields;
            ["enthalpy", HEAT, ANALYTIC].iter().any(|key| expr_of(fields, key).is_some())
                || self.way_of_solid(e).is_some()
        };
        of.peek().is_some() && of.all(|e| !says(e))
    }

    /// The heat that a mole of a solid takes up as it dissolves whole, by its equilibrium; 0 where it has none.
    pub fn heat_of_solid(&mut self, s: SpeciesId) -> NodeId {
        let ways = self.tables.equilibria.iter().map(|e| e.dissolving_whole(|solid, _| solid == s));
        let of = ways.enumerate().find_map(|(e, way)| Some((e, way?.1)));
        let heat = of.and_then(|(e, way)| Some((self.constant_of(e)?.enthalpy, way)));
        match heat {
            Some((enthalpy, way)) => self.multiple(way, enthalpy),
            None => self.graph.number(0.0),
        }
    }

    /// The amount of a species as it was put into a mixture; none of what cannot be there.
    pub fn put_in(&mut self, id: InstanceId, s: SpeciesId) -> NodeId {
        let state = self.amounts_in(id).find(|(other, _)| *other == s).map(|(_, state)| state);
        match state {
            Some(state) => self.as_put(state),
            None => self.graph.number(0.0),
        }
    }

    /// An amount as a state has it, or as it is at the start.
    fn as_put(&mut self, state: u32) -> NodeId {
        match self.mode().at_start {
            true => self.states[state as usize].initial,
            false => self.graph.add(Op::State(state)),
        }
    }

    /// `-log10` and the like of the activity of a species at equilibrium; `otherwise` where it takes part in none.
    pub fn activity_of(&mut self, id: InstanceId, s: SpeciesId, otherwise: &Num) -> Value {
        if let Some(e) = self.of_gas(s) {
            let node = self.activity_of_gas(id, e).unwrap_or(otherwise.node);
            return Value::Num(Num { node, literal: false, ..otherwise.clone() });
        }
        match self.settled(id, |speciation| Some(Part::Activity(speciation.place_of_any(s)?))) {
            Some(node) => {
                let node = self.graph.unary(UnaryOp::Exp, node);
                Value::Num(Num { node, literal: false, ..otherwise.clone() })
            }
            None => Value::Num(otherwise.clone()),
        }
    }

    /// The equilibrium of a gas.
    pub fn of_gas(&self, s: SpeciesId) -> Option<usize> {
        self.tables.equilibria.iter().position(|e| e.gas.is_some_and(|(gas, _)| gas == s))
    }

    /// The activity that a gas has where it is at rest with what is dissolved: its equation is met. None where nothing of it can be there.
    pub fn activity_of_gas(&mut self, id: InstanceId, e: usize) -> Option<NodeId> {
        let speciation = self.speciation(id)?;
        let mut sum =
            self.constant_at(e, |lab| Some(lab.graph.solved(&speciation.system, Part::Temperature, &speciation.args)))?;
        sum = self.multiple(-1.0, sum);
        let def = &self.tables.equilibria[e];
        let (gas, _) = def.gas?;
        for (s, count) in def.terms.clone().into_iter().filter(|(s, _)| *s != gas) {
            let part = Part::Activity(speciation.place_of_any(s)?);
            let activity = self.graph.solved(&speciation.system, part, &speciation.args);
            let activity = self.multiple(count, activity);
            sum = self.graph.binary(BinaryOp::Add, activity, sum);
        }
        Some(self.graph.unary(UnaryOp::Exp, sum))
    }

    /// The logarithm of a constant at a temperature.
    pub fn constant_at(&mut self, e: usize, temperature: impl FnOnce(&mut Self) -> Option<NodeId>) -> Option<NodeId> {
        let Constant { terms, .. } = self.constant_of(e)?;
        let t = temperature(self)?;
        Some(self.constant_of_terms(&terms, t))
    }

    /// The same by its terms.
    fn constant_of_terms(&mut self, terms: &[NodeId], t: NodeId) -> NodeId {
        let (ln, square) = (self.graph.unary(UnaryOp::Ln, t), self.graph.binary(BinaryOp::Mul, t, t));
        let one = self.graph.number(1.0);
        let over = |lab: &mut Self, node| lab.graph.binary(BinaryOp::Div, one, node);
        let of = [one, over(self, t), ln, t, over(self, square), square];
        self.sum_of(terms, &of)
    }

    /// The enthalpy of an equation at a temperature: R T^2 d(ln K) / dT.
    pub fn enthalpy_at(&mut self, e: usize, t: NodeId) -> Option<NodeId> {
        let Constant { terms, .. } = self.constant_of(e)?;
        let square = self.graph.binary(BinaryOp::Mul, t, t);
        let one = self.graph.number(1.0);
        let inverse = self.graph.binary(BinaryOp::Div, one, t);
        let cube = self.graph.binary(BinaryOp::Mul, square, t);
        let numbers = [(0.0, one), (-GAS, one), (GAS, t), (GAS, square), (-2.0 * GAS, inverse), (2.0 * GAS, cube)];
        let of = numbers.map(|(factor, node)| self.multiple(factor, node));
        Some(self.sum_of(&terms, &of))
    }

    fn sum_of(&mut self, terms: &[NodeId], of: &[NodeId]) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for (term, of) in terms.iter().zip(of) {
            let part = self.graph.binary(BinaryOp::Mul, *term, *of);
            sum = self.graph.binary(BinaryOp::Add, sum, part);
        }
        sum
    }

    /// Whether the equilibrium of a gas has a constant at a temperature.
    pub fn gas_holds(&mut self, e: usize, temperature: NodeId) -> NodeId {
        match self.window_of(e) {
            Some(window) => self.within(window, temperature),
            None => self.graph.number(1.0),
        }
    }

    fn within(&mut self, (low, high): (NodeId, NodeId), temperature: NodeId) -> NodeId {
        let above = self.graph.binary(BinaryOp::Le, low, temperature);
        let below = self.graph.binary(BinaryOp::Le, temperature, high);
        self.graph.binary(BinaryOp::And, above, below)
    }

    /// Whether all equilibria of a mixture, or those that have a species, have constants at a temperature.
    pub fn equilibria_hold(&mut self, id: InstanceId, of: Option<SpeciesId>, temperature: NodeId) -> NodeId {
        let mut holds = self.graph.number(1.0);
        let Some(speciation) = self.speciation(id) else { return holds };
        for e in speciation.equilibria.iter().copied() {
            if of.is_some_and(|s| !self.tables.equilibria[e].involves(s)) {
                continue;
            }
            let Some(window) = self.window_of(e) else { continue };
            let within = self.within(window, temperature);
            holds = self.graph.binary(BinaryOp::And, holds, within);
        }
        holds
    }

    /// The temperatures between which an equilibrium has a constant.
    fn window_of(&mut self, e: usize) -> Option<(NodeId, NodeId)> {
        let def = &self.tables.equilibria[e];
        let (module, fields) = (def.module, def.fields);
        if let Some(valid) = expr_of(fields, "valid") {
            let v = self.expr(valid, &mut Scope::module(module));
            let ty = Type::Range(self.temperature_type().into());
            return match self.coerce(v, &ty, valid.span, "valid") {
                Value::Range(a, b) => Some((a.node, b.node)),
                _ => None,
            };
        }
        if expr_of(fields, "enthalpy").or_else(|| expr_of(fields, ANALYTIC)).is_some() || self.way_of_solid(e).is_some()
        {
            return Some((self.graph.number(LIQUID.0), self.graph.number(LIQUID.1)));
        }
        let (at, reach) = (self.given_at(e)?, self.graph.number(NEAR));
        Some((self.graph.binary(BinaryOp::Sub, at, reach), self.graph.binary(BinaryOp::Add, at, reach)))
    }
}

/// What a species says of the heat of dissolving it.
const HEAT_OF_SOLUTION: &str = "heat_of_solution";

/// A factor below this is what rounding left.
const NO_PART: f64 = 1e-9;

/// Standard potentials are no further from 0, V: that of fluorine is 3.05 V, that of azide -3.3 V.
const MOST_VOLTS: f64 = 5.0;

/// Constants are no further from 1, powers of ten, of one electron each where there are some: strong complexes come to 50.
const MOST_POWERS: f64 = 300.0;

/// Temperatures between which water is liquid, K.
const LIQUID: (f64, f64) = (273.15, 373.15);

/// How far from its temperature a constant without an enthalpy serves, K.
const NEAR: f64 = 10.0;

/// Another temperature at which constants must agree, K.
const WARM: f64 = 333.15;

/// Constants agree to this share of a power of ten: tables round.
const CLOSED: f64 = 0.05;

impl Speciation {
    /// The number of a species among the members that equations move.
    pub fn place(&self, s: SpeciesId) -> Option<u32> {
        self.place_of_any(s).filter(|i| (*i as usize) < self.moved && !self.equilibria.is_empty())
    }

    /// The number of a species among all members.
    fn place_of_any(&self, s: SpeciesId) -> Option<u32> {
        self.members.iter().position(|m| *m == s).map(|i| i as u32)
    }
}

/// The value of a field.
pub fn expr_of<'f>(fields: &'f [Field], key: &str) -> Option<&'f Expr> {
    match &field(fields, key)?.value {
        FieldValue::Expr(e) => Some(e),
        _ => None,
    }
}
