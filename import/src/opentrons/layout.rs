//! Which nozzles of a head take tips.

use std::collections::BTreeMap;

use super::analysis::Command;
use super::node::cell;

/// Channels of a head that take tips where not all do: so many rows and columns of them, from a corner of the head.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// The nozzle that commands name places of: that in the corner.
    pub(super) corner: String,
    pub(super) rows: usize,
    pub(super) columns: usize,
}

/// The layouts of pipettes; nothing where one is not among those that can be said.
pub(super) type Layouts = BTreeMap<String, Option<Layout>>;

/// Takes in what `configureNozzleLayout` says of a pipette with so many channels; the layout before, if any.
pub(super) fn take(layouts: &mut Layouts, command: &Command, channels: usize) -> Option<Option<Layout>> {
    let id = command.text("pipetteId").to_owned();
    let params = &command.params["configurationParams"];
    let nozzle = |key: &str| params[key].as_str().unwrap_or_default();
    let corner = nozzle("primaryNozzle").to_owned();
    let layout = |rows, columns| Some(Layout { corner: corner.clone(), rows, columns });
    let is_corner = ["A1", "H1", "A12", "H12"].contains(&corner.as_str());
    let layout = match (params["style"].as_str().unwrap_or_default(), cell(nozzle("backLeftNozzle"))) {
        ("ALL", _) => return layouts.remove(&id),
        ("SINGLE", _) if is_corner => layout(1, 1),
        ("COLUMN", _) if is_corner => layout(channels.min(8), 1),
        ("ROW", _) if is_corner => layout(1, 12),
        // Some of a column, from the front.
        ("QUADRANT", Some((back, 1))) if corner == "H1" && nozzle("frontRightNozzle") == "H1" => {
            layout(9 - back as usize, 1)
        }
        _ => None,
    };
    layouts.insert(id, layout)
}
