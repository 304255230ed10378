//! The definitions that come with the program, found by name. `data/labware/make.py` writes the file and describes it.
//!
//! Nothing is unpacked before it is asked for: the file begins with an index in text, and each definition is compressed on its
//! own. Two ways were compared: all versions of a name in one stream take 30 % fewer bytes, but each of them then costs the
//! unpacking of all.

use miniz_oxide::inflate::decompress_to_vec_with_limit;

use crate::near::nearest;

/// The definitions of opentrons-shared-data (Apache-2.0, see `assets/labware/NOTICE`).
const PACKED: &[u8] = include_bytes!("../../../assets/labware/opentrons.bin");

/// The name space of these definitions.
pub(super) const NAMESPACE: &str = "opentrons";

/// The same before a name.
const SPACE: &str = "opentrons/";

/// A definition of the library.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Its load name.
    pub name: &'static str,
    /// Its version, from 1.
    pub version: u32,
    packed: &'static [u8],
    whole: usize,
}

impl Entry {
    /// The definition as JSON without blanks.
    pub fn text(&self) -> Result<String, String> {
        let bytes = decompress_to_vec_with_limit(self.packed, self.whole);
        let bytes = bytes.map_err(|e| format!("`{}` of the library cannot be unpacked ({e})", self.name))?;
        String::from_utf8(bytes).map_err(|e| format!("`{}` of the library is not text ({e})", self.name))
    }
}

/// Why no definition of the library has a name.
#[derive(Clone, Debug, PartialEq)]
pub enum Missing {
    /// There is no such name; these are near.
    Name(Vec<String>),
    /// There are other versions of it.
    Version(Vec<u32>),
}

/// Every definition in order of name and version.
pub fn entries() -> impl Iterator<Item = Entry> {
    let end = PACKED.windows(2).position(|pair| pair == b"\n\n").unwrap_or(PACKED.len());
    let (index, rest) = PACKED.split_at(end);
    // The first line names the package.
    let lines = std::str::from_utf8(index).unwrap_or_default().lines().skip(1);
    let mut rest = rest.get(2..).unwrap_or_default();
    lines.map_while(move |line| {
        let mut words = line.split(' ');
        let name = words.next()?;
        let mut number = || words.next()?.parse::<usize>().ok();
        let (version, size, whole) = (number()?, number()?, number()?);
        let (packed, after) = rest.split_at_checked(size)?;
        rest = after;
        Some(Entry { name, version: u32::try_from(version).ok()?, packed, whole })
    })
}

/// Whether a text can only be meant as a name of the library, and not as the path of a file.
pub fn is_name(text: &str) -> bool {
    let plain = text.strip_prefix(SPACE).unwrap_or(text);
    let name = plain.rsplit_once('/').map_or(plain, |(name, version)| if is_number(version) { name } else { plain });
    !name.is_empty()
        && !name.ends_with(".json")
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "._- ".contains(c))
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// The definition of a name, `NAME` in its newest version, `NAME/VERSION` or `opentrons/NAME/VERSION`.
pub fn find(asked: &str) -> Result<Entry, Missing> {
    let plain = asked.strip_prefix(SPACE).unwrap_or(asked);
    let (name, version) = match plain.rsplit_once('/') {
        Some((name, version)) => (name, Some(version)),
        None => (plain, None),
    };
    let versions: Vec<Entry> = entries().filter(|e| e.name == name).collect();
    let Some(newest) = versions.last() else { return Err(Missing::Name(near(name))) };
    match version {
        None => Ok(*newest),
        Some(version) => versions
            .iter()
            .find(|e| e.version.to_string() == version)
            .copied()
            .ok_or_else(|| Missing::Version(versions.iter().map(|e| e.version).collect())),
    }
}

/// The newest definition of every name.
pub fn newest() -> Vec<Entry> {
    let mut out: Vec<Entry> = Vec::new();
    for entry in entries() {
        match out.last_mut().filter(|last| last.name == entry.name) {
            Some(last) => *last = entry,
            None => out.push(entry),
        }
    }
    out
}

/// The names nearest to one that is not there: by their letters, else those that have all of its words.
fn near(name: &str) -> Vec<String> {
    let all = newest();
    let close = nearest(name, all.iter().map(|e| e.name));
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower.split(['_', ' ', '-']).filter(|word| !word.is_empty()).collect();
    if !close.is_empty() || words.is_empty() {
        return close;
    }
    let has_all = |e: &&Entry| words.iter().all(|word| e.name.contains(word));
    all.iter().filter(has_all).take(3).map(|e| e.name.to_owned()).collect()
}
