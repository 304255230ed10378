//! Executes a `Program` on a backend.
