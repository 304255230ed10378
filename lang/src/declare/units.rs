//! Declares the dimensions and units of all modules.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Binary, Expr, ExprKind, Item, ItemKind, Name, Unary, UnitText};
use crate::names::Names;
use crate::near;
use crate::units::text::UnitError;
use crate::units::{Dimension, DimensionDef, Rational, UnitDef, Units, called};

/// Reads every `dimension` item in the order of the modules, then every `unit`.
pub fn declare(names: &Names<'_>, diagnostics: &mut Vec<Diagnostic>) -> Units {
    let mut units = Units::default();
    let mut open = Vec::new();
    for module in names.modules {
        for item in &module.tree.items {
            match &item.kind {
                ItemKind::Dimension { name, point, definition } => {
                    if let Some(first) = units.dimension(&name.text).map(|d| d.span) {
                        diagnostics.push(declared_twice(&format!("dimension `{}`", name.text), name.span, first));
                        continue;
                    }
                    match definition {
                        None => units.add_base(&name.text, name.span),
                        Some(e) => {
                            let dimension = dimension(&units, e, diagnostics);
                            units.add_dimension(&name.text, DimensionDef { dimension, point: *point, span: name.span });
                        }
                    }
                }
                ItemKind::Unit { .. } => open.push(item),
                _ => {}
            }
        }
    }
    in_order(&mut units, &open, diagnostics);
    units
}

/// Declares units after those that they are defined by, else in the order of the text.
fn in_order(units: &mut Units, items: &[&Item], diagnostics: &mut Vec<Diagnostic>) {
    let mut named: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, item) in items.iter().enumerate() {
        let ItemKind::Unit { name, aliases, .. } = &item.kind else { continue };
        for spelling in std::iter::once(name).chain(aliases) {
            named.entry(&spelling.text).or_insert(i);
        }
    }
    let needs: Vec<BTreeSet<usize>> = items.iter().map(|item| needed(item, &named)).collect();
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); items.len()];
    for (i, of) in needs.iter().enumerate() {
        of.iter().for_each(|n| users[*n].push(i));
    }
    let mut waiting: Vec<usize> = needs.iter().map(BTreeSet::len).collect();
    let mut ready: BTreeSet<usize> = (0..items.len()).filter(|i| waiting[*i] == 0).collect();
    while let Some(i) = ready.pop_first() {
        unit(units, items[i], diagnostics);
        for user in &users[i] {
            waiting[*user] -= 1;
            if waiting[*user] == 0 {
                ready.insert(*user);
            }
        }
    }
    rings(units, items, &needs, &waiting, diagnostics);
}

/// Reports each ring among the units that still wait; each of these leads into one.
fn rings(
    units: &mut Units,
    items: &[&Item],
    needs: &[BTreeSet<usize>],
    waiting: &[usize],
    diagnostics: &mut Vec<Diagnostic>,
) {
    // The walk that came by, from 1.
    let mut walked = vec![0; items.len()];
    for start in (0..items.len()).filter(|i| waiting[*i] > 0) {
        let mut at = start;
        while walked[at] == 0 {
            walked[at] = start + 1;
            at = needs[at].iter().copied().find(|n| waiting[*n] > 0).unwrap_or(at);
        }
        let ItemKind::Unit { name, dimension, prefixes, .. } = &items[start].kind else { continue };
        // What a unit of a ring measures is known all the same.
        let dimension = dimension.as_ref().and_then(|n| units.dimension(&n.text)).map(|d| d.dimension.clone());
        let dimension = dimension.unwrap_or_else(Dimension::any);
        let (prefixes, span) = (*prefixes, name.span);
        let def = UnitDef { dimension, factor: 1.0, offset: None, prefixes, called: None, span };
        units.add_unit(&name.text, def);
        if walked[at] == start + 1
            && let ItemKind::Unit { name, .. } = &items[at].kind
        {
            let headline = format!("the unit `{}` is defined by itself", name.text);
            let d = Diagnostic::error(codes::CIRCULAR, name.span, headline, "leads back to its own size");
            diagnostics.push(d.help("give one of the units a size in other ones"));
        }
    }
}

/// The units that the definition of another one names.
fn needed(item: &Item, named: &BTreeMap<&str, usize>) -> BTreeSet<usize> {
    fn texts<'e>(e: &'e Expr, out: &mut Vec<&'e str>) {
        match &*e.kind {
            ExprKind::Quantity(_, u) => out.push(&u.text),
            ExprKind::Binary(_, a, b) => {
                texts(a, out);
                texts(b, out);
            }
            ExprKind::Tuple(items, _) => items.iter().for_each(|i| texts(i, out)),
            _ => {}
        }
    }
    let ItemKind::Unit { definition, origin, .. } = &item.kind else { return BTreeSet::new() };
    let mut used = Vec::new();
    definition.iter().chain(origin).for_each(|e| texts(e, &mut used));
    let words = used.iter().flat_map(|text| text.split(['*', '/', '(', ')', '^', '-']));
    // A word that is no unit by itself may be one with a prefix of one or two letters.
    let find = |word: &str| {
        let shorter = word.char_indices().skip(1).take(2).map(|(at, _)| &word[at..]);
        std::iter::once(word).chain(shorter).find_map(|w| named.get(w).copied())
    };
    words.filter_map(find).collect()
}

fn declared_twice(what: &str, again: Span, first: Span) -> Diagnostic {
    Diagnostic::error(codes::DUPLICATE_NAME, again, format!("the {what} is declared twice"), "declared again here")
        .because(first, "first declared here")
}

fn unknown_dimension(units: &Units, n: &Name) -> Diagnostic {
    let headline = format!("unknown dimension `{}`", n.text);
    let mut d = near::unknown(n, headline, "not declared before this");
    d.help.extend(near::question(&near::nearest(&n.text, units.dimension_names())));
    d
}

fn dimension(units: &Units, e: &Expr, diagnostics: &mut Vec<Diagnostic>) -> Dimension {
    match &*e.kind {
        ExprKind::Number(1.0) => Dimension::one(),
        ExprKind::Name(n) => match units.dimension(&n.text) {
            Some(def) => def.dimension.clone(),
            None => {
                diagnostics.push(unknown_dimension(units, n));
                Dimension::any()
            }
        },
        ExprKind::Binary(Binary::Mul, a, b) => {
            dimension(units, a, diagnostics).times(&dimension(units, b, diagnostics))
        }
        ExprKind::Binary(Binary::Div, a, b) => dimension(units, a, diagnostics).over(&dimension(units, b, diagnostics)),
        ExprKind::Binary(Binary::Pow, a, b) => match exponent(b) {
            Some(e) => dimension(units, a, diagnostics).power(e),
            None => malformed(e, diagnostics),
        },
        ExprKind::Tuple(items, None) if items.len() == 1 => dimension(units, &items[0], diagnostics),
        ExprKind::Error => Dimension::any(),
        _ => malformed(e, diagnostics),
    }
}

fn malformed(e: &Expr, diagnostics: &mut Vec<Diagnostic>) -> Dimension {
    diagnostics.push(
        Diagnostic::error(
            codes::SYNTAX,
            e.span,
            "a dimension must be a product of powers of dimensions",
            "not a dimension",
        )
        .help("write, for example, `dimension Speed = Length / Duration`"),
    );
    Dimension::any()
}

/// A constant exponent: `2`, `-1`, `(1 / 2)`.
pub fn exponent(e: &Expr) -> Option<Rational> {
    match &*e.kind {
        ExprKind::Number(v) => Rational::approximate(*v),
        ExprKind::Unary(crate::ast::Unary::Neg, inner) => {
            let r = exponent(inner)?;
            Some(Rational::new(-r.num, r.den))
        }
        ExprKind::Binary(Binary::Div, a, b) => {
            let (a, b) = (exponent(a)?, exponent(b)?);
            (b.num != 0).then(|| Rational::new(a.num * b.den, a.den * b.num))
        }
        ExprKind::Tuple(items, None) if items.len() == 1 => exponent(&items[0]),
        _ => None,
    }
}

fn unit(units: &mut Units, item: &Item, diagnostics: &mut Vec<Diagnostic>) {
    let ItemKind::Unit { name, dimension, definition, origin, prefixes, aliases } = &item.kind else { return };
    let declared = dimension.as_ref().and_then(|n| {
        let found = units.dimension(&n.text).cloned();
        if found.is_none() {
            diagnostics.push(unknown_dimension(units, n));
        }
        found
    });
    let (value, factor) = match definition {
        Some(e) => match constant(units, e, diagnostics) {
            Some(v) => v,
            None => return,
        },
        None => (declared.as_ref().map_or_else(Dimension::any, |d| d.dimension.clone()), 1.0),
    };
    if let Some(d) = &declared
        && !d.dimension.agrees(&value)
    {
        diagnostics.push(Diagnostic::error(
            codes::UNIT_MISMATCH,
            name.span,
            format!(
                "`{}` is declared as {} but defined as {}",
                name.text,
                units.describe(&d.dimension, d.point),
                units.describe(&value, false)
            ),
            "the definition has another dimension",
        ));
        return;
    }
    if !(factor.is_finite() && factor > 0.0) {
        let headline = format!("the size of the unit `{}` must be a number above zero", name.text);
        diagnostics.push(Diagnostic::error(codes::OUT_OF_RANGE, name.span, headline, "not such a number"));
        return;
    }
    let offset = origin.as_ref().and_then(|e| constant(units, e, diagnostics)).map(|(_, v)| v);
    let offset = offset.or_else(|| declared.as_ref().is_some_and(|d| d.point).then_some(0.0));
    let (prefixes, span) = (*prefixes, name.span);
    let mut def = UnitDef { dimension: value, factor, offset, prefixes, called: called(&item.docs), span };
    for spelling in std::iter::once(name).chain(aliases) {
        if let Some(first) = units.declared(&spelling.text).map(|u| u.span) {
            diagnostics.push(declared_twice(&format!("unit `{}`", spelling.text), spelling.span, first));
            continue;
        }
        units.add_unit(&spelling.text, def.clone());
        // Other spellings are not proposed for the name.
        def.called = None;
    }
}

/// A constant quantity: dimension and SI value.
fn constant(units: &Units, e: &Expr, diagnostics: &mut Vec<Diagnostic>) -> Option<(Dimension, f64)> {
    match &*e.kind {
        ExprKind::Number(v) => Some((Dimension::one(), *v)),
        ExprKind::Quantity(v, u) => match units.resolve(&u.text) {
            Ok(r) => Some((r.dimension, r.unit.to_si(*v))),
            Err(error) => {
                diagnostics.push(unit_error(u, error));
                None
            }
        },
        ExprKind::Binary(op @ (Binary::Mul | Binary::Div), a, b) => {
            let (a, b) = (constant(units, a, diagnostics)?, constant(units, b, diagnostics)?);
            Some(if *op == Binary::Mul { (a.0.times(&b.0), a.1 * b.1) } else { (a.0.over(&b.0), a.1 / b.1) })
        }
        ExprKind::Binary(Binary::Pow, a, b) if exponent(b).is_some() => {
            let (a, power) = (constant(units, a, diagnostics)?, exponent(b)?);
            Some((a.0.power(power), matterix_ir::math::pow(a.1, power.num as f64 / power.den as f64)))
        }
        ExprKind::Unary(Unary::Neg, a) => constant(units, a, diagnostics).map(|(d, v)| (d, -v)),
        ExprKind::Tuple(items, None) if items.len() == 1 => constant(units, &items[0], diagnostics),
        ExprKind::Error => None,
        _ => {
            diagnostics.push(
                Diagnostic::error(
                    codes::SYNTAX,
                    e.span,
                    "a unit must be defined by a constant quantity",
                    "not a constant",
                )
                .help("write, for example, `unit bar: Pressure = 1e5 Pa with prefixes`"),
            );
            None
        }
    }
}

/// The diagnostic for a unit that could not be resolved.
pub fn unit_error(unit: &UnitText, error: UnitError) -> Diagnostic {
    match error {
        UnitError::Unknown { name, near } => {
            let mut d = Diagnostic::error(
                codes::UNKNOWN_UNIT,
                unit.span,
                format!("unknown unit `{name}`"),
                "not a declared unit",
            );
            d.help.extend(near::question(&near));
            if let Some(best) = near.first() {
                let mended = unit.text.replacen(&name, best, 1);
                d = d.guess(format!("replace with `{mended}`"), unit.span, mended);
            }
            if name == "%" {
                d.help = vec!["write `%w/w` (by mass) or `%v/v` (by volume)".into()];
                d.fixes.clear();
            }
            d
        }
        UnitError::PointInDerived { name, mended } => {
            let mut d = Diagnostic::error(
                codes::TEMPERATURE_POINT,
                unit.span,
                format!("`{name}` is a point on a scale and cannot be part of the unit `{}`", unit.text),
                "a derived unit needs a difference",
            );
            if let Some(mended) = mended {
                d = d.help(format!("write `{mended}`")).fix(format!("replace with `{mended}`"), unit.span, mended);
            }
            d
        }
        UnitError::Malformed => Diagnostic::error(
            codes::UNKNOWN_UNIT,
            unit.span,
            format!("`{}` is not a unit", unit.text),
            "cannot be read as a product of units",
        )
        .help("write a unit as one word without blanks: `kg/(mol*s)`, `W/(m^2*K)`, `1/s`"),
    }
}
