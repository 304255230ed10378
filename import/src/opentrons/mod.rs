//! Protocols of Opentrons' OT-2 and Flex: analyses of them, and JSON protocols.
//!
//! An analysis lists the commands that a protocol would run, whatever the Python says; this makes a lab and steps of them, and loops of steps
//! that repeat. It does not say what wells hold where the protocol does not: they hold water then, as much as is aspirated.

mod analysis;
mod deck;
mod layout;
mod library;
mod liquids;
mod node;
mod robot;
mod steps;
mod tips;
mod words;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use matterix_ir::FileId;
use matterix_lang::syntax::fmt::format;

use crate::{Imported, LeftOut, Mistake};
use analysis::{Analysis, Command};
use deck::{Deck, Kind};
use library::Library;
use liquids::{Holding, Liquids};
use node::{cell, folded};
use robot::{Bins, Robot};
use steps::Steps;
use words::number;

/// Reads an analysis or a JSON protocol; `title` is what the file is called.
pub fn import(text: &str, title: &str) -> Result<Imported, Mistake> {
    let analysis = Analysis::read(text)?;
    if let Some(index) = analysis.commands.iter().position(|c| c.command_type == "custom") {
        let why = format!(
            "command {} is only a comment: below API level 2.14 an analysis lacks heights, air gaps and steps of modules; analyse the protocol at level 2.14 or above",
            index + 1
        );
        return Err(Mistake { line: 0, why });
    }
    let library = Library::read();
    let robot = analysis.robot();
    let bins = Bins::of(robot, &analysis.commands);
    let mut deck = Deck::new(robot, bins, &[deck::ASIDE, "deck", "way", "well", "column"]);
    let mut left_out = Vec::new();
    for (index, command) in analysis.commands.iter().enumerate() {
        if matches!(command.command_type.as_str(), "loadPipette" | "loadModule" | "loadLabware")
            && let Err(why) = deck.load(command, &analysis, &library)
        {
            left_out.push(LeftOut { line: index + 1, name: command.command_type.clone(), why });
        }
    }
    let flows = flows(&analysis, &deck);
    // Once to see what wells must hold, and again with that.
    let tried = steps(&analysis, &deck, &flows, Liquids::default());
    let holding = holding(&tried, &analysis.commands, &deck);
    let initial = holding.iter().map(|(well, (volume, _))| (well.clone(), *volume)).collect();
    let mut steps = steps(&analysis, &deck, &flows, Liquids::with(initial));
    left_out.append(&mut steps.left_out);
    left_out.sort_by_key(|left| left.line);
    let nodes = std::mem::take(&mut steps.nodes);
    let leaves = |c: &Command| c.command_type == "moveLabware" && c.params["newLocation"] == deck::OFF;
    let has_aside = deck.labware.values().any(|l| l.on == deck::ASIDE) || analysis.commands.iter().any(leaves);
    let has_gripper = analysis.commands.iter().any(|c| c.text("strategy") == steps::BY_GRIPPER);
    let page = Page {
        library: &library,
        has_gripper,
        deck: &deck,
        flows: &flows,
        holding: &holding,
        parked: &parked(&analysis),
        has_aside,
    };
    let text = page.text(&analysis, title, &folded(nodes));
    let text = format(FileId(0), &text).map_err(|found| {
        let why = found.first().map_or_else(String::new, |d| d.headline.clone());
        Mistake { line: 0, why: format!("the written file cannot be read: {why}") }
    })?;
    Ok(Imported { text, left_out, files: deck.files.into_iter().collect() })
}

/// The flow rates that each pipette uses most, uL/s.
fn flows(analysis: &Analysis, deck: &Deck) -> BTreeMap<String, [f64; 3]> {
    let mut out = BTreeMap::new();
    for (id, mounted) in &deck.pipettes {
        let mut flows = mounted.pipette.flows(None);
        // What is usual depends on the tips of a pipette of the Flex.
        if mounted.pipette.is_flex {
            continue;
        }
        for (which, name) in ["aspirate", "dispense", "blowout"].iter().enumerate() {
            if which == 1 {
                flows = mounted.pipette.flows(Some(flows[0]));
            }
            let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
            let of = analysis.commands.iter().filter(|c| c.command_type == *name && c.text("pipetteId") == id);
            of.filter_map(|c| c.number("flowRate")).for_each(|rate| *counts.entry(rate.to_bits()).or_default() += 1);
            if let Some((rate, _)) = counts.into_iter().max_by_key(|(_, count)| *count) {
                flows[which] = f64::from_bits(rate);
            }
        }
        out.insert(id.clone(), flows);
    }
    out
}

/// Racks into which tips are dropped before any is taken from there.
fn parked(analysis: &Analysis) -> BTreeSet<String> {
    let mut touched: BTreeMap<&str, bool> = BTreeMap::new();
    for command in &analysis.commands {
        if matches!(command.command_type.as_str(), "pickUpTip" | "dropTip") {
            touched.entry(command.text("labwareId")).or_insert(command.command_type == "dropTip");
        }
    }
    touched.into_iter().filter(|(_, is_parked)| *is_parked).map(|(id, _)| id.to_owned()).collect()
}

/// All commands as steps.
fn steps<'a>(
    analysis: &'a Analysis,
    deck: &'a Deck,
    flows: &'a BTreeMap<String, [f64; 3]>,
    liquids: Liquids,
) -> Steps<'a> {
    let mut steps = Steps::new(analysis, deck, flows, liquids);
    let parked = parked(analysis);
    steps.park(&parked, tips::refills(&analysis.commands, deck, &parked));
    // Labware may come to a place that something has left.
    let is_step = |c: &Command| !c.command_type.starts_with("load") || c.command_type == "loadLabware";
    // The robot begins at home by itself.
    let first = analysis.commands.iter().position(|c| c.command_type != "home").unwrap_or(0);
    for (index, command) in analysis.commands.iter().enumerate().skip(first).filter(|(_, c)| is_step(c)) {
        steps.take(index + 1, command);
    }
    steps
}

/// What the protocol says that wells hold; else, of sources, what they need, as far as it fits in.
fn holding(steps: &Steps<'_>, commands: &[Command], deck: &Deck) -> Holding {
    let mut out = steps.loaded(commands);
    let capacity = |(labware, well): &(String, String)| deck.capacity(labware, well);
    for (well, needed) in steps.liquids.needed(capacity) {
        let most = capacity(&well);
        out.entry(well).or_insert_with(|| (needed.min(most), "water".to_owned()));
    }
    out
}

/// The file on its way.
struct Page<'p> {
    library: &'p Library,
    /// Whether a gripper moves labware.
    has_gripper: bool,
    deck: &'p Deck,
    flows: &'p BTreeMap<String, [f64; 3]>,
    holding: &'p Holding,
    /// Racks that begin without tips: others are parked there.
    parked: &'p BTreeSet<String>,
    /// Whether something stands beside the robot at some time.
    has_aside: bool,
}

impl Page<'_> {
    fn text(&self, analysis: &Analysis, title: &str, nodes: &[node::Node]) -> String {
        let mut out = String::from("mtx 1\n");
        let name = analysis.metadata.get("protocolName").and_then(|n| n.as_str()).unwrap_or(title);
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        let _ = writeln!(out, "//! {name}. Imported from {title}.\n");
        let robot = self.deck.robot;
        let more = match robot {
            Robot::Ot2 => vec!["TrashBin"],
            Robot::Flex => {
                self.deck.bins.all().map(|bin| bin.asset).chain(self.has_gripper.then_some("FlexGripper")).collect()
            }
        };
        let used = self.deck.used.iter().map(String::as_str).chain([robot.asset()]).chain(more);
        let (flex, shared): (BTreeSet<&str>, BTreeSet<&str>) = used.partition(|asset| self.library.is_of_flex(asset));
        for (module, used) in [("flex", flex), ("opentrons", shared)] {
            if module == "opentrons" && self.has_aside {
                out.push_str("use std::furniture::LabBench\n");
            }
            if !used.is_empty() {
                let _ = writeln!(out, "use std::{module}::{{{}}}", used.into_iter().collect::<Vec<_>>().join(", "));
            }
        }
        out.push('\n');
        for (asset, from) in &self.deck.assets {
            let _ = writeln!(out, "asset {asset} from labware \"{from}\"");
        }
        let liquids = self.liquids();
        for (liquid, words) in &liquids {
            let _ = writeln!(
                out,
                "\n/// {words}: assumed to be water, because the protocol does not give its contents.\nsolution {liquid} {{ water: 100 %w/w }}"
            );
        }
        out.push_str("\nlab deck {\nambient: 22 degC\n");
        self.lab(&liquids, &mut out);
        let mut taken = BTreeSet::from(["deck".to_owned()]);
        let workflow = words::name_of(&name, "protocol", &mut taken);
        let _ = writeln!(out, "}}\n\nworkflow {workflow} in deck {{");
        nodes.iter().for_each(|node| {
            let _ = writeln!(out, "{}", node.written());
        });
        out.push_str("}\n");
        out
    }

    /// Liquids by the names that they have here, with the protocol's; water needs none.
    fn liquids(&self) -> BTreeMap<String, String> {
        let names: BTreeSet<&str> =
            self.holding.values().map(|(_, name)| name.as_str()).filter(|n| *n != "water").collect();
        let mut taken: BTreeSet<String> = self.deck.labware.values().map(|labware| labware.name.clone()).collect();
        names.into_iter().map(|name| (words::name_of(name, "liquid", &mut taken), name.to_owned())).collect()
    }

    fn lab(&self, liquids: &BTreeMap<String, String>, out: &mut String) {
        let mut mounts: Vec<String> = self
            .deck
            .pipettes
            .iter()
            .map(|(id, mounted)| {
                let flows = self.flows.get(id).copied().unwrap_or(mounted.pipette.flows(None));
                let usual = mounted.pipette.flows(None)[0];
                let [_, out, blow] = mounted.pipette.flows(Some(flows[0]));
                let said = ["flow", "flow_out", "flow_blow"].iter().zip(flows).zip([usual, out, blow]);
                let other: Vec<String> = said
                    .filter(|((_, flow), own)| (flow - own).abs() > 1e-9 * own)
                    .map(|((name, flow), _)| format!("{name}: {} uL/s", number(flow)))
                    .collect();
                format!("{}: {}{}", mounted.mount, mounted.pipette.asset, words::braced(&other))
            })
            .collect();
        let robot = self.deck.robot;
        mounts.extend(self.has_gripper.then(|| "gripper: FlexGripper".to_owned()));
        mounts.extend(self.deck.bins.usual().map(|bin| format!("trash: {bin}")));
        let _ = writeln!(out, "{} = {}{} at (0, 0, 0) m", robot.name(), robot.asset(), words::braced(&mounts));
        for bin in self.deck.bins.all() {
            let place = match &bin.slot {
                Some(slot) => format!("on {}.slot[{slot}]", robot.name()),
                None => "at (1.5, 0, 0) m".to_owned(),
            };
            let _ = writeln!(out, "{} = {} {place}", bin.name, bin.asset);
        }
        if self.has_aside {
            let _ = writeln!(out, "{} = LabBench at (0, -1.5, 0) m", deck::ASIDE);
        }
        for id in &self.deck.loaded {
            if let Some(module) = self.deck.modules.get(id) {
                let _ = writeln!(out, "{} = {} on {}.slot[{}]", module.name, module.asset, robot.name(), module.slot);
            }
            let Some(labware) = self.deck.labware.get(id) else { continue };
            let holding = match labware.kind {
                Kind::Tips => String::new(),
                Kind::Wells => self.held(labware, liquids),
            };
            let emptied = match self.parked.contains(id) {
                true => format!(" {{ emptied: {} }}", labware.wells.len()),
                false => String::new(),
            };
            let _ = writeln!(out, "{} = {}{emptied} on {}{holding}", labware.name, labware.asset, labware.on);
        }
    }

    /// ` holding { A1 .. H1: 100 uL of water }`: alike wells of a column together.
    fn held(&self, labware: &deck::Labware, liquids: &BTreeMap<String, String>) -> String {
        let mut runs: Vec<(Vec<&str>, String)> = Vec::new();
        for well in &labware.order {
            let Some((volume, name)) = self.holding.get(&(labware.name.clone(), well.clone())) else { continue };
            let own = liquids.iter().find(|(_, words)| *words == name).map_or(name.as_str(), |(own, _)| own);
            let said = format!("{} uL of {own}", number(*volume));
            let follows = |last: &str| {
                let (Some(a), Some(b)) = (cell(last), cell(well)) else { return false };
                a.1 == b.1 && a.0 + 1 == b.0
            };
            match runs.last_mut() {
                Some((wells, known)) if *known == said && wells.last().is_some_and(|last| follows(last)) => {
                    wells.push(well)
                }
                _ => runs.push((vec![well], said)),
            }
        }
        // Columns that hold the same become a rectangle.
        let mut areas: Vec<(String, String, String)> = Vec::new();
        for (wells, said) in runs {
            let (first, last) = (wells[0].to_owned(), wells[wells.len() - 1].to_owned());
            let grows = |(from, to, known): &(String, String, String)| {
                let cells = [from.as_str(), to, &first, &last].map(cell);
                let [Some(a), Some(b), Some(c), Some(d)] = cells else { return false };
                *known == said && a.0 == c.0 && b.0 == d.0 && b.1 + 1 == c.1
            };
            match areas.last_mut().filter(|area| grows(area)) {
                Some(area) => area.1 = last,
                None => areas.push((first, last, said)),
            }
        }
        let all: Vec<String> = areas
            .into_iter()
            .map(
                |(from, to, said)| {
                    if from == to { format!("{from}: {said}") } else { format!("{from} .. {to}: {said}") }
                },
            )
            .collect();
        if all.is_empty() { String::new() } else { format!(" holding{}", words::braced(&all)) }
    }
}
