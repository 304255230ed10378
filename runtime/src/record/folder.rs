//! Several files that belong together: all of one performance are there, or none.
//!
//! They are written into a folder of their own beside the target, or inside a target that is there already, and only moved into place when
//! all are whole. A new target appears in one step. In one that is there files are replaced one by one, the last to be written removed first
//! and put back last: a folder that has it is of one performance. Two ways were compared: to exchange whole folders is one step always, but
//! pulls the folder away under a shell or a viewer that stands in it, and files of others would have to be moved along.

use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::files::RecordError;

/// The folders of this process in which files are being written.
static OPEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn open() -> MutexGuard<'static, Vec<PathBuf>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is not in its place yet, for a process that ends at once; files that are being moved into place are waited for.
/// Nothing is moved any more afterwards, as long as what is returned is held.
#[must_use]
pub fn give_up() -> impl Drop {
    let open = open();
    for staging in open.iter() {
        let _ = fs::remove_dir_all(staging);
    }
    open
}

/// A new folder for files that are not in their place yet. One that a killed process left behind, or that a process with the same number
/// in another container writes into, is left alone.
fn staging(beside: &Path, name: &str) -> io::Result<PathBuf> {
    let mut open = open();
    let mut count = 0;
    loop {
        let path = beside.join(format!(".{name}.{}-{count}.part", std::process::id()));
        match fs::create_dir(&path) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => count += 1,
            Err(e) => return Err(e),
            Ok(()) => {
                open.push(path.clone());
                return Ok(path);
            }
        }
    }
}

/// Files on their way into a folder. Those that are not put into place are removed.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    staging: PathBuf,
    /// Names that a performance may write.
    own: &'static [&'static str],
    written: Vec<&'static str>,
    /// Whether the target was there before.
    is_there: bool,
}

impl Folder {
    /// Begins to write into a folder, which is made with those above it if need be. `own` are all names that may be written: those that are
    /// not this time are removed, since they are of an earlier performance.
    pub fn begin(target: &Path, own: &'static [&'static str]) -> Result<Self, RecordError> {
        let failed = |e: io::Error| RecordError::new(target, e);
        let is_there = target.is_dir();
        let whole = std::path::absolute(target).map_err(failed)?;
        let name = whole.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let beside = match (is_there, whole.parent()) {
            (false, Some(parent)) => parent.to_owned(),
            _ => whole,
        };
        fs::create_dir_all(&beside).map_err(failed)?;
        let staging = staging(&beside, &name).map_err(failed)?;
        Ok(Folder { target: target.to_owned(), staging, own, written: Vec::new(), is_there })
    }

    /// Whether files can be written into a folder at all, before much work is done for them.
    pub fn check(target: &Path) -> Result<(), RecordError> {
        Folder::begin(target, &[]).map(drop)
    }

    /// Writes a file that is not in its place yet.
    pub fn put(&mut self, name: &'static str, bytes: &[u8]) -> Result<(), RecordError> {
        self.add(name, |draft| draft.write_all(bytes))
    }

    /// The same, as it is made.
    pub(super) fn add<E: Display>(
        &mut self,
        name: &'static str,
        make: impl FnOnce(&mut Draft) -> Result<(), E>,
    ) -> Result<(), RecordError> {
        let name = self.write(name, make)?;
        self.whole(name);
        Ok(())
    }

    /// Writes a file beside others that are being made, and gives its name: it is put into place when it is said to be
    /// [`whole`](Self::whole).
    pub(super) fn write<E: Display>(
        &self,
        name: &'static str,
        make: impl FnOnce(&mut Draft) -> Result<(), E>,
    ) -> Result<&'static str, RecordError> {
        let failed = |reason: String| RecordError::new(&self.target.join(name), reason);
        let file = File::create_new(self.staging.join(name)).map_err(|e| failed(e.to_string()))?;
        let mut draft = Draft { file: BufWriter::new(file), failed: None };
        let made = make(&mut draft).map_err(|e| e.to_string()).and_then(|()| draft.flush().map_err(|e| e.to_string()));
        // What libraries say of a full disk is seldom that it is full.
        made.map(|()| name).map_err(|reason| failed(draft.failed.unwrap_or(reason)))
    }

    /// A file is written and belongs to the performance.
    pub(super) fn whole(&mut self, name: &'static str) {
        self.written.push(name);
    }

    /// Where files are that are not in their place yet.
    pub(super) fn staging(&self) -> &Path {
        &self.staging
    }

    /// Puts all files into place; their paths, in the order in which they were written.
    pub fn finish(self) -> Result<Vec<PathBuf>, RecordError> {
        // Held until the end: a process that ends meanwhile lets this be done.
        let _open = open();
        if self.is_there {
            self.replace()?;
        } else {
            fs::rename(&self.staging, &self.target).map_err(|e| RecordError::new(&self.target, e))?;
        }
        Ok(self.written.iter().map(|name| self.target.join(name)).collect())
    }

    fn replace(&self) -> Result<(), RecordError> {
        let failed = |name: &str| {
            let path = self.target.join(name);
            move |e: io::Error| RecordError::new(&path, e)
        };
        // The last one written says that all are of one performance.
        let last = self.written.last().copied();
        let older = self.own.iter().copied().filter(|name| !self.written.contains(name));
        for name in last.into_iter().chain(older) {
            match fs::remove_file(self.target.join(name)) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(failed(name)(e)),
                _ => {}
            }
        }
        for name in &self.written {
            fs::rename(self.staging.join(name), self.target.join(name)).map_err(failed(name))?;
        }
        Ok(())
    }
}

/// A file that is being made. It knows what the system said when it could not be written.
#[derive(Debug)]
pub(super) struct Draft {
    file: BufWriter<File>,
    failed: Option<String>,
}

impl Draft {
    fn told<T>(&mut self, done: io::Result<T>) -> io::Result<T> {
        if let Err(e) = &done {
            self.failed.get_or_insert_with(|| e.to_string());
        }
        done
    }
}

impl Write for Draft {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let done = self.file.write(bytes);
        self.told(done)
    }

    fn flush(&mut self) -> io::Result<()> {
        let done = self.file.flush();
        self.told(done)
    }
}

impl Seek for Draft {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let done = self.file.seek(to);
        self.told(done)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let mut open = open();
        open.retain(|staging| *staging != self.staging);
        // After all went into place there is nothing left, or an empty folder.
        let _ = fs::remove_dir_all(&self.staging);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("matterix-folder-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).expect("a folder");
        dir
    }

    fn names(dir: &Path) -> Vec<String> {
        let entries = fs::read_dir(dir).expect("a folder").flatten();
        let mut names: Vec<_> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    const OWN: &[&str] = &["a", "b", "c"];

    #[test]
    fn a_new_folder_appears_with_all_its_files() {
        let dir = scratch("new");
        let out = dir.join("far/out");
        let mut folder = Folder::begin(&out, OWN).expect("begun");
        folder.put("a", b"1").expect("written");
        assert!(!out.exists());
        folder.put("b", b"2").expect("written");
        folder.finish().expect("in place");
        assert_eq!(
            (names(&out), names(&dir.join("far"))),
            (vec!["a".to_owned(), "b".to_owned()], vec!["out".to_owned()])
        );
        fs::remove_dir_all(dir).expect("removed");
    }

    #[test]
    fn files_that_are_not_finished_leave_a_folder_as_it_was() {
        let dir = scratch("left");
        for name in ["a", "b", "other"] {
            fs::write(dir.join(name), "old").expect("a file");
        }
        let mut folder = Folder::begin(&dir, OWN).expect("begun");
        folder.put("a", b"new").expect("written");
        drop(folder);
        assert_eq!(names(&dir), ["a", "b", "other"]);
        assert_eq!(fs::read(dir.join("a")).expect("a file"), b"old");

        let mut folder = Folder::begin(&dir, OWN).expect("begun");
        for name in ["c", "a"] {
            folder.put(name, b"new").expect("written");
        }
        folder.finish().expect("in place");
        assert_eq!(names(&dir), ["a", "c", "other"], "a file of an earlier performance stays");
        fs::remove_dir_all(dir).expect("removed");
    }

    #[test]
    fn a_file_that_cannot_be_written_says_what_the_system_said() {
        let dir = scratch("full");
        let folder = Folder::begin(&dir.join("out"), OWN).expect("begun");
        let made = folder.write("a", |draft| {
            let full = draft.told(Err::<(), _>(io::Error::from(io::ErrorKind::StorageFull)));
            full.map_err(|_| "the library has no words for it")
        });
        assert_eq!(made.expect_err("it is full").reason, "no storage space");
        drop(folder);
        assert_eq!(names(&dir), [""; 0]);
        fs::remove_dir_all(dir).expect("removed");
    }

    #[test]
    fn a_process_that_ends_at_once_leaves_nothing() {
        let dir = scratch("ended");
        let mut folder = Folder::begin(&dir, OWN).expect("begun");
        folder.put("a", b"new").expect("written");
        drop(give_up());
        assert_eq!(names(&dir), [""; 0]);
        fs::remove_dir_all(dir).expect("removed");
    }
}
