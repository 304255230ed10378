//! The frames that move, each reached from the one before by as little arithmetic as its axes allow.
//!
//! Where an axis follows another turning axis, frames are laid along the common normal (as Denavit and Hartenberg
//! did): a shift along two axes and a twist about one, which for right angles only renames axes.

use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

use crate::chain::{Move, Tree};
use crate::lanes::{Lanes, Row};
use crate::pose::{Pose, slid, turned};
use crate::vector::{Axes, Placed, Vector};

/// From the frame before to this one, ahead of its own motion.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Fixed in the world: axes and origin.
    Fixed([[f32; 3]; 4]),
    /// Along x, along z, then sine and cosine of the twist about x.
    Twist(f32, f32, Twist),
    /// Any: the new axes and origin in the old frame.
    Any([[f32; 3]; 4]),
}

#[derive(Clone, Copy, Debug)]
enum Twist {
    None,
    Quarter,
    Back,
    By(f32, f32),
}

/// A moving frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    parent: Option<usize>,
    step: Step,
    /// How it moves about or along its third axis.
    pub motion: Move,
    /// How far its origin can be from the anchor; metres.
    pub reach: f64,
    /// The origin of the first frame of its chain, in the world.
    pub anchor: Vector3<f64>,
}

/// Where a link is: fixed to a moving frame, or to the world.
#[derive(Clone, Debug)]
pub(crate) struct Seat {
    /// Index of the frame; `None` for the world.
    pub frame: Option<usize>,
    /// Relative to it.
    pub pose: Pose,
}

struct Raw {
    parent: Option<usize>,
    before: Pose,
    motion: Move,
}

/// The frames that `moved` variables move, and where all links sit; the other variables stay as in `rest`.
pub(crate) fn compile(tree: &Tree, base: &Pose, moved: &[usize], rest: &[f64]) -> (Vec<Frame>, Vec<Seat>) {
    let mut raw: Vec<Raw> = Vec::new();
    let mut seats = vec![Seat { frame: None, pose: *base }; tree.links];
    for knot in &tree.knots {
        let (frame, at) = (seats[knot.parent].frame, seats[knot.parent].pose * knot.before);
        seats[knot.child] = match &knot.motion {
            None => Seat { frame, pose: at },
            Some((motion, after)) => match moved.iter().position(|&m| m == motion.variable) {
                Some(variable) => {
                    raw.push(Raw { parent: frame, before: at, motion: Move { variable, ..*motion } });
                    Seat { frame: Some(raw.len() - 1), pose: *after }
                }
                None => {
                    let by = motion.multiplier * rest[motion.variable] + motion.offset;
                    let still = if motion.slides { slid(&at, by) } else { turned(&at, by) };
                    Seat { frame, pose: still * after }
                }
            },
        };
    }
    normalise(&raw, seats)
}

fn about_z(angle: f64) -> Pose {
    turned(&Pose::identity(), angle)
}

fn along_z(by: f64) -> Pose {
    slid(&Pose::identity(), by)
}

fn normalise(raw: &[Raw], mut seats: Vec<Seat>) -> (Vec<Frame>, Vec<Seat>) {
    let mut frames: Vec<Frame> = Vec::with_capacity(raw.len());
    // What was multiplied to the right of each frame to bring its x axis onto the common normal.
    let mut extra: Vec<Pose> = Vec::with_capacity(raw.len());
    for (index, r) in raw.iter().enumerate() {
        let follower = raw.iter().position(|o| o.parent == Some(index)).filter(|_| !r.motion.slides);
        let turn = follower.map_or(0.0, |f| normal(&raw[f].before));
        let before = r.parent.map_or(r.before, |p| extra[p].inverse() * r.before);
        let first = r
            .parent
            .filter(|&p| !raw[p].motion.slides)
            .is_some_and(|p| raw.iter().position(|o| o.parent == Some(p)) == Some(index));
        let mut motion = r.motion;
        let mut shift = 0.0;
        let step = match (r.parent, first && !r.motion.slides) {
            (None, _) => Step::Fixed(columns(&before)),
            (Some(_), false) => Step::Any(columns(&before)),
            (Some(_), true) => {
                let m = before.rotation.matrix();
                let (sine, cosine) = (-m[(1, 2)], m[(2, 2)]);
                let mut t = before.translation.vector;
                if sine.abs() > 1e-6 {
                    shift = t.y / sine;
                    t += Vector3::new(0.0, -sine, cosine) * shift;
                }
                // What is left of the rotation once the twist is undone is about z: it adds to the joint's own.
                let left = Rotation3::from_axis_angle(&Vector3::x_axis(), matterix_ir::math::atan2(sine, cosine))
                    .inverse()
                    * before.rotation;
                motion.offset += matterix_ir::math::atan2(left[(1, 0)], left[(0, 0)]);
                Step::Twist(t.x as f32, t.z as f32, twist(sine, cosine))
            }
        };
        if !motion.slides {
            motion.offset += turn;
        }
        let adjust = along_z(shift) * about_z(turn);
        let span = (before * Translation3::new(0.0, 0.0, shift)).translation.vector.norm();
        let reach = if motion.slides { f64::INFINITY } else { r.parent.map_or(0.0, |p| frames[p].reach + span) };
        let anchor = r.parent.map_or(before.translation.vector, |p| frames[p].anchor);
        extra.push(adjust);
        frames.push(Frame { parent: r.parent, step, motion, reach, anchor });
    }
    for seat in &mut seats {
        if let Some(frame) = seat.frame {
            seat.pose = extra[frame].inverse() * seat.pose;
        }
    }
    (frames, seats)
}

/// The angle about z at which x is along the common normal of this axis and the next one.
fn normal(next: &Pose) -> f64 {
    let m = next.rotation.matrix();
    let (x, y) = (m[(0, 2)], m[(1, 2)]);
    if x * x + y * y > 1e-12 {
        return matterix_ir::math::atan2(x, -y);
    }
    let t = next.translation.vector;
    if t.x * t.x + t.y * t.y > 1e-18 { matterix_ir::math::atan2(t.y, t.x) } else { 0.0 }
}

fn twist(sine: f64, cosine: f64) -> Twist {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    if near(sine, 0.0) && near(cosine, 1.0) {
        Twist::None
    } else if near(cosine, 0.0) && near(sine, 1.0) {
        Twist::Quarter
    } else if near(cosine, 0.0) && near(sine, -1.0) {
        Twist::Back
    } else {
        Twist::By(sine as f32, cosine as f32)
    }
}

fn columns(pose: &Pose) -> [[f32; 3]; 4] {
    let m: &Matrix3<f64> = pose.rotation.matrix();
    let t = pose.translation.vector;
    let single = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
    [single(m.column(0).into()), single(m.column(1).into()), single(m.column(2).into()), single(t)]
}

/// Places all frames; `motion` holds two rows for each: sine and cosine, or the way along the axis and nothing.
#[inline(always)]
pub(crate) fn place<L: Lanes>(frames: &[Frame], motion: &[[Row; 2]], placed: &mut [Placed]) {
    for (index, (frame, [first, second])) in frames.iter().zip(motion).enumerate() {
        let (before, rest) = placed.split_at_mut(index);
        let Some(out) = rest.first_mut() else { return };
        let from = frame.parent.and_then(|p| before.get(p));
        match (&frame.step, from) {
            (Step::Twist(along_x, along_z, twist), Some(p)) => {
                let (x, y, z) = (Vector::<L>::load(&p[0]), Vector::<L>::load(&p[1]), Vector::<L>::load(&p[2]));
                let at = z.scaled_plus(L::splat(*along_z), Vector::load(&p[3]));
                x.scaled_plus(L::splat(*along_x), at).store(&mut out[3]);
                match *twist {
                    Twist::None => moved(x, y, z, first, second, out),
                    Twist::Quarter => moved(x, z, y.opposite(), first, second, out),
                    Twist::Back => moved(x, z.opposite(), y, first, second, out),
                    Twist::By(sine, cosine) => {
                        let (s, c) = (L::splat(sine), L::splat(cosine));
                        let (y, z) = (y.scaled_plus(c, z.scaled(s)), z.scaled_plus(c, y.scaled(-s)));
                        moved(x, y, z, first, second, out);
                    }
                }
            }
            (Step::Any(m), Some(p)) => {
                let axes = Axes::<L>::load(p);
                let (x, y, z) = (axes.vector(m[0]), axes.vector(m[1]), axes.vector(m[2]));
                let at = axes.point(m[3]);
                if frame.motion.slides {
                    z.scaled_plus(L::load(first), at).store(&mut out[3]);
                    still(x, y, z, out);
                } else {
                    at.store(&mut out[3]);
                    moved(x, y, z, first, second, out);
                }
            }
            (Step::Fixed(m), _) | (Step::Any(m), None) => {
                let (x, y, z) = (Vector::<L>::splat(m[0]), Vector::<L>::splat(m[1]), Vector::<L>::splat(m[2]));
                if frame.motion.slides {
                    z.scaled_plus(L::load(first), Vector::splat(m[3])).store(&mut out[3]);
                    still(x, y, z, out);
                } else {
                    Vector::<L>::splat(m[3]).store(&mut out[3]);
                    moved(x, y, z, first, second, out);
                }
            }
            (Step::Twist(..), None) => {}
        }
    }
}

/// Stores axes turned about the third one.
#[inline(always)]
fn moved<L: Lanes>(x: Vector<L>, y: Vector<L>, z: Vector<L>, sine: &Row, cosine: &Row, out: &mut Placed) {
    let (s, c) = (L::load(sine), L::load(cosine));
    x.scaled_plus(c, y.scaled(s)).store(&mut out[0]);
    y.scaled_plus(c, x.scaled(-s)).store(&mut out[1]);
    z.store(&mut out[2]);
}

#[inline(always)]
fn still<L: Lanes>(x: Vector<L>, y: Vector<L>, z: Vector<L>, out: &mut Placed) {
    x.store(&mut out[0]);
    y.store(&mut out[1]);
    z.store(&mut out[2]);
}
