//! Meshes from STL (text and binary), OBJ, glTF (`.glb`, and `.gltf` with its data inside) and, with the feature `usd`, USD
//! (`.usda`, `.usdc`, `.usd` and `.usdz`), or in words what is wrong.
//!
//! Coordinates stay in the unit of the file. Those of glTF are metres by its standard, those of USD become metres by what the
//! file says; the y axis, where it points up there, becomes z.

mod gltf;
mod obj;
mod stl;
#[cfg(feature = "usd")]
mod usd;

use matterix_ir::mesh::Mesh;

/// Files with more triangles are refused: shapes for planning have some hundred.
pub const MOST_TRIANGLES: usize = 1 << 16;

/// Larger files are refused, in bytes.
pub const MOST_BYTES: usize = 64 << 20;

/// Kinds of files, by the ends of their names, and whether the kind says its unit (then metres).
const KINDS: &[Kind] = &[
    ("stl", false, stl::read),
    ("obj", false, obj::read),
    ("glb", true, gltf::read),
    ("gltf", true, gltf::read),
    ("usd", true, usd::usd),
    ("usda", true, usd::usda),
    ("usdc", true, usd::usdc),
    ("usdz", true, usd::usdz),
];

/// What is said of USD files where they are not read.
#[cfg(not(feature = "usd"))]
mod usd {
    use crate::Surface;

    pub(crate) fn read(_: &[u8]) -> Result<Surface, String> {
        Err("this program was built without USD: build it with `cargo install --features usd`".to_string())
    }

    pub(crate) use {read as usd, read as usda, read as usdc, read as usdz};
}

/// The end of a name, whether the kind is in metres, and what reads it.
type Kind = (&'static str, bool, fn(&[u8]) -> Result<Surface, String>);

/// Points and triangles.
type Surface = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Whether files of this name are in metres by their standard; none for names of no kind that is read.
pub fn is_metric(name: &str) -> Option<bool> {
    kind(name).map(|(_, metric, _)| *metric)
}

fn kind(name: &str) -> Option<&'static Kind> {
    let end = name.rsplit_once('.').map_or("", |(_, end)| end).to_ascii_lowercase();
    KINDS.iter().find(|(known, ..)| *known == end)
}

/// The mesh in a file, in the unit of the file.
pub fn read(name: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let Some((.., read)) = kind(name) else {
        return Err(
            "supported formats are `.stl`, `.obj`, `.glb`, `.gltf` and `.usd`, `.usda`, `.usdc`, `.usdz`".to_string()
        );
    };
    if bytes.len() > MOST_BYTES {
        return Err(format!("it is larger than {} MiB", MOST_BYTES >> 20));
    }
    let (points, triangles) = read(bytes)?;
    if triangles.is_empty() {
        return Err("it has no triangles".to_string());
    }
    if triangles.len() > MOST_TRIANGLES {
        return Err(format!("it has {} triangles, more than {MOST_TRIANGLES}: simplify it", triangles.len()));
    }
    let mesh = Mesh { name: name.to_string(), points, triangles };
    if !mesh.is_sound() {
        return Err("a corner of a triangle is missing, or not a number".to_string());
    }
    if mesh.size().contains(&0.0) {
        return Err("it is flat: a body needs a volume".to_string());
    }
    Ok(mesh)
}
