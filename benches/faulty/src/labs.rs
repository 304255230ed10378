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
    /// States that are 0 when it is safe.
    pub off: &'static [&'static str],
}

/// A lab before it is compiled.
pub struct Lab {
    /// What it is known by.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
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

/// Strings of a pump that move its plunger, without what frames them.
fn strokes(heard: &str) -> Vec<String> {
    let string = |frame: &str| {
        let from = frame.find(['I', 'A'])?;
        let to = from + frame[from..].find('R')?;
        frame[from..to].contains('A').then(|| frame[from..=to].to_owned())
    };
    heard.split(['\r', '\u{3}']).filter_map(string).collect()
}

fn nothing(_: &str) -> Vec<String> {
    Vec::new()
}

const PLATE: Part = Part {
    name: "plate",
    binding: "[plate]\naddress = \"plate:1\"\n",
    driver: "IkaNamur",
    off: &["plate.active", "plate.stirring"],
};

static LABS: [Lab; 4] = [
    Lab {
        name: "pumped",
        text: PUMPED,
        parts: &[
            PLATE,
            Part {
                name: "pump",
                binding: "[pump]\naddress = \"pump:1\"\ndriver = \"CavroDt\"\n",
                driver: "CavroDt",
                off: &[],
            },
        ],
        moves: strokes,
    },
    Lab {
        name: "numbered",
        text: NUMBERED,
        parts: &[Part {
            name: "pump",
            binding: "[pump]\naddress = \"pump:1\"\ndriver = \"CavroOem\"\n",
            driver: "CavroOem",
            off: &[],
        }],
        moves: strokes,
    },
    Lab {
        name: "weighed",
        text: WEIGHED,
        parts: &[Part { name: "scale", binding: "[scale]\naddress = \"scale:1\"\n", driver: "MtSics", off: &[] }],
        moves: nothing,
    },
    Lab { name: "stirred", text: STIRRED, parts: &[PLATE], moves: nothing },
];

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
    let file = sources.add("lab.mtx", lab.text);
    let options = Options { wires, ..Options::default() };
    match matterix_lang::compile(&mut sources, file, &LibraryOnly, &options) {
        (Some(program), _) => (sources, program),
        (None, found) => panic!("`{}` does not compile: {:?}", lab.name, found.first().map(|d| &d.headline)),
    }
}
