//! STL, text and binary.

use std::io::Cursor;

use crate::{MOST_TRIANGLES, Surface};

/// Bytes before the triangles of a binary file, and of each triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

pub(crate) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let count = bytes.get(80..HEADER).and_then(|c| c.try_into().ok()).map(u32::from_le_bytes);
    // Binary files may begin with the word `solid`, too: their length tells.
    let binary = count.is_some_and(|n| bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * u64::from(n));
    if !binary && !bytes.trim_ascii_start().starts_with(b"solid") {
        return Err(
            "it is not an STL file: it neither starts with `solid` nor has the length of its triangles".to_string()
        );
    }
    let mut bytes = bytes.to_vec();
    if binary {
        if count.is_some_and(|n| n as usize > MOST_TRIANGLES) {
            return Err(format!("it has more than {MOST_TRIANGLES} triangles: simplify it"));
        }
        bytes[..80].fill(0);
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| format!("it is not an STL file: {e}"))?;
    let points = mesh.vertices.iter().map(|v| [0, 1, 2].map(|k| f64::from(v[k]))).collect();
    let triangles = mesh.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect();
    Ok((points, triangles))
}
