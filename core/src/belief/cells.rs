//! The grid that a belief is held over: the whole map, also where no view of a landmark fits any more. A vehicle can be
//! there, and nothing that it sees says so.

use crate::{
    atlas::Atlas,
    landmark::{Lattice, Point},
    math::sqrt,
};

/// Cells, at most.
const MAX_COUNT: u32 = u16::MAX as u32;

/// A regular grid of square cells over a map, once per heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// Center of the first cell.
    origin: Point,
    /// Side of a cell, in map pixels.
    side_px: f32,
    columns: u16,
    rows: u16,
    headings: u8,
}

impl Cells {
    /// No cell.
    pub(super) const NONE: Self = Self {
        origin: super::ORIGIN,
        side_px: 0.0,
        columns: 0,
        rows: 0,
        headings: 0,
    };

    /// The grid for an atlas with as many cells as `capacity` states have room for. Where its landmarks are one whole
    /// lattice, a cell is centered on every landmark, or on every second, third, … one. Where there is no room for all
    /// headings, there is one.
    pub(super) fn of(atlas: &Atlas<'_>, capacity: usize) -> Self {
        let survey = &atlas.header().survey;
        let headings = Some(survey.headings.max(1))
            .filter(|&headings| usize::from(headings) <= capacity)
            .unwrap_or(1);
        let room = u32::try_from(capacity / usize::from(headings)).unwrap_or(u32::MAX);
        let room = room.clamp(1, MAX_COUNT);
        let map_px = atlas.header().map_px;
        match (survey.lattices.as_slice(), atlas.landmarks().is_whole()) {
            ([lattice], true) => Self::on(lattice, map_px, headings, room),
            _ => Self::over(map_px, headings, room),
        }
    }

    /// Every landmark of a lattice, or every second, … and on to the borders of the map.
    fn on(lattice: &Lattice, map_px: (u32, u32), headings: u8, room: u32) -> Self {
        // Cells before the first landmark, and all, along one axis.
        let along = |origin: f32, side: f32, map: u32| {
            let before = ((origin / side) as u32).min(MAX_COUNT);
            let after = ((map as f32 - origin) / side) as u32;
            (before, before.saturating_add(after.min(MAX_COUNT)) + 1)
        };
        let (mut step, mut grid) = (1_u16, None);
        while step < u16::MAX && grid.is_none() {
            let side = lattice.stride_px * f32::from(step);
            let (left, columns) = along(lattice.origin.x_px, side, map_px.0);
            let (above, rows) = along(lattice.origin.y_px, side, map_px.1);
            if columns.saturating_mul(rows) <= room {
                grid = Some(Self {
                    origin: Point {
                        x_px: lattice.origin.x_px - left as f32 * side,
                        y_px: lattice.origin.y_px - above as f32 * side,
                    },
                    side_px: side,
                    columns: columns as u16,
                    rows: rows as u16,
                    headings,
                });
            }
            step += 1;
        }
        grid.unwrap_or_else(|| Self::over(map_px, headings, room))
    }

    /// Squares over a map.
    fn over((width, height): (u32, u32), headings: u8, room: u32) -> Self {
        let [width, height] = [width, height].map(|side| side.max(1) as f32);
        let count = |length: f32, side: f32| ((length / side) as u32).saturating_add(1);
        // The area decides, but for long and narrow maps; some steps of 1 % follow.
        let mut side = sqrt(width * height / room as f32)
            .max(width.max(height) / room as f32)
            .max(1.0);
        for _ in 0..1000 {
            if count(width, side).saturating_mul(count(height, side)) <= room {
                break;
            }
            side *= 1.01;
        }
        let columns = count(width, side).min(room);
        let rows = count(height, side).clamp(1, (room / columns.max(1)).max(1));
        // The same margin on both sides.
        let first = |length: f32, count: u32| (length - (count - 1) as f32 * side) / 2.0;
        Self {
            origin: Point {
                x_px: first(width, columns),
                y_px: first(height, rows),
            },
            side_px: side,
            columns: columns as u16,
            rows: rows as u16,
            headings,
        }
    }

    /// Side of a cell, in map pixels.
    #[must_use]
    pub fn side_px(&self) -> f32 {
        self.side_px
    }

    /// Cells per row.
    #[must_use]
    pub fn columns(&self) -> u16 {
        self.columns
    }

    /// Rows of cells.
    #[must_use]
    pub fn rows(&self) -> u16 {
        self.rows
    }

    /// Headings; at least one.
    #[must_use]
    pub fn headings(&self) -> u8 {
        self.headings
    }

    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        self.layer() * usize::from(self.headings)
    }

    /// Number of cells, which is that of the states of one heading.
    #[must_use]
    pub fn layer(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// The center of a cell.
    #[must_use]
    pub fn center(&self, column: u16, row: u16) -> Point {
        Point {
            x_px: self.origin.x_px + f32::from(column) * self.side_px,
            y_px: self.origin.y_px + f32::from(row) * self.side_px,
        }
    }

    /// The cell that a point lies in, as an index into a layer; the nearest one when it lies beyond the grid by less
    /// than a cell.
    #[must_use]
    pub fn find(&self, point: Point) -> Option<usize> {
        let along = |at: f32, origin: f32, count: u16| {
            let cell = (at - origin) / self.side_px + 0.5;
            let last = u32::from(count).checked_sub(1)?;
            (cell > -1.0 && cell < last as f32 + 2.0).then(|| (cell as u32).min(last) as usize)
        };
        let column = along(point.x_px, self.origin.x_px, self.columns)?;
        let row = along(point.y_px, self.origin.y_px, self.rows)?;
        Some(row * usize::from(self.columns) + column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(stride_px: f32, columns: u16, rows: u16) -> Lattice {
        let origin = Point {
            x_px: 100.0,
            y_px: 50.0,
        };
        Lattice {
            origin,
            stride_px,
            columns,
            rows,
        }
    }

    #[test]
    fn whole_lattices_have_a_cell_per_landmark_as_far_as_there_is_room() {
        // Centers at 100, 120, … 880 and 50, 70, … 630, on a map that goes on by as much.
        let map = (980, 680);
        let all = 50 * 34;
        let cells = Cells::on(&lattice(20.0, 40, 30), map, 1, all);
        assert_eq!((cells.columns, cells.rows, cells.side_px), (50, 34, 20.0));
        assert_eq!((cells.origin.x_px, cells.origin.y_px), (0.0, 10.0));
        let cells = Cells::on(&lattice(20.0, 40, 30), map, 1, all - 1);
        assert_eq!((cells.columns, cells.rows, cells.side_px), (25, 17, 40.0));
        assert_eq!(cells.origin.x_px, 20.0);
        for (column, row) in [(0, 0), (24, 16), (7, 3)] {
            let index = usize::from(row) * 25 + usize::from(column);
            assert_eq!(cells.find(cells.center(column, row)), Some(index));
        }
        let at = |x_px, y_px| cells.find(Point { x_px, y_px });
        assert_eq!(at(20.0 + 19.0, 10.0 + 21.0), Some(25));
        assert_eq!(at(-70.0, 50.0), None);
        assert_eq!(at(f32::NAN, 50.0), None);
    }

    #[test]
    fn maps_are_covered_within_the_room() {
        for (map, room) in [
            ((1600, 1200), 4096),
            ((1, 1), 16),
            ((300, 1), 64),
            ((2, 900), 100),
        ] {
            let cells = Cells::over(map, 1, room);
            assert!(cells.states() <= room as usize && cells.states() > 0);
            let last = Point {
                x_px: map.0 as f32,
                y_px: map.1 as f32,
            };
            for corner in [super::super::ORIGIN, last] {
                assert!(cells.find(corner).is_some(), "{cells:?} {corner:?}");
            }
            assert!(
                map.0.min(map.1) < 10 || cells.states() * 2 > room as usize,
                "{cells:?}"
            );
        }
    }
}
