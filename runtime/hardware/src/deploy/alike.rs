//! Answers that cannot be told from what a device says by itself over the same line.

use matterix_ir::wire::{Driver, Framing, Pattern};
use matterix_ir::{Diagnostic, codes};

use super::device::Device;
use crate::pattern::{example, matched, written};

/// Findings about drivers whose answers look like lines that nobody asked for: they would be taken for these.
pub(super) fn alike(devices: &[Device<'_>]) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for device in devices {
        let line = device.host.map_or(device, |host| &devices[host]);
        let (Some(driver), Some(of)) = (device.driver, line.driver) else { continue };
        if matches!(of.framing, Framing::Json | Framing::Calls) {
            continue;
        }
        for answer in expected(driver) {
            let Ok(example) = example(answer) else { continue };
            let Some(said) = by_itself(of).find(|said| matched(said, &example).is_some()) else { continue };
            let headline = format!(
                "the reply `{}` that `{}` expects looks like a message that `{}` sends by itself",
                written(answer),
                driver.name,
                of.name
            );
            let d = Diagnostic::error(codes::DRIVER_LINE, answer.span, headline, "ambiguous reply");
            let d = d.because(said.span, format!("sent by itself: `{}`", written(said)));
            found.push(d.help("let the device send it in another form, or only when asked"));
        }
    }
    found
}

/// What a device says without being asked.
fn by_itself(driver: &Driver) -> impl Iterator<Item = &Pattern> {
    driver.heard().map(|(_, told)| &told.expects).chain(&driver.ignores)
}

/// What a driver expects as answers.
fn expected(driver: &Driver) -> impl Iterator<Item = &Pattern> {
    let asked = driver.told.iter().filter(|told| told.heard.is_none());
    let told = asked.flat_map(|told| told.forms().map(|(form, _)| form));
    let calls = driver.calls.iter().map(|(_, exchange)| exchange).chain(driver.said_apart());
    let answers =
        calls.flat_map(|exchange| exchange.expects.iter().chain(exchange.until.iter().flat_map(|u| &u.expects)));
    told.chain(answers).flat_map(|pattern| std::iter::once(pattern).chain(&pattern.then))
}
