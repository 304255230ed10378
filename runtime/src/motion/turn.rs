//! Joints to positions.

use matterix_ir::scene::InstanceId;
use matterix_motion::Variable;

use super::performed::Performed;
use super::refused::Refused;
use super::stage::Stage;

impl Stage<'_> {
    /// Brings the joints that move the tip to positions.
    pub(super) fn turn(&mut self, mover: InstanceId, to: Vec<f64>) -> Result<Performed, Refused> {
        let robot = self.actor_of(mover).ok_or(Refused::NoRobot)?;
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let variables = actor.chain.variables();
        if to.len() != variables.len() {
            return Err(Refused::Joints(to.len(), variables.len()));
        }
        let beyond = |(v, q): &(&Variable, &f64)| {
            !q.is_finite() || v.is_bounded() && !(v.limits.lower..=v.limits.upper).contains(*q)
        };
        if let Some((variable, _)) = variables.iter().zip(&to).find(beyond) {
            let joint = actor.assembly.robot.joints.get(variable.joint as usize);
            return Err(Refused::Beyond(joint.map(|j| j.name.clone()).unwrap_or_default()));
        }
        let mut parts = self.depart(robot, None)?;
        let arm = self.arm(robot);
        parts.push(self.way(robot, &arm, &to, None)?);
        Ok(Performed::new(robot, parts))
    }
}
