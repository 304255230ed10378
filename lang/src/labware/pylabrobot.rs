//! Resources of PyLabRobot, as their `serialize()` gives them.
//!
//! Places are corners at the left, front and bottom. A well reaches from there, above its floor of `material_z_thickness`, up to
//! its `size_z`, as PyLabRobot moves tips in it. Functions and liquids that a file carries are not read.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::definition::{Definition, Opening, Shape, Well};

/// A resource; lengths in mm, volumes in µL.
#[derive(Debug, Deserialize)]
struct Resource {
    name: String,
    #[serde(rename = "type")]
    class: String,
    size_x: f64,
    size_y: f64,
    size_z: f64,
    location: Option<Coordinate>,
    rotation: Option<Coordinate>,
    #[serde(default)]
    category: Option<String>,
    #[serde(default)]
    model: Option<String>,
    #[serde(default)]
    children: Vec<Resource>,
    /// Names of children by place.
    #[serde(default)]
    ordering: Option<BTreeMap<String, String>>,
    /// A number, or `"Infinity"`.
    max_volume: Option<serde_json::Value>,
    material_z_thickness: Option<f64>,
    cross_section_type: Option<String>,
    prototype_tip: Option<Tip>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Coordinate {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Tip {
    total_tip_length: f64,
    maximal_volume: f64,
    fitting_depth: Option<f64>,
}

/// Whether this is a resource of PyLabRobot.
pub(super) fn is_one(value: &serde_json::Value) -> bool {
    value.get("size_x").is_some() && value.get("type").is_some()
}

/// Reads a resource, or says in words why it is no labware.
pub(super) fn read(value: serde_json::Value) -> Result<Definition, String> {
    let resource: Resource = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let mut wells = BTreeMap::new();
    for child in &resource.children {
        let Some(well) = resource.child(child)? else { continue };
        let place = resource.place(child);
        if wells.insert(place.clone(), well).is_some() {
            return Err(format!("it has the place `{place}` twice"));
        }
    }
    let has_tips = resource.children.iter().any(|child| child.is("tip_spot"));
    let capability = resource.capability(&wells, has_tips)?;
    if capability == "Reservoir" && wells.is_empty() {
        wells.insert("A1".to_owned(), resource.container([0.0; 3], &resource)?);
    }
    let title = resource.model.clone().unwrap_or_else(|| resource.name.clone());
    let size = Some([resource.size_x, resource.size_y, resource.size_z]);
    Definition { capability, title, size, aside: [0.0; 2], uri: None, has_tips, wells }.checked()
}

impl Resource {
    fn is(&self, category: &str) -> bool {
        self.category.as_deref() == Some(category)
    }

    /// What it is by what it holds; what only carries labware is none.
    fn capability(&self, wells: &BTreeMap<String, Well>, has_tips: bool) -> Result<&'static str, String> {
        let holders = |r: &Resource| r.category.as_deref().is_some_and(|c| c.ends_with("holder") || c == "tube_spot");
        match self.category.as_deref().unwrap_or_default() {
            "trough" => Ok("Reservoir"),
            "lid" => Ok("Lid"),
            "plate_adapter" => Ok("Adapter"),
            _ if has_tips => Ok("TipRack"),
            "container_rack" | "tube_rack" if wells.is_empty() => {
                Err("it has no tubes: assign tubes to its places".into())
            }
            "container_rack" | "tube_rack" => Ok("TubeRack"),
            _ if !wells.is_empty() && !self.children.iter().any(holders) => Ok("WellPlate"),
            _ => Err(format!("`{}` of PyLabRobot is not a plate, rack, trough, adapter or lid", self.class)),
        }
    }

    /// `A1`, as the ordering says or, without one, as the name of the child ends.
    fn place(&self, child: &Resource) -> String {
        let ordered = self.ordering.iter().flatten().find(|(_, name)| **name == child.name);
        match ordered {
            Some((place, _)) => place.clone(),
            None => child.name.rsplit_once('_').map_or(child.name.as_str(), |(_, place)| place).to_owned(),
        }
    }

    /// A place that holds something: a well, the place of a tip, or a tube in its holder.
    fn child(&self, child: &Resource) -> Result<Option<Well>, String> {
        let turned = |r: &Resource| r.rotation.is_some_and(|r| [r.x, r.y, r.z].iter().any(|angle| *angle != 0.0));
        if turned(child) || child.children.iter().any(turned) {
            return Err(format!("`{}` is rotated", child.name));
        }
        if child.is("well") {
            return self.container(child.corner()?, child).map(Some);
        }
        if child.is("tip_spot") {
            return self.tip(child.corner()?, child).map(Some);
        }
        let Some(tube) = child.children.iter().find(|c| c.is("tube")) else { return Ok(None) };
        let (corner, inner) = (child.corner()?, tube.corner()?);
        self.container([0, 1, 2].map(|k| corner[k] + inner[k]), tube).map(Some)
    }

    fn corner(&self) -> Result<[f64; 3], String> {
        let Coordinate { x, y, z } = self.location.ok_or_else(|| format!("`{}` has no location", self.name))?;
        Ok([x, y, z])
    }

    /// The middle of the bottom of something, seen from the middle of the base.
    fn middle(&self, corner: [f64; 3], size: [f64; 2]) -> [f64; 3] {
        [corner[0] + (size[0] - self.size_x) / 2.0, corner[1] + (size[1] - self.size_y) / 2.0, corner[2]]
    }

    fn container(&self, corner: [f64; 3], of: &Resource) -> Result<Well, String> {
        let size = [of.size_x, of.size_y];
        let floor = of.material_z_thickness.unwrap_or(0.0);
        let [x, y, z] = self.middle(corner, size);
        let volume = of.max_volume.as_ref().and_then(serde_json::Value::as_f64);
        // Tubes are round; troughs, which say nothing, are not.
        let round = match of.cross_section_type.as_deref() {
            Some("circle") => true,
            Some("rectangle") => false,
            Some(other) => return Err(format!("`{}` has a cross section `{other}`", of.name)),
            None => of.is("tube"),
        };
        Ok(Well {
            at: [x, y, z + floor],
            depth: of.size_z - floor,
            volume: volume.ok_or_else(|| format!("the `max_volume` of `{}` is not a number", of.name))?,
            opening: Some(if round { Opening::Round(size[0].min(size[1])) } else { Opening::Square(size) }),
            inside: None,
            shape: Shape::Straight,
            reach: None,
        })
    }

    /// The place of a tip; the shape of the tip is not in the file.
    fn tip(&self, corner: [f64; 3], spot: &Resource) -> Result<Well, String> {
        let tip = spot.prototype_tip.ok_or_else(|| format!("`{}` gives no tip", spot.name))?;
        Ok(Well {
            at: self.middle(corner, [spot.size_x, spot.size_y]),
            depth: tip.total_tip_length,
            volume: tip.maximal_volume,
            opening: None,
            inside: None,
            shape: Shape::Straight,
            reach: Some(tip.total_tip_length - tip.fitting_depth.unwrap_or(0.0)).filter(|reach| *reach > 0.0),
        })
    }
}
