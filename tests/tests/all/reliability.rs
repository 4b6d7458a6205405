//! How far landmarks can be trusted on every map: claims 4 to 6 of the report, what the combined score has to do with the
//! separate measures, and what contrast normalization is worth. The measured tables are committed in
//! `tests/reliability.md`; set `EIGENMARK_BLESS` to renew them.

use std::fmt::Write;

use eigenmark::{
    evaluate::{
        Criterion, Deviation, EvaluatedTable, Everywhere, Exact, Journal, Plan, Site, evaluate,
        reliability::{End, MeanReliability, Measure, Reliability, Steps},
    },
    learn::{Candidates, Model, PixelBasis, Settings},
    map::{Integral, Map},
    output::Progress,
    select::{Selection, select, spearman_rho},
    train::learn,
};
use eigenmark_core::{atlas::Blur, eigenspace::Normalize};
use eigenmark_tests::{
    maps::{self, TestMap},
    record::compare_or_bless,
};

/// Numbers of dimensions from 2 to 35, as in (3.2).
const DIMENSIONS: [usize; 11] = [2, 3, 5, 7, 10, 12, 15, 18, 20, 25, 35];

/// Those that blurs and scales are compared in.
const COMPARED: [usize; 5] = [2, 5, 10, 15, 25];

/// The dimensions in which landmarks are selected, as in figure 3.8.
const SELECTED_IN: usize = 15;

/// Limits are whole steps; means over landmarks may differ by one step of one of them.
const TOLERANCE: fn(usize, f64) -> f64 = |_, committed| 0.01 * committed.abs() + 0.02;

/// A map, its candidates in 35 dimensions, and eight landmarks selected in 15.
struct Learned {
    candidates: Candidates,
    model: Model,
    coordinates: Vec<f64>,
    landmarks: Vec<u32>,
    settings: Settings,
}

impl Learned {
    fn new(map: &Map, settings: Settings) -> Self {
        let most = DIMENSIONS[DIMENSIONS.len() - 1];
        let (candidates, model) = learn(map, &settings, most, &Progress::Hidden).expect("learns");
        let coordinates = model.project(&candidates);
        let selected_in = first_columns(&coordinates, model.dimensions, SELECTED_IN);
        let selected = select(map, &candidates, &selected_in, &settings, false);
        Self {
            landmarks: selected.expect("selects").landmarks,
            candidates,
            model,
            coordinates,
            settings,
        }
    }

    /// The landmarks in every number of dimensions.
    fn exacts(&self, dimensions: &[usize]) -> Vec<Exact> {
        let basis = PixelBasis::new(&self.model, self.candidates.preprocess(), 0.0);
        let of = |&k: &usize| {
            let coordinates = first_columns(&self.coordinates, self.model.dimensions, k);
            Exact::new(
                basis.first(k),
                self.settings.metric,
                &coordinates,
                &self.landmarks,
            )
        };
        dimensions.iter().map(of).collect()
    }

    fn evaluate(&self, map: &Map, dimensions: &[usize], plan: &Plan) -> Vec<EvaluatedTable> {
        let (exacts, integral) = (self.exacts(dimensions), Integral::new(map.luminance()));
        let window_px = self.settings.view_size_px;
        let everywhere = Everywhere::nested(&exacts, map, &integral, window_px);
        let sites: Vec<Site> = self
            .landmarks
            .iter()
            .map(|&view| Site {
                view,
                place: self.candidates.grid().place(view),
            })
            .collect();
        let (journal, progress) = (Journal::none(), Progress::Hidden);
        let found = evaluate(map, &sites, &everywhere, plan, &journal, &progress);
        let found = found.expect("nothing is written");
        let table = |judge: usize| EvaluatedTable::new(found.iter().map(|by| by[judge].clone()));
        (0..dimensions.len()).map(table).collect()
    }
}

fn first_columns(rows: &[f64], width: usize, count: usize) -> Vec<f64> {
    let rows = rows.chunks_exact(width);
    rows.flat_map(|row| &row[..count]).copied().collect()
}

fn settings(map: &TestMap) -> Settings {
    Settings {
        view_size_px: map.view_size_px,
        ..Settings::default()
    }
}

fn report_plan(views: u64) -> Plan {
    Plan {
        measures: Measure::REPORT.to_vec(),
        steps: Steps { gamma: 0.1 },
        deviation: Deviation::MODERATE,
        views,
        seed: 2004,
    }
}

/// Means of a setting over the eight landmarks, by criterion, by dimensions.
type Curves = [Vec<MeanReliability>; 2];

fn curves(tables: &[EvaluatedTable]) -> Curves {
    let by = |mean: fn(&EvaluatedTable) -> &MeanReliability| {
        tables.iter().map(|table| mean(table).clone()).collect()
    };
    [
        by(|table| &table.mean.nearest),
        by(|table| &table.mean.guaranteed),
    ]
}

/// A range of tolerance: of gamma in octaves, of altitude in percent, of orientation in degrees.
fn width(mean: &MeanReliability, measure: Measure) -> f64 {
    let [Some(low), Some(high)] = mean.limits[&measure] else {
        return 0.0;
    };
    match measure {
        Measure::Gamma => (high / low).log2(),
        Measure::Altitude => 100.0 * (high - low),
        _ => high - low,
    }
}

/// The slope of the least-squares line and Pearson's correlation.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
    let (xx, yy) = (sum(&|p| (p.0 - x).powi(2)), sum(&|p| (p.1 - y).powi(2)));
    let xy = sum(&|p| (p.0 - x) * (p.1 - y));
    (xy / xx, if yy > 0.0 { xy / (xx * yy).sqrt() } else { 0.0 })
}

fn mean_where(curve: &[f64], holds: impl Fn(usize) -> bool) -> f64 {
    let chosen: Vec<f64> = DIMENSIONS
        .iter()
        .zip(curve)
        .filter(|(k, _)| holds(**k))
        .map(|(_, &value)| value)
        .collect();
    mean(&chosen)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn verdict(holds: bool) -> &'static str {
    if holds { "holds" } else { "does not hold" }
}

/// What was measured of a map.
struct Measured {
    name: &'static str,
    /// In all [`DIMENSIONS`], at scale 10 with gauss1.
    curves: Curves,
    /// In those that are [`COMPARED`], without blur to gauss3 at scale 10.
    blurs: [Curves; 4],
    /// In the same, at scales 5, 10 and 20 with gauss1.
    scales: [Curves; 3],
}

impl Measured {
    fn new(map: &TestMap) -> Self {
        let opened = map.open();
        let landmarks = Learned::new(&opened, settings(map)).landmarks;
        let curves = |blur: Blur, scale: f64, dimensions: &[usize]| {
            let settings = Settings {
                blur,
                scale,
                ..settings(map)
            };
            let learned = Learned {
                landmarks: landmarks.clone(),
                ..Learned::new(&opened, settings)
            };
            curves(&learned.evaluate(&opened, dimensions, &report_plan(0)))
        };
        let compared = |blur, scale| curves(blur, scale, &COMPARED);
        let all = curves(Blur::Gauss1, 10.0, &DIMENSIONS);
        let some = all.each_ref().map(|by| {
            let of = |k| {
                by[DIMENSIONS
                    .iter()
                    .position(|&other| other == k)
                    .expect("one of them")]
                .clone()
            };
            COMPARED.map(of).to_vec()
        });
        Self {
            name: map.name,
            curves: all,
            blurs: [
                compared(Blur::None, 10.0),
                some.clone(),
                compared(Blur::Gauss2, 10.0),
                compared(Blur::Gauss3, 10.0),
            ],
            scales: [
                compared(Blur::Gauss1, 5.0),
                some,
                compared(Blur::Gauss1, 20.0),
            ],
        }
    }

    /// Figure 3.8.
    fn table(&self, out: &mut String) {
        for (k, index) in DIMENSIONS.iter().zip(0..) {
            let _ = write!(out, "| {} | {k} ", self.name);
            for by in &self.curves {
                let mean = &by[index];
                let show = |limit: Option<f64>, digits: usize| {
                    limit.map_or("–".to_owned(), |limit| format!("{limit:.digits$}"))
                };
                for (measure, digits) in [
                    (Measure::Orientation, 1),
                    (Measure::Altitude, 3),
                    (Measure::Gamma, 2),
                ] {
                    let [low, high] = mean.limits[&measure];
                    let _ = write!(out, "| {} | {} ", show(low, digits), show(high, digits));
                }
                let _ = write!(out, "| {:.3} ", 100.0 * mean.catchment_share);
            }
            let _ = writeln!(out, "|");
        }
    }

    /// Claims 4 to 6 by a criterion.
    fn claims(&self, out: &mut String, criterion: usize) {
        let by = ["nearest", "guaranteed"][criterion];
        let mut claim = |name: &str, numbers: String, holds: bool| {
            let _ = writeln!(
                out,
                "| {} | {by} | {name} | {numbers} | {} |",
                self.name,
                verdict(holds)
            );
        };
        let at_gauss1 = &self.curves[criterion];
        for (measure, unit) in [(Measure::Orientation, "°"), (Measure::Altitude, " %")] {
            let name = if measure == Measure::Orientation {
                "orientation"
            } else {
                "altitude"
            };
            let curve: Vec<f64> = at_gauss1.iter().map(|mean| width(mean, measure)).collect();
            let (low, middle, high) = (
                mean_where(&curve, |k| k < 7),
                mean_where(&curve, |k| (10..=15).contains(&k)),
                mean_where(&curve, |k| k > 15),
            );
            claim(
                &format!("4: {name} is tolerated more at k = 10 to 15 than below 7"),
                format!("{low:.1}{unit} below, {middle:.1}{unit} there"),
                middle > low,
            );
            claim(
                "4: and not more above 15 (by at most a tenth)",
                format!("{middle:.1}{unit} there, {high:.1}{unit} above"),
                high <= 1.1 * middle,
            );
        }
        let at_15 = &at_gauss1[DIMENSIONS
            .iter()
            .position(|&k| k == SELECTED_IN)
            .expect("there")];
        let limits = |measure| at_15.limits[&measure].map(|limit| limit.unwrap_or(f64::NAN));
        let ([left, right], [low, high]) =
            (limits(Measure::Orientation), limits(Measure::Altitude));
        claim(
            "4: about ±25° at k = 15 (within a third)",
            format!("{left:.1}° to {right:.1}°"),
            [-left, right]
                .iter()
                .all(|limit| (16.7..=33.3).contains(limit)),
        );
        claim(
            "4: about 0.825 to 1.35 at k = 15 (within a third of the way from 1)",
            format!("{low:.3} to {high:.3}"),
            (0.767..=0.883).contains(&low) && (1.233..=1.467).contains(&high),
        );

        let area = |curves: &Curves| -> Vec<f64> {
            let by = curves[criterion].iter();
            by.map(|mean| 100.0 * mean.catchment_share).collect()
        };
        let curve = area(&self.curves);
        let (below, above) = (
            mean_where(&curve, |k| k < 10),
            mean_where(&curve, |k| k >= 10),
        );
        claim(
            "5: catchments are larger for k < 10",
            format!("{below:.3} % of the map below, {above:.3} % from there on"),
            below > above,
        );
        let steady = curve
            .iter()
            .zip(DIMENSIONS)
            .filter(|(_, k)| *k >= 10)
            .map(|(area, _)| *area);
        let (least, most) = steady.fold((f64::MAX, 0.0_f64), |(l, m), area| {
            (l.min(area), m.max(area))
        });
        claim(
            "5: and level from there on (the largest at most twice the smallest)",
            format!("{least:.3} to {most:.3} % of the map"),
            most <= 2.0 * least,
        );
        let all = |curves: &[Curves]| -> Vec<f64> {
            curves.iter().map(|curves| mean(&area(curves))).collect()
        };
        let numbers = |values: &[f64], digits: usize| -> String {
            let values: Vec<String> = values
                .iter()
                .map(|value| format!("{value:.digits$}"))
                .collect();
            values.join(", ")
        };
        let grows = |values: &[f64]| values.windows(2).all(|pair| pair[1] > pair[0]);
        let of_blurs = all(&self.blurs);
        claim(
            "5: they grow with smoothing (none to gauss3)",
            format!("{} % of the map", numbers(&of_blurs, 3)),
            grows(&of_blurs),
        );
        let of_scales = all(&self.scales);
        claim(
            "5: they grow with down-scaling (1/5, 1/10, 1/20)",
            format!("{} % of the map", numbers(&of_scales, 3)),
            grows(&of_scales),
        );

        let gammas = |curves: &Curves| -> Vec<f64> {
            curves[criterion]
                .iter()
                .map(|mean| width(mean, Measure::Gamma))
                .collect()
        };
        let points: Vec<(f64, f64)> = DIMENSIONS
            .iter()
            .map(|&k| k as f64)
            .zip(gammas(&self.curves))
            .collect();
        let (slope, correlation) = line(&points);
        claim(
            "6: the range of gamma grows linearly with k (r of at least 0.8)",
            format!(
                "{:+.3} octaves per ten dimensions, r = {correlation:.2}",
                10.0 * slope
            ),
            slope > 0.0 && correlation >= 0.8,
        );
        let of_blurs: Vec<f64> = self
            .blurs
            .iter()
            .map(|curves| mean(&gammas(curves)))
            .collect();
        claim(
            "6: less smoothing tolerates more (none to gauss3)",
            format!("{} octaves", numbers(&of_blurs, 2)),
            of_blurs.windows(2).all(|pair| pair[1] <= pair[0]) && of_blurs[3] < of_blurs[0],
        );
    }
}

/// Which separate measure orders all 83 views, or as many as the map has, as the score does: Spearman's ρ.
fn scores(map: &TestMap, out: &mut String) {
    let opened = map.open();
    let settings = Settings {
        selection: Selection::All,
        ..settings(map)
    };
    let learned = Learned::new(&opened, settings);
    let tables = learned.evaluate(&opened, &[SELECTED_IN], &report_plan(200));
    // Those with room to be turned by 15°: at the edge neither score nor limits say much.
    let inside: Vec<_> = tables[0]
        .landmarks
        .iter()
        .filter(|one| {
            let reliability = &one.evaluated.nearest;
            let [low, high] = reliability.limits[&Measure::Orientation];
            reliability.ends[&Measure::Orientation] == [End::Failed; 2]
                || (low < -15.0 && high > 15.0)
        })
        .collect();
    let ranked = |value: &dyn Fn(&Reliability) -> f64, criterion| -> Vec<u32> {
        let mut order: Vec<u32> = (1..=inside.len() as u32).collect();
        let of = |one: &u32| value(inside[*one as usize - 1].evaluated.by(criterion));
        order.sort_by(|a, b| of(b).total_cmp(&of(a)).then(a.cmp(b)));
        order
    };
    let score = |one: usize| inside[one].score.expect("there is room");
    for (criterion, name) in [
        (Criterion::Nearest, "nearest"),
        (Criterion::Guaranteed, "guaranteed"),
    ] {
        let mut by_score: Vec<u32> = (1..=inside.len() as u32).collect();
        let share = |one: &u32| match criterion {
            Criterion::Nearest => score(*one as usize - 1).right,
            Criterion::Guaranteed => score(*one as usize - 1).guaranteed,
        };
        by_score.sort_by(|a, b| share(b).total_cmp(&share(a)).then(a.cmp(b)));
        let range = |measure: Measure| {
            move |one: &Reliability| {
                let [low, high] = one.limits[&measure];
                if measure == Measure::Orientation {
                    high - low
                } else {
                    (high / low).ln()
                }
            }
        };
        let rho = |value: &dyn Fn(&Reliability) -> f64| {
            spearman_rho(&by_score, &ranked(value, criterion)).expect("the same landmarks")
        };
        let mean = tables[0].mean.score.expect("drawn");
        let share = if criterion == Criterion::Nearest {
            mean.right
        } else {
            mean.guaranteed
        };
        let _ = writeln!(
            out,
            "| {} | {name} | {} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} |",
            map.name,
            inside.len(),
            100.0 * share,
            rho(&range(Measure::Orientation)),
            rho(&range(Measure::Altitude)),
            rho(&range(Measure::Gamma)),
            rho(&|one| one.catchment_px as f64),
        );
    }
}

/// The narrowest range of gamma over the landmarks with contrast normalized, and the mean one.
fn normalized(map: &TestMap, out: &mut String) {
    let opened = map.open();
    let settings = Settings {
        normalize: Normalize::Std,
        ..settings(map)
    };
    let tables = Learned::new(&opened, settings).evaluate(&opened, &[SELECTED_IN], &report_plan(0));
    for (criterion, name) in [
        (Criterion::Nearest, "nearest"),
        (Criterion::Guaranteed, "guaranteed"),
    ] {
        let limits: Vec<[f64; 2]> = tables[0]
            .landmarks
            .iter()
            .map(|one| one.evaluated.by(criterion).limits[&Measure::Gamma])
            .collect();
        let low = limits.iter().map(|[low, _]| *low).fold(0.0, f64::max);
        let high = limits
            .iter()
            .map(|[_, high]| *high)
            .fold(f64::MAX, f64::min);
        if criterion == Criterion::Nearest {
            assert!(
                low <= 0.2 && high >= 5.0,
                "{}: gamma {low} to {high}",
                map.name
            );
        }
        let covering = limits
            .iter()
            .filter(|[low, high]| *low <= 0.2 && *high >= 5.0)
            .count();
        let mean = if criterion == Criterion::Nearest {
            &tables[0].mean.nearest
        } else {
            &tables[0].mean.guaranteed
        };
        let [mean_low, mean_high] =
            mean.limits[&Measure::Gamma].map(|limit| limit.unwrap_or(f64::NAN));
        let _ = writeln!(
            out,
            "| {} | {name} | {low:.2} | {high:.1} | {mean_low:.2} | {mean_high:.1} | {covering} of {} |",
            map.name,
            limits.len()
        );
    }
}

#[test]
fn tolerances_hold_and_their_tables_are_up_to_date() {
    let mut maps = maps::all();
    maps.retain(|map| map.name != "city");
    let measured: Vec<Measured> = maps.iter().map(Measured::new).collect();
    let mut out = HEAD.to_owned();
    for one in &measured {
        one.table(&mut out);
    }
    out += CLAIMS;
    for one in &measured {
        one.claims(&mut out, 1);
        one.claims(&mut out, 0);
    }
    out += SCORES;
    for map in &maps {
        scores(map, &mut out);
    }
    out += NORMALIZED;
    for map in &maps {
        normalized(map, &mut out);
    }
    compare_or_bless("reliability.md", &out, TOLERANCE);
}

const HEAD: &str = "\
# How far landmarks can be trusted

The settings of figure 3.8: scale 1/10, gauss1, eight landmarks selected by profile in 15 dimensions, the eigenspace in
f64. Means over the landmarks of the limits that do not end at the map's edge (the report's criterion is `guaranteed`,
(2.39), reconstructed; `nearest` asks only that the landmark is the strict nearest one); catchments in percent of the map.
Gamma is tried in steps of 0.1 up to 10, and their reciprocals: the report's 0.5 is too coarse for guarantees.

| map | k | nearest: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % | guaranteed: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const CLAIMS: &str = "
## Claims 4 to 6

Ranges are from the lower to the upper limit, gamma in octaves; of blurs and scales, means over k = 2, 5, 10, 15 and 25,
always of the same eight landmarks.

| map | criterion | claim | measured | |
| --- | --- | --- | --- | --- |
";

const SCORES: &str = "
## The score and the separate measures

The score is the probability of a right fix under moderate deviations, all at once: ±20°, ±15 % shift, altitude to 1.2,
gamma to 2, noise; 200 views per landmark. All views of the report's layout are landmarks, 15 dimensions; Spearman's rank
correlation of the score with the range of each measure, over the landmarks with room to turn.

| map | criterion | landmarks | score of all, % | orientation | altitude | gamma | catchment |
| --- | --- | --- | --- | --- | --- | --- | --- |
";

const NORMALIZED: &str = "
## Brightness with contrast normalized

Eight landmarks by profile with `--normalize std`, 15 dimensions: the lower limit that every landmark reaches, the upper
one, their means, and how many landmarks tolerate gamma 0.2 to 5.

| map | criterion | all from | to | mean from | to | 0.2 to 5 |
| --- | --- | --- | --- | --- | --- | --- |
";
