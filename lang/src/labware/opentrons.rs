//! Labware definitions of Opentrons, schema 2 and 3.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::Deserialize;

use super::definition::{self, Definition, Opening, Shape};
use super::library;
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
    #[serde(default)]
    groups: Vec<Group>,
}

/// Wells of one kind.
#[derive(Debug, Deserialize)]
struct Group {
    #[serde(default)]
    wells: Vec<String>,
    #[serde(default)]
    metadata: Kind,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Kind {
    well_bottom_shape: Option<String>,
}

/// What a version of a definition says of the inside of its wells.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Insides {
    wells: BTreeMap<String, Inside>,
    inner_labware_geometry: BTreeMap<String, Geometry>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Inside {
    geometry_definition_id: Option<String>,
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
    let newer = file.newer_insides();
    // A lid stack stands for the lids on it: it has no body of its own.
    let size = file.size().filter(|_| file.metadata.display_category != "system");
    if size.is_none() && file.metadata.display_category != "system" {
        return Err("it has no outer dimensions".into());
    }
    let wells: BTreeMap<String, definition::Well> = file
        .wells
        .iter()
        .filter(|(_, well)| !file.is_seat(well))
        .map(|(n, w)| (n.clone(), file.well(n, w, &newer)))
        .collect();
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

    fn well(&self, name: &str, well: &Well, newer: &Insides) -> definition::Well {
        let [x, y, _] = self.size().unwrap_or_default();
        let [right, rear] = self.aside();
        let back = if self.schema_version == 2 { well.y - y / 2.0 } else { well.y + y / 2.0 };
        let opening = match well.opening {
            Across::Circular { diameter } => Opening::Round(diameter),
            Across::Rectangular { x_dimension, y_dimension } => Opening::Square([x_dimension, y_dimension]),
        };
        let by_sections =
            self.inside(well).or_else(|| self.newer_inside(name, well, newer)).map(|inside| (inside, Shape::Sections));
        let by_bottom = || self.inside_by_bottom(name, well).map(|inside| (inside, Shape::Bottom));
        let (inside, shape) =
            by_sections.or_else(by_bottom).map_or((None, Shape::Straight), |(inside, shape)| (Some(inside), shape));
        let reach = self.parameters.tip_length.map(|length| length - self.parameters.tip_overlap.unwrap_or(0.0));
        definition::Well {
            at: [well.x - x / 2.0 + right, back + rear, well.z],
            depth: well.depth,
            volume: well.total_liquid_volume,
            opening: Some(opening),
            inside,
            shape,
            reach: reach.filter(|reach| self.parameters.is_tiprack && *reach > 0.0),
        }
    }

    /// The inside of a well, where its sections are known and as round or square as its opening.
    fn inside(&self, well: &Well) -> Option<Profile> {
        made_of(self.inner_labware_geometry.get(well.geometry_definition_id.as_ref()?)?, well)
    }

    /// What the newest version of the library says of the wells, where this version of the same labware has no sections. Tips have no inside, and
    /// unpacking a definition takes time: it is done only where it may say more.
    fn newer_insides(&self) -> Insides {
        let is_told = self.parameters.is_tiprack || !self.inner_labware_geometry.is_empty();
        if is_told || self.namespace != library::NAMESPACE {
            return Insides::default();
        }
        let newest = library::find(&self.parameters.load_name).ok().filter(|entry| entry.version > self.version);
        newest.and_then(|entry| entry.text().ok()).and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
    }

    /// The inside of a well in that version.
    fn newer_inside(&self, name: &str, well: &Well, newer: &Insides) -> Option<Profile> {
        let id = newer.wells.get(name)?.geometry_definition_id.as_ref()?;
        made_of(newer.inner_labware_geometry.get(id)?, well)
    }

    /// The inside of a round well with a round or a pointed bottom, of which no sections are known: half a sphere, or a cone that is as high as the
    /// volume says, with straight walls above.
    fn inside_by_bottom(&self, name: &str, well: &Well) -> Option<Profile> {
        let Across::Circular { diameter } = well.opening else { return None };
        let group = self.groups.iter().find(|group| group.wells.iter().any(|n| n == name))?;
        let (radius, depth) = (diameter / 2.0, well.depth);
        let area = PI * radius * radius;
        let (bottom, height) = match group.metadata.well_bottom_shape.as_deref()? {
            "u" if depth > radius => (Section::Cap(radius, [0.0, radius]), radius),
            "v" => {
                // What a cylinder would hold beyond the volume is two thirds of that around the cone.
                let height = (1.5 * (depth - well.total_liquid_volume / area)).clamp(0.0, depth);
                (Section::Cone([[0.0, 0.0], [radius, height]]), height)
            }
            _ => return None,
        };
        let above = Section::Cone([[radius, height], [radius, depth]]);
        let sections = if height <= 0.0 {
            vec![above]
        } else if height >= depth {
            vec![bottom]
        } else {
            vec![bottom, above]
        };
        Profile::of(sections, depth, well.total_liquid_volume)
    }
}

/// The inside that sections make of a well.
fn made_of(geometry: &Geometry, well: &Well) -> Option<Profile> {
    let is_round = matches!(well.opening, Across::Circular { .. });
    let sections: Option<Vec<Section>> = geometry.sections.iter().map(|part| part.section(is_round)).collect();
    Profile::of(sections?, well.depth, well.total_liquid_volume)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube 10 mm across and 40 mm deep of this volume and bottom, by hand: a cone or half a sphere below a cylinder.
    fn inside(bottom: &str, volume: f64) -> Option<Profile> {
        let definition = serde_json::json!({
            "schemaVersion": 2, "metadata": { "displayCategory": "tubeRack" },
            "parameters": { "isTiprack": false, "loadName": "of_my_own" }, "namespace": "custom", "version": 1,
            "dimensions": { "xDimension": 127.76, "yDimension": 85.48, "zDimension": 50.0 },
            "wells": { "A1": { "shape": "circular", "diameter": 10.0, "depth": 40.0, "totalLiquidVolume": volume, "x": 50.0, "y": 40.0, "z": 5.0 } },
            "groups": [{ "wells": ["A1"], "metadata": { "wellBottomShape": bottom } }],
        });
        read(definition).expect("it is a definition").wells["A1"].inside.clone()
    }

    #[test]
    fn bottoms_say_how_a_well_without_sections_is_inside() {
        // 78.54 mm2 x 40 mm are 3141.6 uL: a cone of 18.02 mm leaves out two thirds of what stands around it.
        let cone = inside("v", 2198.0).expect("it is known");
        assert!((cone.volume() - 2198.0).abs() < 1.0 && cone.points().len() == 3, "{cone:?}");
        assert!((cone.points()[1][1] - 18.02).abs() < 0.01, "{cone:?}");
        // Half a sphere of 5 mm: 261.8 uL, and 35 mm of cylinder.
        let round = inside("u", 3000.0).expect("it is known");
        assert!((round.volume() - (261.8 + 2748.9)).abs() < 1.0, "{round:?}");
        assert_eq!(inside("flat", 3000.0), None);
        // A cone to the rim holds a third: no well of this depth holds so little with one.
        let whole = inside("v", 500.0).expect("it is known");
        assert!((whole.volume() - 1047.2).abs() < 1.0, "{whole:?}");
    }
}
