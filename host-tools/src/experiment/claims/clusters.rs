//! Claims 8 and 9.

use super::{Claim, MISSING, Part};
use crate::experiment::Grid;

pub fn claims(_grid: &Grid) -> Vec<Claim> {
    [
        (
            8,
            "CCC is 0.7–0.8 for Euclidean distance with average, centroid or single linkage (4.1)",
        ),
        (
            9,
            "Mean silhouette worsens with k, and there is no natural number of clusters (4.1)",
        ),
    ]
    .map(|(claim, statement)| {
        Claim::new(
            claim,
            statement,
            vec![Part::open("clusters", MISSING)],
            vec![],
        )
    })
    .to_vec()
}
