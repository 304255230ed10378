//! The labs that are deployed, with what in them must not be done twice, and what must be off at the end.

use std::sync::OnceLock;

use matterix_ir::wire::Driver;
use matterix_ir::{Program, Sources};
use matterix_lang::{LibraryOnly, Options, Wires};
use matterix_runtime::backend::Prepared;

/// A device of a lab.
pub struct Part {
    /// Its name.
    pub name: &'static str,
    /// Its binding.
    pub binding: &'static str,
    /// Its driver.
    pub driver: &'static str,
    /// Its line, which others may share, and its address there.
    pub line: (&'static str, Option<&'static str>),
    /// States that are 0 when it is safe.
    pub off: &'static [&'static str],
}

/// A lab before it is compiled.
pub struct Lab {
    /// What it is known by.
    pub name: &'static str,
    /// Its text.
    pub text: fn() -> String,
    /// Its devices.
    pub parts: &'static [Part],
    /// What of what a device heard moves matter.
    pub moves: fn(&str) -> Vec<String>,
}

/// A lab that was compiled: for whom it is deployed, and for whom its devices are emulated.
pub struct Compiled {
    /// The lab.
    pub lab: &'static Lab,
    /// Its bindings.
    pub bindings: String,
    /// With the lines of drivers for the plan.
    pub deployed: Program,
    /// With those that emulators know.
    pub served: Program,
    /// The model of these, made ready.
    pub prepared: Prepared,
    /// The text.
    pub sources: Sources,
}

impl Compiled {
    /// The drivers that an emulator of a device answers for.
    pub fn drivers(&self, part: &Part) -> Vec<&Driver> {
        let instance = self.served.scene.find(part.name);
        let own = self
            .served
            .drivers
            .iter()
            .filter(|d| Some(d.instance) == instance && d.name == part.driver && d.host.is_none());
        let over = self
            .served
            .drivers
            .iter()
            .filter(|d| d.host.as_ref().is_some_and(|h| Some(h.instance) == instance && h.driver == part.driver));
        own.chain(over).collect()
    }
}

const PUMPED: &str = "mtx 1
use std::glassware::{Beaker50mL, Beaker250mL}
use std::heating::IkaRetControl
use std::pumps
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
    pump = CavroXlp6000 at (3, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 20 mL of water
    b = Beaker50mL at (2, 0, 0) m
    between pump and a { piped: true, port: 1 }
    between pump and b { piped: true, port: 3 }
}
workflow dose in bench {
    stir plate at 300 rpm
    heat plate to 40 degC
    draw 2.123 mL from a by pump
    push 1 mL into b by pump
    ask \"is the flask in?\"
    wait until plate.temperature >= 26 degC timeout 5 min
    wait 20 s
    push 1.123 mL into b by pump
    expect plate.temperature >= 25 degC
} finally { stop heating plate; stop stirring plate }
";

const NUMBERED: &str = "mtx 1
use std::glassware::{Beaker50mL}
use std::pumps
lab bench {
    ambient: 22 degC
    pump = CavroXlp6000 at (3, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 40 mL of water
    b = Beaker50mL at (2, 0, 0) m
    between pump and a { piped: true, port: 1 }
    between pump and b { piped: true, port: 3 }
}
workflow doses in bench {
    repeat 3 times {
        draw 1.5 mL from a by pump
        push 0.5 mL into b by pump
        wait 5 s
        push 1 mL into b by pump
    }
}
";

const WEIGHED: &str = "mtx 1
use std::balances::PrecisionBalance
use std::glassware::Beaker50mL
lab bench {
    ambient: 22 degC
    scale = PrecisionBalance at (0, 0, 0) m
    a = Beaker50mL on scale holding 20 mL of water
}
workflow weigh_it in bench {
    let m <- read scale
    ask \"is it dry?\"
    let later <- read scale
    wait 2 s
    tare scale
    expect m in 40 g .. 60 g
}
";

const STIRRED: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow stir_a_while in bench {
    ask \"add the reagent, then confirm\"
    stir plate at 300 rpm
    parallel {
        sequence { wait 40 s; stir plate at 400 rpm }
        sequence { wait 30 s; ask \"is it clear?\" }
    }
    hold plate.speed > 350 rpm for 20 s timeout 2 min
    stop stirring plate
} finally { stop stirring plate; stop heating plate }
";

const SHARED: &str = "lab bench { ambient: 22 degC, acid = Ne1000, base = Ne1000 }
workflow neutralise in bench {
    set diameter acid to 14.43 mm
    set diameter base to 14.43 mm
    infuse 0.25 mL at 3 mL/min by acid
    ask \"is it pink?\"
    infuse 0.3 mL at 3 mL/min by base
    wait 15 s
    infuse 0.1 mL at 3 mL/min by acid
}
";

const MODBUS: &str = "lab bench { ambient: 22 degC, block = HeatedBlock at (0, 0, 0) m }
workflow warm in bench {
    heat block to 40 degC
    wait until block.temperature >= 24 degC timeout 10 min
    ask \"is the vial in?\"
    heat block to 60 degC
    wait 30 s
    expect block.temperature >= 24 degC
} finally { stop heating block }
";

/// Strings of a pump that move its plunger, without what frames them.
fn strokes(heard: &str) -> Vec<String> {
    let string = |frame: &str| {
        let from = frame.find(['I', 'A'])?;
        let to = from + frame[from..].find('R')?;
        let is_stroke = |(at, _): (usize, char)| frame[at + 1..to].starts_with(|c: char| c.is_ascii_digit());
        let mut strokes = frame[..to].char_indices().skip(from).filter(|(_, c)| *c == 'A');
        strokes.any(is_stroke).then(|| frame[from..=to].to_owned())
    };
    heard.split(['\r', '\u{3}']).filter_map(string).collect()
}

/// Commands of a syringe pump that let it run, with its address and how much it is to pump.
fn runs(heard: &str) -> Vec<String> {
    let said = |word: &&str| word.contains("VOL") || word.contains("RUN");
    heard.split(|c: char| c.is_control() || !c.is_ascii()).filter(|w| said(w)).map(str::to_owned).collect()
}

fn nothing(_: &str) -> Vec<String> {
    Vec::new()
}

const PLATE: Part = Part {
    name: "plate",
    line: ("plate", None),
    binding: "[plate]\naddress = \"plate:1\"\n",
    driver: "IkaNamur",
    off: &["plate.active", "plate.stirring"],
};

static LABS: [Lab; 6] = [
    Lab {
        name: "pumped",
        text: || PUMPED.to_owned(),
        parts: &[
            PLATE,
            Part {
                name: "pump",
                line: ("pump", None),
                binding: "[pump]\naddress = \"pump:1\"\ndriver = \"CavroDt\"\n",
                driver: "CavroDt",
                off: &[],
            },
        ],
        moves: strokes,
    },
    Lab {
        name: "numbered",
        text: || NUMBERED.to_owned(),
        parts: &[Part {
            name: "pump",
            line: ("pump", None),
            binding: "[pump]\naddress = \"pump:1\"\ndriver = \"CavroOem\"\n",
            driver: "CavroOem",
            off: &[],
        }],
        moves: strokes,
    },
    Lab {
        name: "weighed",
        text: || WEIGHED.to_owned(),
        parts: &[Part {
            name: "scale",
            line: ("scale", None),
            binding: "[scale]\naddress = \"scale:1\"\n",
            driver: "MtSics",
            off: &[],
        }],
        moves: nothing,
    },
    Lab { name: "stirred", text: || STIRRED.to_owned(), parts: &[PLATE], moves: nothing },
    Lab {
        name: "shared",
        text: || with(include_str!("../../../examples/devices/new_era.mtx"), SHARED),
        parts: &[
            Part {
                name: "acid",
                line: ("pumps", Some("3")),
                binding: "[acid]\naddress = \"pumps:1\"\nunit = \"3\"\n",
                driver: "Ne1000Safe",
                off: &["acid.running"],
            },
            Part {
                name: "base",
                line: ("pumps", Some("7")),
                binding: "[base]\naddress = \"pumps:1\"\nunit = \"7\"\n",
                driver: "Ne1000Safe",
                off: &["base.running"],
            },
        ],
        moves: runs,
    },
    Lab {
        name: "modbus",
        text: || with(include_str!("../../../examples/devices/watlow.mtx"), MODBUS),
        parts: &[Part {
            name: "block",
            line: ("block", None),
            binding: "[block]\naddress = \"block:1\"\ndriver = \"EzZoneTcp\"\n",
            driver: "EzZoneTcp",
            off: &["block.active"],
        }],
        moves: nothing,
    },
];

/// The devices of an example, in another lab.
fn with(example: &str, lab: &str) -> String {
    let devices = example.split("\nlab ").next().unwrap_or_default();
    format!("{devices}\n{lab}")
}

/// All labs, compiled once.
pub fn all() -> &'static [Compiled] {
    static ALL: OnceLock<Vec<Compiled>> = OnceLock::new();
    ALL.get_or_init(|| LABS.iter().map(compiled).collect())
}

fn compiled(lab: &'static Lab) -> Compiled {
    let (sources, deployed) = program(lab, Wires::Called);
    let (_, served) = program(lab, Wires::Served);
    let prepared = Prepared::new(&served);
    let bindings = lab.parts.iter().map(|p| p.binding).collect();
    Compiled { lab, bindings, deployed, served, prepared, sources }
}

fn program(lab: &Lab, wires: Wires) -> (Sources, Program) {
    let mut sources = Sources::default();
    let file = sources.add("lab.mtx", (lab.text)());
    let options = Options { wires, ..Options::default() };
    match matterix_lang::compile(&mut sources, file, &LibraryOnly, &options) {
        (Some(program), _) => (sources, program),
        (None, found) => panic!("`{}` does not compile: {:?}", lab.name, found.first().map(|d| &d.headline)),
    }
}
