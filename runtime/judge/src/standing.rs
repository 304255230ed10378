//! What is in something else where a run begins.

use matterix_ir::bodies::Standing;
use matterix_solids::{Body, Isometry, Vector};

use crate::kinematics::moved_by;
use crate::trajectory::Trajectory;
use crate::{NOMINAL, Wrong};

/// What is thinner than this is none, m: round walls are prisms.
const THIN: f64 = 3e-4;

/// A body, where it is, and the box around it.
type Piece<'f> = (&'f Body, Isometry, [[f64; 3]; 2]);

/// Pairs of things with places of their own that are in each other by more than shapes are nominal. What moves of robots is
/// followed with them.
pub(crate) fn judge(film: &Trajectory) -> Vec<Wrong> {
    let mut all: Vec<(&Standing, Vec<Piece<'_>>)> = Vec::new();
    all.extend(film.standing.iter().map(|standing| (standing, pieces(film, &standing.name))));
    let by = |standing: &Standing| {
        let own = film.things.iter().filter(|thing| thing.whole == standing.name);
        NOMINAL / 2.0 + own.map(|thing| thing.coarse).fold(0.0, f64::max)
    };
    let mut met: Vec<(usize, usize, Wrong)> = Vec::new();
    for (i, (one, mine)) in all.iter().enumerate() {
        for (k, (other, theirs)) in all.iter().enumerate().take(i) {
            if !may_stand_in(one, other)
                && let Some((depth, at)) =
                    deepest(mine, theirs, [0.0; 3]).filter(|_| !only_touch(mine, theirs, by(one) + by(other)))
            {
                let (mine, other) = (one.name.clone(), other.name.clone());
                met.push((i, k, Wrong::Meets { mine, other, depth, at, time: 0.0 }));
            }
        }
    }
    let pairs: Vec<(usize, usize)> = met.iter().map(|(i, k, _)| (*i, *k)).collect();
    let on = |i: usize, k: usize| i == k || is_on(all[i].0, all[k].0);
    // What stands on something goes where that goes.
    met.retain(|(i, k, _)| {
        let causes = |(a, b): &(usize, usize)| (on(*i, *a) && on(*k, *b)) || (on(*i, *b) && on(*k, *a));
        !pairs.iter().any(|pair| *pair != (*i, *k) && causes(pair))
    });
    met.into_iter().map(|(.., wrong)| wrong).collect()
}

/// What does not move by itself of a thing and of its parts, where the run begins.
fn pieces<'f>(film: &'f Trajectory, name: &str) -> Vec<Piece<'f>> {
    let placed = |(body, at): (&'f Body, Isometry)| (body, at, body.bounds(&at));
    let things = film.things.iter().filter(|thing| thing.whole == name);
    let mut out: Vec<Piece<'f>> =
        things.filter_map(|thing| Some((thing.body.as_ref()?, thing.first()?.1))).map(placed).collect();
    for robot in film.robots.iter().filter(|robot| robot.name == name) {
        let Some(first) = robot.samples.first() else { continue };
        let still = moved_by(&robot.machine.robot).into_iter().map(|joint| joint.is_none());
        let links = robot.bodies.iter().zip(&first.links).zip(still);
        out.extend(
            links.filter(|(_, still)| *still).filter_map(|((body, at), _)| Some((body.as_ref()?, *at))).map(placed),
        );
    }
    out
}

/// Whether a name is that of a thing or of a part of it.
fn is_of(name: &str, thing: &str) -> bool {
    name.strip_prefix(thing).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

fn is_on(one: &Standing, below: &Standing) -> bool {
    one.carriers.iter().any(|carrier| is_of(carrier, &below.name))
}

/// Whether two may share a place: one carries the other, one is somewhere beside the other, or both are furniture of the lab.
fn may_stand_in(a: &Standing, b: &Standing) -> bool {
    let beside = a.carriers.first() == b.carriers.first();
    let furniture = beside && a.carriers.is_empty() && !a.loose && !b.loose;
    is_on(a, b) || is_on(b, a) || furniture || beside && !(a.told && b.told)
}

/// Whether a shift by so much, m, along any of the axes parts them.
fn only_touch(mine: &[Piece<'_>], theirs: &[Piece<'_>], by: f64) -> bool {
    let far = [0.0, by, -by];
    let all = (0..27).map(|k| [far[k % 3], far[k / 3 % 3], far[k / 9]]);
    all.into_iter().any(|shift| deepest(mine, theirs, shift).is_none())
}

/// How deep bodies of one thing, shifted, are in those of another one at most, m, and where.
fn deepest(mine: &[Piece<'_>], theirs: &[Piece<'_>], shift: [f64; 3]) -> Option<(f64, [f64; 3])> {
    let by = Isometry::from_translation(Vector::from(shift));
    let near = |a: &[[f64; 3]; 2], b: &[[f64; 3]; 2]| {
        (0..3).all(|k| a[0][k] + shift[k] < b[1][k] && b[0][k] < a[1][k] + shift[k])
    };
    let mut out: Option<(f64, [f64; 3])> = None;
    for (body, at, around) in mine {
        for (other, other_at, _) in theirs.iter().filter(|(.., box_of_theirs)| near(around, box_of_theirs)) {
            let Some(touch) = body.touch(&(by * *at), other, other_at, 0.0) else { continue };
            if -touch.distance > THIN && out.is_none_or(|(depth, _)| -touch.distance > depth) {
                out = Some((-touch.distance, touch.point));
            }
        }
    }
    out
}
