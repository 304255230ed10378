//! Judges what a recording says robots did, apart from what planned it, and how things stood before.
//!
//! It reads the file alone: shapes and joints (`/bodies`), joints over time (`/joints`), frames (`/tf`) and grips
//! (`/grips`), how what is gripped may be moved (`/burdens`). Kinematics are its own; bodies are those of `matterix-solids`, not the balls that motions are planned with.

mod carried;
mod kinematics;
mod limits;

mod standing;
mod sweep;
mod trajectory;
mod verdict;

pub use trajectory::Unreadable;
pub use verdict::{Looked, Verdict, Wrong};

use trajectory::Trajectory;

/// How far bodies may reach into each other before it counts, m: their dimensions are nominal.
pub const NOMINAL: f64 = 2e-3;

/// Steps in which motions are looked at, m: no point of a robot moves farther in one.
pub const STEP: f64 = 2e-3;

/// How far the tip may be from the frame of a thing that it grips, m.
pub const GRIP: f64 = 2e-3;

/// Judges a recording.
pub fn judge(file: &[u8]) -> Result<Verdict, Unreadable> {
    let film = Trajectory::read(file)?;
    let mut verdict = Verdict::default();
    verdict.wrong.extend(standing::judge(&film));
    for index in 0..film.robots.len() {
        let mut looked = Looked { robot: film.robots[index].name.clone(), ..Looked::default() };
        limits::judge(&film.robots[index], &mut looked, &mut verdict.wrong);
        sweep::judge(&film, index, &mut looked, &mut verdict.wrong);
        carried::judge(&film, index, &mut verdict.wrong);
        verdict.looked.push(looked);
    }
    verdict.wrong.sort_by(|a, b| a.time().total_cmp(&b.time()));
    Ok(verdict)
}
