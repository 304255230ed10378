//! The findings of the screen, with the ways on which the two got together.

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, Span, codes};

use super::state::{Before, Entry, MixtureState};
use super::{Coming, Pending, Walk};
use crate::declare::SpeciesId;
use crate::declare::compatibility::{Intended, Match, Party, Presence, intended};

/// What every finding of the screen says of itself.
const SCREEN: &str = "this screens classes of substances and is no safety assessment: a mixture that it does not report may still be dangerous";

/// Two species that come together.
struct Meeting<'e> {
    /// Where.
    m: InstanceId,
    /// What comes.
    a: (SpeciesId, &'e Entry),
    /// What is there.
    b: (SpeciesId, &'e Entry),
    /// Whatever way the plan takes.
    certain: bool,
    /// The step, or the line of what it holds.
    place: Span,
}

impl Walk<'_, '_> {
    /// Judges a species that gets to others; `before` is what there was before the transfer that brings it.
    pub(super) fn meet(
        &mut self,
        world: &MixtureState,
        m: InstanceId,
        s: SpeciesId,
        others: &[SpeciesId],
        before: Option<&Before>,
    ) {
        let tables = self.eyes.lab.tables;
        let Some(entry) = world.held(m).get(&s) else { return };
        // As concentrated as it arrives, and as what it meets is before it is diluted.
        let arriving = before.and_then(|b| b.source.get(&s)).unwrap_or(entry);
        for o in others.iter().filter(|o| **o != s) {
            let met = before.and_then(|b| b.target.get(o)).or_else(|| world.held(m).get(o));
            let Some(met) = met else { continue };
            let (a, b): (Presence, Presence) = ((s, arriving.content), (*o, met.content));
            let Some(found) = tables.screen.pair(&tables.species, a, b) else { continue };
            if tables.screen.is_allowed(&tables.species, s, *o) {
                continue;
            }
            let library = |module: usize| tables.names.modules[module].is_library();
            let mild = found.pair.severity() == Severity::Warning;
            match intended(&tables.reactions, library, &tables.species, s, *o) {
                Intended::Directly => continue,
                Intended::ByIons if mild => continue,
                _ => {}
            }
            let place = match before {
                Some(_) => self.place(),
                None => entry.came.last().map_or(self.place(), |c| c.span),
            };
            let pair = (m, s.min(*o), s.max(*o));
            let certain = arriving.certain && met.certain && !met.residue;
            self.certain.extend(certain.then_some(pair));
            if self.orders.is_none() && !self.seen.insert((place, s.min(*o), s.max(*o))) {
                continue;
            }
            let meeting = Meeting { m, a: (s, entry), b: (*o, met), certain, place };
            let diagnostic = self.incompatible(world, &meeting, &found);
            let grave = found.pair.severity();
            match &mut self.orders {
                Some(orders) => orders.add(Coming { pair, place, diagnostic, certain, grave }),
                None => {
                    let consequences = found.pair.consequences.clone();
                    self.pending.push(Pending { consequences, diagnostic, pair, place });
                }
            }
        }
    }

    /// Reports the gravest of what one event brings together: the others are mended with it.
    pub(super) fn settle(&mut self) {
        let pending = std::mem::take(&mut self.pending);
        for p in &pending {
            let told = self.pairs.entry(p.pair).or_insert(p.diagnostic.severity);
            *told = (*told).min(p.diagnostic.severity);
        }
        let rank = |p: &Pending| (p.diagnostic.severity, p.consequences.clone());
        if let Some(gravest) = pending.into_iter().min_by_key(rank) {
            self.told.push((gravest.pair, gravest.place, self.found.len()));
            self.found.push(gravest.diagnostic);
        }
    }

    fn incompatible(&self, world: &MixtureState, meeting: &Meeting<'_>, found: &Match<'_>) -> Diagnostic {
        let Meeting { m, a, b, certain, place } = *meeting;
        let (x, y) = (self.species(a.0), self.species(b.0));
        let vessel = self.vessel(m);
        let meets = if certain { "come together" } else { "may come together" };
        let headline = format!("`{x}` and `{y}` {meets} in `{vessel}`: {}", found.pair.words());
        let label = match b.1.residue {
            true => format!("`{x}` meets traces of `{y}`"),
            false => format!("`{x}` meets `{y}` here"),
        };
        let mut d = Diagnostic::error(codes::INCOMPATIBLE_MIX, place, headline, label);
        if !certain || found.pair.severity() == Severity::Warning {
            d.severity = Severity::Warning;
        }
        for (name, entry) in [(&x, a.1), (&y, b.1)] {
            d = self.history(d, name, entry, place);
        }
        let tables = self.eyes.lab.tables;
        let title = |party: Party| tables.screen.title(party);
        let (of_x, of_y) = (title(found.a), title(found.b));
        let belongs = |name: &str, title: &str| format!("`{name}` is one of the {title}");
        let why = match (of_x, of_y) {
            (Some(p), Some(q)) => format!("{}, {}", belongs(&x, p), belongs(&y, q)),
            (Some(p), None) => belongs(&x, p),
            (None, Some(q)) => belongs(&y, q),
            (None, None) => "this pair is published as incompatible".to_string(),
        };
        d = d.help(format!("{why} ({})", found.pair.source));
        let unknown: Vec<String> = world
            .present(m)
            .filter(|(p, _)| tables.screen.is_unknown(&tables.species, p.0))
            .map(|(p, _)| format!("`{}`", self.species(p.0)))
            .collect();
        if !unknown.is_empty() {
            d = d.help(format!(
                "the screen has no structure or group for {}, so it cannot judge them",
                unknown.join(", ")
            ));
        }
        d.help(format!("if this is intended, write `allow incompatible {x} with {y} \"why\"`")).help(SCREEN)
    }

    /// Judges what a species does to the wall around it.
    pub(super) fn touch(&mut self, world: &MixtureState, m: InstanceId, s: SpeciesId, before: Option<&Before>) {
        let Some(&material) = self.materials.get(&m) else { return };
        let tables = self.eyes.lab.tables;
        let Some(entry) = world.held(m).get(&s) else { return };
        let Some(found) = tables.screen.material(&tables.species, material, (s, entry.content)) else { return };
        let place = match before {
            Some(_) => self.place(),
            None => entry.came.last().map_or(self.place(), |c| c.span),
        };
        // The wells that one step fills are one mistake.
        let known = !self.walls.insert((m, s)) || !self.at_walls.insert((place, material, s));
        if known || tables.screen.is_allowed_in(&tables.species, material, s) {
            return;
        }
        let wall = tables.screen.title(Party::Material(material)).unwrap_or("something else");
        let (name, vessel) = (self.species(s), self.vessel(m));
        let headline = format!("`{name}` attacks `{vessel}`, which is made of {wall}: {}", found.pair.words());
        let mut d =
            Diagnostic::error(codes::MATERIAL_ATTACKED, place, headline, format!("`{name}` reaches the wall here"));
        if !entry.certain || found.pair.severity() == Severity::Warning {
            d.severity = Severity::Warning;
        }
        d = self.history(d, &name, entry, place);
        let belongs = match tables.screen.title(found.b) {
            Some(title) => format!("`{name}` is one of the {title}, which attack {wall}"),
            None => format!("`{name}` attacks {wall}"),
        };
        let d =
            d.help(format!("{belongs} ({})", found.pair.source)).help("use a vessel of another material").help(SCREEN);
        match &mut self.orders {
            Some(orders) => {
                orders.add(Coming { pair: (m, s, s), place, grave: d.severity, diagnostic: d, certain: false });
            }
            None => self.found.push(d),
        }
    }

    fn history(&self, mut d: Diagnostic, name: &str, entry: &Entry, place: Span) -> Diagnostic {
        for (i, came) in entry.came.iter().enumerate() {
            // One step may bring it into a tip and out of it again.
            let passes = entry.came.get(i + 1).is_some_and(|next| next.span == came.span);
            if came.span == place || passes {
                continue;
            }
            let vessel = self.vessel(came.into);
            let text = match i {
                0 => format!("`{vessel}` holds `{name}`"),
                _ => format!("brings `{name}` into `{vessel}`"),
            };
            d = d.because(came.span, text);
        }
        d
    }

    fn species(&self, s: SpeciesId) -> String {
        self.eyes.lab.tables.species.get(s).name.clone()
    }

    fn vessel(&self, m: InstanceId) -> String {
        let lab = self.eyes.lab;
        let of = |i: InstanceId| &lab.instances[i.0 as usize];
        of(of(m).owner.unwrap_or(m)).name.clone()
    }
}
