//! What std::opentrons has: its pipettes by their names at Opentrons, its modules by their models, its labware by definition.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::FileId;
use matterix_lang::ast::{AssetLine, Expr, ExprKind, Field, FieldValue, ItemKind};
use matterix_lang::library;

use super::robot::Robot;

/// The modules of the library that have what robots of Opentrons use.
const MODULES: [&str; 2] = ["std::opentrons", "std::flex"];

/// The one for the Flex alone.
const FLEX: &str = MODULES[1];

/// A pipette of the library.
#[derive(Clone, Debug)]
pub(super) struct Pipette {
    pub(super) asset: String,
    /// Its channels.
    pub(super) channels: usize,
    /// How fast it aspirates by default, uL/s.
    flow: f64,
    /// How fast it dispenses and blows out, if that is not as fast as it aspirates.
    others: [Option<f64>; 2],
    /// The same with tips up to so many uL, where those are others.
    by_tip: Vec<(f64, [Option<f64>; 3])>,
    /// Whether its rates are those of its tips.
    pub(super) is_flex: bool,
}

impl Pipette {
    /// How fast it aspirates, dispenses and blows out with tips of a volume, uL/s.
    pub(super) fn flows_with(&self, tip: f64) -> [f64; 3] {
        let usual = self.flows(None);
        match self.by_tip.iter().find(|(most, _)| tip <= *most) {
            Some((_, flows)) => std::array::from_fn(|which| flows[which].unwrap_or(usual[which])),
            None => usual,
        }
    }

    /// How fast it aspirates, dispenses and blows out where a lab says no more than how fast it aspirates, uL/s.
    pub(super) fn flows(&self, flow: Option<f64>) -> [f64; 3] {
        let flow = flow.unwrap_or(self.flow);
        [flow, self.others[0].unwrap_or(flow), self.others[1].unwrap_or(flow)]
    }
}

/// What the library has.
#[derive(Debug, Default)]
pub(super) struct Library {
    pipettes: BTreeMap<String, Pipette>,
    modules: BTreeMap<String, String>,
    /// Modules that stand otherwise in the deck of a Flex.
    flex_modules: BTreeMap<String, String>,
    labware: BTreeMap<String, String>,
    /// Where assets of the Flex alone are declared.
    of_flex: BTreeSet<String>,
}

impl Library {
    /// Reads it.
    pub(super) fn read() -> Library {
        let mut out = Library::default();
        for module in MODULES {
            out.read_module(module);
        }
        out
    }

    fn read_module(&mut self, module: &str) {
        let Some(index) = library::MODULES.iter().position(|known| known.name == module) else { return };
        let (file, _) = library::read(index, FileId(u32::MAX));
        for item in &file.items {
            let ItemKind::Asset { name, source, extends, lines, .. } = &item.kind else { continue };
            let asset = name.text.clone();
            if module == FLEX {
                self.of_flex.insert(asset.clone());
            }
            let field = |key: &str| lines.iter().find_map(|line| value(line, key));
            if let Some((kind, definition)) = source
                && kind.text == "labware"
            {
                self.labware.insert(definition.text.clone(), asset.clone());
            }
            if let Some(uri) = field("definition").and_then(text)
                && let Some((_, named)) = uri.split_once('/')
            {
                self.labware.insert(named.to_owned(), asset.clone());
            }
            let Some(model) = field("model").and_then(text) else {
                let bases = extends.iter().filter_map(|path| path.segments.last());
                let known = |base: &str| self.modules.iter().find(|(_, asset)| *asset == base).map(|(model, _)| model);
                if let Some(model) = bases.filter_map(|base| known(&base.text)).next().cloned() {
                    self.flex_modules.insert(model, asset);
                }
                continue;
            };
            match field("flow").and_then(quantity) {
                Some(flow) => {
                    let last = lines.iter().find_map(|line| match line {
                        AssetLine::Grid(grid) => grid.to.as_ref(),
                        _ => None,
                    });
                    let channels = match last.map(|last| last.text.as_str()) {
                        None => 1,
                        Some("H12") => 96,
                        Some(_) => 8,
                    };
                    let others = ["flow_out", "flow_blow"].map(|key| field(key).and_then(quantity));
                    let by_tip = [20.0, 50.0, 200.0].map(|tip| {
                        let of = |flow: &str| field(&format!("{flow}_{tip}")).and_then(quantity);
                        (tip, ["flow", "flow_out", "flow_blow"].map(of))
                    });
                    let by_tip = by_tip.into();
                    let pipette = Pipette { asset, channels, flow, others, by_tip, is_flex: module == FLEX };
                    self.pipettes.insert(model.to_owned(), pipette);
                }
                None => drop(self.modules.insert(model.to_owned(), asset)),
            }
        }
    }

    /// Whether an asset is declared for the Flex alone.
    pub(super) fn is_of_flex(&self, asset: &str) -> bool {
        self.of_flex.contains(asset)
    }

    /// The pipette of a name.
    pub(super) fn pipette(&self, name: &str) -> Option<&Pipette> {
        self.pipettes.get(name)
    }

    /// The asset of a model of module.
    pub(super) fn module(&self, model: &str, robot: Robot) -> Option<&str> {
        let own = self.flex_modules.get(model).filter(|_| robot == Robot::Flex);
        own.or_else(|| self.modules.get(model)).map(String::as_str)
    }

    /// The asset of a definition, `NAME/VERSION`.
    pub(super) fn labware(&self, named: &str) -> Option<&str> {
        self.labware.get(named).map(String::as_str)
    }
}

/// The value of a line with a key.
fn value<'l>(line: &'l AssetLine, key: &str) -> Option<&'l Expr> {
    match line {
        AssetLine::Field(Field { key: known, value: FieldValue::Expr(e), .. }) if known.text == key => Some(e),
        _ => None,
    }
}

fn text(e: &Expr) -> Option<&str> {
    match &*e.kind {
        ExprKind::Text(text) => Some(text),
        _ => None,
    }
}

/// A number of uL/s.
fn quantity(e: &Expr) -> Option<f64> {
    match &*e.kind {
        ExprKind::Quantity(number, _) => Some(*number),
        _ => None,
    }
}
