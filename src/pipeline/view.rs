//! A lab as a picture.

use matterix_ir::robot::Robot;
use matterix_ir::{Program, Sources};
use matterix_runtime::motion::Stage;
use matterix_view::document::Mesh;
use matterix_view::{Document, from_program, robot};

/// The lab of a program before anything happens, robots as their joints stand.
pub fn still(program: &Program, sources: &Sources) -> Document {
    let mut document = from_program::from_program(program, sources);
    let Ok(stage) = Stage::new(program) else { return document };
    for (id, description, _) in stage.movers() {
        let name = &program.scene.get(id).name;
        let placements = stage.moment(id, 0.0).map(|moment| moment.links).unwrap_or_default();
        robot::add(&mut document, description, name, &placements, |file| mesh(description, file));
    }
    document
}

/// A mesh of a robot, by the name that the robot has for it.
fn mesh(robot: &Robot, file: &str) -> Option<Mesh> {
    let mesh = robot.meshes.get(file)?;
    let positions = mesh.points.iter().flatten().map(|v| *v as f32).collect();
    Some(Mesh { positions, indices: mesh.triangles.iter().flatten().copied().collect() })
}
