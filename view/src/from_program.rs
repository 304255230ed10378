//! A compiled lab as a document: where things stand, what is in them and what is to be done, before anything happened.

use matterix_ir::graph::eval_op;
use matterix_ir::plan::{Plan, Step};
use matterix_ir::robot::Placement;
use matterix_ir::scene::{Instance, InstanceId, Shape};
use matterix_ir::{Env, NodeId, Op, Program, Sources, Span};

use crate::bench::{self, Owners, Thing};
use crate::document::{Contents, DOCUMENT_VERSION, Document, Node, Origin, Series, Source};
use crate::units;

/// The lab of a program at the start, with the plan of its workflow.
pub fn from_program(program: &Program, sources: &Sources) -> Document {
    let scene = &program.scene;
    let mixtures = &program.model.mixtures;
    let stands = scene.stands();
    let holds = |i: usize| {
        let owner = |id: InstanceId| scene.instances.get(id.0 as usize).and_then(|part| part.owner).unwrap_or(id);
        mixtures.iter().any(|m| owner(m.instance).0 as usize == i)
    };
    let thing = |(i, instance): (usize, &Instance)| Thing {
        name: instance.name.clone(),
        kind: instance.kind.clone(),
        shapes: shapes(instance),
        visual: instance.visual.clone(),
        at: scene.in_lab(InstanceId(i as u32), |id| stands.get(id.0 as usize).copied()),
        frames: instance.frames.iter().filter(|f| !f.stand).map(|f| (f.name.clone(), f.pose)).collect(),
        holds: holds(i),
        link: false,
    };
    let things: Vec<Thing> = scene.instances.iter().enumerate().map(thing).collect();
    let mut meshes = Vec::new();
    let (bodies, owners) = bench::bodies(&things, &mut meshes);
    let mut document = Document {
        version: DOCUMENT_VERSION,
        workflow: program.plan.workflow.clone(),
        lab: scene.lab.clone(),
        facts: program.plan.arguments.clone(),
        bodies,
        meshes,
        ..Document::default()
    };
    contents(program, &owners, &mut document);
    plan(&program.plan, sources, &mut document);
    document
}

/// All shapes of an instance.
fn shapes(instance: &Instance) -> Vec<(Placement, Shape, Option<[f32; 4]>)> {
    let main = instance.shape.iter().map(|shape| (Placement::default(), shape.clone(), None));
    main.chain(instance.solids.iter().map(|s| (s.pose, s.shape.clone(), None))).collect()
}

/// What is in vessels before anything happens, as series of one value.
fn contents(program: &Program, owners: &Owners, document: &mut Document) {
    let model = &program.model;
    let initial = evaluate(program, model.states.iter().map(|s| s.initial).collect(), &[]);
    let observed = model.observables.iter().flat_map(|o| o.value.iter().copied()).collect();
    let mut values = evaluate(program, observed, &initial).into_iter();
    let observables: Vec<Vec<f64>> =
        model.observables.iter().map(|o| values.by_ref().take(o.value.len()).collect()).collect();

    document.axes = vec![vec![0.0]];
    for mixture in &model.mixtures {
        let Some(instance) = program.scene.instances.get(mixture.instance.0 as usize) else { continue };
        let body = owners.of(&instance.name);
        let owner = instance.owner.and_then(|id| program.scene.instances.get(id.0 as usize));
        let inside = owners.get(owner.map_or(instance.name.as_str(), |o| o.name.as_str()));
        let mut made = Contents { name: instance.name.clone(), body: inside, ..Contents::default() };
        let add = |series: &mut Vec<Series>, name: &str, label: &str, unit: &str, value: f64| {
            let values = vec![Some(value as f32).filter(|v| v.is_finite())];
            let (name, label, unit) = (name.to_owned(), label.to_owned(), unit.to_owned());
            series.push(Series { name, label, body, origin: Origin::Contents, unit, axis: 0, values });
            series.len() as u32 - 1
        };
        let label = |name: &str| {
            let rest = name.strip_prefix(instance.name.as_str()).unwrap_or(name);
            rest.trim_start_matches(['.', '[']).trim_end_matches(']').to_owned()
        };
        let series = &mut document.series;
        let mut properties = Vec::new();
        for (observable, value) in mixture.properties.iter().filter_map(|&i| {
            let i = i as usize;
            model.observables.get(i).zip(observables.get(i))
        }) {
            let unit = &observable.unit;
            match value.as_slice() {
                [one] => {
                    let shown = unit.of_si(*one);
                    let index = add(series, &observable.name, &label(&observable.name), &unit.symbol, shown);
                    if let (None, Some(size)) = (made.volume, units::volume(&unit.symbol)) {
                        made.volume = Some((index, size));
                    }
                    properties.push(index);
                }
                [r, g, b] if made.color.is_none() && unit.symbol.is_empty() => {
                    made.color = Some([*r, *g, *b].map(|v| add(series, &observable.name, "color", "", v)));
                }
                _ => {}
            }
        }
        let concentrations: Vec<u32> = mixture
            .concentrations
            .iter()
            .filter_map(|&i| Some((model.observables.get(i as usize)?, *observables.get(i as usize)?.first()?)))
            .filter(|(_, value)| *value != 0.0)
            .map(|(o, value)| add(series, &o.name, &label(&o.name), &o.unit.symbol, o.unit.of_si(value)))
            .collect();
        let solids = mixture.contents.iter().filter(|content| model.is_solid(content)).filter_map(|content| {
            let i = content.settled? as usize;
            Some((
                model.observables.get(i)?,
                *observables.get(i)?.first()?,
                model.species.get(content.species as usize)?,
            ))
        });
        let solids: Vec<u32> = solids
            .filter(|(_, amount, _)| *amount > 0.0)
            .map(|(o, amount, s)| {
                add(
                    series,
                    &format!("{}.solid[{}]", instance.name, s.name),
                    &s.name,
                    &o.unit.symbol,
                    o.unit.of_si(amount),
                )
            })
            .collect();
        made.groups = vec![("properties".to_owned(), properties), ("concentrations".to_owned(), concentrations)];
        if !solids.is_empty() {
            made.groups.push(("solids".to_owned(), solids));
        }
        document.contents.push(made);
    }
}

/// The values of nodes at the start; a number that is not known then is none.
fn evaluate(program: &Program, wanted: Vec<NodeId>, states: &[f64]) -> Vec<f64> {
    let model = &program.model;
    let mut states = states.to_vec();
    states.resize(model.states.len(), f64::NAN);
    let params: Vec<f64> = model.params.iter().map(|p| p.value).collect();
    let locals = vec![f64::NAN; program.plan.locals.len()];
    let readings = vec![f64::NAN; model.readings.len()];
    let env = Env { time: 0.0, states: &states, params: &params, locals: &locals, readings: &readings };
    let mut values = vec![f64::NAN; model.graph.ops().len()];
    for node in model.graph.schedule(wanted.iter().copied()) {
        values[node.0 as usize] = match model.graph.op(node) {
            Op::Solved(call, _) => model.graph.call(call).value(|arg| values[arg.0 as usize]),
            op => eval_op(op, env, &values),
        };
    }
    wanted.iter().map(|n| values.get(n.0 as usize).copied().unwrap_or(f64::NAN)).collect()
}

/// The plan from the top down; nodes that only order others are left out.
fn plan(plan: &Plan, sources: &Sources, document: &mut Document) {
    let mut stack = vec![(plan.root, None)];
    let mut seen = vec![false; plan.steps.len()];
    while let Some((id, parent)) = stack.pop() {
        let i = id.0 as usize;
        let Some(node) = plan.steps.get(i).filter(|_| !seen[i]) else { continue };
        seen[i] = true;
        let hidden = id == plan.root || matches!(node.step, Step::Sequence(_) | Step::Guarded { .. });
        let below = if hidden {
            parent
        } else {
            let place = place(sources, node.span, &mut document.sources);
            document.plan.push(Node { parent, label: node.label.clone(), place, runs: Vec::new() });
            Some(document.plan.len() as u32 - 1)
        };
        stack.extend(node.step.children().into_iter().rev().map(|child| (child, below)));
    }
}

/// File and line of a span; the file is added if it is new.
fn place(sources: &Sources, span: Span, known: &mut Vec<Source>) -> Option<(u32, u32)> {
    let source = sources.get(span.file)?;
    let (line, _) = sources.line_column(span);
    let index = known.iter().position(|s| s.name == source.name).unwrap_or_else(|| {
        known.push(Source { name: source.name.clone(), text: source.text.clone() });
        known.len() - 1
    });
    Some((index as u32, line as u32))
}
