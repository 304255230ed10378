//! The part of a labware definition that a lab needs.

use std::collections::BTreeMap;

use serde::Deserialize;

/// A labware definition; lengths in mm, volumes in µL, places measured from the corner at the back left bottom or, in
/// schema 2, from the front left bottom.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Definition {
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
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Metadata {
    display_category: String,
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
pub(super) struct Well {
    /// From top to bottom.
    pub(super) depth: f64,
    /// What it holds.
    pub(super) total_liquid_volume: f64,
    x: f64,
    y: f64,
    z: f64,
    #[serde(flatten)]
    pub(super) opening: Opening,
}

/// The shape of an opening.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "shape", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(super) enum Opening {
    /// Round.
    Circular {
        /// Across.
        diameter: f64,
    },
    /// With four sides.
    Rectangular {
        /// Left to right.
        x_dimension: f64,
        /// Front to back.
        y_dimension: f64,
    },
}

impl Definition {
    /// Reads a definition, or says in words why it is none.
    pub(super) fn read(text: &str) -> Result<Definition, String> {
        let value: serde_json::Value = serde_json::from_str(text).map_err(|e| format!("it is not JSON ({e})"))?;
        match value.get("schemaVersion").and_then(serde_json::Value::as_u64) {
            Some(2 | 3) => {}
            Some(other) => return Err(format!("its schema is {other}, but only 2 and 3 are supported")),
            None => return Err("it has no `schemaVersion`".into()),
        }
        let definition: Definition = serde_json::from_value(value).map_err(|e| e.to_string())?;
        definition.check()?;
        Ok(definition)
    }

    fn check(&self) -> Result<(), String> {
        let [x, y, z] = self.size().ok_or("it has no outer dimensions")?;
        if !(x > 0.0 && y > 0.0 && z > 0.0) {
            return Err("its outer dimensions must be above 0".into());
        }
        if self.wells.is_empty() {
            return Err("it has no wells".into());
        }
        for (name, well) in &self.wells {
            if crate::eval::lab::grids::Place::parse(name).is_none() {
                return Err(format!("`{name}` is not the name of a well such as `A1`"));
            }
            let open = match well.opening {
                Opening::Circular { diameter } => diameter > 0.0,
                Opening::Rectangular { x_dimension, y_dimension } => x_dimension > 0.0 && y_dimension > 0.0,
            };
            if !(open && well.depth >= 0.0 && well.total_liquid_volume > 0.0) {
                return Err(format!("the size of `{name}` must be above 0"));
            }
        }
        Ok(())
    }

    /// What it is known by: its name space, name and version; nothing where it does not say them.
    pub(super) fn uri(&self) -> Option<String> {
        let name = &self.parameters.load_name;
        let is_known = !self.namespace.is_empty() && !name.is_empty() && self.version > 0;
        is_known.then(|| format!("{}/{name}/{}", self.namespace, self.version))
    }

    /// Outer size left to right, front to back, bottom to top, mm.
    pub(super) fn size(&self) -> Option<[f64; 3]> {
        if let Some(d) = self.dimensions {
            return Some([d.x_dimension, d.y_dimension, d.z_dimension]);
        }
        let Total { back_left_bottom: a, front_right_top: b } = &self.extents.as_ref()?.total;
        Some([b.x - a.x, a.y - b.y, b.z - a.z])
    }

    /// Every place by its name.
    pub(super) fn wells(&self) -> impl Iterator<Item = (&str, &Well)> {
        self.wells.iter().map(|(name, well)| (name.as_str(), well))
    }

    /// Where the bottom of a well is, seen from the middle of the base, mm.
    pub(super) fn position(&self, well: &Well) -> [f64; 3] {
        let [x, y, _] = self.size().unwrap_or_default();
        let back = if self.schema_version == 2 { well.y - y / 2.0 } else { well.y + y / 2.0 };
        [well.x - x / 2.0, back, well.z]
    }

    /// Whether its places are tips.
    pub(super) fn is_tip_rack(&self) -> bool {
        self.parameters.is_tiprack
    }

    /// How far the end of one of its tips is below the nozzle that has it, mm.
    pub(super) fn tip_reach(&self) -> Option<f64> {
        Some(self.parameters.tip_length? - self.parameters.tip_overlap.unwrap_or(0.0))
    }

    /// The capability called like its category.
    pub(super) fn capability(&self) -> String {
        let mut letters = self.metadata.display_category.chars();
        letters.next().map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    }
}
