//! What meets in some order of steps that run beside each other: an explicit search through the joint points of all lines.
//!
//! A state is where each line stands; what the vessels hold there is joined over all ways to it. Steps that concern one line only go
//! first (a persistent set, Godefroid: Partial-order methods for the verification of concurrent systems, 1996), so that only steps
//! whose order matters are tried in every order. Orders that claims, `await` or times exclude are none.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Op, Severity, Span, codes};

use super::evaluator::NodeEvaluator;
use super::lines::{Edge, Lines, lines};
use super::state::MixtureState;
use super::{Coming, Pair, Walk};
use crate::check::time::Times;
use crate::declare::SpeciesId;

/// Points of all lines, and steps from one joint state to the next, at most; a plan that needs more is told so. Time and memory go with
/// the steps: a joint state of a hundred lines leads to a hundred others.
const MOST_POINTS: usize = 100_000;
const MOST_STEPS: usize = 40_000;

/// Where each line stands, by its point, in order.
type State = Vec<usize>;

/// What came of it.
#[derive(Default)]
pub(super) struct Found {
    /// Meetings by pair and place.
    met: BTreeMap<(Pair, Span), Met>,
    /// How often a statement was carried out.
    done: BTreeMap<Span, usize>,
    /// Pairs that have met whatever the order; none where no order comes to the end.
    always: Option<BTreeSet<Pair>>,
}

struct Met {
    diagnostic: Diagnostic,
    /// On how many ways to the statement they have met for certain.
    certain: usize,
    /// As grave as the pair is.
    grave: Severity,
}

impl Found {
    pub(super) fn add(&mut self, coming: Coming) {
        let Coming { pair, place, diagnostic, certain, grave } = coming;
        let count = usize::from(certain);
        let new =
            self.met.entry((pair, place)).or_insert_with(|| Met { diagnostic: diagnostic.clone(), certain: 0, grave });
        new.certain += count;
        if certain && diagnostic.severity < new.diagnostic.severity {
            new.diagnostic = diagnostic;
        }
    }
}

/// Mixtures as far as streams and events connect them, and what operations do to each of these groups.
struct Shared<'e, 'l, 'a> {
    eyes: &'e NodeEvaluator<'l, 'a>,
    group: Vec<usize>,
    /// Groups of which the order of operations in different lines matters.
    hot: BTreeSet<usize>,
    /// States that decide which streams run, with the groups of those.
    switches: BTreeMap<u32, BTreeSet<usize>>,
}

/// The groups that an operation brings something into, and those whose contents it passes on or takes away.
struct Effect {
    into: BTreeSet<usize>,
    from: BTreeSet<usize>,
}

impl<'e, 'l, 'a> Shared<'e, 'l, 'a> {
    fn new(eyes: &'e NodeEvaluator<'l, 'a>, by_event: &BTreeSet<(InstanceId, InstanceId)>) -> Self {
        let mut group: Vec<usize> = (0..eyes.lab.instances.len()).collect();
        let streams = eyes.lab.streams.keys().map(|(_, from, to)| (*from, *to));
        for (from, to) in streams.chain(by_event.iter().copied()) {
            let (a, b) = (group[from.0 as usize], group[to.0 as usize]);
            group.iter_mut().filter(|g| **g == a).for_each(|g| *g = b);
        }
        let mut switches: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
        for (process, from, _) in eyes.lab.streams.keys() {
            let Some(guard) = eyes.lab.processes.get(*process).and_then(|p| p.guard) else { continue };
            for state in states_of(eyes, guard) {
                switches.entry(state).or_default().insert(group[from.0 as usize]);
            }
        }
        Shared { eyes, group, hot: BTreeSet::new(), switches }
    }

    /// Groups that several species can get into.
    fn of_several(&self) -> BTreeSet<usize> {
        let lab = self.eyes.lab;
        let mut species: BTreeMap<usize, BTreeSet<SpeciesId>> = BTreeMap::new();
        for m in &lab.mixtures {
            let all = species.entry(self.group[m.0 as usize]).or_default();
            all.extend(lab.reach.set(&lab.instances[m.0 as usize].name).into_iter().flatten());
        }
        species.into_iter().filter(|(_, all)| all.len() > 1).map(|(group, _)| group).collect()
    }

    fn effect(&self, operation: &Operation) -> Effect {
        let mixtures = &self.eyes.lab.mixtures;
        let of = |m: &u32| mixtures.get(*m as usize).map(|m| self.group[m.0 as usize]);
        let (mut into, mut from, mut rinsed) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for action in operation.at_start.iter().chain(&operation.at_end) {
            match action {
                Action::Move { from: a, to: b, .. } => {
                    from.extend(of(a));
                    into.extend(of(b));
                }
                Action::Assign { state, .. } => {
                    rinsed.extend(self.eyes.lineage.get(state).map(|m| self.group[m.0 as usize]));
                    let switched = self.switches.get(state).into_iter().flatten();
                    switched.for_each(|g| {
                        into.insert(*g);
                        from.insert(*g);
                    });
                }
            }
        }
        // What a transfer notes of what it touches is no rinse.
        from.extend(rinsed.into_iter().filter(|g| !into.contains(g)).collect::<Vec<_>>());
        Effect { into, from }
    }

    fn is_hot(&self, operation: &Operation) -> bool {
        let Effect { into, from } = self.effect(operation);
        into.iter().chain(&from).any(|g| self.hot.contains(g))
    }
}

fn states_of(eyes: &NodeEvaluator<'_, '_>, node: NodeId) -> Vec<u32> {
    let graph = &eyes.lab.graph;
    let states = graph.schedule([node]).into_iter().filter_map(|n| match graph.op(n) {
        Op::State(s) => Some(s),
        _ => None,
    });
    states.collect()
}

/// Follows the steps of a plan in every order in which they can run; `times` is asked for only where the order matters.
pub(super) fn orders<'t>(walk: &mut Walk<'_, '_>, world: &MixtureState, times: impl FnOnce() -> Times<'t>) {
    let plan = walk.plan;
    if !plan.steps.iter().any(|s| matches!(s.step, Step::Parallel(_) | Step::Start { .. })) {
        return;
    }
    let mut shared = Shared::new(walk.eyes, &walk.by_event);
    let operations: Vec<(StepId, Effect)> = (0..plan.steps.len() as u32)
        .map(StepId)
        .filter_map(|id| match &plan.get(id).step {
            Step::Operation(o) => {
                Some((id, shared.effect(o))).filter(|(_, e)| !e.into.is_empty() || !e.from.is_empty())
            }
            _ => None,
        })
        .collect();
    let (mut into, mut from): (BTreeMap<usize, Vec<StepId>>, BTreeMap<usize, Vec<StepId>>) = Default::default();
    for (id, effect) in &operations {
        effect.into.iter().for_each(|g| into.entry(*g).or_default().push(*id));
        effect.from.iter().for_each(|g| from.entry(*g).or_default().push(*id));
    }
    // Where there is one species there is nothing that it could meet.
    let several = shared.of_several();
    into.retain(|group, _| several.contains(group));
    if !into.keys().any(|g| from.contains_key(g)) {
        return;
    }
    let times = times();
    for (group, writers) in &into {
        let readers = from.get(group).map_or(&[][..], Vec::as_slice);
        if writers.iter().any(|a| readers.iter().any(|b| a != b && times.beside(*a, *b))) {
            shared.hot.insert(*group);
        }
    }
    if shared.hot.is_empty() {
        return;
    }
    let span = plan.get(plan.root).span;
    let begin = MixtureState::clone(world);
    let eyes = walk.eyes;
    let number = |node: NodeId| eyes.value(node, &begin);
    let Some(lines) = lines(plan, &walk.library, walk.eyes.lab.tables.dangers(), &number, MOST_POINTS) else {
        return walk.found.push(not_followed(span));
    };
    let hot = operations
        .iter()
        .map(|o| o.0)
        .filter(|id| matches!(&plan.get(*id).step, Step::Operation(o) if shared.is_hot(o)));
    let hot: Vec<StepId> = hot.collect();
    walk.orders = Some(Found::default());
    let complete = Search::new(walk, &lines, &shared, &times, hot).run(begin);
    walk.take_orders();
    if !complete {
        walk.found.push(not_followed(span));
    }
}

fn not_followed(span: Span) -> Diagnostic {
    let headline = "concurrent steps can run in too many orders to check them all";
    Diagnostic::warning(codes::NOT_ANALYSED, span, headline, "some orders are not screened")
        .help("let the steps that fill and empty one vessel wait for each other")
}

struct Search<'s, 'w, 'v, 'a> {
    walk: &'s mut Walk<'w, 'a>,
    lines: &'s Lines,
    /// Operations whose order matters.
    hot: BTreeSet<StepId>,
    /// Operations that are over before another one begins, by that one.
    before: BTreeMap<StepId, Vec<StepId>>,
    /// Conditions that other lines may change, and instances that several lines claim.
    open: BTreeSet<u32>,
    contended: BTreeSet<InstanceId>,
    /// From which points the end of an operation is still to come.
    ahead: BTreeMap<StepId, Vec<bool>>,
    shared: &'s Shared<'v, 'v, 'a>,
}

impl<'s, 'w, 'v, 'a> Search<'s, 'w, 'v, 'a> {
    fn new(
        walk: &'s mut Walk<'w, 'a>,
        lines: &'s Lines,
        shared: &'s Shared<'v, 'v, 'a>,
        times: &Times<'_>,
        hot: Vec<StepId>,
    ) -> Self {
        let mut before: BTreeMap<StepId, Vec<StepId>> = BTreeMap::new();
        for b in &hot {
            let earlier = hot.iter().filter(|a| times.beside(**a, *b) && times.before(**a, *b)).copied().collect();
            before.insert(*b, earlier);
        }
        let (open, contended) = interference(walk.plan, lines);
        let hot = hot.into_iter().collect();
        Search { walk, lines, hot, before, open, contended, ahead: BTreeMap::new(), shared }
    }

    /// Visits every joint state; whether that came to an end.
    fn run(&mut self, begin: MixtureState) -> bool {
        let mut worlds: BTreeMap<State, MixtureState> = BTreeMap::new();
        let mut due: BTreeSet<(usize, State)> = BTreeSet::new();
        let first = vec![self.lines.begin];
        due.insert((0, first.clone()));
        worlds.insert(first, begin);
        let mut steps = 0;
        while let Some((_, state)) = due.pop_first() {
            if steps > MOST_STEPS {
                return false;
            }
            let Some(world) = worlds.get(&state).cloned() else { continue };
            if state.contains(&self.lines.end) {
                continue;
            }
            let successors = self.successors(&state, &world);
            steps += successors.len().max(1);
            for (next, after) in successors {
                let grown = match worlds.remove(&next) {
                    None => Some(after),
                    Some(known) => {
                        let joined = known.clone().join(after);
                        match joined.is_like(&known) {
                            true => {
                                worlds.insert(next.clone(), known);
                                None
                            }
                            false => Some(joined),
                        }
                    }
                };
                if let Some(grown) = grown {
                    worlds.insert(next.clone(), grown);
                    due.insert((next.iter().sum(), next));
                }
            }
        }
        let ends = worlds.into_iter().filter(|(state, _)| state.contains(&self.lines.end));
        let always = ends.map(|(_, world)| world.met).reduce(|a, b| a.intersection(&b).copied().collect());
        if let Some(found) = &mut self.walk.orders {
            found.always = always;
        }
        true
    }

    /// Where a joint state leads, and what the vessels hold then.
    fn successors(&mut self, state: &State, world: &MixtureState) -> Vec<(State, MixtureState)> {
        let lines = self.lines;
        // A line whose next steps concern no other one goes first, alone.
        let alone = state.iter().position(|p| {
            let next = &lines.points[*p].next;
            !next.is_empty() && next.iter().all(|(edge, to)| self.is_local(edge, *to) && ready(lines, state, edge))
        });
        let moving: Vec<usize> = alone.map_or_else(|| (0..state.len()).collect(), |i| vec![i]);
        let mut out = Vec::new();
        for i in moving {
            for (edge, to) in &lines.points[state[i]].next {
                if !ready(lines, state, edge) || !self.may_begin(state, i, edge) || self.is_held(state, i, *to) {
                    continue;
                }
                if let Some(after) = self.follow(edge, world) {
                    out.extend(step(lines, state, i, edge, *to).map(|next| (next, after)));
                }
            }
        }
        out
    }

    /// Whether a step concerns its own line only.
    fn is_local(&self, edge: &Edge, to: usize) -> bool {
        let enters = self.lines.points[to].held.iter().any(|(i, _)| self.contended.contains(i));
        let own = |id: &StepId| match &self.walk.plan.get(*id).step {
            Step::Operation(o) => !o.needs.iter().any(|need| self.is_open(need.node)),
            _ => true,
        };
        match edge {
            Edge::Begin(id) => !self.hot.contains(id) && own(id),
            Edge::End(id) => !self.hot.contains(id),
            Edge::Assume(node, _) => !self.is_open(*node),
            Edge::Escape(_) => true,
            _ => !enters,
        }
    }

    fn is_open(&self, node: NodeId) -> bool {
        states_of(self.walk.eyes, node).iter().any(|s| {
            let eyes = self.walk.eyes;
            let of_hot = eyes.counted.contains(s)
                && eyes.amounts.iter().any(|(m, list)| {
                    self.shared.hot.contains(&self.shared.group[m.0 as usize]) && list.iter().any(|(_, of)| of == s)
                });
            self.open.contains(s) || of_hot
        })
    }

    /// Whether times let an operation begin: those that are over before it are over.
    fn may_begin(&mut self, state: &State, line: usize, edge: &Edge) -> bool {
        let Edge::Begin(id) = edge else { return true };
        let Some(earlier) = self.before.get(id).cloned() else { return true };
        earlier.into_iter().all(|b| {
            let ahead = self.ahead(b);
            state.iter().enumerate().all(|(i, p)| i == line || !ahead[*p])
        })
    }

    /// By point: whether an operation is still to end.
    fn ahead(&mut self, operation: StepId) -> &[bool] {
        let lines = self.lines;
        self.ahead.entry(operation).or_insert_with(|| {
            let mut back: Vec<Vec<usize>> = vec![Vec::new(); lines.points.len()];
            let mut todo = Vec::new();
            for (from, point) in lines.points.iter().enumerate() {
                for (edge, to) in &point.next {
                    back[*to].push(from);
                    match edge {
                        Edge::End(id) if *id == operation => todo.push(from),
                        Edge::Fork(begins) => begins.iter().for_each(|b| back[*b].push(from)),
                        _ => {}
                    }
                }
            }
            let mut ahead = vec![false; lines.points.len()];
            while let Some(point) = todo.pop() {
                if !std::mem::replace(&mut ahead[point], true) {
                    todo.extend(&back[point]);
                }
            }
            ahead
        })
    }

    /// Whether another line holds what is held at a point.
    fn is_held(&self, state: &State, line: usize, to: usize) -> bool {
        let mine = &self.lines.points[to].held;
        let has = |set: &BTreeSet<(InstanceId, StepId)>, by: &StepId| set.iter().any(|(_, other)| other == by);
        state.iter().enumerate().filter(|(i, _)| *i != line).any(|(_, p)| {
            let other = &self.lines.points[*p].held;
            mine.iter().any(|(i, by)| {
                other.iter().any(|(j, their)| i == j && by != their && !has(other, by) && !has(mine, their))
            })
        })
    }

    /// What the vessels hold after a step; nothing where it cannot be done.
    fn follow(&mut self, edge: &Edge, world: &MixtureState) -> Option<MixtureState> {
        let mut world = world.clone();
        let eyes = self.walk.eyes;
        match edge {
            Edge::Begin(id) | Edge::End(id) => {
                let plan = self.walk.plan;
                let Step::Operation(operation) = &plan.get(*id).step else { return Some(world) };
                let begins = matches!(edge, Edge::Begin(_));
                if begins && operation.needs.iter().any(|need| eyes.truth(need.node, &world) == Some(false)) {
                    return None;
                }
                let places = self.lines.sites.get(id).cloned().unwrap_or_default();
                let outer = std::mem::replace(&mut self.walk.places, places);
                let actions = if begins { &operation.at_start } else { &operation.at_end };
                actions.iter().for_each(|action| self.walk.action(action, &mut world));
                if !actions.is_empty() {
                    self.walk.streams(None, &mut world);
                    let place = self.walk.place();
                    if let Some(found) = &mut self.walk.orders {
                        *found.done.entry(place).or_default() += 1;
                    }
                }
                self.walk.places = outer;
            }
            Edge::Keep(local, node) => {
                let value = eyes.value(*node, &world);
                world.keep(*local, value);
            }
            Edge::Assume(node, holds) if eyes.truth(*node, &world) == Some(!*holds) => return None,
            _ => {}
        }
        Some(world)
    }
}

/// States that operations of several lines assign, and instances that several lines claim.
fn interference(plan: &matterix_ir::plan::Plan, lines: &Lines) -> (BTreeSet<u32>, BTreeSet<InstanceId>) {
    let mut writers: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
    let mut holders: BTreeMap<InstanceId, BTreeSet<usize>> = BTreeMap::new();
    for point in &lines.points {
        for (i, by) in point.held.iter() {
            if matches!(plan.get(*by).step, Step::Claim { .. }) {
                holders.entry(*i).or_default().insert(point.line);
            }
        }
        for (edge, _) in &point.next {
            let Edge::Begin(id) = edge else { continue };
            let Step::Operation(o) = &plan.get(*id).step else { continue };
            for action in o.at_start.iter().chain(&o.at_end) {
                if let Action::Assign { state, .. } = action {
                    writers.entry(*state).or_default().insert(point.line);
                }
            }
        }
    }
    let open = writers.into_iter().filter(|(_, lines)| lines.len() > 1).map(|(s, _)| s).collect();
    let contended = holders.into_iter().filter(|(_, lines)| lines.len() > 1).map(|(i, _)| i).collect();
    (open, contended)
}

/// Whether the lines that a step waits for have come to their ends.
fn ready(lines: &Lines, state: &State, edge: &Edge) -> bool {
    match edge {
        Edge::Join(ends) => ends.iter().all(|end| state.contains(end)),
        Edge::Await(end) => {
            state.contains(end) || !state.iter().any(|p| lines.points[*p].line == lines.points[*end].line)
        }
        Edge::Fork(begins) => {
            !begins.iter().any(|b| state.iter().any(|p| lines.points[*p].line == lines.points[*b].line))
        }
        _ => true,
    }
}

/// The joint state after a step of one line.
fn step(lines: &Lines, state: &State, line: usize, edge: &Edge, to: usize) -> Option<State> {
    let mut next = state.clone();
    next[line] = to;
    match edge {
        Edge::Fork(begins) => next.extend(begins.iter()),
        Edge::Join(ends) => next.retain(|p| !ends.contains(p)),
        Edge::Await(end) => next.retain(|p| p != end),
        Edge::Escape(inside) => {
            let own = lines.points[to].line;
            next.retain(|p| {
                let of = lines.points[*p].line;
                *p == to || (of != own && !inside.contains(&of))
            });
        }
        _ => {}
    }
    next.sort_unstable();
    next.dedup();
    Some(next)
}

impl Walk<'_, '_> {
    /// Takes over what was found in other orders than that of the text: a warning, or an error where it happens in every order.
    pub(super) fn take_orders(&mut self) {
        let Some(Found { met, done, always }) = self.orders.take() else { return };
        let is_always = |pair: &Pair| always.as_ref().is_some_and(|all| all.contains(pair));
        // What the text's own order has found, and another order does not, or none that can happen.
        let mut never = BTreeSet::new();
        for (pair, place, index) in std::mem::take(&mut self.told) {
            let times = done.get(&place).copied().unwrap_or_default();
            match met.get(&(pair, place)) {
                None if times > 0 && always.is_some() => {
                    self.pairs.remove(&pair);
                    never.insert(index);
                }
                Some(met) if met.certain < times && always.is_some() && !is_always(&pair) && !self.in_loop(place) => {
                    in_some_order(&mut self.found[index]);
                }
                _ => {}
            }
        }
        let mut index = 0;
        self.found.retain(|_| {
            index += 1;
            !never.contains(&(index - 1))
        });
        let mut said: BTreeMap<Pair, (Severity, Span, Diagnostic)> = BTreeMap::new();
        for ((pair, place), found) in met {
            let Met { mut diagnostic, certain, grave } = found;
            if is_always(&pair) && certain > 0 {
                diagnostic.severity = grave;
            } else {
                in_some_order(&mut diagnostic);
            }
            if self.pairs.get(&pair).is_some_and(|told| *told <= diagnostic.severity) {
                continue;
            }
            // One place is enough: the last in the text.
            let better = said.get(&pair).is_none_or(|(severity, at, _)| {
                (diagnostic.severity, std::cmp::Reverse(place)) < (*severity, std::cmp::Reverse(*at))
            });
            if better {
                said.insert(pair, (diagnostic.severity, place, diagnostic));
            }
        }
        let mut new: BTreeMap<Span, (Severity, Span, Diagnostic)> = BTreeMap::new();
        for (severity, place, diagnostic) in said.into_values() {
            let graver = new.get(&place).is_none_or(|(known, ..)| severity < *known);
            if graver {
                new.insert(place, (severity, place, diagnostic));
            }
        }
        self.found.extend(new.into_values().map(|(_, _, d)| d));
    }

    /// Whether a statement stands in a loop.
    fn in_loop(&self, place: Span) -> bool {
        let loops = self.plan.steps.iter().filter(|s| matches!(s.step, Step::Repeat { .. } | Step::RepeatWhile { .. }));
        let holds = |outer: Span| outer.file == place.file && outer.start <= place.start && place.end <= outer.end;
        loops.into_iter().any(|s| holds(s.span))
    }
}

/// Says that the order of steps that run beside each other decides.
fn in_some_order(d: &mut Diagnostic) {
    d.severity = Severity::Warning;
    let headline = d.headline.replacen(" may come together", " come together", 1);
    d.headline = format!("in some order of the steps, {headline}");
    let help = "concurrent steps run in any order: let one wait for the other, or `claim` the thing that both use";
    d.help.insert(0, help.to_owned());
}
