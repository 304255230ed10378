//! What a moment leaves once all that happens at once has happened: salts have split in water. The contents of the walk keep what was put
//! in, which reactions and findings go by; a hazard asks for what is there.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Event};
use matterix_ir::{FileId, NodeId, Op};
use rustc_hash::{FxHashMap, FxHashSet};

use super::evaluator::NodeEvaluator;
use super::state::MixtureState;
use crate::elaborate::hazards::{Hazard, Watched};

/// The events that set what a hazard asks for, by the index of the hazard. What the library looks at after each step counts what is still
/// to split.
#[derive(Default)]
pub(super) struct Settling(BTreeMap<usize, Vec<usize>>);

impl Settling {
    /// The events of each hazard, and the states that they go by.
    pub fn new(
        eyes: &NodeEvaluator<'_, '_>,
        hazards: &[Hazard],
        events: &[Event],
        library: &BTreeSet<FileId>,
    ) -> (Settling, BTreeMap<usize, BTreeSet<u32>>) {
        let (mut settling, mut reads) = (Settling::default(), BTreeMap::new());
        let counts = |hazard: &Hazard| hazard.watched == Watched::Steps && library.contains(&hazard.span.file);
        let mut setters: Option<Setters> = None;
        for (i, hazard) in hazards.iter().enumerate().filter(|(_, hazard)| !counts(hazard)) {
            let setters = setters.get_or_insert_with(|| Setters::of(eyes, events));
            let (found, read) = setters.below(eyes, events, &hazard.states);
            if !found.is_empty() {
                settling.0.insert(i, found.into_iter().collect());
                reads.insert(i, read);
            }
        }
        (settling, reads)
    }

    /// The moment as a hazard sees it; as it is where not all that happens is known, or where it does not come to an end.
    pub fn settled<'w>(
        &self,
        hazard: usize,
        eyes: &NodeEvaluator<'_, '_>,
        events: &[Event],
        world: &'w MixtureState,
    ) -> Cow<'w, MixtureState> {
        let mut after = Cow::Borrowed(world);
        let Some(those) = self.0.get(&hazard) else { return after };
        for _ in 0..=those.len() {
            let happens = |e: &&usize| eyes.nominal_truth(events[**e].when, &after) == Some(true);
            let Some(event) = those.iter().find(happens) else { return after };
            for action in &events[*event].actions {
                let Action::Assign { state, value, .. } = action else { continue };
                let value = eyes.value(*value, &after);
                if value.is_nan() {
                    return Cow::Borrowed(world);
                }
                after.to_mut().states[*state as usize] = value;
            }
        }
        Cow::Borrowed(world)
    }
}

/// The events that do nothing but set amounts, by the states they set.
struct Setters(FxHashMap<u32, Vec<usize>>);

impl Setters {
    fn of(eyes: &NodeEvaluator<'_, '_>, events: &[Event]) -> Setters {
        let mut out: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        for (i, event) in events.iter().enumerate() {
            let set = event.actions.iter().map(|action| match action {
                Action::Assign { state, .. } if eyes.counted.contains(state) => Some(*state),
                _ => None,
            });
            let Some(set) = set.collect::<Option<Vec<u32>>>() else { continue };
            set.into_iter().for_each(|state| out.entry(state).or_default().push(i));
        }
        Setters(out)
    }

    /// The events that set some states, or what these events go by, and all that they go by.
    fn below(
        &self,
        eyes: &NodeEvaluator<'_, '_>,
        events: &[Event],
        states: &[u32],
    ) -> (BTreeSet<usize>, BTreeSet<u32>) {
        let (mut found, mut read) = (BTreeSet::new(), BTreeSet::new());
        let mut todo = states.to_vec();
        let mut seen: FxHashSet<u32> = todo.iter().copied().collect();
        while let Some(state) = todo.pop() {
            for event in self.0.get(&state).into_iter().flatten() {
                if found.insert(*event) {
                    let asked = asked(eyes, &events[*event]);
                    todo.extend(asked.iter().copied().filter(|s| seen.insert(*s)));
                    read.extend(asked);
                }
            }
        }
        (found, read)
    }
}

/// The states that an event goes by.
fn asked(eyes: &NodeEvaluator<'_, '_>, event: &Event) -> Vec<u32> {
    let values = event.actions.iter().flat_map(|action| {
        let kept = action.but().iter().map(|kept| kept.stays.source());
        action.assigned().map(|_| action.source()).into_iter().chain(kept)
    });
    let nodes: Vec<NodeId> = values.chain([event.when]).collect();
    let graph = &eyes.lab.graph;
    let state = |node| if let Op::State(s) = graph.op(node) { Some(s) } else { None };
    graph.schedule(nodes).into_iter().filter_map(state).collect()
}
