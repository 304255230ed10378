//! Systems by short texts, for tests and for the bench of equilibria, which includes this file.

use super::{Equation, Member, Phase, System, Unsettled, Written};

/// ln 10.
pub const LN_10: f64 = std::f64::consts::LN_10;

/// Gas constant, J/(mol*K).
const GAS: f64 = 8.314_462_618_153_24;

/// Equations with their constants, as they are written one after the other.
pub struct Sketch {
    /// Members and equations so far.
    pub written: Written,
    /// By equation: log10 K at 25 degC, and kJ/mol.
    constants: Vec<(f64, f64)>,
}

impl Sketch {
    /// Water alone.
    pub fn new() -> Sketch {
        let water = Member { name: "water".into(), phase: Phase::Solvent, charge: 0.0 };
        let written =
            Written { members: vec![water], equations: Vec::new(), solvent_mass: 0.018_015, interactions: None };
        Sketch { written, constants: Vec::new() }
    }

    /// Water, an acid and half-cells, one of which takes up eight protons, with two metals.
    pub fn half_cells() -> Sketch {
        let log = |electrons: f64, potential: f64| electrons * potential / 0.059_159_6;
        Sketch::new()
            .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
            .equation("-1 HAc 1 H+ 1 Ac-", -4.756, -0.4)
            .equation("-1 Fe+++ -1 e- 1 Fe++", log(1.0, 0.771), -41.0)
            .equation("-1 Ce++++ -1 e- 1 Ce+++", log(1.0, 1.72), 0.0)
            .equation("-1 MnO4- -8 H+ -5 e- 1 Mn++ 4 water", log(5.0, 1.507), -825.0)
            .equation("-1 Cu++ -2 e- 1 Cu(s)", log(2.0, 0.3419), -65.0)
            .equation("-1 Zn++ -2 e- 1 Zn(s)", log(2.0, -0.7618), 153.0)
    }

    fn member(&mut self, name: &str) -> usize {
        if let Some(known) = self.written.members.iter().position(|m| m.name == name) {
            return known;
        }
        let phase = match name {
            "e-" => Phase::Formal,
            name if name.ends_with("(s)") => Phase::Solid,
            name if name.ends_with("(org)") => Phase::Extracted,
            _ => Phase::Solute,
        };
        let signs = |sign: char| name.chars().rev().take_while(|c| *c == sign).count() as f64;
        self.written.members.push(Member { name: name.into(), phase, charge: signs('+') - signs('-') });
        self.written.equations.iter_mut().for_each(|e| e.coefficients.push(0.0));
        self.written.members.len() - 1
    }

    /// One more, `-1 HA 1 H+ 1 A-`, with log10 K at 25 degC and kJ/mol.
    pub fn equation(mut self, text: &str, log: f64, enthalpy: f64) -> Sketch {
        let words: Vec<&str> = text.split(' ').collect();
        let pairs = words.chunks(2).filter_map(|pair| Some((pair.first()?.parse::<f64>().ok()?, *pair.get(1)?)));
        let found: Vec<(f64, usize)> = pairs.map(|(n, name)| (n, self.member(name))).collect();
        let mut coefficients = vec![0.0; self.written.members.len()];
        found.into_iter().for_each(|(n, i)| coefficients[i] += n);
        self.written.equations.push(Equation { name: text.into(), coefficients });
        self.constants.push((log, enthalpy));
        self
    }

    /// The system, and arguments with nothing in it at 25 degC, where all activity coefficients are 1.
    pub fn ready(self) -> Result<(System, Vec<f64>), Unsettled> {
        let system = System::try_from(self.written)?;
        let layout = system.layout();
        let mut args = vec![0.0; layout.count()];
        for (r, (log, enthalpy)) in self.constants.iter().enumerate() {
            let slope = enthalpy * 1e3 / GAS;
            let at = layout.constant(r);
            args[at..at + 2].copy_from_slice(&[log * LN_10 + slope / 298.15, -slope]);
            args[layout.enthalpy(r)] = enthalpy * 1e3;
        }
        args[layout.capacity()] = f64::INFINITY;
        args[layout.reference()] = 298.15;
        Ok((system, args))
    }
}
