//! What a vessel holds at the start: `10 g of water + 12 mmol of EtOH`, `100 g of S0`.

use matterix_ir::{BinaryOp, Diagnostic, NodeId, Span, codes};

use crate::ast::{Binary, Expr, ExprKind, Name};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::lab::free::Bound;
use crate::eval::lab::held::Held;
use crate::eval::lab::substances::Substance;
use crate::eval::{Num, Scope, Value};

/// What contents are called as a reagent: the substance, or the whole recipe where there are several.
pub fn origin(e: &Expr) -> String {
    fn terms<'e>(e: &'e Expr, out: &mut Vec<(&'e Expr, &'e Name)>) {
        match &*e.kind {
            ExprKind::Binary(Binary::Add, a, b) => {
                terms(a, out);
                terms(b, out);
            }
            ExprKind::Tuple(items, None) if items.len() == 1 => terms(&items[0], out),
            ExprKind::Of(quantity, name) => out.push((quantity, name)),
            _ => {}
        }
    }
    let mut all = Vec::new();
    terms(e, &mut all);
    if let [(_, one)] = all.as_slice() {
        return one.text.clone();
    }
    let shown = all.iter().map(|(quantity, name)| match &*quantity.kind {
        ExprKind::Quantity(v, unit) => format!("{v} {} of {}", unit.text, name.text),
        _ => name.text.clone(),
    });
    shown.collect::<Vec<_>>().join(" + ")
}

impl<'a> Elaborator<'a> {
    /// Amounts of a `holding` expression: mol (kg where counted by mass). `owner` names the parameters.
    pub fn contents(&mut self, e: &'a Expr, owner: &str, module: usize) -> Vec<(SpeciesId, NodeId)> {
        let mut out = Vec::new();
        self.add_contents(e, owner, module, &mut out);
        out
    }

    fn add_contents(&mut self, e: &'a Expr, owner: &str, module: usize, out: &mut Vec<(SpeciesId, NodeId)>) {
        match &*e.kind {
            ExprKind::Binary(Binary::Add, a, b) => {
                self.add_contents(a, owner, module, out);
                self.add_contents(b, owner, module, out);
            }
            ExprKind::Tuple(items, None) if items.len() == 1 => self.add_contents(&items[0], owner, module, out),
            ExprKind::Of(quantity, name) => {
                let mut scope = Scope { lab: true, ..Scope::module(module) };
                let value = self.expr(quantity, &mut scope);
                let Some(substance) = self.substance(name, module) else { return };
                let Value::Num(n) = value else {
                    self.expected("a mass, a volume or an amount", &value, quantity.span);
                    return;
                };
                if self.graph.constant(n.node).is_some_and(|v| v < 0.0) {
                    self.report(Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        quantity.span,
                        "a vessel cannot hold a negative amount",
                        "negative",
                    ));
                    return;
                }
                let n = self.name_param(&format!("{owner}.initial[{}]", name.text), n, quantity.span);
                self.open.bound(self.graph.op(n.node), Bound::AtLeast, 0.0);
                let amounts = self.amounts_of(&substance, n.clone(), quantity.span, name);
                self.held.push(Held {
                    mixture: None,
                    substance: name.text.clone(),
                    solution: match substance {
                        Substance::Solution(id) => Some(id),
                        Substance::Species(_) => None,
                    },
                    quantity: n,
                    amounts: amounts.clone(),
                    span: e.span,
                });
                for (s, node) in amounts {
                    self.held_at.entry((owner.to_string(), s)).or_insert(e.span);
                    match out.iter().position(|(o, _)| *o == s) {
                        Some(i) => out[i].1 = self.plus(out[i].1, node),
                        None => out.push((s, node)),
                    }
                }
            }
            ExprKind::Error => {}
            _ => self.report(
                Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    e.span,
                    "write the substance too: `10 g of water`",
                    "not an amount of a substance",
                )
                .help("write contents as a sum of quantities with `of`: `10 g of water + 12 mmol of EtOH`"),
            ),
        }
    }

    /// A quantity of a substance as amounts of species.
    pub fn amounts_of(&mut self, what: &Substance, n: Num, span: Span, name: &Name) -> Vec<(SpeciesId, NodeId)> {
        let units = &self.tables.units;
        let (mass, amount, volume) = (units.named("Mass"), units.named("Amount"), units.named("Volume"));
        let parts: Vec<(SpeciesId, f64)> = match what {
            Substance::Species(s) => vec![(*s, 1.0 / self.tables.species.get(*s).molar_mass)],
            Substance::Solution(id) => self.composition(*id),
        };
        if parts.is_empty() {
            return Vec::new();
        }
        if n.dimension == mass {
            return parts.into_iter().map(|(s, per_kg)| (s, self.scaled(n.node, per_kg))).collect();
        }
        if n.dimension == volume {
            let Some(per_kg) = self.volume_of(&parts, name.span) else { return Vec::new() };
            return parts.into_iter().map(|(s, amount)| (s, self.scaled(n.node, amount / per_kg))).collect();
        }
        if let Substance::Species(s) = what
            && n.dimension == amount
        {
            if self.tables.species.get(*s).by_mass {
                self.report(
                    Diagnostic::error(
                        codes::CONCENTRATION_KIND,
                        span,
                        format!("`{}` is declared `by: mass` and has no amount of substance", name.text),
                        "cannot be given in mol",
                    )
                    .help("give a mass: `1 g of ...`"),
                );
                return Vec::new();
            }
            return vec![(*s, n.node)];
        }
        let found = self.describe(&n);
        let solution = matches!(what, Substance::Solution(_));
        let wanted = if solution { "a mass or a volume" } else { "a mass, a volume or an amount" };
        let mut d = Diagnostic::error(
            codes::UNIT_MISMATCH,
            span,
            format!("contents need {wanted}, found {found}"),
            format!("this is {found}"),
        );
        if solution && n.dimension == amount {
            d = d.help("a solution has no single molar mass: give its mass, such as `100 g`");
        }
        self.report(d);
        Vec::new()
    }

    fn scaled(&mut self, node: NodeId, by: f64) -> NodeId {
        let factor = self.graph.number(by);
        self.graph.binary(BinaryOp::Mul, node, factor)
    }

    /// Volume, m^3, of amounts of species together; salts as the ions they become where there is water.
    pub fn volume_of(&mut self, parts: &[(SpeciesId, f64)], at: Span) -> Option<f64> {
        let species = &self.tables.species;
        let wet = parts.iter().any(|(s, _)| species.get(*s).is_water);
        self.volume_with(parts, wet, at)
    }

    /// The same where it is known from elsewhere whether there is water.
    pub fn volume_with(&mut self, parts: &[(SpeciesId, f64)], wet: bool, at: Span) -> Option<f64> {
        let species = &self.tables.species;
        let mut there: Vec<(SpeciesId, f64)> = Vec::new();
        for (s, amount) in parts {
            match species.get(*s).dissolves.as_slice() {
                ions @ [_, ..] if wet => there.extend(ions.iter().map(|(ion, count)| (*ion, count * amount))),
                _ => there.push((*s, *amount)),
            }
        }
        let mut amounts: Vec<(SpeciesId, f64)> = Vec::new();
        for (s, amount) in there {
            // Said here, and not at the law, where it is missing.
            self.molar_volume(s, at)?;
            match amounts.iter_mut().find(|(known, _)| *known == s) {
                Some((_, sum)) => *sum += amount,
                None => amounts.push((s, amount)),
            }
        }
        let amounts = amounts.into_iter().map(|(s, amount)| (s, self.graph.number(amount))).collect();
        self.with_composition(amounts, |lab, id| {
            let volume = lab.size_in(id, &lab.tables.units.named("Volume"))?;
            match lab.member_value(id, volume, at) {
                Value::Num(n) => lab.graph.constant(n.node),
                _ => None,
            }
        })
    }

    /// Molar volume, m^3/mol, of a species that is measured out by volume.
    fn molar_volume(&mut self, s: SpeciesId, at: Span) -> Option<f64> {
        let probe = Name { text: "molar_volume".into(), span: at };
        match self.member(Value::Species(s), &probe) {
            Value::Num(n) => self.graph.constant(n.node),
            _ => None,
        }
    }
}
