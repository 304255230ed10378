//! Labs with parameters, and labs inside labs: `include bench as left at (0, 0, 0) m { offset: 5 mm }`.
//!
//! What an included lab holds is named after it (`left.table`); its own text goes on naming it without that.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Expr, Holding, ItemKind, LabLine, LabLineKind, Name, NamedExpr, Param, Path};
use crate::declare::Type;
use crate::eval::Elaborator;
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::near;

/// More labs than any holds; each of two that holds two others grows fast.
const MOST_LABS: usize = 500;

/// The deepest lab in a lab.
const DEEPEST: usize = 16;

/// A lab being built: the one a workflow is done in, or one included in it.
pub struct Bench<'a> {
    /// What its names begin with: empty, or `left.`.
    pub within: String,
    /// Module of its text.
    pub module: usize,
    /// Its lines.
    pub lines: &'a [LabLine],
    /// Its own instances, with their places and contents.
    #[allow(clippy::type_complexity)]
    pub made: Vec<(InstanceId, &'a [(Name, Expr)], Option<&'a Holding>)>,
}

/// Where an included lab stands.
struct Place<'a> {
    within: String,
    relations: &'a [(Name, Expr)],
    outer: String,
    module: usize,
}

/// How a lab is opened.
struct Opening<'a> {
    id: DeclId,
    within: String,
    /// Values of parameters, and where their names are looked up.
    given: &'a [NamedExpr],
    outer: String,
    module: usize,
    /// Where it is asked for.
    span: Span,
    /// Settings that the labs around it give.
    covered: BTreeSet<String>,
}

/// What was opened so far.
#[derive(Default)]
struct Building<'a> {
    benches: Vec<Bench<'a>>,
    places: Vec<Place<'a>>,
    open: Vec<DeclId>,
}

impl<'a> Elaborator<'a> {
    /// Opens a lab with everything it includes: settings and instances, the included labs first. What each holds and
    /// where it stands is not looked at yet.
    pub fn open_labs(&mut self, id: DeclId) -> Vec<Bench<'a>> {
        let mut building = Building::default();
        let module = self.tables.names.decl(id).module;
        let opening = Opening {
            id,
            within: String::new(),
            given: &[],
            outer: String::new(),
            module,
            span: self.lab_name,
            covered: BTreeSet::new(),
        };
        self.open_lab(opening, &mut building);
        self.places = building.places.into_iter().map(|p| (p.within, p.relations, p.outer, p.module)).collect();
        building.benches
    }

    fn open_lab(&mut self, opening: Opening<'a>, building: &mut Building<'a>) {
        let decl = self.tables.names.decl(opening.id);
        let ItemKind::Lab { params, lines, .. } = &decl.item.kind else { return };
        building.open.push(opening.id);
        self.lab_parameters(params, &opening, decl.module);
        let Opening { within, mut covered, .. } = opening;
        let mut own = BTreeSet::new();
        for line in lines {
            let LabLineKind::Setting { name, value } = &line.kind else { continue };
            if !own.insert(name.text.clone()) {
                let headline = format!("`{}` is given twice", name.text);
                self.report(Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "given again here"));
            } else if !covered.contains(&name.text) {
                self.within_lab(&within, |this| this.lab_setting(name, value, decl.module));
            }
        }
        covered.extend(own);
        let mut made = Vec::new();
        for line in lines {
            match &line.kind {
                LabLineKind::Instance { name, literal, relations, holding } => {
                    let id = self.within_lab(&within, |this| this.lab_instance(name, literal, decl.module));
                    match id {
                        Some(id) => made.push((id, relations.as_slice(), holding.as_ref())),
                        // What is wrong with it is said; its uses are fine.
                        None => {
                            self.settings.entry(name.text.clone()).or_insert(Value::Error);
                        }
                    }
                }
                LabLineKind::Include { lab, name, relations, options } => {
                    let Some(id) = self.lab_to_include(lab, decl.module, &building.open) else {
                        self.settings.entry(name.text.clone()).or_insert(Value::Error);
                        continue;
                    };
                    if self.included.len() >= MOST_LABS || building.open.len() >= DEEPEST {
                        let headline = format!("a lab may include at most {MOST_LABS} labs, nested {DEEPEST} deep");
                        let span = self.lab_name;
                        self.report(Diagnostic::error(
                            codes::OUT_OF_RANGE,
                            span,
                            headline,
                            "this lab includes too many",
                        ));
                        continue;
                    }
                    let full = format!("{within}{}", name.text);
                    if self.lab_name_of(&full).is_some() {
                        let headline = format!("`{}` is declared twice", name.text);
                        let label = "declared again here";
                        self.report(Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, label));
                        continue;
                    }
                    self.included.insert(full.clone());
                    let inner = format!("{full}.");
                    let opening = Opening {
                        id,
                        within: inner.clone(),
                        given: options,
                        outer: within.clone(),
                        module: decl.module,
                        span: line.span,
                        covered: covered.clone(),
                    };
                    self.open_lab(opening, building);
                    building.places.push(Place {
                        within: inner,
                        relations,
                        outer: within.clone(),
                        module: decl.module,
                    });
                }
                _ => {}
            }
        }
        building.open.pop();
        building.benches.push(Bench { within, module: decl.module, lines, made });
    }

    fn lab_to_include(&mut self, path: &Path, module: usize, open: &[DeclId]) -> Option<DeclId> {
        let is_lab = |k: &ItemKind| matches!(k, ItemKind::Lab { .. });
        match self.tables.names.find(module, path, "lab", is_lab) {
            Ok(id) if open.contains(&id) => {
                let name = path.segments.last().map_or("", |n| n.text.as_str());
                let headline = format!("`{name}` includes itself");
                self.report(Diagnostic::error(codes::CIRCULAR, path.span, headline, "leads back to the same lab"));
                None
            }
            Ok(id) => Some(id),
            Err(d) => {
                self.report(*d);
                None
            }
        }
    }

    /// Binds the parameters of a lab: given where it is included, or their defaults.
    fn lab_parameters(&mut self, params: &'a [Param], opening: &Opening<'a>, module: usize) {
        for o in opening.given {
            if !params.iter().any(|p| p.name.text == o.name.text) {
                let near = near::nearest(&o.name.text, params.iter().map(|p| &p.name.text));
                let headline = format!("the included lab has no parameter `{}`", o.name.text);
                let mut d = Diagnostic::error(codes::UNKNOWN_PARAMETER, o.name.span, headline, "not a parameter");
                d.help.extend(near::question(&near));
                self.report(d);
            }
        }
        for p in params {
            let ty = p.ty.as_ref().map_or(Type::Any, |ty| self.resolve_type(ty, module));
            let given = opening.given.iter().find(|o| o.name.text == p.name.text);
            let value = match (given, &p.default) {
                (Some(o), _) => self.within_lab(&opening.outer, |this| {
                    let mut scope = Scope { lab: true, ..Scope::module(opening.module) };
                    this.typed(&o.value, &ty, &mut scope, &p.name.text)
                }),
                (None, Some(e)) => self.within_lab(&opening.within, |this| {
                    this.typed(e, &ty, &mut Scope { lab: true, ..Scope::module(module) }, &p.name.text)
                }),
                (None, None) if self.open_parameters => self.placeholder(&ty, &p.name.text),
                (None, None) => {
                    let headline = format!("`{}` has no value", p.name.text);
                    let mut d = Diagnostic::error(codes::MISSING_FIELD, opening.span, headline, "this lab needs it");
                    d = d.because(p.name.span, "declared without a default here");
                    let give = if opening.within.is_empty() {
                        format!("add a default, `{} = ...`, or `include` the lab in another one", p.name.text)
                    } else {
                        format!("give it at the end of the line: `{{ {}: ... }}`", p.name.text)
                    };
                    self.report(d.help(give));
                    Value::Error
                }
            };
            let span = given.map_or(p.name.span, |o| o.value.span);
            let value = match value {
                Value::Num(n) => Value::Num(self.name_param(&format!("{}{}", opening.within, p.name.text), n, span)),
                other => other,
            };
            self.lab_values.insert((opening.within.clone(), p.name.text.clone()), value);
        }
    }

    /// A setting that another lab has given too must be the same.
    pub fn same_setting(&mut self, name: &Name, first: &Value, second: &Value) {
        let known = |this: &Self, v: &Value| match v {
            Value::Num(n) => this.glance(n.node),
            _ => None,
        };
        let (a, b) = (known(self, first), known(self, second));
        if first == second || (a.is_some() && a == b) || [first, second].contains(&&Value::Error) {
            return;
        }
        let show = |this: &Self, v: &Value, si: Option<f64>| match (v, si) {
            (Value::Num(n), Some(si)) => this.unit_of(n).show(si),
            _ => "another value".to_string(),
        };
        let (a, b) = (show(self, first, a), show(self, second, b));
        let headline = format!("`{}` is {a} in one included lab and {b} in another", name.text);
        let d = Diagnostic::error(codes::AMBIGUOUS_NAME, name.span, headline, "which value?");
        let lab = self.lab_name;
        let d = d.because(lab, "both labs are included here");
        self.report(d.help(format!("set it in the lab that includes them: `{}: ...`", name.text)));
    }

    /// Moves what an included lab holds to where the lab stands: all that stands on nothing in it.
    pub fn place_labs(&mut self) {
        for (within, relations, outer, module) in std::mem::take(&mut self.places) {
            let own = |i: &crate::eval::lab::Instance<'a>| {
                i.owner.is_none() && i.name.starts_with(&within) && i.placed.is_empty()
            };
            let free: Vec<usize> = (0..self.instances.len()).filter(|i| own(&self.instances[*i])).collect();
            // Where a lab stands that has no place of its own, is open to the one that includes it.
            let stands = relations.iter().any(|(label, _)| label.text != "with");
            free.iter().filter(|_| !stands).for_each(|i| self.instances[*i].at = None);
            for (label, operand) in relations {
                let value = self
                    .within_lab(&outer, |this| this.expr(operand, &mut Scope { lab: true, ..Scope::module(module) }));
                match (label.text.as_str(), value) {
                    (_, Value::Error) => {}
                    ("at", Value::Tuple(items)) => {
                        let Some(by) = self.position(&items, operand) else { continue };
                        for i in &free {
                            let position = &mut self.instances[*i].pose.position;
                            position.iter_mut().zip(by).for_each(|(p, by)| *p += by);
                        }
                    }
                    ("at", other) => {
                        self.expected("a position `(x, y, z) m`", &other, operand.span);
                    }
                    (word, Value::Instance(on)) => {
                        for i in &free {
                            self.instances[*i].placed.push((word.to_string(), on));
                        }
                    }
                    (_, other) => {
                        self.expected("an instance of the lab", &other, operand.span);
                    }
                }
            }
        }
    }
}
