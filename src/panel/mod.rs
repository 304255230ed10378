//! The page of a deployment (`deploy --view`): what goes on, and what people say to it.
//!
//! The executor writes on a board and never waits for a viewer; a thread of its own serves the board. Whoever has the address that
//! was printed, with its token, may look and act; nobody else learns anything.

mod act;
mod board;
mod watch;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use matterix_hardware::deploy::{Control, Exposed};
use matterix_net::http::{Answer, Asked, Limits, Request, Server, Token};

pub use board::Board;
pub use watch::Watcher;

/// How long a request is waited for before looking whether something new stands on the board.
const PATIENCE: Duration = Duration::from_millis(50);

/// Shortest time between two states that are sent.
const FRAME: Duration = Duration::from_millis(150);

/// How long viewers have to read how it ended.
const FAREWELL: Duration = Duration::from_millis(500);

const PAGE: &str = include_str!("page.html");

/// A page of this machine: it loads nothing from anywhere, and asks nobody but this server.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What people see and say beside a deployment.
pub struct Panel {
    url: String,
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What the page shows, and whom it tells.
struct Desk {
    board: Arc<Board>,
    control: &'static Control,
    exposed: &'static Exposed,
    token: Token,
}

impl Panel {
    /// Serves a board at a port of this machine; 0 takes any that is free.
    pub fn open(
        board: Arc<Board>,
        control: &'static Control,
        exposed: &'static Exposed,
        port: u16,
    ) -> io::Result<Panel> {
        let server = Server::bind(port, Limits::default())?;
        let token = Token::new()?;
        let url = format!("http://{}/?token={}", server.address(), token.digits());
        let ended = Arc::new(AtomicBool::new(false));
        let (desk, end) = (Desk { board, control, exposed, token }, Arc::clone(&ended));
        let thread = std::thread::Builder::new().name("panel".to_owned()).spawn(move || desk.serve(server, &end))?;
        Ok(Panel { url, ended, thread: Some(thread) })
    }

    /// What to type into a browser.
    pub fn url(&self) -> &str {
        &self.url
    }
}

impl Drop for Panel {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            // What became of the page changes nothing of how a deployment ended.
            let _ = thread.join();
        }
    }
}

#[allow(clippy::disallowed_methods, reason = "viewers live by the clock of the room")]
fn now() -> Instant {
    Instant::now()
}

impl Desk {
    fn serve(&self, mut server: Server, ended: &AtomicBool) {
        let (mut shown, mut sent, mut left) = (String::new(), now(), None);
        loop {
            let Ok(asked) = server.next(PATIENCE) else { return };
            if let Some(asked) = asked {
                self.attend(&mut server, asked);
            }
            if left.is_none() && ended.load(Ordering::SeqCst) {
                left = Some(now());
            }
            if sent.elapsed() >= FRAME || left.is_some() {
                let state = self.state();
                if state != shown {
                    server.publish("state", &state);
                    (shown, sent) = (state, now());
                }
            }
            if left.is_some_and(|left| left.elapsed() > FAREWELL || server.listeners() == 0) {
                return;
            }
        }
    }

    fn state(&self) -> String {
        self.board.state(&self.control.open(), &self.exposed.names())
    }

    fn attend(&self, server: &mut Server, asked: Asked) {
        let request = &asked.request;
        if (request.method(), request.path()) == ("GET", "/events") && self.refusal(request).is_none() {
            server.answer(asked.client, Answer::events());
            server.tell(asked.client, "state", &self.state());
            return;
        }
        server.answer(asked.client, self.answer(request).guarded());
    }

    /// Why a request is not served, if it is not.
    fn refusal(&self, request: &Request) -> Option<Answer> {
        match () {
            () if !request.is_for_this_machine() => Some(Answer::text(403, "this page is for this computer only")),
            () if !request.is_of_own_origin() => Some(Answer::text(403, "requests from other origins are not allowed")),
            () if !self.token.is_known_to(request) => {
                Some(Answer::text(401, "open the address printed by `deploy --view`, with its token"))
            }
            () => None,
        }
    }

    fn answer(&self, request: &Request) -> Answer {
        if let Some(refusal) = self.refusal(request) {
            return refusal;
        }
        match (request.method(), request.path()) {
            ("GET" | "HEAD", "/") => Answer::new(200, "text/html; charset=utf-8", PAGE.as_bytes())
                .with("Content-Security-Policy", POLICY)
                .with("Referrer-Policy", "no-referrer"),
            ("GET", "/state") => Answer::new(200, "application/json", self.state().into_bytes()),
            ("POST", "/act") => act::answer(request, self.control),
            (_, "/" | "/state" | "/events") => Answer::text(405, "this address only takes GET").with("Allow", "GET"),
            (_, "/act") => Answer::text(405, "this address only takes POST").with("Allow", "POST"),
            _ => Answer::text(404, "page not found"),
        }
    }
}
