//! A backend whose time is the clock's, and that looks after what is asked while time passes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use matterix_ir::plan::{Operation, StepId};
use matterix_ir::{NodeId, codes};
use matterix_runtime::backend::{Backend, Follow, Status, Ticket};
use matterix_runtime::exec::{Alarm, Listener};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Advance, Watch};

use super::Desk;

/// Longest time in which nobody looks at what is asked.
const TICK: Duration = Duration::from_millis(5);

/// Another backend, no faster than the clock.
pub struct Paced<'b, 'd, 'p> {
    inner: &'b mut dyn Backend,
    desk: &'d Desk<'p>,
    cancel: &'d AtomicBool,
    begun: (f64, Instant),
    speed: f64,
}

impl<'b, 'd, 'p> Paced<'b, 'd, 'p> {
    /// Lab time passes `speed` times as fast as the clock.
    #[allow(clippy::disallowed_methods, reason = "who calls a lab lives by the wall clock")]
    pub fn new(inner: &'b mut dyn Backend, desk: &'d Desk<'p>, cancel: &'d AtomicBool, speed: f64) -> Self {
        let begun = (inner.now(), Instant::now());
        Paced { inner, desk, cancel, begun, speed }
    }

    #[allow(clippy::disallowed_methods, reason = "who calls a lab lives by the wall clock")]
    fn clock(&self) -> f64 {
        self.begun.0 + self.begun.1.elapsed().as_secs_f64() * self.speed
    }

    /// Answers what is asked of the lab as it is.
    fn answer(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        while let Some((read, node, kind)) = self.desk.next_read() {
            match self.inner.observe(node, out) {
                Ok(value) => self.desk.answer(read, kind, value),
                // One who asks for what a device does not tell now is told so; others are left alone.
                Err(fault) if matches!(fault.code, codes::DEVICE_GARBLED | codes::DEVICE_REFUSED) => {
                    self.desk.refuse(read, fault.message);
                }
                Err(fault) => {
                    self.desk.refuse(read, fault.message.clone());
                    return Err(fault);
                }
            }
        }
        self.measure(out)?;
        self.desk.tell(self.inner.now());
        Ok(())
    }

    /// Works out how long commands take that have just begun.
    fn measure(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        for (step, node) in self.desk.unmeasured() {
            let takes = self.inner.value(node, out)?.unwrap_or(0.0);
            self.desk.measured(step, takes);
        }
        Ok(())
    }
}

impl Backend for Paced<'_, '_, '_> {
    fn now(&self) -> f64 {
        self.inner.now()
    }

    fn moment_after(&mut self, duration: f64) -> f64 {
        self.inner.moment_after(duration)
    }

    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.inner.value(node, out)
    }

    fn defined(&mut self, node: NodeId) -> Result<(), Fault> {
        self.inner.defined(node)
    }

    fn observe(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.inner.observe(node, out)
    }

    fn limit(&mut self, limit: u32, condition: NodeId, out: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        self.inner.limit(limit, condition, out)
    }

    fn broken(&self) -> Vec<u32> {
        self.inner.broken()
    }

    fn decide(&self, limit: u32) -> Vec<Vec<u32>> {
        self.inner.decide(limit)
    }

    fn may_change(&self, operation: &Operation, condition: NodeId) -> bool {
        self.inner.may_change(operation, condition)
    }

    fn follow(&mut self, condition: NodeId) -> Follow {
        self.inner.follow(condition)
    }

    fn set_local(&mut self, local: u32, value: Option<f64>) {
        self.desk.kept(local, value);
        self.inner.set_local(local, value);
    }

    fn foresee(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Option<Alarm> {
        self.inner.foresee(step, operation, out)
    }

    fn start(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        // How long a command takes follows from what it finds, as in a run, not from what it does.
        self.measure(out)?;
        self.inner.start(step, operation, out)
    }

    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        self.inner.poll(ticket, out)
    }

    fn halt(&mut self, ticket: Ticket) {
        self.inner.halt(ticket);
    }

    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        loop {
            let waiting = self.desk.look();
            self.answer(out)?;
            let target = until.min(self.clock()).max(self.inner.now());
            match self.inner.advance(target, watches, out)? {
                stopped @ (Advance::Watch(_) | Advance::Broken(_)) => return Ok(stopped),
                Advance::Reached if self.inner.now() >= until => return Ok(Advance::Reached),
                Advance::Reached => {}
            }
            if waiting || self.cancel.load(Ordering::Relaxed) {
                return Ok(Advance::Watch(Vec::new()));
            }
            std::thread::sleep(TICK);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use matterix_ir::offer::{Arranged, Offer};
    use matterix_ir::plan::{Plan, PlanStep, Step, Takes};
    use matterix_ir::scene::Scene;
    use matterix_ir::{Sources, Span};
    use matterix_sila_wire::{Call, Request, news};

    use super::super::desk::Attendant;
    use super::super::features::Catalogue;
    use super::*;

    /// A backend that notes the order in which it is asked.
    #[derive(Default)]
    struct Noting {
        asked: Vec<&'static str>,
    }

    impl Backend for Noting {
        fn now(&self) -> f64 {
            0.0
        }

        fn value(&mut self, _: NodeId, _: &mut dyn Listener) -> Result<Option<f64>, Fault> {
            self.asked.push("value");
            Ok(Some(2.0))
        }

        fn follow(&mut self, _: NodeId) -> Follow {
            Follow::Assumed
        }

        fn set_local(&mut self, _: u32, _: Option<f64>) {}

        fn start(&mut self, _: StepId, _: &Operation, _: &mut dyn Listener) -> Result<Ticket, Fault> {
            self.asked.push("start");
            Ok(Ticket(0))
        }

        fn poll(&mut self, _: Ticket, _: &mut dyn Listener) -> Result<Status, Fault> {
            Ok(Status::Done)
        }

        fn halt(&mut self, _: Ticket) {}

        fn advance(&mut self, _: f64, _: &[Watch], _: &mut dyn Listener) -> Result<Advance, Fault> {
            Ok(Advance::Reached)
        }
    }

    fn heats() -> Operation {
        let takes = Some(Takes { nominal: NodeId(0), bounds: None });
        Operation { verb: "heat".to_owned(), takes, ..Operation::default() }
    }

    #[test]
    fn how_long_a_command_takes_is_asked_before_it_does_anything() {
        let step = Step::Operation(Box::new(heats()));
        let plan = Plan {
            workflow: String::new(),
            arguments: Vec::new(),
            steps: vec![PlanStep { label: "heat".to_owned(), span: Span::default(), step }],
            root: StepId(0),
            locals: Vec::new(),
            limits: Vec::new(),
            ends: Vec::new(),
        };
        let offer = Offer {
            device: None,
            capability: String::new(),
            verb: "heat".to_owned(),
            docs: String::new(),
            parameters: Vec::new(),
            arrangements: vec![Arranged { things: Vec::new(), locals: Vec::new(), step: StepId(0), result: None }],
            lasts: true,
            result: None,
            fails: Vec::new(),
        };
        let (scene, sources, cancel) = (Scene::default(), Sources::default(), AtomicBool::new(false));
        let catalogue = Catalogue { features: Vec::new(), commands: vec![vec![&offer]], properties: vec![Vec::new()] };
        let (ask, requests) = channel();
        let desk = Desk::new(catalogue, &scene, &plan, requests);
        let (told, mut heard) = news::unbounded_channel();
        ask.send(Request::Call(Call {
            feature: 0,
            command: 0,
            arguments: Vec::new(),
            user: None,
            news: told,
            cancelled: Default::default(),
        }))
        .expect("it is open");
        let mut say = |_: &str| {};
        let mut listener = Attendant::new(&desk, &sources, &mut say);
        let begun = listener.asked(0.0);
        assert_eq!(begun.len(), 1);
        let mut backend = Noting::default();
        {
            let mut paced = Paced::new(&mut backend, &desk, &cancel, 1.0);
            paced.start(StepId(0), &heats(), &mut listener).expect("it starts");
            paced.answer(&mut listener).expect("it answers");
        }
        assert_eq!(backend.asked, ["value", "start"]);
        assert!(heard.try_recv().is_ok());
    }
}
