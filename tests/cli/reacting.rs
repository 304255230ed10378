//! Random reaction systems: every state of a run lies within what `check --contents` knows at that statement.

use std::fmt::Write;

use crate::contents::stays_within;
use crate::harness::folder;

/// Systems that are tried.
const SYSTEMS: u64 = 24;

/// Species by name, with how many units of CH2O they are.
const SPECIES: [(&str, u32); 7] = [("M1", 1), ("M2", 1), ("M3", 1), ("D1", 2), ("D2", 2), ("T1", 3), ("T2", 3)];

/// Numbers that look random: a generator of Lehmer's (Park and Miller, 1988).
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 % n
    }

    fn one<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u64) as usize]
    }

    fn species(&mut self, size: u32) -> &'static str {
        let fit: Vec<&str> = SPECIES.iter().filter(|s| s.1 == size).map(|s| s.0).collect();
        self.one(&fit)
    }

    /// The two sides of an equation that balances, and the orders of its first side.
    fn equation(&mut self) -> (String, String, Vec<&'static str>) {
        let one = |size: u32, draw: &mut Self| draw.species(size);
        match self.below(5) {
            0 => (one(1, self).to_string(), one(1, self).to_string(), vec![]),
            1 => {
                let (a, b) = (one(1, self), one(1, self));
                let side = if a == b { format!("2 {a}") } else { format!("{a} + {b}") };
                (side, one(2, self).to_string(), if a == b { vec![a] } else { vec![a, b] })
            }
            2 => {
                let (a, b) = (one(1, self), one(2, self));
                (format!("{a} + {b}"), one(3, self).to_string(), vec![b])
            }
            3 => (one(3, self).to_string(), format!("3 {}", one(1, self)), vec![]),
            _ => (one(2, self).to_string(), one(2, self).to_string(), vec![]),
        }
    }

    fn system(&mut self) -> String {
        let mut out = String::from("mtx 1\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n");
        for (name, size) in SPECIES {
            let density = self.one(&["0.8", "1", "1.3"]);
            let (c, h) = (size, 2 * size);
            let _ = writeln!(
                out,
                "species {name} {{ formula: \"C{c}H{h}O{c}\", density: {density} g/mL, heat_capacity: {} J/(mol*K) }}",
                60 * size + 5 * self.below(5) as u32
            );
        }
        for i in 0..1 + self.below(4) {
            let (left, right, mut orders) = self.equation();
            if left == right {
                continue;
            }
            if orders.is_empty() {
                orders = vec![SPECIES.iter().find(|s| s.0 == left).map_or("M1", |s| s.0)];
            }
            let unit = if orders.len() == 2 { "kg/(mol*s)" } else { "1/s" };
            let orders: Vec<String> = orders.iter().map(|s| format!("{s}: 1")).collect();
            let rate = self.one(&["1e-4", "2e-3", "0.05"]);
            let enthalpy = self.one(&["-40", "-5", "0", "20"]);
            let _ = writeln!(
                out,
                "reaction r{i}: {left} -> {right} {{ rate: {rate} {unit}, order: {{ {} }}, enthalpy: {enthalpy} kJ/mol }}",
                orders.join(", ")
            );
        }
        out.push_str("extern skill drip(v: Volume) from(source: Vessel) into(target: Vessel)\n");
        out.push_str("    effect move(v, from: source, to: target)\n");
        out.push_str("lab bench {\n    ambient: 22 degC\n    plate = IkaRetControl at (0, 0, 0) m\n");
        let mut held = vec!["80 g of water".to_string()];
        for (name, _) in SPECIES {
            if self.below(2) == 0 {
                held.push(format!("{} mmol of {name}", 1 + self.below(40)));
            }
        }
        let _ = writeln!(out, "    cup = Beaker250mL on plate holding {}", held.join(" + "));
        // Of everything there is a little, so that every reaction can begin.
        let all: Vec<String> =
            SPECIES.iter().map(|(name, _)| format!("{} mmol of {name}", 1 + self.below(4))).collect();
        let _ = writeln!(out, "    other = Beaker250mL at (1, 0, 0) m holding 20 g of water + {}\n}}", all.join(" + "));
        out.push_str("workflow go in bench {\n");
        for _ in 0..4 + self.below(4) {
            match self.below(5) {
                0 => {
                    let _ = writeln!(out, "    heat plate to {} degC", 30 + 5 * self.below(8));
                }
                1 => {
                    let ends = self.one(&["from cup into other", "from other into cup"]);
                    let _ = writeln!(out, "    drip {} mL {ends}", 1 + self.below(5));
                }
                2 => {
                    let goal = 22 + self.below(20);
                    let _ = writeln!(
                        out,
                        "    wait until cup.contents.temperature >= {goal} degC timeout 3 min on timeout {{ }}"
                    );
                }
                _ => {
                    let _ = writeln!(out, "    wait {} s", self.one(&[1, 30, 600, 3600]));
                }
            }
        }
        out.push_str("    wait 1 min\n} finally {\n    stop heating plate\n}\n");
        out
    }
}

#[test]
fn what_reacts_stays_within_what_is_known() {
    let mut compared = 0;
    for seed in 1..=SYSTEMS {
        let mut draw = Draw(seed * 7919);
        let dir = folder(&format!("reacting_{seed}"));
        let file = dir.join("system.mtx");
        std::fs::write(&file, draw.system()).expect("the file is written");
        compared += stays_within(file.to_str().expect("text"), &dir);
    }
    assert!(compared > 500, "only {compared} values were compared");
}
