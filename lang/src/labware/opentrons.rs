//! Labware definitions of Opentrons, schema 2 and 3.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::definition::{self, Definition, Opening};
use super::profile::{Profile, Section};

/// The footprint of microplates (ANSI SLAS 1-2004), for which the places of decks are made, and how much larger labware may be that stands in one
/// place alone, mm.
const FOOTPRINT: [f64; 2] = [127.76, 85.48];
const PLAY: f64 = 5.0;

/// A labware definition; lengths in mm, volumes in µL, places measured from the corner at the back left bottom or, in
/// schema 2, from the front left bottom.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct File {
    schema_version: u32,
    metadata: Metadata,
    parameters: Parameters,
    dimensions: Option<Size>,
    extents: Option<Extents>,
    wells: BTreeMap<String, Well>,
    #[serde(default)]
    namespace: String,
    #[serde(default)]
    version: u32,
    #[serde(default)]
    allowed_roles: Vec<String>,
    #[serde(default)]
    inner_labware_geometry: BTreeMap<String, Geometry>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Metadata {
    display_category: String,
    #[serde(default)]
    display_name: String,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Parameters {
    is_tiprack: bool,
    #[serde(default)]
    load_name: String,
    tip_length: Option<f64>,
    tip_overlap: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Size {
    x_dimension: f64,
    y_dimension: f64,
    z_dimension: f64,
}

#[derive(Debug, Deserialize)]
struct Extents {
    total: Total,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Total {
    back_left_bottom: Point,
    front_right_top: Point,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Point {
    x: f64,
    y: f64,
    z: f64,
}

/// A well, a tube or a tip.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Well {
    depth: f64,
    total_liquid_volume: f64,
    x: f64,
    y: f64,
    z: f64,
    geometry_definition_id: Option<String>,
    #[serde(flatten)]
    opening: Across,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(tag = "shape", rename_all = "camelCase", rename_all_fields = "camelCase")]
enum Across {
    Circular { diameter: f64 },
    Rectangular { x_dimension: f64, y_dimension: f64 },
}

/// The inside of a well.
#[derive(Debug, Deserialize)]
struct Geometry {
    sections: Vec<Part>,
}

/// A section of it.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Part {
    shape: Form,
    bottom_height: f64,
    top_height: f64,
    bottom_diameter: Option<f64>,
    top_diameter: Option<f64>,
    radius_of_curvature: Option<f64>,
    bottom_x_dimension: Option<f64>,
    bottom_y_dimension: Option<f64>,
    top_x_dimension: Option<f64>,
    top_y_dimension: Option<f64>,
    x_count: Option<f64>,
    y_count: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    Conical,
    Spherical,
    Cuboidal,
    /// A form whose wall is not described by the ends of a section: from a circle to a rectangle.
    #[serde(other)]
    Other,
}

/// Reads a definition, or says in words why it is none.
pub(super) fn read(value: serde_json::Value) -> Result<Definition, String> {
    match value.get("schemaVersion").and_then(serde_json::Value::as_u64) {
        Some(2 | 3) => {}
        Some(other) => return Err(format!("its schema is {other}, but only 2 and 3 are supported")),
        None => return Err("it has no `schemaVersion`".into()),
    }
    let file: File = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let capability = file.capability();
    // A lid stack stands for the lids on it: it has no body of its own.
    let size = file.size().filter(|_| file.metadata.display_category != "system");
    if size.is_none() && file.metadata.display_category != "system" {
        return Err("it has no outer dimensions".into());
    }
    let wells: BTreeMap<String, definition::Well> =
        file.wells.iter().filter(|(_, well)| !file.is_seat(well)).map(|(n, w)| (n.clone(), file.well(w))).collect();
    if wells.is_empty() && !file.may_be_without_wells() {
        return Err("it has no wells".into());
    }
    let has_tips = file.parameters.is_tiprack;
    let aside = file.aside();
    let definition = Definition { capability, title: file.title(), size, aside, uri: file.uri(), has_tips, wells };
    definition.checked()
}

impl File {
    /// Categories of things that others stand in or on: a place of theirs that holds nothing is a seat or a mark.
    fn may_be_without_wells(&self) -> bool {
        ["aluminumBlock", "adapter", "lid", "other", "system"].contains(&self.metadata.display_category.as_str())
    }

    fn is_seat(&self, well: &Well) -> bool {
        self.may_be_without_wells() && well.total_liquid_volume == 0.0
    }

    /// A block or adapter with the labware that it comes with is that labware: its definition has its wells and not the role of
    /// an adapter.
    fn capability(&self) -> &'static str {
        let has = |role: &str| self.allowed_roles.iter().any(|r| r == role);
        let holds = self.wells.values().any(|well| well.total_liquid_volume > 0.0);
        match self.metadata.display_category.as_str() {
            "wellPlate" => "WellPlate",
            "reservoir" => "Reservoir",
            "tubeRack" => "TubeRack",
            "tipRack" => "TipRack",
            "trash" => "Trash",
            "lid" => "Lid",
            _ if has("adapter") => "Adapter",
            "adapter" if holds => "WellPlate",
            "adapter" => "Adapter",
            "aluminumBlock" if holds => "AluminumBlock",
            _ => "Labware",
        }
    }

    fn title(&self) -> String {
        self.metadata.display_name.clone()
    }

    fn uri(&self) -> Option<String> {
        let name = &self.parameters.load_name;
        let is_known = !self.namespace.is_empty() && !name.is_empty() && self.version > 0;
        is_known.then(|| format!("{}/{name}/{}", self.namespace, self.version))
    }

    fn size(&self) -> Option<[f64; 3]> {
        if let Some(d) = self.dimensions {
            return Some([d.x_dimension, d.y_dimension, d.z_dimension]);
        }
        let Total { back_left_bottom: a, front_right_top: b } = &self.extents.as_ref()?.total;
        Some([b.x - a.x, a.y - b.y, b.z - a.z])
    }

    /// Labware begins at the front left corner of its place. What is about as large as that is taken to stand in its middle; a bin is a part of its
    /// robot, which says where it is.
    fn aside(&self) -> [f64; 2] {
        let (Some([x, y, _]), 2) = (self.size(), self.schema_version) else { return [0.0; 2] };
        if self.metadata.display_category == "trash" {
            return [0.0; 2];
        }
        let beyond = [x - FOOTPRINT[0], y - FOOTPRINT[1]];
        if beyond.iter().any(|over| *over > PLAY) { beyond.map(|over| over / 2.0) } else { [0.0; 2] }
    }

    fn well(&self, well: &Well) -> definition::Well {
        let [x, y, _] = self.size().unwrap_or_default();
        let [right, rear] = self.aside();
        let back = if self.schema_version == 2 { well.y - y / 2.0 } else { well.y + y / 2.0 };
        let opening = match well.opening {
            Across::Circular { diameter } => Opening::Round(diameter),
            Across::Rectangular { x_dimension, y_dimension } => Opening::Square([x_dimension, y_dimension]),
        };
        let reach = self.parameters.tip_length.map(|length| length - self.parameters.tip_overlap.unwrap_or(0.0));
        definition::Well {
            at: [well.x - x / 2.0 + right, back + rear, well.z],
            depth: well.depth,
            volume: well.total_liquid_volume,
            opening: Some(opening),
            inside: self.inside(well),
            reach: reach.filter(|reach| self.parameters.is_tiprack && *reach > 0.0),
        }
    }

    /// The inside of a well, where its sections are known and as round or square as its opening.
    fn inside(&self, well: &Well) -> Option<Profile> {
        let sections = &self.inner_labware_geometry.get(well.geometry_definition_id.as_ref()?)?.sections;
        let is_round = matches!(well.opening, Across::Circular { .. });
        let sections: Option<Vec<Section>> = sections.iter().map(|part| part.section(is_round)).collect();
        Profile::of(sections?, well.depth, well.total_liquid_volume)
    }
}

impl Part {
    fn section(&self, is_round: bool) -> Option<Section> {
        let (low, high) = (self.bottom_height, self.top_height);
        let count = self.x_count.unwrap_or(1.0) * self.y_count.unwrap_or(1.0);
        match self.shape {
            Form::Cuboidal if !is_round => {
                let bottom = [self.bottom_x_dimension?, self.bottom_y_dimension?, low];
                let top = [self.top_x_dimension?, self.top_y_dimension?, high];
                Some(Section::Pyramids(count, [bottom, top]))
            }
            Form::Conical if is_round && count == 1.0 => {
                let [bottom, top] = [self.bottom_diameter? / 2.0, self.top_diameter? / 2.0];
                Some(Section::Cone([[bottom, low], [top, high]]))
            }
            Form::Spherical if is_round && count == 1.0 => Some(Section::Cap(self.radius_of_curvature?, [low, high])),
            _ => None,
        }
    }
}
