//! Lines that several devices share: a port is opened once, and each device speaks over it in its turn.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::rc::{Rc, Weak};
use std::time::Duration;

use matterix_ir::wire::Driver;

use crate::debt::Debt;
use crate::place::Place;
use crate::port::Port;
use crate::world::World;

/// A port that is open; none once it has failed, for all of its devices.
#[derive(Default)]
struct Wire {
    port: RefCell<Option<Box<dyn Port>>>,
    debt: Rc<Debt>,
}

/// A world whose ports are opened once each, as long as somebody uses them.
pub struct Shared {
    clock: Rc<Clock>,
    world: Rc<dyn World>,
    open: RefCell<BTreeMap<String, Weak<Wire>>>,
}

impl Shared {
    /// The same world with shared ports.
    pub fn new(world: Rc<dyn World>) -> Self {
        let seen = Cell::new(world.elapsed());
        let clock = Rc::new(Clock { world: Rc::clone(&world), seen, held_up: Cell::default() });
        Shared { clock, world, open: RefCell::default() }
    }
}

/// Shorter than this a busy machine may always hold a process up.
const HELD_UP: Duration = Duration::from_secs(2);

/// Measures how long waits last that are bounded, and what is between them.
struct Clock {
    world: Rc<dyn World>,
    /// When it was last seen that this process goes on.
    seen: Cell<Duration>,
    held_up: Cell<Duration>,
}

impl Clock {
    /// Does what takes so long at most, unless this process is held up.
    fn within<T>(&self, most: Duration, act: impl FnOnce() -> T) -> T {
        self.goes_on(Duration::ZERO);
        let done = act();
        self.goes_on(most);
        done
    }

    /// It goes on now, and so long of what has passed since it was last seen was asked for.
    fn goes_on(&self, asked: Duration) {
        let now = self.world.elapsed();
        let beyond = now.saturating_sub(self.seen.replace(now)).saturating_sub(asked);
        if beyond >= HELD_UP {
            self.held_up.set(self.held_up.get() + beyond);
        }
    }
}

impl World for Shared {
    fn elapsed(&self) -> Duration {
        self.world.elapsed()
    }

    fn wall(&self) -> f64 {
        self.world.wall()
    }

    fn sleep(&self, time: Duration) {
        self.clock.within(time, || self.world.sleep(time));
    }

    fn held_up(&self) -> Duration {
        self.clock.goes_on(Duration::ZERO);
        self.clock.held_up.take()
    }

    fn excuse(&self) {
        self.clock.seen.set(self.world.elapsed());
    }

    fn open(&self, place: &Place, driver: &Driver) -> io::Result<Box<dyn Port>> {
        let (Place::Serial(at) | Place::Tcp(at)) = place else { return self.world.open(place, driver) };
        let known = self.open.borrow().get(at).and_then(Weak::upgrade);
        let wire = known.unwrap_or_default();
        if wire.port.borrow().is_none() {
            *wire.port.borrow_mut() = Some(self.world.open(place, driver)?);
            self.open.borrow_mut().insert(at.clone(), Rc::downgrade(&wire));
        }
        Ok(Box::new(Tap { wire, clock: Rc::clone(&self.clock) }))
    }
}

/// One device's share of a port.
struct Tap {
    wire: Rc<Wire>,
    clock: Rc<Clock>,
}

impl Tap {
    fn over<T>(&self, act: impl FnOnce(&mut dyn Port) -> io::Result<T>) -> io::Result<T> {
        let mut wire = self.wire.port.borrow_mut();
        let port = wire.as_deref_mut();
        let port = port.ok_or_else(|| io::Error::new(ErrorKind::NotConnected, "it has failed before"))?;
        let done = act(port);
        if done.is_err() {
            *wire = None;
        }
        done
    }
}

impl Port for Tap {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.clock.goes_on(Duration::ZERO);
        let sent = self.over(|port| port.send(bytes));
        // Who takes bytes in slowly is a device.
        self.clock.seen.set(self.clock.world.elapsed());
        sent
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        self.clock.within(within, || self.over(|port| port.receive(within)))
    }

    fn debt(&self) -> Rc<Debt> {
        Rc::clone(&self.wire.debt)
    }

    fn attach(&mut self, name: &str, bytes: Vec<u8>) -> io::Result<()> {
        self.over(|port| port.attach(name, bytes))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[derive(Default)]
    struct Counting {
        opened: Cell<usize>,
        fails: Rc<Cell<bool>>,
    }

    struct Silent(Rc<Cell<bool>>);

    impl Port for Silent {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            if self.0.get() { Err(io::Error::other("gone")) } else { Ok(()) }
        }

        fn receive(&mut self, _: Duration) -> io::Result<Vec<u8>> {
            Ok(Vec::new())
        }
    }

    impl World for Counting {
        fn elapsed(&self) -> Duration {
            Duration::ZERO
        }

        fn wall(&self) -> f64 {
            0.0
        }

        fn sleep(&self, _: Duration) {}

        fn open(&self, _: &Place, _: &Driver) -> io::Result<Box<dyn Port>> {
            self.opened.set(self.opened.get() + 1);
            Ok(Box::new(Silent(Rc::clone(&self.fails))))
        }
    }

    fn driver() -> Driver {
        Driver {
            name: "D".into(),
            instance: matterix_ir::scene::InstanceId(0),
            transport: matterix_ir::wire::Transport::Tcp,
            host: None,
            framing: matterix_ir::wire::Framing::Calls,
            address: None,
            timeout: 1.0,
            identity: Vec::new(),
            open: Vec::new(),
            close: Vec::new(),
            halt: Vec::new(),
            safe: Vec::new(),
            stays_on: false,
            play: Vec::new(),
            alive: Vec::new(),
            told: Vec::new(),
            ignores: Vec::new(),
            answers: Vec::new(),
            refusals: Vec::new(),
            calls: Vec::new(),
            served: Vec::new(),
            span: matterix_ir::Span::default(),
        }
    }

    /// A machine on which each wait takes this much longer than it should.
    struct Slow(Duration, Cell<Duration>);

    impl World for Slow {
        fn elapsed(&self) -> Duration {
            self.1.get()
        }

        fn wall(&self) -> f64 {
            0.0
        }

        fn sleep(&self, time: Duration) {
            self.1.set(self.1.get() + time + self.0);
        }

        fn open(&self, _: &Place, _: &Driver) -> io::Result<Box<dyn Port>> {
            Err(io::Error::other("nobody is there"))
        }
    }

    #[test]
    fn a_process_that_was_held_up_is_known_for_one() {
        let nap = Duration::from_millis(10);
        for (beyond, told) in
            [(Duration::from_secs(1), Duration::ZERO), (Duration::from_secs(9), Duration::from_secs(9))]
        {
            let shared = Shared::new(Rc::new(Slow(beyond, Cell::default())));
            shared.sleep(nap);
            assert_eq!((shared.held_up(), shared.held_up()), (told, Duration::ZERO));
            // Between two waits, and with a device that takes its time.
            shared.world.sleep(nap);
            assert_eq!(shared.held_up() > Duration::ZERO, told > Duration::ZERO);
            shared.world.sleep(nap);
            shared.excuse();
            assert_eq!(shared.held_up(), Duration::ZERO);
        }
    }

    #[test]
    fn a_port_is_opened_once_and_again_for_all_when_it_has_failed() {
        let counting = Rc::new(Counting::default());
        let shared = Shared::new(Rc::clone(&counting) as Rc<dyn World>);
        let open = |at: &str| shared.open(&Place::Serial(at.into()), &driver()).expect("it opens");
        let (mut first, mut second, _other) = (open("a"), open("a"), open("b"));
        assert_eq!(counting.opened.get(), 2);
        counting.fails.set(true);
        assert!(first.send(b"x").is_err());
        counting.fails.set(false);
        assert!(second.send(b"x").is_err(), "it is gone for both");
        let _third = open("a");
        assert!(first.send(b"x").is_ok() && second.send(b"x").is_ok());
        assert_eq!(counting.opened.get(), 3);
        drop((first, second, _third));
        let _again = open("a");
        assert_eq!(counting.opened.get(), 4, "closed when nobody uses it");
    }
}
