//! The dissimilarity of every pair of views.

use super::{ClusterError, LARGEST, check};
use crate::select::Dissimilarity;

/// The upper triangle of a symmetrical matrix, row by row, without its diagonal: n·(n − 1)/2 numbers, as SciPy and kodama
/// have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pairwise {
    values: Vec<f64>,
    count: usize,
    dissimilarity: Dissimilarity,
}

impl Pairwise {
    /// Compares all points with each other: rows of `dimensions` coordinates.
    ///
    /// # Errors
    /// When there is no point, rows are not whole, or numbers are not finite or too large.
    pub fn new(
        dissimilarity: Dissimilarity,
        points: &[f64],
        dimensions: usize,
    ) -> Result<Self, ClusterError> {
        let count = check(points, dimensions)?;
        let row = |index: usize| &points[index * dimensions..][..dimensions];
        let mut values = Vec::with_capacity(count * (count - 1) / 2);
        for a in 0..count {
            for b in a + 1..count {
                let value = dissimilarity.between(row(a), row(b));
                if value.is_nan() || value > LARGEST {
                    return Err(ClusterError::NotFinite { view: b + 1 });
                }
                values.push(value);
            }
        }
        Ok(Self {
            values,
            count,
            dissimilarity,
        })
    }

    /// The numbers: rows of the upper triangle.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Number of views, n.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// What the views were compared by.
    #[must_use]
    pub fn dissimilarity(&self) -> Dissimilarity {
        self.dissimilarity
    }
}

/// Where the pair of rows `a` < `b` of `count` stands.
pub(super) fn index(count: usize, a: usize, b: usize) -> usize {
    a * (2 * count - a - 1) / 2 + b - a - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_stand_in_rows() {
        let pairwise = Pairwise::new(Dissimilarity::Ssd, &[0.0, 1.0, 3.0, 7.0], 1);
        let pairwise = pairwise.expect("finite");
        assert_eq!(pairwise.values(), [1.0, 9.0, 49.0, 4.0, 36.0, 16.0]);
        let pairs = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
        for (place, (a, b)) in pairs.enumerate() {
            assert_eq!(index(4, a, b), place);
        }
    }

    #[test]
    fn dissimilarities_that_are_too_large_are_refused() {
        let found = Pairwise::new(Dissimilarity::Ssd, &[0.0, 1e100], 1);
        assert_eq!(found, Err(ClusterError::NotFinite { view: 2 }));
        assert!(Pairwise::new(Dissimilarity::Euclid, &[0.0, 1e100], 1).is_ok());
    }
}
