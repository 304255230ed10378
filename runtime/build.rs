//! Tells the crate which sources plan motions, so that what another version has planned is not taken for its own.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::Hasher;
use std::path::{Path, PathBuf};

/// Where a motion is planned and what it is planned with, seen from this crate.
const SOURCES: &[&str] = &["src/motion", "motion/src", "solids/src", "src/backend/noise.rs", "../lang/ir/src"];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut files = Vec::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        collect(&root.join(source), &mut files);
    }
    files.sort();
    let mut hash = DefaultHasher::new();
    for file in files {
        hash.write(&fs::read(file).unwrap_or_default());
    }
    println!("cargo::rustc-env=MATTERIX_MOTION_SOURCES={:016x}", hash.finish());
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if !path.is_dir() {
        return files.push(path.to_path_buf());
    }
    let entries = fs::read_dir(path).into_iter().flatten().flatten().map(|e| e.path());
    entries.for_each(|entry| collect(&entry, files));
}
