//! How fast worlds of several sizes go on: real time for a second in which all of it moves, and what they cost asleep.

#![allow(clippy::disallowed_methods, reason = "benches look at the clock")]

use std::time::Instant;

use matterix_contact::{Id, Kind, STEP, Thing, World};
use matterix_ir::inertia::of_shapes;
use matterix_ir::pose::Pose;
use matterix_ir::scene::Shape;
use matterix_solids::Body;

/// A beaker of 250 mL.
fn beaker() -> Shape {
    let (r, h, wall) = (0.035, 0.095, 0.002);
    Shape::Turned {
        outside: vec![[0.0, 0.0], [r, 0.0], [r, h]],
        inside: vec![[0.0, wall], [r - wall, wall], [r - wall, h]],
    }
}

/// So many beakers and boxes in a square, each a little above the floor.
fn world(count: u32) -> (World, Vec<Id>) {
    let shapes = [beaker(), Shape::Box([0.06, 0.04, 0.03])];
    let bodies = shapes.each_ref().map(|shape| Body::of_shapes([(shape, Pose::IDENTITY)]).expect("it has a form"));
    let inertials = shapes.each_ref().map(|shape| of_shapes(0.1, [(shape, Pose::IDENTITY)]).expect("it has a form"));
    let mut world = World::new();
    world.floor(0.4);
    let side = f64::from(count).sqrt().ceil() as u32;
    let ids = (0..count).map(|k| {
        let kind = (k % 2) as usize;
        let at = Pose::at([0.1 * f64::from(k % side), 0.1 * f64::from(k / side), 0.002]);
        let parts = vec![(Pose::IDENTITY, &bodies[kind])];
        let kind = Kind::Loose(inertials[kind]);
        world.add(&Thing { parts, outside: Vec::new(), at, kind, friction: 0.4, bounce: 0.0, robot: false })
    });
    let ids = ids.collect();
    (world, ids)
}

fn main() {
    let only: Vec<u32> = std::env::args().skip(1).filter_map(|arg| arg.parse().ok()).collect();
    let sizes = if only.is_empty() { vec![5, 20, 80] } else { only };
    println!("things  s of world for a s of clock, all moving  the same, asleep");
    let mut before: Option<(u32, f64)> = None;
    for count in sizes {
        let mut best = [f64::INFINITY; 2];
        for _ in 0..3 {
            let (mut world, ids) = world(count);
            let begun = Instant::now();
            for step in 0..500u32 {
                // Pushed again and again, so that none falls asleep.
                if step % 100 == 0 {
                    ids.iter().for_each(|id| world.throw(*id, [0.05, 0.0, 0.0], [0.0; 3]));
                }
                world.step();
            }
            best[0] = best[0].min(begun.elapsed().as_secs_f64());
            for _ in 0..3000 {
                world.step();
            }
            assert!(world.is_asleep(), "it has come to rest");
            let begun = Instant::now();
            (0..500).for_each(|_| world.step());
            best[1] = best[1].min(begun.elapsed().as_secs_f64());
        }
        let of = |seconds: f64| 500.0 * STEP / seconds;
        let grows = before.map(|(less, time)| (best[0] / time).ln() / (f64::from(count) / f64::from(less)).ln());
        let grows = grows.map_or(String::new(), |exponent| format!("  grows with the power {exponent:.2}"));
        println!("{count:6}  {:8.1}  {:8.1}{grows}", of(best[0]), of(best[1]));
        before = Some((count, best[0]));
    }
}
