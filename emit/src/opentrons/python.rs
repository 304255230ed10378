//! A protocol as Python.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use matterix_ir::{Diagnostic, Span};
use serde_json::Value;

use super::WHAT;
use super::deck::{BIN, CHUTE, GRIPPER_CHUTE, Waste};
use super::form::{BIN_ID, TRASH_BIN, WASTE_CHUTE};
use super::protocol::{Command, Protocol};
use crate::finding::not_expressible;
use crate::place;

/// The file, or what the Python API has no call for.
pub(super) fn write(protocol: &Protocol<'_>) -> Result<Vec<u8>, Vec<Diagnostic>> {
    let mut script = Script {
        text: String::new(),
        rates: BTreeMap::new(),
        targets: BTreeMap::new(),
        binned: BTreeSet::new(),
        aimed: None,
        slots: BTreeMap::new(),
        areas: BTreeMap::new(),
    };
    script.head(protocol);
    let mut found = Vec::new();
    for command in &protocol.loads {
        if !script.load(command, protocol) {
            found.push(no_call(command));
        }
    }
    let mut said: Option<Span> = None;
    let mut commands = protocol.commands.iter().peekable();
    while let Some(command) = commands.next() {
        if said != Some(command.at) {
            said = Some(command.at);
            let (file, line, text) = place::line(protocol.subject.sources, command.at);
            script.line(&format!("# {file}:{line}: {text}"));
        }
        if command.name == "temperatureModule/setTargetTemperature" {
            script.targets.insert(command.text("moduleId").to_owned(), shown(command.params.get("celsius")));
        }
        // One call brings a module to a temperature and waits for it.
        if let Some((_, wait, call)) = TEMPERED.iter().find(|(set, ..)| *set == command.name) {
            let waits = |next: &&Command| next.name == *wait && next.text("moduleId") == command.text("moduleId");
            if commands.next_if(waits).is_some() {
                let celsius = shown(command.params.get("celsius"));
                let volume = command.params.get("blockMaxVolumeUl");
                let volume = volume.map_or(String::new(), |v| format!(", block_max_volume={}", shown(Some(v))));
                script.line(&format!("{}.{call}({celsius}{volume})", command.text("moduleId")));
                continue;
            }
        }
        let is_said = if command.name == "loadLabware" { script.load(command, protocol) } else { script.call(command) };
        if !is_said {
            found.push(no_call(command));
        }
    }
    if found.is_empty() { Ok(script.text.into_bytes()) } else { Err(found) }
}

/// Pipettes that the Python API calls otherwise than the run engine.
const CALLED: [(&str, &str); 6] = [
    ("p50_single_flex", "flex_1channel_50"),
    ("p50_multi_flex", "flex_8channel_50"),
    ("p1000_single_flex", "flex_1channel_1000"),
    ("p1000_multi_flex", "flex_8channel_1000"),
    ("p200_96", "flex_96channel_200"),
    ("p1000_96", "flex_96channel_1000"),
];

/// The first API level with layouts of one nozzle.
const LAYOUTS: &str = "2.20";

/// A set point, the wait that follows, and the call that is both.
const TEMPERED: [(&str, &str, &str); 3] = [
    ("temperatureModule/setTargetTemperature", "temperatureModule/waitForTemperature", "set_temperature"),
    ("thermocycler/setTargetBlockTemperature", "thermocycler/waitForBlockTemperature", "set_block_temperature"),
    ("thermocycler/setTargetLidTemperature", "thermocycler/waitForLidTemperature", "set_lid_temperature"),
];

fn no_call(command: &Command) -> Diagnostic {
    not_expressible(command.at, format!("{WHAT} in Python has no call for `{}`", command.name), "this step sends it")
        .help("use `--target opentrons-json`")
}

struct Script {
    text: String,
    /// Flow rates as they were last set, by pipette and what flows.
    rates: BTreeMap<(String, &'static str), f64>,
    /// What temperature modules were set to last, degC.
    targets: BTreeMap<String, String>,
    /// Pipettes that were at the bin last: it is no place for what is done in place.
    binned: BTreeSet<String>,
    /// The pipette that was brought over an area to drop its tip, and what is called there.
    aimed: Option<(String, String)>,
    /// Bins and chutes that are loaded, by their areas; the chute by what its areas end in.
    areas: BTreeMap<String, String>,
    /// In which slot labware stands.
    slots: BTreeMap<String, String>,
}

/// A text as a literal of Python: JSON's escapes are among Python's.
pub(super) fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// A number as Python writes it.
pub(super) fn shown(value: Option<&Value>) -> String {
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
        let is_aside = |c: &Command| {
            let offset = |axis: &str| c.params.get("wellLocation").and_then(|l| l["offset"][axis].as_f64());
            ["x", "y"].iter().any(|axis| offset(axis).is_some_and(|off| off != 0.0))
        };
        let is_place = |c: &Command| c.name == "moveToCoordinates";
        if protocol.commands.iter().any(is_place) {
            self.text.push_str("from opentrons.types import Location, Point\n\n");
        } else if protocol.commands.iter().any(is_aside) {
            self.text.push_str("from opentrons.types import Point\n\n");
        }
        let is_off =
            |c: &Command| ["location", "newLocation"].iter().any(|key| c.params.get(*key) == Some(&"offDeck".into()));
        if protocol.loads.iter().chain(&protocol.commands).any(is_off) {
            self.text.push_str("from opentrons import protocol_api\n\n");
        }
        let lays_out = protocol.commands.iter().any(|c| c.name == "configureNozzleLayout");
        if lays_out {
            self.text.push_str("from opentrons.protocol_api import ALL, COLUMN, PARTIAL_COLUMN, ROW, SINGLE\n\n");
        }
        let _ = writeln!(self.text, "metadata = {{\"protocolName\": {name}}}");
        let _ = writeln!(
            self.text,
            "requirements = {{\"robotType\": {}, \"apiLevel\": {}}}\n",
            setting("type"),
            if lays_out && setting("api") == "\"2.19\"" { quoted(LAYOUTS) } else { setting("api") }
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
        let text = |name: &str| command.text(name);
        let slot = |v: &Value| v["slotName"].as_str().or(v["addressableAreaName"].as_str()).map(quoted);
        let location = command.params.get("location").cloned().unwrap_or_default();
        match command.name {
            "loadPipette" => {
                let name = text("pipetteName");
                let called = CALLED.iter().find(|(engine, _)| *engine == name).map_or(name, |(_, python)| *python);
                let (name, mount) = (quoted(called), quoted(text("mount")));
                self.line(&format!("{} = protocol.load_instrument({name}, {mount})", text("pipetteId")));
            }
            "loadModule" => {
                let Some(slot) = slot(&location) else { return false };
                self.line(&format!("{} = protocol.load_module({}, {slot})", text("moduleId"), quoted(text("model"))));
            }
            "loadLabware" => {
                let (id, version) = (text("labwareId"), shown(command.params.get("version")));
                self.slots.extend(location["slotName"].as_str().map(|slot| (id.to_owned(), slot.to_owned())));
                let uri = format!("{}/{}/{version}", text("namespace"), text("loadName"));
                let below = location["moduleId"].as_str().or_else(|| location["labwareId"].as_str());
                let on = below.unwrap_or("protocol");
                let slot = match location.as_str() {
                    Some(_) => ", protocol_api.OFF_DECK".to_owned(),
                    None => slot(&location).map(|s| format!(", {s}")).unwrap_or_default(),
                };
                let label = quoted(text("displayName"));
                // An adapter takes no label.
                let (kind, label) = match protocol.adapters.contains(&uri) {
                    true => ("adapter", String::new()),
                    false => ("labware", format!(", label={label}")),
                };
                if protocol.definitions.iter().any(|(known, _)| *known == uri) {
                    let uri = quoted(&uri);
                    self.line(&format!("{id} = {on}.load_{kind}_from_definition(DEFINITIONS[{uri}]{slot}{label})"));
                } else {
                    let (name, space) = (quoted(text("loadName")), quoted(text("namespace")));
                    self.line(&format!(
                        "{id} = {on}.load_{kind}({name}{slot}{label}, namespace={space}, version={version})"
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
            TRASH_BIN => {
                let Some(slot) = location["slotName"].as_str() else { return false };
                self.areas.insert(Waste::Bin(slot.to_owned()).area(""), text(BIN_ID).to_owned());
                self.line(&format!("{} = protocol.load_trash_bin({})", text(BIN_ID), quoted(slot)));
            }
            WASTE_CHUTE => {
                self.areas.insert(CHUTE.to_owned(), text(BIN_ID).to_owned());
                self.line(&format!("{} = protocol.load_waste_chute()", text(BIN_ID)));
            }
            // What brings a module into its state at the start.
            _ => return self.call(command),
        }
        true
    }

    /// Does something; whether there is a call for it.
    fn call(&mut self, command: &Command) -> bool {
        let text = |name: &str| command.text(name);
        let number = |name: &str| shown(command.params.get(name));
        let (pipette, module) = (text("pipetteId"), text("moduleId"));
        let well = format!("{}[{}]", text("labwareId"), quoted(text("wellName")));
        let over_bin = self.areas.values().any(|bin| bin == text("labwareId"));
        let spot = if over_bin { text("labwareId").to_owned() } else { spot(command, &well) };
        let offset = |axis: &str| shown(command.params.get("wellLocation").map(|location| &location["offset"][axis]));
        let aimed = self.aimed.take();
        match (text("labwareId"), command.params.contains_key("coordinates")) {
            (id, _) if id == BIN || over_bin => drop(self.binned.insert(pipette.to_owned())),
            ("", false) => {}
            _ => drop(self.binned.remove(pipette)),
        }
        match command.name {
            "pickUpTip" => self.line(&format!("{pipette}.pick_up_tip({spot})")),
            "configureNozzleLayout" => {
                let Some(layout) = command.params.get("configurationParams") else { return false };
                let corner = |key: &str, name: &str| {
                    layout[key].as_str().map_or(String::new(), |nozzle| format!(", {name}={}", quoted(nozzle)))
                };
                let style = layout["style"].as_str().unwrap_or_default();
                let style = if style == "QUADRANT" { "PARTIAL_COLUMN" } else { style };
                let (start, end) = (corner("primaryNozzle", "start"), corner("backLeftNozzle", "end"));
                self.line(&format!("{pipette}.configure_nozzle_layout(style={style}{start}{end})"));
            }
            "aspirate" => {
                self.rate(command, "aspirate");
                self.line(&format!("{pipette}.aspirate({}, {spot})", number("volume")));
            }
            "dispense" => {
                self.rate(command, "dispense");
                let push = command.params.get("pushOut");
                let push = push.map_or(String::new(), |volume| format!(", push_out={}", shown(Some(volume))));
                self.line(&format!("{pipette}.dispense({}, {spot}{push})", number("volume")));
            }
            "blowout" => {
                self.rate(command, "blow_out");
                self.line(&format!("{pipette}.blow_out({spot})"));
            }
            "aspirateInPlace" if self.binned.contains(pipette) => return false,
            "aspirateInPlace" => {
                self.rate(command, "aspirate");
                self.line(&format!("{pipette}.aspirate({})", number("volume")));
            }
            "touchTip" if [offset("x"), offset("y")].iter().all(|off| off == "0") => self.line(&format!(
                "{pipette}.touch_tip({well}, radius={}, v_offset={}, speed={})",
                number("radius"),
                offset("z"),
                number("speed")
            )),
            "moveToWell" | "moveToCoordinates" => {
                let at = |axis: &str| shown(command.params.get("coordinates").map(|place| &place[axis]));
                let spot = match command.name {
                    "moveToWell" => spot,
                    _ => format!("Location(Point({}, {}, {}), None)", at("x"), at("y"), at("z")),
                };
                let direct = command.params.get("forceDirect") == Some(&Value::Bool(true));
                let direct = if direct { ", force_direct=True" } else { "" };
                let given = |key: &str, name: &str| {
                    command.params.get(key).map_or(String::new(), |v| format!(", {name}={}", shown(Some(v))))
                };
                let (speed, clear) = (given("speed", "speed"), given("minimumZHeight", "minimum_z_height"));
                self.line(&format!("{pipette}.move_to({spot}{direct}{clear}{speed})"));
            }
            "moveLabware" => {
                let to = command.params.get("newLocation").cloned().unwrap_or_default();
                let before = self.slots.remove(text("labwareId"));
                self.slots.extend(to["slotName"].as_str().map(|slot| (text("labwareId").to_owned(), slot.to_owned())));
                if let (Some(slot), "offDeck", "manualMoveWithoutPause") =
                    (before, to.as_str().unwrap_or_default(), text("strategy"))
                {
                    self.line(&format!("del protocol.deck[{}]", quoted(&slot)));
                    return true;
                }
                let slot = to["slotName"].as_str().or(to["addressableAreaName"].as_str());
                let place = match (slot, to["moduleId"].as_str().or(to["labwareId"].as_str())) {
                    (Some(GRIPPER_CHUTE), _) => self.areas.get(CHUTE).cloned().unwrap_or_default(),
                    (Some(slot), _) => quoted(slot),
                    (None, Some(id)) => id.to_owned(),
                    (None, None) => "protocol_api.OFF_DECK".to_owned(),
                };
                let gripper = if text("strategy") == "usingGripper" { ", use_gripper=True" } else { "" };
                let shift = |key: &str, name: &str| {
                    let at = |axis: &str| shown(command.params.get(key).map(|offset| &offset[axis]));
                    command.params.get(key).map_or(String::new(), |_| {
                        format!(", {name}={{\"x\": {}, \"y\": {}, \"z\": {}}}", at("x"), at("y"), at("z"))
                    })
                };
                let (pick, drop) = (shift("pickUpOffset", "pick_up_offset"), shift("dropOffset", "drop_offset"));
                self.line(&format!("protocol.move_labware({}, {place}{gripper}{pick}{drop})", text("labwareId")));
            }
            "setTipState" => self.line(&format!("{}.reset()", text("labwareId"))),
            "home" => match command.params.get("axes").and_then(Value::as_array) {
                None => self.line("protocol.home()"),
                Some(axes) => {
                    let axis = axes.first().and_then(Value::as_str).unwrap_or_default();
                    let call = if axes.len() == 1 { "home_plunger" } else { "home" };
                    let mount = axis.trim_end_matches("Plunger").trim_end_matches('Z');
                    self.line(&format!("protocol.loaded_instruments[{}].{call}()", quoted(mount)));
                }
            },
            "thermocycler/openLid" => self.line(&format!("{module}.open_lid()")),
            "thermocycler/closeLid" => self.line(&format!("{module}.close_lid()")),
            "thermocycler/deactivateBlock" => self.line(&format!("{module}.deactivate_block()")),
            "thermocycler/deactivateLid" => self.line(&format!("{module}.deactivate_lid()")),
            "setRailLights" => {
                let on = command.params.get("on") == Some(&Value::Bool(true));
                self.line(&format!("protocol.set_rail_lights({})", if on { "True" } else { "False" }));
            }
            "temperatureModule/setTargetTemperature" => {
                self.line(&format!("{module}.start_set_temperature({})", number("celsius")));
            }
            "temperatureModule/waitForTemperature" => match self.targets.get(module) {
                Some(celsius) => self.line(&format!("{module}.await_temperature({celsius})")),
                None => return false,
            },
            "temperatureModule/deactivate" => self.line(&format!("{module}.deactivate()")),
            "absorbanceReader/openLid" => self.line(&format!("{module}.open_lid()")),
            "absorbanceReader/closeLid" => self.line(&format!("{module}.close_lid()")),
            "absorbanceReader/read" => self.line(&format!("{module}.read()")),
            "absorbanceReader/initialize" => {
                let wavelength = shown(command.params.get("sampleWavelengths").map(|all| &all[0]));
                let reference = command.params.get("referenceWavelength");
                let reference =
                    reference.map_or(String::new(), |nm| format!(", reference_wavelength={}", shown(Some(nm))));
                self.line(&format!("{module}.initialize(\"single\", [{wavelength}]{reference})"));
            }
            "magneticModule/engage" => self.line(&format!("{module}.engage(height_from_base={})", number("height"))),
            "magneticModule/disengage" => self.line(&format!("{module}.disengage()")),
            "heaterShaker/waitForTemperature" => self.line(&format!("{module}.wait_for_temperature()")),
            "dropTip" => self.line(&format!("{pipette}.drop_tip({spot})")),
            "moveToAddressableAreaForDropTip" | "moveToAddressableArea" => {
                let area = text("addressableAreaName");
                let area = if area.ends_with(CHUTE) { CHUTE } else { area };
                let bin =
                    if area == BIN { Some("protocol.fixed_trash") } else { self.areas.get(area).map(String::as_str) };
                let Some(bin) = bin else { return false };
                self.aimed = Some((pipette.to_owned(), bin.to_owned()));
            }
            // The call goes there by itself.
            "dropTipInPlace" => match aimed {
                Some((aimed, bin)) if aimed == pipette => self.line(&format!("{pipette}.drop_tip({bin})")),
                _ => return false,
            },
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

/// A place in a well, or the bin.
fn spot(command: &Command, well: &str) -> String {
    if command.text("labwareId") == BIN {
        return "protocol.fixed_trash".to_owned();
    }
    let Some(location) = command.params.get("wellLocation") else { return well.to_owned() };
    let [x, y, z] = ["x", "y", "z"].map(|axis| shown(Some(&location["offset"][axis].as_f64().unwrap_or(0.0).into())));
    let place = match location["origin"].as_str() {
        Some("bottom") => format!("{well}.bottom({z})"),
        Some("center") => format!("{well}.center()"),
        _ => format!("{well}.top({z})"),
    };
    if x == "0" && y == "0" { place } else { format!("{place}.move(Point({x}, {y}, 0))") }
}
