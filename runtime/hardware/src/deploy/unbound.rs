//! Devices that bindings leave out, and what to write for them.

use std::collections::BTreeSet;

use matterix_ir::plan::{Operation, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::{Driver, Transport};
use matterix_ir::{NodeId, Program};

use super::device::Device;

/// The instance that bindings would have to name for a step to be told to something: one whose driver has a line for it, or
/// over whose line that one is spoken to, else the device of the step; none where they have it.
pub(super) fn key(
    program: &Program,
    devices: &[Device<'_>],
    step: StepId,
    operation: &Operation,
) -> Option<InstanceId> {
    let callers = program.drivers.iter().filter(|d| d.call(step).is_some()).map(line_of).min();
    let own = || program.drivers.iter().filter(|d| Some(d.instance) == operation.device).map(line_of).min();
    let key = callers.or_else(own).or(operation.device)?;
    let is_bound = |id| is_bound(devices, id);
    (!is_bound(key) && !operation.device.is_some_and(is_bound)).then_some(key)
}

/// The instance that bindings would have to name for a part of a node to be told; none where they have all that tell something.
pub(super) fn teller(program: &Program, devices: &[Device<'_>], node: NodeId) -> Option<InstanceId> {
    let (mut below, mut open) = (BTreeSet::new(), vec![node]);
    while let Some(node) = open.pop() {
        if below.insert(node) {
            open.extend(program.model.graph.op(node).operands());
        }
    }
    let tells = |d: &&Driver| d.told.iter().any(|told| below.contains(&told.value));
    program.drivers.iter().filter(tells).map(line_of).filter(|id| !is_bound(devices, *id)).min()
}

/// The instance whose line a driver speaks over.
fn line_of(driver: &Driver) -> InstanceId {
    driver.host.as_ref().map_or(driver.instance, |host| host.instance)
}

fn is_bound(devices: &[Device<'_>], id: InstanceId) -> bool {
    devices.iter().any(|d| d.binding.instance == id)
}

/// What to write for it.
pub(super) fn lines(program: &Program, key: InstanceId) -> String {
    let name = &program.scene.get(key).name;
    let drivers: Vec<&Driver> = program.drivers.iter().filter(|d| d.instance == key && d.host.is_none()).collect();
    let line = |driver: &Driver| match driver.transport {
        Transport::Serial { .. } => "port = \"/dev/ttyUSB0\"",
        Transport::Tcp => "address = \"HOST:PORT\"",
        Transport::Http { .. } => "http = \"HOST:PORT\"",
        Transport::Sila { .. } => "sila = \"HOST:PORT\"",
    };
    let ways: Vec<String> = match drivers.as_slice() {
        [] => vec!["by = \"hand\"".to_owned()],
        [only] => vec![line(only).to_owned()],
        several => several.iter().map(|d| format!("{}\n  driver = \"{}\"", line(d), d.name)).collect(),
    };
    let ways: Vec<String> = ways.iter().map(|way| format!("\n  [{}]\n  {way}", toml_key(name))).collect();
    format!("add to the bindings{}", ways.join("\nor"))
}

/// A name as a key of TOML.
fn toml_key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare { name.to_owned() } else { format!("\"{name}\"") }
}
