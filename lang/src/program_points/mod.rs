//! What is known at every statement of a workflow, put in the words of the lab: which values are asked for, and how
//! what is known of them reads.

mod units;

use std::sync::Arc;

use matterix_ir::model::{Domain, Observable};
use matterix_ir::plan::{Plan, Step};
use matterix_ir::points::{After, Fact, POINTS_VERSION, Point, Points, Reagent, Settled, Thing, Value};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op, Sources, Span, Unit};

use crate::ast::{MemberKind, Role};
use crate::check::{AbstractValue, Seen};
use crate::eval::lab::given::HIDDEN;
use crate::eval::lab::{Elaborator, MemberKey, Mode};
use crate::eval::{Num, Value as State};

use units::Written;

/// A share of the largest magnitude below which what is left is due to rounding.
const ROUNDING: f64 = 1e-9;

/// A value that is asked for.
struct Asked {
    name: String,
    domain: Domain,
    node: NodeId,
    /// Where its model holds; absent where it always does.
    valid: Option<NodeId>,
}

/// What is asked of an instance.
struct About {
    instance: InstanceId,
    facts: Vec<Asked>,
    species: Vec<Asked>,
    /// Amounts at equilibrium, with whether each is of a solid.
    settled: Vec<(Asked, bool)>,
    reagents: Vec<(String, NodeId)>,
}

/// Everything that is asked for at each statement.
pub struct Questions {
    things: Vec<About>,
    /// The values, in the order of the things.
    pub nodes: Vec<NodeId>,
}

impl Questions {
    /// The states of every instance that its declaration does not hide, what follows from them (`observables`, each with
    /// its instance and where its model holds), amounts of species, and reagents.
    pub fn of<'o>(
        lab: &mut Elaborator<'_>,
        observables: impl Iterator<Item = (InstanceId, &'o Observable, Option<NodeId>)>,
    ) -> Questions {
        let mut things: Vec<About> = (0..lab.instances.len() as u32)
            .map(|i| About {
                instance: InstanceId(i),
                facts: Vec::new(),
                species: Vec::new(),
                settled: Vec::new(),
                reagents: Vec::new(),
            })
            .collect();
        for (instance, o, valid) in observables {
            // A colour is three numbers of which none is read by itself.
            if let [node] = o.value.as_slice() {
                let name = o.name.rsplit('.').next().unwrap_or(&o.name).to_string();
                let domain = Domain::Quantity(o.unit.clone());
                things[instance.0 as usize].facts.push(Asked { name, domain, node: *node, valid });
            }
        }
        for thing in &mut things {
            let states = visible_states(lab, thing.instance);
            let derived = std::mem::take(&mut thing.facts);
            thing.facts = states.into_iter().map(|(name, s)| ask(lab, name, s)).chain(derived).collect();
        }
        for (key, state) in lab.extensive.clone() {
            let Some(species) = key.species else { continue };
            let def = lab.tables.species.get(species);
            let (name, by_mass) = (def.name.clone(), def.by_mass);
            if !key.matter {
                if !is_hidden(lab, key.instance, &key.member) {
                    let asked = ask(lab, format!("{}[{name}]", key.member), state);
                    things[key.instance.0 as usize].facts.push(asked);
                }
                continue;
            }
            let mut asked = ask(lab, name, state);
            if by_mass {
                // Its amount is its mass in kg.
                asked.domain = Domain::Quantity(
                    lab.tables.unit("g").map_or(Unit::scaled("kg", 1.0), |u| Arc::unwrap_or_clone(u.unit)),
                );
            }
            if let Some(node) = lab.settled_amount(key.instance, species) {
                let solid = lab.is_solid(species);
                let amount = Asked { name: asked.name.clone(), domain: asked.domain.clone(), node, valid: None };
                things[key.instance.0 as usize].settled.push((amount, solid));
            }
            things[key.instance.0 as usize].species.push(asked);
        }
        for (mixture, reagents) in lab.lineage.clone() {
            let asked = reagents.into_iter().map(|(reagent, state)| (reagent, lab.graph.add(Op::State(state))));
            things[mixture.0 as usize].reagents.extend(asked);
        }
        things.retain(|t| !(t.facts.is_empty() && t.species.is_empty() && t.reagents.is_empty()));
        let nodes = things.iter().flat_map(About::nodes).collect();
        Questions { things, nodes }
    }

    /// The answers as points of the plan.
    pub fn answered(&self, lab: &Elaborator<'_>, sources: &Sources, plan: &Plan, seen: Vec<Seen>) -> Option<Points> {
        let words = Words { lab, written: Written::of(lab, sources, plan) };
        let mut seen = seen.into_iter();
        let start = seen.next()?.after?;
        let mut points: Vec<Point> = seen
            .map(|s| {
                let after = s.after.map(|after| {
                    Arc::new(After {
                        elapsed: quantity(&after.time, Unit::scaled("s", 1.0)),
                        kept: words.kept(plan, sources, &s.label, &after.locals),
                        things: self.things(&words, &after.values),
                    })
                });
                Point {
                    span: s.span,
                    label: head(sources, s.span, s.block),
                    reached: s.times > 0,
                    repeated: s.times > 1,
                    block: s.block,
                    after,
                }
            })
            .collect();
        points.extend(unreached(plan, sources, &points));
        points.sort_by_key(|p| (p.span.file, p.span.start, std::cmp::Reverse(p.span.end)));
        Some(Points {
            version: POINTS_VERSION,
            workflow: plan.workflow.clone(),
            lab: sources.slice(lab.lab_name).to_string(),
            start: Arc::new(self.things(&words, &start.values)),
            points,
        })
    }

    fn things(&self, words: &Words<'_, '_>, values: &[(AbstractValue, bool)]) -> Vec<Thing> {
        let mut values = values.iter();
        let mut out = Vec::new();
        for about in &self.things {
            let mut facts = |asked: &mut dyn Iterator<Item = &Asked>| -> Vec<Fact> {
                let fact = |a: &Asked| {
                    let (known, changed) = values.next()?;
                    let holds = match a.valid {
                        Some(_) => values.next()?.0.truth(),
                        None => Some(true),
                    };
                    let value = words.value(known, &a.domain);
                    Some(Fact { name: a.name.clone(), value, changed: *changed, outside: holds != Some(true) })
                };
                asked.map_while(fact).collect()
            };
            let (facts, species, settled) = (
                facts(&mut about.facts.iter()),
                facts(&mut about.species.iter()),
                facts(&mut about.settled.iter().map(|s| &s.0)),
            );
            let solids = about.settled.iter().map(|(_, solid)| *solid);
            let settled = settled.into_iter().zip(solids).map(|(amount, solid)| Settled { amount, solid }).collect();
            let touched = about.reagents.iter().zip(values.by_ref());
            let reagents = touched
                .filter(|(_, (known, changed))| *changed || known.truth() != Some(false))
                .map(|((name, _), (known, changed))| Reagent {
                    name: name.clone(),
                    certain: known.truth() == Some(true),
                    changed: *changed,
                })
                .collect();
            let name = words.lab.instances[about.instance.0 as usize].name.clone();
            out.push(Thing { instance: about.instance, name, facts, species, settled, reagents });
        }
        out
    }
}

impl About {
    fn nodes(&self) -> impl Iterator<Item = NodeId> {
        let facts = self.facts.iter().chain(&self.species).chain(self.settled.iter().map(|s| &s.0));
        facts.flat_map(|a| std::iter::once(a.node).chain(a.valid)).chain(self.reagents.iter().map(|r| r.1))
    }
}

/// Statements of the user's that no way leads to.
fn unreached(plan: &Plan, sources: &Sources, known: &[Point]) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    for (i, step) in plan.steps.iter().enumerate() {
        let text = sources.slice(step.span);
        let library = sources.get(step.span.file).is_none_or(|f| f.name.contains("::"));
        let skip = library || text.is_empty() || text.starts_with('{') || i == plan.root.0 as usize;
        if skip || known.iter().chain(&out).any(|p| p.span == step.span) {
            continue;
        }
        let span = step.span;
        let inside = |o: Span| o != span && o.file == span.file && span.start <= o.start && o.end <= span.end;
        let block = plan.steps.iter().any(|s| inside(s.span) && !sources.slice(s.span).starts_with('{'));
        let label = head(sources, span, block);
        out.push(Point { span, label, reached: false, repeated: false, block, after: None });
    }
    out
}

/// The text of a statement on one line, without its block.
fn head(sources: &Sources, span: Span, block: bool) -> String {
    let text = sources.slice(span);
    let text = if block { text.split('{').next().unwrap_or(text) } else { text };
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether the declaration of a member hides it.
fn is_hidden(lab: &Elaborator<'_>, id: InstanceId, member: &str) -> bool {
    lab.members_of(id, member).first().is_some_and(|m| match &m.member.kind {
        MemberKind::Value { options, .. } => options.iter().any(|o| o.name.text == HIDDEN),
        _ => false,
    })
}

/// The states of an instance that are not hidden, by name of the member.
fn visible_states(lab: &Elaborator<'_>, id: InstanceId) -> Vec<(String, u32)> {
    let mut out = Vec::new();
    for m in lab.all_members(id).iter().copied() {
        let MemberKind::Value { role: Role::State | Role::Extensive, name, options, .. } = &m.member.kind else {
            continue;
        };
        if options.iter().any(|o| o.name.text == HIDDEN) {
            continue;
        }
        let current = lab.instances[id.0 as usize].values.get(&MemberKey::of(m, Mode::default()));
        let Some(State::Num(Num { node, .. }) | State::Bool(node) | State::InstanceNode(node) | State::Enum(node, _)) =
            current
        else {
            continue;
        };
        if let Op::State(state) = lab.graph.op(*node) {
            out.push((name.text.clone(), state));
        }
    }
    out
}

fn ask(lab: &mut Elaborator<'_>, name: String, state: u32) -> Asked {
    let domain = lab.states[state as usize].domain.clone();
    Asked { name, domain, node: lab.graph.add(Op::State(state)), valid: None }
}

/// The name that a statement binds to the result of a step.
fn bound(label: &str) -> Option<&str> {
    let (name, _) = label.strip_prefix("let ")?.split_once("<-")?;
    Some(name.trim())
}

/// What is known, in units and words of the lab.
struct Words<'l, 'a> {
    lab: &'l Elaborator<'a>,
    written: Written,
}

impl Words<'_, '_> {
    /// Of the kept values that a statement sets those that the user has named.
    fn kept(&self, plan: &Plan, sources: &Sources, label: &str, locals: &[(u32, AbstractValue)]) -> Vec<Fact> {
        let own = |span: Span| sources.get(span.file).is_some_and(|f| !f.name.contains("::"));
        let sets = |i: u32| {
            plan.steps.iter().filter(|s| own(s.span)).any(|s| match &s.step {
                Step::Let { local, .. } => *local == i,
                Step::Named { start, end, .. } => *start == i || *end == i,
                _ => false,
            })
        };
        let mut out = Vec::new();
        for (i, known) in locals {
            let local = &plan.locals[*i as usize];
            // The result of a step is kept under the whole of its statement, `let first <- pour ...`.
            let result = if local.name == label { bound(label) } else { None };
            // What a skill gives is its caller's to name.
            let named = !local.name.contains(' ') && sets(*i);
            if let Some(name) = result.or_else(|| named.then_some(local.name.as_str())) {
                out.push(Fact {
                    name: name.to_string(),
                    value: quantity(known, local.unit.clone()),
                    changed: true,
                    outside: false,
                });
            }
        }
        out
    }

    fn value(&self, known: &AbstractValue, domain: &Domain) -> Value {
        let word = |v: f64| match domain {
            Domain::Bool => Some(if v == 0.0 { "false" } else { "true" }.to_string()),
            Domain::Enum(words) => words.get(v as usize).cloned(),
            _ if v < 0.0 => Some("nothing".to_string()),
            _ => self.lab.instances.get(v as usize).map(|i| i.name.clone()),
        };
        match (domain, known) {
            (Domain::Quantity(unit), _) => self.quantity(known, unit),
            (_, AbstractValue::Range(..)) => Value::Unknown,
            (_, AbstractValue::Point(v)) => word(*v).map_or(Value::Unknown, |w| Value::Words(vec![w])),
            (_, AbstractValue::Few(all, _)) => {
                let words: Option<Vec<String>> = all.iter().map(|v| word(*v)).collect();
                words.map_or(Value::Unknown, Value::Words)
            }
        }
    }

    fn quantity(&self, known: &AbstractValue, unit: &Unit) -> Value {
        quantity(known, self.written.best(self.lab, unit, largest(known)))
    }
}

/// The largest magnitude among the bounds of a number that are known.
fn largest(known: &AbstractValue) -> f64 {
    let (low, high) = known.bounds();
    [low, high].into_iter().filter(|v| v.is_finite()).map(f64::abs).fold(0.0, f64::max)
}

fn quantity(known: &AbstractValue, unit: Unit) -> Value {
    let (low, high) = known.bounds();
    let largest = largest(known);
    let tidy = |v: f64| if v.abs() < ROUNDING * largest { 0.0 } else { v };
    match known {
        AbstractValue::Point(v) if v.is_finite() => Value::Exact(*v, unit),
        AbstractValue::Few(all, _) if all.iter().all(|v| v.is_finite()) => {
            let mut all: Vec<f64> = all.iter().map(|v| tidy(*v)).collect();
            // What only rounding tells apart is the same.
            all.dedup_by(|a, b| (*a - *b).abs() <= ROUNDING * largest);
            if let [one] = all.as_slice() { Value::Exact(*one, unit) } else { Value::OneOf(all, unit) }
        }
        _ => match [low, high].map(|v| v.is_finite().then(|| tidy(v))) {
            [None, None] => Value::Unknown,
            [low, high] => Value::Between(low, high, unit),
        },
    }
}
