//! How much each well must hold at the start, so that what is aspirated is there.

use std::collections::BTreeMap;

/// What is in wells, beyond what was there at the start, and in tips.
#[derive(Debug, Default)]
pub(super) struct Liquids {
    /// By labware and well: what came in less what went out, and the least that it ever was, uL.
    wells: BTreeMap<(String, String), (f64, f64)>,
    /// By pipette: liquid and air in each tip, uL.
    tips: BTreeMap<String, (f64, f64)>,
}

impl Liquids {
    /// The tips of a pipette hold nothing.
    pub(super) fn empty(&mut self, pipette: &str) {
        self.tips.remove(pipette);
    }

    /// Each tip aspirates so much.
    pub(super) fn aspirate(&mut self, pipette: &str, volume: f64, channels: usize, labware: &str, wells: &[String]) {
        self.tips.entry(pipette.to_owned()).or_default().0 += volume;
        self.add(labware, wells, -volume * channels as f64);
    }

    /// Each tip aspirates so much air.
    pub(super) fn air(&mut self, pipette: &str, volume: f64) {
        self.tips.entry(pipette.to_owned()).or_default().1 += volume;
    }

    /// Each tip dispenses so much: its air first.
    pub(super) fn dispense(&mut self, pipette: &str, volume: f64, channels: usize, labware: &str, wells: &[String]) {
        let (liquid, air) = self.tips.entry(pipette.to_owned()).or_default();
        let blown = volume.min(*air);
        *air -= blown;
        let given = (volume - blown).min(*liquid);
        *liquid -= given;
        self.add(labware, wells, given * channels as f64);
    }

    /// Each tip gives off what it holds.
    pub(super) fn blow_out(&mut self, pipette: &str, channels: usize, labware: &str, wells: &[String]) {
        let (liquid, _) = self.tips.remove(pipette).unwrap_or_default();
        self.add(labware, wells, liquid * channels as f64);
    }

    fn add(&mut self, labware: &str, wells: &[String], volume: f64) {
        for well in wells {
            let (net, least) = self.wells.entry((labware.to_owned(), well.clone())).or_default();
            *net += volume / wells.len() as f64;
            *least = least.min(*net);
        }
    }

    /// What wells must hold at the start, uL, by labware and well.
    pub(super) fn needed(&self) -> impl Iterator<Item = (&(String, String), f64)> {
        self.wells.iter().map(|(well, (_, least))| (well, -least)).filter(|(_, needed)| *needed > 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_well_must_hold_what_leaves_before_something_comes() {
        let mut liquids = Liquids::default();
        let well = |name: &str| vec![name.to_owned()];
        liquids.aspirate("p", 50.0, 1, "plate", &well("A1"));
        liquids.air("p", 10.0);
        liquids.dispense("p", 60.0, 1, "plate", &well("B1"));
        liquids.aspirate("p", 70.0, 1, "plate", &well("B1"));
        liquids.blow_out("p", 1, "plate", &well("A1"));
        let needed: Vec<(String, f64)> = liquids.needed().map(|((_, well), v)| (well.clone(), v)).collect();
        assert_eq!(needed, [("A1".to_owned(), 50.0), ("B1".to_owned(), 20.0)]);
    }
}
