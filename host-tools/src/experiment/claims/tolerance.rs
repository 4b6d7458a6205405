//! Claims 4 to 6: what landmarks tolerate, over dimensions, blurs and scales (report 3.5, figure 3.8).
//!
//! The landmarks are the same everywhere, [`Method::Fixed`], so that settings are compared and not selections; means are
//! over those of them whose limit ends at the map's edge in no setting that is compared.

use super::{
    Claim, Curve, FIGURE_BLUR, FIGURE_SCALE, MISSING, Part, Plot, figure,
    statistics::{line, mean, rank_correlation},
};
use crate::{
    evaluate::reliability::{End, Measure, Reliability},
    experiment::{Cell, Grid, Method, MethodTable, REPORT_BLURS, REPORT_SCALES},
};

/// Dimensions of the curves.
const DIMENSIONS: std::ops::RangeInclusive<usize> = 2..=35;

/// Those that blurs and scales are compared in.
const COMPARED: [usize; 5] = [2, 5, 10, 15, 25];

/// The report's, in figure 3.8.
const FIGURE_DIMENSIONS: usize = 15;

/// Names of the criteria, in the order of every pair.
const CRITERIA: [&str; 2] = ["nearest", "guaranteed"];

/// Rank correlation from which on something grows with something else.
const GROWS: f64 = 0.8;

/// Claims 4, 5 and 6.
pub fn claims(grid: &Grid) -> Vec<Claim> {
    let Some(seen) = Seen::new(grid) else {
        return [(4, ORIENTATION_AND_ALTITUDE), (5, CATCHMENT), (6, GAMMA)]
            .map(|(claim, statement)| {
                Claim::new(
                    claim,
                    statement,
                    vec![Part::open("scale 1/10, gauss1", MISSING)],
                    vec![],
                )
            })
            .to_vec();
    };
    vec![
        seen.orientation_and_altitude(),
        seen.catchment(),
        seen.gamma(),
    ]
}

const ORIENTATION_AND_ALTITUDE: &str = "Orientation and altitude tolerance rise up to k ≈ 10, peak at 10–15, then flatten or fall; about ±25° and \
                                        0.825–1.35 (3.5)";
const CATCHMENT: &str = "Catchment area is larger for k < 10, then small and level; it grows with smoothing and \
                         down-scaling (3.5)";
const GAMMA: &str =
    "Tolerated gamma range grows about linearly with k; less smoothing tolerates more (3.5)";

/// The tables that are compared.
struct Seen<'a> {
    /// By dimensions, in the report's setting.
    all: Vec<(usize, &'a MethodTable)>,
    /// By blur, by dimensions; without those that are not computed.
    blurs: Vec<(String, Vec<&'a MethodTable>)>,
    /// By scale, by dimensions.
    scales: Vec<(f64, Vec<&'a MethodTable>)>,
    /// By criterion, measure and side: the landmarks that means are over.
    inside: [[[Vec<usize>; 2]; 3]; 2],
}

impl<'a> Seen<'a> {
    fn new(grid: &'a Grid) -> Option<Self> {
        let cell = figure(grid)?;
        let dims = cell.dims.iter().filter(|k| DIMENSIONS.contains(k));
        let all: Vec<(usize, &MethodTable)> = dims
            .map(|&k| Some((k, cell.table(Method::Fixed, k)?)))
            .collect::<Option<_>>()?;
        let compared = |cell: &'a Cell| -> Option<Vec<&'a MethodTable>> {
            // Few views, or few pixels, span fewer dimensions.
            let spanned = COMPARED.iter().filter(|k| Some(*k) <= cell.dims.last());
            spanned.map(|&k| cell.table(Method::Fixed, k)).collect()
        };
        let of_blur = |blur| {
            let cell = grid.cell(FIGURE_SCALE, blur)?;
            Some((cell.blur.clone(), compared(cell)?))
        };
        let of_scale = |scale| Some((scale, compared(grid.cell(scale, FIGURE_BLUR)?)?));
        let blurs: Vec<_> = REPORT_BLURS.into_iter().filter_map(of_blur).collect();
        let scales: Vec<_> = REPORT_SCALES.into_iter().filter_map(of_scale).collect();
        let tables: Vec<&MethodTable> = all
            .iter()
            .map(|(_, table)| *table)
            .chain(blurs.iter().flat_map(|(_, tables)| tables.iter().copied()))
            .chain(scales.iter().flat_map(|(_, tables)| tables.iter().copied()))
            .collect();
        Some(Self {
            inside: inside(&tables),
            all,
            blurs,
            scales,
        })
    }

    /// The mean limit of a table over the landmarks inside; NaN without any.
    fn limit(&self, table: &MethodTable, by: usize, measure: usize, side: usize) -> f64 {
        let inside = self.inside[by][measure][side].iter();
        let limit = |&one: &usize| table.tolerated[one][by].limits[&Measure::REPORT[measure]][side];
        mean(&inside.map(limit).collect::<Vec<f64>>())
    }

    /// A range of tolerance: of orientation in degrees, of altitude in percent, of gamma in octaves.
    fn range(&self, table: &MethodTable, by: usize, measure: usize) -> f64 {
        let [low, high] = [0, 1].map(|side| self.limit(table, by, measure, side));
        match Measure::REPORT[measure] {
            Measure::Gamma => (high / low).log2(),
            Measure::Altitude => 100.0 * (high - low),
            _ => high - low,
        }
    }

    fn orientation_and_altitude(&self) -> Claim {
        let (mut parts, mut plots) = (Vec::new(), Vec::new());
        for (measure, name, unit) in [(0, "orientation", "°"), (1, "altitude", " %")] {
            for by in [1, 0] {
                let curve = self.curve(|table| self.range(table, by, measure));
                let at = |holds: &dyn Fn(f64) -> bool| {
                    mean(
                        &curve
                            .iter()
                            .filter(|(k, _)| holds(*k))
                            .map(|(_, y)| *y)
                            .collect::<Vec<_>>(),
                    )
                };
                let (low, middle, high) = (
                    at(&|k| k < 7.0),
                    at(&|k| (10.0..=15.0).contains(&k)),
                    at(&|k| k > 15.0),
                );
                let named = |what: &str| format!("{name}, {}: {what}", CRITERIA[by]);
                let more = self.part(
                    named("more at k = 10 to 15 than below 7"),
                    format!("{low:.1}{unit} below, {middle:.1}{unit} there"),
                    middle > low,
                    (by, measure),
                );
                let not_more = self.part(
                    named("not more above 15, by a tenth at most"),
                    format!("{middle:.1}{unit} at 10 to 15, {high:.1}{unit} above"),
                    high <= 1.1 * middle,
                    (by, measure),
                );
                parts.push(more.decided_by(&[low, middle]));
                parts.push(not_more.decided_by(&[middle, high]));
            }
            plots.push(self.plot(measure, name));
        }
        let at_15 = self.all.iter().find(|(k, _)| *k == FIGURE_DIMENSIONS);
        for by in [1, 0] {
            let Some((_, table)) = at_15 else {
                parts.push(Part::open("the limits at k = 15", "k = 15 is not computed"));
                continue;
            };
            let [left, right] = [0, 1].map(|side| self.limit(table, by, 0, side));
            let [low, high] = [0, 1].map(|side| self.limit(table, by, 1, side));
            parts.push(
                self.part(
                    format!(
                        "orientation, {}: about ±25° at k = 15, within a third",
                        CRITERIA[by]
                    ),
                    format!("{left:.1}° to {right:.1}°"),
                    [-left, right]
                        .iter()
                        .all(|limit| (16.7..=33.3).contains(limit)),
                    (by, 0),
                ),
            );
            parts.push(self.part(
                format!(
                    "altitude, {}: about 0.825 to 1.35 at k = 15, within a third of the way from 1",
                    CRITERIA[by]
                ),
                format!("{low:.3} to {high:.3}"),
                (0.767..=0.883).contains(&low) && (1.233..=1.467).contains(&high),
                (by, 1),
            ));
        }
        Claim::new(4, ORIENTATION_AND_ALTITUDE, parts, plots)
    }

    fn catchment(&self) -> Claim {
        let mut parts = Vec::new();
        let grows = |values: &[f64]| values.windows(2).all(|pair| pair[1] > pair[0]);
        for by in [1, 0] {
            let named = |what: &str| format!("{}: {what}", CRITERIA[by]);
            let curve = self.curve(|table| catchment(table, by));
            let (below, above): (Vec<_>, Vec<_>) = curve.iter().partition(|(k, _)| *k < 10.0);
            let values =
                |points: &[(f64, f64)]| points.iter().map(|(_, y)| *y).collect::<Vec<f64>>();
            let (below, above) = (values(&below), values(&above));
            parts.push(
                Part::new(
                    named("larger for k < 10"),
                    format!(
                        "{:.3} % of the map below, {:.3} % from there on",
                        mean(&below),
                        mean(&above)
                    ),
                    mean(&below) > mean(&above),
                )
                .decided_by(&[mean(&below), mean(&above)]),
            );
            let least = above.iter().copied().fold(f64::INFINITY, f64::min);
            let most = above.iter().copied().fold(0.0, f64::max);
            parts.push(
                Part::new(
                    named("level from k = 10 on: the largest is twice the smallest at most"),
                    format!("{least:.3} to {most:.3} %"),
                    most <= 2.0 * least,
                )
                .decided_by(&[least]),
            );
            let of_tables =
                |tables: &[&MethodTable]| mean_over(tables, |table| catchment(table, by));
            let what = named("grows with smoothing at every step");
            let blurs: Vec<f64> = self
                .blurs
                .iter()
                .map(|(_, tables)| of_tables(tables))
                .collect();
            parts.push(match blurs[..] {
                [none, .., gauss3] if blurs.len() == REPORT_BLURS.len() => Part::new(
                    what,
                    format!("{none:.3} % without, {gauss3:.3} % with gauss3"),
                    grows(&blurs),
                ),
                _ => Part::open(what, MISSING),
            });
            let what = named(
                "grows with down-scaling: rank correlation with the scale factor of 0.8 at least",
            );
            let scales: Vec<(f64, f64)> = self
                .scales
                .iter()
                .map(|(scale, tables)| (*scale, of_tables(tables)))
                .collect();
            parts.push(match scales[..] {
                [(_, finest), .., (_, coarsest)] if scales.len() >= 3 => {
                    let correlation = rank_correlation(&scales);
                    Part::new(
                        what,
                        format!(
                            "{correlation:.2} over {} scales; {finest:.3} % at 1/{}, {coarsest:.3} % at 1/{}",
                            scales.len(),
                            scales[0].0,
                            scales[scales.len() - 1].0
                        ),
                        correlation >= GROWS,
                    )
                }
                _ => Part::open(what, MISSING),
            });
        }
        let curves =
            [1, 0].map(|by| Curve::new(CRITERIA[by], self.curve(|table| catchment(table, by))));
        let by_scale = [1, 0].map(|by| {
            let points = self
                .scales
                .iter()
                .map(|(scale, tables)| (*scale, mean_over(tables, |table| catchment(table, by))));
            Curve::new(CRITERIA[by], points.collect::<Vec<_>>())
        });
        let plots = vec![
            Plot::new(
                "Catchments of the same landmarks, scale 1/10, gauss1",
                "dimensions k",
                "catchment, % of the map",
                curves.to_vec(),
            ),
            Plot::new(
                "Catchments by scale, gauss1, means over k = 2, 5, 10, 15, 25",
                "scale factor, map pixels per view pixel",
                "catchment, % of the map",
                by_scale.to_vec(),
            ),
        ];
        Claim::new(5, CATCHMENT, parts, plots)
    }

    fn gamma(&self) -> Claim {
        let mut parts = Vec::new();
        for by in [1, 0] {
            let named = |what: &str| format!("{}: {what}", CRITERIA[by]);
            let (slope, correlation) = line(&self.curve(|table| self.range(table, by, 2)));
            parts.push(self.part(
                named("grows linearly with k: correlation of 0.8 at least"),
                format!(
                    "r = {correlation:.2}, {:.2} octaves per ten dimensions",
                    10.0 * slope
                ),
                slope > 0.0 && correlation >= 0.8,
                (by, 2),
            ));
            let of_tables =
                |tables: &[&MethodTable]| mean_over(tables, |table| self.range(table, by, 2));
            let what = named("less smoothing tolerates more, at every step");
            let blurs: Vec<f64> = self
                .blurs
                .iter()
                .map(|(_, tables)| of_tables(tables))
                .collect();
            parts.push(match blurs[..] {
                [none, .., gauss3] if blurs.len() == REPORT_BLURS.len() => self.part(
                    what,
                    format!("{none:.2} octaves without, {gauss3:.2} with gauss3"),
                    blurs.windows(2).all(|pair| pair[1] <= pair[0]) && gauss3 < none,
                    (by, 2),
                ),
                _ => Part::open(what, MISSING),
            });
        }
        Claim::new(6, GAMMA, parts, vec![self.plot(2, "gamma")])
    }

    /// A part about ranges, which are of nothing when no landmark is inside.
    fn part(
        &self,
        what: String,
        numbers: String,
        holds: bool,
        (by, measure): (usize, usize),
    ) -> Part {
        if self.inside[by][measure].iter().any(Vec::is_empty) {
            return Part::open(
                what,
                "every landmark's limit ends at the map's edge somewhere",
            );
        }
        Part::new(what, numbers, holds)
    }

    /// A value over dimensions.
    fn curve(&self, value: impl Fn(&MethodTable) -> f64) -> Vec<(f64, f64)> {
        self.all
            .iter()
            .map(|(k, table)| (*k as f64, value(table)))
            .collect()
    }

    /// Lower and upper limits over dimensions.
    fn plot(&self, measure: usize, name: &str) -> Plot {
        let curves = [1, 0].into_iter().flat_map(|by| {
            [(0, "from"), (1, "to")].map(|(side, end)| {
                let points = self.curve(|table| self.limit(table, by, measure, side));
                Curve::new(format!("{}, {end}", CRITERIA[by]), points)
            })
        });
        let y = match Measure::REPORT[measure] {
            Measure::Altitude => "altitude, actual over nominal",
            Measure::Gamma => "gamma",
            _ => "orientation, degrees",
        };
        let title = format!("Tolerated {name} of the same landmarks, scale 1/10, gauss1");
        Plot::new(&title, "dimensions k", y, curves.collect())
    }
}

/// The mean of a value over some tables.
fn mean_over(tables: &[&MethodTable], value: impl Fn(&MethodTable) -> f64) -> f64 {
    mean(
        &tables
            .iter()
            .map(|table| value(table))
            .collect::<Vec<f64>>(),
    )
}

/// By criterion, measure and side: the landmarks whose limit ends at the map in none of the tables.
fn inside(tables: &[&MethodTable]) -> [[[Vec<usize>; 2]; 3]; 2] {
    let landmarks = tables.first().map_or(0, |table| table.landmarks.len());
    [0, 1].map(|by| {
        Measure::REPORT.map(|measure| {
            [0, 1].map(|side| {
                let ends_at_map = |one: &Reliability| one.ends[&measure][side] == End::Map;
                (0..landmarks)
                    .filter(|&one| {
                        !tables
                            .iter()
                            .any(|table| ends_at_map(&table.tolerated[one][by]))
                    })
                    .collect()
            })
        })
    })
}

/// The mean catchment of all landmarks, as far as the map goes, in percent of the map.
fn catchment(table: &MethodTable, by: usize) -> f64 {
    let shares: Vec<f64> = table
        .tolerated
        .iter()
        .map(|one| 100.0 * one[by].catchment_share)
        .collect();
    mean(&shares)
}
