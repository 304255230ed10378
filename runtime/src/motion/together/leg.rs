//! One motion of a robot as the room it sweeps.

use matterix_ir::Span;
use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_motion::meet::{self, Gap, Mover};
use matterix_motion::spheres::Placed;

use crate::motion::performed::Performed;
use crate::motion::stage::Stage;

/// Distance of the places at which a sweep is looked at, m.
const PACE: f64 = 0.03;

/// A motion that some line of a plan carries out.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The robot.
    pub robot: InstanceId,
    /// The operation.
    pub step: StepId,
    /// The innermost statement of the user's own that leads to it.
    pub site: Span,
    /// Whether it has one way only.
    pub straight: bool,
    /// What the line has claimed meanwhile.
    pub claims: Vec<InstanceId>,
    names: Vec<String>,
    /// The robot and what it holds, from the beginning to the end.
    sweep: Vec<Vec<Placed>>,
    /// Least and greatest coordinates of all of it, m.
    bounds: [[f64; 3]; 2],
}

impl Leg {
    /// A motion that has just been carried out; nothing where the robot itself did not move.
    pub fn of(
        stage: &Stage<'_>,
        performed: &Performed,
        (step, site): (StepId, Span),
        straight: bool,
        claims: Vec<InstanceId>,
    ) -> Option<Self> {
        let robot = performed.robot;
        let actor = stage.actors.get(&robot)?;
        let joints = performed.moved(actor);
        if joints.is_empty() {
            return None;
        }
        let figure = stage.figure(robot, actor, &joints).ok()?;
        let at = |t: f64| performed.at(&joints, t).unwrap_or_default();
        let duration = performed.duration();
        let way = meet::speed(&Mover { figure: &figure, at: &at }, 0.0, duration) * duration;
        let steps = (way / PACE).ceil().clamp(1.0, 1e3) as u32;
        let moment = |step: u32| figure.placed(&at(duration * f64::from(step) / f64::from(steps)));
        let sweep: Vec<Vec<Placed>> = (0..=steps).map(moment).collect();
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (middle, radius) in sweep.iter().flatten().map(|p| p.cover) {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(middle[k] - radius);
                bounds[1][k] = bounds[1][k].max(middle[k] + radius);
            }
        }
        let names = (0..).map_while(|l| Some(figure.name(l)).filter(|n| !n.is_empty()).map(str::to_string)).collect();
        Some(Leg { robot, step, site, straight, claims, names, sweep, bounds })
    }

    /// Where the robot is when it begins.
    pub fn begin(&self) -> &[Placed] {
        self.sweep.first().map_or(&[], Vec::as_slice)
    }

    /// Where the robot is when it has ended.
    pub fn end(&self) -> &[Placed] {
        self.sweep.last().map_or(&[], Vec::as_slice)
    }

    /// What a link, or what it holds, is called.
    pub fn name(&self, link: u32) -> &str {
        self.names.get(link as usize).map_or("", String::as_str)
    }

    /// Where it first reaches deeper than this, m, into a robot that stands still.
    pub fn meets(&self, standing: &[Placed], deep: f64) -> Option<Gap> {
        self.sweep.iter().find_map(|moment| overlap(moment, standing, deep))
    }

    /// Where the room that two motions sweep first overlaps deeper than this, m.
    pub fn crosses(&self, other: &Leg, deep: f64) -> Option<Gap> {
        let apart = |k: usize| self.bounds[0][k] > other.bounds[1][k] || other.bounds[0][k] > self.bounds[1][k];
        if (0..3).any(apart) {
            return None;
        }
        other.sweep.iter().find_map(|standing| self.meets(standing, deep))
    }
}

/// How two robots that stand still reach into each other, if deeper than this, m.
pub fn overlap(a: &[Placed], b: &[Placed], deep: f64) -> Option<Gap> {
    meet::gap(a, b, -deep, &|_, _| true)
}
