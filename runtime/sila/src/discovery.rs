//! Servers on the network (part B, "SiLA Server Discovery"): DNS-SD over multicast DNS, service `_sila._tcp`.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};

use mdns_sd::{DaemonEvent, ResolvedService, ServiceDaemon, ServiceEvent, ServiceInfo};

use crate::server::About;
use crate::tls;

const SERVICE: &str = "_sila._tcp.local.";

/// Longest `key=value` of a record, bytes (RFC 6763, 6.1).
const LONGEST: usize = 255;

/// Longest wait until others have heard that a server is gone.
const FAREWELL: Duration = Duration::from_millis(500);

/// A server that says to the network that it is there, until it is dropped.
pub struct Announced(ServiceDaemon);

impl Drop for Announced {
    fn drop(&mut self) {
        // Whoever is gone needs no farewell.
        if let Ok(ended) = self.0.shutdown() {
            let _ = ended.recv_timeout(FAREWELL);
        }
    }
}

/// A server on the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its identifier.
    pub uuid: String,
    /// What it says of itself.
    pub name: String,
    /// What it says of itself.
    pub description: String,
    /// Where it answers, addresses of IPv4 first.
    pub addresses: Vec<SocketAddr>,
    /// The fingerprint of the certificate that it says it shows. Whoever is on the network can say so.
    pub fingerprint: Option<String>,
}

fn failed(e: impl std::fmt::Display) -> String {
    format!("the network cannot be asked (multicast DNS): {e}")
}

/// Says to the network where a server answers, and which certificate in PEM it shows.
pub fn announce(about: &About, address: SocketAddr, chain: Option<&str>) -> Result<Announced, String> {
    let text = |key: &str, value: &str| {
        let most = LONGEST - key.len() - 1;
        let end = (0..=most.min(value.len())).rev().find(|end| value.is_char_boundary(*end)).unwrap_or(0);
        (key.to_owned(), value[..end].to_owned())
    };
    let mut texts = vec![
        text("version", &about.version),
        text("server_name", &about.name),
        text("description", &about.description),
    ];
    let lines = chain.into_iter().flat_map(str::lines).enumerate();
    texts.extend(lines.map(|(at, line)| text(&format!("ca{at}"), line)));
    let host = format!("{}.local.", about.uuid);
    let info = match address.ip() {
        ip if ip.is_unspecified() => {
            ServiceInfo::new(SERVICE, &about.uuid, &host, (), address.port(), texts.as_slice())
                .map(ServiceInfo::enable_addr_auto)
        }
        ip => ServiceInfo::new(SERVICE, &about.uuid, &host, ip, address.port(), texts.as_slice()),
    };
    let daemon = ServiceDaemon::new().map_err(failed)?;
    let events = daemon.monitor().map_err(failed)?;
    daemon.register(info.map_err(failed)?).map_err(failed)?;
    // What goes wrong at once is said; later the network may come and go.
    while let Ok(event) = events.recv_timeout(Duration::from_millis(20)) {
        if let DaemonEvent::Error(e) = event {
            return Err(failed(e));
        }
    }
    Ok(Announced(daemon))
}

/// The servers that answer within this time; with a `uuid` only that one, as soon as it answers.
#[allow(clippy::disallowed_methods, reason = "servers live by the wall clock")]
pub fn look(time: Duration, uuid: Option<&str>) -> Result<Vec<Found>, String> {
    let daemon = ServiceDaemon::new().map_err(failed)?;
    let events = daemon.browse(SERVICE).map_err(failed)?;
    let (mut all, until) = (BTreeMap::new(), Instant::now() + time);
    while let Ok(event) = events.recv_timeout(until.saturating_duration_since(Instant::now())) {
        match event {
            ServiceEvent::ServiceResolved(service) => {
                let Some(found) = found(&service) else { continue };
                let is_it = uuid.is_some_and(|uuid| uuid == found.uuid);
                if uuid.is_none() || is_it {
                    all.insert(found.uuid.clone(), found);
                }
                if is_it {
                    break;
                }
            }
            ServiceEvent::ServiceRemoved(_, name) => all.retain(|uuid, _| !name.starts_with(uuid.as_str())),
            _ => {}
        }
    }
    drop(Announced(daemon));
    Ok(all.into_values().collect())
}

fn found(service: &ResolvedService) -> Option<Found> {
    let uuid = crate::server::uuid(service.get_fullname().strip_suffix(SERVICE)?.trim_end_matches('.'))?;
    let text = |key: &str| service.get_property_val_str(key).unwrap_or_default().to_owned();
    let mut addresses: Vec<IpAddr> = service.get_addresses().iter().map(|ip| ip.to_ip_addr()).collect();
    addresses.sort();
    let lines: Vec<&str> = (0..).map_while(|at| service.get_property_val_str(&format!("ca{at}"))).collect();
    Some(Found {
        uuid,
        name: text("server_name"),
        description: text("description"),
        addresses: addresses.into_iter().map(|ip| SocketAddr::new(ip, service.get_port())).collect(),
        fingerprint: tls::fingerprint_of(&lines.join("\n")),
    })
}
