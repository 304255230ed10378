//! How much each well must hold at the start, so that what is aspirated is there.

use std::collections::BTreeMap;

/// A well by labware and name.
pub(super) type Name = (String, String);

/// By well, a volume in uL.
pub(super) type Holdings = BTreeMap<Name, f64>;

/// What wells hold at the start: volume in uL, and what of.
pub(super) type Holding = BTreeMap<Name, (f64, String)>;

/// What a tip at a height finds in a well, uL.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reach {
    /// What the well holds up to that height.
    pub(super) below: f64,
    /// What the tip leaves there however much it draws.
    pub(super) left: f64,
}

/// A well, uL.
#[derive(Clone, Copy, Debug, Default)]
struct Well {
    /// What came in less what went out.
    net: f64,
    /// The least that it ever was.
    least: f64,
    /// The most that it ever was.
    most: f64,
    /// The least that it was before that.
    before: f64,
    /// What must be there at the start so that tips reached the liquid.
    wet: f64,
    /// Whether something left it before anything came: it is a source, and was not filled on the way.
    is_source: bool,
}

/// The tips of a pipette, uL: their pistons move together, but wells may hold less for some of them than for others.
#[derive(Clone, Debug, Default)]
struct Tips {
    /// What the pistons have taken up: liquid, and air.
    drawn: f64,
    each: Vec<Tip>,
}

/// What a tip holds, uL.
#[derive(Clone, Copy, Debug, Default)]
struct Tip {
    liquid: f64,
    /// Air at the end, which comes out first.
    air: f64,
    /// Air behind the liquid, which comes out last.
    behind: f64,
}

impl Tips {
    /// At least so many.
    fn widen(&mut self, channels: usize) {
        // A tip that comes to work later has drawn air until then.
        let new = Tip { air: self.drawn, ..Tip::default() };
        self.each.resize(channels.max(self.each.len()), new);
    }
}

/// What is in wells, beyond what was there at the start, and in tips.
#[derive(Debug, Default)]
pub(super) struct Liquids {
    /// What wells hold at the start, where that is known, uL.
    initial: Option<Holdings>,
    wells: BTreeMap<Name, Well>,
    /// By pipette: what its tips hold.
    tips: BTreeMap<String, Tips>,
}

impl Liquids {
    /// Wells that hold so much at the start, uL.
    pub(super) fn with(initial: Holdings) -> Liquids {
        Liquids { initial: Some(initial), ..Liquids::default() }
    }

    /// The tips of a pipette hold nothing.
    pub(super) fn empty(&mut self, pipette: &str) {
        self.tips.remove(pipette);
    }

    /// Whether the tips of a pipette hold any liquid.
    pub(super) fn is_wet(&self, pipette: &str) -> bool {
        self.tips.get(pipette).is_some_and(|tips| tips.each.iter().any(|tip| tip.liquid > 0.0))
    }

    /// Each tip aspirates so much, as far as it reaches; whether the wells hold less.
    pub(super) fn aspirate(
        &mut self,
        pipette: &str,
        volume: f64,
        (channels, reach): (usize, Reach),
        labware: &str,
        wells: &[String],
    ) -> bool {
        let share = wells.len() as f64 / channels as f64;
        let each = volume / share;
        let (mut taken, mut lacks) = (Vec::new(), false);
        for well in wells {
            let name = (labware.to_owned(), well.clone());
            let initial = self.initial.as_ref().map(|initial| initial.get(&name).copied().unwrap_or(0.0));
            let is_new = !self.wells.contains_key(&name);
            let well = self.wells.entry(name).or_default();
            well.is_source |= is_new;
            well.wet = well.wet.max(reach.below - well.net).max(reach.left + each - well.net);
            // What rounding left counts as there.
            let there = initial.map_or(f64::INFINITY, |initial| (initial + well.net) * (1.0 + 1e-9));
            lacks |= there < each;
            let here = each.min((there - reach.left).max(0.0));
            taken.push(here);
            well.net -= here;
            well.least = well.least.min(well.net);
        }
        let tips = self.tips.entry(pipette.to_owned()).or_default();
        tips.widen(channels);
        for (channel, tip) in tips.each.iter_mut().enumerate() {
            let works = channel < channels;
            let taken = taken.get(of(channel, wells)).filter(|_| works).map_or(0.0, |taken| taken * share);
            tip.behind += tip.air;
            tip.air = (volume - taken).max(0.0);
            tip.liquid += taken;
        }
        tips.drawn += volume;
        lacks
    }

    /// Each tip aspirates so much air.
    pub(super) fn air(&mut self, pipette: &str, volume: f64) {
        let tips = self.tips.entry(pipette.to_owned()).or_default();
        tips.drawn += volume;
        tips.each.iter_mut().for_each(|tip| tip.air += volume);
    }

    /// Each tip dispenses so much: the air at its end first, then the same share of all that it holds, as `dispense` of the library does.
    pub(super) fn dispense(&mut self, pipette: &str, volume: f64, labware: &str, wells: &[String]) {
        let tips = self.tips.entry(pipette.to_owned()).or_default();
        let drawn = tips.drawn;
        let give = |tip: &mut Tip| {
            let (stroke, whole) = ((volume - tip.air).max(0.0), drawn - tip.air - tip.behind);
            let share = if stroke * (1.0 + 1e-9) >= whole { 1.0 } else { stroke / whole };
            let given = tip.liquid * share;
            tip.liquid -= given;
            tip.behind = tip.behind.min((drawn - volume - (tip.air - volume).max(0.0)).max(0.0));
            tip.air = (tip.air - volume).max(0.0);
            given
        };
        let given: Vec<f64> = tips.each.iter_mut().map(give).collect();
        tips.drawn = (drawn - volume).max(0.0);
        self.fill(labware, wells, &given);
    }

    /// Each tip gives off what it holds.
    pub(super) fn blow_out(&mut self, pipette: &str, labware: &str, wells: &[String]) {
        let tips = self.tips.remove(pipette).unwrap_or_default();
        let given: Vec<f64> = tips.each.iter().map(|tip| tip.liquid).collect();
        self.fill(labware, wells, &given);
    }

    fn fill(&mut self, labware: &str, wells: &[String], given: &[f64]) {
        for (channel, volume) in given.iter().enumerate() {
            let Some(well) = wells.get(of(channel, wells)) else { continue };
            let well = self.wells.entry((labware.to_owned(), well.clone())).or_default();
            well.net += volume;
            if well.net > well.most {
                (well.most, well.before) = (well.net, well.least);
            }
        }
    }

    /// What sources must hold at the start, uL, by labware and well: what leaves them, and, rounded up, what tips must reach. Less than that
    /// where what comes would not find room: tips take air for the rest then.
    pub(super) fn needed(&self, capacity: impl Fn(&Name) -> f64) -> Holdings {
        let needed = |name: &Name, well: &Well| {
            let room = capacity(name) - well.most;
            well.wet.ceil().max(-well.least).min(room).max(-well.before)
        };
        let is_short = |well: &Well| well.is_source && -well.least > 1e-9;
        let short = self.wells.iter().filter(|(_, well)| is_short(well));
        short.map(|(name, well)| (name.clone(), needed(name, well))).collect()
    }
}

/// Which of some wells a channel works in: its own, or the only one.
fn of(channel: usize, wells: &[String]) -> usize {
    if wells.len() == 1 { 0 } else { channel }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn well(name: &str) -> Vec<String> {
        vec![name.to_owned()]
    }

    /// Up to a height the well holds so much, and all of it can be taken from there.
    fn at(below: f64) -> Reach {
        Reach { below, left: 0.0 }
    }

    #[test]
    fn a_source_must_hold_what_leaves_it() {
        let mut liquids = Liquids::default();
        liquids.aspirate("p", 50.0, (1, at(10.0)), "plate", &well("A1"));
        liquids.air("p", 10.0);
        liquids.dispense("p", 60.0, "plate", &well("B1"));
        // More than there is: the rest is air.
        liquids.aspirate("p", 70.0, (1, at(75.5)), "plate", &well("B1"));
        liquids.aspirate("p", 1.0, (1, at(75.5)), "plate", &well("C1"));
        let needed = |capacity: f64| -> Vec<(String, f64)> {
            liquids.needed(|_| capacity).into_iter().map(|((_, well), v)| (well, v)).collect()
        };
        assert_eq!(needed(200.0), [("A1".to_owned(), 50.0), ("C1".to_owned(), 76.0)]);
        // What tips must reach leaves room for what comes: 71 uL, where 1 uL went.
        liquids.blow_out("p", "plate", &well("C1"));
        let needed: Vec<f64> = liquids.needed(|_| 100.0).into_values().collect();
        assert_eq!(needed, [50.0, 30.0]);
        // No more room than that, even if all of it leaves in the end.
        liquids.aspirate("p", 130.0, (1, at(0.0)), "plate", &well("C1"));
        let needed: Vec<f64> = liquids.needed(|_| 100.0).into_values().collect();
        assert_eq!(needed, [50.0, 30.0]);
    }

    #[test]
    fn what_lacks_is_air() {
        let initial = BTreeMap::from([(("plate".to_owned(), "A1".to_owned()), 100.0)]);
        let mut liquids = Liquids::with(initial);
        assert!(!liquids.aspirate("p", 60.0, (1, at(0.0)), "plate", &well("A1")));
        assert!(liquids.aspirate("p", 60.0, (1, at(0.0)), "plate", &well("A1")));
        liquids.dispense("p", 120.0, "plate", &well("B1"));
        assert!(!liquids.aspirate("p", 100.0, (1, at(0.0)), "plate", &well("B1")));
    }

    #[test]
    fn each_channel_has_what_its_own_well_gave() {
        let initial = [("A1", 5.0), ("B1", 50.0)].map(|(well, volume)| (("plate".to_owned(), well.to_owned()), volume));
        let mut liquids = Liquids::with(BTreeMap::from(initial));
        let column = ["A1", "B1"].map(str::to_owned);
        for _ in 0..3 {
            // Mixed in place, the first well never holds more than its own.
            assert!(liquids.aspirate("p", 20.0, (2, at(0.0)), "plate", &column));
            liquids.dispense("p", 20.0, "plate", &column);
        }
        assert!(!liquids.aspirate("p", 5.0, (2, at(0.0)), "plate", &column));
    }

    #[test]
    fn what_is_not_reached_is_air() {
        let initial = BTreeMap::from([(("plate".to_owned(), "A1".to_owned()), 100.0)]);
        let mut liquids = Liquids::with(initial);
        // 40 uL and 20 uL of air, which comes out first.
        let high = Reach { below: 80.0, left: 60.0 };
        assert!(!liquids.aspirate("p", 60.0, (1, high), "plate", &well("A1")));
        liquids.dispense("p", 30.0, "plate", &well("B1"));
        assert!(liquids.aspirate("p", 11.0, (1, at(0.0)), "plate", &well("B1")));
        let mut liquids = Liquids::default();
        liquids.aspirate("p", 60.0, (1, high), "plate", &well("A1"));
        let needed: Vec<f64> = liquids.needed(|_| 1000.0).into_values().collect();
        assert_eq!(needed, [120.0]);
    }

    #[test]
    fn channels_share_a_trough() {
        let mut liquids = Liquids::default();
        liquids.aspirate("p", 10.0, (8, at(0.0)), "trough", &well("A1"));
        liquids.dispense("p", 10.0, "waste", &well("A1"));
        let needed: Vec<f64> = liquids.needed(|_| 1000.0).into_values().collect();
        assert_eq!(needed, [80.0]);
        assert_eq!(liquids.wells[&("waste".to_owned(), "A1".to_owned())].net, 80.0);
    }
}
