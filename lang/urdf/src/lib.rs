//! Robots from URDF (Unified Robot Description Format, 1.0 to 1.2), or what is wrong with the text and where.
//!
//! What the format leaves out has the value the format says: an absent origin is none, an absent axis is x, an absent
//! `lower` or `upper` beside a given one is 0 (no limit from 1.2 on). Where a joint has a safety controller, its soft
//! limits hold. Extensions (`gazebo`, `transmission`, `dynamics` and others) are passed over; a word that is nearly one
//! of the format's is not. A capsule becomes a cylinder and two spheres.

mod cover;
mod joints;
mod problem;
mod shapes;
mod tree;
mod xml;

use std::collections::HashMap;
use std::sync::Arc;

use matterix_ir::mesh::Mesh;
use matterix_ir::robot::{Inertial, Link, Robot, Solid};
use roxmltree::{Document, Node, ParsingOptions};

pub use problem::Problem;
use xml::Element;

/// Longer texts are refused, in bytes; descriptions keep their meshes elsewhere and have some 10 kB.
pub const MOST_BYTES: usize = 16 << 20;

/// Robots with more links are refused.
pub const MOST_LINKS: usize = 4096;

/// The robot a text describes; its meshes are kept by name.
pub fn read(text: &str) -> Result<Robot, Problem> {
    read_with(text, |_| None)
}

/// The robot a text describes, with its meshes as far as `mesh` knows them by name, with spheres that cover its collision shapes where these are known, and the pairs of
/// links that a joint keeps in touch.
pub fn read_with(text: &str, mut mesh: impl FnMut(&str) -> Option<Mesh>) -> Result<Robot, Problem> {
    if text.len() > MOST_BYTES {
        return Err(Problem::new(1, format!("the text is longer than {} MiB", MOST_BYTES >> 20)));
    }
    let options = ParsingOptions { nodes_limit: 1 << 20, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| {
        let (place, message) = (format!(" at {}", e.pos()), e.to_string());
        Problem::new(e.pos().row, message.trim_end_matches(&place).replace('\'', "`"))
    })?;
    let root = Element(document.root_element());
    if root.name() != "robot" {
        return Err(root.wrong(format!("the outermost element is `{}`, not `robot`", root.name())));
    }
    if let Some(template) = document.root_element().descendants().find(is_template) {
        let what = template.tag_name().name();
        return Err(Element(template).wrong(format!("`xacro:{what}` must be expanded by xacro first")));
    }
    root.expect_words(&["link", "joint", "material"], &["name", "version"])?;

    let colors = shapes::colors(&root)?;
    let mut links = Vec::new();
    let mut index = HashMap::new();
    let elements: Vec<Element> = root.all("link").collect();
    if elements.len() > MOST_LINKS {
        return Err(elements[MOST_LINKS].wrong(format!("it has more than {MOST_LINKS} links")));
    }
    for element in &elements {
        let link = link(element, &colors)?;
        if index.insert(link.name.clone(), links.len() as u32).is_some() {
            return Err(element.wrong(format!("link `{}` is described twice", link.name)));
        }
        links.push(link);
    }
    let joints = joints::read(&root, &index)?;
    let mut robot = tree::grow(&root, &elements, links, joints)?;
    for piece in robot.links.iter().flat_map(|link| link.visual.iter().chain(&link.collision)) {
        let Solid::Mesh(name, _) = &piece.solid else { continue };
        if !robot.meshes.contains_key(name)
            && let Some(found) = mesh(name)
        {
            robot.meshes.insert(name.clone(), Arc::new(found));
        }
    }
    robot.balls = cover::balls(&robot);
    robot.touching = cover::touching(&robot);
    Ok(robot)
}

fn is_template(node: &Node) -> bool {
    node.is_element() && node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"))
}

fn link(element: &Element, colors: &shapes::Colors) -> Result<Link, Problem> {
    element.expect_words(&["inertial", "visual", "collision"], &["name"])?;
    let name = element.text("name")?.to_string();
    let inertial = element.one("inertial")?.map(|e| inertial(&e)).transpose()?;
    let (mut visual, mut collision) = (Vec::new(), Vec::new());
    for piece in element.all("visual") {
        visual.extend(shapes::pieces(&piece, Some(colors))?);
    }
    for piece in element.all("collision") {
        collision.extend(shapes::pieces(&piece, None)?);
    }
    Ok(Link { name, inertial, visual, collision })
}

fn inertial(element: &Element) -> Result<Inertial, Problem> {
    element.expect_words(&["origin", "mass", "inertia"], &[])?;
    let placement = shapes::origin(element)?;
    let mass = element.needed("mass")?.not_negative("value")?;
    let tensor = element.needed("inertia")?;
    tensor.expect_words(&[], &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])?;
    let inertia = [
        tensor.not_negative("ixx")?,
        tensor.number("ixy")?,
        tensor.number("ixz")?,
        tensor.not_negative("iyy")?,
        tensor.number("iyz")?,
        tensor.not_negative("izz")?,
    ];
    Ok(Inertial { mass, placement, inertia })
}
