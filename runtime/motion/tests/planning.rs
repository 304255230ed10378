//! Plans are free by an exact checker, the same every time, and failures say what is wrong where.

#[allow(dead_code)]
#[path = "../benches/mbm/problems.rs"]
mod problems;

use matterix_motion::plan::{End, Failure, Settings, plan};
use matterix_motion::spheres::{Checker, Figure, Held, Other};
use matterix_motion::time::{Limits, follow};
use matterix_motion::world::{Body, Shape, World};
use matterix_motion::{Pose, Tree};
use nalgebra::Translation3;
use problems::{problems, robot};

fn figure(name: &str, held: &[Held]) -> Figure {
    let robot = robot(name);
    let count = Tree::new(&robot).expect("a tree").variables().len();
    let moved: Vec<usize> = (0..count).collect();
    Figure::new(&robot, &Pose::identity(), &moved, &vec![0.0; count], held).expect("a figure")
}

fn settings(name: &str) -> Settings {
    Settings { range: if name == "panda" { 1.0 } else { 1.5 }, ..Settings::default() }
}

/// Every so many problems, so that debug builds stay quick.
const EVERY: usize = 35;

#[test]
fn plans_are_free_by_the_exact_checker() {
    for (name, invalid) in [("panda", 1), ("ur5", 11)] {
        let figure = figure(name, &[]);
        let all = problems(name);
        let mut refused = 0;
        for (number, problem) in all.iter().enumerate() {
            let mut checker = Checker::new(&figure, &problem.world, 32.0);
            let single = |q: &[f64]| q.iter().map(|&x| x as f32).collect::<Vec<_>>();
            let free = checker.is_free(&single(&problem.start)) && checker.is_free(&single(&problem.goal));
            refused += usize::from(!free);
            if number % EVERY != 0 || !free {
                continue;
            }
            let route = plan(&mut checker, &problem.start, &problem.goal, &settings(name)).unwrap();
            for line in route.points.windows(2) {
                for k in 0..=8 {
                    let t = f64::from(k) / 8.0;
                    let q: Vec<f64> = line[0].iter().zip(&line[1]).map(|(a, b)| a + (b - a) * t).collect();
                    let contacts = figure.contacts(&problem.world, &q);
                    let deep = contacts.iter().find(|c| c.depth > 1e-6);
                    // Ends of lines and the eighths of short ones are checked themselves; between, the grid is 1/32.
                    let length: f64 = line[0].iter().zip(&line[1]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                    let allowed = if k == 0 || k == 8 { 1e-5 } else { 0.02 * length.max(0.1) };
                    assert!(
                        deep.is_none_or(|c| c.depth < allowed),
                        "{name} {} {}: {contacts:?}",
                        problem.scene,
                        problem.number
                    );
                }
            }
        }
        assert_eq!(refused, invalid);
    }
}

#[test]
fn lanes_and_the_exact_checker_agree() {
    for name in ["panda", "ur5"] {
        let figure = figure(name, &[]);
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for problem in problems(name).iter().step_by(70) {
            let mut checker = Checker::new(&figure, &problem.world, 32.0);
            for _ in 0..50 {
                let q: Vec<f64> = figure.limits().iter().map(|l| l[0] + (l[1] - l[0]) * random()).collect();
                let deepest = figure.contacts(&problem.world, &q).first().map_or(0.0, |c| c.depth);
                let single: Vec<f32> = q.iter().map(|&x| x as f32).collect();
                let free = checker.is_free(&single);
                // A micrometre is what 32 bits may get wrong; touching to that depth may be judged either way.
                assert!(free == (deepest == 0.0) || deepest < 5e-6, "{name} {q:?} {deepest}");
            }
        }
    }
}

#[test]
fn the_same_question_has_the_same_answer() {
    let figure = figure("panda", &[]);
    let all = problems("panda");
    let answer = || {
        let mut checker = Checker::new(&figure, &all[3].world, 32.0);
        plan(&mut checker, &all[3].start, &all[3].goal, &Settings::default())
    };
    assert_eq!(answer(), answer());
}

const READY: [f64; 7] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];

fn ball(at: [f64; 3], radius: f64) -> World {
    let pose = Pose::from_parts(Translation3::from(at), Default::default());
    World { bodies: vec![Body { name: "ball".into(), pose, shape: Shape::Sphere(radius) }], ..World::default() }
}

#[test]
fn a_goal_in_something_names_link_body_and_depth() {
    let figure = figure("panda", &[]);
    let mut goal = READY;
    goal[0] = 1.0;
    let hand = figure.poses(&goal)[robot("panda").link("panda_hand").unwrap() as usize].translation.vector;
    let world = ball(hand.into(), 0.05);
    let mut checker = Checker::new(&figure, &world, 32.0);
    match plan(&mut checker, &READY, &goal, &Settings::default()) {
        Err(Failure::Collision(End::Goal, contacts)) => {
            let deepest = &contacts[0];
            assert_eq!(deepest.other, Other::Body(0));
            assert!(deepest.depth > 0.04, "{contacts:?}");
            assert!(contacts.iter().any(|c| figure.name(c.link) == "panda_hand"));
        }
        other => panic!("{other:?}"),
    }
    let outside = [9.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0];
    let failure = plan(&mut checker, &READY, &outside, &Settings::default()).unwrap_err();
    assert_eq!(failure, Failure::Limits(End::Goal, 0, 9.0));
    let failure = plan(&mut checker, &READY[..3], &goal, &Settings::default()).unwrap_err();
    assert_eq!(failure, Failure::Size(End::Start, 3));
}

/// A torso that turns without end, a lift on it, and two arms of one joint each: frames that branch and slide.
fn branching() -> matterix_ir::robot::Robot {
    use matterix_ir::robot::{Ball, Joint, JointKind, JointLimits, Link, Placement, Robot};
    let names = ["base", "torso", "lift", "left", "right", "thumb"];
    let links = names.map(|n| Link { name: n.into(), inertial: None, visual: vec![], collision: vec![] });
    let s = 0.5_f64.sqrt();
    let joint = |name: &str, kind, parent, child, position, rotation, axis, (lower, upper)| Joint {
        name: name.into(),
        kind,
        parent,
        child,
        origin: Placement { position, rotation },
        axis,
        limits: Some(JointLimits { lower, upper, velocity: 1.0, effort: 1.0, acceleration: None, jerk: None }),
        mimic: None,
    };
    let (still, tilted, turned) = ([0.0, 0.0, 0.0, 1.0], [0.6, 0.0, 0.0, 0.8], [0.0, s, 0.0, s]);
    let all = (f64::MIN, f64::MAX);
    let joints = vec![
        joint("turn", JointKind::Continuous, 0, 1, [0.1, 0.0, 0.2], still, [0.0, 0.0, 1.0], all),
        joint("rise", JointKind::Prismatic, 1, 2, [0.0, 0.1, 0.1], tilted, [0.0, 0.0, 1.0], (0.0, 0.4)),
        joint("left", JointKind::Revolute, 2, 3, [0.2, 0.0, 0.1], turned, [0.0, 1.0, 0.0], (-2.0, 2.0)),
        joint("right", JointKind::Revolute, 2, 4, [-0.2, 0.05, 0.1], tilted, [0.6, 0.0, 0.8], (-2.0, 2.0)),
        joint("thumb", JointKind::Revolute, 4, 5, [0.1, 0.2, 0.3], turned, [1.0, 0.0, 0.0], (-2.0, 2.0)),
    ];
    let ball = |link, center, radius| Ball { link, center, radius };
    let balls = vec![
        ball(0, [0.0; 3], 0.1),
        ball(1, [0.0, 0.1, 0.0], 0.05),
        ball(3, [0.2, 0.0, 0.1], 0.06),
        ball(3, [0.4, 0.0, 0.1], 0.05),
        ball(4, [0.0, 0.2, 0.2], 0.05),
        ball(5, [0.0, 0.0, 0.2], 0.05),
    ];
    Robot {
        name: "two arms".into(),
        links: links.into(),
        joints,
        balls,
        touching: vec![[0, 1], [4, 5]],
        ..Robot::default()
    }
}

#[test]
fn frames_may_branch_slide_and_turn_without_end() {
    let robot = branching();
    let base =
        Pose::from_parts(Translation3::new(0.3, -0.2, 0.1), nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3));
    let figure = Figure::new(&robot, &base, &[0, 1, 2, 3, 4], &[0.0; 5], &[]).unwrap();
    let pose =
        Pose::from_parts(Translation3::new(0.4, 0.2, 0.6), nalgebra::Rotation3::from_euler_angles(0.5, 0.4, 0.3));
    for shape in
        [Shape::Cuboid([0.2, 0.1, 0.3]), Shape::Cylinder(0.15, 0.2), Shape::Capsule(0.1, 0.2), Shape::Sphere(0.2)]
    {
        let world = World { bodies: vec![Body { name: "thing".into(), pose, shape }], ..World::default() };
        let mut checker = Checker::new(&figure, &world, 32.0);
        let mut seen = [0, 0];
        for k in 0..400 {
            let part = |i: usize| (f64::from(k) * [0.618, 0.414, 0.732, 0.236, 0.889][i]).fract();
            let q = [6.0 * part(0) - 3.0, 0.4 * part(1), 4.0 * part(2) - 2.0, 4.0 * part(3) - 2.0, 4.0 * part(4) - 2.0];
            let depth = figure.contacts(&world, &q).first().map_or(0.0, |c| c.depth);
            let free = checker.is_free(&q.map(|x| x as f32));
            assert!(free == (depth == 0.0) || depth < 5e-6, "{:?} {q:?} {depth}", world.bodies[0].shape);
            seen[usize::from(free)] += 1;
        }
        assert!(seen.iter().all(|&n| n > 20), "{seen:?}");
        let route = plan(&mut checker, &[-2.0, 0.1, 0.0, 0.0, 0.0], &[2.0, 0.3, 0.5, 0.5, 0.5], &Settings::default());
        assert!(matches!(route, Ok(_) | Err(Failure::Collision(..))), "{route:?}");
    }
}

#[test]
fn what_is_held_collides_too() {
    let hand = robot("panda").link("panda_hand").unwrap();
    let fingers = ["panda_leftfinger", "panda_rightfinger"].map(|n| robot("panda").link(n).unwrap());
    let flask = Held {
        name: "flask".into(),
        link: hand,
        balls: vec![([0.0, 0.0, 0.12], 0.02), ([0.0, 0.0, 0.18], 0.03)],
        touching: fingers.to_vec(),
    };
    let (bare, laden) = (figure("panda", &[]), figure("panda", &[flask]));
    let below = (bare.poses(&READY)[hand as usize] * nalgebra::Point3::new(0.0, 0.0, 0.2)).coords;
    let world = ball(below.into(), 0.01);
    let q = READY.map(|x| x as f32);
    assert!(Checker::new(&bare, &world, 32.0).is_free(&q));
    assert!(Checker::new(&laden, &World::default(), 32.0).is_free(&q));
    assert!(!Checker::new(&laden, &world, 32.0).is_free(&q));
    let contacts = laden.contacts(&world, &READY);
    assert_eq!(laden.name(contacts[0].link), "flask");
    assert!((contacts[0].depth - 0.02).abs() < 1e-9, "{contacts:?}");
}

#[test]
fn trajectories_keep_every_limit_and_stay_free() {
    let limits = Limits {
        velocity: vec![2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        acceleration: vec![15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
        jerk: vec![7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
    };
    let slow = Limits { jerk: limits.acceleration.iter().map(|a| 5.0 * a).collect(), ..limits.clone() };
    let figure = figure("panda", &[]);
    for (problem, limits) in problems("panda").iter().step_by(47).zip([&limits, &slow].into_iter().cycle()) {
        let mut checker = Checker::new(&figure, &problem.world, 32.0);
        let Ok(route) = plan(&mut checker, &problem.start, &problem.goal, &Settings::default()) else { continue };
        let stops = follow(&route.points, limits, None).unwrap();
        let flows = follow(&route.points, limits, Some(&mut checker)).unwrap();
        assert!(flows.duration() <= stops.duration() + 1e-9);
        for trajectory in [stops, flows] {
            let end = trajectory.duration();
            let count = 400;
            let mut before = trajectory.at(0.0);
            assert_eq!(before.position, problem.start);
            assert_eq!(trajectory.at(end).position, problem.goal);
            for k in 1..=count {
                let step = end / f64::from(count);
                let state = trajectory.at(f64::from(k) * step);
                for j in 0..7 {
                    let over = 1.0 + 1e-9;
                    assert!(state.velocity[j].abs() <= limits.velocity[j] * over);
                    assert!(state.acceleration[j].abs() <= limits.acceleration[j] * over);
                    assert!(state.jerk[j].abs() <= limits.jerk[j] * over);
                    let moved = (state.position[j] - before.position[j]).abs();
                    assert!(moved <= limits.velocity[j] * step * over + 1e-9);
                    let gained = (state.velocity[j] - before.velocity[j]).abs();
                    assert!(gained <= limits.acceleration[j] * step * over + 1e-9, "{k} {j} {gained}");
                    let pushed = (state.acceleration[j] - before.acceleration[j]).abs();
                    assert!(pushed <= limits.jerk[j] * step * over + 1e-6, "{k} {j} {pushed}");
                }
                if k % 8 == 0 {
                    let deep = figure.contacts(&problem.world, &state.position).first().map_or(0.0, |c| c.depth);
                    assert!(deep < 5e-3, "{} {}: {deep}", problem.scene, problem.number);
                }
                before = state;
            }
        }
    }
}

#[test]
fn straight_moves_stay_on_their_line_or_say_where_they_end() {
    use matterix_motion::inverse::Solver;
    use matterix_motion::plan::{Blocked, Stride, straight};
    let robot = robot("panda");
    let (figure, tip) = (figure("panda", &[]), robot.link("panda_hand").unwrap());
    let chain = matterix_motion::Chain::new(&robot, 0, tip).unwrap();
    let mut solver = Solver::new(chain);
    let from = solver.chain().tip(&READY);
    let mut down = from;
    down.translation.vector.z -= 0.2;
    let empty = World::default();
    let mut checker = Checker::new(&figure, &empty, 32.0);
    let points = straight(&mut solver, &mut checker, &READY, &down, &Stride::default()).unwrap();
    for (k, q) in points.iter().enumerate() {
        let at = solver.chain().tip(q);
        let line = from.translation.vector.z - 0.2 * k as f64 / (points.len() - 1) as f64;
        assert!((at.translation.vector - from.translation.vector).xy().norm() < 2e-6);
        assert!((at.translation.vector.z - line).abs() < 2e-6);
    }
    let mut far = from;
    far.translation.vector.x += 1.0;
    match straight(&mut solver, &mut checker, &READY, &far, &Stride::default()) {
        Err(Blocked::Reach(share, linear, _)) => assert!(share > 0.2 && share < 0.8 && linear > 0.0),
        Err(Blocked::Jump(share, ..)) => assert!(share > 0.2 && share < 0.8),
        other => panic!("{other:?}"),
    }
    let table = Shape::Cuboid([0.5, 0.5, 0.01]);
    let pose = Pose::from_parts(Translation3::new(0.6, 0.0, down.translation.vector.z), Default::default());
    let world = World { bodies: vec![Body { name: "table".into(), pose, shape: table }], ..World::default() };
    let mut checker = Checker::new(&figure, &world, 32.0);
    match straight(&mut solver, &mut checker, &READY, &down, &Stride::default()) {
        Err(Blocked::Collision(share, contacts)) => {
            assert!(share > 0.1 && share < 0.9, "{share}");
            assert_eq!(contacts[0].other, Other::Body(0));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_held_vessel_stays_upright() {
    use matterix_motion::inverse::{Request, Solver};
    use matterix_motion::plan::{Level, Upright, plan_upright};
    use nalgebra::Vector3;
    let robot = robot("panda");
    let figure = figure("panda", &[]);
    let mut solver = Solver::new(matterix_motion::Chain::new(&robot, 0, robot.link("panda_hand").unwrap()).unwrap());
    // The hand points down when ready: its third axis is against up.
    let upright = Upright { axis: -Vector3::z_axis(), up: Vector3::z_axis(), tilt: 0.15 };
    let mut goal = solver.chain().tip(&READY);
    goal.translation.vector = Vector3::new(0.1, 0.5, 0.4);
    let goal = solver.solve(&Request::new(goal, &READY)).unwrap().q;
    let pose = Pose::from_parts(Translation3::new(0.4, 0.3, 0.3), Default::default());
    let world = World {
        bodies: vec![Body { name: "post".into(), pose, shape: Shape::Capsule(0.05, 0.3) }],
        ..World::default()
    };
    let mut checker = Checker::new(&figure, &world, 32.0);
    let mut level = Level { checker: &mut checker, solver: &mut solver, upright };
    let settings = Settings { iterations: 2000, ..Settings::default() };
    let route = plan_upright(&mut level, &READY, &goal, &settings).unwrap();
    let jerk = Limits { velocity: vec![2.0; 7], acceleration: vec![10.0; 7], jerk: vec![100.0; 7] };
    let trajectory = follow(&route.points, &jerk, Some(&mut level)).unwrap();
    for k in 0..=300 {
        let q = trajectory.at(trajectory.duration() * f64::from(k) / 300.0).position;
        let tilt = upright.tilt_of(&solver.chain().tip(&q));
        assert!(tilt < 0.16, "{k}: {tilt}");
        let deep = figure.contacts(&world, &q).first().map_or(0.0, |c| c.depth);
        assert!(deep < 5e-3, "{k}: {deep}");
    }
    let tipped = [0.0, -0.785, 0.0, -2.356, 0.0, 2.571, 0.785];
    let mut level = Level { checker: &mut checker, solver: &mut solver, upright };
    assert!(matches!(
        plan_upright(&mut level, &READY, &tipped, &settings),
        Err(Failure::Tilt(End::Goal, tilt)) if (tilt - 1.0).abs() < 0.01
    ));
}

#[test]
fn a_search_gives_up_when_it_has_looked_at_so_much() {
    let figure = figure("panda", &[]);
    let mut goal = READY;
    goal[0] = 1.5;
    let pose = Pose::from_parts(Translation3::new(0.22, 0.22, 0.6), Default::default());
    let world = World {
        bodies: vec![Body { name: "post".into(), pose, shape: Shape::Capsule(0.05, 0.4) }],
        ..World::default()
    };
    let found = |effort: u64| {
        let mut checker = Checker::new(&figure, &world, 32.0);
        let route = plan(&mut checker, &READY, &goal, &Settings { effort, ..Settings::default() });
        (route.map(|route| route.iterations), checker.effort())
    };
    let (whole, enough) = found(u64::MAX);
    assert!(whole.is_ok());
    let (given_up, spent) = found(8);
    assert!(matches!(given_up, Err(Failure::Unreached(_))), "{given_up:?}");
    assert!(spent < 30 && spent < enough, "{spent} of {enough}");
    assert_eq!(found(2 * enough).0, whole);
}

#[test]
fn direct_motions_keep_every_limit() {
    use matterix_motion::time::{State, Untimed, direct};
    let limits = Limits { velocity: vec![2.0; 7], acceleration: vec![10.0; 7], jerk: vec![100.0; 7] };
    let still = vec![0.0; 7];
    let moving = vec![0.5; 7];
    let from = State { position: READY.to_vec(), velocity: moving, acceleration: still.clone(), jerk: still };
    let to = [1.0, 0.5, -1.0, -1.0, 0.3, 2.0, -0.5];
    let motion = direct(&from, &to, &limits).unwrap();
    for k in 0..=500 {
        let state = motion.at(motion.duration() * f64::from(k) / 500.0);
        for j in 0..7 {
            assert!(state.velocity[j].abs() <= 2.0 + 1e-9 && state.acceleration[j].abs() <= 10.0 + 1e-9);
            assert!(state.jerk[j].abs() <= 100.0 + 1e-9);
        }
    }
    let end = motion.at(motion.duration());
    assert!((0..7).all(|j| (end.position[j] - to[j]).abs() < 1e-8 && end.velocity[j].abs() < 1e-8));
    let none = Limits { jerk: vec![0.0; 7], ..limits.clone() };
    assert_eq!(direct(&from, &to, &none).unwrap_err(), Untimed::Limit(0));
    assert_eq!(direct(&from, &to[..3], &limits).unwrap_err(), Untimed::Size);
}
