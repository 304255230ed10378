//! A referee is asked where balls leave no way, and nowhere else.

#[allow(dead_code)]
#[path = "../benches/mbm/problems.rs"]
mod problems;

use std::cell::Cell;

use matterix_motion::plan::{End, Failure, Settings, plan};
use matterix_motion::spheres::{Checker, Contact, Figure, Other, Referee};
use matterix_motion::world::{Body, Shape, World};
use matterix_motion::{Pose, Tree};
use nalgebra::Point3;
use problems::robot;

/// Finds a contact everywhere or nowhere, and counts how often it is asked.
#[derive(Debug)]
struct Fixed {
    free: bool,
    asked: Cell<usize>,
}

impl Referee for Fixed {
    fn contacts(&self, _: &[f64]) -> Vec<Contact> {
        self.asked.set(self.asked.get() + 1);
        let contact = Contact { link: 3, other: Other::Body(0), point: Point3::origin(), depth: 0.5 };
        if self.free { Vec::new() } else { vec![contact] }
    }

    fn resolution(&self) -> f64 {
        50.0
    }
}

fn figure() -> Figure {
    let robot = robot("panda");
    let count = Tree::new(&robot).expect("a tree").variables().len();
    let moved: Vec<usize> = (0..count).collect();
    Figure::new(&robot, &Pose::identity(), &moved, &vec![0.0; count], &[]).expect("a figure")
}

const START: [f64; 7] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];
const GOAL: [f64; 7] = [0.5, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];

/// A ball about where the hand ends up; none, where it is small.
fn world(radius: f64) -> World {
    let at = figure().poses(&GOAL)[8].translation.vector;
    World {
        bodies: vec![Body {
            name: "ball".into(),
            pose: Pose::translation(at.x, at.y, at.z),
            shape: Shape::Sphere(radius),
        }],
        ..World::default()
    }
}

#[test]
fn where_balls_find_a_way_no_referee_is_asked() {
    let (figure, world, referee) = (figure(), World::default(), Fixed { free: false, asked: Cell::new(0) });
    let mut checker = Checker::new(&figure, &world, 32.0).overruled_by(&referee);
    plan(&mut checker, &START, &GOAL, &Settings::default()).expect("a way");
    assert_eq!(referee.asked.get(), 0);
}

#[test]
fn where_balls_collide_the_referee_decides() {
    let (figure, world) = (figure(), world(0.1));
    for free in [true, false] {
        let referee = Fixed { free, asked: Cell::new(0) };
        let mut checker = Checker::new(&figure, &world, 32.0).overruled_by(&referee);
        let found = plan(&mut checker, &START, &GOAL, &Settings::default());
        assert!(referee.asked.get() > 0);
        match found {
            Ok(route) => assert!(free && route.points.len() >= 2),
            // What it says is what is told.
            Err(Failure::Collision(End::Goal | End::Start, contacts)) => assert!(!free && contacts[0].depth == 0.5),
            Err(other) => panic!("{other:?}"),
        }
    }
    let mut checker = Checker::new(&figure, &world, 32.0);
    let alone = plan(&mut checker, &START, &GOAL, &Settings::default());
    assert!(matches!(alone, Err(Failure::Collision(..))), "{alone:?}");
}
