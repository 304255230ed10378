//! Systems of equilibria of any size, and mixtures to be solved.

use matterix_ir::equilibrium::{Equation, Layout, Member, Phase, System, Written};

/// Water in a kilogram, mol.
pub const WATER: f64 = 55.508;

const LN_10: f64 = std::f64::consts::LN_10;

/// Gas constant, J/(mol*K).
const GAS: f64 = 8.314_462_618_153_24;

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

/// Equations with their constants, as they are written one after the other.
pub struct Chemistry {
    written: Written,
    /// By equation: log10 K at 25 degC, and kJ/mol.
    constants: Vec<(f64, f64)>,
}

impl Chemistry {
    /// Water that splits.
    pub fn water() -> Chemistry {
        let water = Member { name: "water".into(), phase: Phase::Solvent, charge: 0.0 };
        let written = Written { members: vec![water], equations: Vec::new(), solvent_mass: 0.018_015 };
        Chemistry { written, constants: Vec::new() }.and("-1 water 1 H+ 1 OH-", -13.995, 55.8)
    }

    /// With carbon dioxide.
    pub fn carbonate() -> Chemistry {
        let known = Chemistry::water().and("-1 CO2 -1 water 1 H+ 1 HCO3-", -6.352, 9.1);
        known.and("-1 HCO3- 1 H+ 1 CO3--", -10.329, 14.9)
    }

    /// With acids, ammonia, silver and lime, and three solids.
    pub fn bench() -> Chemistry {
        Chemistry::carbonate()
            .and("-1 HAc 1 H+ 1 Ac-", -4.756, -0.4)
            .and("-1 H3PO4 1 H+ 1 H2PO4-", -2.168, -8.8)
            .and("-1 H2PO4- 1 H+ 1 HPO4--", -7.207, 4.1)
            .and("-1 HPO4-- 1 H+ 1 PO4---", -12.346, 14.8)
            .and("-1 NH4+ 1 H+ 1 NH3", -9.244, 52.2)
            .and("-1 Ag+ -2 NH3 1 Ag(NH3)2+", 7.22, -56.0)
            .and("-1 AgCl(s) 1 Ag+ 1 Cl-", -9.75, 65.5)
            .and("-1 CaCO3(s) 1 Ca++ 1 CO3--", -8.48, -13.2)
            .and("-1 Ca(OH)2(s) 1 Ca++ 2 OH-", -5.2, -18.0)
    }

    /// With half-cells, one of which takes up eight protons, and two metals.
    pub fn half_cells() -> Chemistry {
        let log = |electrons: f64, potential: f64| electrons * potential / 0.059_159_6;
        Chemistry::water()
            .and("-1 HAc 1 H+ 1 Ac-", -4.756, -0.4)
            .and("-1 Fe+++ -1 e- 1 Fe++", log(1.0, 0.771), -41.0)
            .and("-1 Ce++++ -1 e- 1 Ce+++", log(1.0, 1.72), 0.0)
            .and("-1 MnO4- -8 H+ -5 e- 1 Mn++ 4 water", log(5.0, 1.507), -825.0)
            .and("-1 Cu++ -2 e- 1 Cu(s)", log(2.0, 0.3419), -65.0)
            .and("-1 Zn++ -2 e- 1 Zn(s)", log(2.0, -0.7618), 153.0)
    }

    /// Acids of two steps and metals that they bind, until there are so many species or just more; constants as they are common.
    pub fn of_size(species: usize) -> Chemistry {
        let mut draw = Draw::new(species as u64);
        let mut made = Chemistry::water();
        let mut pairs = 0;
        while made.written.members.len() < species {
            let (acid, metal) = (format!("L{pairs}"), format!("M{pairs}++"));
            let first = draw.between(2.0, 6.0);
            made = made.and(&format!("-1 H2{acid} 1 H+ 1 H{acid}-"), -first, draw.between(-10.0, 10.0));
            let second = first + draw.between(2.0, 5.0);
            made = made.and(&format!("-1 H{acid}- 1 H+ 1 {acid}--"), -second, draw.between(-10.0, 20.0));
            made = made.and(&format!("-1 {metal} -1 water 1 M{pairs}OH+ 1 H+"), -draw.between(7.0, 12.0), 40.0);
            made = made.and(&format!("-1 {metal} -1 {acid}-- 1 {metal}:{acid}"), draw.between(2.0, 6.0), 10.0);
            if pairs > 0 {
                let before = pairs - 1;
                made = made.and(&format!("-1 {metal} -1 L{before}-- 1 {metal}:L{before}"), draw.between(2.0, 6.0), 5.0);
            }
            pairs += 1;
        }
        made
    }

    fn member(&mut self, name: &str) -> usize {
        if let Some(known) = self.written.members.iter().position(|m| m.name == name) {
            return known;
        }
        let phase = match name {
            "e-" => Phase::Formal,
            name if name.ends_with("(s)") => Phase::Solid,
            _ => Phase::Solute,
        };
        let signs = |sign: char| name.chars().rev().take_while(|c| *c == sign).count() as f64;
        self.written.members.push(Member { name: name.into(), phase, charge: signs('+') - signs('-') });
        self.written.equations.iter_mut().for_each(|e| e.coefficients.push(0.0));
        self.written.members.len() - 1
    }

    /// One more: `-1 HA 1 H+ 1 A-`.
    fn and(mut self, text: &str, log: f64, enthalpy: f64) -> Chemistry {
        let words: Vec<&str> = text.split(' ').collect();
        let pairs = words.chunks(2).filter_map(|pair| Some((pair.first()?.parse::<f64>().ok()?, *pair.get(1)?)));
        let found: Vec<(f64, usize)> = pairs.map(|(n, name)| (n, self.member(name))).collect();
        let mut coefficients = vec![0.0; self.written.members.len()];
        found.into_iter().for_each(|(n, i)| coefficients[i] += n);
        self.written.equations.push(Equation { name: text.into(), coefficients });
        self.constants.push((log, enthalpy));
        self
    }

    /// The system, and arguments with nothing in a kilogram of water at 25 degC.
    pub fn ready(self) -> Result<(System, Vec<f64>), String> {
        let system = System::try_from(self.written).map_err(|why| why.to_string())?;
        let layout = system.layout();
        let mut args = vec![0.0; layout.count()];
        args[..Layout::ACTIVITIES].copy_from_slice(&[0.51, 8.74e-4, 4.34e-6, 0.3285, 1.75e-4, 1.0, 0.017]);
        for (r, (log, enthalpy)) in self.constants.iter().enumerate() {
            let slope = enthalpy * 1e3 / GAS;
            let at = layout.constant(r);
            args[at..at + 2].copy_from_slice(&[log * LN_10 + slope / 298.15, -slope]);
            args[layout.enthalpy(r)] = enthalpy * 1e3;
        }
        for (i, member) in system.members().iter().enumerate() {
            let numbers = if member.charge == 0.0 { [0.0, 0.0, 0.0, 0.1] } else { [1.0, 0.0, 0.3, 0.0] };
            let at = layout.coefficients(i);
            args[at..at + Layout::COEFFICIENTS].copy_from_slice(&numbers);
        }
        args[layout.amount(0)] = WATER;
        args[layout.capacity()] = f64::INFINITY;
        args[layout.reference()] = 298.15;
        Ok((system, args))
    }
}
