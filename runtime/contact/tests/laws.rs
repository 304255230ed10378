//! What the engine does held against closed forms.

use matterix_contact::{Finger, GRAVITY, Grip, GripId, Id, Kind, STEP, Thing, World};
use matterix_ir::inertia::of_shapes;
use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_ir::scene::Shape;
use matterix_solids::Body;

fn body(shape: &Shape) -> Body {
    Body::of_shapes([(shape, Pose::IDENTITY)]).expect("it has a form")
}

fn inertial(shape: &Shape, mass: f64) -> Inertial {
    of_shapes(mass, [(shape, Pose::IDENTITY)]).expect("it has a form")
}

fn loose(shape: &Shape, mass: f64, at: Pose, friction: f64) -> (Body, Thing<'static>) {
    let kind = Kind::Loose(inertial(shape, mass));
    (body(shape), Thing { parts: Vec::new(), outside: Vec::new(), at, kind, friction, bounce: 0.0, robot: false })
}

fn add(world: &mut World, (body, thing): &(Body, Thing<'static>)) -> Id {
    world.add(&Thing { parts: vec![(Pose::IDENTITY, body)], ..thing.clone() })
}

fn steps(world: &mut World, seconds: f64) {
    for _ in 0..(seconds / STEP).round() as u32 {
        world.step();
    }
}

/// A plate that leans by an angle about y, its top through the origin.
fn slope(world: &mut World, angle: f64, friction: f64) -> Pose {
    let plate = Shape::Box([2.0, 1.0, 0.05]);
    let turned = Pose::turned([0.0; 3], [0.0, angle, 0.0]);
    let at = turned.then(Pose::at([0.0, 0.0, -0.05]));
    let thing =
        Thing { parts: Vec::new(), outside: Vec::new(), at, kind: Kind::Fixed, friction, bounce: 0.0, robot: false };
    add(world, &(body(&plate), thing));
    turned
}

fn far(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// How far a block gets down a slope in two seconds, m.
fn slides(friction: f64, angle: f64) -> f64 {
    let mut world = World::new();
    let slope = slope(&mut world, angle, friction);
    let block = Shape::Box([0.06, 0.06, 0.02]);
    let at = slope.then(Pose::IDENTITY);
    let block = add(&mut world, &loose(&block, 0.2, at, 1.0));
    steps(&mut world, 2.0);
    far(world.pose(block).position, at.position)
}

#[test]
fn a_block_slides_from_the_angle_of_friction_on() {
    for friction in [0.1f64, 0.3, 0.6, 0.9] {
        let angle = friction.atan();
        let (below, above) = (slides(friction, angle * 0.99), slides(friction, angle * 1.01));
        println!("friction {friction}: {below:.6} m and {above:.6} m");
        // Free of friction but for what is above: a = g (sin - mu cos).
        let a = GRAVITY * ((angle * 1.01).sin() - friction * (angle * 1.01).cos());
        assert!(below < 1e-3, "{friction}: it creeps {below} m below its angle");
        assert!((above / (0.5 * a * 4.0) - 1.0).abs() < 0.05, "{friction}: {above} m, {} by the law", 0.5 * a * 4.0);
    }
}

/// Whether a beaker on a slope that does not let it slide has tipped over after a while.
fn tips(shape: &Shape, inertial: Inertial, angle: f64) -> bool {
    let mut world = World::new();
    let slope = slope(&mut world, angle, 5.0);
    let thing = Thing {
        parts: Vec::new(),
        outside: Vec::new(),
        at: slope,
        kind: Kind::Loose(inertial),
        friction: 5.0,
        bounce: 0.0,
        robot: false,
    };
    let beaker = add(&mut world, &(body(shape), thing));
    // Beyond that it rolls, and may come to stand again.
    (0..8000).any(|_| {
        world.step();
        let up = world.pose(beaker).then(Pose::up(1.0)).position;
        (up[2] - world.pose(beaker).position[2]).acos() > angle + 0.5
    })
}

#[test]
fn a_beaker_tips_when_its_middle_is_beyond_its_foot() {
    let (r, h, wall) = (0.035, 0.095, 0.002);
    let beaker = Shape::Turned {
        outside: vec![[0.0, 0.0], [r, 0.0], [r, h]],
        inside: vec![[0.0, wall], [r - wall, wall], [r - wall, h]],
    };
    let empty = inertial(&beaker, 0.1);
    let (level, water) = (0.08, 0.25);
    let middle = (0.1 * empty.placement.position[2] + water * (wall + level / 2.0)) / (0.1 + water);
    let full = Inertial { mass: 0.1 + water, placement: Pose::up(middle), ..empty };
    for (name, inertial) in [("empty", empty), ("full", full)] {
        let angle = (r / inertial.placement.position[2]).atan();
        println!("{name}: {:.2} deg", angle.to_degrees());
        assert!(!tips(&beaker, inertial, angle * 0.99), "{name} tips early");
        assert!(tips(&beaker, inertial, angle * 1.01), "{name} tips late");
    }
}

#[test]
fn a_ball_bounces_to_the_square_of_what_it_keeps_of_its_speed() {
    for bounce in [0.0, 0.5, 0.8] {
        let mut world = World::new();
        let plate = Shape::Box([1.0, 1.0, 0.1]);
        let at = Pose::at([0.0, 0.0, -0.1]);
        let plate = (
            body(&plate),
            Thing {
                parts: Vec::new(),
                outside: Vec::new(),
                at,
                kind: Kind::Fixed,
                friction: 0.5,
                bounce,
                robot: false,
            },
        );
        add(&mut world, &plate);
        let mut ball = loose(&Shape::Sphere(0.02), 0.01, Pose::up(0.5), 0.5);
        ball.1.bounce = bounce;
        let ball = add(&mut world, &ball);
        let (mut highest, mut hit): (f64, bool) = (0.0, false);
        for _ in 0..1200 {
            world.step();
            hit |= !world.touches(ball).is_empty();
            if hit && world.motion(ball).0[2] > 0.0 {
                highest = highest.max(world.pose(ball).position[2]);
            }
        }
        println!("bounce {bounce}: {highest:.4} m");
        assert!((highest - 0.5 * bounce * bounce).abs() < 0.01 * 0.5 + 1e-3, "{bounce}: {highest} m");
    }
}

#[test]
fn stacks_stand_and_press_with_what_is_above() {
    let mut world = World::new();
    world.floor(0.5);
    let block = Shape::Box([0.08, 0.08, 0.04]);
    let ids: Vec<Id> =
        (0..8).map(|k| add(&mut world, &loose(&block, 0.2, Pose::up(0.04 * f64::from(k)), 0.5))).collect();
    steps(&mut world, 1.0);
    for (k, id) in ids.iter().enumerate() {
        let below: f64 = world.touches(*id).iter().map(|t| t.press[2].max(0.0)).sum();
        let weight = 0.2 * GRAVITY * (8 - k) as f64;
        assert!((below / weight - 1.0).abs() < 0.01, "block {k} bears {below} N of {weight} N");
    }
    steps(&mut world, 9.0);
    let top = world.pose(ids[7]).position;
    println!("the top one after 10 s: {:.4} mm aside, {:.4} mm low", top[0].hypot(top[1]) * 1e3, (0.28 - top[2]) * 1e3);
    assert!(top[0].hypot(top[1]) < 1e-3 && (top[2] - 0.28).abs() < 2e-3, "{top:?}");
    assert!(world.is_asleep(), "it sleeps when nothing moves");
}

/// A hand that looks down, and its two fingers: blocks of a size that are so far open, m.
fn hand(world: &mut World, above: Pose, pad: [f64; 3], at: f64, friction: f64) -> (Id, [Finger; 2]) {
    let still =
        |at, kind| Thing { parts: Vec::new(), outside: Vec::new(), at, kind, friction, bounce: 0.0, robot: true };
    let hand = world.add(&still(above, Kind::Led));
    let inner = Pose::at([0.0, pad[1] / 2.0, 0.0]);
    let own = inertial(&Shape::Box(pad), 0.03);
    let pad = body(&Shape::Box(pad));
    let fingers = [0.0, std::f64::consts::PI].map(|about| {
        let origin = Pose::turned([0.0, 0.0, -0.1], [0.0, 0.0, about]);
        let kind = Kind::Loose(Inertial { placement: inner.then(own.placement), ..own });
        let pose = above.then(origin).then(Pose::at([0.0, at, 0.0]));
        let body = world.add(&Thing { parts: vec![(inner, &pad)], ..still(pose, kind) });
        Finger { body, origin, axis: [0.0, 1.0, 0.0], at, range: [0.0, 0.04] }
    });
    (hand, fingers)
}

/// A hand that looks down on a block of some width between its fingers, above nothing.
fn pinched(mass: f64, force: f64, friction: f64) -> (World, GripId, Id) {
    let mut world = World::new();
    let (hand, fingers) = hand(&mut world, Pose::up(0.3), [0.018, 0.01, 0.03], 0.025, friction);
    let block = Shape::Box([0.03, 0.04, 0.05]);
    let item = add(&mut world, &loose(&block, mass, Pose::up(0.19), 1.0));
    let grip = world.gripper(Grip { hand, fingers, force, speed: 0.2 }).expect("it has fingers");
    // Held from below until the fingers press.
    let table = Shape::Box([0.2, 0.2, 0.1]);
    let table = world.add(&Thing {
        parts: vec![(Pose::IDENTITY, &body(&table))],
        outside: Vec::new(),
        at: Pose::up(0.09),
        kind: Kind::Led,
        friction: 1.0,
        bounce: 0.0,
        robot: false,
    });
    let start = world.pose(item).position;
    world.close(grip, -0.03, 0.0);
    steps(&mut world, 0.3);
    assert!(far(world.pose(item).position, start) < 1e-3, "{:?}", world.pose(item));
    for k in 0..200 {
        world.lead(table, &Pose::up(0.09 - 0.0004 * f64::from(k)));
        world.step();
    }
    (world, grip, item)
}

#[test]
fn a_pinch_grip_bears_twice_friction_times_force() {
    for (force, friction) in [(10.0, 0.5), (70.0, 0.2), (30.0, 0.3), (140.0, 0.1)] {
        let most = 2.0 * friction * force / GRAVITY;
        let falls = |mass: f64| {
            let (mut world, grip, item) = pinched(mass, force, friction);
            let pinch = world.pinch(grip, item);
            let before = world.pose(item).position[2];
            steps(&mut world, 1.0);
            (before - world.pose(item).position[2], pinch)
        };
        let (held, pinch) = falls(most * 0.95);
        let (lost, _) = falls(most * 1.05);
        println!(
            "{force} N, {friction}: {most:.3} kg; held {:.4} mm, lost {:.1} mm, pressed {pinch:?}",
            held * 1e3,
            lost * 1e3
        );
        assert!(pinch.iter().all(|f| (f / force - 1.0).abs() < 0.01), "each finger presses {pinch:?} of {force}");
        assert!(held < 1e-3, "{force} N: 95 % of what it bears slips {held} m");
        assert!(lost > 0.02, "{force} N: 105 % of what it bears is held, {lost} m");
    }
}

#[test]
fn a_pendulum_keeps_its_period_and_its_energy() {
    let (length, mass) = (0.25, 0.1);
    let mut world = World::new();
    let post = Thing {
        parts: Vec::new(),
        outside: Vec::new(),
        at: Pose::up(1.0),
        kind: Kind::Fixed,
        friction: 0.5,
        bounce: 0.0,
        robot: false,
    };
    let post = world.add(&post);
    let rod = Shape::Box([0.01, 0.01, length]);
    let own = inertial(&rod, mass);
    // Its frame is in the middle of its lower end, the hinge at its upper end.
    let swing = 0.2;
    let hung = Pose::up(1.0).then(Pose::turned([0.0; 3], [swing, 0.0, 0.0])).then(Pose::up(-length));
    let kind = Kind::Loose(own);
    let rod = world.add(&Thing {
        parts: Vec::new(),
        outside: Vec::new(),
        at: hung,
        kind,
        friction: 0.5,
        bounce: 0.0,
        robot: false,
    });
    world.hinge([(post, Pose::IDENTITY), (rod, Pose::up(length))]);
    let middle = length - own.placement.position[2];
    let about = own.inertia[0] + mass * middle * middle;
    // The first two terms of the exact period for a swing of finite width.
    let period = std::f64::consts::TAU * (about / (mass * GRAVITY * middle)).sqrt() * (1.0 + swing * swing / 16.0);
    let least = mass * GRAVITY * (1.0 - middle);
    world.step();
    let energy = world.energy() - least;
    let (mut crossings, mut before) = (Vec::new(), world.pose(rod).position[1]);
    for step in 1..=60_000u32 {
        world.step();
        let now = world.pose(rod).position[1];
        if before < 0.0 && now >= 0.0 {
            crossings.push((f64::from(step) - now / (now - before)) * STEP);
        }
        before = now;
    }
    let mean = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    let drift = (world.energy() - least) / energy - 1.0;
    println!("period {mean:.5} s of {period:.5} s; energy after 60 s {:+.3} %", drift * 100.0);
    assert!((mean / period - 1.0).abs() < 0.002, "{mean} s, {period} s by the law");
    assert!(drift.abs() < 0.02, "{drift}");
}

/// Things that fall on a heap, and where all are after a while, to the last bit.
fn heap() -> World {
    let mut world = World::new();
    world.floor(0.4);
    for k in 0..12u32 {
        let at =
            Pose::turned([0.01 * f64::from(k % 3), 0.0, 0.05 + 0.06 * f64::from(k)], [0.1 * f64::from(k), 0.2, 0.3]);
        let shape = if k % 2 == 0 { Shape::Box([0.05, 0.04, 0.03]) } else { Shape::Cylinder([0.03, 0.05]) };
        add(&mut world, &loose(&shape, 0.05, at, 0.4));
    }
    world
}

fn bits(world: &World) -> Vec<u64> {
    let poses = (1..13).map(|k| world.pose(Id(k)));
    poses.flat_map(|p| p.position.into_iter().chain(p.rotation)).map(f64::to_bits).collect()
}

#[test]
fn the_same_world_goes_on_to_the_last_bit_also_from_the_middle() {
    let mut one = heap();
    steps(&mut one, 0.4);
    let mut copy = one.clone();
    steps(&mut one, 1.2);
    steps(&mut copy, 1.2);
    let mut again = heap();
    steps(&mut again, 1.6);
    assert!(bits(&one) == bits(&copy), "from a copy in the middle");
    assert!(bits(&one) == bits(&again), "from the beginning");
}

#[test]
fn friction_of_a_pair_stands_above_that_of_its_surfaces() {
    let held = |friction: Option<f64>| {
        let mut world = World::new();
        let slope = slope(&mut world, 0.3, 1.0);
        let block = add(&mut world, &loose(&Shape::Box([0.06, 0.06, 0.02]), 0.2, slope, 1.0));
        if let Some(friction) = friction {
            world.between(Id(0), block, friction);
        }
        steps(&mut world, 1.0);
        far(world.pose(block).position, slope.position)
    };
    assert!(held(None) < 1e-4);
    assert!(held(Some(0.1)) > 0.5);
}

/// A light vial that stands between the pads of a hand: how far it leans, rad, and moves, m, once they press, and with what.
fn pinched_vial(force: f64, friction: f64, turn: f64) -> (f64, f64, [f64; 2]) {
    let mut world = World::new();
    world.floor(0.5);
    let above = Pose::turned([0.0, 0.0, 0.14], [0.0, 0.0, turn]);
    let (hand, fingers) = hand(&mut world, above, [0.0175, 0.019, 0.031], 0.012, friction);
    let vial = Shape::Cylinder([0.017, 0.061]);
    let (form, felt) = (body(&vial), Body::outside([(&vial, Pose::IDENTITY)]).expect("it has a form"));
    let kind = Kind::Loose(inertial(&vial, 0.013));
    let at = Pose::at([0.0003, 0.0, 0.0]);
    let parts = vec![(Pose::IDENTITY, &form)];
    let outside = vec![(Pose::IDENTITY, &felt)];
    let item = world.add(&Thing { parts, outside, at, kind, friction: 0.4, bounce: 0.0, robot: false });
    let grip = Grip { hand, fingers, force, speed: 0.2 };
    let grip = world.gripper(grip).expect("it has fingers");
    let mut to = 0.012;
    for k in 0..1000u32 {
        to -= 0.05 * STEP;
        world.close(grip, f64::max(to, -0.03), -0.05);
        // It is lifted, led along and turned.
        let t = f64::from(k.max(400) - 400) * STEP;
        world.lead(hand, &Pose::turned([0.2 * t * t, 0.1 * t * t, 0.14 + 0.2 * t * t], [0.0, 0.0, turn + t * t]));
        world.step();
    }
    let seen = world.pose(hand).inverse().then(world.pose(item));
    let up = world.pose(item).then(Pose::up(1.0)).position[2] - world.pose(item).position[2];
    let before = above.inverse().then(at).position;
    (up.min(1.0).acos(), far(seen.position, before), world.pinch(grip, item))
}

#[test]
fn a_light_vial_stays_upright_between_strong_fingers() {
    let turns = [0.0, 0.3, std::f64::consts::FRAC_PI_4];
    for (force, turn) in [10.0, 40.0, 70.0].into_iter().flat_map(|force| turns.map(|turn| (force, turn))) {
        let (lean, moved, pinch) = pinched_vial(force, 0.8, turn);
        println!(
            "vial {force} N, {turn:.2} rad: leans {:.3} deg, moved {:.3} mm, pressed {pinch:.2?}",
            lean.to_degrees(),
            moved * 1e3
        );
        assert!(lean < 0.01 && moved < 4e-4, "{lean} rad, {moved} m");
    }
}

#[test]
fn a_turn_that_is_written_the_other_way_is_the_same_turn() {
    let (mut world, _, item) = pinched(0.2, 70.0, 0.5);
    let (hand, before) = (Id(0), world.pose(Id(0)).inverse().then(world.pose(item)));
    for k in 0..500u32 {
        let to = Pose::turned([0.0, 0.0, 0.3], [0.0, 0.0, 2e-3 * f64::from(k)]);
        // A turn and its negative are the same one.
        let sign = if k % 50 < 25 { 1.0 } else { -1.0 };
        world.lead(hand, &Pose { rotation: to.rotation.map(|r| r * sign), ..to });
        world.step();
    }
    let after = world.pose(hand).inverse().then(world.pose(item));
    assert!(far(after.position, before.position) < 1e-3, "{before:?} {after:?}");
    let [one, other] = [before, after].map(|pose| pose.point([0.1, 0.0, 0.0]));
    assert!(far(one, other) < 2e-3, "{before:?} {after:?}");
}

#[test]
fn fingers_that_let_go_come_to_rest_where_they_are_led() {
    let (mut world, grip, _) = pinched(0.2, 70.0, 0.5);
    let mut to = world.opened(grip);
    let mut widest = 0.0f64;
    for _ in 0..1000 {
        let next = f64::min(to + 0.2 * STEP, 0.035);
        world.close(grip, next, (next - to) / STEP);
        to = next;
        world.step();
        widest = widest.max(world.opened(grip));
    }
    assert!((world.opened(grip) - 0.035).abs() < 2e-4 && widest < 0.036, "{} {widest}", world.opened(grip));
    assert!(world.opening(grip).abs() < 1e-3, "{}", world.opening(grip));
}
