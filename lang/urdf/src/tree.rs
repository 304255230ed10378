//! Links and joints as one tree, parents before children.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use matterix_ir::robot::{Joint, Link, Robot};

use crate::problem::Problem;
use crate::xml::Element;

/// The robot: the root first, joints in the order of the description but for parents before children.
pub(crate) fn grow(
    root: &Element,
    elements: &[Element],
    mut links: Vec<Link>,
    joints: Vec<(Joint, Element)>,
) -> Result<Robot, Problem> {
    let mut carriers: Vec<Option<usize>> = vec![None; links.len()];
    let mut leaving: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
    for (index, (joint, element)) in joints.iter().enumerate() {
        if let Some(first) = carriers[joint.child as usize].replace(index) {
            let (child, first) = (&links[joint.child as usize].name, &joints[first].0.name);
            return Err(
                element.wrong(format!("link `{child}` is the child of joint `{}` and of joint `{first}`", joint.name))
            );
        }
        leaving[joint.parent as usize].push(index);
    }
    let mut roots = (0..links.len()).filter(|&link| carriers[link].is_none());
    let first = match (roots.next(), roots.next()) {
        (Some(first), None) => first,
        (Some(first), Some(second)) => {
            let (first, second) = (&links[first].name, &links[second]);
            let message = format!("link `{}` is not connected to `{first}`: no joint has it as its child", second.name);
            return Err(at_link(root, elements, &second.name).wrong(message));
        }
        (None, _) if links.is_empty() => return Err(root.wrong("the robot has no link")),
        (None, _) => return Err(root.wrong("every link is the child of a joint: they form a circle")),
    };

    let mut order = Vec::with_capacity(joints.len());
    let mut ready: BinaryHeap<_> = leaving[first].iter().map(|&joint| Reverse(joint)).collect();
    while let Some(Reverse(joint)) = ready.pop() {
        order.push(joint);
        ready.extend(leaving[joints[joint].0.child as usize].iter().map(|&joint| Reverse(joint)));
    }
    if order.len() < joints.len() {
        let mut reached = vec![false; joints.len()];
        order.iter().for_each(|&joint| reached[joint] = true);
        let lost = reached.iter().position(|r| !r).unwrap_or_default();
        let (joint, element) = &joints[lost];
        let message = format!("joint `{}` is part of a separate circle", joint.name);
        return Err(element.wrong(message));
    }

    // The root goes first; those before it move up by one.
    links[..=first].rotate_right(1);
    let link = |index: u32| match (index as usize).cmp(&first) {
        std::cmp::Ordering::Less => index + 1,
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => index,
    };
    let mut place = vec![0; joints.len()];
    order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
    let joint = |old: usize| {
        let mut joint = joints[old].0.clone();
        (joint.parent, joint.child) = (link(joint.parent), link(joint.child));
        if let Some(mimic) = &mut joint.mimic {
            mimic.joint = place[mimic.joint as usize];
        }
        joint
    };
    let joints = order.iter().map(|&old| joint(old)).collect();
    let name = root.given("name").unwrap_or_default().to_string();
    Ok(Robot { name, links, joints, ..Robot::default() })
}

/// The element of a link.
fn at_link<'a>(root: &Element<'a>, elements: &[Element<'a>], name: &str) -> Element<'a> {
    elements.iter().find(|e| e.given("name").map(str::trim) == Some(name)).copied().unwrap_or(*root)
}
