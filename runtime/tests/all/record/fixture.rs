//! A small lab, written by hand, and a run of it.

use std::collections::BTreeMap;

use matterix_ir::model::{
    Balance, Content, Derivative, Domain, Event, Mixture, Model, Observable, Param, Process, Reading, Species, State,
};
use matterix_ir::plan::{Local, Plan, PlanStep, Step, StepId};
use matterix_ir::scene::{Frame, Instance, InstanceId, Pose, Scene, Shape};
use matterix_ir::{BinaryOp, Diagnostic, FileId, Op, Program, Sources, Span, Unit, codes};
use matterix_runtime::exec::{Measured, StepState};
use matterix_runtime::record::{Expectation, Failure, Level, Recording, Run, RunInfo, Series, Status};
use matterix_runtime::run::{Fidelity, Finding};

pub(super) const TEXT: &str = "mtx 1\nlab bench {\n}\nworkflow synthesize in bench {\n    wait 2 s\n    heat hotplate to 76.33 degC\n    place beaker on hotplate by panda\n    expect beaker.contents[EtI] in 0.90 mol/kg .. 0.92 mol/kg\n}\n";

/// A program, its text and what is known of its run.
pub(super) struct Lab {
    pub(super) program: Program,
    pub(super) sources: Sources,
    pub(super) recording: Recording,
    pub(super) info: RunInfo,
}

impl Lab {
    pub(super) fn run(&self) -> Run<'_> {
        Run { program: &self.program, recording: &self.recording, sources: &self.sources, info: &self.info }
    }
}

pub(super) fn degc() -> Unit {
    Unit { symbol: "degC".into(), factor: 1.0, offset: 273.15 }
}

/// The span of the nth line of [`TEXT`].
fn line(n: usize) -> Span {
    let start = TEXT.lines().take(n - 1).map(|l| l.len() + 1).sum::<usize>();
    Span::new(FileId(0), start, start + 4)
}

fn instance(name: &str, kind: &str, support: Option<u32>, at: [f64; 3], shape: Option<Shape>) -> Instance {
    Instance {
        name: name.into(),
        kind: kind.into(),
        capabilities: vec![],
        owner: None,
        link: None,
        support: support.map(InstanceId),
        pose: Pose::at(at),
        placed: true,
        at: None,
        frames: vec![],
        shape,
        solids: Vec::new(),
        collision: Vec::new(),
        visual: None,
        inertial: None,
        friction: None,
        force: None,
        stopover: false,
        room: None,
        articulation: None,
        span: line(2),
    }
}

fn scene() -> Scene {
    let place = Frame { name: "place".into(), pose: Pose::up(0.13), stand: false, link: None };
    let mut hotplate = instance("hotplate", "IkaRet", Some(0), [0.55, 0.2, 0.0], Some(Shape::Box([0.16, 0.27, 0.1])));
    hotplate.frames.push(place);
    let mut contents = instance("beaker.contents", "Mixture", None, [0.0; 3], None);
    contents.owner = Some(InstanceId(2));
    let instances = vec![
        instance("table", "OpticalTable", None, [0.0; 3], Some(Shape::Box([1.2, 0.8, 0.75]))),
        hotplate,
        instance("beaker", "Beaker250mL", Some(0), [0.45, -0.25, 0.0], Some(Shape::Cylinder([0.07, 0.095]))),
        contents,
        instance("panda", "FrankaPanda", Some(0), [0.0; 3], Some(Shape::Cylinder([0.15, 0.6]))),
    ];
    Scene { lab: "bench".into(), instances, ..Scene::default() }
}

fn state(name: &str, domain: Domain, initial: matterix_ir::NodeId) -> State {
    State { name: name.into(), domain, initial, scale: Some(1e-6), span: line(2) }
}

fn species(name: &str, formula: &str, molar_mass: f64) -> Species {
    Species {
        name: name.into(),
        formula: formula.into(),
        elements: vec![],
        charge: 0,
        molar_mass,
        by_mass: false,
        span: line(2),
    }
}

/// States: hotplate.temperature, hotplate.target, hotplate.active, beaker.support, enthalpy, EtOH, EtI, heat out.
fn model() -> Model {
    let mut model = Model::default();
    let graph = &mut model.graph;
    let zero = graph.number(0.0);
    let room = graph.number(298.15);
    let table = graph.number(0.0);
    let enthalpy = graph.add(Op::State(4));
    let scale = graph.number(1000.0);
    let [etoh, eti] = [5, 6].map(|i| graph.add(Op::State(i)));
    let carbon = graph.binary(BinaryOp::Add, etoh, eti);
    let capacity = graph.number(41.75);
    let warm = graph.binary(BinaryOp::Div, enthalpy, capacity);
    let temperature = graph.binary(BinaryOp::Add, warm, room);
    let active = graph.add(Op::State(2));
    let kelvin = || Domain::Quantity(degc());
    let mole = || Domain::Quantity(Unit::scaled("mol", 1.0));
    let joule = || Domain::Quantity(Unit::scaled("J", 1.0));
    model.states = vec![
        state("hotplate.temperature", kelvin(), room),
        state("hotplate.target", kelvin(), room),
        state("hotplate.active", Domain::Bool, zero),
        state("beaker.support", Domain::Instance, table),
        state("beaker.contents.enthalpy", joule(), zero),
        state("beaker.contents.amount[EtOH]", mole(), zero),
        state("beaker.contents.amount[EtI]", mole(), zero),
        state("energy through convection(beaker)", joule(), zero),
    ];
    model.derivatives = [0, 4, 5, 6, 7].map(|state| Derivative::new(state, zero)).to_vec();
    model.params = vec![Param { name: "hotplate.gain".into(), value: 70.09, unit: Unit::one(), span: line(2) }];
    let process = |name: &str, guard| Process { name: name.into(), guard, span: line(2) };
    model.processes = vec![
        process("heating(hotplate)", Some(active)),
        process("convection(beaker)", None),
        process("mass_action(beaker.contents, ethyl_iodide)", Some(active)),
    ];
    model.events =
        vec![Event { name: "contact(beaker, hotplate)".into(), when: active, actions: vec![], span: line(2) }];
    model.readings = vec![Reading {
        name: "hotplate.probe".into(),
        instance: InstanceId(1),
        value: temperature,
        resolution: None,
        noise: None,
        period: None,
        unit: degc(),
        span: line(2),
    }];
    model.species = vec![species("EtOH", "C2H6O", 0.046_069), species("EtI", "C2H5I", 0.155_966)];
    let observable = |name: &str, value: Vec<_>, unit| Observable { name: name.into(), value, unit, valid: None };
    model.observables = vec![
        observable("beaker.contents.temperature", vec![temperature], degc()),
        observable("beaker.contents.color", vec![zero, zero, zero], Unit::one()),
        observable("beaker.contents[EtOH]", vec![etoh], Unit::scaled("mol/kg", 1.0)),
        observable("beaker.contents[EtI]", vec![eti], Unit::scaled("mol/kg", 1.0)),
    ];
    model.mixtures = vec![Mixture {
        instance: InstanceId(3),
        extensive: vec![("amount[EtI]".into(), 6), ("amount[EtOH]".into(), 5), ("enthalpy".into(), 4)],
        contents: vec![
            Content { species: 0, state: 5, settled: None },
            Content { species: 1, state: 6, settled: None },
        ],
        properties: vec![0, 1],
        concentrations: vec![2, 3],
    }];
    model.balances = vec![
        Balance {
            name: "energy".into(),
            total: enthalpy,
            exchanges: vec![7],
            unit: Unit::scaled("kJ", 1000.0),
            magnitude: scale,
            terms: vec![],
            doubts: vec![],
        },
        Balance {
            name: "element C".into(),
            total: carbon,
            exchanges: vec![],
            unit: Unit::scaled("mmol", 1e-3),
            magnitude: carbon,
            terms: vec![],
            doubts: vec![],
        },
    ];
    model
}

fn plan(model: &mut Model) -> Plan {
    let two = model.graph.number(2.0);
    let step = |label: &str, n, step| PlanStep { label: label.into(), span: line(n), step };
    let ids = |list: &[u32]| list.iter().map(|&i| StepId(i)).collect::<Vec<_>>();
    let wait = || Step::Wait { duration: two };
    let record = Step::Record { name: "probe".into(), value: vec![two], unit: degc(), every: two };
    let grow = Step::Named { name: "grow".into(), start: 0, end: 1, body: StepId(2) };
    let steps = vec![
        step("sequence", 4, Step::Sequence(ids(&[1, 3, 4, 5, 6, 7]))),
        step("step grow", 5, grow),
        step("wait 2 s", 5, wait()),
        step("heat hotplate to 76.33 degC", 6, wait()),
        step("place beaker on hotplate by panda", 7, wait()),
        step("expect beaker.contents[EtI] in 0.90 mol/kg .. 0.92 mol/kg", 8, Step::Expect(vec![])),
        step("record probe every 1 s", 8, record),
        step("stop heating hotplate", 8, wait()),
    ];
    let local = |name: &str| Local { name: name.into(), unit: Unit::scaled("s", 1.0) };
    Plan {
        workflow: "synthesize".into(),
        arguments: vec![("target".into(), "76.33 degC".into())],
        steps,
        root: StepId(0),
        locals: vec![local("grow.start"), local("grow.end")],
        limits: Vec::new(),
        ends: Vec::new(),
    }
}

/// All that is there at a time.
pub(super) struct Sample {
    pub(super) time: f64,
    pub(super) states: [f64; 8],
    pub(super) observables: [Vec<f64>; 4],
}

/// Every 0.5 s to 2000 s: heating to 1010.5 s, cooling then, drawn with exponentials; the beaker meets the plate at 8 s.
pub(super) fn samples() -> Vec<Sample> {
    let rise = |t: f64, tau: f64| 1.0 - (-t / tau).exp();
    let sample = |i: i32| {
        let t = f64::from(i) * 0.5;
        let on = (2.0..1010.5).contains(&t);
        let heated = if t < 1010.5 { rise((t - 2.0).max(0.0), 150.0) } else { (-(t - 1010.5) / 250.0).exp() };
        let plate = 298.15 + 49.0 * heated;
        let enthalpy = 41.75 * 34.0 * heated * rise(t, 60.0);
        let done = 0.0109 * rise((t - 11.4).max(0.0), 400.0);
        let (etoh, eti) = (0.012 - done, done);
        let fade = done / 0.012;
        let states = [
            plate,
            if on { 349.48 } else { 298.15 },
            f64::from(u8::from(on)),
            f64::from(u8::from(t >= 8.0)),
            enthalpy,
            etoh,
            eti,
            enthalpy,
        ];
        let temperature = enthalpy / 41.75 + 298.15;
        let observables =
            [vec![temperature], vec![0.9, 0.9 - 0.6 * fade, 0.95 - 0.9 * fade], vec![etoh * 83.0], vec![eti * 83.0]];
        Sample { time: t, states, observables }
    };
    (0..=4000).map(sample).collect()
}

/// The samples, and what happened.
fn recording(program: &Program) -> Recording {
    let mut r = Recording::within(program, 0.0);
    let all = samples();
    for sample in &all {
        r.sample(sample.time, &sample.states, &sample.observables);
    }
    for i in 0..=200 {
        let t = all[20 * i].time;
        let temperature = all[20 * i].observables[0][0];
        r.reading(t, 0, temperature);
        r.value(t, "probe", &[temperature]);
    }
    let spans = [
        (1, 0.0, 2.0),
        (2, 0.0, 2.0),
        (3, 2.0, 2.0),
        (4, 2.0, 8.0),
        (6, 8.0, 8.0),
        (7, 1010.5, 1010.5),
        (5, 2000.0, 2000.0),
    ];
    r.step(0.0, StepId(0), StepState::Running);
    for (step, start, end) in spans {
        r.step(start, StepId(step), StepState::Running);
        r.step(end, StepId(step), if step == 5 { StepState::Failed } else { StepState::Done });
    }
    r.step(2000.0, StepId(0), StepState::Done);
    r.process(2.0, 0, true);
    r.process(1010.5, 0, false);
    r.process(11.4, 2, true);
    r.process(1639.9, 2, false);
    r.event(8.0, 0);
    r.log(2.0, Level::Info, "plate on & warming < 80 °C", Some(line(6)));
    r.log(2000.0, Level::Warning, "a \u{1} control character", None);
    let measured = Measured {
        text: "beaker.contents[EtI] in 0.90 mol/kg .. 0.92 mol/kg".into(),
        value: Some(0.8985),
        low: Some(0.90),
        high: Some(0.92),
        unit: Unit::scaled("mol/kg", 1.0),
    };
    let text = measured.text.clone();
    r.expectation(Expectation { time: 2000.0, text, span: line(8), passed: false, measured: vec![measured] });
    r
}

/// The lab and its run.
pub(super) fn lab() -> Lab {
    let mut model = model();
    let plan = plan(&mut model);
    let program = Program {
        version: 1,
        files: vec!["sn1.mtx".into()],
        scene: scene(),
        model,
        plan,
        inventory: Default::default(),
        drivers: Vec::new(),
        offers: Default::default(),
    };
    let mut sources = Sources::default();
    sources.add("sn1.mtx", TEXT);
    let info = RunInfo {
        language: 1,
        seed: 7,
        fidelity: Fidelity::Process,
        status: Status::Missed,
        failure: Some(Failure {
            name: "slip".into(),
            text: "the beaker slipped".into(),
            time: 6.5,
            span: Some(line(7)),
            trace: vec![StepId(4), StepId(0)],
        }),
        findings: vec![Finding {
            time: 6.0,
            diagnostic: Diagnostic::warning(codes::INCOMPATIBLE_MIX, line(7), "`EtI` and `EtOH` have met", "here"),
        }],
        integrator: BTreeMap::from([("steps".into(), 128), ("rejected".into(), 3)]),
    };
    Lab { recording: recording(&program), program, sources, info }
}

/// Points in a curve to the last bit.
pub(super) fn series(points: &[(f64, f64)]) -> Series {
    let mut series = Series::new(0.0);
    points.iter().for_each(|(time, value)| series.push(*time, *value));
    series
}
