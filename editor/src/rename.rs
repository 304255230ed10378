//! Other names for what a package declares.
//!
//! A name is changed only where that changes nothing else: library names stay, and so does what some text names without
//! writing it, or what would then mean something else.

use std::collections::BTreeMap;

use matterix_ir::{FileId, Span};
use matterix_lang::lower::FAILURES;
use matterix_lang::syntax;

use crate::Index;
use crate::index::{DefId, Kind, Meaning};
use crate::references::{Place, references};

/// The name at a place, if it can be changed; why not otherwise.
pub fn prepare(index: &Index, file: FileId, offset: usize) -> Result<(Span, DefId), String> {
    let found = index.at(file, offset).ok_or("no name at this place")?;
    let text = index.text(found.span);
    let def = match found.meaning {
        Meaning::Def(def) => def,
        Meaning::Module(_) => return Err(format!("`{text}` is a module, named by its file")),
        Meaning::Language(what) => return Err(format!("`{text}` is a word of the language: {what}")),
        Meaning::Open => return Err(format!("the owner of `{text}` is unknown: its type is open here")),
        Meaning::Unknown => return Err(format!("`{text}` is unknown")),
    };
    let d = index.def(def);
    if index.is_library(d.span.file) {
        return Err(format!("`{}` belongs to the standard library", d.name));
    }
    if index.sources().get(d.span.file).is_none_or(|s| !s.name.ends_with(".mtx"))
        && !index.own_files().any(|f| f == d.span.file)
    {
        return Err(format!("`{}` comes from a file in another format", d.name));
    }
    if d.kind == Kind::Setting && FIXED.contains(&d.name.as_str()) {
        return Err(format!("laws read the setting `{}` by this name", d.name));
    }
    if d.kind == Kind::Column && index.is_header(def) {
        return Err(format!("the header of the file names the column `{}`", d.name));
    }
    if d.kind == Kind::Word {
        return Err(format!("`{}` is a word of a state: types are equal if their words are", d.name));
    }
    if index.text(d.span) != d.name && !matches!(d.kind, Kind::Skill | Kind::Command) {
        return Err(format!("the declaration of `{}` does not contain its name", d.name));
    }
    if d.kind == Kind::Failure && index.failure_places(&d.name).iter().any(|s| index.is_library(s.file)) {
        return Err(format!("`{}` is also a failure of the standard library", d.name));
    }
    if index.is_implicit(def) {
        return Err(format!("calls of the function take `{}` from their surroundings by its name", d.name));
    }
    if let Some(other) = index.redeclared(def) {
        let (kind, owner) = (index.def(other).kind.word(), index.def(other).owner.map(|o| index.def(o).name.clone()));
        return Err(format!("`{}` is also declared as a {kind} of `{}`", d.name, owner.unwrap_or_default()));
    }
    if index.is_spoken(&d.name) {
        return Err(format!("a quoted text contains the name `{}`", d.name));
    }
    Ok((found.span, def))
}

/// The changes that give what stands at a place another name, by file; why that cannot be done otherwise.
pub fn rename(
    all: &[&Index],
    index: &Index,
    file: FileId,
    offset: usize,
    name: &str,
) -> Result<BTreeMap<String, Vec<Place>>, String> {
    let (_, def) = prepare(index, file, offset)?;
    let d = index.def(def);
    if !fits(d.kind, name) {
        let word = d.kind.word();
        let article = if word.starts_with(['a', 'e', 'i', 'o']) { "an" } else { "a" };
        return Err(format!("`{name}` cannot be the name of {article} {word}"));
    }
    let key = index.key(def);
    for index in std::iter::once(&index).chain(all) {
        let Some(def) = index.find(&key) else { continue };
        prepare_there(index, def)?;
        if let Some(why) = index.clash(def, name) {
            return Err(why);
        }
    }
    let mut out: BTreeMap<String, Vec<Place>> = BTreeMap::new();
    for place in references(all, index, file, offset, true) {
        let text = std::iter::once(&index).chain(all).find_map(|i| i.text_at(&place)).unwrap_or_default();
        // A label or an alias stands for the same thing under a name of its own.
        if same(text, &d.name) {
            if name.contains(' ') && std::iter::once(&index).chain(all).any(|i| i.is_imported(&place)) {
                return Err(format!(
                    "`{}` is imported by name in `{}`, and `use` takes single words",
                    d.name, place.file
                ));
            }
            out.entry(place.file.clone()).or_default().push(place);
        }
    }
    Ok(out)
}

/// What another package says of a declaration.
fn prepare_there(index: &Index, def: DefId) -> Result<(), String> {
    let span = index.def(def).span;
    prepare(index, span.file, span.start as usize).map(|_| ())
}

/// Whether two texts are the same words.
fn same(a: &str, b: &str) -> bool {
    a.split_whitespace().eq(b.split_whitespace())
}

/// Whether a name can stand for such a thing.
fn fits(kind: Kind, name: &str) -> bool {
    let word = |w: &str| syntax::is_name(w) && !FIXED.contains(&w) && !FAILURES.contains(&w);
    match kind {
        Kind::Skill | Kind::Command => {
            let mut words = name.split(' ');
            words.all(word)
        }
        Kind::Species => {
            reads(&format!("mtx 1\nspecies {name} {{ by: mass }}\n")) && !name.contains(char::is_whitespace)
        }
        Kind::Unit => reads(&format!("mtx 1\nunit {name}: Volume = 1 L\n")) && name.chars().all(char::is_alphabetic),
        Kind::Failure | Kind::Member | Kind::Option => {
            name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && word(name)
        }
        _ => word(name),
    }
}

/// Whether a text is one of the language.
fn reads(text: &str) -> bool {
    syntax::parse(FileId(0), text).1.is_empty()
}

/// Names that mean the same everywhere, besides the failures of the language.
const FIXED: &[&str] =
    &["true", "false", "nothing", "unlimited", "elapsed", "self", "ambient", "rest", "sum", "product", "all", "any"];

impl Index {
    /// The text of a place apart from an index.
    fn text_at(&self, place: &Place) -> Option<&str> {
        let files = (0..).map(FileId).map_while(|id| Some((id, self.sources().get(id)?)));
        let (_, source) = files.into_iter().find(|(_, s)| s.name == place.file)?;
        source.text.get(place.start as usize..place.end as usize)
    }

    /// Whether the name of a column is what the header of its file says: no other header stands behind it.
    fn is_header(&self, column: DefId) -> bool {
        let d = self.def(column);
        let behind = self.text(d.whole).strip_prefix(d.name.as_str()).unwrap_or_default();
        !behind.trim_start().starts_with('"')
    }

    /// Another declaration of the same member in what the owner extends, or in what extends it.
    fn redeclared(&self, def: DefId) -> Option<DefId> {
        let d = self.def(def);
        let owner = self.decl_of(d.owner?)?;
        if !matches!(d.kind, Kind::Member | Kind::Frame | Kind::Part | Kind::Grid | Kind::Joint) {
            return None;
        }
        let family = self.family(owner);
        let all = family.into_iter().filter_map(|k| self.of_decl(k)).flat_map(|k| self.def(k).inside.clone());
        all.into_iter().find(|o| *o != def && self.def(*o).name == d.name)
    }

    /// Whether a text in quotes is just this name: frames and properties may be named so.
    fn is_spoken(&self, name: &str) -> bool {
        let quoted = format!("\"{name}\"");
        self.own_files().any(|f| self.sources().get(f).is_some_and(|s| s.text.contains(&quoted)))
    }

    /// What would go wrong if a declaration had this name.
    fn clash(&self, def: DefId, name: &str) -> Option<String> {
        let d = self.def(def);
        let already = |other: DefId| {
            let o = self.def(other);
            Some(format!("`{name}` is already the name of a {}", o.kind.word()))
        };
        // What has the same owner.
        if let Some(owner) = d.owner {
            let beside = self.def(owner).inside.iter().copied().chain(self.own_inside(owner));
            if let Some(other) = beside.into_iter().find(|o| *o != def && self.def(*o).name == name) {
                return already(other);
            }
            if let Some(kind) = self.decl_of(owner) {
                let family = self.family(kind);
                let members =
                    family.into_iter().filter_map(|k| self.of_decl(k)).flat_map(|k| self.def(k).inside.clone());
                let mut members = members.filter(|o| *o != def && self.def(*o).name == name);
                if let Some(other) = members.next() {
                    return already(other);
                }
            }
        }
        if matches!(d.kind, Kind::Unit | Kind::Dimension) {
            return self.units().find(name).is_some().then(|| format!("`{name}` is already a unit"));
        }
        if d.kind == Kind::Failure && self.failure(name).is_some() {
            return Some(format!("`{name}` is already a failure"));
        }
        if matches!(d.kind, Kind::Skill | Kind::Command) && self.verbs(name).next().is_some() {
            return Some(format!("`{name}` is already a verb"));
        }
        // What would be hidden where it is named, or hide it.
        for span in self.references(def) {
            if let Some(other) = self.named_at(span.file, span.start as usize, name).filter(|o| *o != def) {
                return already(other);
            }
        }
        // What is named so already, and would mean this.
        for used in self.all_uses().filter(|u| !self.is_library(u.span.file) && self.text(u.span) == name) {
            let seen = self.named_at(used.span.file, used.span.start as usize, &d.name);
            if seen == Some(def) && used.meaning != Meaning::Def(def) {
                return Some(format!("uses of `{name}` would then mean `{}`", d.name));
            }
        }
        None
    }
}
