//! What the engine refuses to continue from.

use matterix_ir::model::{Contribution, Flow};
use matterix_ir::{FileId, NodeId, Span, UnaryOp, codes};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Engine, Options};

use crate::engine_model::{Build, assign, close, engine};

fn fails(b: &Build, until: f64) -> Fault {
    let mut engine = engine(&b.model);
    let start = engine.start(&mut ());
    let fault = match start {
        Err(fault) => fault,
        Ok(()) => engine.advance(until, &[], &mut ()).expect_err("a fault"),
    };
    assert!(engine.states().iter().all(|s| s.is_finite()), "{:?}", engine.states());
    assert_ne!(fault.span, Some(Span::default()), "{fault}");
    fault
}

#[test]
fn cascade() {
    let mut b = Build::default();
    let x = b.state("x", 0.0);
    let (one, zero) = (b.num(1.0), b.num(0.0));
    let (up, down) = (b.lt(zero, x), b.lt(x, one));
    b.event("down", up, vec![assign(0, zero)]);
    b.event("up", down, vec![assign(0, one)]);
    let fault = fails(&b, 1.0);
    assert_eq!(fault.code, codes::EVENT_CASCADE);
    assert!(fault.message.contains("down") || fault.message.contains("up"), "{fault}");
}

#[test]
fn chatter_of_a_process() {
    for speed in [1.0, 1e-3, 1e3] {
        let mut b = Build::default();
        let x = b.state("x", 0.0);
        let one = b.num(1.0);
        let cold = b.lt(x, one);
        let (up, down) = (b.num(speed), b.num(-speed));
        let rate = b.model.graph.select(cold, up, down);
        b.rate(0, rate);
        b.process("heating(plate)", Some(cold));
        let fault = fails(&b, 1e4);
        assert_eq!(fault.code, codes::CHATTERING, "{fault}");
        assert!(fault.message.contains("heating(plate)"), "{fault}");
        assert!(fault.help[0].contains("hysteresis"));
        assert!((fault.time - 1.0 / speed).abs() < 2e-3);
    }
}

#[test]
fn chatter_of_events() {
    let mut b = Build::default();
    let (x, on) = (b.state("x", 0.0), b.state("on", 1.0));
    let (one, zero) = (b.num(1.0), b.num(0.0));
    let hot = b.at_least(x, 1.0);
    let cold = b.lt(x, one);
    b.event("off", hot, vec![assign(1, zero)]);
    b.event("on", cold, vec![assign(1, one)]);
    let down = b.num(-1.0);
    let rate = b.model.graph.select(on, one, down);
    b.rate(0, rate);
    assert_eq!(fails(&b, 10.0).code, codes::CHATTERING);
}

/// A line of a process.
fn line(process: u32, node: NodeId, start: u32) -> Contribution {
    Contribution { process, node, span: Span { file: FileId(0), start, end: start + 5 } }
}

#[test]
fn a_law_that_adds_to_a_flow_is_blamed_not_the_one_that_uses_it() {
    let mut b = Build::default();
    let (_, gap) = (b.state("body.enthalpy", 1.0), b.state("lamp.gap", 0.0));
    let one = b.num(1.0);
    let (steady, broken) = (b.num(2.0), b.div(one, gap));
    let flow = b.model.graph.add(matterix_ir::Op::Binary(matterix_ir::BinaryOp::Add, steady, broken));
    b.rate(0, flow);
    ["sun(body)", "lamp(body)", "balance(body)"].into_iter().for_each(|name| b.process(name, None));
    b.model.derivatives[0].terms = vec![line(2, flow, 30)];
    let terms = vec![line(0, steady, 10), line(1, broken, 20)];
    b.model.flows.push(Flow { name: "body.heat_flow".into(), node: flow, terms });
    let fault = fails(&b, 1.0);
    assert!(fault.message.contains("a division by zero in `lamp(body)`, where `lamp.gap` is 0"), "{fault}");
    assert_eq!(fault.span.map(|s| s.start), Some(20));
    assert_eq!(fault.help, ["it is part of `body.heat_flow`"]);
}

#[test]
fn a_process_that_rests_is_not_blamed() {
    let mut b = Build::default();
    let (x, zero) = (b.state("x", 1.0), b.state("zero", 0.0));
    let one = b.num(1.0);
    let (rests, broken) = (b.div(x, zero), b.div(one, zero));
    let off = b.lt(one, zero);
    let gated = b.only_if(off, rests);
    let rate = b.model.graph.add(matterix_ir::Op::Binary(matterix_ir::BinaryOp::Add, gated, broken));
    b.rate(0, rate);
    b.process("rests", Some(off));
    b.process("runs", None);
    b.model.derivatives[0].terms = vec![line(0, rests, 10), line(1, broken, 20)];
    let fault = fails(&b, 1.0);
    assert!(fault.message.contains("in `runs`"), "{fault}");
}

#[test]
fn division_by_zero_at_the_start() {
    let mut b = Build::default();
    let (_, y) = (b.state("beaker.temperature", 300.0), b.state("mass", 0.0));
    let one = b.num(1.0);
    let rate = b.div(one, y);
    b.rate(0, rate);
    b.process("heating", None);
    let fault = fails(&b, 1.0);
    assert_eq!(fault.code, codes::NOT_A_NUMBER);
    assert!(fault.message.contains("`beaker.temperature`") && fault.message.contains("division by zero"), "{fault}");
    assert!(fault.help[0].contains("`heating`"), "{fault:?}");
    assert_eq!(fault.span.map(|s| s.start), Some(1));
}

/// x' = x^2 from 1 reaches infinity at 1 s.
#[test]
fn explosion() {
    let mut b = Build::default();
    let x = b.state("amount", 1.0);
    let rate = b.mul(x, x);
    b.rate(0, rate);
    let fault = fails(&b, 10.0);
    assert!([codes::INTEGRATION_FAILED, codes::NOT_A_NUMBER].contains(&fault.code), "{fault}");
    assert!(fault.message.contains("`amount`"), "{fault}");
    assert!((fault.time - 1.0).abs() < 1e-3, "{fault}");
}

/// A root of what becomes negative: the law ends at 1 s.
#[test]
fn end_of_a_domain() {
    let mut b = Build::default();
    let x = b.state("level", 1.0);
    let root = b.model.graph.unary(UnaryOp::Sqrt, x);
    let one = b.num(1.0);
    let sum = b.add(root, one);
    let rate = b.scale(-1.0, sum);
    b.rate(0, rate);
    let fault = fails(&b, 10.0);
    assert!(fault.message.contains("`level`"), "{fault}");
}

#[test]
fn an_assignment_that_is_not_a_number() {
    let mut b = Build::default();
    b.state("x", 1.0);
    let unset = b.local(0);
    let mut engine = engine(&b.model);
    let fault = engine.apply(&[assign(0, unset)], &mut ()).expect_err("a value not set");
    assert_eq!(fault.code, codes::NOT_A_NUMBER);
}

#[test]
fn an_initial_state_that_is_not_finite() {
    let mut b = Build::default();
    b.state("x", f64::INFINITY);
    let fault = Engine::new(&b.model, vec![], 0, Options::default()).err().expect("a fault");
    assert_eq!(fault.code, codes::NOT_A_NUMBER);
    assert!(fault.message.contains("`x`"));
}

/// A level that falls with the root of what is above an outlet comes to it in a finite time: whatever becomes of it there, the run ends.
#[test]
fn a_root_that_comes_to_nothing_does_not_hold_up_the_run() {
    let mut b = Build::default();
    let level = b.state("level", 0.1);
    let outlet = b.num(0.01);
    let above = b.sub(level, outlet);
    let share = b.scale(10.0, above);
    let root = b.model.graph.unary(matterix_ir::UnaryOp::Sqrt, share);
    let rate = b.scale(-0.02, root);
    b.rate(0, rate);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    match engine.advance(60.0, &[], &mut ()) {
        Ok(_) => close(engine.states()[0], 0.01, 1e-6),
        Err(fault) => assert!(!fault.message.is_empty()),
    }
}
