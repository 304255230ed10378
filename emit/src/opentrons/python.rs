//! A protocol as Python.

use std::collections::BTreeMap;
use std::fmt::Write;

use matterix_ir::{Diagnostic, Span};
use serde_json::Value;

use super::WHAT;
use super::protocol::{Command, Protocol};
use crate::finding::not_expressible;
use crate::place;

/// The file, or what the Python API has no call for.
pub(super) fn write(protocol: &Protocol<'_>) -> Result<Vec<u8>, Vec<Diagnostic>> {
    let mut script = Script { text: String::new(), rates: BTreeMap::new(), aimed: None };
    script.head(protocol);
    let mut found = Vec::new();
    for command in &protocol.loads {
        if !script.load(command, protocol) {
            found.push(no_call(command));
        }
    }
    let mut said: Option<Span> = None;
    for command in &protocol.commands {
        if said != Some(command.at) {
            said = Some(command.at);
            let (file, line, text) = place::line(protocol.subject.sources, command.at);
            script.line(&format!("# {file}:{line}: {text}"));
        }
        if !script.call(command) {
            found.push(no_call(command));
        }
    }
    if found.is_empty() { Ok(script.text.into_bytes()) } else { Err(found) }
}

fn no_call(command: &Command) -> Diagnostic {
    not_expressible(command.at, format!("{WHAT} in Python has no call for `{}`", command.name), "this step sends it")
        .help("use `--target opentrons-json`")
}

struct Script {
    text: String,
    /// Flow rates as they were last set, by pipette and what flows.
    rates: BTreeMap<(String, &'static str), f64>,
    /// The pipette that was brought over an area to drop its tip.
    aimed: Option<String>,
}

/// A text as a literal of Python: JSON's escapes are among Python's.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// A number as Python writes it.
fn shown(value: Option<&Value>) -> String {
    match value.and_then(Value::as_f64) {
        Some(v) if v.fract() == 0.0 && v.abs() < 1e15 => format!("{v:.0}"),
        Some(v) => v.to_string(),
        None => "None".to_owned(),
    }
}

impl Script {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "    {text}");
    }

    fn head(&mut self, protocol: &Protocol<'_>) {
        let setting = |name: &str| quoted(protocol.robot.setting(name).unwrap_or_default());
        let name = quoted(&protocol.subject.program.plan.workflow);
        if !protocol.definitions.is_empty() {
            self.text.push_str("import json\n\n");
        }
        let _ = writeln!(self.text, "metadata = {{\"protocolName\": {name}}}");
        let _ = writeln!(
            self.text,
            "requirements = {{\"robotType\": {}, \"apiLevel\": {}}}\n",
            setting("type"),
            setting("api")
        );
        if !protocol.definitions.is_empty() {
            self.text.push_str("# Labware that does not come with Opentrons' software.\nDEFINITIONS = {\n");
            for (uri, definition) in &protocol.definitions {
                let _ = writeln!(self.text, "    {}: json.loads({}),", quoted(uri), quoted(&definition.to_string()));
            }
            self.text.push_str("}\n\n");
        }
        self.text.push_str("\ndef run(protocol):\n");
        for (id, name) in &protocol.liquids {
            let name = quoted(name);
            self.line(&format!("{id} = protocol.define_liquid(name={name}, description={name}, display_color=None)"));
        }
    }

    /// Loads something; whether there is a call for it.
    fn load(&mut self, command: &Command, protocol: &Protocol<'_>) -> bool {
        let (text, slot) = (|name: &str| command.text(name), |v: &Value| v["slotName"].as_str().map(quoted));
        let location = command.params.get("location").cloned().unwrap_or_default();
        match command.name {
            "loadPipette" => {
                let (name, mount) = (quoted(text("pipetteName")), quoted(text("mount")));
                self.line(&format!("{} = protocol.load_instrument({name}, {mount})", text("pipetteId")));
            }
            "loadModule" => {
                let Some(slot) = slot(&location) else { return false };
                self.line(&format!("{} = protocol.load_module({}, {slot})", text("moduleId"), quoted(text("model"))));
            }
            "loadLabware" => {
                let (id, version) = (text("labwareId"), shown(command.params.get("version")));
                let uri = format!("{}/{}/{version}", text("namespace"), text("loadName"));
                let on = location["moduleId"].as_str().unwrap_or("protocol");
                let slot = slot(&location).map(|s| format!(", {s}")).unwrap_or_default();
                let label = quoted(text("displayName"));
                if protocol.definitions.iter().any(|(known, _)| *known == uri) {
                    let uri = quoted(&uri);
                    self.line(&format!(
                        "{id} = {on}.load_labware_from_definition(DEFINITIONS[{uri}]{slot}, label={label})"
                    ));
                } else {
                    let (name, space) = (quoted(text("loadName")), quoted(text("namespace")));
                    self.line(&format!(
                        "{id} = {on}.load_labware({name}{slot}, label={label}, namespace={space}, version={version})"
                    ));
                }
            }
            "loadLiquid" => {
                let Some(Value::Object(volumes)) = command.params.get("volumeByWell") else { return false };
                for (well, volume) in volumes {
                    let place = format!("{}[{}]", text("labwareId"), quoted(well));
                    self.line(&format!("{place}.load_liquid({}, {})", text("liquidId"), shown(Some(volume))));
                }
            }
            _ => return false,
        }
        true
    }

    /// Does something; whether there is a call for it.
    fn call(&mut self, command: &Command) -> bool {
        let text = |name: &str| command.text(name);
        let number = |name: &str| shown(command.params.get(name));
        let (pipette, module) = (text("pipetteId"), text("moduleId"));
        let well = format!("{}[{}]", text("labwareId"), quoted(text("wellName")));
        let spot = spot(command, &well);
        let aimed = self.aimed.take();
        match command.name {
            "pickUpTip" => self.line(&format!("{pipette}.pick_up_tip({spot})")),
            "aspirate" => {
                self.rate(command, "aspirate");
                self.line(&format!("{pipette}.aspirate({}, {spot})", number("volume")));
            }
            "dispense" => {
                self.rate(command, "dispense");
                self.line(&format!("{pipette}.dispense({}, {spot})", number("volume")));
            }
            "blowout" => {
                self.rate(command, "blow_out");
                self.line(&format!("{pipette}.blow_out({spot})"));
            }
            "dropTip" => self.line(&format!("{pipette}.drop_tip({spot})")),
            "moveToAddressableAreaForDropTip" if text("addressableAreaName") == "fixedTrash" => {
                self.aimed = Some(pipette.to_owned());
            }
            // The call goes there by itself.
            "dropTipInPlace" if aimed.as_deref() == Some(pipette) => {
                self.line(&format!("{pipette}.drop_tip(protocol.fixed_trash)"));
            }
            "waitForDuration" => self.line(&format!("protocol.delay(seconds={})", number("seconds"))),
            "waitForResume" => self.line(&format!("protocol.pause({})", quoted(text("message")))),
            "comment" => self.line(&format!("protocol.comment({})", quoted(text("message")))),
            "heaterShaker/setTargetTemperature" => {
                self.line(&format!("{module}.set_target_temperature({})", number("celsius")));
            }
            "heaterShaker/deactivateHeater" => self.line(&format!("{module}.deactivate_heater()")),
            "heaterShaker/setAndWaitForShakeSpeed" => {
                self.line(&format!("{module}.set_and_wait_for_shake_speed({})", number("rpm")));
            }
            "heaterShaker/deactivateShaker" => self.line(&format!("{module}.deactivate_shaker()")),
            "heaterShaker/openLabwareLatch" => self.line(&format!("{module}.open_labware_latch()")),
            "heaterShaker/closeLabwareLatch" => self.line(&format!("{module}.close_labware_latch()")),
            _ => return false,
        }
        true
    }

    /// Sets a flow rate where it is another than before.
    fn rate(&mut self, command: &Command, of: &'static str) {
        let Some(rate) = command.params.get("flowRate").and_then(Value::as_f64) else { return };
        let pipette = command.text("pipetteId");
        if self.rates.insert((pipette.to_owned(), of), rate) != Some(rate) {
            self.line(&format!("{pipette}.flow_rate.{of} = {}", shown(command.params.get("flowRate"))));
        }
    }
}

/// A place in a well.
fn spot(command: &Command, well: &str) -> String {
    let Some(location) = command.params.get("wellLocation") else { return well.to_owned() };
    let z = location["offset"]["z"].as_f64().unwrap_or(0.0);
    let z = shown(Some(&z.into()));
    match location["origin"].as_str() {
        Some("bottom") => format!("{well}.bottom({z})"),
        Some("center") => format!("{well}.center()"),
        _ => format!("{well}.top({z})"),
    }
}
