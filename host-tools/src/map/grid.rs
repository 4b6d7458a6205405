//! Which windows of a map are candidates.
//!
//! The report's layout (section 3.1, corrected): windows side by side in rows, then windows centered on the inner
//! corners of the first. On a map whose sides are not whole multiples of the window, the rows are centered. A dense
//! grid instead takes a window every `stride` pixels.

use eigenmark_core::landmark::{
    Lattice, Lattices, Point,
    lattice::{candidate_count, place},
};

use super::Map;

/// The candidates of a map: square windows of one size, numbered from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    window_px: u32,
    lattices: Lattices,
}

/// Why a map has no such grid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GridError {
    /// A window does not fit into the map.
    #[error(
        "a view of {window_px}×{window_px} pixels does not fit into the map of {width}×{height}"
    )]
    WindowTooLarge {
        /// Side of the window.
        window_px: u32,
        /// Width of the map.
        width: u32,
        /// Height of the map.
        height: u32,
    },
    /// Corners of windows lie between pixels.
    #[error("views of {window_px}×{window_px} pixels do not lie on whole pixels of the map")]
    BetweenPixels {
        /// Side of the window.
        window_px: u32,
    },
    /// A window lies beyond the map.
    #[error("a view of {window_px}×{window_px} pixels around ({}, {}) does not lie on the map", place[0], place[1])]
    OffMap {
        /// Side of the window.
        window_px: u32,
        /// Its center, rounded down.
        place: [i64; 2],
    },
    /// There are more rows or columns than can be numbered.
    #[error(
        "a stride of {stride_px} gives more than 65535 views per row or column; choose a larger one"
    )]
    TooMany {
        /// The stride asked for.
        stride_px: u32,
    },
}

impl Grid {
    /// The report's layout with windows of `window_px`×`window_px`.
    ///
    /// # Errors
    /// When not even one window fits.
    pub fn report(map: &Map, window_px: u32) -> Result<Self, GridError> {
        check_fit(map, window_px)?;
        let (columns, rows) = (map.width() / window_px, map.height() / window_px);
        let left = (map.width() - columns * window_px) / 2;
        let top = (map.height() - rows * window_px) / 2;
        let half = window_px / 2;
        let first = lattice((left, top), window_px, window_px, (columns, rows))?;
        let mut lattices: Lattices = [first].into_iter().collect();
        if columns > 1 && rows > 1 {
            let corners = lattice(
                (left + half, top + half),
                window_px,
                window_px,
                (columns - 1, rows - 1),
            )?;
            lattices.extend([corners]);
        }
        Ok(Self {
            window_px,
            lattices,
        })
    }

    /// A window every `stride_px` pixels, from the top-left corner as far as windows fit.
    ///
    /// # Errors
    /// When not even one window fits, or there are too many.
    ///
    /// # Panics
    /// When the stride is zero.
    pub fn dense(map: &Map, window_px: u32, stride_px: u32) -> Result<Self, GridError> {
        check_fit(map, window_px)?;
        let columns = (map.width() - window_px) / stride_px + 1;
        let rows = (map.height() - window_px) / stride_px + 1;
        let only = lattice((0, 0), window_px, stride_px, (columns, rows))?;
        Ok(Self {
            window_px,
            lattices: [only].into_iter().collect(),
        })
    }

    /// The windows of `window_px`×`window_px` pixels around the points of some lattices, such as an atlas names.
    ///
    /// # Errors
    /// When a window does not lie on the map, or not on whole pixels of it.
    pub fn around(map: &Map, window_px: u32, lattices: &Lattices) -> Result<Self, GridError> {
        check_fit(map, window_px)?;
        let half = window_px as f32 / 2.0;
        let is_on_map = |at: f32, size: u32| at >= half && at + half <= size as f32;
        let is_whole = |length: f32| length.fract() == 0.0;
        for lattice in lattices {
            let Point { x_px, y_px } = lattice.origin;
            if lattice.stride_px < 1.0
                || ![lattice.stride_px, x_px - half, y_px - half]
                    .into_iter()
                    .all(is_whole)
            {
                return Err(GridError::BetweenPixels { window_px });
            }
            let last = lattice.point(u32::from(lattice.columns) - 1, u32::from(lattice.rows) - 1);
            for Point { x_px, y_px } in [lattice.origin, last] {
                if !is_on_map(x_px, map.width()) || !is_on_map(y_px, map.height()) {
                    let place = [x_px, y_px].map(|at| at as i64);
                    return Err(GridError::OffMap { window_px, place });
                }
            }
        }
        Ok(Self {
            window_px,
            lattices: lattices.clone(),
        })
    }

    /// Side of a window, in map pixels: a view's footprint.
    #[must_use]
    pub fn window_px(&self) -> u32 {
        self.window_px
    }

    /// The lattices of window centers.
    #[must_use]
    pub fn lattices(&self) -> &Lattices {
        &self.lattices
    }

    /// Number of candidates, n.
    #[must_use]
    pub fn count(&self) -> u32 {
        candidate_count(&self.lattices)
    }

    /// The place of candidate `view` (1-based): the center of its window.
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn place(&self, view: u32) -> Point {
        place(&self.lattices, view).unwrap_or_else(|| panic!("view {view} of {}", self.count()))
    }

    /// Top-left pixel of the window of candidate `view` (1-based).
    #[must_use]
    pub fn corner(&self, view: u32) -> (u32, u32) {
        let place = self.place(view);
        let half = self.window_px as f32 / 2.0;
        ((place.x_px - half) as u32, (place.y_px - half) as u32)
    }
}

fn check_fit(map: &Map, window_px: u32) -> Result<(), GridError> {
    let (width, height) = (map.width(), map.height());
    if window_px == 0 || window_px > width || window_px > height {
        return Err(GridError::WindowTooLarge {
            window_px,
            width,
            height,
        });
    }
    Ok(())
}

fn lattice(
    corner: (u32, u32),
    window_px: u32,
    stride_px: u32,
    count: (u32, u32),
) -> Result<Lattice, GridError> {
    let half = window_px as f32 / 2.0;
    let too_many = |_| GridError::TooMany { stride_px };
    Ok(Lattice {
        origin: Point {
            x_px: corner.0 as f32 + half,
            y_px: corner.1 as f32 + half,
        },
        stride_px: stride_px as f32,
        columns: u16::try_from(count.0).map_err(too_many)?,
        rows: u16::try_from(count.1).map_err(too_many)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::GrayImage;

    fn map(width: u32, height: u32) -> Map {
        Map::from_luminance("test", GrayImage::new(width, height))
    }

    #[test]
    fn the_reports_map_has_its_83_views() {
        let grid = Grid::report(&map(1600, 1200), 200).expect("fits");
        assert_eq!(grid.count(), 83);
        assert_eq!(grid.corner(1), (0, 0));
        assert_eq!(grid.corner(48), (1400, 1000));
        assert_eq!(grid.corner(49), (100, 100));
        assert_eq!(grid.corner(83), (1300, 900));
    }

    #[test]
    fn odd_windows_stay_on_whole_pixels_inside_the_map() {
        let grid = Grid::report(&map(1010, 1000), 125).expect("fits");
        assert_eq!(grid.count(), 64 + 49);
        assert_eq!(grid.corner(1), (5, 0));
        assert_eq!(grid.corner(65), (67, 62));
        for view in 1..=grid.count() {
            let (x, y) = grid.corner(view);
            assert!(x + 125 <= 1010 && y + 125 <= 1000);
            assert_eq!(
                grid.place(view),
                Point {
                    x_px: x as f32 + 62.5,
                    y_px: y as f32 + 62.5
                }
            );
        }
    }

    #[test]
    fn a_dense_grid_reaches_the_far_corner() {
        let grid = Grid::dense(&map(1600, 1200), 200, 8).expect("fits");
        assert_eq!(grid.count(), 176 * 126);
        assert_eq!(grid.corner(grid.count()), (1400, 1000));
    }

    #[test]
    fn windows_that_do_not_fit_are_refused() {
        let error = Grid::report(&map(100, 300), 200).expect_err("too large");
        assert_eq!(
            error,
            GridError::WindowTooLarge {
                window_px: 200,
                width: 100,
                height: 300
            }
        );
        assert_eq!(
            Grid::dense(&map(70_000, 300), 200, 1),
            Err(GridError::TooMany { stride_px: 1 })
        );
    }
}
