//! Which landmarks are plausible, when the vehicle knows about where it is, which way it heads, or how high it flies:
//! what [`nearest`](LandmarkTable::nearest) takes as its argument.
//!
//! **Method.** A layer of a survey stands for the headings and altitudes that are nearest to its own: half a step of the
//! headings to both sides, and ratios up to the geometric mean with the next one; the lowest and the highest altitude
//! stand for everything beyond. It is plausible when that range and the prior have something in common, so that no
//! compass, however exact, points between layers. In the table of a whole survey the landmarks within a circle are one run
//! per row and plausible layer. In any other table every landmark is looked at, and is a run of its own.
//!
//! **Cost.** One root per row and plausible layer, or a comparison per landmark.

use core::ops::Range;

use super::{LandmarkTable, Lattice, Layer, Point, Survey};
use crate::math::{sqrt, turn};

/// By how much rounding may move a heading, in radians: 0.0006°.
const ROUNDING_RAD: f32 = 1e-5;

/// What is known before a frame is looked at; nothing of what is `None`.
///
/// # Examples
/// ```
/// use eigenmark_core::landmark::{Circle, Point, Prior, Sector};
/// let compass = Sector { heading_rad: 1.5, tolerance_rad: 0.2 };
/// let circle = Circle { center: Point { x_px: 300.0, y_px: 200.0 }, radius_px: 100.0 };
/// let prior = Prior { circle: Some(circle), heading: Some(compass), ..Prior::NONE };
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prior {
    /// Where the vehicle is.
    pub circle: Option<Circle>,
    /// Which way it heads, relative to the pose that a frame is levelled by.
    pub heading: Option<Sector>,
    /// The lowest and the highest ratio of actual over nominal altitude, relative to that pose.
    pub altitude: Option<[f32; 2]>,
}

/// All places at most so far from one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// The place, on the map.
    pub center: Point,
    /// How far, in map pixels; of a negative one there are none.
    pub radius_px: f32,
}

/// All headings that differ at most so much from one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sector {
    /// The heading in radians, clockwise from map-up to frame-up.
    pub heading_rad: f32,
    /// How much to either side, in radians; of a negative one there are none.
    pub tolerance_rad: f32,
}

impl<'a> LandmarkTable<'a> {
    /// The landmarks that agree with `prior`, as ascending ranges of the table (0-based). `survey` is that of the table's
    /// atlas.
    pub fn plausible(
        &self,
        survey: &Survey,
        prior: &Prior,
    ) -> impl Iterator<Item = Range<u32>> + Clone + use<'a> {
        let prior = *prior;
        let (layers, listed) = if self.is_whole {
            (survey.layers(), &[][..])
        } else {
            (0, self.records)
        };
        let whole = survey.clone();
        let runs = (0..layers).flat_map(move |index| {
            let is_plausible = |&layer: &Layer| prior.admits(&whole, layer);
            let layer = whole.layer(index).filter(is_plausible);
            let first = index.saturating_mul(whole.windows());
            let lines = layer.map_or(0, |_| prior.lines(&whole));
            let whole = whole.clone();
            (0..lines).filter_map(move |line| {
                let run = prior.run(&whole, line)?;
                Some(first.saturating_add(run.start)..first.saturating_add(run.end))
            })
        });
        let survey = survey.clone();
        let singles = listed.iter().zip(0..).filter_map(move |(record, index)| {
            let candidate = survey.find(record.view)?;
            let is_plausible = prior.admits(&survey, candidate.layer)
                && prior
                    .circle
                    .is_none_or(|circle| circle.holds(candidate.place()));
            is_plausible.then_some(index..index + 1)
        });
        runs.chain(singles)
    }

    /// The landmarks at most `radius_px` map pixels away from `center`, whatever their heading and altitude: the
    /// [`plausible`](Self::plausible) ones when nothing else is known.
    pub fn near(
        &self,
        survey: &Survey,
        center: Point,
        radius_px: f32,
    ) -> impl Iterator<Item = Range<u32>> + Clone + use<'a> {
        let circle = Some(Circle { center, radius_px });
        self.plausible(
            survey,
            &Prior {
                circle,
                ..Prior::NONE
            },
        )
    }
}

impl Prior {
    /// Nothing is known.
    pub const NONE: Self = Self {
        circle: None,
        heading: None,
        altitude: None,
    };

    /// Whether the vehicle may be at a heading and an altitude that `layer` stands for.
    fn admits(&self, survey: &Survey, layer: Layer) -> bool {
        let heads = self.heading.is_none_or(|sector| {
            let reach = sector.tolerance_rad + survey.heading_step_rad() / 2.0 + ROUNDING_RAD;
            let angle = turn(layer.heading_rad, sector.heading_rad);
            sector.tolerance_rad >= 0.0 && angle <= reach && -angle <= reach
        });
        let flies = self.altitude.is_none_or(|[lowest, highest]| {
            let ratio = layer.altitude_ratio;
            let border = |other: f32| sqrt(ratio * other);
            let below = survey.altitudes.iter().rev().find(|&&other| other < ratio);
            let above = survey.altitudes.iter().find(|&&other| other > ratio);
            lowest <= highest
                && below.is_none_or(|&below| border(below) <= highest)
                && above.is_none_or(|&above| lowest <= border(above))
        });
        heads && flies
    }

    /// Lines that windows are looked for in: the rows of all lattices, or a single one when all windows are plausible.
    fn lines(&self, survey: &Survey) -> u32 {
        match self.circle {
            None => 1,
            Some(_) => {
                let rows = survey.lattices.iter();
                rows.map(|lattice| u32::from(lattice.rows)).sum()
            }
        }
    }

    /// The plausible windows (0-based) in line `line`; `None` when there are none.
    fn run(&self, survey: &Survey, line: u32) -> Option<Range<u32>> {
        let Some(circle) = self.circle else {
            return Some(0..survey.windows());
        };
        let (mut row, mut first) = (line, 0_u32);
        for lattice in &survey.lattices {
            let rows = u32::from(lattice.rows);
            if row < rows {
                let run = run_of(lattice, row, circle)?;
                let start = first.saturating_add(row * u32::from(lattice.columns));
                return Some(start.saturating_add(run.start)..start.saturating_add(run.end));
            }
            row -= rows;
            first = first.saturating_add(lattice.count());
        }
        None
    }
}

impl Circle {
    fn holds(&self, place: Point) -> bool {
        let Self { center, radius_px } = *self;
        let (x, y) = (place.x_px - center.x_px, place.y_px - center.y_px);
        radius_px >= 0.0 && x * x + y * y <= radius_px * radius_px
    }
}

/// The columns of a lattice's row within a circle; `None` when there are none.
fn run_of(lattice: &Lattice, row: u32, circle: Circle) -> Option<Range<u32>> {
    let Circle { center, radius_px } = circle;
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
    use core::f32::consts::{PI, TAU};
    use std::vec::Vec;

    use proptest::{option, prelude::*};

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

    fn survey(headings: u8, altitudes: &[f32]) -> Survey {
        Survey {
            lattices: [lattice(50.0, 20.0, 13, 9), lattice(60.0, 33.0, 7, 11)]
                .into_iter()
                .collect(),
            headings,
            altitudes: altitudes.iter().copied().collect(),
        }
    }

    /// A table of some candidates.
    fn with_table<T>(
        survey: &Survey,
        is_whole: bool,
        then: impl FnOnce(&LandmarkTable<'_>) -> T,
    ) -> T {
        let numbers = 1..=survey.count();
        let mut records: Vec<Record> = numbers.map(|view| Record { view, radius: 0.0 }).collect();
        if !is_whole {
            records.reverse();
            records.retain(|record| record.view % 5 == 2);
        }
        then(&LandmarkTable {
            metric: Metric::Nssd,
            dimensions: 1,
            step: 1.0,
            width: Width::I16,
            row_len: 1,
            is_whole,
            coefficients: &std::vec![Pair::default(); records.len()],
            squared_norms: &std::vec![0; records.len()],
            records: &records,
        })
    }

    /// How far candidate `view` is inside of what the prior admits, in units in which rounding is far below 10⁻³:
    /// negative outside.
    fn inside(survey: &Survey, prior: &Prior, view: u32) -> f32 {
        let candidate = survey.find(view).expect("a candidate");
        let place = candidate.place();
        let of_circle = prior
            .circle
            .map_or(f32::MAX, |Circle { center, radius_px }| {
                radius_px - (place.x_px - center.x_px).hypot(place.y_px - center.y_px)
            });
        let of_heading = prior.heading.map_or(f32::MAX, |sector| {
            let angle = (candidate.layer.heading_rad - sector.heading_rad).rem_euclid(TAU);
            sector.tolerance_rad + PI / f32::from(survey.headings) - angle.min(TAU - angle)
        });
        let of_altitude = prior.altitude.map_or(f32::MAX, |[lowest, highest]| {
            let ratio = candidate.layer.altitude_ratio;
            let index = survey
                .altitudes
                .iter()
                .position(|&other| other == ratio)
                .expect("listed");
            let border =
                |other: Option<&f32>, open: f32| other.map_or(open, |o| (o * ratio).sqrt());
            let low = border(
                index.checked_sub(1).and_then(|i| survey.altitudes.get(i)),
                0.0,
            );
            let high = border(survey.altitudes.get(index + 1), f32::MAX);
            (highest - low).min(high - lowest)
        });
        of_circle.min(of_heading).min(of_altitude)
    }

    proptest! {
        #[test]
        fn plausible_matches_reference(
            circle in option::of((-100.0_f32..500.0, -100.0_f32..500.0, 0.0_f32..400.0)),
            heading in option::of((-7.0_f32..7.0, 0.0_f32..4.0)),
            altitude in option::of((0.5_f32..1.5, 0.0_f32..0.5)),
            headings in 1_u8..9,
            is_whole in any::<bool>(),
        ) {
            let survey = survey(headings, &[0.8, 1.0, 1.1]);
            let prior = Prior {
                circle: circle.map(|(x_px, y_px, radius_px)| {
                    Circle { center: Point { x_px, y_px }, radius_px }
                }),
                heading: heading.map(|(heading_rad, tolerance_rad)| Sector { heading_rad, tolerance_rad }),
                altitude: altitude.map(|(lowest, more)| [lowest, lowest + more]),
            };
            with_table(&survey, is_whole, |table| {
                let found: Vec<u32> = table.plausible(&survey, &prior).flatten().collect();
                prop_assert!(found.is_sorted_by(|a, b| a < b));
                for (record, index) in table.records.iter().zip(0..) {
                    let inside = inside(&survey, &prior, record.view);
                    // On the border itself rounding decides.
                    if inside.abs() > 1e-3 {
                        prop_assert_eq!(found.binary_search(&index).is_ok(), inside > 0.0, "{}", record.view);
                    }
                }
                Ok(())
            })?;
        }

        #[test]
        fn no_heading_and_no_altitude_is_between_layers(
            heading_rad in -7.0_f32..7.0, headings in 1_u8..73, ratio in 0.0_f32..5.0,
        ) {
            let survey = survey(headings, &[0.8, 1.25]);
            let prior = Prior {
                heading: Some(Sector { heading_rad, tolerance_rad: 0.0 }),
                altitude: Some([ratio, ratio]),
                ..Prior::NONE
            };
            let found = with_table(&survey, true, |table| table.plausible(&survey, &prior).flatten().count());
            prop_assert!(found >= survey.windows() as usize);
        }
    }

    #[test]
    fn headings_and_altitudes_halfway_belong_to_both_layers() {
        let survey = survey(12, &[0.8, 1.25]);
        for heading in 0..12_u8 {
            let heading_rad = (15.0 + 30.0 * f32::from(heading)).to_radians();
            let prior = Prior {
                heading: Some(Sector {
                    heading_rad,
                    tolerance_rad: 0.0,
                }),
                altitude: Some([1.0, 1.0]),
                ..Prior::NONE
            };
            let layers = with_table(&survey, true, |table| {
                table.plausible(&survey, &prior).count()
            });
            assert_eq!(layers, 4, "{heading}");
        }
    }

    #[test]
    fn what_is_no_number_admits_nothing() {
        let survey = survey(12, &[1.0]);
        let sector = |heading_rad, tolerance_rad| Prior {
            heading: Some(Sector {
                heading_rad,
                tolerance_rad,
            }),
            ..Prior::NONE
        };
        let altitude = |range| Prior {
            altitude: Some(range),
            ..Prior::NONE
        };
        for prior in [
            sector(f32::NAN, 1.0),
            sector(f32::INFINITY, 1.0),
            sector(0.0, -1.0),
            sector(0.0, f32::NAN),
            altitude([f32::NAN, 1.0]),
            altitude([1.1, 0.9]),
        ] {
            let found = with_table(&survey, true, |table| {
                table.plausible(&survey, &prior).next()
            });
            assert_eq!(found, None, "{prior:?}");
        }
    }

    #[test]
    fn circles_beyond_all_numbers_hold_nothing_or_everything() {
        let lattice = lattice(50.0, 1e-30, 60, 1);
        let run = |x_px, y_px, radius_px| {
            let center = Point { x_px, y_px };
            run_of(&lattice, 0, Circle { center, radius_px })
        };
        for x_px in [1e20, -1e20, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(run(x_px, 50.0, 1.0), None, "{x_px}");
        }
        assert_eq!(run(0.0, 0.0, 1e19), Some(0..60));
        assert_eq!(run(0.0, 0.0, -1.0), None);
    }
}
