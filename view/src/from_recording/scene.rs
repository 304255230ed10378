//! `/scene` and `/tf`: what is seen and how it moves.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::bodies::Bodies;
use matterix_ir::mesh::Mesh;
use matterix_ir::robot::Placement;
use matterix_ir::scene::Shape;
use serde::Deserialize;
use serde_json::Value;

use super::{Topic, list, number, text};
use crate::bench::{self, Owners, Thing};
use crate::document::{Document, Track};
use crate::placement::pose;

/// The frame everything stands in.
const LAB: &str = "lab";
/// What a recording gives to things that have no colour of their own; here the page chooses.
const GREY: [f64; 3] = [0.62, 0.66, 0.70];
/// A recording's colours come in shades this far apart.
const SHADE: f64 = 1.0 / 63.0;

/// Reads bodies and their tracks; gives the bodies by name.
pub(super) fn read(topics: &[Topic], document: &mut Document) -> Owners {
    let (ways, points) = transforms(topics);
    let held: BTreeSet<&str> = topics.iter().filter_map(|t| t.name.strip_prefix("/contents/")).map(owner).collect();
    let forms = forms(topics);
    let mut things: Vec<Thing> = Vec::new();
    let mut known = BTreeSet::new();
    let updates = topics.iter().filter(|t| t.name == "/scene").flat_map(|t| &t.messages);
    for entity in updates.flat_map(|(_, update)| list(update, "entities")) {
        let name = text(entity, "id");
        if !known.insert(name) {
            continue;
        }
        let at = ways.get(name).and_then(|way| way.first()).map_or_else(Placement::default, |(_, at)| *at);
        let pairs = list(entity, "metadata").iter();
        let kind = pairs.filter(|pair| text(pair, "key") == "kind").map(|pair| text(pair, "value")).next();
        things.push(Thing {
            name: name.to_owned(),
            kind: kind.unwrap_or_default().to_owned(),
            // The links of a robot are given in their own frames.
            shapes: shapes(entity, if text(entity, "frame_id") == name { Placement::default() } else { at }),
            visual: None,
            at,
            frames: points.get(name).cloned().unwrap_or_default(),
            holds: held.contains(name),
            link: text(entity, "frame_id") == name,
        });
    }
    for thing in things.iter_mut().filter(|thing| !thing.link) {
        if let Some((true_shapes, visual)) = forms.get(&thing.name) {
            thing.visual.clone_from(visual);
            let color = thing.shapes.first().and_then(|(.., color)| *color);
            thing.shapes = true_shapes.iter().map(|(at, shape)| (*at, shape.clone(), color)).collect();
        }
    }
    let (bodies, owners) = bench::bodies(&things, &mut document.meshes);
    document.bodies = bodies;
    for (name, way) in &ways {
        let Some(body) = owners.get(name) else { continue };
        if way.len() > 1 {
            document.tracks.push(Track {
                body,
                times: way.iter().map(|(time, _)| *time).collect(),
                poses: way.iter().map(|(_, at)| pose(*at)).collect(),
                smooth: false,
            });
        }
    }
    document.tracks.sort_by_key(|t| t.body);
    owners
}

/// Shapes of a thing, and what is seen instead of them.
type Form = (Vec<(Placement, Shape)>, Option<Shape>);

/// The true shapes of things, where the recording has them: primitives say nothing of insides and of what is turned.
fn forms(topics: &[Topic]) -> BTreeMap<String, Form> {
    let told = topics.iter().filter(|t| t.name == "/bodies").flat_map(|t| &t.messages).next();
    let bodies = told.and_then(|(_, message)| Bodies::deserialize(message).ok()).unwrap_or_default();
    let form = |thing: matterix_ir::bodies::Thing| {
        let main = thing.shape.map(|shape| (Placement::default(), shape));
        let more = thing.solids.into_iter().map(|solid| (solid.pose, solid.shape));
        (thing.name, (main.into_iter().chain(more).collect(), thing.visual))
    };
    bodies.things.into_iter().map(form).collect()
}

/// The thing that a mixture is in, by their names: `beaker` of `beaker.contents`.
pub(super) fn owner(mixture: &str) -> &str {
    mixture.rsplit_once('.').map_or(mixture, |(owner, _)| owner)
}

/// Of each thing its places over time, and of each its named points.
type Ways = BTreeMap<String, Vec<(f64, Placement)>>;
type Points = BTreeMap<String, Vec<(String, Placement)>>;

fn transforms(topics: &[Topic]) -> (Ways, Points) {
    let (mut ways, mut points) = (Ways::new(), Points::new());
    for (time, message) in topics.iter().filter(|t| t.name == "/tf").flat_map(|t| &t.messages) {
        for transform in list(message, "transforms") {
            let (above, name) = (text(transform, "parent_frame_id"), text(transform, "child_frame_id"));
            let at = placement(&transform["translation"], &transform["rotation"]);
            if above == LAB {
                ways.entry(name.to_owned()).or_default().push((*time, at));
                continue;
            }
            let point = name.strip_prefix(above).and_then(|rest| rest.strip_prefix('.')).unwrap_or(name);
            let known = points.entry(above.to_owned()).or_default();
            if known.iter().all(|(name, _)| name != point) {
                known.push((point.to_owned(), at));
            }
        }
    }
    (ways, points)
}

/// The boxes and cylinders of an entity, each from the middle of its base, relative to the thing that stands at `at`.
fn shapes(entity: &Value, at: Placement) -> Vec<(Placement, Shape, Option<[f32; 4]>)> {
    let back = at.inverse();
    let read = |primitive: &Value, shape: fn([f64; 3]) -> Shape| {
        let shape = shape(["x", "y", "z"].map(|k| number(&primitive["size"], k)));
        let middle = placement(&primitive["pose"]["position"], &primitive["pose"]["orientation"]);
        let color = ["r", "g", "b"].map(|k| number(&primitive["color"], k));
        let own = color.iter().zip(GREY).any(|(a, b)| (a - b).abs() > SHADE);
        let color = own.then(|| [color[0] as f32, color[1] as f32, color[2] as f32, 1.0]);
        (back.then(middle).then(Placement::up(-shape.size()[2] / 2.0)), shape, color)
    };
    let spheres = list(entity, "spheres").iter().map(|s| read(s, |[x, _, _]| Shape::Sphere(x)));
    let cubes = list(entity, "cubes").iter().map(|c| read(c, Shape::Box));
    let cylinders = list(entity, "cylinders").iter().map(|c| read(c, |[x, _, z]| Shape::Cylinder([x, z])));
    let meshes = list(entity, "triangles").iter().map(|t| mesh(t, back));
    cubes.chain(cylinders).chain(spheres).chain(meshes).collect()
}

/// A mesh in the frame that `back` leads to.
fn mesh(triangles: &Value, back: Placement) -> (Placement, Shape, Option<[f32; 4]>) {
    let at = back.then(placement(&triangles["pose"]["position"], &triangles["pose"]["orientation"]));
    let point = |p: &Value| ["x", "y", "z"].map(|k| number(p, k));
    let points: Vec<[f64; 3]> = list(triangles, "points").iter().map(point).collect();
    let there = |i: &Value| u32::try_from(i.as_u64()?).ok().filter(|i| (*i as usize) < points.len());
    let indices: Option<Vec<u32>> = list(triangles, "indices").iter().map(there).collect();
    let triangles = indices.unwrap_or_default().chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    (at, Shape::Mesh(Arc::new(Mesh { name: String::new(), points, triangles })), None)
}

fn placement(position: &Value, rotation: &Value) -> Placement {
    let at = ["x", "y", "z"].map(|k| number(position, k));
    let turned = ["x", "y", "z", "w"].map(|k| number(rotation, k));
    let length: f64 = turned.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length > 0.0 {
        Placement { position: at, rotation: turned.map(|v| v / length) }
    } else {
        Placement { position: at, ..Placement::default() }
    }
}
