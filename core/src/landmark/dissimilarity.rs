//! How dissimilar a view is from every landmark: what a [`Belief`](crate::belief::Belief) observes.
//!
//! **What.** The squared dissimilarity δ: ‖a − b‖² (Euclid, in squared eigenspace units), nSSD, or 1 − cos (cosine, half
//! the squared distance of the vectors brought to length one). It rises with the metric's distance and needs no angle.
//!
//! **Cost.** The table is streamed once, as for [`nearest`](LandmarkTable::nearest), and some ten operations per landmark.

use super::{LandmarkTable, Metric};
use crate::{
    eigenspace::{Coefficients, MAX_DIMENSIONS},
    kernel::{BATCH, Dots, Pair},
    math::{at_least, at_most, sqrt},
};

impl LandmarkTable<'_> {
    /// Calls `visit` with every landmark (0-based), in their order, and its squared dissimilarity: finite, not negative.
    /// Of no landmark when the number of coefficients is not the table's k.
    pub fn dissimilarities(&self, coefficients: &Coefficients, mut visit: impl FnMut(u32, f32)) {
        if coefficients.dimensions() != self.dimensions {
            return;
        }
        let mut split = [Pair::default(); MAX_DIMENSIONS as usize / 2];
        let view = self.prepare(coefficients, &mut split);
        let squared_norm = coefficients.squared_norm();
        let measure = Measure::new(self.metric, squared_norm, self.step);
        let mut dots = Dots::new();
        let mut landmark = 0;
        let batches = self.coefficients.chunks((BATCH * self.row_len).max(1));
        for (rows, norms) in batches.zip(self.squared_norms.chunks(BATCH)) {
            let dots = dots.of(self.width, view, rows, norms.len());
            for (&dot, &norm) in dots.iter().zip(norms) {
                visit(landmark, measure.squared(dot, norm));
                landmark += 1;
            }
        }
    }
}

/// What is the same for all landmarks.
struct Measure {
    metric: Metric,
    /// A.
    squared_norm: u32,
    /// step² for Euclid, 1/√A for cosine.
    factor: f32,
}

impl Measure {
    fn new(metric: Metric, squared_norm: u32, step: f32) -> Self {
        let factor = match metric {
            Metric::Euclid => step * step,
            Metric::Nssd => 1.0,
            Metric::Cosine => 1.0 / sqrt(squared_norm.max(1) as f32),
        };
        Self {
            metric,
            squared_norm,
            factor,
        }
    }

    /// δ of a landmark from a·b and B.
    #[inline]
    fn squared(&self, dot: i32, norm: u32) -> f32 {
        let sum = self.squared_norm.wrapping_add(norm);
        let squared = || sum.wrapping_sub(dot.wrapping_mul(2) as u32) as f32;
        match self.metric {
            Metric::Euclid => at_most(squared() * self.factor, f32::MAX),
            Metric::Nssd if sum == 0 => 0.0,
            Metric::Nssd => 0.5 * (squared() / sum as f32),
            // A zero vector is at a right angle to everything.
            Metric::Cosine => {
                let cosine = dot as f32 * self.factor / sqrt(norm.max(1) as f32);
                at_least(1.0 - cosine, 0.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::landmark::{Record, Width};

    proptest! {
        #[test]
        fn dissimilarities_match_reference(
            rows in proptest::collection::vec([-500_i16..500, -500_i16..500], 1..300),
            view in [-500_i16..500, -500_i16..500],
        ) {
            let pairs: Vec<Pair> = rows.iter().map(|&row| Pair(row)).collect();
            let squared = |[x, y]: [i16; 2]| (i32::from(x).pow(2) + i32::from(y).pow(2)) as u32;
            let norms: Vec<u32> = rows.iter().map(|&row| squared(row)).collect();
            let records: Vec<Record> =
                (0..rows.len() as u32).map(|index| Record { view: index + 1, radius: 0.0 }).collect();
            for metric in [Metric::Euclid, Metric::Nssd, Metric::Cosine] {
                let table = LandmarkTable {
                    metric, dimensions: 2, step: 0.5, width: Width::I16, row_len: 1, is_whole: false,
                    coefficients: &pairs, squared_norms: &norms, records: &records,
                };
                let coefficients = Coefficients::from_values(&view).expect("two");
                let mut next = 0;
                let mut worst = 0.0_f64;
                table.dissimilarities(&coefficients, |landmark, found| {
                    assert_eq!(landmark, next);
                    let [a, b] = [view, rows[next as usize]].map(|row| row.map(f64::from));
                    let norm = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
                    let between = norm([a[0] - b[0], a[1] - b[1]]);
                    let (lengths, sum) = ((norm(a) * norm(b)).sqrt(), norm(a) + norm(b));
                    let expected = match metric {
                        Metric::Euclid => between / 4.0,
                        Metric::Nssd if sum == 0.0 => 0.0,
                        Metric::Nssd => between / (2.0 * sum),
                        Metric::Cosine if lengths == 0.0 => 1.0,
                        Metric::Cosine => 1.0 - (a[0] * b[0] + a[1] * b[1]) / lengths,
                    };
                    worst = worst.max((f64::from(found) - expected).abs() / expected.max(1.0));
                    next += 1;
                });
                prop_assert_eq!(next as usize, rows.len());
                prop_assert!(worst < 1e-6, "{worst}");
            }
        }
    }
}
