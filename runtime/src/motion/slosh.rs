//! Liquids in open vessels that are moved: how far the level is from straight across the vessel, and what runs over the rim.
//!
//! A liquid stands across the pull that it feels, of gravity and of the motion, and follows that as its first wave does: one that goes to and
//! fro at `w`, `w^2 = 1.841 g/r tanh(1.841 h/r)` for a round vessel of radius `r` filled `h` high (Abramson, The Dynamic Behavior of Liquids in Moving
//! Containers, NASA SP-106, 1966, chapter 2), hardly damped (chapter 4). What is then above the level of the rim's lowest point is lost. A plane that tilts
//! as that wave does reaches a fifth higher at the wall than the wave, which is to the safe side.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use matterix_ir::math::{exp, sin_cos};
use matterix_ir::scene::{InstanceId, Shape};
use matterix_ir::tilting::table;

/// Standard gravity, m/s2.
pub(super) const GRAVITY: f64 = 9.806_65;
/// The first zero of the derivative of Bessel's function J1, by which the first wave in a round vessel goes.
const FIRST_WAVE: f64 = 1.841_183_781_340_659;
/// Damping of the first wave as a share of the critical one: about that of water in a smooth vessel of some centimetres.
const DAMPING: f64 = 0.01;
/// What counts as little, as a share of what fills the vessel: a film that is no liquid with waves, or the last drops of what pours.
const LITTLE: f64 = 2e-3;
/// What may stand above the rim without running out, as a share of what fills the vessel: the error of the table.
const SLACK: f64 = 1e-3;

/// Tilt of a vessel and what stays in it at that, rad and m3.
type Tilts = Arc<[[f64; 2]]>;

/// The tables of vessels, made once for all motions. Copies share them.
#[derive(Clone, Debug, Default)]
pub(super) struct Tables(Arc<Mutex<BTreeMap<InstanceId, Tilts>>>);

impl Tables {
    /// That of a vessel with this inside.
    pub(super) fn of(&self, vessel: InstanceId, inside: &[[f64; 2]]) -> Tilts {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.entry(vessel).or_insert_with(|| table(inside).into()).clone()
    }
}

/// A vessel with what is in it.
pub(super) struct Filled {
    tilts: Tilts,
    /// What is in it, m3.
    volume: f64,
    /// The frequency of its first wave, 1/s.
    pub(super) frequency: f64,
    /// How high its surface is above its base, m.
    pub(super) surface: f64,
}

impl Filled {
    /// Nothing where its inside is not known, or hardly anything is in it.
    pub(super) fn of(shape: &Shape, volume: f64, table: impl FnOnce(&[[f64; 2]]) -> Tilts) -> Option<Self> {
        let Shape::Turned { inside, .. } = shape else { return None };
        let (surface, radius) = level(inside, volume)?;
        let depth = surface - inside.first()?[1];
        let steep = 2.0 * FIRST_WAVE * depth / radius;
        let tanh = 1.0 - 2.0 / (exp(steep.min(700.0)) + 1.0);
        let tilts = table(inside);
        let frequency = (FIRST_WAVE * GRAVITY / radius * tanh).sqrt();
        let filled = Filled { tilts, volume, frequency, surface };
        Some(filled).filter(|filled| filled.volume > filled.little())
    }

    /// A volume that does not count, m3.
    fn little(&self) -> f64 {
        LITTLE * self.tilts.first().map_or(0.0, |p| p[1])
    }

    /// How far it tilts before anything runs out, rad.
    pub(super) fn brink(&self) -> f64 {
        let full = self.tilts.first().map_or(0.0, |p| p[1]);
        let volume = self.volume - SLACK * full;
        let above = self.tilts.partition_point(|p| p[1] >= volume);
        match (self.tilts.get(above.wrapping_sub(1)), self.tilts.get(above)) {
            (Some([a, v]), Some([b, w])) => a + (b - a) * (v - volume) / (v - w),
            (Some([a, _]), None) => *a,
            _ => 0.0,
        }
    }

    /// How much runs out at a tilt, m3.
    pub(super) fn lost(&self, tilt: f64) -> f64 {
        let full = self.tilts.first().map_or(0.0, |p| p[1]);
        let above = self.tilts.partition_point(|p| p[0] <= tilt);
        let stays = match (self.tilts.get(above.wrapping_sub(1)), self.tilts.get(above)) {
            (Some([a, v]), Some([b, w])) => v + (w - v) * (tilt - a) / (b - a),
            (Some([_, v]), None) => *v,
            _ => full,
        };
        (self.volume - stays - SLACK * full).max(0.0)
    }
}

/// How high a volume stands in a vessel, and how wide it is there: m. Nothing where none is in it.
fn level(inside: &[[f64; 2]], volume: f64) -> Option<(f64, f64)> {
    if volume <= 0.0 {
        return None;
    }
    let mut left = volume;
    for pair in inside.windows(2) {
        let ([r, z], [s, top]) = (pair[0], pair[1]);
        // A frustum up to a share of its height.
        let up_to = |share: f64| {
            let at = r + (s - r) * share;
            PI * (top - z) * share * (r * r + r * at + at * at) / 3.0
        };
        if up_to(1.0) >= left {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if up_to(middle) < left { low = middle } else { high = middle }
            }
            let at = r + (s - r) * high;
            return (at > 0.0).then_some((z + (top - z) * high, at));
        }
        left -= up_to(1.0);
    }
    let [radius, top] = *inside.last()?;
    Some((top, radius))
}

/// The wave in a vessel: the pull, m/s2 along x and y of the lab, across which the level stands, and how that changes, m/s3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wave {
    pub(super) pull: [f64; 2],
    rate: [f64; 2],
}

impl Wave {
    /// Follows the pull that is felt for a time, s; exact where that stays as it is.
    pub(super) fn follow(&mut self, felt: [f64; 2], frequency: f64, dt: f64) {
        let swings = frequency * (1.0 - DAMPING * DAMPING).sqrt();
        let (sin, cos) = sin_cos(swings * dt);
        let fades = exp(-DAMPING * frequency * dt);
        for ((pull, rate), felt) in self.pull.iter_mut().zip(&mut self.rate).zip(felt) {
            let off = *pull - felt;
            let slope = (*rate + DAMPING * frequency * off) / swings;
            let (now, turned) = (off * cos + slope * sin, slope * cos - off * sin);
            *pull = felt + fades * now;
            *rate = fades * (swings * turned - DAMPING * frequency * now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beaker() -> Shape {
        let (outside, inside) = (vec![], vec![[0.0, 0.002], [0.0332, 0.002], [0.0332, 0.095]]);
        Shape::Turned { outside, inside }
    }

    #[test]
    fn water_in_a_beaker_goes_to_and_fro_as_is_known() {
        // 200 mL stand 57.8 mm high: sqrt(1.8412 * 9.80665 / 0.0332) = 23.32 1/s, times sqrt(tanh(3.20)) = 0.9983.
        let filled = Filled::of(&beaker(), 200e-6, |inside| table(inside).into()).expect("water");
        assert!((filled.surface - 0.0598).abs() < 1e-4, "{}", filled.surface);
        assert!((filled.frequency - 23.28).abs() < 0.02, "{}", filled.frequency);
        assert_eq!(level(&[[0.0, 0.0], [0.03, 0.0], [0.03, 0.1]], 0.0), None);
    }

    #[test]
    fn a_push_that_lasts_tilts_the_surface_by_its_share_of_gravity_and_overshoots_once() {
        let mut wave = Wave::default();
        let mut most: f64 = 0.0;
        for _ in 0..40_000 {
            wave.follow([2.0, 0.0], 23.0, 1e-3);
            most = most.max(wave.pull[0]);
        }
        let pull = wave.pull;
        // The first swing of an oscillator with 1 % of damping goes 1 + exp(-pi zeta) as far.
        assert!((most / 2.0 - (1.0 + exp(-PI * DAMPING))).abs() < 1e-3, "{most}");
        assert!((pull[0] - 2.0).abs() < 0.05 && pull[1] == 0.0);
    }

    #[test]
    fn what_stays_below_the_rim_is_not_lost() {
        let filled = Filled::of(&beaker(), 200e-6, |inside| table(inside).into()).expect("water");
        // 200 of 322 mL: the surface reaches the lip at arctan(35.2 / 33.2) = 46.7 deg.
        assert_eq!(filled.lost(46.0_f64.to_radians()), 0.0);
        assert!(filled.lost(filled.brink()) < 1e-12 && filled.lost(filled.brink() + 0.01) > 0.0);
        assert!(filled.lost(49.0_f64.to_radians()) > 5e-6);
    }
}
