//! How much each well must hold at the start, so that what is aspirated is there.

use std::collections::BTreeMap;

/// A well by labware and name.
pub(super) type Name = (String, String);

/// What wells hold at the start: volume in uL, and what of.
pub(super) type Holding = BTreeMap<Name, (f64, String)>;

/// A well, uL.
#[derive(Clone, Copy, Debug, Default)]
struct Well {
    /// What came in less what went out.
    net: f64,
    /// The least that it ever was.
    least: f64,
    /// What must be there at the start so that tips reached the liquid.
    wet: f64,
    /// Whether something left it before anything came: it is a source, and was not filled on the way.
    is_source: bool,
}

/// A tip, uL.
#[derive(Clone, Copy, Debug, Default)]
struct Tip {
    liquid: f64,
    /// What the piston has taken up: liquid, and air.
    drawn: f64,
    /// Air at the end, which comes out first.
    air: f64,
}

/// What is in wells, beyond what was there at the start, and in tips.
#[derive(Debug, Default)]
pub(super) struct Liquids {
    /// What wells hold at the start, where that is known, uL.
    initial: Option<BTreeMap<Name, f64>>,
    wells: BTreeMap<Name, Well>,
    /// By pipette: what each of its tips holds.
    tips: BTreeMap<String, Tip>,
}

impl Liquids {
    /// Wells that hold so much at the start, uL.
    pub(super) fn with(initial: BTreeMap<Name, f64>) -> Liquids {
        Liquids { initial: Some(initial), ..Liquids::default() }
    }

    /// The tips of a pipette hold nothing.
    pub(super) fn empty(&mut self, pipette: &str) {
        self.tips.remove(pipette);
    }

    /// Whether the tips of a pipette hold any liquid.
    pub(super) fn is_wet(&self, pipette: &str) -> bool {
        self.tips.get(pipette).is_some_and(|tip| tip.liquid > 0.0)
    }

    /// Each tip aspirates so much, at a height up to which a well holds `below`; whether the wells hold less.
    pub(super) fn aspirate(
        &mut self,
        pipette: &str,
        volume: f64,
        (channels, below): (usize, f64),
        labware: &str,
        wells: &[String],
    ) -> bool {
        let each = volume * channels as f64 / wells.len().max(1) as f64;
        let (mut taken, mut lacks) = (0.0_f64, false);
        for well in wells {
            let name = (labware.to_owned(), well.clone());
            let initial = self.initial.as_ref().map(|initial| initial.get(&name).copied().unwrap_or(0.0));
            let is_new = !self.wells.contains_key(&name);
            let well = self.wells.entry(name).or_default();
            well.is_source |= is_new;
            well.wet = well.wet.max(below - well.net);
            // What rounding left counts as there.
            let there = initial.map_or(each, |initial| (initial + well.net) * (1.0 + 1e-9));
            let here = each.min(there.max(0.0));
            lacks |= here < each;
            taken = taken.max(here);
            well.net -= here;
            well.least = well.least.min(well.net);
        }
        let tip = self.tips.entry(pipette.to_owned()).or_default();
        tip.liquid += taken * wells.len() as f64 / channels as f64;
        tip.drawn += volume;
        tip.air = 0.0;
        lacks
    }

    /// Each tip aspirates so much air.
    pub(super) fn air(&mut self, pipette: &str, volume: f64) {
        let tip = self.tips.entry(pipette.to_owned()).or_default();
        tip.drawn += volume;
        tip.air += volume;
    }

    /// Each tip dispenses so much: the air at its end first, then the same share of all that it holds, as `dispense` of the library does.
    pub(super) fn dispense(&mut self, pipette: &str, volume: f64, channels: usize, labware: &str, wells: &[String]) {
        let tip = self.tips.entry(pipette.to_owned()).or_default();
        let (stroke, whole) = ((volume - tip.air).max(0.0), tip.drawn - tip.air);
        let given = if stroke * (1.0 + 1e-9) >= whole { tip.liquid } else { tip.liquid * stroke / whole };
        tip.liquid -= given;
        tip.drawn = (tip.drawn - volume).max(0.0);
        tip.air = (tip.air - volume).max(0.0);
        self.fill(labware, wells, given * channels as f64);
    }

    /// Each tip gives off what it holds.
    pub(super) fn blow_out(&mut self, pipette: &str, channels: usize, labware: &str, wells: &[String]) {
        let tip = self.tips.remove(pipette).unwrap_or_default();
        self.fill(labware, wells, tip.liquid * channels as f64);
    }

    fn fill(&mut self, labware: &str, wells: &[String], volume: f64) {
        for well in wells {
            let well = self.wells.entry((labware.to_owned(), well.clone())).or_default();
            well.net += volume / wells.len() as f64;
        }
    }

    /// What sources must hold at the start, uL, by labware and well: what leaves them, and, rounded up, what tips must reach.
    pub(super) fn needed(&self) -> impl Iterator<Item = (&Name, f64)> {
        let needed = |well: &Well| if well.wet > -well.least { well.wet.ceil() } else { -well.least };
        let is_short = |well: &Well| well.is_source && -well.least > 1e-9;
        self.wells.iter().filter(move |(_, well)| is_short(well)).map(move |(name, well)| (name, needed(well)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn well(name: &str) -> Vec<String> {
        vec![name.to_owned()]
    }

    #[test]
    fn a_source_must_hold_what_leaves_it() {
        let mut liquids = Liquids::default();
        liquids.aspirate("p", 50.0, (1, 10.0), "plate", &well("A1"));
        liquids.air("p", 10.0);
        liquids.dispense("p", 60.0, 1, "plate", &well("B1"));
        // More than there is: the rest is air.
        liquids.aspirate("p", 70.0, (1, 75.5), "plate", &well("B1"));
        liquids.aspirate("p", 1.0, (1, 75.5), "plate", &well("C1"));
        let needed: Vec<(String, f64)> = liquids.needed().map(|((_, well), v)| (well.clone(), v)).collect();
        assert_eq!(needed, [("A1".to_owned(), 50.0), ("C1".to_owned(), 76.0)]);
    }

    #[test]
    fn what_lacks_is_air() {
        let initial = BTreeMap::from([(("plate".to_owned(), "A1".to_owned()), 100.0)]);
        let mut liquids = Liquids::with(initial);
        assert!(!liquids.aspirate("p", 60.0, (1, 0.0), "plate", &well("A1")));
        assert!(liquids.aspirate("p", 60.0, (1, 0.0), "plate", &well("A1")));
        liquids.dispense("p", 120.0, 1, "plate", &well("B1"));
        assert!(!liquids.aspirate("p", 100.0, (1, 0.0), "plate", &well("B1")));
    }
}
