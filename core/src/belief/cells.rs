//! The grid that a belief is held over.

use crate::{
    atlas::Atlas,
    landmark::{Lattice, Point},
    math::sqrt,
};

/// A regular grid of square cells over the places of all candidates, once per heading.
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
    /// One cell of one pixel at the origin.
    pub(super) const SINGLE: Self = Self {
        origin: super::ORIGIN,
        side_px: 1.0,
        columns: 1,
        rows: 1,
        headings: 1,
    };

    /// The grid for an atlas with as many cells as `capacity` states have room for. Where its landmarks are one whole
    /// lattice, a cell is centered on every landmark, or on every second, third, … one.
    pub(super) fn of(atlas: &Atlas<'_>, capacity: usize) -> Self {
        let survey = &atlas.header().survey;
        let headings = survey.headings.max(1);
        let room = (capacity / usize::from(headings)).max(1) as u32;
        match (survey.lattices.as_slice(), atlas.landmarks().is_whole()) {
            ([lattice], true) => Self::on(lattice, headings, room),
            (lattices, _) => Self::over(lattices, headings, room),
        }
    }

    /// Every landmark of a lattice, or every second, …
    fn on(lattice: &Lattice, headings: u8, room: u32) -> Self {
        let every = |step: u16| (lattice.columns.div_ceil(step), lattice.rows.div_ceil(step));
        let fits = |(columns, rows): (u16, u16)| u32::from(columns) * u32::from(rows) <= room;
        let longest = lattice.columns.max(lattice.rows).max(1);
        let step = (1..=longest).find(|&step| fits(every(step)));
        let step = step.unwrap_or(longest);
        let (columns, rows) = every(step);
        Self {
            origin: lattice.origin,
            side_px: lattice.stride_px * f32::from(step),
            columns,
            rows,
            headings,
        }
    }

    /// The bounding box of some lattices.
    fn over(lattices: &[Lattice], headings: u8, room: u32) -> Self {
        let corners = lattices.iter().flat_map(|lattice| {
            let last = |count: u16| u32::from(count).saturating_sub(1);
            [
                lattice.origin,
                lattice.point(last(lattice.columns), last(lattice.rows)),
            ]
        });
        let (mut least, mut most) = ([f32::MAX; 2], [0.0_f32; 2]);
        for corner in corners {
            least = [least[0].min(corner.x_px), least[1].min(corner.y_px)];
            most = [most[0].max(corner.x_px), most[1].max(corner.y_px)];
        }
        let [width, height] = [most[0] - least[0], most[1] - least[1]].map(|side| side.max(0.0));
        let count = |length: f32, side: f32| ((length / side) as u32).saturating_add(1);
        // The area decides, but for long and narrow boxes; at most a few steps of 1 % follow.
        let mut side = sqrt(width * height / room as f32)
            .max(width.max(height) / room as f32)
            .max(1.0);
        for _ in 0..1000 {
            if count(width, side).saturating_mul(count(height, side)) <= room {
                break;
            }
            side *= 1.01;
        }
        let columns = count(width, side).min(room).min(u16::MAX.into());
        let rows = count(height, side)
            .min(room / columns.max(1))
            .clamp(1, u16::MAX.into());
        Self {
            origin: Point {
                x_px: least[0],
                y_px: least[1],
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
            let last = u32::from(count) - 1;
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
        let cells = Cells::on(&lattice(20.0, 40, 30), 1, 1200);
        assert_eq!((cells.columns, cells.rows, cells.side_px), (40, 30, 20.0));
        let cells = Cells::on(&lattice(20.0, 40, 30), 1, 1199);
        assert_eq!((cells.columns, cells.rows, cells.side_px), (20, 15, 40.0));
        for (column, row) in [(0, 0), (19, 14), (7, 3)] {
            let index = usize::from(row) * 20 + usize::from(column);
            assert_eq!(cells.find(cells.center(column, row)), Some(index));
        }
        let at = |x_px, y_px| cells.find(Point { x_px, y_px });
        assert_eq!(at(100.0 + 19.0, 50.0 + 21.0), Some(20));
        assert_eq!(at(30.0, 50.0), None);
        assert_eq!(at(f32::NAN, 50.0), None);
    }

    #[test]
    fn boxes_are_covered_within_the_room() {
        for (columns, rows, room) in [(8, 6, 4096), (1, 1, 16), (300, 1, 64), (2, 900, 100)] {
            let only = lattice(200.0, columns, rows);
            let cells = Cells::over(&[only], 1, room);
            assert!(cells.states() <= room as usize && cells.states() > 0);
            let last = only.point(u32::from(columns) - 1, u32::from(rows) - 1);
            for corner in [only.origin, last] {
                assert!(cells.find(corner).is_some(), "{cells:?} {corner:?}");
            }
            assert!(
                columns == 1 || rows == 1 || cells.states() * 2 > room as usize,
                "{cells:?}"
            );
        }
    }
}
