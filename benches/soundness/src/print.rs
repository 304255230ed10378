//! Plans as text: a file with a lab and a workflow for each, every statement on a line of its own.

use std::fmt::Write;

use crate::plan::{
    ACID, Action, Block, Condition, Declared, Handler, Id, Ill, Kind, LIQUIDS, Lab, Plan, Remedy, Stmt, Theme, Thing,
};

/// A file with several plans.
#[derive(Debug, Default)]
pub struct Text {
    /// What it says.
    pub text: String,
    /// By line, counted from 0: which statement of which plan begins there.
    pub lines: Vec<Option<(usize, Id)>>,
    /// By plan: its first line and the line behind its last one.
    pub spans: Vec<(usize, usize)>,
}

/// What every file begins with: laws, devices and actions of the house, whose times differ so that nothing ends at the
/// same moment by chance.
const HEADER: &str = r#"
reactive_group house_sour { title: "acids of the house", members: { acid: any }, source: "house rule 1" }
reactive_group house_bitter { title: "cyanides of the house", members: { cyan: any }, source: "house rule 2" }
incompatible house_sour with house_bitter { consequence: [toxic_gas], source: "house rule 3" }
material house_tin { }
incompatible house_sour with house_tin { consequence: [dissolving], source: "house rule 4" }

capability Dial: Body {
    state level: Ratio = 0.5
    reading shown: Ratio = level { noise: 0.3, period: 0.05 s }
}
asset Meter: Dial { mass: 1 kg }
asset Token: Body { mass: 1 kg }
asset Cup: Vessel, Body { mass: 10 g }
asset Phial: Vessel, Capped { mass: 10 g, cap_time: 2.3 s }
asset Tin: Vessel, Body { mass: 10 g, material: house_tin }
asset Stand: Surface, Body { mass: 1 kg }
asset Pan: Balance { mass: 1 kg, range: 60 g, settling: 1.5 s, resolution: 10 mg, noise: 5 mg }

capability Burning: Body {
    state lid: open | closed = closed
    state burning: Bool = false
    command fire
        needs lid == closed else lid_open "shut it first"
        effect burning = true
        takes 1.7 s
    command quench
        effect burning = false
        takes 0.93 s
    command unlid
        needs not burning else still_moving "quench it first"
        effect lid = open
        takes 1.37 s
    command shut
        effect lid = closed
        takes 1.51 s
    ends not burning else left_burning "quench it"
}
asset Oven: Burning { mass: 1 kg }

capability Hob: Thermal, Surface {
    state hot: Bool = false
    state goal: Temperature = ambient
    command bring to(t: Temperature)
        effect hot = true, goal = t
        takes 1.19 s
    command calm
        effect hot = false
        takes 0.83 s
    process warming while hot { heat_flow += clamp(30 W/K * (goal - temperature), 0 W, 200 W) }
    ends not hot else left_hot "calm it"
}
asset Ring: Hob { mass: 1 kg, capacity: 300 J/K, air: 0.3 W/K }

extern skill drip(v: Volume) from(source: Vessel) into(target: Vessel)
    needs source.contents.volume >= v else volume_underflow "take less"
    needs target.room >= v else volume_overflow "use a larger vessel"
    needs not closed_up(source) and not closed_up(target) else capped "uncap it first"
    effect move(v, from: source, to: target)
    takes 1.13 s

extern skill splash(v: Volume) from(source: Vessel) into(target: Vessel)
    effect move(v, from: source, to: target)
    takes 0.71 s

extern skill strain(v: Volume) from(source: Vessel) into(target: Vessel)
    effect move(v, from: source, to: target, but: each(s in [red]: 0.75))
    takes 0.67 s

skill double(v: Volume) from(source: Vessel) into(target: Vessel)
    fails volume_underflow, volume_overflow, capped
{
    drip v from source into target
    wait 0.47 s
    drip v from source into target
}
"#;

/// Writes plans into one file; those with a reaction go with each other only.
pub fn print(plans: &[Plan]) -> Text {
    let mut out = Text::default();
    let reaction = plans.iter().any(|p| p.theme == Theme::Reaction);
    out.line("mtx 1", None);
    out.line("use std::glassware::Beaker50mL", None);
    out.line("use std::opentrons::{Corning96, OT2, P300Single, TipRack300}", None);
    out.line("use std::pumps::{CavroXlp6000, draw, piped, push}", None);
    out.line("use std::robots::{FrankaPanda, Robotiq2F85}", None);
    for (i, l) in LIQUIDS.iter().enumerate() {
        let text = match reaction && i < ACID {
            true => format!(
                "species {} {{ formula: \"C2H6O\", density: {} g/mL, heat_capacity: 100 J/(mol*K) }}",
                l.name, l.density
            ),
            false => format!(
                "species {} {{ by: mass, density: {} g/mL, specific_heat: {} J/(g*K) }}",
                l.name, l.density, l.heat
            ),
        };
        out.line(&text, None);
    }
    if reaction {
        out.line("reaction turn: red -> blue { rate: 0.02 1/s, order: { red: 1 } }", None);
    }
    for line in HEADER.lines() {
        out.line(line, None);
    }
    for (number, plan) in plans.iter().enumerate() {
        let from = out.lines.len();
        out.lab(number, plan);
        out.workflow(number, plan);
        out.spans.push((from, out.lines.len()));
    }
    out
}

impl Text {
    fn line(&mut self, text: &str, is: Option<(usize, Id)>) {
        self.text.push_str(text);
        self.text.push('\n');
        self.lines.push(is);
    }

    fn lab(&mut self, number: usize, plan: &Plan) {
        let lab = &plan.lab;
        match plan.declared {
            None => {}
            Some(Declared::Label(is, label)) => {
                let rest = 100 - is;
                let text =
                    format!("solution mixed{number} {{ red: {is} g, blue: {rest} g }} labelled {label} %w/w of red");
                self.line(&text, None);
            }
            Some(Declared::Slab(share)) => {
                let air = f64::from(share) / 100.0;
                let text = format!(
                    "asset Slab{number}: Thermal, Surface {{ mass: 2 kg, capacity: 2 kJ/K, air: {air} W/K, inner: 1 W/K }}"
                );
                self.line(&text, None);
            }
            Some(Declared::Equation(n)) => {
                let text = format!("reaction odd{number}: {n} red -> blue {{ rate: 1e-9 1/s, order: {{ red: 1 }} }}");
                self.line(&text, None);
            }
        }
        self.line(&format!("lab lab{number} {{"), None);
        self.line("    ambient: 22 degC", None);
        match plan.declared {
            Some(Declared::Label(..)) => {
                let text = format!("    flask = Beaker50mL at (0, 6, 0) m holding 10 mL of mixed{number}");
                self.line(&text, None);
            }
            Some(Declared::Slab(_)) => self.line(&format!("    slab = Slab{number} at (0, 6, 0) m"), None),
            _ => {}
        }
        if plan.theme == Theme::Tips {
            self.line("    ot2 = OT2 { left: P300Single } at (0, 0, 0) m", None);
            self.line("    tips = TipRack300 on ot2.slot[1]", None);
            let wells = lab.cups.iter().enumerate().filter_map(|(i, c)| {
                let (liquid, volume) = c.holds?;
                Some(format!("{}: {volume} uL of {}", well(i), LIQUIDS.get(liquid)?.name))
            });
            let wells: Vec<String> = wells.collect();
            self.line(&format!("    plate = Corning96 on ot2.slot[2] holding {{ {} }}", wells.join(", ")), None);
        } else if plan.theme == Theme::Arms {
            self.table(lab);
        } else {
            self.things(lab);
        }
        if plan.theme == Theme::Pump {
            self.line("    pump = CavroXlp6000 at (0, 5, 0) m", None);
            for (i, _) in lab.cups.iter().enumerate().filter(|(_, cup)| cup.piped) {
                self.line(&format!("    between pump and c{i} {{ piped: true }}"), None);
            }
        }
        for d in 0..lab.dials {
            self.line(&format!("    d{d} = Meter at ({d}, 3, 0) m"), None);
        }
        for (o, open) in lab.ovens.iter().enumerate() {
            let lid = if *open { "open" } else { "closed" };
            self.line(&format!("    o{o} = Oven {{ lid: {lid} }} at ({o}, 2, 0) m"), None);
        }
        for t in 0..lab.tokens {
            self.line(&format!("    t{t} = Token at ({t}, 4, 0) m"), None);
        }
        self.line("}", None);
    }

    /// A table with an arm, beakers and what they are put on.
    fn table(&mut self, lab: &Lab) {
        self.line("    table = OpticalTable at (0, 0, 0) m", None);
        self.line("    arm = FrankaPanda { gripper: Robotiq2F85 } on table at (0, 0) mm", None);
        for (i, cup) in lab.cups.iter().enumerate() {
            let holding = cup.holds.and_then(|(l, v)| Some(format!(" holding {v} uL of {}", LIQUIDS.get(l)?.name)));
            let holding = holding.unwrap_or_default();
            self.line(&format!("    c{i} = Beaker50mL on table at (450, {}) mm{holding}", 250 - 200 * i as i64), None);
        }
        self.line("    s0 = Pan on table at (550, 100) mm", None);
        self.line("    s1 = Stand on table at (550, -100) mm", None);
    }

    /// Hot plates with beakers, or cups.
    fn things(&mut self, lab: &Lab) {
        for p in 0..lab.plates {
            self.line(&format!("    p{p} = Ring at ({p}, 0, 0) m"), None);
        }
        for (i, cup) in lab.cups.iter().enumerate() {
            let holding = cup.holds.and_then(|(l, v)| Some(format!(" holding {v} uL of {}", LIQUIDS.get(l)?.name)));
            let holding = holding.unwrap_or_default();
            let text = match (lab.plates > 0, cup.cap) {
                (true, _) if i < lab.plates => format!("    c{i} = Beaker50mL on p{i}{holding}"),
                (true, _) => format!("    c{i} = Beaker50mL at ({i}, 1, 0) m{holding}"),
                (false, Some(on)) => {
                    let cap = if on { "on" } else { "off" };
                    format!("    c{i} = Phial {{ max_volume: {} uL, cap: {cap} }} at ({i}, 1, 0) m{holding}", cup.max)
                }
                (false, None) if cup.tin => {
                    format!("    c{i} = Tin {{ max_volume: {} uL }} at ({i}, 1, 0) m{holding}", cup.max)
                }
                (false, None) => format!("    c{i} = Cup {{ max_volume: {} uL }} at ({i}, 1, 0) m{holding}", cup.max),
            };
            self.line(&text, None);
        }
    }

    fn workflow(&mut self, number: usize, plan: &Plan) {
        self.line(&format!("workflow flow{number} in lab{number} {{"), None);
        let mut at = At { plan, number, depth: 1 };
        self.block(&mut at, &plan.body);
        match plan.finally.is_empty() {
            true => self.line("}", None),
            false => {
                self.line("} finally {", None);
                self.block(&mut at, &plan.finally);
                self.line("}", None);
            }
        }
    }

    fn block(&mut self, at: &mut At<'_>, block: &Block) {
        for stmt in block {
            self.stmt(at, stmt);
        }
    }

    fn inner(&mut self, at: &mut At<'_>, block: &Block) {
        at.depth += 1;
        self.block(at, block);
        at.depth -= 1;
    }

    /// A wait of statement `is` that may have a handler for its timeout.
    fn timed_out(&mut self, at: &mut At<'_>, is: Option<(usize, Id)>, head: String, handler: Option<&Block>) {
        let pad = "    ".repeat(at.depth);
        let Some(block) = handler else { return self.line(&format!("{pad}{head}"), is) };
        self.line(&format!("{pad}{head} on timeout {{"), is);
        self.inner(at, block);
        self.line(&format!("{pad}}}"), None);
    }

    fn stmt(&mut self, at: &mut At<'_>, stmt: &Stmt) {
        let pad = "    ".repeat(at.depth);
        let is = Some((at.number, stmt.id));
        let open = |out: &mut Self, text: String| out.line(&format!("{pad}{text}"), is);
        let close = format!("{pad}}}");
        match &stmt.kind {
            Kind::Do(action) => open(self, at.action(action)),
            Kind::Wait(ms) => open(self, format!("wait {}", seconds(*ms))),
            Kind::Until(c, ms, handler) => {
                let head = format!("wait until {} timeout {}", at.condition(c), seconds(*ms));
                self.timed_out(at, is, head, handler.as_ref());
            }
            Kind::If(c, yes, no) => {
                open(self, format!("if {} {{", at.condition(c)));
                self.inner(at, yes);
                if !no.is_empty() {
                    self.line(&format!("{pad}}} else {{"), None);
                    self.inner(at, no);
                }
                self.line(&close, None);
            }
            Kind::Repeat(n, body) => {
                open(self, format!("repeat {n} times {{"));
                self.inner(at, body);
                self.line(&close, None);
            }
            Kind::While(c, max, body) => {
                open(self, format!("repeat while {} max {max} {{", at.condition(c)));
                self.inner(at, body);
                self.line(&close, None);
            }
            Kind::Parallel(branches) => {
                open(self, "parallel {".to_string());
                for branch in branches {
                    self.line(&format!("{pad}    sequence {{"), None);
                    at.depth += 1;
                    self.inner(at, branch);
                    at.depth -= 1;
                    self.line(&format!("{pad}    }}"), None);
                }
                self.line(&close, None);
            }
            Kind::Start(j, body) => {
                open(self, format!("start j{j} = {{"));
                self.inner(at, body);
                self.line(&close, None);
            }
            Kind::Await(j) => open(self, format!("await j{j}")),
            Kind::Guard(body, handlers) => {
                open(self, "sequence {".to_string());
                self.inner(at, body);
                for handler in handlers {
                    self.handler(at, &pad, handler);
                }
                self.line(&close, None);
            }
            Kind::Try(body, other) => {
                open(self, "try {".to_string());
                self.inner(at, body);
                self.line(&format!("{pad}}} else {{"), None);
                self.inner(at, other);
                self.line(&close, None);
            }
            Kind::Step(name, body) => {
                open(self, format!("step phase{name} {{"));
                self.inner(at, body);
                self.line(&close, None);
            }
            Kind::Within(name, ms, body, handler) => {
                open(self, format!("within {} after phase{name}.end {{", seconds(*ms)));
                self.inner(at, body);
                self.answered(at, &pad, "late", handler.as_ref());
            }
            Kind::Keep(c, body, handler) => {
                open(self, format!("keep {} {{", at.condition(c)));
                self.inner(at, body);
                self.answered(at, &pad, "broken", handler.as_ref());
            }
            Kind::Hold(c, span, ms, handler) => {
                let head = format!("hold {} for {} timeout {}", at.condition(c), seconds(*span), seconds(*ms));
                self.timed_out(at, is, head, handler.as_ref());
            }
            Kind::Ill(Ill::Mass) => open(self, "wait 3 g".to_string()),
            Kind::Ill(Ill::Volume) => open(self, "wait 20 uL".to_string()),
            Kind::Ill(Ill::Compared) => open(self, "wait until elapsed > 5 mg timeout 3 s".to_string()),
            Kind::Fail(name) => open(self, format!("fail {name} \"meant\"")),
            Kind::Claim(things, body) => {
                let names: Vec<String> = things.iter().map(|t| at.thing(*t)).collect();
                open(self, format!("claim {} {{", names.join(", ")));
                self.inner(at, body);
                self.line(&close, None);
            }
        }
    }

    /// The end of a block that may have one handler of its own.
    fn answered(&mut self, at: &mut At<'_>, pad: &str, on: &str, handler: Option<&Block>) {
        if let Some(block) = handler {
            self.line(&format!("{pad}}} on {on} {{"), None);
            self.inner(at, block);
        }
        self.line(&format!("{pad}}}"), None);
    }

    fn handler(&mut self, at: &mut At<'_>, pad: &str, handler: &Handler) {
        self.line(&format!("{pad}}} on {} {{", handler.on), None);
        match &handler.what {
            Remedy::Retry(n) => self.line(&format!("{pad}    retry {n}"), None),
            Remedy::Block(block) => self.inner(at, block),
        }
    }
}

/// Where the printer is.
struct At<'p> {
    plan: &'p Plan,
    number: usize,
    depth: usize,
}

impl At<'_> {
    fn cup(&self, i: usize) -> String {
        if self.plan.theme == Theme::Tips { format!("plate[{}]", well(i)) } else { format!("c{i}") }
    }

    fn thing(&self, thing: Thing) -> String {
        match thing {
            Thing::Cup(i) => self.cup(i),
            Thing::Oven(i) => format!("o{i}"),
            Thing::Token(i) => format!("t{i}"),
            Thing::Plate(i) => format!("p{i}"),
            Thing::Pipette => "ot2.left".to_string(),
            Thing::Arm => "arm".to_string(),
            Thing::Place(p) => format!("s{p}"),
            Thing::Pump => "pump".to_string(),
        }
    }

    fn condition(&self, c: &Condition) -> String {
        match *c {
            Condition::Dial(d) => format!("d{d}.shown > 0.5"),
            Condition::Fuller(c, v) => format!("{}.contents.volume > {v} uL", self.cup(c)),
            Condition::On(o) => format!("o{o}.burning"),
            Condition::Warm(c, t) => format!("{}.contents.temperature >= {t} degC", self.cup(c)),
            Condition::Made(c, umol) => format!("{}.contents.amount[blue] >= {umol} umol", self.cup(c)),
            Condition::Heavy(grams) => format!("s0.weight > {grams} g"),
        }
    }

    fn action(&self, action: &Action) -> String {
        match *action {
            Action::Drip(v, a, b) => format!("drip {v} uL from {} into {}", self.cup(a), self.cup(b)),
            Action::Tip(v, a, b) => format!("splash {v} uL from {} into {}", self.cup(a), self.cup(b)),
            Action::Strain(v, a, b) => format!("strain {v} uL from {} into {}", self.cup(a), self.cup(b)),
            Action::Double(v, a, b) => format!("double {v} uL from {} into {}", self.cup(a), self.cup(b)),
            Action::Cap(c) => format!("cap {}", self.cup(c)),
            Action::Uncap(c) => format!("uncap {}", self.cup(c)),
            Action::Fire(o) => format!("fire o{o}"),
            Action::Quench(o) => format!("quench o{o}"),
            Action::Open(o) => format!("unlid o{o}"),
            Action::Close(o) => format!("shut o{o}"),
            Action::Heat(p, t) => format!("bring p{p} to {t} degC"),
            Action::Cool(p) => format!("calm p{p}"),
            Action::TakeTip => "pick up tip from tips by ot2.left".to_string(),
            Action::DropTip => "drop tip by ot2.left".to_string(),
            Action::Aspirate(v, c) => format!("aspirate {v} uL from {} by ot2.left", self.cup(c)),
            Action::Dispense(v, c) => format!("dispense {v} uL into {} by ot2.left", self.cup(c)),
            Action::BlowOut(c) => format!("blow out into {} by ot2.left", self.cup(c)),
            Action::Pick(c) => format!("pick c{c} by arm"),
            Action::Place(c, s) => format!("place c{c} on s{s} by arm"),
            Action::PutBack(c) => format!("put back c{c} by arm"),
            Action::Draw(v, c) => format!("draw {v} uL from c{c} by pump"),
            Action::Push(v, c) => format!("push {v} uL into c{c} by pump"),
        }
    }
}

/// The name of a well: `A1`, `B1`, ...
pub fn well(i: usize) -> String {
    format!("{}{}", char::from(b'A' + (i % 8) as u8), i / 8 + 1)
}

fn seconds(ms: u32) -> String {
    let mut out = String::new();
    // Writing to a text cannot fail.
    let _ = write!(out, "{} s", f64::from(ms) / 1000.0);
    out
}
