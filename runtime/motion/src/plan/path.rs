//! Ways through configuration space as points joined by straight lines.

/// The vector between two points into `vector`; its length.
#[inline]
pub(crate) fn gap(from: &[f32], to: &[f32], vector: &mut [f32]) -> f32 {
    let mut square = 0.0;
    for (v, (a, b)) in vector.iter_mut().zip(from.iter().zip(to)) {
        *v = b - a;
        square += *v * *v;
    }
    square.sqrt()
}

/// Points one after another, all of the same number of coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    dims: usize,
    flat: Vec<f32>,
}

impl Way {
    pub fn new(dims: usize) -> Self {
        Self { dims, flat: Vec::with_capacity(32 * dims) }
    }

    pub fn len(&self) -> usize {
        self.flat.len() / self.dims.max(1)
    }

    pub fn point(&self, index: usize) -> &[f32] {
        &self.flat[index * self.dims..][..self.dims]
    }

    pub fn push(&mut self, point: &[f32]) {
        self.flat.extend_from_slice(point);
    }

    pub fn set(&mut self, index: usize, point: &[f32]) {
        self.flat[index * self.dims..][..self.dims].copy_from_slice(point);
    }

    /// Without the points from `from` up to but not with `to`.
    pub fn cut(&mut self, from: usize, to: usize) {
        self.flat.drain(from * self.dims..to * self.dims);
    }

    pub fn reverse(&mut self) {
        let n = self.len();
        for i in 0..n / 2 {
            let (head, tail) = self.flat.split_at_mut((n - 1 - i) * self.dims);
            head[i * self.dims..][..self.dims].swap_with_slice(&mut tail[..self.dims]);
        }
    }

    /// Puts another way in the place of the last point, which is its first one up to rounding.
    pub fn replace_last(&mut self, other: &Way) {
        self.flat.truncate(self.flat.len() - self.dims);
        self.flat.extend_from_slice(&other.flat);
    }

    /// With a point in the middle of every line.
    pub fn halve(&mut self) {
        let mut flat = Vec::with_capacity(self.flat.len() * 2);
        for i in 0..self.len() {
            let here = self.point(i);
            flat.extend_from_slice(here);
            if i + 1 < self.len() {
                flat.extend(here.iter().zip(self.point(i + 1)).map(|(a, b)| 0.5 * (a + b)));
            }
        }
        self.flat = flat;
    }

    /// The length of all lines together.
    pub fn cost(&self) -> f32 {
        let mut vector = vec![0.0; self.dims];
        (1..self.len()).map(|i| gap(self.point(i - 1), self.point(i), &mut vector)).sum()
    }

    /// In 64 bits.
    pub fn points(&self) -> Vec<Vec<f64>> {
        (0..self.len()).map(|i| self.point(i).iter().map(|&x| f64::from(x)).collect()).collect()
    }
}
