//! A world of bodies that goes on in even steps.

use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_solids::{isometry, pose};
use rapier3d_f64::prelude::{
    ActiveHooks, BroadPhaseBvh, CCDSolver, CoefficientCombineRule, ColliderBuilder, ColliderHandle, ColliderSet,
    FrictionModel, GenericJointBuilder, Group, ImpulseJointSet, IntegrationParameters, InteractionGroups,
    InteractionTestMode, IslandManager, JointAxesMask, MultibodyJointSet, NarrowPhase, PhysicsPipeline,
    RigidBodyBuilder, RigidBodyHandle, RigidBodySet, SharedShape, SoftBodySet, SpringCoefficients, Vector,
};

use crate::facets::{fine, inset};
use crate::friction::Pairs;
use crate::grip::Joined;
use crate::thing::{Id, Kind, Thing, mass};

/// The length of a step, s.
pub const STEP: f64 = 1e-3;
/// Standard gravity, m/s2.
pub const GRAVITY: f64 = 9.80665;

/// What is told apart where it is asked what touches what: things, robots, and things as robots feel them.
const THINGS: Group = Group::GROUP_1;
const ROBOTS: Group = Group::GROUP_2;
const FELT: Group = Group::GROUP_3;

/// The size of what is in a lab, by which the engine takes its margins, m.
const UNIT: f64 = 0.1;
/// How often forces are solved in a step.
const ROUNDS: usize = 8;
/// How stiff touch is, and touch of what does not move: frequency, Hz, and damping ratio.
const TOUCH: (f64, f64) = (1000.0, 8.0);
const STAND: (f64, f64) = (1000.0, 10.0);
/// What moves slower than this for half a second falls asleep, m/s.
const STILL: f64 = 1e-3;
/// Bodies are made of a core and a skin of this thickness, m. What rests has its skins in touch and its cores apart, where distances are exact: of faces that
/// lie in each other's plane the engine may not find which way is out.
const SKIN: f64 = 1e-5;
/// How near bodies are when it is looked for touch, m.
const NEAR: f64 = 2e-3;

/// Bodies, where they are and how they move. A clone goes on as it does, to the last bit.
#[derive(Clone)]
pub struct World {
    parameters: IntegrationParameters,
    pipeline: Pipeline,
    islands: IslandManager,
    broad: BroadPhaseBvh,
    pub(crate) narrow: NarrowPhase,
    pub(crate) bodies: RigidBodySet,
    pub(crate) colliders: ColliderSet,
    pub(crate) joints: ImpulseJointSet,
    multibodies: MultibodyJointSet,
    soft: SoftBodySet,
    fast: CCDSolver,
    handles: Vec<(RigidBodyHandle, Vec<ColliderHandle>)>,
    pairs: Pairs,
    pub(crate) grips: Vec<Joined>,
    steps: u64,
}

/// Room that the engine works in; nothing in it is carried from step to step.
struct Pipeline(PhysicsPipeline);

impl Clone for Pipeline {
    fn clone(&self) -> Self {
        Pipeline(PhysicsPipeline::new())
    }
}

impl Default for World {
    fn default() -> Self {
        World::new()
    }
}

impl World {
    /// Nothing yet.
    pub fn new() -> Self {
        let soft = |(natural_frequency, damping_ratio)| SpringCoefficients { natural_frequency, damping_ratio };
        let parameters = IntegrationParameters {
            dt: STEP,
            length_unit: UNIT,
            normalized_prediction_distance: NEAR / UNIT,
            num_solver_iterations: ROUNDS,
            contact_softness: soft(TOUCH),
            static_contact_softness: soft(STAND),
            contact_recycling: false,
            contact_clustering: false,
            warmstart_joints: true,
            friction_model: FrictionModel::Simplified,
            ..IntegrationParameters::default()
        };
        World {
            parameters,
            pipeline: Pipeline(PhysicsPipeline::new()),
            islands: IslandManager::new(),
            broad: BroadPhaseBvh::default(),
            narrow: NarrowPhase::new(),
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            joints: ImpulseJointSet::new(),
            multibodies: MultibodyJointSet::new(),
            soft: SoftBodySet::new(),
            fast: CCDSolver::new(),
            handles: Vec::new(),
            pairs: Pairs::default(),
            grips: Vec::new(),
            steps: 0,
        }
    }

    /// A body comes in. Without solid parts it touches nothing.
    pub fn add(&mut self, thing: &Thing<'_>) -> Id {
        let mut shapes = Vec::new();
        for (at, body) in &thing.parts {
            let at = isometry(at);
            shapes.extend(body.pieces().flat_map(|(inner, shape)| fine(at * inner, shape, SKIN)));
        }
        let shape = match shapes.len() {
            0 => None,
            _ => Some(SharedShape::compound(shapes)),
        };
        let mut felt = Vec::new();
        for (at, body) in &thing.outside {
            let at = isometry(at);
            felt.extend(body.pieces().map(|(inner, shape)| (at * inner, inset(shape, SKIN).unwrap_or(shape.clone()))));
        }
        let felt = (!felt.is_empty()).then(|| SharedShape::compound(felt));
        self.insert(thing, shape, felt)
    }

    /// The floor: all that is below z = 0.
    pub fn floor(&mut self, friction: f64) -> Id {
        let (parts, outside) = (Vec::new(), Vec::new());
        let thing =
            Thing { parts, outside, at: Pose::up(-SKIN), kind: Kind::Fixed, friction, bounce: 0.0, robot: false };
        self.insert(&thing, Some(SharedShape::halfspace(Vector::Z)), None)
    }

    fn insert(&mut self, thing: &Thing<'_>, shape: Option<SharedShape>, felt: Option<SharedShape>) -> Id {
        let id = Id(self.handles.len() as u32);
        let at = isometry(&thing.at);
        let builder = match &thing.kind {
            Kind::Fixed => RigidBodyBuilder::fixed(),
            Kind::Led => RigidBodyBuilder::kinematic_position_based(),
            Kind::Loose(inertial) => RigidBodyBuilder::dynamic().additional_mass_properties(mass(inertial)),
        };
        let mut body = builder.pose(at).gyroscopic_forces_enabled(true).build();
        body.activation_mut().normalized_linear_threshold = STILL / UNIT;
        let body = self.bodies.insert(body);
        let others = if felt.is_some() { THINGS } else { THINGS | ROBOTS };
        let groups = if thing.robot { (ROBOTS, THINGS | FELT) } else { (THINGS, others) };
        let all = [(shape, groups), (felt, (FELT, ROBOTS))];
        let colliders = all.into_iter().filter_map(|(shape, (own, others))| {
            let collider = ColliderBuilder::new(shape?)
                .density(0.0)
                .contact_skin(SKIN)
                .friction(thing.friction)
                .friction_combine_rule(CoefficientCombineRule::Min)
                .restitution(thing.bounce)
                .restitution_combine_rule(CoefficientCombineRule::Min)
                .collision_groups(InteractionGroups::new(own, others, InteractionTestMode::And))
                .user_data(u128::from(id.0))
                .build();
            Some(self.colliders.insert_with_parent(collider, body, &mut self.bodies))
        });
        let colliders = colliders.collect();
        self.handles.push((body, colliders));
        id
    }

    /// The friction between two bodies, where it is not the lesser of theirs.
    pub fn between(&mut self, a: Id, b: Id, friction: f64) {
        self.pairs.set(a, b, friction);
        for id in [a, b].into_iter().filter(|id| self.pairs.has(*id)) {
            for handle in self.colliders_of(id).to_vec() {
                if let Some(collider) = self.colliders.get_mut(handle) {
                    collider.set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
                }
            }
        }
    }

    /// The mass of a loose body and how it is distributed from now on.
    pub fn weigh(&mut self, id: Id, inertial: &Inertial) {
        if let Some(body) = self.handle(id).and_then(|handle| self.bodies.get_mut(handle)) {
            body.set_additional_mass_properties(mass(inertial), false);
            body.recompute_mass_properties_from_colliders(&self.colliders);
        }
    }

    /// Where a led body is at the end of the next step.
    pub fn lead(&mut self, id: Id, to: &Pose) {
        let mut to = isometry(to);
        if let Some(body) = self.handle(id).and_then(|handle| self.bodies.get_mut(handle))
            && *body.position() != to
        {
            // Of the two ways to write a turn the one that is near: the other one leads once around within the step.
            if body.position().rotation.dot(to.rotation) < 0.0 {
                to.rotation = -to.rotation;
            }
            body.set_next_kinematic_position(to);
        }
    }

    /// A body is somewhere else from now on, at rest.
    pub fn put(&mut self, id: Id, at: &Pose) {
        if let Some(body) = self.handle(id).and_then(|handle| self.bodies.get_mut(handle)) {
            body.set_position(isometry(at), true);
            body.set_linvel(Vector::ZERO, false);
            body.set_angvel(Vector::ZERO, false);
        }
    }

    /// Two bodies turn about an axis that they share from now on, without friction: the x axis of a frame that is given on each.
    pub fn hinge(&mut self, [a, b]: [(Id, Pose); 2]) {
        let (Some(first), Some(second)) = (self.handle(a.0), self.handle(b.0)) else { return };
        let joint = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(isometry(&a.1))
            .local_frame2(isometry(&b.1))
            .contacts_enabled(false)
            .build();
        self.joints.insert(first, second, joint, true);
    }

    /// A body that sleeps no longer does.
    pub fn wake(&mut self, id: Id) {
        if let Some(body) = self.handle(id).and_then(|handle| self.bodies.get_mut(handle)) {
            body.wake_up(true);
        }
    }

    /// A loose body moves like that, m/s and rad/s.
    pub fn throw(&mut self, id: Id, speed: [f64; 3], spin: [f64; 3]) {
        if let Some(body) = self.handle(id).and_then(|handle| self.bodies.get_mut(handle)) {
            body.set_linvel(Vector::from(speed), true);
            body.set_angvel(Vector::from(spin), true);
        }
    }

    /// One step on.
    pub fn step(&mut self) {
        self.press();
        self.pipeline.0.step(
            Vector::new(0.0, 0.0, -GRAVITY),
            &self.parameters,
            &mut self.islands,
            &mut self.broad,
            &mut self.narrow,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.joints,
            &mut self.multibodies,
            &mut self.soft,
            &mut self.fast,
            &self.pairs,
            &(),
        );
        self.steps += 1;
    }

    /// Nothing moves until it would have made so many steps: they are counted without being made.
    pub fn rest_until(&mut self, steps: u64) {
        self.steps = self.steps.max(steps);
    }

    /// How many steps it has made.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Where a body is.
    pub fn pose(&self, id: Id) -> Pose {
        let body = self.handle(id).and_then(|handle| self.bodies.get(handle));
        body.map_or(Pose::IDENTITY, |body| pose(body.position()))
    }

    /// How fast a body moves and turns, m/s and rad/s.
    pub fn motion(&self, id: Id) -> ([f64; 3], [f64; 3]) {
        let body = self.handle(id).and_then(|handle| self.bodies.get(handle));
        body.map_or_else(Default::default, |body| (body.linvel().to_array(), body.angvel().to_array()))
    }

    /// Whether no force moves a body any more.
    pub fn is_still(&self, id: Id) -> bool {
        self.handle(id)
            .and_then(|handle| self.bodies.get(handle))
            .is_none_or(|body| !body.is_dynamic() || body.is_sleeping())
    }

    /// Whether no force moves any.
    pub fn is_asleep(&self) -> bool {
        (0..self.handles.len() as u32).all(|id| self.is_still(Id(id)))
    }

    /// Energy of all loose bodies, of motion and of height, J.
    pub fn energy(&self) -> f64 {
        let loose = self.bodies.iter().filter(|(_, body)| body.is_dynamic());
        loose.map(|(_, body)| body.kinetic_energy() + body.mass() * GRAVITY * body.center_of_mass().z).sum()
    }

    pub(crate) fn handle(&self, id: Id) -> Option<RigidBodyHandle> {
        self.handles.get(id.0 as usize).map(|handles| handles.0)
    }

    pub(crate) fn colliders_of(&self, id: Id) -> &[ColliderHandle] {
        self.handles.get(id.0 as usize).map_or(&[], |handles| &handles.1)
    }
}
