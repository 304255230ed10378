//! Hands the page to a browser on this machine, and to nobody else.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use matterix_net::http::{Answer, Limits, Request, Server};

/// How long a request is waited for before looking whether to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// A page that waits for its reader.
pub struct Served {
    server: Server,
    page: Arc<[u8]>,
}

impl Served {
    /// Takes the port on this machine's own address; 0 takes any that is free.
    pub fn new(page: String, port: u16) -> io::Result<Self> {
        Ok(Served { server: Server::bind(port, Limits::default())?, page: page.into_bytes().into() })
    }

    /// Where it answers.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }

    /// What to type into a browser.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address())
    }

    /// Answers until `stop` is set.
    pub fn until(&mut self, stop: &AtomicBool) -> io::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            if let Some(asked) = self.server.next(PATIENCE)? {
                self.server.answer(asked.client, answer(&asked.request, &self.page));
            }
        }
        Ok(())
    }
}

fn answer(request: &Request, page: &Arc<[u8]>) -> Answer {
    let answer = match (request.method(), request.path()) {
        _ if !request.is_for_this_machine() => Answer::text(403, "this page is for this computer only"),
        ("GET" | "HEAD", "/") => Answer::new(200, "text/html; charset=utf-8", Arc::clone(page)),
        ("GET" | "HEAD", _) => Answer::text(404, "page not found: the only page is at /"),
        _ => Answer::text(405, "this page is read-only").with("Allow", "GET, HEAD"),
    };
    answer.guarded()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).expect("connects");
        stream.write_all(request.as_bytes()).expect("writes");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("reads");
        answer
    }

    #[test]
    fn answers_this_machine_with_the_page_and_others_with_none() {
        let mut served = Served::new("<p>a bench</p>".to_owned(), 0).expect("a free port");
        let address = served.address();
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| served.until(&stop));
            let port = address.port();
            let get =
                |path: &str, host: &str| format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
            let page = ask(address, &get("/?x=1", &format!("127.0.0.1:{port}")));
            let other = ask(address, &get("/secret", &format!("localhost:{port}")));
            let foreign = ask(address, &get("/", "lab.example"));
            let put =
                format!("PUT / HTTP/1.1\r\nHost: localhost:{port}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
            let changed = ask(address, &put);
            stop.store(true, Ordering::Relaxed);
            assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<p>a bench</p>"), "{page}");
            assert!(other.starts_with("HTTP/1.1 404"), "{other}");
            assert!(foreign.starts_with("HTTP/1.1 403") && !foreign.contains("bench"), "{foreign}");
            assert!(changed.starts_with("HTTP/1.1 405"), "{changed}");
        });
    }
}
