//! What touches what: rigid bodies with mass and friction, grippers whose fingers press, and what slips, tips and falls.
//!
//! A [`World`] knows bodies by number, and nothing of labs, plans or names. Bodies have the true shapes of `matterix-solids`; three kinds
//! are told apart: what never moves, what is led along a given way (links of arms), and what forces move. The engine is rapier in 64 bits, in steps
//! of [`STEP`]; the same calls give the same bits, also when a [`World`] is cloned midway and both go on.
//!
//! Three ways to model an arm were compared. *A multibody in reduced coordinates* feels contact in its joints, and rapier's costs ten times
//! what the rest of a small scene does. *Links joined by impulses* drift apart under load and stay soft. *Links led by kinematics of one's own* are exact and cost
//! least, and have no give: an arm never yields. The last is used for arms; fingers, which must yield, are bodies on a sliding joint with a motor.

mod facets;
mod friction;
mod grip;
mod thing;
mod touch;
mod world;

pub use grip::{Finger, Grip, GripId};
pub use thing::{Id, Kind, Thing};
pub use touch::Touch;
pub use world::{GRAVITY, STEP, World};
