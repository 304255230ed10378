//! Assets from files of other formats: `asset X from labware "plate.json"`, `asset X from urdf "arm.urdf"`; meshes of shapes.

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::mesh::Mesh;
use matterix_ir::{Diagnostic, FileId, Sources, codes};

use crate::ast::{AssetLine, Expr, ExprKind, Field, FieldValue, File, ItemKind, Member, MemberKind, Name, Path};
use crate::loader::Loader;
use crate::names::Names;
use crate::near::question;
use crate::units::Units;
use crate::{labware, library, sila};

/// What a file gives: lines of the asset, and what it is where its text does not say.
type Given = (Vec<AssetLine>, Option<Path>);

/// A format that an asset can come from.
struct Format {
    word: &'static str,
    code: codes::Code,
    /// What its files hold, for messages.
    holds: &'static str,
    read: fn(&str, &Name, &mut Beside<'_>) -> Result<Given, String>,
}

/// Files beside one that is being read.
struct Beside<'l> {
    from: FileId,
    loader: &'l dyn Loader,
    found: Vec<Diagnostic>,
}

const FORMATS: &[Format] = &[
    Format {
        word: "labware",
        code: codes::LABWARE_FILE,
        holds: "labware definition",
        read: |text, path, _| labware::lines(text, path),
    },
    Format { word: "urdf", code: codes::URDF_FILE, holds: "description of a robot", read: urdf },
];

/// Whether an asset can come from files of this format.
pub fn is_known(format: &Name) -> bool {
    FORMATS.iter().any(|f| f.word == format.text)
}

/// Texts of the files in a format that assets come from, by what stands after the format; what cannot be read is left out.
pub fn texts(names: &Names<'_>, format: &str, loader: &dyn Loader) -> BTreeMap<String, String> {
    let named = names.decls.iter().filter_map(|decl| match &decl.item.kind {
        ItemKind::Asset { source: Some((word, path)), .. } if word.text == format => Some((decl.module, path)),
        _ => None,
    });
    let read = named.filter_map(|(module, path)| {
        let text = source_text(names.modules[module].file, format, &path.text, loader).ok()?;
        Some((path.text.clone(), text))
    });
    read.collect()
}

/// The one format that a capability can come from.
const FEATURE: &str = "sila";

/// Whether a capability of a module comes from a file.
pub fn has_features(tree: &File) -> bool {
    tree.items.iter().any(|i| matches!(&i.kind, ItemKind::Capability { source: Some(_), .. }))
}

/// Writes out each `capability NAME from sila "file"` of a module, with a driver for it beside it.
pub fn features(
    tree: &mut File,
    file: FileId,
    units: &Units,
    sources: &mut Sources,
    loader: &dyn Loader,
) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut beside = Vec::new();
    for item in &mut tree.items {
        let ItemKind::Capability { name, source: Some((word, path)), members, .. } = &mut item.kind else { continue };
        if word.text != FEATURE {
            let headline = format!("a capability cannot be imported from `{}`", word.text);
            let d = Diagnostic::error(codes::MISPLACED, word.span, headline, "not a format for capabilities");
            found.push(d.help(format!("use `{FEATURE}`, a feature of SiLA 2")));
            continue;
        }
        let read = text(file, &path.text, loader).and_then(|text| {
            matterix_sila::read(&text).map_err(|p| format!("`{}` is not a feature of SiLA 2: {p}", path.text))
        });
        let feature = match read {
            Ok(feature) => feature,
            Err(headline) => {
                found.push(Diagnostic::error(codes::SILA_FILE, path.span, headline, "this file"));
                members.push(Member { docs: Vec::new(), kind: MemberKind::Error, span: path.span });
                continue;
            }
        };
        let declared = sila::declarations(&feature, &name.text, units, sila::declared(members));
        if !declared.left_out.is_empty() {
            let list: Vec<String> = declared.left_out.iter().map(|(what, why)| format!("`{what}`, {why}")).collect();
            let headline = format!("these parts of `{}` cannot be used: {}", feature.identifier, list.join("; "));
            found.push(Diagnostic::advice(codes::SILA_FILE, path.span, headline, "in this file"));
        }
        let written = sources.add(format!("{} as `{}`", path.text, name.text), declared.text.as_str());
        let (inner, wrong) = crate::syntax::parse(written, &declared.text);
        found.extend(wrong);
        for other in inner.items {
            match other.kind {
                ItemKind::Capability { members: given, .. } => {
                    members.extend(given);
                    item.docs.extend(other.docs);
                }
                _ => beside.push(other),
            }
        }
    }
    tree.items.extend(beside);
    found
}

/// Whether assets of a module name files, or shapes of theirs.
pub fn reads(tree: &File) -> bool {
    tree.items.iter().any(|item| match &item.kind {
        ItemKind::Asset { source, lines, .. } => source.is_some() || lines.iter().flat_map(shapes_of).any(names_file),
        _ => false,
    })
}

/// Whether a shape is a mesh of a file.
fn names_file(shape: &Expr) -> bool {
    matches!(&*shape.kind, ExprKind::Call(callee, _) if matches!(&*callee.kind, ExprKind::Name(name) if name.text == "mesh"))
}

/// Replaces each `from FORMAT "file"` of a module by the lines of that file.
pub fn import(tree: &mut File, file: FileId, loader: &dyn Loader) -> Vec<Diagnostic> {
    let mut beside = Beside { from: file, loader, found: Vec::new() };
    for item in &mut tree.items {
        let ItemKind::Asset { source, extends, lines, .. } = &mut item.kind else { continue };
        let meshes: Vec<AssetLine> = lines.iter().flat_map(shapes_of).filter_map(|s| beside.mesh_of(s)).collect();
        lines.extend(meshes);
        let Some((word, path)) = source else { continue };
        let Some(format) = FORMATS.iter().find(|f| f.word == word.text) else { continue };
        let read = source_text(file, &word.text, &path.text, loader).and_then(|text| {
            (format.read)(&text, path, &mut beside)
                .map_err(|reason| format!("`{}` is not a {}: {reason}", path.text, format.holds).into())
        });
        match read {
            Ok((given, kind)) => {
                if extends.is_empty() {
                    extends.extend(kind);
                }
                // A shape that the asset gives replaces the body of a definition, wherever that stands.
                let shaped = word.text == "labware" && lines.iter().any(|line| is_field(line, "shape"));
                lines.extend(given.into_iter().filter(|line| !(shaped && matches!(line, AssetLine::Solid { .. }))));
            }
            Err(unread) => {
                beside.found.push(unread.told(format.code, path));
                // What it would have given is not missed again.
                lines.push(AssetLine::Error(path.span));
            }
        }
    }
    beside.found
}

/// Whether a line gives a field.
fn is_field(line: &AssetLine, key: &str) -> bool {
    matches!(line, AssetLine::Field(field) if field.key.text == key)
}

/// The shapes that a line of an asset gives.
fn shapes_of(line: &AssetLine) -> Vec<&Expr> {
    let given = match line {
        AssetLine::Solid { shape, .. } => shape,
        AssetLine::Field(Field { key, value: FieldValue::Expr(e), .. })
            if ["shape", "mesh", "collision"].contains(&key.text.as_str()) =>
        {
            e
        }
        _ => return Vec::new(),
    };
    match &*given.kind {
        ExprKind::List(pieces) => pieces.iter().collect(),
        _ => vec![given],
    }
}

impl Beside<'_> {
    /// The mesh that a shape names.
    fn mesh_of(&mut self, shape: &Expr) -> Option<AssetLine> {
        let (called, file) = match &*shape.kind {
            ExprKind::Call(callee, args) => (&*callee.kind, &args.first()?.value),
            _ => return None,
        };
        match (called, &*file.kind) {
            (ExprKind::Name(name), ExprKind::Text(path)) if name.text == "mesh" => {
                let read =
                    self.loader.bytes(self.from, path).map_err(|reason| format!("cannot read `{path}`: {reason}"));
                let mesh = read.and_then(|bytes| {
                    matterix_mesh::read(path, &bytes).map_err(|reason| format!("`{path}` is not a mesh: {reason}"))
                });
                let mesh = mesh.map_err(|headline| {
                    self.found.push(Diagnostic::error(codes::MESH_FILE, file.span, headline, "this file"));
                });
                Some(AssetLine::Mesh(file.span, mesh.ok().map(Arc::new)))
            }
            _ => None,
        }
    }

    /// A mesh that a description of a robot names, if there is such a file beside it.
    fn mesh(&mut self, description: &Name, uri: &str) -> Option<Mesh> {
        matterix_mesh::is_metric(uri)?;
        let folder = description.text.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
        // The first part of such a name is a package, whose folder the description lies in, or in one below.
        let rest = uri.strip_prefix("package://").map(|rest| rest.split_once('/').map_or(rest, |(_, rest)| rest));
        let name = uri.rsplit_once('/').map_or(uri, |(_, name)| name);
        let places = match rest {
            Some(rest) => vec![format!("{folder}{rest}"), format!("{folder}../{rest}"), format!("{folder}{name}")],
            None => vec![format!("{folder}{uri}")],
        };
        let (path, bytes) =
            places.into_iter().find_map(|p| Some((p.clone(), self.loader.bytes(self.from, &p).ok()?)))?;
        match matterix_mesh::read(&path, &bytes) {
            Ok(mesh) => Some(Mesh { name: path, ..mesh }),
            Err(reason) => {
                let headline = format!("`{path}` is not a mesh: {reason}");
                self.found.push(Diagnostic::error(codes::MESH_FILE, description.span, headline, "named in this file"));
                None
            }
        }
    }
}

/// Why there is nothing to read, and the names that may be meant.
struct Unread {
    headline: String,
    near: Vec<String>,
    help: Option<String>,
}

impl From<String> for Unread {
    fn from(headline: String) -> Self {
        Unread { headline, near: Vec::new(), help: None }
    }
}

impl Unread {
    fn told(self, code: codes::Code, path: &Name) -> Diagnostic {
        let mut d = Diagnostic::error(code, path.span, self.headline, "this file");
        d.help.extend(self.help.into_iter().chain(question(&self.near)));
        match self.near.first() {
            Some(best) => d.guess(format!("replace with `{best}`"), path.span, format!("\"{best}\"")),
            None => d,
        }
    }
}

/// The text that an asset comes from: of labware, a definition of the library by its name; else that of a file.
fn source_text(from: FileId, format: &str, path: &str, loader: &dyn Loader) -> Result<String, Unread> {
    if format != "labware" {
        return Ok(text(from, path, loader)?);
    }
    if labware::library::is_name(path) {
        let missing = match labware::library::find(path) {
            Ok(entry) => return Ok(entry.text()?),
            Err(missing) => missing,
        };
        // A file may be called like that too.
        return loader.file(from, path).map_err(|_| no_definition(path, missing));
    }
    let unread = |reason: String| {
        let name = path.strip_suffix(".json").and_then(|name| labware::library::find(name).ok());
        let help = name.map(|entry| format!("the library's definition is named without `.json`: `{}`", entry.name));
        Unread { help, ..Unread::from(format!("cannot read `{path}`: {reason}")) }
    };
    loader.file(from, path).map_err(unread)
}

/// A name that the library does not have.
fn no_definition(path: &str, missing: labware::library::Missing) -> Unread {
    let list = "`matterixc labware WORD` lists the names with a word in them; a file of yours ends with `.json`";
    match missing {
        labware::library::Missing::Name(near) => {
            let help = near.is_empty().then(|| list.to_owned());
            Unread { headline: format!("the library has no labware definition `{path}`"), near, help }
        }
        labware::library::Missing::Version(versions) => {
            let known: Vec<String> = versions.iter().map(u32::to_string).collect();
            let help = format!("it has version {}", matterix_ir::listing::joined(&known, "and"));
            Unread { help: Some(help), ..Unread::from(format!("the library has no labware definition `{path}`")) }
        }
    }
}

/// The text of a file beside the module, or else of one of the library's.
fn text(from: FileId, path: &str, loader: &dyn Loader) -> Result<String, String> {
    match loader.file(from, path) {
        Ok(text) => Ok(text),
        Err(reason) => match library::file(path) {
            Some(text) => Ok(text.to_string()),
            None => Err(format!("cannot read `{path}`: {reason}")),
        },
    }
}

/// A robot's links and joints.
fn urdf(text: &str, path: &Name, beside: &mut Beside<'_>) -> Result<Given, String> {
    let robot = matterix_urdf::read_with(text, |uri| beside.mesh(path, uri)).map_err(|problem| problem.to_string())?;
    Ok((vec![AssetLine::Robot(Box::new(robot), path.span)], None))
}
