//! Which landmarks are plausible, when the vehicle knows about where it is: what [`nearest`](LandmarkTable::nearest)
//! takes as its argument.
//!
//! **Method.** In a table of whole lattices the landmarks within a circle are one run per row of a lattice. In any other
//! table every landmark is looked at, and is a run of its own.
//!
//! **Cost.** One root per row of the lattices, or a comparison per landmark.

use core::ops::Range;

use super::{LandmarkTable, Lattice, Lattices, Point, lattice::place};
use crate::math::sqrt;

impl<'a> LandmarkTable<'a> {
    /// The landmarks at most `radius_px` map pixels away from `center`, as ascending ranges of the table (0-based);
    /// none when the radius is negative. `lattices` are those of the table's atlas.
    pub fn near(
        &self,
        lattices: &Lattices,
        center: Point,
        radius_px: f32,
    ) -> impl Iterator<Item = Range<u32>> + Clone + use<'a> {
        let (whole, listed) = if self.is_whole {
            (lattices.clone(), &[][..])
        } else {
            (Lattices::new(), self.records)
        };
        let mut next = 0_u32;
        let firsts = (0..whole.capacity()).map_while(move |index| {
            let (lattice, first) = (*whole.get(index)?, next);
            next = next.saturating_add(lattice.count());
            Some((first, lattice))
        });
        let rows = firsts.flat_map(move |(first, lattice)| {
            let columns = u32::from(lattice.columns);
            (0..u32::from(lattice.rows)).filter_map(move |row| {
                let run = run_of(&lattice, row, center, radius_px)?;
                let start = first.saturating_add(row * columns);
                Some(start.saturating_add(run.start)..start.saturating_add(run.end))
            })
        });
        let lattices = lattices.clone();
        let singles = listed.iter().zip(0..).filter_map(move |(record, index)| {
            let at = place(&lattices, record.view)?;
            let (x, y) = (at.x_px - center.x_px, at.y_px - center.y_px);
            let is_near = radius_px >= 0.0 && x * x + y * y <= radius_px * radius_px;
            is_near.then_some(index..index + 1)
        });
        rows.chain(singles)
    }
}

/// The columns of a lattice's row within a circle; `None` when there are none.
fn run_of(lattice: &Lattice, row: u32, center: Point, radius_px: f32) -> Option<Range<u32>> {
    let origin = lattice.point(0, row);
    let down = origin.y_px - center.y_px;
    let half = radius_px * radius_px - down * down;
    if !(half >= 0.0 && radius_px >= 0.0) {
        return None;
    }
    let half = sqrt(half);
    let column = |x_px: f32| (x_px - origin.x_px) / lattice.stride_px;
    let (from, to) = (column(center.x_px - half), column(center.x_px + half));
    // `as` truncates and saturates: rounded up and down for what is not negative.
    let first = (from as u32).saturating_add(u32::from(from > from as u32 as f32));
    let end = if to >= 0.0 {
        (to as u32).saturating_add(1)
    } else {
        0
    };
    let end = end.min(u32::from(lattice.columns));
    (first < end).then_some(first..end)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::{
        kernel::Pair,
        landmark::{Metric, Record, Width},
    };

    fn lattice(x_px: f32, stride_px: f32, columns: u16, rows: u16) -> Lattice {
        let origin = Point { x_px, y_px: 50.0 };
        Lattice {
            origin,
            stride_px,
            columns,
            rows,
        }
    }

    proptest! {
        #[test]
        fn near_matches_reference(
            x in -100.0_f32..500.0, y in -100.0_f32..500.0, radius in 0.0_f32..400.0, is_whole in any::<bool>(),
        ) {
            let lattices: Lattices =
                [lattice(50.0, 20.0, 13, 9), lattice(60.0, 33.0, 7, 11)].into_iter().collect();
            let views = 1..=13 * 9 + 7 * 11;
            let mut records: Vec<Record> = views.map(|view| Record { view, radius: 0.0 }).collect();
            if !is_whole {
                records.reverse();
                records.truncate(40);
            }
            let table = LandmarkTable {
                metric: Metric::Nssd,
                dimensions: 1,
                step: 1.0,
                width: Width::I16,
                row_len: 1,
                is_whole,
                coefficients: &std::vec![Pair::default(); records.len()],
                squared_norms: &std::vec![0; records.len()],
                records: &records,
            };
            let found: Vec<u32> = table.near(&lattices, Point { x_px: x, y_px: y }, radius).flatten().collect();
            for (record, index) in records.iter().zip(0..) {
                let at = place(&lattices, record.view).expect("a candidate");
                let distance = (at.x_px - x).hypot(at.y_px - y);
                // On the circle itself rounding decides.
                if (distance - radius).abs() > 1e-3 {
                    prop_assert_eq!(found.contains(&index), distance < radius);
                }
            }
            prop_assert!(found.is_sorted());
        }
    }

    #[test]
    fn circles_beyond_all_numbers_hold_nothing_or_everything() {
        let lattice = lattice(50.0, 1e-30, 60, 1);
        for x_px in [1e20, -1e20, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            let center = Point { x_px, y_px: 50.0 };
            assert_eq!(run_of(&lattice, 0, center, 1.0), None, "{x_px}");
        }
        let center = Point {
            x_px: 0.0,
            y_px: 0.0,
        };
        assert_eq!(run_of(&lattice, 0, center, 1e19), Some(0..60));
        assert_eq!(run_of(&lattice, 0, center, -1.0), None);
    }
}
