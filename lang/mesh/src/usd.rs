//! USD: the triangles of all meshes of the stage that a file holds, each in its place; other shapes, what is not seen and what
//! only guides are left out. Files that it refers to are read only where they are in the same archive.
//!
//! Text is safe whatever it holds. A damaged binary file may end the program: openusd 0.6 sets memory aside by what it claims.

use std::io::{self, Cursor, Read};

use openusd::ar::{Asset, ResolvedPath, Resolver, split_package_relative_path_outer};
use openusd::gf;
use openusd::schemas::geom::{Gprim, Imageable, Mesh, PointBased, Purpose, Visibility, Xformable};
use openusd::sdf::{Path, Value};
use openusd::usd::{Prim, PrimPredicate, SchemaBase, SchemaKind, Stage, TimeCode};

use crate::{MOST_BYTES, MOST_TRIANGLES, Surface};

/// What went wrong in the library.
type Caught = Box<dyn std::error::Error + Send + Sync>;

/// Length of a unit where a file does not say it, m: a centimetre by the standard.
const UNIT: f64 = 0.01;

pub(crate) fn usd(bytes: &[u8]) -> Result<Surface, String> {
    // Either kind goes by this name.
    if bytes.starts_with(b"PXR-USDC") { usdc(bytes) } else { usda(bytes) }
}

pub(crate) fn usda(bytes: &[u8]) -> Result<Surface, String> {
    read("stage.usda", bytes)
}

pub(crate) fn usdc(bytes: &[u8]) -> Result<Surface, String> {
    read("stage.usdc", bytes)
}

pub(crate) fn usdz(bytes: &[u8]) -> Result<Surface, String> {
    read("stage.usdz", bytes)
}

fn read(name: &'static str, bytes: &[u8]) -> Result<Surface, String> {
    // The library expects files to be whole.
    let caught = std::panic::catch_unwind(|| surface(name, bytes));
    caught.unwrap_or_else(|_| Err("it is not a USD file, or not a supported one".to_string()))
}

fn surface(name: &'static str, bytes: &[u8]) -> Result<Surface, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("it is not a USD file: {e:#}");
    let only = Only { name, bytes: bytes.to_vec() };
    let stage = Stage::builder().resolver(only).open(name).map_err(|e| wrong(&e))?;
    let mut paths = Vec::new();
    stage.traverse(PrimPredicate::DEFAULT_PROXIES, |path| paths.push(path.clone())).map_err(|e| wrong(&e))?;
    if let Some(error) = stage.composition_errors().first() {
        return Err(format!("it refers to something that it does not contain: {error}"));
    }
    let mut out = (Vec::new(), Vec::new());
    for path in paths {
        if let Some(mesh) = Mesh::get(&stage, path).map_err(|e| wrong(&e))? {
            add(&mesh, &mut out).map_err(|e| format!("`{}` is damaged: {e:#}", mesh.path()))?;
        }
        if out.1.len() > MOST_TRIANGLES {
            return Err(format!("it has more than {MOST_TRIANGLES} triangles: simplify it"));
        }
    }
    let (unit, up) = measures(&stage);
    for point in &mut out.0 {
        let [x, y, z] = point.map(|v: f64| v * unit);
        *point = match up.as_str() {
            "Z" => [x, y, z],
            _ => [x, -z, y],
        };
    }
    Ok(out)
}

/// Length of a unit, m, and the axis that points up.
fn measures(stage: &Stage) -> (f64, String) {
    let layer = stage.root_layer();
    let stated = |name: &str| layer.data().try_field(&Path::abs_root(), name).ok().flatten().map(|v| v.into_owned());
    let unit = match stated("metersPerUnit") {
        Some(Value::Double(unit)) => unit,
        Some(Value::Float(unit)) => f64::from(unit),
        _ => UNIT,
    };
    let up = match stated("upAxis") {
        Some(Value::Token(axis)) => axis.as_str().to_string(),
        _ => "Y".to_string(),
    };
    (unit, up)
}

/// Adds the triangles of a mesh that is seen, in the frame of the stage.
fn add(mesh: &Mesh, out: &mut Surface) -> Result<(), Caught> {
    let seen = mesh.compute_visibility()? != Visibility::Invisible;
    if !seen || !matches!(mesh.compute_purpose()?, Purpose::Default | Purpose::Render) {
        return Ok(());
    }
    let numbers = |value: Option<Value>| match value {
        Some(Value::IntVec(numbers)) => numbers,
        _ => Vec::new(),
    };
    let points = mesh.points_attr().get::<Vec<gf::Vec3f>>()?.unwrap_or_default();
    let counts = numbers(mesh.face_vertex_counts_attr().get::<Value>()?);
    let corners = numbers(mesh.face_vertex_indices_attr().get::<Value>()?);
    let matrix = to_stage(mesh)?;
    // A matrix that mirrors, and a mesh that counts its corners the other way round, turn triangles inside out.
    let left = matches!(mesh.orientation_attr().get::<Value>()?, Some(Value::Token(t)) if t.as_str() == "leftHanded");
    let turned = left != (determinant(&matrix) < 0.0);
    let first = out.0.len() as u32;
    for p in points {
        let p = [p.x, p.y, p.z].map(f64::from);
        out.0.push([0, 1, 2].map(|c| (0..3).map(|r| p[r] * matrix.0[4 * r + c]).sum::<f64>() + matrix.0[12 + c]));
    }
    let mut begin = 0usize;
    for count in counts {
        let count = usize::try_from(count)?;
        let end = begin.saturating_add(count);
        let face = corners.get(begin..end).ok_or("a face lacks corners")?;
        begin = end;
        for pair in face.get(1..).unwrap_or_default().windows(2) {
            let mut triangle = [face[0], pair[0], pair[1]];
            if turned {
                triangle.swap(1, 2);
            }
            let index = |i: i32| u32::try_from(i).map(|i| first.saturating_add(i));
            out.1.push([index(triangle[0])?, index(triangle[1])?, index(triangle[2])?]);
        }
        if out.1.len() > MOST_TRIANGLES {
            break;
        }
    }
    Ok(())
}

/// Where a mesh is on its stage; vectors are rows, as there.
fn to_stage(mesh: &Mesh) -> Result<gf::Matrix4d, Caught> {
    let mut matrix = gf::Matrix4d::IDENTITY;
    let mut next = Some(mesh.path().clone());
    while let Some(path) = next.filter(|path| *path != Path::abs_root()) {
        let placed = Placed(mesh.stage().prim(path.clone()));
        matrix = matrix * placed.local_to_parent_transform(TimeCode::EARLIEST)?;
        next = if placed.resets_xform_stack()? { None } else { path.parent() };
    }
    Ok(matrix)
}

fn determinant(m: &gf::Matrix4d) -> f64 {
    let at = |r: usize, c: usize| m.0[4 * r + c];
    at(0, 0) * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1)) - at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0))
        + at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0))
}

/// Anything that may have a place.
struct Placed(Prim);

impl SchemaBase for Placed {
    const KIND: SchemaKind = SchemaKind::ConcreteTyped;

    fn prim(&self) -> &Prim {
        &self.0
    }
}

impl Imageable for Placed {}
impl Xformable for Placed {}

/// Finds one file, which is in memory, and what is in it where it is an archive; nothing else.
struct Only {
    name: &'static str,
    bytes: Vec<u8>,
}

impl Only {
    /// What is in an archive under a name.
    fn packed(&self, inner: &str) -> io::Result<Vec<u8>> {
        let mut archive = zip::ZipArchive::new(Cursor::new(&self.bytes)).map_err(io::Error::other)?;
        let file = archive.by_name(inner).map_err(io::Error::other)?;
        let mut out = Vec::new();
        file.take(MOST_BYTES as u64 + 1).read_to_end(&mut out)?;
        if out.len() > MOST_BYTES {
            return Err(io::Error::other(format!("it unpacks to more than {} MiB", MOST_BYTES >> 20)));
        }
        Ok(out)
    }
}

impl Resolver for Only {
    fn create_identifier(&self, path: &str, anchor: Option<&ResolvedPath>) -> String {
        let anchor = anchor.map(|a| a.to_string());
        match anchor.as_deref().and_then(split_package_relative_path_outer) {
            // Beside what refers to it, in the same archive.
            Some((package, from)) if !path.starts_with(self.name) => {
                let folder = from.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
                format!("{package}[{folder}{}]", path.trim_start_matches("./"))
            }
            _ => path.to_string(),
        }
    }

    fn resolve(&self, path: &str) -> Option<ResolvedPath> {
        let there = match split_package_relative_path_outer(path) {
            Some((package, inner)) => package == self.name && self.packed(&inner).is_ok(),
            None => path == self.name,
        };
        there.then(|| ResolvedPath::new(path))
    }

    fn resolve_for_new_asset(&self, _: &str) -> Option<ResolvedPath> {
        None
    }

    fn open_asset(&self, path: &ResolvedPath) -> io::Result<Box<dyn Asset>> {
        let text = path.to_string();
        let bytes = match split_package_relative_path_outer(&text) {
            Some((_, inner)) => self.packed(&inner)?,
            None => self.bytes.clone(),
        };
        Ok(Box::new(Cursor::new(bytes)))
    }

    fn get_modification_timestamp(&self, _: &str, _: &ResolvedPath) -> Option<std::time::SystemTime> {
        None
    }
}
