//! What std::opentrons has: its pipettes by their names at Opentrons, its modules by their models, its labware by definition.

use std::collections::BTreeMap;

use matterix_ir::FileId;
use matterix_lang::ast::{AssetLine, Expr, ExprKind, Field, FieldValue, ItemKind};
use matterix_lang::library;

/// The module of the library.
const MODULE: &str = "std::opentrons";

/// A pipette of the library.
#[derive(Clone, Debug)]
pub(super) struct Pipette {
    pub(super) asset: String,
    /// Channels in a row.
    pub(super) channels: usize,
    /// How fast it aspirates, dispenses and blows out by default, uL/s.
    pub(super) flows: [f64; 3],
}

/// What the library has.
#[derive(Debug, Default)]
pub(super) struct Library {
    pipettes: BTreeMap<String, Pipette>,
    modules: BTreeMap<String, String>,
    labware: BTreeMap<String, String>,
}

impl Library {
    /// Reads it.
    pub(super) fn read() -> Library {
        let mut out = Library::default();
        let Some(index) = library::MODULES.iter().position(|module| module.name == MODULE) else { return out };
        let (file, _) = library::read(index, FileId(u32::MAX));
        for item in &file.items {
            let ItemKind::Asset { name, source, lines, .. } = &item.kind else { continue };
            let asset = name.text.clone();
            let field = |key: &str| lines.iter().find_map(|line| value(line, key));
            if let Some((kind, definition)) = source
                && kind.text == "labware"
            {
                out.labware.insert(definition.text.clone(), asset.clone());
            }
            if let Some(uri) = field("definition").and_then(text)
                && let Some((_, named)) = uri.split_once('/')
            {
                out.labware.insert(named.to_owned(), asset.clone());
            }
            let Some(model) = field("model").and_then(text) else { continue };
            match field("flow").and_then(quantity) {
                Some(flow) => {
                    let is_row = |line: &AssetLine| matches!(line, AssetLine::Grid(grid) if grid.to.is_some());
                    let channels = if lines.iter().any(is_row) { 8 } else { 1 };
                    let out_flow = field("flow_out").and_then(quantity).unwrap_or(flow);
                    let blow = field("flow_blow").and_then(quantity).unwrap_or(flow);
                    let pipette = Pipette { asset, channels, flows: [flow, out_flow, blow] };
                    out.pipettes.insert(model.to_owned(), pipette);
                }
                None => drop(out.modules.insert(model.to_owned(), asset)),
            }
        }
        out
    }

    /// The pipette of a name.
    pub(super) fn pipette(&self, name: &str) -> Option<&Pipette> {
        self.pipettes.get(name)
    }

    /// The asset of a model of module.
    pub(super) fn module(&self, model: &str) -> Option<&str> {
        self.modules.get(model).map(String::as_str)
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
