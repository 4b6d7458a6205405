//! Which views of a map are candidates: the windows of its lattices, seen at some headings and from some altitudes.
//!
//! **What.** Every heading at every altitude is a [`Layer`], which shows all windows once. Numbers instead of poses make a
//! landmark's place, heading and altitude cost nothing in flash, and its neighbours computable.
//!
//! **Notation.** w windows, N headings, numbered from 0 as altitudes are. Candidates are numbered from 1:
//! number − 1 = (altitude · N + heading) · w + window. Heading h is 2π·h/N, clockwise from map-up to frame-up; altitudes
//! are ratios of actual over nominal.
//!
//! **Cost.** Three divisions of integers per number.

use core::f32::consts::TAU;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{Lattice, Lattices, Point};

/// Headings of a survey, at most: every 5°.
pub const MAX_HEADINGS: u8 = 72;

/// Altitudes of a survey, at most.
pub const MAX_ALTITUDES: usize = 4;

/// Ratios of actual over nominal altitude, ascending.
pub type Altitudes = Vec<f32, MAX_ALTITUDES>;

/// Where, in which direction and from what altitude the candidates of a map are seen.
///
/// # Examples
/// ```
/// use eigenmark_core::landmark::{Lattice, Point, Survey};
/// let origin = Point { x_px: 100.0, y_px: 100.0 };
/// let grid = Lattice { origin, stride_px: 200.0, columns: 8, rows: 6 };
/// let survey = Survey { headings: 4, ..Survey::nominal([grid].into_iter().collect()) };
/// assert_eq!(survey.count(), 4 * 48);
/// assert_eq!(survey.place(48 + 10), Some(Point { x_px: 300.0, y_px: 300.0 }));
/// assert_eq!(survey.heading_rad(48 + 10), Some(90_f32.to_radians()));
/// assert_eq!(survey.place(4 * 48 + 1), None);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Survey {
    /// Where the windows lie.
    pub lattices: Lattices,
    /// Headings, evenly spread from map-up on, N: 1 to [`MAX_HEADINGS`].
    pub headings: u8,
    /// Altitudes; at least one.
    pub altitudes: Altitudes,
}

/// One heading at one altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Its number, 0-based.
    pub index: u32,
    /// Heading in radians, clockwise from map-up to frame-up, 0 to below 2π.
    pub heading_rad: f32,
    /// Actual over nominal altitude.
    pub altitude_ratio: f32,
}

/// A window of a lattice, seen in a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Its number, 1-based.
    pub view: u32,
    /// The heading and the altitude it is seen at.
    pub layer: Layer,
    /// The lattice it belongs to.
    pub lattice: Lattice,
    /// Its column, 0-based.
    pub column: u32,
    /// Its row, 0-based.
    pub row: u32,
}

impl Survey {
    /// Windows seen at nominal heading and altitude only.
    #[must_use]
    pub fn nominal(lattices: Lattices) -> Self {
        Self {
            lattices,
            headings: 1,
            altitudes: [1.0].into_iter().collect(),
        }
    }

    /// Number of windows, w; saturating.
    #[must_use]
    pub fn windows(&self) -> u32 {
        let counts = self.lattices.iter().map(Lattice::count);
        counts.fold(0, u32::saturating_add)
    }

    /// Number of layers.
    #[must_use]
    pub fn layers(&self) -> u32 {
        u32::from(self.headings) * self.altitudes.len() as u32
    }

    /// Number of candidates; saturating.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.windows().saturating_mul(self.layers())
    }

    /// Angle between neighbouring headings in radians, 2π/N.
    #[must_use]
    pub fn heading_step_rad(&self) -> f32 {
        TAU / f32::from(self.headings.max(1))
    }

    /// The layer with number `index` (0-based), `None` when there is no such layer.
    #[must_use]
    pub fn layer(&self, index: u32) -> Option<Layer> {
        let headings = u32::from(self.headings);
        let heading = index.checked_rem(headings)?;
        let altitude = index.checked_div(headings)?;
        Some(Layer {
            index,
            heading_rad: TAU * heading as f32 / headings as f32,
            altitude_ratio: *self.altitudes.get(altitude as usize)?,
        })
    }

    /// The candidate with number `view` (1-based), `None` when there is no such number.
    #[must_use]
    pub fn find(&self, view: u32) -> Option<Candidate> {
        let index = view.checked_sub(1)?;
        let layer = self.layer(index.checked_div(self.windows())?)?;
        let mut window = index.checked_rem(self.windows())?;
        for lattice in &self.lattices {
            if window < lattice.count() {
                let columns = u32::from(lattice.columns);
                return Some(Candidate {
                    view,
                    layer,
                    lattice: *lattice,
                    column: window.checked_rem(columns)?,
                    row: window.checked_div(columns)?,
                });
            }
            window -= lattice.count();
        }
        None
    }

    /// The place of candidate `view` (1-based), `None` when there is no such number.
    #[must_use]
    pub fn place(&self, view: u32) -> Option<Point> {
        Some(self.find(view)?.place())
    }

    /// The heading of candidate `view` (1-based) in radians, clockwise from map-up to frame-up, 0 to below 2π; `None`
    /// when there is no such number.
    #[must_use]
    pub fn heading_rad(&self, view: u32) -> Option<f32> {
        Some(self.find(view)?.layer.heading_rad)
    }

    /// Actual over nominal altitude of candidate `view` (1-based), `None` when there is no such number.
    #[must_use]
    pub fn altitude_ratio(&self, view: u32) -> Option<f32> {
        Some(self.find(view)?.layer.altitude_ratio)
    }

    /// The number of the same window from the same altitude, `steps` headings further clockwise; `None` when there is
    /// no candidate `view`.
    #[must_use]
    pub fn turned(&self, view: u32, steps: i32) -> Option<u32> {
        let (windows, headings) = (self.windows(), u32::from(self.headings));
        let index = view.checked_sub(1)?;
        let layer = index.checked_div(windows)?;
        let heading = layer.checked_rem(headings)?;
        let steps = steps.checked_rem_euclid(self.headings.into())? as u32;
        let turned = (heading + steps).checked_rem(headings)?;
        let first = index.checked_sub(heading.checked_mul(windows)?)?;
        first
            .checked_add(turned.checked_mul(windows)?)?
            .checked_add(1)
    }
}

impl Candidate {
    /// The center of its window.
    #[must_use]
    pub fn place(&self) -> Point {
        self.lattice.point(self.column, self.row)
    }

    /// Candidate `view` where it is in the same row, and not before this one: what
    /// [`Survey::find`] says, without its divisions.
    #[must_use]
    #[inline]
    pub fn along(&self, view: u32) -> Option<Self> {
        let column = self.column.checked_add(view.checked_sub(self.view)?)?;
        let is_inside = column < u32::from(self.lattice.columns);
        is_inside.then_some(Self {
            view,
            column,
            ..*self
        })
    }

    /// The number of the window `right` columns to the right and `down` rows below in the same layer, `None` beyond the
    /// lattice.
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

    /// The report's layout on its map.
    fn lattices() -> Lattices {
        let lattice = |at, columns, rows| Lattice {
            origin: Point { x_px: at, y_px: at },
            stride_px: 200.0,
            columns,
            rows,
        };
        [lattice(100.0, 8, 6), lattice(200.0, 7, 5)]
            .into_iter()
            .collect()
    }

    #[test]
    fn the_reports_views_lie_where_its_figure_shows_them() {
        let survey = Survey::nominal(lattices());
        assert_eq!((survey.count(), survey.layers()), (83, 1));
        let at = |x_px, y_px| Some(Point { x_px, y_px });
        for (view, expected) in [
            (0, None),
            (1, at(100.0, 100.0)),
            (48, at(1500.0, 1100.0)),
            (49, at(200.0, 200.0)),
            (83, at(1400.0, 1000.0)),
            (84, None),
        ] {
            assert_eq!(survey.place(view), expected, "{view}");
        }

        let found = survey
            .find(57)
            .expect("in the second lattice, at its second row");
        assert_eq!((found.column, found.row), (1, 1));
        assert_eq!(
            [(-1, 0), (0, 1), (1, -1)].map(|(x, y)| found.neighbor(x, y)),
            [Some(56), Some(64), Some(51)]
        );
        assert_eq!(
            [(-2, 0), (6, 0), (0, -2), (0, 4)].map(|(x, y)| found.neighbor(x, y)),
            [None; 4]
        );
    }

    #[test]
    fn numbers_go_through_windows_then_headings_then_altitudes() {
        let survey = Survey {
            lattices: lattices(),
            headings: 12,
            altitudes: [0.8, 1.25].into_iter().collect(),
        };
        assert_eq!(survey.count(), 83 * 24);
        let mut expected = 1;
        for altitude_ratio in [0.8, 1.25] {
            for heading in 0..12_u8 {
                for window in 1..=83 {
                    let found = survey.find(expected).expect("a number");
                    assert_eq!(
                        found.place(),
                        Survey::nominal(lattices()).place(window).expect("a window")
                    );
                    assert_eq!(found.layer.altitude_ratio, altitude_ratio);
                    let degrees = found.layer.heading_rad.to_degrees();
                    assert!((degrees - 30.0 * f32::from(heading)).abs() < 1e-4);
                    expected += 1;
                }
            }
        }
        assert_eq!(survey.find(expected), None);
    }

    #[test]
    fn neighbors_stay_in_their_layer() {
        let survey = Survey {
            headings: 3,
            ..Survey::nominal(lattices())
        };
        let found = survey.find(83 + 1).expect("the first window, turned");
        assert_eq!(found.neighbor(1, 1), Some(83 + 10));
        assert_eq!(found.neighbor(-1, 0), None);
    }

    #[test]
    fn rows_go_on_to_their_ends() {
        let survey = Survey {
            headings: 2,
            ..Survey::nominal(lattices())
        };
        for first in 1..=survey.count() {
            let candidate = survey.find(first).expect("a number");
            for view in 0..=survey.count() + 1 {
                let along = candidate.along(view);
                let is_there = survey.find(view).filter(|found| {
                    let row =
                        |candidate: &Candidate| (candidate.layer, candidate.lattice, candidate.row);
                    view >= first && row(found) == row(&candidate)
                });
                assert_eq!(along, is_there, "{first} {view}");
            }
        }
    }

    #[test]
    fn headings_are_a_circle() {
        let survey = Survey {
            headings: 4,
            altitudes: [1.0, 1.2].into_iter().collect(),
            ..Survey::nominal(lattices())
        };
        for first in [1, 40, 83, 4 * 83 + 7] {
            let turned = [-1, 0, 1, 3, 4, -401].map(|steps| survey.turned(first, steps));
            let expected = [3, 0, 1, 3, 0, 3].map(|heading| Some(first + heading * 83));
            assert_eq!(turned, expected);
        }
        assert_eq!(survey.turned(0, 1), None);
        assert_eq!(
            Survey {
                headings: 0,
                ..survey
            }
            .turned(1, 1),
            None
        );
    }

    #[test]
    fn empty_surveys_have_no_candidates() {
        let survey = Survey::nominal(Lattices::new());
        assert_eq!(
            (survey.count(), survey.find(1), survey.turned(1, 1)),
            (0, None, None)
        );
        let survey = Survey {
            headings: 0,
            ..Survey::nominal(lattices())
        };
        assert_eq!((survey.count(), survey.find(1)), (0, None));
    }
}
