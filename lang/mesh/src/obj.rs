//! Wavefront OBJ: all of its objects as one; polygons as triangles; materials are left out.

use std::io::Cursor;

use tobj::LoadOptions;

use crate::Surface;

pub(crate) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let options = LoadOptions { triangulate: true, single_index: true, ..LoadOptions::default() };
    let loaded = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Ok(Default::default()));
    let (models, _) = loaded.map_err(|e| format!("it is not an OBJ file: {e}"))?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for model in models {
        let first = points.len() as u32;
        points.extend(model.mesh.positions.chunks_exact(3).map(|p| [0, 1, 2].map(|k| f64::from(p[k]))));
        let corners = model.mesh.indices.chunks_exact(3);
        triangles.extend(corners.map(|t| [0, 1, 2].map(|k| first.saturating_add(t[k]))));
    }
    Ok((points, triangles))
}
