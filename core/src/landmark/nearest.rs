//! Nearest and second nearest landmark, exactly, by one pass over the table.
//!
//! **Method.** With A = ‖a‖² of the view and B = ‖b‖² of a landmark (stored), ‖a − b‖² = A + B − 2a·b. Candidates are
//! compared without rounding: fractions ‖a − b‖² over 1 (Euclidean) or over A + B (nSSD) are cross-multiplied in 64
//! bits; cosines a·b/√B are compared as squares, in 96 bits where single precision cannot tell them apart. Of equals
//! the first in the table wins. Only the two winners become distances.
//!
//! **Prior.** What is matched is an argument: ranges of the table. All of it is one range; a set of plausible places is
//! several.
//!
//! **Cost.** l·k multiply-adds; the table is streamed once and nothing of it is kept, so memory does not depend on l.
//!
//! **Limits.** Coefficients within [`coefficient_limit`](crate::eigenspace::coefficient_limit) keep squared distances
//! below 2³¹ and A + B below 2³⁰; the atlas parser and the projection see to that.

use core::ops::Range;

use super::{LandmarkTable, Metric, Width};
use crate::{
    eigenspace::{Coefficients, MAX_DIMENSIONS},
    kernel::{self, BATCH, Dots, Greatest, Pair, Ranked},
    math::{angle, at_most, sqrt},
};

/// Single precision rounds by less than this in the four operations of a comparison of cosines.
const ROUNDING: f32 = 1.0 / (1 << 20) as f32;

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
    /// The second nearest; `None` when only one was looked at.
    pub second: Option<Match>,
}

/// The nearest two so far, of one view: the greater its fraction, the nearer a landmark.
struct Search {
    metric: Metric,
    /// A.
    squared_norm: i32,
    /// Numerators are a·b, for Euclid 2a·b − B. Denominators are A + B for nSSD, B, of which the root is meant, for
    /// cosine, and 1 for Euclid.
    greatest: Greatest,
}

impl LandmarkTable<'_> {
    /// The landmarks nearest to `coefficients` among some ranges of the table (0-based), in ascending order: what lies
    /// outside of the table or before the end of an earlier range is left out. Coefficients are as
    /// [`project`](crate::eigenspace::Eigenspace::project) makes them, within the limit of the table's width. `None` when there is none, or the number of coefficients is not the table's k.
    #[must_use]
    pub fn nearest(
        &self,
        coefficients: &Coefficients,
        among: impl IntoIterator<Item = Range<u32>>,
    ) -> Option<Nearest> {
        self.search(coefficients, &mut among.into_iter())
    }

    /// Compiled once for all ways to name ranges.
    #[inline(never)]
    fn search(
        &self,
        coefficients: &Coefficients,
        among: &mut dyn Iterator<Item = Range<u32>>,
    ) -> Option<Nearest> {
        if coefficients.dimensions() != self.dimensions {
            return None;
        }
        let mut search = Search::new(self.metric, coefficients.squared_norm());
        match self.width {
            Width::I16 => {
                let view = coefficients.pairs(self.row_len);
                self.scan(among, Width::I16, view, &mut search);
            }
            Width::I8 => self.scan_split(among, coefficients, &mut search),
        }
        Some(Nearest {
            first: search.measured(search.greatest.first, self.step)?,
            second: search.measured(search.greatest.second, self.step),
        })
    }

    /// A view's coefficients as the table's kernel wants them.
    pub(super) fn prepare<'v>(
        &self,
        coefficients: &'v Coefficients,
        split: &'v mut [Pair; MAX_DIMENSIONS as usize / 2],
    ) -> &'v [Pair] {
        match self.width {
            Width::I16 => coefficients.pairs(self.row_len),
            Width::I8 => {
                let view = split.get_mut(..2 * self.row_len).unwrap_or_default();
                kernel::split(coefficients.pairs(view.len()), view);
                view
            }
        }
    }

    /// Every landmark, for [`nearest`](Self::nearest).
    #[must_use]
    pub fn everywhere(&self) -> core::iter::Once<Range<u32>> {
        core::iter::once(0..self.len() as u32)
    }

    /// Searches ranges of a table of 8-bit coefficients: apart, because of the room that it needs.
    #[inline(never)]
    fn scan_split(
        &self,
        among: &mut dyn Iterator<Item = Range<u32>>,
        coefficients: &Coefficients,
        search: &mut Search,
    ) {
        let mut split = [Pair::default(); MAX_DIMENSIONS as usize / 2];
        let view = self.prepare(coefficients, &mut split);
        self.scan(among, Width::I8, view, search);
    }

    /// Searches ranges of the table.
    #[inline(always)]
    fn scan(
        &self,
        among: &mut dyn Iterator<Item = Range<u32>>,
        width: Width,
        view: &[Pair],
        search: &mut Search,
    ) {
        let len = self.row_len;
        let mut dots = Dots::new();
        let mut done = 0;
        for range in among {
            let mut start = (range.start as usize).max(done);
            let end = (range.end as usize).min(self.len());
            done = end.max(done);
            while start < end {
                let count = (end - start).min(BATCH);
                let (Some(rows), Some(norms)) = (
                    self.coefficients.get(start * len..),
                    self.squared_norms.get(start..start + count),
                ) else {
                    return;
                };
                search.offer(start as u32, dots.of(width, view, rows, count), norms);
                start += count;
            }
        }
    }
}

impl Search {
    fn new(metric: Metric, squared_norm: u32) -> Self {
        Self {
            metric,
            squared_norm: squared_norm as i32,
            greatest: Greatest::NONE,
        }
    }

    /// Offers the landmarks from number `start` on, by their dot products and squared norms.
    #[inline(always)]
    fn offer(&mut self, start: u32, dots: &[i32], norms: &[u32]) {
        let greatest = &mut self.greatest;
        match self.metric {
            Metric::Nssd if self.squared_norm == 0 => of_nothing(start, norms, greatest),
            Metric::Nssd => kernel::keep_greatest(dots, norms, self.squared_norm, start, greatest),
            Metric::Euclid => by_distance(start, dots, norms, greatest),
            Metric::Cosine => by_cosine(start, dots, norms, greatest),
        }
    }

    /// The distance in the metric's unit; `None` when no landmark was found.
    fn measured(&self, ranked: Ranked, step: f32) -> Option<Match> {
        if ranked.row == u32::MAX {
            return None;
        }
        let (numerator, divisor) = (ranked.numerator, ranked.denominator);
        let distance = match self.metric {
            // A − (2a·b − B)
            Metric::Euclid => {
                let squared = self.squared_norm.wrapping_sub(numerator);
                at_most(sqrt(squared.max(0) as f32) * step, f32::MAX)
            }
            Metric::Nssd if self.squared_norm == 0 => 0.5 - 0.5 * numerator as f32,
            // (A + B − 2a·b) / 2(A + B)
            Metric::Nssd => {
                let squared = divisor.wrapping_sub(numerator.wrapping_mul(2));
                0.5 * (squared as f32 / divisor as f32)
            }
            Metric::Cosine => angle_between(numerator, self.squared_norm, divisor),
        };
        Some(Match {
            landmark: ranked.row,
            distance,
        })
    }
}

/// The angle between two vectors from their dot product and squared norms.
#[inline(never)]
fn angle_between(dot: i32, a: i32, b: i32) -> f32 {
    let (dot, norms) = (i64::from(dot), i64::from(a) * i64::from(b));
    // Cauchy-Schwarz: not negative. Both are exact, so that small angles are, too.
    let across = (norms - dot * dot).max(0);
    if norms == 0 {
        core::f32::consts::FRAC_PI_2
    } else {
        angle(sqrt(across as f32), dot as f32)
    }
}

/// nSSD of a view at the origin: ½ for every landmark, but 0/0, which is 0, for one that is there, too.
#[cold]
#[inline(never)]
fn of_nothing(start: u32, norms: &[u32], greatest: &mut Greatest) {
    for (&norm, row) in norms.iter().zip(start..) {
        let ranked = Ranked {
            row,
            numerator: i32::from(norm == 0),
            denominator: 1,
        };
        greatest.take(ranked, Ranked::is_greater);
    }
}

#[inline(never)]
fn by_distance(start: u32, dots: &[i32], norms: &[u32], greatest: &mut Greatest) {
    for ((&dot, &norm), row) in dots.iter().zip(norms).zip(start..) {
        let numerator = dot.wrapping_mul(2).wrapping_sub(norm as i32);
        if numerator > greatest.second.numerator {
            let ranked = Ranked {
                row,
                numerator,
                denominator: 1,
            };
            greatest.take(ranked, |a, b| a.numerator > b.numerator);
        }
    }
}

#[inline(never)]
fn by_cosine(start: u32, dots: &[i32], norms: &[u32], greatest: &mut Greatest) {
    let mut row = 0;
    while let (Some(rest), Some(norms_of_rest)) = (dots.get(row..), norms.get(row..)) {
        // Single precision decides where it can; negative cosines are left to the exact comparison.
        let numerator = greatest.second.numerator.max(0) as f32;
        let square = numerator * numerator / greatest.second.denominator.max(1) as f32;
        row += kernel::find_square(rest, norms_of_rest, square * (1.0 - ROUNDING));
        let (Some(&dot), Some(&norm)) = (dots.get(row), norms.get(row)) else {
            return;
        };
        let ranked = Ranked {
            row: start + row as u32,
            numerator: dot,
            denominator: norm as i32,
        };
        greatest.take(ranked, has_greater_cosine);
        row += 1;
    }
}

/// Whether n/√d > m/√c. A zero divisor comes with a zero numerator: a zero vector is at a right angle to everything.
fn has_greater_cosine(ranked: &Ranked, than: &Ranked) -> bool {
    let [n, m] = [ranked, than].map(|ranked| ranked.numerator);
    // n²·c and m²·d, in 96 bits.
    let of_n = wide_product(n, than.denominator);
    let of_m = wide_product(m, ranked.denominator);
    match (n > 0, m > 0) {
        (true, true) => of_n > of_m,
        (false, false) => of_n < of_m,
        (is_greater, _) => is_greater,
    }
}

/// n²·d with d at least 1: the upper 64 bits, and the lower 32.
fn wide_product(n: i32, d: i32) -> (u64, u32) {
    let (n, d) = (u64::from(n.unsigned_abs()), d.max(1) as u64);
    let square = n * n;
    let low = (square & u64::from(u32::MAX)) * d;
    ((square >> 32) * d + (low >> 32), low as u32)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::super::{Record, row_len};
    use super::*;

    /// Stored words of a table.
    fn stored(rows: &[Vec<i16>], dimensions: u8, width: Width) -> Vec<Pair> {
        let mut words = Vec::new();
        for row in rows {
            let mut numbers: Vec<i16> = row
                .chunks(width.per_number())
                .map(|pair| width.pack(pair[0], pair.get(1).copied().unwrap_or(0)))
                .collect();
            numbers.resize(2 * row_len(dimensions, width), 0);
            words.extend(numbers.chunks_exact(2).map(|pair| Pair([pair[0], pair[1]])));
        }
        words
    }

    /// Order of two rows by the definition of the metric, in integers that hold everything.
    fn order(metric: Metric, view: &[i16], a: &[i16], b: &[i16]) -> core::cmp::Ordering {
        let dot = |a: &[i16], b: &[i16]| -> i128 {
            a.iter()
                .zip(b)
                .map(|(&a, &b)| i128::from(a) * i128::from(b))
                .sum()
        };
        let fraction = |row: &[i16]| {
            let (norms, product) = (dot(view, view) + dot(row, row), dot(view, row));
            match metric {
                Metric::Euclid => (norms - 2 * product, 1),
                Metric::Nssd if norms == 0 => (0, 1),
                Metric::Nssd => (norms - 2 * product, norms),
                Metric::Cosine => (-product * product.abs(), dot(row, row).max(1)),
            }
        };
        let ((n, d), (m, c)) = (fraction(a), fraction(b));
        (n * c).cmp(&(m * d))
    }

    fn coefficients(values: &[i16]) -> Coefficients {
        Coefficients::from_values(values).expect("at most 128")
    }

    fn metrics() -> impl Strategy<Value = Metric> {
        prop_oneof![
            Just(Metric::Nssd),
            Just(Metric::Euclid),
            Just(Metric::Cosine)
        ]
    }

    /// Small numbers tie often, and large ones reach the limit.
    fn table() -> impl Strategy<Value = (Width, Vec<Vec<i16>>)> {
        (1_usize..=128, 1_usize..200, any::<bool>(), any::<bool>()).prop_flat_map(
            |(k, l, is_small, is_wide)| {
                let width = if is_wide { Width::I16 } else { Width::I8 };
                let limit = if is_small { 2 } else { width.limit(k as u8) };
                let rows = prop::collection::vec(prop::collection::vec(-limit..=limit, k), l);
                (Just(width), rows)
            },
        )
    }

    proptest! {
        #[test]
        fn nearest_matches_reference(
            metric in metrics(), (width, mut rows) in table(), cuts in any::<[u16; 4]>(),
        ) {
            let view = rows.swap_remove(0);
            prop_assume!(!rows.is_empty());
            let dimensions = view.len() as u8;
            let words = stored(&rows, dimensions, width);
            let norms: Vec<u32> = rows.iter().map(|row| coefficients(row).squared_norm()).collect();
            let records = std::vec![Record { view: 1, radius: 0.0 }; rows.len()];
            let table = LandmarkTable {
                metric,
                dimensions,
                step: 1.0,
                width,
                row_len: row_len(dimensions, width),
                is_whole: true,
                coefficients: &words,
                squared_norms: &norms,
                records: &records,
            };
            // Two ranges that overlap, some of them empty or beyond the table.
            let mut cuts = cuts.map(|cut| u32::from(cut) % (rows.len() as u32 + 20));
            cuts.sort_unstable();
            let among = [cuts[0]..cuts[2], cuts[1]..cuts[3]];
            let whole = 0..rows.len() as u32;
            for among in [core::slice::from_ref(&whole), &among] {
                let looked_at = among.iter().cloned().flatten().filter(|&row| (row as usize) < rows.len());
                let mut expected: Vec<u32> = looked_at.collect();
                expected.sort_unstable();
                expected.dedup();
                expected.sort_by(|&a, &b| order(metric, &view, &rows[a as usize], &rows[b as usize]));
                let found = table.nearest(&coefficients(&view), among.iter().cloned());
                prop_assert_eq!(found.map(|found| found.first.landmark), expected.first().copied());
                let second = found.and_then(|found| found.second);
                prop_assert_eq!(second.map(|second| second.landmark), expected.get(1).copied());
                if let Some(Nearest { first, second: Some(second) }) = found {
                    prop_assert!(first.distance <= second.distance);
                }
            }
        }
    }

    #[test]
    fn distances_are_in_the_metrics_unit() {
        let words = [Pair([0, 4]), Pair([-3, 0])];
        let records = [Record {
            view: 1,
            radius: 0.0,
        }; 2];
        for (metric, step, expected) in [
            (Metric::Nssd, 1.0, (0.5, 1.0)),
            (Metric::Euclid, 0.5, (2.5, 3.0)),
            (
                Metric::Cosine,
                1.0,
                (core::f32::consts::FRAC_PI_2, core::f32::consts::PI),
            ),
        ] {
            let table = LandmarkTable {
                metric,
                dimensions: 2,
                step,
                width: Width::I16,
                row_len: 1,
                is_whole: true,
                coefficients: &words,
                squared_norms: &[16, 9],
                records: &records,
            };
            let nearest = table
                .nearest(&coefficients(&[3, 0]), table.everywhere())
                .expect("two rows");
            let second = nearest.second.expect("two rows");
            assert_eq!((nearest.first.distance, second.distance), expected);
        }
    }
}
