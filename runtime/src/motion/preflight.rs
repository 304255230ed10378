//! Follows the motions of a plan before anything moves: what is out of reach, what collides, what cannot be gripped.
//!
//! Steps are followed in the order they are written, branches one after the other from the state before them, loops
//! twice; where a condition decides, both ways are followed and the state after the first is kept. A motion that cannot
//! be carried out is reported once, and the robot counts as where it was.

use std::collections::BTreeSet;

use matterix_ir::model::{Action, Domain};
use matterix_ir::plan::{Motion, Operation, Step, StepId};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand};
use matterix_ir::{Diagnostic, NodeId, Op, Program, Span, codes};
use matterix_motion::inverse::{Request, Solver};
use matterix_motion::pose::pose;

use super::perform::Refused;
use super::stage::{Carried, Stage};

/// How many motions are followed before a plan counts as too long to be looked at whole.
const MOST: usize = 2000;

/// What would go wrong with the motions of a program. Empty for labs without robots that have joints.
pub fn preflight(program: &Program) -> Vec<Diagnostic> {
    let Ok(stage) = Stage::new(&program.scene) else { return Vec::new() };
    if stage.actors.is_empty() {
        return Vec::new();
    }
    let mut walk =
        Walk { program, stage, found: Vec::new(), told: BTreeSet::new(), site: Vec::new(), lost: false, left: MOST };
    walk.step(program.plan.root);
    walk.found
}

struct Walk<'p> {
    program: &'p Program,
    stage: Stage<'p>,
    found: Vec<Diagnostic>,
    /// Statements of the user that have been reported.
    told: BTreeSet<Span>,
    /// The statements of the user's file that are being followed, the innermost last.
    site: Vec<Span>,
    /// What is being followed cannot be done: its other motions are passed over.
    lost: bool,
    left: usize,
}

impl<'p> Walk<'p> {
    fn step(&mut self, id: StepId) {
        if self.left == 0 {
            return;
        }
        let at = self.program.plan.get(id);
        // The innermost statement of the user's own text is where a mistake is said.
        if self.is_own(at.span) && !self.lost {
            let before = self.stage.clone();
            self.site.push(at.span);
            self.inside(id);
            self.site.pop();
            // What failed in part counts as done where things stand, and robots as where they were before.
            if self.lost
                && self
                    .program
                    .plan
                    .get(id)
                    .step
                    .children()
                    .iter()
                    .all(|c| !self.is_own(self.program.plan.get(*c).span))
            {
                self.lost = false;
                let after = std::mem::replace(&mut self.stage, before);
                self.recover(&after);
            }
            return;
        }
        self.inside(id);
    }

    /// Things are put where their states say, as far as that is not where they were.
    fn recover(&mut self, after: &Stage<'p>) {
        for (index, carried) in after.carried.iter().enumerate() {
            let carrier = match carried {
                Carried::Stands(Stand::On(below, _)) | Carried::Held(below, _) => *below,
                Carried::Stands(_) => continue,
            };
            self.stage.follow(InstanceId(index as u32), Some(carrier));
        }
    }

    /// Whether a place is in the user's own files.
    fn is_own(&self, span: Span) -> bool {
        self.program.files.get(span.file.0 as usize).is_some_and(|name| !name.starts_with("std::"))
    }

    fn inside(&mut self, id: StepId) {
        let at = self.program.plan.get(id);
        match &at.step {
            Step::Operation(operation) => self.operation(operation, at.span),
            Step::If { then, otherwise, .. } => {
                let before = self.stage.clone();
                self.step(*then);
                if let Some(otherwise) = otherwise {
                    let after = std::mem::replace(&mut self.stage, before);
                    self.step(*otherwise);
                    self.stage = after;
                }
            }
            Step::Try(all) => {
                let mut after = None;
                for one in all {
                    let before = self.stage.clone();
                    self.step(*one);
                    after.get_or_insert_with(|| self.stage.clone());
                    self.stage = before;
                }
                self.stage = after.unwrap_or_else(|| self.stage.clone());
            }
            Step::Guarded { body, handlers, finally } => {
                let before = self.stage.clone();
                self.step(*body);
                // Handlers begin somewhere in the body; what they do is followed from its beginning.
                let after = std::mem::replace(&mut self.stage, before);
                for (_, handler) in handlers {
                    let before = self.stage.clone();
                    self.step(*handler);
                    self.stage = before;
                }
                self.stage = after;
                finally.iter().for_each(|f| self.step(*f));
            }
            Step::Repeat { body, .. } | Step::RepeatWhile { body, .. } => {
                self.step(*body);
                self.step(*body);
            }
            other => other.children().into_iter().for_each(|child| self.step(child)),
        }
    }

    fn operation(&mut self, operation: &Operation, span: Span) {
        if let Some(motion) = &operation.motion {
            self.left -= 1;
            if !self.lost
                && let Err(refused) = self.motion(motion)
            {
                self.lost = true;
                let site = self.site.last().copied().unwrap_or(span);
                if self.told.insert(site) {
                    let found = self.finding(motion, &refused, site);
                    self.found
                        .extend(found.map(|d| if site == span { d } else { d.because(span, "on this step of it") }));
                }
            }
        }
        for action in operation.at_start.iter().chain(&operation.at_end) {
            let Action::Assign { state, value, .. } = action else { continue };
            let Some(state) = self.program.model.states.get(*state as usize) else { continue };
            let Some(value) = self.program.model.graph.constant(*value) else { continue };
            if let Some(id) = supported(&self.program.scene, &state.name, &state.domain) {
                self.stage.follow(id, (value >= 0.0).then_some(InstanceId(value as u32)));
            }
        }
    }

    fn motion(&mut self, motion: &Motion) -> Result<(), Refused> {
        let known = motion.values().into_iter().map(|node| self.known(node));
        // What only a run can tell is left to the run.
        let Some(values) = known.collect::<Option<Vec<f64>>>() else { return Ok(()) };
        self.stage.perform(motion, &values).map(|_| ())
    }

    /// The value of a node that depends on nothing but parameters.
    fn known(&self, node: NodeId) -> Option<f64> {
        let model = &self.program.model;
        let live = |op: &Op| matches!(op, Op::State(_) | Op::Time | Op::Reading(_) | Op::Local(_));
        if model.graph.depends(node, live) {
            return None;
        }
        let value = model.graph.eval_on(node, |leaf| match leaf {
            Op::Const(value) => value,
            Op::Param(index) => model.params.get(index as usize).map_or(f64::NAN, |p| p.value),
            _ => f64::NAN,
        });
        value.is_finite().then_some(value)
    }

    fn finding(&self, motion: &Motion, refused: &Refused, span: Span) -> Option<Diagnostic> {
        let scene = &self.program.scene;
        let name = &scene.get(motion.mover()).name;
        let goal = motion.goal().map(|(goal, _)| goal);
        let to = goal.map_or("there".to_string(), |g| format!("`{}`", scene.get(g).name));
        let found = match refused {
            Refused::OutOfReach(far, _) => {
                let headline = format!("`{name}` does not reach {to}");
                let label = match far * 1e3 {
                    mm if mm >= 1.0 => format!("its gripper stays {mm:.0} mm away"),
                    _ => "it gets there, but not turned like this".to_string(),
                };
                let found = Diagnostic::error(codes::OUT_OF_REACH, span, headline, label);
                match motion.goal().and_then(|(goal, frame)| self.nearer(motion.mover(), goal, frame)) {
                    Some(help) => found.help(help),
                    None => found,
                }
            }
            Refused::Collides(meeting) => {
                let [x, y, z] = meeting.at.map(|v| v * 1e3);
                let headline = format!("`{name}` runs into `{}` on its way to {to}", meeting.other);
                let label = format!(
                    "`{}` meets it at ({x:.0}, {y:.0}, {z:.0}) mm, {:.0} mm deep",
                    meeting.mine,
                    (meeting.depth * 1e3).max(1.0)
                );
                let found = Diagnostic::error(codes::COLLISION, span, headline, label);
                match meeting.with {
                    Some(with) => found.because(scene.get(with).span, format!("`{}` stands here", meeting.other)),
                    None => found,
                }
            }
            Refused::NoWay => Diagnostic::error(
                codes::COLLISION,
                span,
                format!("no way was found for `{name}` to {to}"),
                "nothing is in the way at its end, but between",
            ),
            Refused::Misplaced(far, _) => {
                let (Motion::Grip { item, .. } | Motion::Free { item, .. }) = motion else { return None };
                let item = &scene.get(*item).name;
                let headline = format!("`{name}` is not at `{item}`: {:.0} mm are between them", far * 1e3);
                Diagnostic::error(codes::MISPLACED_GRIP, span, headline, "too far to grip or let go")
            }
            Refused::TooWide(width, opening) => {
                let Motion::Grip { item, .. } = motion else { return None };
                let headline = format!("`{name}` does not open wide enough for `{}`", scene.get(*item).name);
                let label = format!("it is {:.0} mm wide, and the fingers open {:.0} mm", width * 1e3, opening * 1e3);
                Diagnostic::error(codes::TOO_WIDE, span, headline, label)
            }
            Refused::Tilted(by) => {
                let headline = format!("what `{name}` holds tilts on its way to {to}");
                let label = format!("by {:.0} deg at one end of it, more than it may", by.to_degrees());
                Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
            }
            Refused::Joints(given, there) => {
                let headline = format!("{given} positions for the {there} joints of `{name}`");
                Diagnostic::error(codes::WRONG_ARGUMENTS, span, headline, "not one for each")
            }
            Refused::Beyond(joint) => {
                let headline = format!("`{joint}` of `{name}` does not get to this position");
                Diagnostic::error(codes::OUT_OF_REACH, span, headline, "outside of its limits")
            }
            Refused::NoRobot | Refused::NoFrame | Refused::NotHeld => return None,
        };
        Some(match goal.filter(|g| scene.get(*g).span != span) {
            Some(goal) => found.because(scene.get(goal).span, format!("`{}` stands here", scene.get(goal).name)),
            None => found,
        })
    }

    /// Where a thing out of reach could be reached: the nearest place on the line to the robot.
    fn nearer(&self, robot: InstanceId, goal: InstanceId, frame: &str) -> Option<String> {
        let robot = self.stage.actor_of(robot)?;
        let targets = super::goal::targets(&self.stage, robot, goal, frame);
        let base = self.stage.pose(robot);
        let actor = self.stage.actors.get(&robot)?;
        let mut solver = Solver::new(actor.chain.clone());
        let now = actor.configuration();
        for share in (1..20).map(|k| f64::from(k) * 0.05) {
            for target in &targets {
                let mut at = *target;
                (0..2).for_each(|k| at.position[k] += share * (base.position[k] - at.position[k]));
                let request = Request { attempts: 20, ..Request::new(pose(&base.inverse().then(at)), &now) };
                if solver.solve(&request).is_ok() {
                    let moved: Vec<f64> = (0..2).map(|k| (at.position[k] - target.position[k]) * 1e3).collect();
                    let name = &self.program.scene.get(goal).name;
                    return Some(format!(
                        "`{name}` is within reach if it stands ({:.0}, {:.0}) mm from there",
                        moved[0], moved[1]
                    ));
                }
            }
        }
        None
    }
}

/// The instance of which a state says what it stands on.
pub fn supported(scene: &matterix_ir::scene::Scene, state: &str, domain: &Domain) -> Option<InstanceId> {
    let owner = state.strip_suffix(".support").filter(|_| *domain == Domain::Instance)?;
    scene.find(owner)
}

impl Stage<'_> {
    /// Something else carries a thing from now on, as a state of the model says. Where that is not so already, the thing
    /// comes to its new place at once.
    pub fn follow(&mut self, id: InstanceId, by: Option<InstanceId>) {
        let carrier = by.map(|by| self.actor_of(by).unwrap_or(by));
        if self.below(id) == carrier || self.below(id) == by {
            return;
        }
        match by.filter(|by| self.actor_of(*by).is_none()) {
            Some(on) => self.put(id, on, Pose::IDENTITY),
            None => self.carry(id, by),
        }
    }
}
