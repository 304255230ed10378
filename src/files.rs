//! Reading and writing files.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::reads;

/// Bytes of the largest text that is read.
pub const LARGEST_TEXT: u64 = 16 << 20;
/// The same of recordings.
const LARGEST_RECORDING: u64 = 4 << 30;

/// What a file of text holds, or in words why it cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    read_up_to(path, LARGEST_TEXT)
}

/// What a recording holds, or in words why it cannot be read.
pub fn read_recording(path: &Path) -> Result<Vec<u8>, String> {
    read_up_to(path, LARGEST_RECORDING)
}

fn read_up_to(path: &Path, largest: u64) -> Result<Vec<u8>, String> {
    // Asked first, since what opening a folder says differs between systems.
    if path.is_dir() {
        reads::note(path, largest, None);
        return Err(format!("`{}` is a directory, not a file", path.display()));
    }
    contents(path, largest).map_err(|why| format!("cannot read `{}`: {why}", path.display()))
}

/// What a file of at most so many bytes holds, or why not. A pipe or a device may never end, or never begin.
pub fn contents(path: &Path, largest: u64) -> Result<Vec<u8>, String> {
    let found = bytes(path, largest);
    reads::note(path, largest, found.as_deref().ok());
    found
}

fn bytes(path: &Path, largest: u64) -> Result<Vec<u8>, String> {
    let about = fs::metadata(path).map_err(|e| reason(&e))?;
    if about.is_dir() {
        return Err("it is a directory".to_string());
    }
    if !about.is_file() {
        return Err("it is a pipe or a device, not a file".to_string());
    }
    let file = File::open(path).map_err(|e| reason(&e))?;
    up_to(file, largest)
}

/// All there is to read, of at most so many bytes.
fn up_to(from: impl Read, largest: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    // One byte more tells what is larger, whatever its length was said to be.
    from.take(largest + 1).read_to_end(&mut bytes).map_err(|e| reason(&e))?;
    match bytes.len() as u64 > largest {
        true => Err(format!("it is larger than {} MiB", largest >> 20)),
        false => Ok(bytes),
    }
}

/// Files that were found, and in words what was not.
pub struct Found {
    /// Each once, in the order of the paths; those of a folder by name.
    pub files: Vec<PathBuf>,
    /// What cannot be read.
    pub missing: Vec<String>,
}

/// The files that paths name, and all with an extension in the folders they name. Hidden folders and links to folders
/// are left out.
pub fn with_extension(paths: &[PathBuf], extension: &str) -> Found {
    let mut found = Found { files: Vec::new(), missing: Vec::new() };
    for path in paths {
        if path.is_dir() {
            search(path, extension, &mut found);
        } else {
            found.files.push(path.clone());
        }
    }
    let mut seen = std::collections::BTreeSet::new();
    found.files.retain(|path| seen.insert(path.clone()));
    found
}

fn search(dir: &Path, extension: &str, found: &mut Found) {
    let mut entries: Vec<PathBuf> = match fs::read_dir(dir) {
        Ok(entries) => entries.flatten().map(|e| e.path()).collect(),
        Err(e) => {
            found.missing.push(format!("cannot read `{}`: {}", dir.display(), reason(&e)));
            return;
        }
    };
    entries.sort();
    for path in entries {
        let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if path.is_dir() {
            if !hidden && !path.is_symlink() {
                search(&path, extension, found);
            }
        } else if path.extension().is_some_and(|e| e == extension) {
            let path = path.strip_prefix(".").map_or_else(|_| path.clone(), Path::to_path_buf);
            found.files.push(path);
        }
    }
}

/// Whether a path lies in a folder that is given by its whole path, links followed; where nothing is there, whether the nearest
/// folder on the way to it does.
pub fn lies_in(path: &Path, folder: &Path) -> bool {
    let Ok(whole) = std::path::absolute(path) else { return false };
    let there = whole.ancestors().find_map(|p| p.canonicalize().ok());
    there.is_some_and(|there| there.starts_with(folder))
}

/// What standard input holds, or in words why it cannot be read.
pub fn read_stdin() -> Result<Vec<u8>, String> {
    up_to(io::stdin().lock(), LARGEST_TEXT).map_err(|why| format!("cannot read standard input: {why}"))
}

/// Replaces what a file holds in one step, keeping its permissions; a link stays a link.
pub fn replace(path: &Path, text: impl AsRef<[u8]>) -> Result<(), String> {
    let failed = |e: io::Error| format!("cannot write `{}`: {}", path.display(), reason(&e));
    let target = fs::canonicalize(path).map_err(failed)?;
    let there = fs::metadata(&target).map_err(failed)?;
    // A pipe or a device in its place is not to be lost.
    if !there.is_file() {
        return Err(format!("cannot write `{}`: it is not a regular file", path.display()));
    }
    let permissions = there.permissions();
    if permissions.readonly() {
        return Err(format!("cannot write `{}`: it is read-only", path.display()));
    }
    let beside = beside(&target);
    let written = fill(&beside, text.as_ref())
        .and_then(|()| fs::set_permissions(&beside, permissions))
        .and_then(|()| fs::rename(&beside, &target));
    reads::note(path, LARGEST_TEXT, written.is_ok().then_some(text.as_ref()));
    written.map_err(|e| {
        // What is left of a failed attempt is of no use; that it cannot be removed either changes nothing.
        let _ = fs::remove_file(&beside);
        failed(e)
    })
}

/// Writes a file, new or not; a reader sees the old text or the new, never a part.
pub fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), String> {
    if path.exists() {
        return replace(path, text);
    }
    let beside = beside(path);
    fill(&beside, text.as_ref()).and_then(|()| fs::rename(&beside, path)).map_err(|e| {
        let _ = fs::remove_file(&beside);
        format!("cannot write `{}`: {}", path.display(), reason(&e))
    })
}

/// Creates a folder with these files, all or none; a folder that exists must be empty.
pub fn create_folder(dir: &Path, files: &[(&str, &str)]) -> Result<(), String> {
    let failed = |e: io::Error| format!("cannot create `{}`: {}", dir.display(), reason(&e));
    let exists = match fs::read_dir(dir).map(|mut entries| entries.next().is_none()) {
        Ok(true) => true,
        Ok(false) => return Err(format!("`{}` already exists and is not empty", dir.display())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => false,
        Err(e) => return Err(failed(e)),
    };
    // The final name is taken only by a rename, so whoever looks sees the whole folder or none.
    let dir = if exists { fs::canonicalize(dir).map_err(failed)? } else { std::path::absolute(dir).map_err(failed)? };
    if let Some(parent) = dir.parent() {
        fs::create_dir_all(parent).map_err(failed)?;
    }
    let beside = beside(&dir);
    let created = fs::create_dir(&beside)
        .and_then(|()| files.iter().try_for_each(|(name, text)| fill(&beside.join(name), text)))
        .and_then(|()| if exists { fs::remove_dir(&dir) } else { Ok(()) })
        .and_then(|()| fs::rename(&beside, &dir));
    created.map_err(|e| {
        let _ = fs::remove_dir_all(&beside);
        failed(e)
    })
}

/// Why an operation on a file failed, without the number of the system's error.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "the file does not exist".to_string(),
        io::ErrorKind::PermissionDenied => "permission denied".to_string(),
        io::ErrorKind::NotADirectory => "part of the path is not a directory".to_string(),
        _ => {
            let text = error.to_string();
            text.split(" (os error").next().unwrap_or_default().to_lowercase()
        }
    }
}

fn fill(path: &Path, text: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file: File = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_ref())?;
    file.sync_all()
}

/// A name next to `path` that nobody else uses.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}
