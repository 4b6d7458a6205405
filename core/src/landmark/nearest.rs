//! Nearest and second nearest landmark, exactly, by one pass over the table.
//!
//! **Method.** With A = ‖a‖² of the view and B = ‖b‖² of a landmark (stored), ‖a − b‖² = A + B − 2a·b. Candidates are
//! compared as fractions: ‖a − b‖² over 1 (Euclidean) or over A + B (nSSD), cross-multiplied in 64 bits, so ranking
//! involves no rounding. Of equals the first in the table wins. Only the two winners become floats.
//!
//! **Cost.** l·k multiply-adds; the table is streamed once and nothing of it is kept, so memory does not depend on l.
//!
//! **Limits.** Coefficients within [`coefficient_limit`](crate::eigenspace::coefficient_limit) keep squared distances
//! below 2³¹ and A + B below 2³⁰; the atlas parser and the projection see to that.

use super::{LandmarkTable, Metric, Table, row_len};
use crate::{eigenspace::Coefficients, math::sqrt};

/// A landmark and how far away it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Index in the table, 0-based.
    pub landmark: u32,
    /// Distance in the metric's unit; finite.
    pub distance: f32,
}

/// The two nearest landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The nearest.
    pub first: Match,
    /// The second nearest; `None` in a table of one.
    pub second: Option<Match>,
}

/// A landmark and its distance as an exact fraction.
#[derive(Clone, Copy)]
struct Scored {
    landmark: u32,
    squared_distance: u32,
    divisor: u32,
}

impl LandmarkTable<'_> {
    /// The landmarks nearest to `coefficients`. `None` when their number is not the table's k.
    #[must_use]
    pub fn nearest(&self, coefficients: &Coefficients) -> Option<Nearest> {
        let view = coefficients.values();
        if view.len() != usize::from(self.dimensions) {
            return None;
        }
        let stride = row_len(self.dimensions, self.width());
        let (first, second) = match self.coefficients {
            Table::I16(values) => self.scan(
                view,
                coefficients.squared_norm(),
                values.chunks_exact(stride),
            ),
            Table::I8(values) => self.scan(
                view,
                coefficients.squared_norm(),
                values.chunks_exact(stride),
            ),
        };
        Some(Nearest {
            first: self.measured(first?),
            second: second.map(|scored| self.measured(scored)),
        })
    }

    fn scan<'t, C: Copy + Into<i32> + 't>(
        &self,
        view: &[i16],
        squared_norm: u32,
        rows: impl Iterator<Item = &'t [C]>,
    ) -> (Option<Scored>, Option<Scored>) {
        let (mut first, mut second): (Option<Scored>, Option<Scored>) = (None, None);
        for ((row, &row_norm), landmark) in rows.zip(self.squared_norms).zip(0..) {
            let dot: i32 = view
                .iter()
                .zip(row)
                .map(|(&a, &b)| i32::from(a) * b.into())
                .sum();
            let sum = squared_norm + row_norm;
            let squared_distance = sum.wrapping_sub((2 * dot) as u32);
            let divisor = match self.metric {
                Metric::Euclid => 1,
                Metric::Nssd => sum.max(1),
            };
            let scored = Scored {
                landmark,
                squared_distance,
                divisor,
            };
            if first.is_none_or(|best| scored.is_nearer_than(best)) {
                second = first;
                first = Some(scored);
            } else if second.is_none_or(|best| scored.is_nearer_than(best)) {
                second = Some(scored);
            }
        }
        (first, second)
    }

    /// The fraction as a distance in the metric's unit.
    fn measured(&self, scored: Scored) -> Match {
        let ratio = scored.squared_distance as f32 / scored.divisor as f32;
        let distance = match self.metric {
            Metric::Euclid => (sqrt(ratio) * self.step).min(f32::MAX),
            Metric::Nssd => 0.5 * ratio,
        };
        Match {
            landmark: scored.landmark,
            distance,
        }
    }
}

impl Scored {
    fn is_nearer_than(self, other: Self) -> bool {
        u64::from(self.squared_distance) * u64::from(other.divisor)
            < u64::from(other.squared_distance) * u64::from(self.divisor)
    }
}
