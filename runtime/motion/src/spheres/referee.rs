//! A second opinion where balls collide: balls stand out of what they cover.

use std::fmt::Debug;

use super::Contact;

/// Knows the true shapes of a robot and of its world. It is asked only where balls leave no way, so it may take its time.
pub trait Referee: Debug {
    /// What collides in a configuration, deepest first; links and bodies are numbered as the checker has them.
    fn contacts(&self, q: &[f64]) -> Vec<Contact>;

    /// Whether nothing collides.
    fn is_free(&self, q: &[f64]) -> bool {
        self.contacts(q).is_empty()
    }

    /// Configurations it looks at for every unit of length (rad, or m, over all variables together).
    fn resolution(&self) -> f64;
}
