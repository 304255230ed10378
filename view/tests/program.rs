//! A compiled lab as a document.

use matterix_ir::model::{Content, Domain, Mixture, Model, Observable, Species, State};
use matterix_ir::plan::{Plan, PlanStep, Step, StepId};
use matterix_ir::program::PROGRAM_VERSION;
use matterix_ir::scene::{Frame, Instance, InstanceId, Pose, Scene, Shape};
use matterix_ir::{Op, Program, Sources, Span, Text, Unit};
use matterix_view::document::{Cavity, Finish};
use matterix_view::from_program::from_program;

fn instance(name: &str, shape: Option<Shape>, at: [f64; 3]) -> Instance {
    Instance {
        name: name.into(),
        kind: "Thing".into(),
        capabilities: Vec::new(),
        owner: None,
        link: None,
        support: None,
        pose: Pose::at(at),
        placed: true,
        at: None,
        frames: Vec::new(),
        solids: Vec::new(),
        collision: Vec::new(),
        visual: None,
        inertial: None,
        friction: None,
        force: None,
        stopover: false,
        room: None,
        articulation: None,
        shape,
        span: Span::default(),
    }
}

/// A plate with a place on a table, a beaker with 50 mL on the plate, an oven around a vial.
fn program() -> (Program, Sources) {
    let place = Frame { name: "place".into(), pose: Pose::at([0.0, 0.02, 0.08]), stand: false, link: None };
    let on = |support: u32, i: Instance| Instance { support: Some(InstanceId(support)), ..i };
    let instances = vec![
        instance("table", Some(Shape::Box([1.0, 0.8, 0.05])), [0.0; 3]),
        on(
            0,
            Instance { frames: vec![place], ..instance("plate", Some(Shape::Box([0.2, 0.2, 0.09])), [0.3, 0.0, 0.0]) },
        ),
        on(1, instance("beaker", Some(Shape::Cylinder([0.07, 0.095])), [0.0; 3])),
        Instance { owner: Some(InstanceId(2)), ..instance("beaker.contents", None, [0.0; 3]) },
        on(0, instance("oven", Some(Shape::Box([0.3, 0.3, 0.4])), [-0.3, 0.0, 0.0])),
        on(0, instance("vial", Some(Shape::Cylinder([0.02, 0.05])), [-0.3, 0.0, 0.1])),
    ];
    let mut model = Model::default();
    let initial = model.graph.number(2.0);
    let amount = model.graph.add(Op::State(0));
    let molar = model.graph.number(25e-6);
    let volume = model.graph.binary(matterix_ir::BinaryOp::Mul, amount, molar);
    model.species = vec![Species {
        name: "water".into(),
        formula: "H2O".into(),
        elements: Vec::new(),
        charge: 0,
        molar_mass: 0.018,
        by_mass: false,
        span: Span::default(),
    }];
    let name = "beaker.contents.amount[water]".into();
    let domain = Domain::Quantity(Unit::scaled("mol", 1.0));
    model.states = vec![State { name, domain, initial, scale: Some(1e-6), span: Span::default() }];
    let unit = Unit::scaled("mL", 1e-6);
    model.observables =
        vec![Observable { name: "beaker.contents.volume".into(), value: vec![volume], unit, valid: None }];
    model.mixtures = vec![Mixture {
        instance: InstanceId(3),
        extensive: vec![("amount[water]".into(), 0)],
        contents: vec![Content { species: 0, state: 0, settled: None }],
        properties: vec![0],
        concentrations: Vec::new(),
    }];
    let mut sources = Sources::default();
    let file = sources.add("lab.mtx", "mtx 1\nworkflow w in l {\n    note \"a\"\n}\n");
    let step = |label: &str, start: usize, step: Step| PlanStep {
        label: label.into(),
        span: Span::new(file, start, start + 1),
        step,
    };
    let note = || Step::Note(Text::default());
    let steps = vec![
        step("note a", 30, note()),
        step("note b", 30, note()),
        step("sequence", 6, Step::Sequence(vec![StepId(1)])),
        step("repeat 2", 6, Step::Repeat { times: initial, body: StepId(2) }),
        step("sequence", 6, Step::Sequence(vec![StepId(0), StepId(3)])),
    ];
    let plan = Plan {
        workflow: "w".into(),
        arguments: vec![("target".into(), "40 degC".into())],
        steps,
        root: StepId(4),
        locals: Vec::new(),
        limits: Vec::new(),
        ends: Vec::new(),
    };
    let scene = Scene { lab: "l".into(), instances, ..Scene::default() };
    let files = vec!["lab.mtx".into()];
    (
        Program {
            version: PROGRAM_VERSION,
            files,
            scene,
            model,
            plan,
            inventory: Default::default(),
            drivers: Vec::new(),
            offers: Default::default(),
        },
        sources,
    )
}

#[test]
fn things_stand_on_the_places_of_what_is_below_them() {
    let (program, sources) = program();
    let document = from_program(&program, &sources);
    let at = |name: &str| document.bodies.iter().find(|b| b.name == name).expect("a body").pose.0;
    assert_eq!(at("plate")[..3], [0.3, 0.0, 0.05]);
    assert_eq!(at("beaker")[..3], [0.3, 0.02, 0.13]);
    let finish = |name: &str| document.bodies.iter().find(|b| b.name == name).expect("a body").pieces[0].finish;
    assert_eq!((finish("oven"), finish("beaker"), finish("table")), (Finish::Hull, Finish::Glass, Finish::Matte));
    assert_eq!(document.duration, None);
}

#[test]
fn vessels_hold_what_they_begin_with() {
    let (program, sources) = program();
    let document = from_program(&program, &sources);
    let contents = &document.contents[0];
    let (volume, size) = contents.volume.expect("a volume");
    assert_eq!((document.series[volume as usize].values.as_slice(), size), ([Some(50.0)].as_slice(), 1e-6));
    let body = &document.bodies[contents.body.expect("a vessel") as usize];
    assert_eq!(body.name, "beaker");
    assert!(matches!(body.cavity, Some(Cavity::Round(_))));
}

#[test]
fn the_plan_is_a_tree_without_what_only_orders() {
    let (program, sources) = program();
    let document = from_program(&program, &sources);
    let tree: Vec<(&str, Option<u32>)> = document.plan.iter().map(|n| (n.label.as_str(), n.parent)).collect();
    assert_eq!(tree, [("note a", None), ("repeat 2", None), ("note b", Some(1))]);
    assert_eq!(document.plan[0].place, Some((0, 3)));
    assert_eq!(document.facts, [("target".to_owned(), "40 degC".to_owned())]);
}
