//! What a file sets out and then never needs: things of a lab that no workflow has to do with, and reagents that stand
//! in no recipe, no vessel and no step.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use matterix_ir::model::Action;
use matterix_ir::plan::{Argument, Plan, Step};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Op, Sources, Span, codes};

use crate::ast::{AssetLine, Item, ItemKind, LabLineKind, MemberKind, Role};
use crate::declare::Tables;
use crate::declare::tables::MemberRef;
use crate::eval::lab::Elaborator;
use crate::names::{DeclId, Names, item_name};
use crate::syntax::relocate::Relocate;

/// What one workflow has to do with the things of its lab.
#[derive(Clone, Debug)]
pub struct Uses {
    /// The things by the place of their names, each with whether the workflow has to do with it.
    things: BTreeMap<Span, bool>,
    /// Reagents that vessels are filled with, by the place of the thing and name, each with where and whether anything is done with
    /// one of these vessels.
    reagents: BTreeMap<(Span, String), (String, bool)>,
    /// Names of the things, and whether the lab's file says them outside of its labs.
    said: BTreeMap<String, bool>,
    /// The module of the lab.
    module: usize,
}

impl Uses {
    /// Whether the file of the lab still says the same names outside of its labs.
    pub fn hold(&self, tables: &Tables<'_>, sources: &Sources) -> bool {
        let spoken = words_outside_labs(tables, sources, self.module);
        self.said.iter().all(|(name, said)| spoken.contains(name) == *said)
    }
}

impl Relocate for Uses {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        self.things = std::mem::take(&mut self.things).into_iter().map(|(span, used)| (to(span), used)).collect();
        let reagents = std::mem::take(&mut self.reagents).into_iter();
        self.reagents = reagents.map(|((span, name), told)| ((to(span), name), told)).collect();
    }
}

/// What one workflow has to do with the things of its lab; nothing where it is not whole.
pub fn uses(lab: &Elaborator<'_>, sources: &Sources, lab_id: DeclId, plan: &Plan) -> Option<Uses> {
    if lab.diagnostics.iter().any(Diagnostic::is_error) {
        return None;
    }
    let decl = lab.tables.names.decl(lab_id);
    let spoken = words_outside_labs(lab.tables, sources, decl.module);
    let mut used: BTreeSet<InstanceId> = BTreeSet::new();
    let tops =
        || (0..lab.instances.len() as u32).map(InstanceId).filter(|i| lab.instances[i.0 as usize].owner.is_none());
    let mut said: BTreeMap<String, bool> = BTreeMap::new();
    for id in tops() {
        let name = &lab.instances[id.0 as usize].name;
        let last = name.rsplit('.').next().unwrap_or(name);
        let named = spoken.contains(last);
        said.insert(last.to_string(), named);
        if named || lab.gone_through.iter().any(|kind| lab.instance_is(id, *kind)) {
            used.insert(id);
        }
    }
    for step in &plan.steps {
        if let Step::Operation(o) = &step.step {
            let arguments = o.arguments.iter().filter_map(|(_, a)| match a {
                Argument::Instance(id) => Some(*id),
                _ => None,
            });
            used.extend(o.claims.iter().copied().chain(o.device).chain(arguments).map(|id| lab.outermost(id)));
        }
    }
    if plan.steps.iter().any(|step| matches!(&step.step, Step::Operation(o) if o.motion.is_some())) {
        used.extend(tops().filter(|id| is_obstacle(lab, *id)));
    }
    let bonds = bonds(lab, sources, decl.item);
    loop {
        let more: BTreeSet<InstanceId> = bonds
            .iter()
            .filter(|(from, _)| used.contains(from))
            .map(|(_, to)| *to)
            .filter(|t| !used.contains(t))
            .collect();
        if more.is_empty() {
            break;
        }
        used.extend(more);
    }
    let carriers: BTreeSet<InstanceId> = tops().flat_map(|id| carriers(lab, id)).collect();
    let own = |id: &InstanceId| {
        let inst = &lab.instances[id.0 as usize];
        // Included labs are judged where they run alone; what carries something is there for that.
        inst.span.file == decl.item.span.file && !inst.name.contains('.') && !carriers.contains(id)
    };
    let things = tops().filter(own).map(|id| (lab.instances[id.0 as usize].span, used.contains(&id))).collect();
    let touched = touched(lab, plan);
    let mut idle = Vec::new();
    let mut reagents: BTreeMap<(Span, String), (String, bool)> = BTreeMap::new();
    for i in 0..lab.instances.len() as u32 {
        let (id, inst) = (InstanceId(i), &lab.instances[i as usize]);
        let Some(origin) = inst.origin.clone() else { continue };
        let thing = lab.outermost(id);
        if !own(&thing) {
            continue;
        }
        let vessel = inst.owner.unwrap_or(id);
        // Of what has many places, each counts by itself: steps name it for the others.
        let alone = lab.instances.iter().filter(|other| other.origin.is_some() && other.span == inst.span).count() == 1;
        let label = lab.instances[vessel.0 as usize].name.rsplit(['[', ']']).nth(1).map(str::to_string);
        let is_used = touched.contains(&id)
            || touched.contains(&vessel)
            || used.contains(&thing) && (alone && vessel == thing || touched.contains(&thing))
            || label.is_some_and(|label| spoken.contains(&label));
        let name = lab.instances[vessel.0 as usize].name.clone();
        let span = lab.instances[thing.0 as usize].span;
        let told = reagents.entry((span, origin.clone())).or_insert((name, false));
        told.1 |= is_used;
        if !is_used {
            idle.push((id, (span, origin)));
        }
    }
    idle.retain(|(_, key)| reagents.get(key).is_some_and(|told| !told.1));
    if !idle.is_empty() {
        let read = read(lab, plan, &used);
        for (_, key) in idle.into_iter().filter(|(id, _)| read.contains(id)) {
            reagents.get_mut(&key).into_iter().for_each(|told| told.1 = true);
        }
    }
    Some(Uses { things, reagents, said, module: decl.module })
}

/// Whether a thing only stands in the way of motions, such as a wall or a bench: it has a shape, and neither commands nor readings nor
/// contents by which a step could use it.
fn is_obstacle(lab: &Elaborator<'_>, id: InstanceId) -> bool {
    let instance = &lab.instances[id.0 as usize];
    let shaped = ["shape", "mesh", "collision"].iter().any(|field| instance.setting(field).is_some())
        || lab.lines(id).iter().any(|(_, line)| matches!(line, AssetLine::Solid { .. }));
    let serves = |m: &MemberRef<'_>| {
        matches!(&m.member.kind, MemberKind::Command { .. } | MemberKind::Value { role: Role::Reading, .. })
    };
    let stands_by = |id: InstanceId| !lab.is_mixture(id) && !lab.all_members(id).iter().any(serves);
    let mut todo = vec![id];
    shaped
        && std::iter::from_fn(|| {
            let next = todo.pop()?;
            todo.extend(lab.instances[next.0 as usize].children());
            Some(next)
        })
        .all(stands_by)
}

/// What the steps of a plan name, set or move matter from or to, vessel by vessel.
fn touched(lab: &Elaborator<'_>, plan: &Plan) -> BTreeSet<InstanceId> {
    let mut out: BTreeSet<InstanceId> = BTreeSet::new();
    let mixture = |m: u32| lab.mixtures.get(m as usize).copied();
    for step in &plan.steps {
        let Step::Operation(o) = &step.step else { continue };
        for (_, argument) in &o.arguments {
            match argument {
                Argument::Instance(id) => out.extend([*id]),
                Argument::Instances(ids) => out.extend(ids),
                _ => {}
            }
        }
        for action in o.at_start.iter().chain(&o.at_end) {
            match action {
                Action::Move { from, to, .. } => out.extend(mixture(*from).into_iter().chain(mixture(*to))),
                Action::Assign { state, .. } => out.extend(lab.state_owner.get(*state as usize)),
            }
        }
    }
    out.extend(lab.streams.keys().flat_map(|(_, from, to)| [*from, *to]));
    out
}

/// What conditions and values of a plan read, and laws that change only other things, which the plan uses: a counterweight is
/// used by whatever asks for balance.
fn read(lab: &Elaborator<'_>, plan: &Plan, used: &BTreeSet<InstanceId>) -> BTreeSet<InstanceId> {
    let mut nodes: Vec<NodeId> = Vec::new();
    for step in &plan.steps {
        match &step.step {
            Step::Operation(o) => {
                nodes.extend(o.needs.iter().map(|need| need.node));
                nodes.extend(o.limits.iter().filter_map(|i| plan.limits.get(*i as usize)).map(|l| l.condition.node));
                nodes.extend(o.until.iter().map(|until| until.node));
                nodes.extend(o.at_start.iter().chain(&o.at_end).map(Action::source));
            }
            Step::Skill { needs, invariants, .. } => {
                nodes.extend(needs.iter().map(|need| need.node).chain(invariants.iter().map(|c| c.node)));
            }
            Step::During { invariants, .. } => nodes.extend(invariants.iter().map(|c| c.node)),
            Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } => nodes.push(condition.node),
            Step::Keep { condition, .. } | Step::If { condition, .. } => nodes.push(condition.node),
            Step::RepeatWhile { condition, .. } => nodes.push(condition.node),
            Step::Let { value, .. } => nodes.push(*value),
            Step::Expect(conditions) => nodes.extend(conditions.iter().map(|c| c.node)),
            _ => {}
        }
    }
    let mut out = owners_read(lab, nodes);
    let mut laws: BTreeMap<usize, (BTreeSet<InstanceId>, Vec<NodeId>)> = BTreeMap::new();
    let flows = lab.flows.iter().map(|((id, ..), parts)| (*id, parts));
    let rates = lab.rates.iter().map(|(state, parts)| (lab.state_owner[*state as usize], parts));
    for (id, parts) in flows.chain(rates) {
        for part in parts {
            let law = laws.entry(part.process).or_default();
            law.0.insert(lab.outermost(id));
            law.1.push(part.node);
        }
    }
    for (changed, nodes) in laws.into_values().filter(|(changed, _)| !changed.is_disjoint(used)) {
        out.extend(owners_read(lab, nodes).into_iter().filter(|id| !changed.contains(&lab.outermost(*id))));
    }
    out
}

/// The things whose states nodes depend on. What a choice leaves out as things stand at first does not count: whatever is moved is
/// named where that is done.
fn owners_read(lab: &Elaborator<'_>, mut todo: Vec<NodeId>) -> BTreeSet<InstanceId> {
    let at_first = |state: u32| lab.states.get(state as usize).and_then(|s| lab.graph.constant(s.initial));
    let known = |condition: NodeId| {
        let is_open = |op: &Op| match op {
            Op::State(state) => at_first(*state).is_none(),
            Op::Const(_) => false,
            op => op.operands().next().is_none(),
        };
        let value = |op: Op| match op {
            Op::Const(value) => value,
            Op::State(state) => at_first(state).unwrap_or(f64::NAN),
            _ => f64::NAN,
        };
        (!lab.graph.depends(condition, is_open)).then(|| lab.graph.eval_on(condition, value) != 0.0)
    };
    let (mut seen, mut out) = (BTreeSet::new(), BTreeSet::new());
    while let Some(node) = todo.pop() {
        if !seen.insert(node) {
            continue;
        }
        match lab.graph.op(node) {
            Op::State(state) => out.extend(lab.state_owner.get(state as usize)),
            Op::Reading(reading) => todo.extend(lab.readings.get(reading as usize).map(|r| r.value)),
            Op::Select(condition, a, b) => match known(condition) {
                Some(holds) => todo.extend([condition, if holds { a } else { b }]),
                None => todo.extend([condition, a, b]),
            },
            op => todo.extend(op.operands()),
        }
    }
    out
}

/// Things that no workflow of the file has to do with.
pub fn things(sources: &Sources, uses: &[Uses]) -> Vec<Diagnostic> {
    let mut all: BTreeMap<Span, bool> = BTreeMap::new();
    for (span, used) in uses.iter().flat_map(|uses| &uses.things) {
        *all.entry(*span).or_default() |= *used;
    }
    // A reagent of which no vessel has anything to do with any step: what was to be added is not.
    let mut filled: BTreeMap<&String, (&Span, &String, bool)> = BTreeMap::new();
    for ((span, reagent), (vessel, used)) in uses.iter().flat_map(|uses| &uses.reagents) {
        let told = filled.entry(reagent).or_insert((span, vessel, false));
        told.2 |= used;
    }
    let mut out = Vec::new();
    // Where no step has to do with any reagent, none is missing.
    let doses = filled.values().any(|(.., used)| *used);
    for (reagent, (span, vessel, _)) in filled.into_iter().filter(|(_, (.., used))| doses && !used) {
        all.remove(span);
        let headline = format!("no workflow of this file uses `{reagent}` in `{vessel}`");
        let d = Diagnostic::warning(codes::UNUSED, *span, headline, "filled, but never used");
        out.push(d.help("remove it, or add the missing step that dispenses, pours or draws it"));
    }
    let idle = all.into_iter().filter(|(_, used)| !used);
    out.extend(idle.map(|(span, _)| {
        let headline = format!("no workflow of this file uses `{}`", sources.slice(span));
        Diagnostic::advice(codes::UNUSED, span, headline, "no step uses it")
            .help("remove it, or use it: did you mean it in one of the steps?")
    }));
    out
}

/// Species and solutions of a module that nothing in its file names.
pub fn reagents(names: &Names<'_>, sources: &Sources, module: usize) -> Vec<Diagnostic> {
    let items: Vec<&Item> = names.declared_by(module).map(|id| names.decl(id).item).collect();
    // Each word with the first item that has it, and whether others have it as well.
    let mut named: HashMap<&str, (usize, bool)> = HashMap::new();
    for (index, item) in items.iter().enumerate() {
        for word in sources.slice(item.span).split(|c: char| !is_of_species(c)).filter(|w| !w.is_empty()) {
            let known = named.entry(word).or_insert((index, false));
            known.1 |= known.0 != index;
        }
    }
    let mut out = Vec::new();
    for (index, item) in items.iter().enumerate() {
        let what = match item.kind {
            ItemKind::Species { .. } => "species",
            ItemKind::Solution { .. } => "solution",
            _ => continue,
        };
        let Some((name, span)) = item_name(item) else { continue };
        let bare = name.split_once('(').map_or(name.as_str(), |(bare, _phase)| bare);
        let word = bare.trim_end_matches(|c: char| !is_of_species(c));
        if named.get(word).is_some_and(|(first, several)| *several || *first != index) {
            continue;
        }
        let headline = format!("this file never uses the {what} `{name}`");
        let d = Diagnostic::warning(codes::UNUSED, span, headline, "no vessel or recipe contains it");
        out.push(d.help("remove it, or use it: should a vessel hold it?"));
    }
    out
}

/// Which things are needed for which: what carries them, what their fields name, what a law couples them with.
fn bonds(lab: &Elaborator<'_>, sources: &Sources, item: &Item) -> BTreeSet<(InstanceId, InstanceId)> {
    let mut out = BTreeSet::new();
    for i in 0..lab.instances.len() as u32 {
        let id = InstanceId(i);
        out.extend(carriers(lab, id).into_iter().map(|c| (lab.outermost(id), c)));
    }
    if let ItemKind::Lab { lines, .. } = &item.kind {
        for line in lines {
            let LabLineKind::Instance { name, literal, .. } = &line.kind else { continue };
            let Some(id) = lab.find_instance(&name.text) else { continue };
            let named = words(sources.slice(literal.span)).filter_map(|w| lab.find_instance(w));
            out.extend(named.map(|other| (id, lab.outermost(other))));
        }
    }
    let mut coupled: BTreeMap<usize, BTreeSet<InstanceId>> = BTreeMap::new();
    for ((id, ..), parts) in &lab.flows {
        parts.iter().for_each(|c| coupled.entry(c.process).or_default().extend([lab.outermost(*id)]));
    }
    for (state, parts) in &lab.rates {
        let owner = lab.outermost(lab.state_owner[*state as usize]);
        parts.iter().for_each(|c| coupled.entry(c.process).or_default().extend([owner]));
    }
    for together in coupled.values() {
        out.extend(together.iter().flat_map(|a| together.iter().map(|b| (*a, *b))));
    }
    out
}

/// What a thing stands on or in.
fn carriers(lab: &Elaborator<'_>, id: InstanceId) -> Vec<InstanceId> {
    lab.instances[id.0 as usize].placed.iter().map(|(_, on)| lab.outermost(*on)).collect()
}

/// The words of a module's items that are no labs; put together once, for all workflows.
fn words_outside_labs(tables: &Tables<'_>, sources: &Sources, module: usize) -> Arc<HashSet<String>> {
    if let Some(known) = tables.spoken.read().ok().and_then(|all| all.get(&module).cloned()) {
        return known;
    }
    let items = tables.names.declared_by(module).map(|id| tables.names.decl(id).item);
    let outside = items.filter(|i| !matches!(i.kind, ItemKind::Lab { .. }));
    let found: Arc<HashSet<String>> =
        Arc::new(outside.flat_map(|i| words(sources.slice(i.span))).map(str::to_string).collect());
    if let Ok(mut all) = tables.spoken.write() {
        all.insert(module, found.clone());
    }
    found
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !is_word(c)).filter(|w| !w.is_empty())
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Whether a character is one of the name of a species, all but the sign of its charge: `SO4^2-`.
fn is_of_species(c: char) -> bool {
    is_word(c) || c == '^'
}

#[cfg(test)]
mod tests {
    use crate::check::tests::found;

    fn idle(steps: &str) -> Vec<String> {
        let text = format!(
            "use std::glassware::Beaker250mL
            use std::heating::IkaRetControl
            lab bench {{
                ambient: 25 degC
                plate = IkaRetControl at (0, 0, 0) m
                other = IkaRetControl at (1, 0, 0) m
                cup = Beaker250mL on plate holding 10 g of water
            }}
            workflow w in bench {{ {steps} }}"
        );
        found(&text, |bench| {
            let subject = bench.subject();
            let uses = super::uses(subject.lab, subject.sources, bench.at.1, subject.plan);
            super::things(subject.sources, &[uses.expect("the lab stands in the text")])
        })
    }

    #[test]
    fn a_wall_that_arms_pass_is_used() {
        let lab = |wall: &str, steps: &str| {
            let text = format!(
                "use std::glassware::Beaker250mL
                use std::heating::IkaRetControl
                use std::robots::{{FrankaPanda, Robotiq2F85}}
                asset Wall: Body {{ mass: 40 kg, shape: box(20 mm, 800 mm, 900 mm) }}
                lab bench {{
                    ambient: 25 degC
                    table = OpticalTable at (0, 0, 0) m
                    panda = FrankaPanda {{ gripper: Robotiq2F85 }} on table at (-400, 0) mm
                    cup = Beaker250mL on table at (100, 0) mm holding 10 g of water
                    other = {wall} at (1.2, 0, 0) m
                }}
                workflow w in bench {{ {steps} }}"
            );
            found(&text, |bench| {
                let subject = bench.subject();
                let uses = super::uses(subject.lab, subject.sources, bench.at.1, subject.plan);
                super::things(subject.sources, &[uses.expect("the lab stands in the text")])
            })
        };
        let moved = "pick cup by panda; put back cup by panda";
        for wall in ["Wall", "LabBench"] {
            assert_eq!(lab(wall, moved), [""; 0], "{wall}");
        }
        // A spare device is one that no step uses, and without a robot nothing is in the way.
        let spare = "unused: no workflow of this file uses `other`";
        assert_eq!(lab("IkaRetControl", moved), [spare]);
        assert!(lab("Wall", "wait 1 s").contains(&spare.to_owned()));
    }

    #[test]
    fn a_thing_that_no_step_has_to_do_with_is_not_used() {
        assert_eq!(
            idle("heat plate to 30 degC; heat other to 30 degC; stop heating plate; stop heating other"),
            [""; 0]
        );
        assert_eq!(
            idle("heat plate to 30 degC; stop heating plate"),
            ["unused: no workflow of this file uses `other`"]
        );
    }
}
