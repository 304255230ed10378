//! Small balls around many balls.

use nalgebra::Vector3;

/// A ball in some frame; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Round {
    pub center: Vector3<f64>,
    pub radius: f64,
}

impl Round {
    /// In 32 bits: middle and radius.
    pub fn single(&self) -> [f32; 4] {
        [self.center.x as f32, self.center.y as f32, self.center.z as f32, self.radius as f32]
    }
}

/// A ball around all of these, within a thousandth of the least one (Badoiu and Clarkson's walk: towards the
/// farthest, by ever shorter steps).
pub(crate) fn cover(balls: &[Round]) -> Round {
    let far = |from: Vector3<f64>| -> (f64, Vector3<f64>) {
        balls.iter().fold((0.0, from), |(most, at), b| {
            let d = b.center - from;
            let reach = d.norm() + b.radius;
            let end = b.center + d.try_normalize(1e-12).unwrap_or_default() * b.radius;
            if reach > most { (reach, end) } else { (most, at) }
        })
    };
    if let [only] = balls {
        return *only;
    }
    let count = balls.len().max(1) as f64;
    let mut center = balls.iter().map(|b| b.center).sum::<Vector3<f64>>() / count;
    let (mut best, mut at) = (far(center).0, center);
    for step in 1..400 {
        let (_, end) = far(center);
        center += (end - center) / (step as f64 + 1.0);
        let reach = far(center).0;
        if reach < best {
            (best, at) = (reach, center);
        }
    }
    // A hair more, so that rounding to 32 bits leaves nothing outside.
    Round { center: at, radius: best * (1.0 + 1e-6) + 1e-7 }
}
