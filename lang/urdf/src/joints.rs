//! Joints: what they connect, how they move, how far and whom they follow.

use std::collections::HashMap;

use matterix_ir::robot::{Joint, JointKind, JointLimits, Mimic};

use crate::problem::Problem;
use crate::shapes;
use crate::xml::Element;

/// The joints in the order of the description, with their elements.
pub(crate) fn read<'a>(root: &Element<'a>, links: &HashMap<String, u32>) -> Result<Vec<(Joint, Element<'a>)>, Problem> {
    let unbounded = is_unbounded_by_default(root.given("version"));
    let mut joints = Vec::new();
    let mut index = HashMap::new();
    // A joint without a type is a reference of an extension's.
    for element in root.all("joint") {
        let joint = joint(&element, links, unbounded)?;
        if index.insert(joint.name.clone(), joints.len() as u32).is_some() {
            return Err(element.wrong(format!("joint `{}` is described twice", joint.name)));
        }
        joints.push((joint, element));
    }
    for at in 0..joints.len() {
        let (joint, element) = &joints[at];
        if joint.kind == JointKind::Fixed {
            continue;
        }
        let Some(mimic) = element.one("mimic")? else { continue };
        mimic.expect_words(&[], &["joint", "multiplier", "offset"])?;
        let other = mimic.text("joint")?;
        let Some(&other_index) = index.get(other) else {
            return Err(mimic.wrong(format!("joint `{}` follows `{other}`, which is not a joint", joint.name)));
        };
        if joints[other_index as usize].0.kind == JointKind::Fixed {
            return Err(mimic.wrong(format!("joint `{}` follows `{other}`, which does not move", joint.name)));
        }
        let multiplier = mimic.optional("multiplier")?.unwrap_or(1.0);
        let offset = mimic.optional("offset")?.unwrap_or(0.0);
        joints[at].0.mimic = Some(Mimic { joint: other_index, multiplier, offset });
    }
    follow_no_circle(&joints)?;
    Ok(joints)
}

/// From version 1.2 on a limit that is not given is none.
fn is_unbounded_by_default(version: Option<&str>) -> bool {
    let parts = version.and_then(|v| v.trim().split_once('.'));
    let number = parts.and_then(|(major, minor)| Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?)));
    number.is_some_and(|number| number >= (1, 2))
}

fn joint(element: &Element, links: &HashMap<String, u32>, unbounded: bool) -> Result<Joint, Problem> {
    element.expect_words(
        &["origin", "parent", "child", "axis", "limit", "mimic", "safety_controller"],
        &["name", "type"],
    )?;
    let name = element.text("name")?.to_string();
    let kind = match element.text("type")? {
        "fixed" => JointKind::Fixed,
        "revolute" => JointKind::Revolute,
        "continuous" => JointKind::Continuous,
        "prismatic" => JointKind::Prismatic,
        other @ ("planar" | "floating" | "spherical") => {
            return Err(element.wrong(format!(
                "joint `{name}` is `{other}`; write it as a chain of `prismatic` and `continuous` joints"
            )));
        }
        other => return Err(element.wrong(format!("`{other}` is not a type of joint"))),
    };
    let end = |which: &str| -> Result<u32, Problem> {
        let end = element.needed(which)?;
        let link = end.text("link")?;
        let known = links.get(link).copied();
        known.ok_or_else(|| end.wrong(format!("the {which} of joint `{name}` is `{link}`, which is not a link")))
    };
    let (parent, child) = (end("parent")?, end("child")?);
    if parent == child {
        return Err(element.wrong(format!("joint `{name}` connects a link with itself")));
    }
    let origin = shapes::origin(element)?;
    let (axis, limits) = match kind {
        JointKind::Fixed => ([1.0, 0.0, 0.0], None),
        _ => (axis(element, &name)?, Some(limits(element, &name, kind, unbounded)?)),
    };
    Ok(Joint { name, kind, parent, child, origin, axis, limits, mimic: None })
}

/// The axis at unit length; x where none is given.
fn axis(element: &Element, name: &str) -> Result<[f64; 3], Problem> {
    let Some(axis) = element.one("axis")? else { return Ok([1.0, 0.0, 0.0]) };
    let xyz = axis.numbers::<3>("xyz")?;
    let norm = xyz.iter().map(|c| c * c).sum::<f64>().sqrt();
    if !norm.is_finite() || norm < 1e-6 {
        return Err(axis.wrong(format!("the axis of joint `{name}` has length {norm}")));
    }
    Ok(xyz.map(|c| c / norm))
}

fn limits(element: &Element, name: &str, kind: JointKind, unbounded: bool) -> Result<JointLimits, Problem> {
    let free = JointLimits {
        lower: f64::MIN,
        upper: f64::MAX,
        velocity: f64::MAX,
        effort: f64::MAX,
        acceleration: None,
        jerk: None,
    };
    let Some(limit) = element.one("limit")? else {
        if kind == JointKind::Continuous {
            return Ok(free);
        }
        return Err(element.wrong(format!("joint `{name}` has no `limit`")));
    };
    limit.expect_words(&[], &["lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"])?;
    let positive = |attribute: &str| -> Result<Option<f64>, Problem> {
        match limit.optional(attribute)? {
            Some(value) if value <= 0.0 => {
                Err(limit.wrong(format!("the maximum {attribute} of joint `{name}` is {value}, but must be above 0")))
            }
            value => Ok(value),
        }
    };
    let missing = |what: &str| limit.wrong(format!("`limit` of joint `{name}` has no `{what}`"));
    let mut limits = free;
    limits.velocity = positive("velocity")?.ok_or_else(|| missing("velocity"))?;
    limits.effort = limit.not_negative("effort")?;
    limits.acceleration = match (positive("acceleration")?, positive("deceleration")?) {
        (Some(a), Some(d)) => Some(a.min(d)),
        (a, _) => a,
    };
    limits.jerk = positive("jerk")?;
    if kind == JointKind::Continuous {
        return Ok(limits);
    }
    match (limit.optional("lower")?, limit.optional("upper")?) {
        (None, None) if !unbounded => return Err(missing("lower` and `upper")),
        (lower, upper) => {
            limits.lower = lower.unwrap_or(if unbounded { f64::MIN } else { 0.0 });
            limits.upper = upper.unwrap_or(if unbounded { f64::MAX } else { 0.0 });
        }
    }
    if let Some(safety) = element.one("safety_controller")? {
        limits.lower = limits.lower.max(safety.optional("soft_lower_limit")?.unwrap_or(f64::MIN));
        limits.upper = limits.upper.min(safety.optional("soft_upper_limit")?.unwrap_or(f64::MAX));
    }
    if limits.lower > limits.upper {
        let (lower, upper) = (limits.lower, limits.upper);
        return Err(limit.wrong(format!("the limits of joint `{name}` allow no position: {lower} to {upper}")));
    }
    Ok(limits)
}

/// Fails where a joint follows itself, maybe by way of others.
fn follow_no_circle(joints: &[(Joint, Element)]) -> Result<(), Problem> {
    // Joints known to end at one that follows none.
    let mut ends = vec![false; joints.len()];
    for start in 0..joints.len() {
        let mut way = vec![start];
        while let Some(&at) = way.last() {
            let Some(mimic) = joints[at].0.mimic else { break };
            let next = mimic.joint as usize;
            if ends[next] {
                break;
            }
            if way.len() > joints.len() || next == start {
                let (joint, element) = &joints[start];
                return Err(element.wrong(format!("joint `{}` follows itself", joint.name)));
            }
            way.push(next);
        }
        for at in way {
            ends[at] = true;
        }
    }
    Ok(())
}
