//! Systems of equilibria of any size, and mixtures to be solved.

use matterix_ir::equilibrium::{Layout, System};

use super::sketch::Sketch;

/// Water in a kilogram, mol.
pub const WATER: f64 = 55.508;

/// Numbers that look random and are the same every time (xorshift).
pub struct Draw(u64);

impl Draw {
    pub fn new(seed: u64) -> Draw {
        Draw(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.share() * (high - low)
    }
}

/// Carbon dioxide in water.
pub fn carbonate() -> Sketch {
    Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
        .equation("-1 CO2 -1 water 1 H+ 1 HCO3-", -6.352, 9.1)
        .equation("-1 HCO3- 1 H+ 1 CO3--", -10.329, 14.9)
}

/// With acids, ammonia, silver and lime, and three solids.
pub fn bench() -> Sketch {
    carbonate()
        .equation("-1 HAc 1 H+ 1 Ac-", -4.756, -0.4)
        .equation("-1 H3PO4 1 H+ 1 H2PO4-", -2.168, -8.8)
        .equation("-1 H2PO4- 1 H+ 1 HPO4--", -7.207, 4.1)
        .equation("-1 HPO4-- 1 H+ 1 PO4---", -12.346, 14.8)
        .equation("-1 NH4+ 1 H+ 1 NH3", -9.244, 52.2)
        .equation("-1 Ag+ -2 NH3 1 Ag(NH3)2+", 7.22, -56.0)
        .equation("-1 AgCl(s) 1 Ag+ 1 Cl-", -9.75, 65.5)
        .equation("-1 CaCO3(s) 1 Ca++ 1 CO3--", -8.48, -13.2)
        .equation("-1 Ca(OH)2(s) 1 Ca++ 2 OH-", -5.2, -18.0)
}

/// Acids of two steps and metals that they bind, until there are so many species or just more; constants as they are common.
pub fn of_size(species: usize) -> Sketch {
    let mut draw = Draw::new(species as u64);
    let mut made = Sketch::new().equation("-1 water 1 H+ 1 OH-", -13.995, 55.8);
    let mut pairs = 0;
    while made.written.members.len() < species {
        let (acid, metal) = (format!("L{pairs}"), format!("M{pairs}++"));
        let first = draw.between(2.0, 6.0);
        made = made.equation(&format!("-1 H2{acid} 1 H+ 1 H{acid}-"), -first, draw.between(-10.0, 10.0));
        let second = first + draw.between(2.0, 5.0);
        made = made.equation(&format!("-1 H{acid}- 1 H+ 1 {acid}--"), -second, draw.between(-10.0, 20.0));
        made = made.equation(&format!("-1 {metal} -1 water 1 M{pairs}OH+ 1 H+"), -draw.between(7.0, 12.0), 40.0);
        made = made.equation(&format!("-1 {metal} -1 {acid}-- 1 {metal}:{acid}"), draw.between(2.0, 6.0), 10.0);
        if pairs > 0 {
            let text = format!("-1 {metal} -1 L{0}-- 1 {metal}:L{0}", pairs - 1);
            made = made.equation(&text, draw.between(2.0, 6.0), 5.0);
        }
        pairs += 1;
    }
    made
}

/// The system, and arguments with nothing in a kilogram of water at 25 degC, with activities by Davies.
pub fn ready(sketch: Sketch) -> Result<(System, Vec<f64>), String> {
    let (system, mut args) = sketch.ready().map_err(|why| why.to_string())?;
    let layout = system.layout();
    args[..Layout::ACTIVITIES].copy_from_slice(&[0.51, 8.74e-4, 4.34e-6, 0.3285, 1.75e-4, 1.0, 0.017]);
    for (i, member) in system.members().iter().enumerate() {
        let numbers = if member.charge == 0.0 { [0.0, 0.0, 0.0, 0.1] } else { [1.0, 0.0, 0.3, 0.0] };
        let at = layout.coefficients(i);
        args[at..at + Layout::COEFFICIENTS].copy_from_slice(&numbers);
    }
    args[layout.amount(0)] = WATER;
    Ok((system, args))
}
