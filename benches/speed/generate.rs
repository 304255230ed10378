//! Programs of any length that check without findings: many solutions, species and reactions, and long workflows of
//! every kind of statement over a bench of vessels.

use std::fmt::Write;

/// Vessels on a bench; all but the first hold a solution of their own.
const VESSELS: usize = 8;

/// Workflows on a bench in a long program.
const WORKFLOWS: usize = 9;

/// A program of about `lines` lines.
pub fn program(lines: usize) -> String {
    let mut out = String::from(HEAD);
    let mut workflow = 0;
    let mut bench = 0;
    while bench == 0 || out.lines().count() < lines {
        for n in 1..VESSELS {
            declarations(&mut out, bench * VESSELS + n);
        }
        lab(&mut out, bench);
        for n in 0..WORKFLOWS {
            if n == 0 || out.lines().count() < lines {
                steps(&mut out, bench, workflow);
                workflow += 1;
            }
        }
        bench += 1;
    }
    out
}

const HEAD: &str = "mtx 1
//! Generated: a large file without findings.

use std::glassware::Beaker250mL
use std::heating::IkaRetControl
use std::robots::{FrankaPanda, Robotiq2F85}

";

/// Two isomers, what turns one into the other, a solution and a constant.
fn declarations(out: &mut String, n: usize) {
    let carbons = 2 + n % 18;
    let formula = format!("C{carbons}H{}O", 2 * carbons + 2);
    let _ = write!(
        out,
        "/// Family {n}.
species A{n} {{ formula: \"{formula}\", molar_volume: {} mL/mol, heat_capacity: {} J/(mol*K) }}
species B{n} {{ formula: \"{formula}\", molar_volume: {} mL/mol, heat_capacity: {} J/(mol*K) }}

reaction change{n}: A{n} -> B{n} {{
    rate: arrhenius(A: {}e6 1/s, Ea: {} kJ/mol)
    order: {{ A{n}: 1 }}
    valid: 5 degC .. 95 degC
}}

solution s{n} {{ A{n}: {} mmol, KI: 1 mmol, water: 100 g }}
const warm{n} = {} degC

",
        60 + n % 40,
        90 + n % 30,
        61 + n % 40,
        91 + n % 30,
        1 + n % 9,
        60 + n % 30,
        1 + n % 20,
        30 + n % 40,
    );
}

/// A bench with a vessel of every one of its solutions.
fn lab(out: &mut String, bench: usize) {
    let _ = write!(
        out,
        "lab bench{bench} {{
    ambient: 25 degC
    table = OpticalTable at (0, 0, 0) m
    panda = FrankaPanda {{ gripper: Robotiq2F85 }} on table at (0, 0) mm
    hotplate = IkaRetControl on table at (550, 200) mm
    scale = IkaRetControl on table at (550, -200) mm
"
    );
    for v in 0..VESSELS {
        // Around the arm, with room for its fingers.
        let (sin, cos) = (75.0 + 35.0 * (v as f64 - 1.0)).to_radians().sin_cos();
        let on_table = || format!("table at ({:.0}, {:.0}) mm", 400.0 * cos, 400.0 * sin);
        let place = if v == 0 { "scale".to_string() } else { on_table() };
        let content = if v == 0 { "water".to_string() } else { format!("s{}", bench * VESSELS + v) };
        let _ = writeln!(out, "    b{v} = Beaker250mL on {place} holding {} g of {content}", 60 + v);
    }
    out.push_str("}\n\n");
}

/// A workflow on a bench.
fn steps(out: &mut String, bench: usize, n: usize) {
    let _ = writeln!(
        out,
        "/// Workflow {n}.\nworkflow work{n}(target: Temperature = {} degC) in bench{bench} {{",
        40 + n % 30
    );
    for round in 0..3 {
        let vessel = 1 + (n + round) % (VESSELS - 1);
        let species = bench * VESSELS + vessel;
        let _ = write!(
            out,
            "    step part{round} {{
        pour {} g from b{vessel} into b0 by panda using scale {{ tolerance: 2 g }}
        wait {} s
    }}
    if b0.contents.temperature < target {{
        heat hotplate to target
        wait until hotplate.temperature >= {} degC timeout 30 min
    }} else {{
        note \"warm enough\"
    }}
    repeat 2 times {{
        wait 10 s
    }}
    let mass{round} = b0.contents.mass + {} g
    expect mass{round} > 1 g and b0[A{species}] >= 0 mol/kg
",
            1 + n % 3,
            1 + round,
            30 + n % 10,
            round,
        );
    }
    out.push_str("} finally {\n    stop heating hotplate\n}\n\n");
}
