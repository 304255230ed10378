//! What is kept of a journal beside it: how far it got. An older copy of a journal is whole in itself; only its counterfoil knows of
//! what was done since.

use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::{DirBuilderExt, FileExt, OpenOptionsExt};
use std::path::PathBuf;

use super::chain::Chain;
use super::paper::{Taken, lock};

/// A small file of the user's own, by the name of the journal.
#[derive(Debug)]
pub struct Counterfoil(File);

impl Counterfoil {
    /// Begins one.
    pub fn create(id: &str) -> io::Result<Counterfoil> {
        let folder = folder()?;
        DirBuilder::new().mode(0o700).recursive(true).create(&folder)?;
        let file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(folder.join(id))?;
        File::open(&folder)?.sync_all()?;
        lock(&file).map_err(|taken| match taken {
            Taken::Io(e) => e,
            Taken::Locked => io::Error::new(ErrorKind::ResourceBusy, "another process uses it"),
        })?;
        Ok(Counterfoil(file))
    }

    /// The one of a journal, and how far that got; none where there is none on this machine.
    pub fn find(id: &str) -> Result<Option<(Counterfoil, Chain)>, Taken> {
        let mut file = match OpenOptions::new().read(true).write(true).open(folder()?.join(id)) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        lock(&file)?;
        let mut text = Vec::new();
        (&mut file).take(Chain::default().head().len() as u64 + 1).read_to_end(&mut text)?;
        // A machine that was switched off while it began has left nothing in it, and nothing was said by then.
        if text.is_empty() {
            return Ok(Some((Counterfoil(file), Chain::default())));
        }
        let chain = Chain::of_head(&text).filter(|chain| chain.id == id);
        let chain = chain.ok_or_else(|| io::Error::new(ErrorKind::InvalidData, "it was changed after writing"))?;
        Ok(Some((Counterfoil(file), chain)))
    }

    /// Says how far the journal is; comes back when that outlives the machine's power.
    pub fn mark(&mut self, chain: &Chain) -> io::Result<()> {
        self.0.write_all_at(chain.head().as_bytes(), 0)?;
        self.0.sync_data()
    }
}

/// Where they are: a folder that outlives the machine's power.
fn folder() -> io::Result<PathBuf> {
    let given = |key: &str| std::env::var_os(key).map(PathBuf::from).filter(|dir| dir.is_absolute());
    let state = given("XDG_STATE_HOME").or_else(|| Some(given("HOME")?.join(".local/state")));
    let none = || io::Error::new(ErrorKind::NotFound, "it has no folder: neither XDG_STATE_HOME nor HOME is set");
    Ok(state.ok_or_else(none)?.join("matterixc/journals"))
}
