//! Where things are, their shapes and colours.

use std::collections::HashMap;

use matterix_ir::math;
use matterix_ir::robot::{Piece, Placement, Solid};
use roxmltree::Node;

use crate::problem::Problem;
use crate::xml::Element;

/// Red, green, blue and opacity by the name of a material.
pub(crate) type Colors = HashMap<String, [f64; 4]>;

/// The colours of all materials that have one, wherever they are described.
pub(crate) fn colors(root: &Element) -> Result<Colors, Problem> {
    let mut colors = Colors::new();
    for node in root.0.descendants().filter(|n: &Node| n.has_tag_name("material")) {
        let element = Element(node);
        if let (Some(name), Some(color)) = (element.given("name"), color(&element)?) {
            colors.entry(name.to_string()).or_insert(color);
        }
    }
    Ok(colors)
}

fn color(material: &Element) -> Result<Option<[f64; 4]>, Problem> {
    let Some(color) = material.one("color")? else { return Ok(None) };
    let rgba = color.numbers::<4>("rgba")?;
    match rgba.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        None => Ok(Some(rgba)),
        Some(value) => Err(color.wrong(format!("{value} in `rgba` is not between 0 and 1"))),
    }
}

/// Where the origin of an element is; at that of its parent where it names none.
pub(crate) fn origin(element: &Element) -> Result<Placement, Problem> {
    let Some(origin) = element.one("origin")? else { return Ok(Placement::default()) };
    origin.expect_words(&[], &["xyz", "rpy", "quat_xyzw"])?;
    let position = origin.coordinates("xyz")?.unwrap_or_default();
    let rotation = match (origin.optional_numbers::<3>("rpy")?, origin.optional_numbers::<4>("quat_xyzw")?) {
        (Some(_), Some(_)) => return Err(origin.wrong("`origin` has both `rpy` and `quat_xyzw`")),
        (None, None) => Placement::default().rotation,
        (Some(angles), None) => quaternion(angles),
        (None, Some(q)) => {
            let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            if norm.is_nan() || (norm - 1.0).abs() > 1e-3 {
                return Err(origin.wrong(format!("`quat_xyzw` of `origin` has length {norm}, not 1")));
            }
            q.map(|c| c / norm)
        }
    };
    Ok(Placement { position, rotation })
}

/// The quaternion of turns about the fixed x, then y, then z axis.
fn quaternion([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
    let (sr, cr) = math::sin_cos(0.5 * roll);
    let (sp, cp) = math::sin_cos(0.5 * pitch);
    let (sy, cy) = math::sin_cos(0.5 * yaw);
    [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy]
}

/// The solids of a `visual` or `collision`; colours only for what is seen.
pub(crate) fn pieces(element: &Element, colors: Option<&Colors>) -> Result<Vec<Piece>, Problem> {
    element.expect_words(&["origin", "geometry", "material"], &["name"])?;
    let placement = origin(element)?;
    let color = match (colors, element.one("material")?) {
        (Some(colors), Some(material)) => match color(&material)? {
            Some(color) => Some(color),
            None => material.given("name").and_then(|name| colors.get(name)).copied(),
        },
        _ => None,
    };
    let geometry = element.needed("geometry")?;
    let mut shapes = geometry.0.children().filter(Node::is_element).map(Element);
    let (Some(shape), None) = (shapes.next(), shapes.next()) else {
        return Err(geometry.wrong("`geometry` must have one shape"));
    };
    let piece = |offset: f64, solid| Piece { placement: along_third(&placement, offset), solid, color };
    Ok(match shape.name() {
        "box" => vec![piece(0.0, Solid::Cuboid(shape.sizes("size")?))],
        "cylinder" => {
            let ([radius], [length]) = (shape.sizes("radius")?, shape.sizes("length")?);
            vec![piece(0.0, Solid::Cylinder([radius, length]))]
        }
        "sphere" => {
            let [radius] = shape.sizes("radius")?;
            vec![piece(0.0, Solid::Sphere(radius))]
        }
        "capsule" => {
            let ([radius], [length]) = (shape.sizes("radius")?, shape.sizes("length")?);
            let cap = |offset| piece(offset, Solid::Sphere(radius));
            vec![piece(0.0, Solid::Cylinder([radius, length])), cap(0.5 * length), cap(-0.5 * length)]
        }
        "mesh" => {
            let scale = shape.coordinates("scale")?.unwrap_or([1.0; 3]);
            if scale.contains(&0.0) {
                return Err(shape.wrong("`scale` of `mesh` has a 0"));
            }
            vec![piece(0.0, Solid::Mesh(shape.text("filename")?.to_string(), scale))]
        }
        other => {
            return Err(
                shape.wrong(format!("`{other}` is not a shape; use `box`, `cylinder`, `capsule`, `sphere` or `mesh`"))
            );
        }
    })
}

/// A placement moved along its own third axis.
pub(crate) fn along_third(placement: &Placement, by: f64) -> Placement {
    let [x, y, z, w] = placement.rotation;
    let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
    let [a, b, c] = placement.position;
    Placement { position: [a + by * axis[0], b + by * axis[1], c + by * axis[2]], ..*placement }
}
