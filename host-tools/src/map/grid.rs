//! Which windows of a map are candidates.
//!
//! The report's layout (section 3.1, corrected): windows side by side in rows, then windows centered on the inner
//! corners of the first. On a map whose sides are not whole multiples of the window, the rows are centered. A dense
//! grid instead takes a window every `stride` pixels.
//!
//! Windows that are also seen turned or from higher up show more of the map than their own square: those of which that
//! would leave the map are left out, in all layers.

use eigenmark_core::landmark::{Altitudes, Candidate, Lattice, Lattices, Layer, Point, Survey};

use super::Map;

/// The candidates of a map: square windows of one size, seen at some headings and altitudes, numbered from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    window_px: u32,
    survey: Survey,
}

/// Why a map has no such grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// Every window leaves the map when it is seen at all headings and altitudes.
    #[error(
        "views of {window_px}×{window_px} pixels cover up to {reach_px:.0} pixels when they are turned and seen from \
         all altitudes, which does not fit into the map of {width}×{height}"
    )]
    LayersTooLarge {
        /// Side of the window.
        window_px: u32,
        /// Side of the upright square that holds all that is seen.
        reach_px: f64,
        /// Width of the map.
        width: u32,
        /// Height of the map.
        height: u32,
    },
    /// There are more candidates than can be numbered.
    #[error("{layers} layers of {windows} views are more than can be numbered; raise --stride")]
    TooManyLayers {
        /// Headings times altitudes.
        layers: u32,
        /// Windows per layer.
        windows: u32,
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
            survey: Survey::nominal(lattices),
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
            survey: Survey::nominal([only].into_iter().collect()),
        })
    }

    /// The same windows, seen at each of `headings` headings from each of `altitudes`; without those that would show
    /// anything beyond the map.
    ///
    /// # Errors
    /// When no window is left, or there are too many candidates.
    pub fn layered(
        self,
        map: &Map,
        headings: u8,
        altitudes: &Altitudes,
    ) -> Result<Self, GridError> {
        let survey = Survey {
            headings,
            altitudes: altitudes.clone(),
            ..self.survey
        };
        let reach_px = reach_px(self.window_px, &survey);
        let (width, height) = (map.width(), map.height());
        let inside = survey.lattices.iter();
        let lattices: Lattices = inside
            .filter_map(|lattice| inset(lattice, reach_px / 2.0, (width, height)))
            .collect();
        if lattices.is_empty() {
            return Err(GridError::LayersTooLarge {
                window_px: self.window_px,
                reach_px,
                width,
                height,
            });
        }
        let survey = Survey { lattices, ..survey };
        let (layers, windows) = (survey.layers(), survey.windows());
        if layers.checked_mul(windows).is_none() {
            return Err(GridError::TooManyLayers { layers, windows });
        }
        Ok(Self { survey, ..self })
    }

    /// The windows of `window_px`×`window_px` pixels of a survey, such as an atlas has.
    ///
    /// # Errors
    /// When a window does not lie on the map, or not on whole pixels of it, or shows what lies beyond the map when it is
    /// seen at all headings and altitudes.
    pub fn of(map: &Map, window_px: u32, survey: &Survey) -> Result<Self, GridError> {
        check_fit(map, window_px)?;
        let half = window_px as f32 / 2.0;
        let is_on_map = |at: f32, size: u32| at >= half && at + half <= size as f32;
        let is_whole = |length: f32| length.fract() == 0.0;
        for lattice in &survey.lattices {
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
        let grid = Self {
            window_px,
            survey: Survey::nominal(survey.lattices.clone()),
        };
        let layered = grid.layered(map, survey.headings, &survey.altitudes)?;
        if layered.survey == *survey {
            Ok(layered)
        } else {
            Err(GridError::LayersTooLarge {
                window_px,
                reach_px: reach_px(window_px, survey),
                width: map.width(),
                height: map.height(),
            })
        }
    }

    /// Side of a window, in map pixels: a view's footprint.
    #[must_use]
    pub fn window_px(&self) -> u32 {
        self.window_px
    }

    /// Where its windows lie, and how they are seen.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// Number of candidates, n.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.survey.count()
    }

    /// Candidate `view` (1-based).
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn candidate(&self, view: u32) -> Candidate {
        let found = self.survey.find(view);
        found.unwrap_or_else(|| panic!("view {view} of {}", self.count()))
    }

    /// The place of candidate `view` (1-based): the center of its window.
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn place(&self, view: u32) -> Point {
        self.candidate(view).place()
    }

    /// Top-left pixel of the window of candidate `view` (1-based), whatever its heading and altitude.
    #[must_use]
    pub fn corner(&self, view: u32) -> (u32, u32) {
        let place = self.place(view);
        let half = self.window_px as f32 / 2.0;
        ((place.x_px - half) as u32, (place.y_px - half) as u32)
    }
}

/// Side of the upright square that holds what a window shows at any heading from any altitude, in map pixels.
fn reach_px(window_px: u32, survey: &Survey) -> f64 {
    let of_layer = |layer: Layer| {
        let (sin, cos) = f64::from(layer.heading_rad).sin_cos();
        let reach = f64::from(layer.altitude_ratio) * (sin.abs() + cos.abs());
        // Headings are rounded: quarter turns reach no further than their window.
        (reach * 1e6).round() / 1e6
    };
    let layers = (0..survey.layers()).filter_map(|index| survey.layer(index));
    // A window takes part in all layers: no nominal one, no smaller reach.
    let widest = layers.map(of_layer).fold(1.0, f64::max);
    f64::from(window_px) * widest
}

/// The points of a lattice that are at least `margin_px` away from the map's edge, if there are any.
fn inset(lattice: &Lattice, margin_px: f64, size_px: (u32, u32)) -> Option<Lattice> {
    let along = |origin_px: f32, count: u16, size_px: u32| {
        let is_inside = |index: &u16| {
            let at = f64::from(origin_px + f32::from(*index) * lattice.stride_px);
            at >= margin_px && at + margin_px <= f64::from(size_px)
        };
        let first = (0..count).find(is_inside)?;
        let end = (first..count).take_while(is_inside).count() as u16;
        Some((origin_px + f32::from(first) * lattice.stride_px, end))
    };
    let (x_px, columns) = along(lattice.origin.x_px, lattice.columns, size_px.0)?;
    let (y_px, rows) = along(lattice.origin.y_px, lattice.rows, size_px.1)?;
    Some(Lattice {
        origin: Point { x_px, y_px },
        columns,
        rows,
        ..*lattice
    })
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

    #[test]
    fn windows_that_leave_the_map_when_turned_are_left_out() {
        let map = map(1600, 1200);
        let grid = Grid::report(&map, 200).expect("fits");
        let nominal: Altitudes = [1.0].into_iter().collect();
        let layered = |headings, altitudes: &Altitudes| {
            let grid = grid.clone().layered(&map, headings, altitudes);
            grid.expect("room")
        };
        for headings in [1, 2, 4] {
            assert_eq!(
                layered(headings, &nominal).count(),
                83 * u32::from(headings)
            );
        }
        // Half a diagonal is 141 pixels: the outer windows of the first lattice leave.
        let turned = layered(12, &nominal);
        assert_eq!(turned.count(), 12 * (6 * 4 + 7 * 5));
        assert_eq!(turned.corner(1), (200, 200));
        assert_eq!(
            turned.place(turned.survey().windows() + 25),
            turned.place(25)
        );
        let lower: Altitudes = [0.5].into_iter().collect();
        assert_eq!(layered(1, &lower).count(), 83);
        let higher: Altitudes = [1.0, 2.0, 4.0].into_iter().collect();
        assert_eq!(layered(1, &higher).count(), 3 * (4 * 2 + 5 * 3));
        let far: Altitudes = [4.0].into_iter().collect();
        // 1131 of 1200 pixels: a single row of corners is left.
        assert_eq!(layered(72, &far).count(), 72 * 3);
        let again = Grid::of(&map, 200, turned.survey());
        assert_eq!(again, Ok(turned));
        let unturned = Survey {
            headings: 12,
            ..grid.survey().clone()
        };
        let error = Grid::of(&map, 200, &unturned).expect_err("leaves the map");
        assert!(matches!(error, GridError::LayersTooLarge { .. }), "{error}");
    }

    #[test]
    fn layers_that_do_not_fit_are_refused() {
        let map = map(250, 250);
        let grid = Grid::dense(&map, 200, 1).expect("fits");
        let error = grid.layered(&map, 8, &[1.0].into_iter().collect());
        let message = "views of 200×200 pixels cover up to 283 pixels when they are turned and seen from all altitudes, \
                       which does not fit into the map of 250×250";
        assert_eq!(error.expect_err("too large").to_string(), message);
    }
}
