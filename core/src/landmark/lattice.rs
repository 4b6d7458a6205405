//! Where candidates lie on the map.
//!
//! Candidates are the windows of one or two regular lattices, numbered from 1, row by row, the second lattice after
//! the first. The report's layout (section 3.1, corrected) is 8×6 windows side by side, then 7×5 windows centered on
//! the inner corners of the first. A dense table is one lattice with a small stride. Numbers instead of coordinates
//! make a landmark's place cost nothing in flash, and its neighbours computable.
//!
//! Map coordinates: pixels, x to the right, y down, origin at the top-left corner of the map; the place of a window
//! is its center.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// A point on the map, in map pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Point {
    /// To the right of the map's left edge.
    pub x_px: f32,
    /// Below the map's top edge.
    pub y_px: f32,
}

/// A regular grid of window centers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Center of the first window.
    pub origin: Point,
    /// Distance between neighbouring centers, in map pixels; positive.
    pub stride_px: f32,
    /// Windows per row; at least one.
    pub columns: u16,
    /// Rows of windows; at least one.
    pub rows: u16,
}

/// The lattices of a map, in the order of their numbers.
pub type Lattices = Vec<Lattice, 2>;

impl Lattice {
    /// Number of windows.
    #[must_use]
    pub fn count(&self) -> u32 {
        u32::from(self.columns) * u32::from(self.rows)
    }

    /// Center of the window at `column` and `row`, 0-based.
    #[must_use]
    pub fn point(&self, column: u32, row: u32) -> Point {
        Point {
            x_px: self.origin.x_px + column as f32 * self.stride_px,
            y_px: self.origin.y_px + row as f32 * self.stride_px,
        }
    }
}

/// Number of candidates on all lattices; saturating.
#[must_use]
pub fn candidate_count(lattices: &[Lattice]) -> u32 {
    lattices
        .iter()
        .map(Lattice::count)
        .fold(0, u32::saturating_add)
}

/// The place of candidate `view` (1-based), `None` when there is no such number.
///
/// ```
/// use eigenmark_core::landmark::{Lattice, Point, lattice::place};
/// let grid = Lattice { origin: Point { x_px: 100.0, y_px: 100.0 }, stride_px: 200.0, columns: 8, rows: 6 };
/// assert_eq!(place(&[grid], 10), Some(Point { x_px: 300.0, y_px: 300.0 }));
/// assert_eq!(place(&[grid], 49), None);
/// ```
#[must_use]
pub fn place(lattices: &[Lattice], view: u32) -> Option<Point> {
    let window = find(lattices, view)?;
    Some(window.lattice.point(window.column, window.row))
}

/// A window of a lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its number among all candidates, 1-based.
    pub view: u32,
    /// The lattice it belongs to.
    pub lattice: Lattice,
    /// Its column, 0-based.
    pub column: u32,
    /// Its row, 0-based.
    pub row: u32,
}

/// The window with number `view` (1-based), `None` when there is no such number.
#[must_use]
pub fn find(lattices: &[Lattice], view: u32) -> Option<Window> {
    let mut index = view.checked_sub(1)?;
    for lattice in lattices {
        if index < lattice.count() {
            let columns = u32::from(lattice.columns);
            return Some(Window {
                view,
                lattice: *lattice,
                column: index.checked_rem(columns)?,
                row: index.checked_div(columns)?,
            });
        }
        index -= lattice.count();
    }
    None
}

impl Window {
    /// The number of the window `right` columns to the right and `down` rows below, `None` beyond the lattice.
    #[must_use]
    pub fn neighbor(&self, right: i32, down: i32) -> Option<u32> {
        let column = self.column.checked_add_signed(right)?;
        let row = self.row.checked_add_signed(down)?;
        let columns = u32::from(self.lattice.columns);
        let is_inside = column < columns && row < u32::from(self.lattice.rows);
        let first = self.view - (self.row * columns + self.column);
        is_inside.then(|| first + row * columns + column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reports_views_lie_where_its_figure_shows_them() {
        let corner = Point {
            x_px: 100.0,
            y_px: 100.0,
        };
        let inner = Point {
            x_px: 200.0,
            y_px: 200.0,
        };
        let lattices = [
            Lattice {
                origin: corner,
                stride_px: 200.0,
                columns: 8,
                rows: 6,
            },
            Lattice {
                origin: inner,
                stride_px: 200.0,
                columns: 7,
                rows: 5,
            },
        ];
        assert_eq!(candidate_count(&lattices), 83);
        assert_eq!(place(&lattices, 0), None);
        assert_eq!(place(&lattices, 1), Some(corner));
        assert_eq!(
            place(&lattices, 48),
            Some(Point {
                x_px: 1500.0,
                y_px: 1100.0
            })
        );
        assert_eq!(place(&lattices, 49), Some(inner));
        assert_eq!(
            place(&lattices, 83),
            Some(Point {
                x_px: 1400.0,
                y_px: 1000.0
            })
        );
        assert_eq!(place(&lattices, 84), None);

        let window = find(&lattices, 57).expect("in the second lattice, at its second row");
        assert_eq!((window.column, window.row), (1, 1));
        assert_eq!(
            [(-1, 0), (0, 1), (1, -1)].map(|(x, y)| window.neighbor(x, y)),
            [Some(56), Some(64), Some(51)]
        );
        assert_eq!(
            [(-2, 0), (6, 0), (0, -2), (0, 4)].map(|(x, y)| window.neighbor(x, y)),
            [None; 4]
        );
    }
}
