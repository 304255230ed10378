//! The statement at a place, and what is known after it.

use matterix_ir::FileId;
use matterix_ir::points::Points;

use crate::Analysis;

/// The innermost statement that stands at a place, by its index, in each workflow that could be followed. Of one with a block only its head
/// counts.
pub fn statement(analysis: &Analysis, file: FileId, offset: usize) -> Vec<(&Points, usize)> {
    let text = analysis.text(file);
    let stands = |points: &Points| {
        let inner = points.points.iter().enumerate().filter(|(_, point)| {
            let (start, end) = (point.span.start as usize, point.span.end as usize);
            let head =
                text.get(start..end).and_then(|t| t.find('{')).filter(|_| point.block).map(|brace| start + brace);
            point.span.file == file && start <= offset && offset <= head.unwrap_or(end)
        });
        inner.min_by_key(|(_, point)| point.span.len()).map(|(index, _)| index)
    };
    analysis.points.iter().filter_map(|points| Some((points, stands(points)?))).collect()
}
