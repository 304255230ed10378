//! The folder of a record: made before anything is said to a device, sealed at the end.

use std::fs::{DirBuilder, File};
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use matterix_hardware::deploy::{Ending, is_unused, read, sha256};
use serde::{Deserialize, Serialize};

use super::report::{About, Report};
use super::{BINDINGS, JOURNAL, MANIFEST, PAGE, PROGRAM, REPORT, VERSION, page};
use crate::files;

/// The folder.
pub struct Folder {
    dir: PathBuf,
}

/// A file of the program, as it was read.
pub struct Taken {
    /// Its path.
    pub path: PathBuf,
    /// What it held.
    pub bytes: Vec<u8>,
}

/// What the files of a record hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the form.
    pub version: u32,
    /// What the deployment was given.
    pub about: About,
    /// All files but this one.
    pub files: Vec<Sealed>,
}

/// A file as it was when the record was sealed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sealed {
    /// Below the folder.
    pub path: String,
    /// Its length.
    pub bytes: u64,
    /// As hexadecimal digits.
    pub sha256: String,
}

impl Folder {
    /// A new one; an error where there is something already.
    pub fn create(dir: &Path) -> Result<Folder, String> {
        let failed = |e: std::io::Error| format!("cannot create the record `{}`: {}", dir.display(), files::reason(&e));
        match DirBuilder::new().mode(0o700).create(dir) {
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
                let there = format!("`{}` already exists", dir.display());
                Err(format!("{there}: choose another name for the record, or resume it with `--resume`"))
            }
            made => made.map(|()| Folder { dir: dir.to_path_buf() }).map_err(failed),
        }
    }

    /// One that an earlier process has left.
    pub fn open(dir: &Path) -> Result<Folder, String> {
        match dir.join(JOURNAL).is_file() {
            true => Ok(Folder { dir: dir.to_path_buf() }),
            false => Err(format!("`{}` is not a record: it has no `{JOURNAL}`", dir.display())),
        }
    }

    /// Removes it again where its journal says nothing: what was refused beforehand may be tried again with it.
    pub fn forget_unused(&self) {
        if is_unused(&self.journal()) {
            // It stays where it cannot be removed, which the next attempt says.
            let _ = std::fs::remove_dir_all(&self.dir);
        }
    }

    /// Where the journal is.
    pub fn journal(&self) -> PathBuf {
        self.dir.join(JOURNAL)
    }

    /// Keeps the text of a program and its bindings, unless they are there from an earlier process; the path of its first file below
    /// that of the program.
    pub fn keep(&self, main: &Path, read: &[Taken], bindings: &str) -> Result<String, String> {
        let whole =
            |path: &Path| path.canonicalize().map_err(|e| format!("`{}`: {}", path.display(), files::reason(&e)));
        let paths = read.iter().map(|t| whole(&t.path)).collect::<Result<Vec<_>, _>>()?;
        let main = whole(main)?;
        let root = paths.iter().fold(main.parent().unwrap_or(&main).to_path_buf(), |root, path| common(&root, path));
        if !self.dir.join(BINDINGS).exists() {
            for (path, taken) in paths.iter().zip(read) {
                self.write(&Path::new(PROGRAM).join(below(&root, path)), &taken.bytes)?;
            }
            self.write(Path::new(BINDINGS), bindings.as_bytes())?;
        }
        Ok(below(&root, &main).display().to_string())
    }

    /// Writes the reports, and what all files hold; the digest of that.
    pub fn seal(&self, about: About, ending: &Ending) -> Result<String, String> {
        let journal = files::read_recording(&self.journal())?;
        let past = read(&journal[..]).map_err(|why| format!("the journal {why}"))?;
        let report = Report::of(about.clone(), &past.entries, ending);
        self.write(Path::new(REPORT), report.json()?.as_bytes())?;
        self.write(Path::new(PAGE), page::page(&report).as_bytes())?;
        let mut paths = Vec::new();
        gather(&self.dir, &self.dir, &mut paths)?;
        let sealed = |path: &PathBuf| -> Result<Sealed, String> {
            let bytes = files::read_recording(&self.dir.join(path))?;
            let (length, sha256) = (bytes.len() as u64, sha256(&bytes));
            Ok(Sealed { path: path.display().to_string(), bytes: length, sha256 })
        };
        let all = paths.iter().filter(|p| *p != Path::new(MANIFEST)).map(sealed).collect::<Result<Vec<_>, _>>()?;
        let manifest = Manifest { version: VERSION, about, files: all };
        let text = serde_json::to_string_pretty(&manifest).map_err(|e| e.to_string())? + "\n";
        self.write(Path::new(MANIFEST), text.as_bytes())?;
        Ok(sha256(text.as_bytes()))
    }

    /// Writes a file below the folder, whole or not at all.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String> {
        let path = self.dir.join(path);
        let failed = |e: std::io::Error| format!("cannot write `{}`: {}", path.display(), files::reason(&e));
        if let Some(parent) = path.parent().filter(|p| !p.is_dir()) {
            DirBuilder::new().recursive(true).mode(0o700).create(parent).map_err(failed)?;
        }
        let beside = path.with_extension("part");
        let mut file: File =
            File::options().write(true).create(true).truncate(true).mode(0o600).open(&beside).map_err(failed)?;
        file.write_all(bytes).and_then(|()| file.sync_all()).map_err(failed)?;
        std::fs::rename(&beside, &path).map_err(failed)
    }
}

/// The folder that two paths have in common.
fn common(one: &Path, other: &Path) -> PathBuf {
    one.components().zip(other.components()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
}

fn below<'p>(root: &Path, path: &'p Path) -> &'p Path {
    path.strip_prefix(root).unwrap_or(path)
}

/// The files below a folder, in order.
pub fn gather(root: &Path, dir: &Path, out: &mut Vec<PathBuf>) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("cannot read `{}`: {}", dir.display(), files::reason(&e));
    let mut paths =
        std::fs::read_dir(dir).and_then(|all| all.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>());
    paths.iter_mut().for_each(|p| p.sort());
    for path in paths.map_err(failed)? {
        match path.is_dir() && !path.is_symlink() {
            true => gather(root, &path, out)?,
            false => out.push(below(root, &path).to_path_buf()),
        }
    }
    Ok(())
}
