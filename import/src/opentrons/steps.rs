//! Commands as steps.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::analysis::{Analysis, Command};
use super::deck::{Deck, Kind, Labware, Mounted};
use super::layout::{self, Layouts};
use super::liquids::{Holding, Liquids};
use super::node::{Node, Place};
use super::tips::Refills;
use super::words::{self, number};
use crate::LeftOut;

/// Heights are told to this, mm: below is what binary fractions left.
const DUST: f64 = 1e-6;

/// Where a tip aspirates by default, mm above the bottom.
const DIP: f64 = 1.0;

/// Where it touches the wall by default, mm from the rim.
const TOUCH: f64 = -1.0;

/// What is switched off without having been on is switched off as a precaution.
const ANYWAY: &str = " { anyway: true }";

/// Below this pipettes of 50 uL have a mode of their own, uL.
const LOW: f64 = 5.0;

/// How commands say that the gripper moves labware.
pub(super) const BY_GRIPPER: &str = "usingGripper";

/// Commands on their way to steps.
pub(super) struct Steps<'a> {
    analysis: &'a Analysis,
    deck: &'a Deck,
    pub(super) nodes: Vec<Node>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) liquids: Liquids,
    /// By pipette, where it was moved to last: labware, well, and mm above the rim, aside of the axis last.
    moved: BTreeMap<String, (String, String, f64, [f64; 2])>,
    /// Tips that were taken, by rack.
    taken: BTreeMap<String, BTreeSet<String>>,
    /// Places without a tip, by rack: those that were taken and not returned.
    absent: BTreeMap<String, BTreeSet<String>>,
    /// Racks that a person refills, by the number of the command, counting from 0.
    refills: Refills,
    /// How many channels of a pipette have tips, where it has any.
    tips: BTreeMap<String, usize>,
    /// By pipette: the volume in its tips, uL, and what the strokes were more than that.
    drawn: BTreeMap<String, [f64; 2]>,
    /// What its tips take, uL.
    sizes: BTreeMap<String, f64>,
    /// Which nozzles of a pipette take tips, where not all do; nothing where that is not imported.
    layouts: Layouts,
    /// By pipette: the bin that it was brought over.
    aimed: BTreeMap<String, String>,
    /// What modules were set to last, degC.
    targets: BTreeMap<String, f64>,
    /// Numbers of the commands that set modules which stay on at the end.
    staying: BTreeSet<usize>,
    /// The number of the command on its way.
    at: usize,
    /// How long modules hold their temperature once they are there, s, until that is waited for.
    holds: BTreeMap<String, f64>,
    /// Modules that shake.
    shaking: BTreeSet<String>,
    /// The flow rates of each pipette that hold where a step says nothing, uL/s.
    flows: &'a BTreeMap<String, [f64; 3]>,
}

/// Where a command works.
struct Spot {
    place: Place,
    /// How far above the rim, mm.
    above: f64,
    /// Of the well, mm.
    depth: f64,
}

/// What flows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Flow {
    In,
    Out,
    Blow,
}

impl<'a> Steps<'a> {
    pub(super) fn new(
        analysis: &'a Analysis,
        deck: &'a Deck,
        flows: &'a BTreeMap<String, [f64; 3]>,
        liquids: Liquids,
    ) -> Self {
        Steps {
            analysis,
            deck,
            nodes: Vec::new(),
            left_out: Vec::new(),
            liquids,
            moved: BTreeMap::new(),
            taken: BTreeMap::new(),
            absent: BTreeMap::new(),
            refills: Refills::new(),
            tips: BTreeMap::new(),
            drawn: BTreeMap::new(),
            sizes: BTreeMap::new(),
            layouts: Layouts::new(),
            aimed: BTreeMap::new(),
            targets: BTreeMap::new(),
            staying: staying(&analysis.commands),
            at: 0,
            holds: BTreeMap::new(),
            shaking: BTreeSet::new(),
            flows,
        }
    }

    /// Takes the next command; `index` counts from 1.
    pub(super) fn take(&mut self, index: usize, command: &Command) {
        self.at = index;
        let done = self.step(command);
        if let Some(racks) = self.refills.remove(&(index - 1)) {
            racks.iter().for_each(|id| self.refilled(id));
        }
        if let Err(why) = done {
            let name = command.command_type.clone();
            self.nodes.push(Node::plain(format!("// not imported: {name}, as {why}")));
            self.left_out.push(LeftOut { line: index, name, why });
        }
    }

    /// A person puts a full rack in the place of one.
    fn refilled(&mut self, id: &str) {
        let Some(rack) = self.deck.labware.get(id) else { return };
        self.taken.remove(id);
        self.absent.remove(id);
        self.nodes.push(Node::plain(format!("refill {}", rack.name)));
    }

    fn say(&mut self, text: impl Into<String>) -> Result<(), String> {
        self.nodes.push(Node::plain(text));
        Ok(())
    }

    fn step(&mut self, command: &Command) -> Result<(), String> {
        let text = |name: &str| command.text(name);
        match command.command_type.as_str() {
            "pickUpTip" => self.pick_up(command),
            "dropTip" if self.deck.bins.is_one(text("labwareId")) => self.drop(command, text("labwareId")),
            "dropTip" => self.give_back(command),
            // The drop that follows says it.
            "moveToAddressableAreaForDropTip" | "moveToAddressableArea"
                if self.deck.bins.get(text("addressableAreaName")).is_some() =>
            {
                self.aimed.insert(text("pipetteId").to_owned(), text("addressableAreaName").to_owned());
                Ok(())
            }
            "dropTipInPlace" => match self.aimed.remove(text("pipetteId")) {
                Some(area) => self.drop(command, &area),
                None => Err("it is not at a bin".to_owned()),
            },
            "dispenseInPlace" | "blowOutInPlace" => self.give_in_place(command),
            "configureNozzleLayout" => self.lay_out(command),
            // The plunger goes to its start; what the tip does next says so.
            "prepareToAspirate" => Ok(()),
            // It is where it was; only what was measured of its place is looked up again.
            "reloadLabware" => Ok(()),
            // The tip that is taken next is named where it is taken.
            "getNextTip" => Ok(()),
            "configureForVolume" => self.configure(command),
            "aspirate" | "dispense" if command.number("volume") == Some(0.0) => self.move_to(command),
            "aspirate" => self.aspirate(command),
            "dispense" => self.dispense(command),
            "blowout" => self.blow_out(command),
            "touchTip" => self.touch(command),
            "moveToWell" => self.move_to(command),
            "moveToCoordinates" => self.move_across(command),
            "airGapInPlace" | "aspirateInPlace" => self.air(command),
            "waitForDuration" => {
                self.message(command);
                self.say(format!("wait {}", duration(command.number("seconds").unwrap_or(0.0))))
            }
            "waitForResume" | "pause" => {
                let message = text("message");
                self.say(format!("ask {}", words::text(if message.is_empty() { "Go on?" } else { message })))
            }
            "comment" => {
                self.message(command);
                Ok(())
            }
            "home" => self.home(command),
            "setRailLights" => {
                let verb = if command.params["on"] == true { "light" } else { "dim" };
                self.say(format!("{verb} {}", self.deck.robot.name()))
            }
            "setTipState" => self.refill(command),
            "moveLabware" => self.relocate(command),
            "loadLabware" => self.brought(command),
            name => self.module(name, command),
        }
    }

    fn message(&mut self, command: &Command) {
        let message = command.text("message");
        if !message.trim().is_empty() {
            self.nodes.push(Node::plain(format!("note {}", words::text(message))));
        }
    }

    fn pipette(&self, command: &Command) -> Result<(&'a Mounted, String), String> {
        let mounted = self.deck.pipettes.get(command.text("pipetteId")).ok_or("its pipette is not imported")?;
        Ok((mounted, format!("{}.{}", self.deck.robot.name(), mounted.mount)))
    }

    /// How many of its tips work at once; where it has none, all its channels.
    fn channels(&self, command: &Command) -> Result<usize, String> {
        let all = self.pipette(command)?.0.pipette.channels;
        Ok(self.tips.get(command.text("pipetteId")).copied().unwrap_or(all))
    }

    /// Racks that begin without tips, and those that a person refills.
    pub(super) fn park(&mut self, racks: &BTreeSet<String>, refills: Refills) {
        self.refills = refills;
        for (id, rack) in self.deck.labware.iter().filter(|(id, _)| racks.contains(*id)) {
            let places: BTreeSet<String> = rack.order.iter().cloned().collect();
            self.absent.insert(id.clone(), places.clone());
            // None of them is fresh: parked tips are taken by name.
            self.taken.insert(id.clone(), places);
        }
    }

    /// Where a command works.
    fn spot(&self, command: &Command) -> Result<Spot, String> {
        let labware = self.deck.labware.get(command.text("labwareId")).ok_or("its labware is not imported")?;
        let well = command.text("wellName");
        let place = self.reached(command, labware, well)?;
        let depth = labware.wells.get(well).map_or(0.0, |well| well.depth);
        let location = &command.params["wellLocation"];
        let z = location["offset"]["z"].as_f64().unwrap_or(0.0);
        let above = match location["origin"].as_str() {
            Some("bottom") => z - depth,
            Some("center") => z - depth / 2.0,
            None | Some("top" | "default") => z,
            Some(other) => return Err(format!("a height from the {other} is not supported")),
        };
        Ok(Spot { place, above, depth })
    }

    /// The flow rates of a pipette that hold where a step says nothing, uL/s.
    fn usual(&self, id: &str) -> Option<[f64; 3]> {
        let of_tips = || {
            let mounted = self.deck.pipettes.get(id).filter(|mounted| mounted.pipette.is_flex)?;
            Some(mounted.pipette.flows_with(*self.sizes.get(id)?))
        };
        self.flows.get(id).copied().or_else(of_tips)
    }

    /// All nozzles take tips, or some.
    fn lay_out(&mut self, command: &Command) -> Result<(), String> {
        let (mounted, by) = self.pipette(command)?;
        let id = command.text("pipetteId");
        let was = layout::take(&mut self.layouts, command, mounted.pipette.channels);
        match self.layouts.get(id) {
            None if was.is_some() => self.say(format!("lay out {by} from all")),
            None => Ok(()),
            Some(None) => Err("the language has no such layout of nozzles".to_owned()),
            Some(Some(layout)) if was.flatten().is_some_and(|was| was.corner == layout.corner) => Ok(()),
            Some(Some(layout)) => self.say(format!("lay out {by} from {}", layout.corner)),
        }
    }

    /// What a command reaches from a well.
    fn reached(&self, command: &Command, labware: &Labware, well: &str) -> Result<Place, String> {
        match self.layouts.get(command.text("pipetteId")) {
            Some(Some(layout)) => self.deck.reached_by(layout, labware, well),
            Some(None) => Err("some of its nozzles take tips, and that is not imported".to_owned()),
            None => self.deck.reached(self.channels(command)?, labware, well),
        }
    }

    /// Options of a step, in braces.
    fn options(&self, command: &Command, flow: Option<Flow>, more: &[String]) -> String {
        let mut all: Vec<String> = more.to_vec();
        let rate = command.number("flowRate");
        if let (Some(flow), Some(rate)) = (flow, rate)
            && let Some(usual) = self.usual(command.text("pipetteId")).map(|flows| flows[flow as usize])
            && (rate - usual).abs() > 1e-9 * usual
        {
            all.push(format!("rate: {} uL/s", number(rate)));
        }
        for axis in ["x", "y"] {
            let off = command.params["wellLocation"]["offset"][axis].as_f64().unwrap_or(0.0);
            if off.abs() > DUST {
                all.push(format!("{axis}: {} mm", number(off)));
            }
        }
        words::braced(&all)
    }

    /// A step in a well: what stands before the place, by whom, the height where a step says none, mm from the rim, and options.
    fn work(&mut self, command: &Command, before: &str, by: &str, spot: Spot, usual: f64, options: &str) {
        let behind = format!("{by}{}{options}", height(spot.above, spot.depth, Some(usual)));
        self.nodes.push(Node::about(before, spot.place, &behind));
        let aside = ["x", "y"].map(|axis| command.params["wellLocation"]["offset"][axis].as_f64().unwrap_or(0.0));
        let here = (command.text("labwareId").to_owned(), command.text("wellName").to_owned(), spot.above, aside);
        self.aimed.remove(command.text("pipetteId"));
        self.moved.insert(command.text("pipetteId").to_owned(), here);
    }

    fn pick_up(&mut self, command: &Command) -> Result<(), String> {
        let (mounted, by) = self.pipette(command)?;
        let (id, rack, well) = (command.text("pipetteId"), command.text("labwareId"), command.text("wellName"));
        let labware = self.deck.labware.get(rack).ok_or("its rack is not imported")?;
        if labware.kind != Kind::Tips {
            return Err(format!("`{}` is not a tip rack", labware.name));
        }
        if let Some(layout) = self.layouts.get(id) {
            let Some(layout) = layout else {
                return Err("some of its nozzles take tips, and that is not imported".to_owned());
            };
            let (place, tips) = (self.deck.reached_by(layout, labware, well)?, layout.rows * layout.columns);
            self.has_tips(command, labware, &place, tips);
            self.nodes.push(Node::about("pick up tip ", place, &format!(" by {by}")));
            return Ok(());
        }
        // Channels that reach no tip stay without one.
        let channels = mounted.pipette.channels;
        let absent = self.absent.entry(rack.to_owned()).or_default();
        let there = |well: &Option<&str>| well.is_some_and(|well| !absent.contains(well));
        let row = labware.row(channels, well);
        // Where all were taken before, they are named as they are: `check` finds that.
        let is_empty = !row.iter().any(there);
        let is_tip = |well: &Option<&str>| if is_empty { well.is_some() } else { there(well) };
        let tips = row.iter().filter(|well| is_tip(well)).count();
        if tips == 0 || !row[..tips].iter().all(is_tip) {
            return Err("the tips that its channels reach do not begin with the first channel".to_owned());
        }
        let place = self.deck.reached(tips, labware, well)?;
        let wells = self.deck.wells_of(&place);
        let taken = self.taken.entry(rack.to_owned()).or_default();
        let next = labware.order.iter().find(|well| !taken.contains(*well));
        let in_order = tips == channels
            && next.is_some_and(|next| wells.first() == Some(next))
            && taken.len().is_multiple_of(wells.len());
        self.has_tips(command, labware, &place, tips);
        match in_order {
            true => self.say(format!("pick up tip from {} by {by}", place.of)),
            false => {
                self.nodes.push(Node::about("pick up tip ", place, &format!(" by {by}")));
                Ok(())
            }
        }
    }

    /// A pipette has so many tips from a place of a rack.
    fn has_tips(&mut self, command: &Command, labware: &Labware, place: &Place, tips: usize) {
        let (id, rack) = (command.text("pipetteId"), command.text("labwareId"));
        let wells = self.deck.wells_of(place);
        self.absent.entry(rack.to_owned()).or_default().extend(wells.iter().cloned());
        self.taken.entry(rack.to_owned()).or_default().extend(wells);
        self.tips.insert(id.to_owned(), tips);
        let size = labware.wells.get(command.text("wellName")).map_or(0.0, |tip| tip.capacity);
        self.sizes.insert(id.to_owned(), size);
        self.aimed.remove(id);
        self.liquids.empty(id);
        self.moved.remove(id);
    }

    fn drop(&mut self, command: &Command, bin: &str) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let (bin, is_usual) = self.deck.bins.get(bin).ok_or("its bin is not imported")?;
        self.bare(command);
        let into = if is_usual { String::new() } else { format!(" into {bin}") };
        self.say(format!("drop tip{into} by {by}"))
    }

    /// What is dispensed or blown out where the tip is: over a bin, to which the pipette was brought, or where it was moved to.
    fn give_in_place(&mut self, command: &Command) -> Result<(), String> {
        let over_bin = |area: &String| {
            let mut there = command.clone();
            there.params["labwareId"] = area.as_str().into();
            there
        };
        let aimed = self.aimed.get(command.text("pipetteId")).map(over_bin);
        let there = aimed.or_else(|| self.here(command).map(|(there, _)| there));
        let there = there.ok_or("it is done at the position of the tip, which is not known")?;
        if command.command_type == "blowOutInPlace" { self.blow_out(&there) } else { self.dispense(&there) }
    }

    /// A pipette has no tips any more.
    fn bare(&mut self, command: &Command) {
        let id = command.text("pipetteId");
        self.liquids.empty(id);
        self.drawn.remove(id);
        self.moved.remove(id);
        self.tips.remove(id);
    }

    fn give_back(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let Spot { place, .. } = self.spot(command)?;
        let wells = self.deck.wells_of(&place);
        if let Some(absent) = self.absent.get_mut(command.text("labwareId")) {
            absent.retain(|well| !wells.contains(well));
        }
        let rest = if self.liquids.is_wet(command.text("pipetteId")) { " { with_liquid: true }" } else { "" };
        self.bare(command);
        self.nodes.push(Node::about("return tip to ", place, &format!(" by {by}{rest}")));
        Ok(())
    }

    fn aspirate(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let id = command.text("pipetteId");
        let location = &command.params["wellLocation"];
        let is_above = location["origin"] == "top" && location["offset"]["z"].as_f64().is_none_or(|z| z > -DUST);
        // Above the bin there is nothing but air.
        if let Some((bin, _)) = self.deck.bins.get(command.text("labwareId"))
            && is_above
        {
            self.moved.remove(id);
            self.nodes.push(Node::plain(format!("move {by} to {bin}[A1]")));
            return self.air_gap(command, &by);
        }
        let spot = self.spot(command)?;
        // What is aspirated at the rim or above it is air.
        if spot.above > -DUST {
            let is_there = self.moved.get(id).is_some_and(|(labware, well, height, _)| {
                labware == command.text("labwareId")
                    && well == command.text("wellName")
                    && (height - spot.above).abs() < DUST
            });
            if !is_there {
                self.work(command, &format!("move {by} to "), "", spot, 0.0, "");
            }
            return self.air_gap(command, &by);
        }
        let reach = self.deck.reach(&spot.place, spot.above + spot.depth);
        let (how, wells) = ((self.channels(command)?, reach), self.deck.wells_of(&spot.place));
        let lacks = self.liquids.aspirate(id, command.volume(), how, &spot.place.of, &wells);
        let mut more = if lacks { vec!["partial: true".to_owned()] } else { Vec::new() };
        let [volume, beyond] = self.drawn.entry(id.to_owned()).or_default();
        *volume += command.volume();
        *beyond += command.correction();
        if command.correction().abs() > DUST {
            more.push(format!("fix: {} uL", number(command.correction())));
        }
        let options = self.options(command, Some(Flow::In), &more);
        let before = format!("aspirate {} uL from ", number(command.volume() + command.correction()));
        let usual = DIP - spot.depth;
        self.work(command, &before, &format!(" by {by}"), spot, usual, &options);
        Ok(())
    }

    fn dispense(&mut self, command: &Command) -> Result<(), String> {
        let volume = command.volume();
        let before = format!("dispense {} uL into ", number(volume + self.corrected(command)));
        self.give(command, &before, Flow::Out, |liquids, labware, wells| {
            liquids.dispense(command.text("pipetteId"), volume, labware, wells);
        })
    }

    /// A pipette changes its mode only for volumes below the smallest of its usual one.
    fn configure(&self, command: &Command) -> Result<(), String> {
        let (mounted, _) = self.pipette(command)?;
        match mounted.pipette.asset.starts_with("FlexP50") && command.volume() < LOW {
            true => Err("the language has no mode for small volumes".to_owned()),
            false => Ok(()),
        }
    }

    /// What a stroke that empties the tip is more than its volume: as much as those were that filled it.
    fn corrected(&mut self, command: &Command) -> f64 {
        let Some([volume, more]) = self.drawn.get_mut(command.text("pipetteId")) else { return 0.0 };
        *volume -= command.volume();
        if *volume < 1e-6 { std::mem::take(more) } else { 0.0 }
    }

    fn blow_out(&mut self, command: &Command) -> Result<(), String> {
        self.drawn.remove(command.text("pipetteId"));
        self.give(command, "blow out into ", Flow::Blow, |liquids, labware, wells| {
            liquids.blow_out(command.text("pipetteId"), labware, wells);
        })
    }

    /// Liquid goes into wells or the bin.
    fn give(
        &mut self,
        command: &Command,
        before: &str,
        flow: Flow,
        pass: impl FnOnce(&mut Liquids, &str, &[String]),
    ) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let push: Vec<String> =
            command.number("pushOut").map(|volume| format!("push_out: {} uL", number(volume))).into_iter().collect();
        let options = self.options(command, Some(flow), &push);
        if let Some((bin, _)) = self.deck.bins.get(command.text("labwareId")) {
            pass(&mut self.liquids, "", &[]);
            return self.say(format!("{before}{bin}[A1] by {by}{options}"));
        }
        let racks = self.deck.labware.get(command.text("labwareId")).filter(|labware| labware.kind == Kind::Tips);
        if let Some(rack) = racks {
            return Err(format!("`{}` is a rack of tips, and takes no liquid", rack.name));
        }
        let spot = self.spot(command)?;
        pass(&mut self.liquids, &spot.place.of, &self.deck.wells_of(&spot.place));
        self.work(command, before, &format!(" by {by}"), spot, 0.0, &options);
        Ok(())
    }

    fn touch(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let spot = self.spot(command)?;
        let mut more = Vec::new();
        let radius = command.number("radius").unwrap_or(1.0);
        if (radius - 1.0).abs() > 1e-9 {
            more.push(format!("radius: {}", number(radius)));
        }
        let speed = command.number("speed").unwrap_or(60.0);
        if (speed - 60.0).abs() > 1e-9 {
            more.push(format!("speed: {} mm/s", number(speed)));
        }
        let options = self.options(command, None, &more);
        self.work(command, "touch tip to ", &format!(" by {by}"), spot, TOUCH, &options);
        Ok(())
    }

    fn move_to(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let spot = self.spot(command)?;
        let mut more = ways(command);
        if self.deck.labware.get(command.text("labwareId")).is_some_and(|labware| labware.kind == Kind::Tips) {
            if spot.above.abs() > DUST {
                more.push(format!("z: {} mm", number(spot.above)));
            }
            let options = self.options(command, None, &more);
            self.moved.remove(command.text("pipetteId"));
            self.nodes.push(Node::about(&format!("hover {by} at "), spot.place, &options));
            return Ok(());
        }
        let options = self.options(command, None, &more);
        self.work(command, &format!("move {by} to "), "", spot, 0.0, &options);
        Ok(())
    }

    /// Moves to a place of the deck.
    fn move_across(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        let place = &command.params["coordinates"];
        let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(|axis| place[axis].as_f64()) else {
            return Err("it gives no place".to_owned());
        };
        self.moved.remove(command.text("pipetteId"));
        let more: Vec<String> =
            [format!("x: {} mm", number(x)), format!("y: {} mm", number(y))].into_iter().chain(ways(command)).collect();
        self.say(format!("steer {by} at {} mm{}", number(z), words::braced(&more)))
    }

    fn air(&mut self, command: &Command) -> Result<(), String> {
        let (_, by) = self.pipette(command)?;
        match self.here(command).filter(|(_, is_in_well)| *is_in_well && command.command_type == "aspirateInPlace") {
            Some((there, _)) => self.aspirate(&there),
            None => self.air_gap(command, &by),
        }
    }

    /// A command that is carried out where the tip is as one that names the place, and whether that is in a well.
    fn here(&self, command: &Command) -> Option<(Command, bool)> {
        let (labware, well, above, [x, y]) = self.moved.get(command.text("pipetteId"))?;
        let mut there = command.clone();
        there.params["labwareId"] = labware.as_str().into();
        there.params["wellName"] = well.as_str().into();
        there.params["wellLocation"] = json!({ "origin": "top", "offset": { "x": x, "y": y, "z": above } });
        Some((there, *above < 0.0))
    }

    fn air_gap(&mut self, command: &Command, by: &str) -> Result<(), String> {
        self.liquids.air(command.text("pipetteId"), command.volume());
        self.drawn.entry(command.text("pipetteId").to_owned()).or_default()[0] += command.volume();
        let options = self.options(command, Some(Flow::In), &[]);
        self.say(format!("air gap {} uL by {by}{options}", number(command.volume())))
    }

    fn home(&mut self, command: &Command) -> Result<(), String> {
        let Some(axes) = command.params["axes"].as_array() else {
            return self.say(format!("home {}", self.deck.robot.name()));
        };
        let axes: BTreeSet<&str> = axes.iter().filter_map(Value::as_str).collect();
        for mount in ["left", "right"] {
            let [up, plunger] = ["Z", "Plunger"].map(|axis| format!("{mount}{axis}"));
            if axes == BTreeSet::from([up.as_str(), plunger.as_str()]) {
                return self.say(format!("home {}.{mount}", self.deck.robot.name()));
            }
            if axes == BTreeSet::from([plunger.as_str()]) {
                return self.say(format!("home plunger {}.{mount}", self.deck.robot.name()));
            }
        }
        let axes: Vec<&str> = axes.into_iter().collect();
        Err(format!("the language can home a robot or a pipette, but not {}", axes.join(", ")))
    }

    fn refill(&mut self, command: &Command) -> Result<(), String> {
        let id = command.text("labwareId");
        let rack = self.deck.labware.get(id).ok_or("its rack is not imported")?;
        let wells = command.params["wellNames"].as_array().map_or(0, Vec::len);
        if command.text("tipWellState") != "clean" || wells != rack.wells.len() {
            return Err("only a whole rack is refilled".to_owned());
        }
        self.refilled(id);
        Ok(())
    }

    /// A person puts labware in another place.
    fn relocate(&mut self, command: &Command) -> Result<(), String> {
        let labware = self.deck.labware.get(command.text("labwareId")).ok_or("its labware is not imported")?;
        let chute = command.params["newLocation"]["addressableAreaName"].as_str();
        let by_gripper = command.text("strategy") == BY_GRIPPER;
        if let Some((bin, _)) = chute.and_then(|area| self.deck.bins.get(area)) {
            let by = if by_gripper { format!(" by {}.gripper", self.deck.robot.name()) } else { String::new() };
            return self.say(format!("dispose {} into {bin}{by}", labware.name));
        }
        let place = self.deck.place_of(&command.params["newLocation"])?;
        if by_gripper {
            let mut shifts = Vec::new();
            for (key, word) in [("pickUpOffset", "pick"), ("dropOffset", "drop")] {
                for axis in ["x", "y", "z"] {
                    let shift = command.params[key][axis].as_f64().unwrap_or(0.0);
                    if shift.abs() > DUST {
                        shifts.push(format!("{word}_{axis}: {} mm", number(shift)));
                    }
                }
            }
            let (by, options) = (format!("{}.gripper", self.deck.robot.name()), words::braced(&shifts));
            return self.say(format!("relocate {} to {place} by {by}{options}", labware.name));
        }
        let verb = match command.text("strategy") {
            "manualMoveWithPause" => "relocate",
            "manualMoveWithoutPause" => "moved",
            other => return Err(format!("`{other}` is not supported")),
        };
        self.say(format!("{verb} {} to {place}", labware.name))
    }

    /// Labware that comes to a place where something was before.
    fn brought(&mut self, command: &Command) -> Result<(), String> {
        let labware = command.loaded("labwareId").and_then(|id| self.deck.labware.get(id));
        let Some((labware, place)) = labware.and_then(|l| Some((l, l.comes.clone()?))) else { return Ok(()) };
        self.say(format!("moved {} to {place}", labware.name))
    }

    fn module(&mut self, command_type: &str, command: &Command) -> Result<(), String> {
        let known = |id: &str| self.deck.modules.get(id).map(|module| module.name.clone());
        let Some((_, verb)) = command_type.split_once('/') else {
            return Err("the language has no such step".to_owned());
        };
        let name = known(command.text("moduleId")).ok_or("its module is not imported")?;
        let celsius = command.number("celsius").map(number).unwrap_or_default();
        match verb {
            "setTargetBlockTemperature" => {
                let target = command.number("celsius").ok_or("it gives no temperature")?;
                if self.holds.remove(&name).is_some() {
                    return Err("what it was set to before is held for a time that nothing waits for".to_owned());
                }
                self.holds.extend(command.number("holdTimeSeconds").filter(|s| *s > 0.0).map(|s| (name.clone(), s)));
                self.heat(&name, target, command.number("blockMaxVolumeUl"))
            }
            "setTargetTemperature" => {
                self.heat(&name, command.number("celsius").ok_or("it gives no temperature")?, None)
            }
            "runProfile" => self.profile(&name, command),
            "runExtendedProfile" => self.extended_profile(&name, command),
            // The module counts the time from when it is there.
            "waitForBlockTemperature" if self.holds.contains_key(&name) => {
                self.say(format!("settle {name}"))?;
                let held = self.holds.remove(&name).unwrap_or_default();
                self.say(format!("wait {}", duration(held)))
            }
            "waitForTemperature" | "waitForBlockTemperature"
                if command.number("celsius").is_none_or(|celsius| self.targets.get(&name) == Some(&celsius)) =>
            {
                self.say(format!("settle {name}"))
            }
            "waitForTemperature" => Err("it waits for another temperature than the module was set to".to_owned()),
            "deactivate" | "deactivateHeater" | "deactivateBlock" => {
                let anyway = if self.targets.contains_key(&name) { "" } else { ANYWAY };
                self.say(format!("stop heating {name}{anyway}"))
            }
            "engage" => {
                let height = command.number("height").ok_or("it gives no height")?;
                self.say(format!("engage {name} at {} mm", number(height)))
            }
            "disengage" => self.say(format!("disengage {name}")),
            "setTargetLidTemperature" => self.say(format!("heat lid {name} to {celsius} degC")),
            "waitForLidTemperature" => self.say(format!("settle lid {name}")),
            "deactivateLid" => self.say(format!("stop heating lid {name}")),
            "initialize" => {
                let wavelengths = command.params["sampleWavelengths"].as_array();
                let [wavelength] = wavelengths.map_or(&[][..], Vec::as_slice) else {
                    return Err("the language sets a reader up for one wavelength".to_owned());
                };
                let reference = command.number("referenceWavelength").map(|nm| format!("reference: {} nm", number(nm)));
                let options = words::braced(&reference.into_iter().collect::<Vec<_>>());
                let wavelength = wavelength.as_f64().ok_or("it gives no wavelength")?;
                self.say(format!("initialize {name} at {} nm{options}", number(wavelength)))
            }
            "read" => self.say(format!("scan {name}")),
            "openLid" => self.say(format!("open lid {name}")),
            "closeLid" => self.say(format!("close lid {name}")),
            "setAndWaitForShakeSpeed" => {
                let rpm = command.number("rpm").ok_or("it gives no speed")?;
                self.shaking.insert(name.clone());
                self.say(format!("shake {name} at {} rpm", number(rpm)))
            }
            "deactivateShaker" => {
                let anyway = if self.shaking.contains(&name) { "" } else { ANYWAY };
                self.say(format!("stop shaking {name}{anyway}"))
            }
            "openLabwareLatch" => self.say(format!("open latch {name}")),
            "closeLabwareLatch" => self.say(format!("close latch {name}")),
            _ => Err("the language has no such step of this module".to_owned()),
        }
    }

    /// Sets a module; `volume` is the most that one of its wells holds, uL.
    fn heat(&mut self, module: &str, celsius: f64, volume: Option<f64>) -> Result<(), String> {
        self.targets.insert(module.to_owned(), celsius);
        let volume = volume.filter(|volume| *volume > 0.0).map(|volume| format!("volume: {} uL", number(volume)));
        let stays = self.staying.contains(&self.at).then(|| "stays: true".to_owned());
        let options = words::braced(&volume.into_iter().chain(stays).collect::<Vec<_>>());
        self.say(format!("heat {module} to {} degC{options}", number(celsius)))
    }

    /// Temperatures, and cycles of them.
    fn extended_profile(&mut self, module: &str, command: &Command) -> Result<(), String> {
        let elements = command.params["profileElements"].as_array().ok_or("it gives no profile")?;
        for element in elements {
            let mut part = command.clone();
            part.params["profile"] = match &element["steps"] {
                Value::Null => json!([element]),
                steps => steps.clone(),
            };
            for _ in 0..element["repetitions"].as_u64().unwrap_or(1) {
                self.profile(module, &part)?;
            }
        }
        Ok(())
    }

    /// The temperatures of a profile, each held for its time.
    fn profile(&mut self, module: &str, command: &Command) -> Result<(), String> {
        let steps = command.params["profile"].as_array().ok_or("it gives no profile")?;
        let read = |step: &Value| Some((step["celsius"].as_f64()?, step["holdSeconds"].as_f64()?));
        let steps: Option<Vec<(f64, f64)>> = steps.iter().map(read).collect();
        for (celsius, seconds) in steps.ok_or("a step of its profile has no temperature or no time")? {
            self.heat(module, celsius, command.number("blockMaxVolumeUl"))?;
            self.say(format!("settle {module}"))?;
            if seconds > 0.0 {
                self.say(format!("wait {}", duration(seconds)))?;
            }
        }
        Ok(())
    }

    /// What liquids wells hold at the start, by labware and well: volume in uL and name.
    pub(super) fn loaded(&self, commands: &[Command]) -> Holding {
        let mut out = BTreeMap::new();
        for command in commands.iter().filter(|c| c.command_type == "loadLiquid") {
            let Some(labware) = self.deck.labware.get(command.text("labwareId")) else { continue };
            let Value::Object(volumes) = &command.params["volumeByWell"] else { continue };
            let name = self.analysis.liquid(command.text("liquidId")).unwrap_or("liquid");
            for (well, volume) in volumes {
                let key = (labware.name.clone(), well.clone());
                out.insert(key, (volume.as_f64().unwrap_or(0.0), name.to_owned()));
            }
        }
        out
    }
}

/// How a command moves, where it says so.
fn ways(command: &Command) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(speed) = command.number("speed") {
        out.push(format!("speed: {} mm/s", number(speed)));
    }
    if command.params["forceDirect"] == true {
        out.push("direct: true".to_owned());
    }
    if let Some(clear) = command.number("minimumZHeight") {
        out.push(format!("clear: {} mm", number(clear)));
    }
    out
}

/// ` at bottom + 2 mm`, from where the number is round; nothing where that is usual.
fn height(above: f64, depth: f64, usual: Option<f64>) -> String {
    if usual.is_some_and(|usual| (usual - above).abs() < DUST) {
        return String::new();
    }
    let from = [("bottom", above + depth), ("top", above), ("middle", above + depth / 2.0)];
    let is_round = |height: f64, step: f64| ((height / step).round() * step - height).abs() < DUST;
    let round = [1.0, 0.1, 0.01].iter().find_map(|step| from.iter().find(|(_, height)| is_round(*height, *step)));
    let (word, height) = *round.unwrap_or(&from[0]);
    // Ten millionths of a millimetre are dust.
    let height = (height * 1e7).round() / 1e7;
    match height {
        h if h.abs() < DUST => format!(" at {word}"),
        h if h < 0.0 => format!(" at {word} - {} mm", number(-h)),
        h => format!(" at {word} + {} mm", number(h)),
    }
}

/// A time in the largest unit in which it is whole.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s >= 3600.0 && s % 3600.0 == 0.0 => format!("{} h", number(s / 3600.0)),
        s if s >= 60.0 && s % 60.0 == 0.0 => format!("{} min", number(s / 60.0)),
        s => format!("{} s", number(s)),
    }
}

/// Numbers of the commands after which a module stays at its temperature to the end.
fn staying(commands: &[Command]) -> BTreeSet<usize> {
    let mut last: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, command) in commands.iter().enumerate() {
        let verb = command.command_type.split_once('/').map_or("", |(_, verb)| verb);
        let module = command.text("moduleId");
        match verb {
            "setTargetTemperature" | "setTargetBlockTemperature" => drop(last.insert(module, index + 1)),
            "deactivate" | "deactivateHeater" | "deactivateBlock" | "runProfile" => drop(last.remove(module)),
            _ => {}
        }
    }
    last.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_told_from_where_they_are_round() {
        assert_eq!(height(2.0 - 10.67, 10.67, Some(1.0 - 10.67)), " at bottom + 2 mm");
        assert_eq!(height(1.0 - 10.67, 10.67, Some(1.0 - 10.67)), "");
        assert_eq!(height(-1.0, 10.67, None), " at top - 1 mm");
        assert_eq!(height(5.0, 10.67, None), " at top + 5 mm");
        assert_eq!(height(-5.335, 10.67, None), " at middle");
        assert_eq!(height(-10.67, 10.67, None), " at bottom");
    }

    #[test]
    fn durations_are_told_in_whole_units() {
        assert_eq!(
            [duration(120.0), duration(90.0), duration(7200.0), duration(0.5)],
            ["2 min", "90 s", "2 h", "0.5 s"]
        );
    }
}
