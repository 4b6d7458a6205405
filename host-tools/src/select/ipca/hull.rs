//! The affine hull of the landmarks: orthonormal directions from the first of them, by Gram-Schmidt.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Directions that span what landmarks differ in from the first one.
pub struct Hull {
    pixels: usize,
    /// d rows of m.
    directions: Vec<f64>,
}

impl Hull {
    /// Of one landmark: no directions.
    fn new(pixels: usize) -> Self {
        Self {
            pixels,
            directions: Vec::new(),
        }
    }

    /// Of the vectors in `members` (rows of `pixels` numbers) and the origin. Returns also the residual of each to
    /// those before it, and leaves out those that are at most `zero`.
    pub fn of(members: &[f64], pixels: usize, zero: f64) -> (Self, Vec<f64>) {
        let mut hull = Self::new(pixels);
        let mut residuals = Vec::with_capacity(members.len() / pixels);
        for member in members.chunks_exact(pixels) {
            let mut reduced = member.to_vec();
            let residual = hull.reduce(&mut reduced)[0];
            residuals.push(residual);
            if residual > zero {
                hull.push(&reduced, residual);
            }
        }
        (hull, residuals)
    }

    /// Directions so far, d.
    pub fn dimensions(&self) -> usize {
        self.directions.len() / self.pixels
    }

    /// Removes the directions from every row of `deviations`, twice: the second pass removes what rounding left in the
    /// first. Returns the norms of what is left, which are the distances to the hull.
    pub fn reduce(&self, deviations: &mut [f64]) -> Vec<f64> {
        let (count, m) = (deviations.len() / self.pixels, self.pixels);
        if self.dimensions() > 0 {
            for _ in 0..2 {
                let parts = self.parts(deviations, 0);
                matmul(
                    MatMut::from_row_major_slice_mut(deviations, count, m),
                    Accum::Add,
                    parts.as_ref(),
                    MatRef::from_row_major_slice(&self.directions, self.dimensions(), m),
                    -1.0,
                    Par::Seq,
                );
            }
        }
        let rows = deviations.chunks_exact(m);
        rows.map(|row| row.iter().map(|x| x * x).sum::<f64>().sqrt())
            .collect()
    }

    /// Coordinates of every row of `deviations` along the directions from number `first` on: one row each.
    pub fn parts(&self, deviations: &[f64], first: usize) -> Mat<f64> {
        let (count, m) = (deviations.len() / self.pixels, self.pixels);
        let newer = &self.directions[first * m..];
        let mut parts = Mat::zeros(count, newer.len() / m);
        matmul(
            parts.as_mut(),
            Accum::Replace,
            MatRef::from_row_major_slice(deviations, count, m),
            MatRef::from_row_major_slice(newer, newer.len() / m, m).transpose(),
            1.0,
            Par::Seq,
        );
        parts
    }

    /// Adds the direction of what [`reduce`](Self::reduce) has left of a landmark, which has this norm.
    pub fn push(&mut self, reduced: &[f64], norm: f64) {
        self.directions.extend(reduced.iter().map(|x| x / norm));
    }
}
