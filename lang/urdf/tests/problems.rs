//! What is wrong with a description is said at its line, and nothing brings the reader down.

use matterix_urdf::read;
use proptest::prelude::*;

const SOUND: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="arm">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry><material name="red"><color rgba="1 0 0 1"/></material></visual>
    <collision><origin xyz="0 0 1"/><geometry><cylinder radius="0.1" length="1"/></geometry></collision>
  </link>
  <link name="hand"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="arm"/>
    <axis xyz="0 0 2"/>
    <limit lower="-1" upper="1" velocity="2" effort="3"/>
    <safety_controller soft_lower_limit="-0.5" k_velocity="1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="arm"/><child link="hand"/>
    <limit upper="1" velocity="2" effort="3"/>
    <mimic joint="turn" multiplier="2"/>
  </joint>
</robot>"#;

#[test]
fn what_is_left_out_is_as_the_format_says() {
    let robot = read(SOUND).expect("a robot");
    assert_eq!(robot.joints[0].axis, [0.0, 0.0, 1.0]);
    assert_eq!(robot.joints[0].limits.map(|l| (l.lower, l.upper)), Some((-0.5, 1.0)));
    assert_eq!(robot.joints[1].axis, [1.0, 0.0, 0.0]);
    assert_eq!(robot.joints[1].limits.map(|l| (l.lower, l.upper)), Some((0.0, 1.0)));
    assert_eq!(robot.joints[1].mimic.map(|m| (m.joint, m.multiplier, m.offset)), Some((0, 2.0, 0.0)));
    assert_eq!(robot.links[1].visual[0].color, Some([1.0, 0.0, 0.0, 1.0]));
    assert_eq!(robot.links[0].inertial, None);
}

#[test]
fn links_and_joints_may_stand_in_any_order() {
    let mut lines: Vec<&str> = SOUND.split_inclusive("</joint>\n").collect();
    let head = lines.remove(0);
    let (before, turn) = head.split_at(head.find("  <joint").expect("a joint"));
    let robot = read(&format!("{before}{}{turn}{}", lines[0], lines[1])).expect("a robot");
    let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["turn", "slide"]);
    assert_eq!(robot.joints[1].mimic.map(|m| m.joint), Some(0));
}

/// Text to replace, by what, and what is to be said.
const MISTAKES: &[(&str, &str, &str)] = &[
    ("<robot name", "<robt name", "line 20: expected `robt` tag, not `robot`"),
    ("\"base\"/>\n  <link name=\"arm\"", "\"arm\"/>\n  <link name=\"arm\"", "line 3: link `arm` is described twice"),
    ("name=\"slide\"", "name=\"turn\"", "line 15: joint `turn` is described twice"),
    ("<link name=\"hand\"/>", "", "line 16: the child of joint `slide` is `hand`, which is not a link"),
    (
        "<child link=\"arm\"/>",
        "<child link=\"hand\"/>",
        "link `hand` is the child of joint `slide` and of joint `turn`",
    ),
    ("<parent link=\"base\"/>", "<parent link=\"arm\"/>", "line 9: joint `turn` connects a link with itself"),
    ("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 0\"/>", "line 11: the axis of joint `turn` has length 0"),
    ("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 NaN\"/>", "line 11: `NaN` in `xyz` of `axis` is not a finite number"),
    ("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0\"/>", "line 11: `xyz` of `axis` has 2 of 3 numbers"),
    (
        "<axis xyz=\"0 0 2\"/>",
        "<axsi xyz=\"0 0 2\"/>",
        "line 11: `axsi` is not an element of URDF; did you mean `axis`?",
    ),
    ("lower=\"-1\" upper=\"1\"", "", "line 12: `limit` of joint `turn` has no `lower` and `upper`"),
    ("lower=\"-1\" upper=\"1\"", "lower=\"2\" upper=\"1\"", "allow no position: 2 to 1"),
    ("lower=\"-1\"", "lower=\"-inf\"", "line 12: `-inf` in `lower` of `limit` is not a finite number"),
    (
        "velocity=\"2\" effort=\"3\"/>\n    <safety",
        "effort=\"3\"/>\n    <safety",
        "`limit` of joint `turn` has no `velocity`",
    ),
    (
        "velocity=\"2\" effort=\"3\"/>\n    <safety",
        "velocity=\"0\" effort=\"3\"/>\n    <safety",
        "is 0, but must be above 0",
    ),
    ("<limit upper=\"1\" velocity=\"2\" effort=\"3\"/>", "", "line 15: joint `slide` has no `limit`"),
    ("<mimic joint=\"turn\"", "<mimic joint=\"trun\"", "line 18: joint `slide` follows `trun`, which is not a joint"),
    ("<mimic joint=\"turn\"", "<mimic joint=\"slide\"", "line 15: joint `slide` follows itself"),
    ("type=\"prismatic\"", "type=\"planar\"", "line 15: joint `slide` is `planar`"),
    ("type=\"prismatic\"", "type=\"round\"", "line 15: `round` is not a type of joint"),
    ("<box size=\"1 1 1\"/>", "<cone size=\"1 1 1\"/>", "line 5: `cone` is not a shape"),
    ("<box size=\"1 1 1\"/>", "<box size=\"1 0 1\"/>", "line 5: `size` of `box` is 0, but must be above 0"),
    ("<box size=\"1 1 1\"/>", "", "line 5: `geometry` must have one shape"),
    ("rgba=\"1 0 0 1\"", "rgba=\"255 0 0 1\"", "line 5: 255 in `rgba` is not between 0 and 1"),
    ("<mass value=\"1\"/>", "<mass value=\"-1\"/>", "line 4: `value` of `mass` is -1, below 0"),
    ("<mass value=\"1\"/>", "<mass value=\"${m}\"/>", "line 4: `${m}` in `value` of `mass` is not a finite number"),
    (
        "<robot name=\"two\">",
        "<robot xmlns:xacro=\"http://x/xacro\"><xacro:include/>",
        "`xacro:include` must be expanded",
    ),
    (
        "  <link name=\"hand\"/>",
        "  <link name=\"hand\"/><link name=\"lost\"/>",
        "line 8: link `lost` is not connected to `base`",
    ),
    ("</robot>", "", "root node was opened but never closed"),
];

#[test]
fn a_mistake_is_said_at_its_line() {
    for (from, to, expected) in MISTAKES {
        assert!(SOUND.contains(from), "{from}");
        let problem = read(&SOUND.replacen(from, to, 1)).expect_err(expected).to_string();
        assert!(problem.contains(expected), "{from} -> {to}: {problem}");
    }
}

#[test]
fn circles_are_found() {
    let joint = |name: &str, parent: &str, child: &str| {
        format!("<joint name='{name}' type='fixed'><parent link='{parent}'/><child link='{child}'/></joint>")
    };
    let links = "<link name='a'/><link name='b'/><link name='c'/>";
    let all = [joint("j", "a", "b"), joint("k", "b", "c"), joint("l", "c", "a")].concat();
    let problem = read(&format!("<robot>{links}{all}</robot>")).expect_err("a circle");
    assert!(problem.message.contains("they form a circle"), "{problem}");
    let some = [joint("k", "b", "c"), joint("l", "c", "b")].concat();
    let problem = read(&format!("<robot>{links}{some}</robot>")).expect_err("a circle");
    assert!(problem.message.contains("`k` is part of a separate circle"), "{problem}");
}

#[test]
fn what_is_too_large_is_refused() {
    let long = " ".repeat(matterix_urdf::MOST_BYTES + 1);
    assert!(read(&long).expect_err("too long").message.contains("longer than"));
    let links: String = (0..=matterix_urdf::MOST_LINKS).map(|i| format!("<link name='l{i}'/>")).collect();
    assert!(read(&format!("<robot>{links}</robot>")).expect_err("too many").message.contains("more than"));
    let deep = format!("<robot>{}{}</robot>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert!(read(&deep).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Pieces of a description put together in any way are read or refused.
    #[test]
    fn no_text_brings_the_reader_down(cuts in prop::collection::vec((0usize..1400, 0usize..200, 0usize..1400), 0..4)) {
        let mut text = SOUND.to_string();
        for (at, length, from) in cuts {
            let at = at.min(text.len());
            let end = (at + length).min(text.len());
            let from = from.min(SOUND.len());
            let piece = &SOUND[from..(from + length).min(SOUND.len())];
            text.replace_range(at..end, piece);
        }
        let _ = read(&text);
    }

    /// Numbers of any size are read or refused, and what is read is finite.
    #[test]
    fn no_number_brings_the_reader_down(index in 0usize..40, number in any::<f64>()) {
        let starts: Vec<usize> = SOUND.match_indices("=\"").map(|(at, _)| at + 2).collect();
        let start = starts[index % starts.len()];
        let end = start + SOUND[start..].find('"').unwrap_or(0);
        let text = format!("{}{number:e}{}", &SOUND[..start], &SOUND[end..]);
        if let Ok(robot) = read(&text) {
            prop_assert!(robot.balls.iter().all(|b| b.radius.is_finite() && b.center.iter().all(|c| c.is_finite())));
            prop_assert!(robot.joints.iter().all(|j| j.axis.iter().all(|c| c.is_finite())));
        }
    }
}
