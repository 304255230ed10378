//! A made-up bench on which everything happens that a page can show.

use matterix_ir::robot::Placement;
use matterix_view::document::*;

use super::arm;

const END: f64 = 120.0;

/// A lathe line and a cavity of a round vessel, from its outer radii over height and the thickness of its wall, m.
fn vessel(outer: &[[f32; 2]], wall: f32) -> (Solid, Cavity) {
    let inner: Vec<[f32; 2]> = outer.iter().map(|[r, z]| [(r - wall).max(0.0), z.max(wall)]).collect();
    let mut line = vec![[0.0, 0.0]];
    line.extend(outer);
    line.extend(inner.iter().rev());
    line.push([0.0, wall]);
    (Solid::Lathe(line), Cavity::Round(inner))
}

fn body(name: &str, kind: &str, at: [f32; 3]) -> Body {
    let [x, y, z] = at;
    Body { name: name.into(), kind: kind.into(), pose: Pose([x, y, z, 0.0, 0.0, 0.0, 1.0]), ..Body::default() }
}

fn piece(at: [f32; 3], solid: Solid, color: Option<[f32; 4]>) -> Piece {
    let [x, y, z] = at;
    Piece { pose: Pose([x, y, z, 0.0, 0.0, 0.0, 1.0]), solid, finish: Finish::Matte, color }
}

fn glass(mut body: Body, (solid, cavity): (Solid, Cavity)) -> Body {
    body.pieces = vec![Piece { pose: Pose::default(), solid, finish: Finish::Glass, color: None }];
    body.cavity = Some(cavity);
    body
}

/// The whole document.
pub fn document() -> Document {
    let beaker = vessel(&[[0.030, 0.0], [0.034, 0.002], [0.035, 0.006], [0.035, 0.092], [0.037, 0.095]], 0.0015);
    let flask = vessel(&[[0.036, 0.0], [0.041, 0.004], [0.041, 0.012], [0.015, 0.095], [0.015, 0.13]], 0.0015);
    let mut bodies = vec![body("table", "Table", [0.0, 0.0, -0.06]), body("hotplate", "Hotplate", [0.5, 0.0, 0.0])];
    bodies[0].pieces = vec![piece([0.15, 0.0, 0.03], Solid::Cuboid([1.5, 1.0, 0.06]), None)];
    bodies[1].pieces = vec![
        piece([0.0, 0.0, 0.04], Solid::Cuboid([0.16, 0.27, 0.08]), Some([0.9, 0.91, 0.92, 1.0])),
        Piece { finish: Finish::Metal, ..piece([0.0, 0.02, 0.0825], Solid::Cylinder([0.068, 0.005]), None) },
    ];
    bodies.push(glass(body("beaker", "Beaker250mL", [0.5, 0.02, 0.085]), beaker.clone()));
    bodies.push(glass(body("feed", "Beaker250mL", [0.3, -0.35, 0.0]), beaker));
    bodies.push(glass(body("flask", "Erlenmeyer250mL", [0.62, -0.3, 0.0]), flask));
    plate(&mut bodies);
    bodies.push(body("arm", "Arm", [0.0, 0.0, 0.0]));
    let mut document = Document {
        version: DOCUMENT_VERSION,
        workflow: "indicator".into(),
        lab: "bench".into(),
        duration: Some(END),
        ended: Some(State::Failed),
        facts: vec![("seed".into(), "0".into()), ("fidelity".into(), "motion".into())],
        bodies,
        ..Document::default()
    };
    motion(&mut document);
    liquids(&mut document);
    story(&mut document);
    document
}

/// The same before anything happened.
pub fn still() -> Document {
    let mut document = document();
    document.plan.iter_mut().for_each(|node| node.runs.clear());
    document.series.iter_mut().for_each(|series| series.values.truncate(1));
    document.axes.iter_mut().for_each(|axis| axis.truncate(1));
    Document { duration: None, ended: None, tracks: Vec::new(), log: Vec::new(), expectations: Vec::new(), ..document }
}

fn plate(bodies: &mut Vec<Body>) {
    let parent = bodies.len() as u32;
    let mut plate = body("plate", "WellPlate24", [0.42, 0.33, 0.0]);
    plate.pieces =
        vec![Piece { finish: Finish::Hull, ..piece([0.0, 0.0, 0.01], Solid::Cuboid([0.128, 0.086, 0.02]), None) }];
    bodies.push(plate);
    for i in 0..24_u8 {
        let (row, column) = (i % 4, i / 4);
        let name = format!("plate[{}{}]", char::from(b'A' + row), column + 1);
        let at = [0.42 - 0.0475 + 0.019 * f32::from(column), 0.33 + 0.0285 - 0.019 * f32::from(row), 0.002];
        let outer = [[0.008, 0.0], [0.008, 0.0175]];
        bodies.push(Body { parent: Some(parent), ..glass(body(&name, "Well", at), vessel(&outer, 0.0)) });
    }
}

/// From the feed's place to above the beaker, a tilt, and back.
fn motion(document: &mut Document) {
    // Positions of the joints; the hand points down, and at the end leans forward.
    let home = [0.0, -0.2, 0.0, 2.1, 0.0, 1.24, 0.0];
    let above = [-0.75, 0.35, 0.0, 1.78, 0.0, 1.012, 0.0];
    let pick = [-0.75, 0.77, 0.0, 1.81, 0.0, 0.562, 0.0];
    let pour = [0.04, 0.16, 0.0, 2.0, 0.0, 0.982, 0.0];
    let tilt = [0.04, 0.98, 0.0, 1.35, 0.0, 1.962, 0.0];
    let keys: [(f64, [f64; 7]); 13] = [
        (0.0, home),
        (4.0, home),
        (8.0, above),
        (10.0, pick),
        (12.0, pick),
        (14.0, above),
        (20.0, pour),
        (26.0, tilt),
        (43.0, tilt),
        (46.0, pour),
        (50.0, above),
        (52.0, pick),
        (60.0, home),
    ];
    let times: Vec<f64> = (0..=1200).map(|i| f64::from(i) * 0.05).collect();
    let turns = |time: f64| {
        let next = keys.iter().position(|(t, _)| *t >= time).unwrap_or(keys.len() - 1).max(1);
        let ((t0, a), (t1, b)) = (keys[next - 1], keys[next]);
        let s = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let s = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * s)
    };
    let path: Vec<Vec<Placement>> = times.iter().map(|&t| arm::links([0.0; 3], turns(t))).collect();
    let robot = arm::robot();
    let links = matterix_view::robot::add(document, &robot, "arm", &path[0], |_| None);
    for (i, link) in links.iter().enumerate() {
        if let Some(body) = link {
            let way: Vec<Placement> = path.iter().map(|p| p[i]).collect();
            document.tracks.push(matterix_view::robot::track(*body, &times, &way));
        }
    }
    // The feed is gripped where the grip is at 12 s and let go at 52 s.
    let feed = document.bodies.iter().position(|b| b.name == "feed").unwrap_or(0);
    let at = path[240][8];
    let stands = Placement { position: [at.position[0], at.position[1], 0.0], ..Placement::default() };
    document.bodies[feed].pose = Pose([at.position[0] as f32, at.position[1] as f32, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let back = {
        let [x, y, z, w] = at.rotation;
        let turned = Placement { rotation: [-x, -y, -z, w], ..Placement::default() };
        let [px, py, pz] = at.position;
        arm::then(turned, Placement { position: [-px, -py, -pz], ..Placement::default() })
    };
    let held = arm::then(back, stands);
    let way: Vec<Placement> = (0..times.len())
        .map(|i| if (240..=1040).contains(&i) { arm::then(path[i][8], held) } else { stands })
        .collect();
    document.tracks.push(matterix_view::robot::track(feed as u32, &times, &way));
}

fn series(document: &mut Document, name: &str, body: u32, unit: &str, value: impl Fn(f64) -> f64) -> u32 {
    let axis: Vec<f64> = (0..=240).map(|i| f64::from(i) * END / 240.0).collect();
    let values = axis.iter().map(|&t| Some(value(t) as f32)).collect();
    if document.axes.is_empty() {
        document.axes.push(axis);
    }
    let label = name.rsplit('.').next().unwrap_or(name).to_owned();
    let (name, unit) = (name.to_owned(), unit.to_owned());
    document.series.push(Series { name, label, body: Some(body), origin: Origin::Contents, unit, axis: 0, values });
    document.series.len() as u32 - 1
}

fn liquids(document: &mut Document) {
    let poured = |t: f64| ((t - 25.0) / 18.0).clamp(0.0, 1.0);
    let turned = |t: f64| 1.0 / (1.0 + (-(t - 70.0) / 6.0).exp());
    let find =
        |document: &Document, name: &str| document.bodies.iter().position(|b| b.name == name).unwrap_or(0) as u32;
    let mut add = |name: &str,
                   volume: &dyn Fn(f64) -> f64,
                   color: Option<[&dyn Fn(f64) -> f64; 3]>,
                   heat: &dyn Fn(f64) -> f64| {
        let body = find(document, name);
        let full = format!("{name}.contents");
        let v = series(document, &format!("{full}.volume"), body, "mL", volume);
        let t = series(document, &format!("{full}.temperature"), body, "degC", heat);
        let color = color.map(|c| c.map(|c| series(document, &format!("{full}.color"), body, "", c)));
        let groups = vec![("properties".to_owned(), vec![v, t])];
        document.contents.push(Contents { name: full, body: Some(body), volume: Some((v, 1e-6)), color, groups });
    };
    add(
        "beaker",
        &|t| 90.0 + 110.0 * poured(t),
        Some([&|t| 0.95 - 0.5 * turned(t), &|t| 0.72 - 0.62 * turned(t), &|t| 0.30 + 0.35 * turned(t)]),
        &|t| 25.0 + 40.0 * (1.0 - (-(t - 8.0).max(0.0) / 40.0).exp()),
    );
    add("feed", &|t| 160.0 - 110.0 * poured(t), None, &|_| 25.0);
    add("flask", &|_| 120.0, Some([&|_| 0.1, &|_| 0.45, &|_| 0.75]), &|_| 25.0);
    for i in 0..24_u8 {
        let name = format!("plate[{}{}]", char::from(b'A' + i % 4), i / 4 + 1);
        let k = f64::from(i);
        let red = move |_: f64| 1.0 - 0.03 * k;
        let blue = move |_: f64| 0.25 + 0.03 * k;
        add(
            &name,
            &move |t| 0.3 + 1.8 * ((t - 60.0 - k) / 6.0).clamp(0.0, 1.0),
            Some([&red, &|_| 0.55, &blue]),
            &|_| 25.0,
        );
    }
}

fn story(document: &mut Document) {
    let text = "mtx 1\n\nworkflow indicator in bench {\n    parallel {\n        heat hotplate to 65 degC\n        pour 110 mL from feed into beaker by arm\n    }\n    wait until beaker.color[1] < 0.5 timeout 2 min\n    fill plate from flask\n    expect beaker.contents.temperature in 55 degC .. 60 degC\n}\n";
    document.sources = vec![Source { name: "examples/indicator.mtx".into(), text: text.into() }];
    let mut node = |parent: Option<u32>, label: &str, line: u32, runs: &[(f64, f64)], state: State| {
        let runs = runs.iter().map(|&(start, end)| Interval { start, end: Some(end), state }).collect();
        document.plan.push(Node { parent, label: label.into(), place: Some((0, line)), runs });
        document.plan.len() as u32 - 1
    };
    let both = node(None, "parallel", 4, &[(0.0, 60.0)], State::Done);
    node(Some(both), "heat hotplate to 65 degC", 5, &[(0.0, 48.0)], State::Done);
    let pour = node(Some(both), "pour 110 mL from feed into beaker by arm", 6, &[(0.0, 60.0)], State::Done);
    for (label, start, end) in [
        ("move arm to feed", 4.0, 10.0),
        ("grasp feed by arm", 10.0, 12.0),
        ("move arm to beaker", 12.0, 20.0),
        ("tilt feed into beaker by arm", 20.0, 44.0),
        ("put back feed by arm", 44.0, 52.0),
        ("move arm home", 52.0, 60.0),
    ] {
        node(Some(pour), label, 6, &[(start, end)], State::Done);
    }
    node(None, "wait until beaker.color[1] < 0.5 timeout 2 min", 8, &[(60.0, 71.4)], State::Done);
    let fill = node(None, "fill plate from flask", 9, &[(71.4, 110.0)], State::Failed);
    for i in 0..6_u8 {
        let start = 71.4 + 6.0 * f64::from(i);
        node(Some(fill), &format!("dispense into column {}", i + 1), 9, &[(start, start + 6.0)], State::Done);
    }
    node(None, "expect beaker.contents.temperature in 55 degC .. 60 degC", 10, &[(110.0, 110.0)], State::Done);
    let line = |time, level, text: &str, line| LogLine { time, level, text: text.into(), place: Some((0, line)) };
    document.log = vec![
        line(12.0, Level::Info, "feed is in the gripper", 6),
        line(98.0, Level::Warning, "flask runs low: 18 mL left", 9),
        line(110.0, Level::Error, "empty: `fill plate from flask` needs 20 mL more", 9),
    ];
    document.expectations = vec![Expectation {
        time: 110.0,
        text: "beaker.contents.temperature in 55 degC .. 60 degC".into(),
        passed: false,
        found: vec!["beaker.contents.temperature: 61.9 degC".into()],
        place: Some((0, 10)),
    }];
}
