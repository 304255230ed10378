//! Protocols of Opentrons, as JSON of schema 8 and as Python; the same as a program for PyLabRobot.

mod deck;
mod form;
mod json;
mod layout;
mod liquids;
mod message;
mod protocol;
mod pylabrobot;
mod python;
mod writer;

use matterix_ir::Diagnostic;

use crate::course::{self, Means};
use crate::finding::{not_expressible, settle};
use crate::performance::Performance;
use crate::{Subject, Written};
use protocol::Protocol;

/// The wire of the drivers that these files are written from.
pub const WIRE: &str = "opentrons";

/// What the target is called in findings.
const WHAT: &str = "an Opentrons protocol";

/// A JSON protocol of schema 8, with commands of schema 8.
pub fn json(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let (protocol, warnings) = protocol(subject, performance)?;
    let bins = protocol.bins();
    let beyond = |c: &&protocol::Command| {
        ["setTipState", "absorbanceReader/initialize"].contains(&c.name)
            || c.text("labwareId") == deck::BIN
            || bins.contains(c.text("labwareId"))
    };
    if let Some(command) = protocol.commands.iter().find(beyond) {
        let headline =
            format!("{WHAT} in JSON cannot refill a rack, dispense into a bin or set up an absorbance reader");
        let d = not_expressible(command.at, headline, "this step sends it").help("use `--target opentrons-python`");
        return Err(vec![d]);
    }
    Ok((json::write(&protocol), warnings))
}

/// A Python protocol.
pub fn python(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let (protocol, warnings) = protocol(subject, performance)?;
    Ok((python::write(&protocol)?, warnings))
}

/// A program for PyLabRobot.
pub fn pylabrobot(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let (protocol, warnings) = protocol(subject, performance)?;
    if let Some(kind) = protocol.robot.setting("type").filter(|kind| *kind != "OT-2") {
        let at = subject.program.plan.get(subject.program.plan.root).span;
        let headline = format!("a program for PyLabRobot cannot be for a {kind}");
        let d = not_expressible(at, headline, "this workflow uses one").help("use `--target opentrons-python`");
        return Err(vec![d]);
    }
    Ok((pylabrobot::write(&protocol)?, warnings))
}

fn protocol<'p>(
    subject: Subject<'p>,
    performance: &Performance<'_>,
) -> Result<(Protocol<'p>, Vec<Diagnostic>), Vec<Diagnostic>> {
    let Subject { program, wiring, sources } = subject;
    let robot = protocol::robot(subject, performance).map_err(|d| vec![d])?;
    let mut found = course::open(program, wiring, sources, &performance.acts, Means::default(), WHAT);
    let protocol = Protocol::of(subject, performance, robot, &mut found);
    settle(found).map(|warnings| (protocol, warnings))
}
