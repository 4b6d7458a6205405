//! How far a view may be shifted: the catchment area of a landmark; report section 3.5.
//!
//! **What.** Positions around the landmark are visited in a spiral. One counts when the view of its window is localized at
//! the landmark and one of its eight neighbors counts already. The spiral ends with the first turn on which none counts.
//!
//! **Limits.** Windows reach to the map's edge; positions beyond do not count, and a catchment that touches the edge says
//! so.

use serde::{Deserialize, Serialize};

use super::End;
use crate::evaluate::{everywhere::Everywhere, judge::Criterion};

/// The positions at which a landmark is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Catchment {
    /// Their number: an area in map pixels.
    pub area_px: u64,
    /// [`End::Map`] when windows at some of them touch the edge of the map.
    pub end: End,
}

/// The catchment of landmark `landmark` (0-based), the corner of whose window is at `corner`.
#[must_use]
pub fn catchment(
    everywhere: &Everywhere<'_>,
    landmark: u32,
    corner: (u32, u32),
    criterion: Criterion,
) -> Catchment {
    spiral(everywhere.positions(), corner, |x, y| {
        criterion.holds(everywhere.verdict(x, y), landmark)
    })
}

/// The catchment of `start` among columns and rows of positions at which something `holds`; its area is their number.
pub(crate) fn spiral(
    (columns, rows): (u32, u32),
    start: (u32, u32),
    holds: impl Fn(u32, u32) -> bool,
) -> Catchment {
    let mut counted = Counted {
        holds,
        columns,
        rows,
        is_counted: vec![false; columns as usize * rows as usize],
        area_px: 0,
        end: End::Failed,
    };
    let (x, y) = (i64::from(start.0), i64::from(start.1));
    counted.count_if_localized(x, y);
    let mut turn = 0;
    let mut before = 0;
    while counted.area_px > before {
        before = counted.area_px;
        turn += 1;
        for (right, down) in ring(turn) {
            if counted.has_counted_neighbor(x + right, y + down) {
                counted.count_if_localized(x + right, y + down);
            }
        }
    }
    Catchment {
        area_px: counted.area_px,
        end: counted.end,
    }
}

/// The spiral's turn at a distance: starts to the right of the middle and goes down first, all the way around.
fn ring(distance: i64) -> impl Iterator<Item = (i64, i64)> {
    let d = distance;
    let right_side = (0..d).map(move |i| (d, i));
    let bottom = (0..2 * d).map(move |i| (d - i, d));
    let left_side = (0..2 * d).map(move |i| (-d, d - i));
    let top = (0..2 * d).map(move |i| (i - d, -d));
    let rest = (0..d).map(move |i| (d, i - d));
    right_side
        .chain(bottom)
        .chain(left_side)
        .chain(top)
        .chain(rest)
}

/// What counts so far.
struct Counted<F> {
    holds: F,
    columns: u32,
    rows: u32,
    is_counted: Vec<bool>,
    area_px: u64,
    end: End,
}

impl<F: Fn(u32, u32) -> bool> Counted<F> {
    /// Where a position stands in row-major order; `None` beyond the map.
    fn index(&self, x: i64, y: i64) -> Option<usize> {
        let (columns, rows) = (i64::from(self.columns), i64::from(self.rows));
        let is_on_map = (0..columns).contains(&x) && (0..rows).contains(&y);
        is_on_map.then(|| (y * columns + x) as usize)
    }

    fn has_counted_neighbor(&self, x: i64, y: i64) -> bool {
        (y - 1..=y + 1).any(|y| {
            (x - 1..=x + 1).any(|x| self.index(x, y).is_some_and(|index| self.is_counted[index]))
        })
    }

    fn count_if_localized(&mut self, x: i64, y: i64) {
        let Some(index) = self.index(x, y) else {
            return;
        };
        if !(self.holds)(x as u32, y as u32) {
            return;
        }
        self.is_counted[index] = true;
        self.area_px += 1;
        let is_at = |at: i64, last: u32| at == 0 || at == i64::from(last) - 1;
        if is_at(x, self.columns) || is_at(y, self.rows) {
            self.end = End::Map;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_go_all_the_way_around_once() {
        for distance in 1..5 {
            let mut visited: Vec<(i64, i64)> = ring(distance).collect();
            let neighbors = visited.windows(2);
            assert!(
                neighbors
                    .map(|w| (w[0].0 - w[1].0).abs() + (w[0].1 - w[1].1).abs())
                    .all(|step| step == 1)
            );
            assert_eq!(visited.len() as i64, 8 * distance);
            assert!(
                visited
                    .iter()
                    .all(|(x, y)| x.abs().max(y.abs()) == distance)
            );
            visited.sort_unstable();
            visited.dedup();
            assert_eq!(visited.len() as i64, 8 * distance);
        }
    }
}
