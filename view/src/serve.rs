//! Hands the page to a browser on this machine, and to nobody else.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tiny_http::{Header, Method, Request, Response, Server};

/// How long a request is waited for before looking whether to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// A page that waits for its reader.
pub struct Served {
    server: Server,
    page: String,
    address: SocketAddr,
}

impl Served {
    /// Takes the port on this machine's own address; 0 takes any that is free.
    pub fn new(page: String, port: u16) -> io::Result<Self> {
        let server = Server::http((Ipv4Addr::LOCALHOST, port)).map_err(|e| match e.downcast::<io::Error>() {
            Ok(e) => *e,
            Err(e) => io::Error::other(e.to_string()),
        })?;
        let address = server.server_addr().to_ip().ok_or_else(|| io::Error::other("the socket has no address"))?;
        Ok(Served { server, page, address })
    }

    /// What to type into a browser.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Answers until `stop` is set.
    pub fn until(&self, stop: &AtomicBool) -> io::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            if let Some(request) = self.server.recv_timeout(PATIENCE)? {
                // A browser that has gone away is no reason to stop.
                let _ = self.answer(request);
            }
        }
        Ok(())
    }

    fn answer(&self, request: Request) -> io::Result<()> {
        let reads = matches!(request.method(), Method::Get | Method::Head);
        let path = request.url().split(['?', '#']).next().unwrap_or_default();
        let (status, body) = match path {
            _ if !self.is_for_us(&request) => (403, "this page is for this machine only\n"),
            _ if !reads => (405, "there is nothing here to change\n"),
            "/" => (200, self.page.as_str()),
            _ => (404, "there is only one page here, at /\n"),
        };
        let kind = if status == 200 { "text/html; charset=utf-8" } else { "text/plain; charset=utf-8" };
        let mut response = Response::from_data(body).with_status_code(status);
        for (name, value) in
            [("Content-Type", kind), ("Cache-Control", "no-store"), ("X-Content-Type-Options", "nosniff")]
        {
            if let Ok(header) = Header::from_bytes(name, value) {
                response.add_header(header);
            }
        }
        request.respond(response)
    }

    /// Whether the browser asked for this machine by an address of its own: a page from elsewhere that has its name
    /// point here does not.
    fn is_for_us(&self, request: &Request) -> bool {
        let host = request.headers().iter().find(|h| h.field.equiv("Host")).map(|h| h.value.as_str());
        let port = self.address.port();
        host.is_some_and(|host| host == format!("127.0.0.1:{port}") || host == format!("localhost:{port}"))
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn ask(served: &Served, request: &str) -> String {
        let mut stream = TcpStream::connect(served.address).expect("connects");
        stream.write_all(request.as_bytes()).expect("writes");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("reads");
        answer
    }

    #[test]
    fn answers_this_machine_with_the_page_and_others_with_none() {
        let served = Served::new("<p>a bench</p>".to_owned(), 0).expect("a free port");
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| served.until(&stop));
            let port = served.address.port();
            let get =
                |path: &str, host: &str| format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
            let page = ask(&served, &get("/?x=1", &format!("127.0.0.1:{port}")));
            let other = ask(&served, &get("/secret", &format!("localhost:{port}")));
            let foreign = ask(&served, &get("/", "lab.example"));
            let put =
                format!("PUT / HTTP/1.1\r\nHost: localhost:{port}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
            let changed = ask(&served, &put);
            stop.store(true, Ordering::Relaxed);
            assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<p>a bench</p>"), "{page}");
            assert!(other.starts_with("HTTP/1.1 404"), "{other}");
            assert!(foreign.starts_with("HTTP/1.1 403") && !foreign.contains("bench"), "{foreign}");
            assert!(changed.starts_with("HTTP/1.1 405"), "{changed}");
        });
    }
}
