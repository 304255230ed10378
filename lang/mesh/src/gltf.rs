//! glTF 2.0: the triangles of its scene, each node in its place.

use base64::Engine;
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Node};

use crate::{MOST_TRIANGLES, Surface};

/// Nodes lie no deeper than this: a node may name itself.
const DEEPEST: u32 = 64;

pub(crate) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let file = file(bytes)?;
    let buffers = buffers(&file)?;
    fits(&file.document, &buffers)?;
    let Some(scene) = file.default_scene().or_else(|| file.scenes().next()) else {
        return Err("it has no scene".to_string());
    };
    let mut out = (Vec::new(), Vec::new());
    for node in scene.nodes() {
        add(&node, IDENTITY, 0, &buffers, &mut out)?;
    }
    // The y axis points up there.
    out.0.iter_mut().for_each(|p| *p = [p[0], -p[2], p[1]]);
    Ok(out)
}

/// The file, valid by its standard. Attributes are looked at first, as the validation takes their accessors to be there.
fn file(bytes: &[u8]) -> Result<Gltf, String> {
    let wrong = |e: gltf::Error| format!("it is not a glTF file: {e}");
    let Gltf { document, blob } = Gltf::from_slice_without_validation(bytes).map_err(wrong)?;
    let root = document.into_json();
    let mut attributes = root.meshes.iter().flat_map(|m| &m.primitives).flat_map(|p| p.attributes.values());
    if attributes.any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err("it refers to data that it does not describe".to_string());
    }
    Ok(Gltf { document: Document::from_json(root).map_err(wrong)?, blob })
}

/// Columns of a matrix that moves points.
type Matrix = [[f64; 4]; 4];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| (0..4).map(|k| a[k][r] * b[c][k]).sum()))
}

fn buffers(file: &Gltf) -> Result<Vec<Vec<u8>>, String> {
    let data = |buffer: gltf::Buffer<'_>| match buffer.source() {
        Source::Bin => file.blob.clone().ok_or_else(|| "its binary part is missing".to_string()),
        Source::Uri(uri) => {
            let coded = uri.strip_prefix("data:").and_then(|rest| rest.split_once(";base64,")).map(|(_, coded)| coded);
            let coded = coded.ok_or_else(|| format!("its data is in another file, `{uri}`: save it as `.glb`"))?;
            base64::engine::general_purpose::STANDARD.decode(coded).map_err(|e| format!("its data is damaged: {e}"))
        }
    };
    file.buffers().map(data).collect()
}

/// Whether all that the file refers to lies within its data.
fn fits(document: &Document, buffers: &[Vec<u8>]) -> Result<(), String> {
    for accessor in document.accessors() {
        let (Some(view), None) = (accessor.view(), accessor.sparse()) else {
            return Err("it has sparse data, which is not supported".to_string());
        };
        let there = buffers.get(view.buffer().index()).map_or(0, Vec::len);
        let within = view.offset().checked_add(view.length()).is_some_and(|end| end <= there);
        let step = view.stride().unwrap_or(accessor.size());
        let last = accessor.count().checked_sub(1).and_then(|n| n.checked_mul(step));
        let end = last.and_then(|l| l.checked_add(accessor.offset())?.checked_add(accessor.size()));
        if !within || end.is_none_or(|end| end > view.length()) {
            return Err("it refers to more data than it has".to_string());
        }
    }
    Ok(())
}

fn add(node: &Node<'_>, above: Matrix, depth: u32, buffers: &[Vec<u8>], out: &mut Surface) -> Result<(), String> {
    if depth > DEEPEST {
        return Err(format!("its nodes are nested more than {DEEPEST} deep"));
    }
    let matrix = product(&above, &node.transform().matrix().map(|column| column.map(f64::from)));
    for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives).filter(|p| p.mode() == Mode::Triangles) {
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let first = out.0.len() as u32;
        for point in reader.read_positions().into_iter().flatten() {
            let [x, y, z] = point.map(f64::from);
            out.0.push([0, 1, 2].map(|r| matrix[0][r] * x + matrix[1][r] * y + matrix[2][r] * z + matrix[3][r]));
        }
        let count = out.0.len() as u32 - first;
        let corners: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count).collect(),
        };
        out.1.extend(corners.chunks_exact(3).map(|t| [0, 1, 2].map(|k| first.saturating_add(t[k]))));
        if out.1.len() > MOST_TRIANGLES {
            return Err(format!("it has more than {MOST_TRIANGLES} triangles: simplify it"));
        }
    }
    node.children().try_for_each(|child| add(&child, matrix, depth + 1, buffers, out))
}
