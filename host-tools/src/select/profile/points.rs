//! Points of an eigenspace, row after row.

use rayon::prelude::*;

/// n points of the same number of dimensions, which is at least 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points<'a> {
    values: &'a [f64],
    dimensions: usize,
}

impl<'a> Points<'a> {
    /// Rows of `dimensions` numbers; `values` holds whole rows.
    pub(super) fn new(values: &'a [f64], dimensions: usize) -> Self {
        Self { values, dimensions }
    }

    pub(super) fn values(self) -> &'a [f64] {
        self.values
    }

    pub(super) fn dimensions(self) -> usize {
        self.dimensions
    }

    /// n.
    pub(super) fn count(self) -> usize {
        self.values.len() / self.dimensions
    }

    /// n − 1 of (2.37), but at least 1.
    pub(super) fn others(self) -> f64 {
        self.count().saturating_sub(1).max(1) as f64
    }

    /// Point `index`, 0-based.
    pub(super) fn point(self, index: usize) -> &'a [f64] {
        &self.values[index * self.dimensions..][..self.dimensions]
    }

    pub(super) fn iter(self) -> std::slice::ChunksExact<'a, f64> {
        self.values.chunks_exact(self.dimensions)
    }

    /// The squared norm of every point, with a relative error of k·u.
    pub(super) fn squared_norms(self) -> Vec<f64> {
        self.values
            .par_chunks_exact(self.dimensions)
            .map(|point| point.iter().map(|x| x * x).sum())
            .collect()
    }
}
