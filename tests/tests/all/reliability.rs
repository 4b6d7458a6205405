//! How far landmarks can be trusted on every map: claims 4 to 6 of the report, what the combined score has to do with the
//! separate measures, and what contrast normalization is worth. The measured tables are committed in
//! `tests/reliability.md`; set `EIGENMARK_BLESS` to renew them.

use std::fmt::Write;

use eigenmark::{
    evaluate::{
        Criterion, Deviation, EvaluatedTable, Everywhere, Exact, Journal, Onboard, Plan, Site,
        evaluate,
        reliability::{End, Measure, Reliability, Steps},
    },
    learn::{Candidates, Model, PixelBasis, Settings},
    map::{Integral, Map},
    output::Progress,
    select::{Selection, select},
    train::{learn, train},
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

/// Another processor rounds otherwise, and a limit may move by a step: a mean of five by 0.2°, by 0.002 of the altitude,
/// by 0.02 of gamma; an area by a few pixels.
const TOLERANCE: fn(usize, f64) -> f64 = |_, committed| 0.005 * committed.abs() + 0.002;

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
        let sites = sites(&self.candidates, &self.landmarks);
        let (journal, progress) = (Journal::none(), Progress::Hidden);
        let found = evaluate(map, &sites, &everywhere, plan, &journal, &progress);
        let found = found.expect("nothing is written");
        let table = |judge: usize| EvaluatedTable::new(found.iter().map(|by| by[judge].clone()));
        (0..dimensions.len()).map(table).collect()
    }
}

fn sites(candidates: &Candidates, landmarks: &[u32]) -> Vec<Site> {
    let site = |&view: &u32| Site {
        view,
        place: candidates.grid().place(view),
    };
    landmarks.iter().map(site).collect()
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

/// The landmarks that means are taken over: the same in every setting, or they could not be compared.
struct Inside {
    /// By criterion, by measure of the report, by side: those whose limit ends at the map in no setting.
    limits: [[[Vec<usize>; 2]; 3]; 2],
}

impl Inside {
    fn of(tables: &[&EvaluatedTable]) -> Self {
        let landmarks = tables[0].landmarks.len();
        let never = |ends_at_map: &dyn Fn(&EvaluatedTable, usize) -> bool| -> Vec<usize> {
            let is_inside = |one: &usize| !tables.iter().any(|table| ends_at_map(table, *one));
            (0..landmarks).filter(is_inside).collect()
        };
        let of = |table: &EvaluatedTable, one: usize, criterion| {
            table.landmarks[one].evaluated.by(criterion).clone()
        };
        Self {
            limits: Criterion::ALL.map(|by| {
                Measure::REPORT.map(|measure| {
                    [0, 1].map(|side| {
                        never(&|table, one| of(table, one, by).ends[&measure][side] == End::Map)
                    })
                })
            }),
        }
    }

    /// The mean limit of a table; NaN without landmarks.
    fn limit(&self, table: &EvaluatedTable, by: usize, measure: usize, side: usize) -> f64 {
        let limit = |&one: &usize| {
            table.landmarks[one].evaluated.by(Criterion::ALL[by]).limits[&Measure::REPORT[measure]]
                [side]
        };
        mean(
            &self.limits[by][measure][side]
                .iter()
                .map(limit)
                .collect::<Vec<f64>>(),
        )
    }

    /// A range of tolerance: of gamma in octaves, of altitude in percent, of orientation in degrees.
    fn range(&self, table: &EvaluatedTable, by: usize, measure: usize) -> f64 {
        let [low, high] = [0, 1].map(|side| self.limit(table, by, measure, side));
        match Measure::REPORT[measure] {
            Measure::Gamma => (high / low).log2(),
            Measure::Altitude => 100.0 * (high - low),
            _ => high - low,
        }
    }
}

/// The mean catchment of all landmarks, as far as the map goes, in percent of the map.
fn catchment(table: &EvaluatedTable, by: usize) -> f64 {
    100.0 * table.mean.by(Criterion::ALL[by]).catchment_share
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

/// What was measured of a map.
struct Measured {
    name: &'static str,
    inside: Inside,
    /// In all [`DIMENSIONS`], at scale 10 with gauss1.
    all: Vec<EvaluatedTable>,
    /// In those that are [`COMPARED`], without blur to gauss3 at scale 10.
    blurs: [Vec<EvaluatedTable>; 4],
    /// In the same, at scales 5, 10 and 20 with gauss1.
    scales: [Vec<EvaluatedTable>; 3],
}

impl Measured {
    fn new(map: &TestMap) -> Self {
        let opened = map.open();
        let landmarks = Learned::new(&opened, settings(map)).landmarks;
        let tables = |blur: Blur, scale: f64, dimensions: &[usize]| {
            let settings = Settings {
                blur,
                scale,
                ..settings(map)
            };
            let learned = Learned {
                landmarks: landmarks.clone(),
                ..Learned::new(&opened, settings)
            };
            learned.evaluate(&opened, dimensions, &report_plan(0))
        };
        let compared = |blur, scale| tables(blur, scale, &COMPARED);
        let all = tables(Blur::Gauss1, 10.0, &DIMENSIONS);
        let is_compared = |(k, _): &(&usize, &EvaluatedTable)| COMPARED.contains(k);
        let some: Vec<EvaluatedTable> = DIMENSIONS
            .iter()
            .zip(&all)
            .filter(is_compared)
            .map(|(_, table)| table.clone())
            .collect();
        let blurs = [
            compared(Blur::None, 10.0),
            some.clone(),
            compared(Blur::Gauss2, 10.0),
            compared(Blur::Gauss3, 10.0),
        ];
        let scales = [
            compared(Blur::Gauss1, 5.0),
            some,
            compared(Blur::Gauss1, 20.0),
        ];
        let others = blurs.iter().chain(&scales).flatten();
        Self {
            name: map.name,
            inside: Inside::of(&all.iter().chain(others).collect::<Vec<_>>()),
            all,
            blurs,
            scales,
        }
    }

    /// Figure 3.8, and how many landmarks the means are of.
    fn table(&self, out: &mut String) {
        let show = |value: f64, digits: usize| {
            if value.is_nan() {
                "–".to_owned()
            } else {
                format!("{value:.digits$}")
            }
        };
        for (k, table) in DIMENSIONS.iter().zip(&self.all) {
            let _ = write!(out, "| {} | {k} ", self.name);
            for by in [0, 1] {
                for (measure, digits) in [(0, 1), (1, 3), (2, 2)] {
                    for side in [0, 1] {
                        let limit = self.inside.limit(table, by, measure, side);
                        let _ = write!(out, "| {} ", show(limit, digits));
                    }
                }
                let _ = write!(out, "| {} ", show(catchment(table, by), 3));
            }
            let _ = writeln!(out, "|");
        }
        let _ = write!(out, "| {} | of ", self.name);
        for by in [0, 1] {
            for side in self.inside.limits[by].iter().flatten() {
                let _ = write!(out, "| {} ", side.len());
            }
            let _ = write!(out, "| {} ", self.all[0].landmarks.len());
        }
        let _ = writeln!(out, "|");
    }

    /// Claims 4 to 6 by a criterion.
    fn claims(&self, out: &mut String, by: usize) {
        let inside = &self.inside;
        let mut claim = |name: &str, values: &[f64], unit: &str, digits: usize, holds: bool| {
            let verdict = match (values.iter().any(|value| value.is_nan()), holds) {
                (true, _) => "no landmark is inside",
                (false, true) => "holds",
                (false, false) => "does not hold",
            };
            let values: Vec<String> = values
                .iter()
                .map(|value| format!("{value:.digits$}"))
                .collect();
            let _ = writeln!(
                out,
                "| {} | {} | {name} | {} | {unit} | {verdict} |",
                self.name,
                ["nearest", "guaranteed"][by],
                values.join(" | "),
            );
        };
        for (measure, name, unit) in [(0, "orientation", "°"), (1, "altitude", "%")] {
            let curve: Vec<f64> = self
                .all
                .iter()
                .map(|table| inside.range(table, by, measure))
                .collect();
            let low = mean_where(&curve, |k| k < 7);
            let middle = mean_where(&curve, |k| (10..=15).contains(&k));
            let high = mean_where(&curve, |k| k > 15);
            let name_of = |what: &str| format!("4: {name}: {what}");
            claim(
                &name_of("more at k = 10 to 15 than below 7 (below, there)"),
                &[low, middle],
                unit,
                1,
                middle > low,
            );
            claim(
                &name_of("not more above 15, by a tenth at most (10 to 15, above)"),
                &[middle, high],
                unit,
                1,
                high <= 1.1 * middle,
            );
        }
        let at_15 = &self.all[DIMENSIONS
            .iter()
            .position(|&k| k == SELECTED_IN)
            .expect("one of them")];
        let limits = |measure| [0, 1].map(|side| inside.limit(at_15, by, measure, side));
        let ([left, right], [low, high]) = (limits(0), limits(1));
        claim(
            "4: orientation: about ±25 at k = 15, within a third (from, to)",
            &[left, right],
            "°",
            1,
            [-left, right]
                .iter()
                .all(|limit| (16.7..=33.3).contains(limit)),
        );
        claim(
            "4: altitude: about 0.825 to 1.35 at k = 15, within a third of the way from 1 (from, to)",
            &[low, high],
            "×",
            3,
            (0.767..=0.883).contains(&low) && (1.233..=1.467).contains(&high),
        );

        let curve: Vec<f64> = self.all.iter().map(|table| catchment(table, by)).collect();
        let (below, above) = (
            mean_where(&curve, |k| k < 10),
            mean_where(&curve, |k| k >= 10),
        );
        claim(
            "5: catchments: larger for k < 10 (below, from there on)",
            &[below, above],
            "% of the map",
            4,
            below > above,
        );
        let steady = curve
            .iter()
            .zip(DIMENSIONS)
            .filter(|(_, k)| *k >= 10)
            .map(|(area, _)| *area);
        let (least, most) = steady.fold((f64::MAX, 0.0_f64), |(least, most), area| {
            (least.min(area), most.max(area))
        });
        claim(
            "5: catchments: level from k = 10 on, the largest twice the smallest at most (smallest, largest)",
            &[least, most],
            "% of the map",
            4,
            most <= 2.0 * least,
        );
        let ends = |settings: &[Vec<EvaluatedTable>],
                    value: &dyn Fn(&EvaluatedTable) -> f64|
         -> Vec<f64> {
            let of = |tables: &Vec<EvaluatedTable>| {
                mean(&tables.iter().map(value).collect::<Vec<f64>>())
            };
            settings.iter().map(of).collect()
        };
        let catchment = |table: &EvaluatedTable| catchment(table, by);
        let grows = |values: &[f64]| values.windows(2).all(|pair| pair[1] > pair[0]);
        for (name, settings) in [
            (
                "5: catchments: grow with smoothing at every step (none, gauss3)",
                &self.blurs[..],
            ),
            (
                "5: catchments: grow with down-scaling at every step (1/5, 1/20)",
                &self.scales[..],
            ),
        ] {
            let values = ends(settings, &catchment);
            let [first, .., last] = values[..] else {
                unreachable!("three at least")
            };
            claim(name, &[first, last], "% of the map", 4, grows(&values));
        }

        let gamma = |table: &EvaluatedTable| inside.range(table, by, 2);
        let points: Vec<(f64, f64)> = DIMENSIONS
            .iter()
            .zip(&self.all)
            .map(|(&k, table)| (k as f64, gamma(table)))
            .collect();
        let (slope, correlation) = line(&points);
        claim(
            "6: gamma: grows linearly with k, r of 0.8 at least (octaves per ten dimensions, r)",
            &[10.0 * slope, correlation],
            "",
            2,
            slope > 0.0 && correlation >= 0.8,
        );
        let values = ends(&self.blurs, &gamma);
        let [first, .., last] = values[..] else {
            unreachable!("four")
        };
        claim(
            "6: gamma: less smoothing tolerates more (none, gauss3)",
            &[first, last],
            "octaves",
            2,
            values.windows(2).all(|pair| pair[1] <= pair[0]) && last < first,
        );
    }
}

/// All views of a map as landmarks, by the core with the atlas and in f64.
fn of_all_views(map: &TestMap) -> [EvaluatedTable; 2] {
    let opened = map.open();
    let settings = Settings {
        selection: Selection::All,
        ..settings(map)
    };
    let trained = train(&opened, &settings, false, &Progress::Hidden).expect("trains");
    let atlas = trained.atlas();
    let (onboard, integral) = (Onboard::new(&atlas), Integral::new(opened.luminance()));
    let basis = PixelBasis::new(&trained.model, trained.candidates.preprocess(), 0.0);
    let landmarks = &trained.selected.landmarks;
    let exact = Exact::new(basis, settings.metric, &trained.coordinates, landmarks);
    let everywhere = [
        Everywhere::lazily(&onboard, &opened, &integral, map.view_size_px),
        Everywhere::densely(&exact, &opened, &integral, map.view_size_px),
    ];
    let sites = sites(&trained.candidates, landmarks);
    let (journal, progress) = (Journal::none(), Progress::Hidden);
    let found = evaluate(
        &opened,
        &sites,
        &everywhere,
        &report_plan(200),
        &journal,
        &progress,
    );
    let found = found.expect("nothing is written");
    [0, 1].map(|by| EvaluatedTable::new(found.iter().map(|one| one[by].clone())))
}

/// Which separate measure orders all views of a map as the score does: Spearman's ρ.
fn scores(map: &TestMap, table: &EvaluatedTable, out: &mut String) {
    // Those with room to be turned by 15°: at the edge neither score nor limits say much.
    let inside: Vec<_> = table
        .landmarks
        .iter()
        .filter(|one| {
            let reliability = &one.evaluated.nearest;
            let [low, high] = reliability.limits[&Measure::Orientation];
            reliability.ends[&Measure::Orientation] == [End::Failed; 2]
                || (low < -15.0 && high > 15.0)
        })
        .collect();
    let set = table.mean.score.expect("drawn");
    for (criterion, share) in [
        (Criterion::Nearest, set.right),
        (Criterion::Guaranteed, set.guaranteed),
    ] {
        let values = |value: &dyn Fn(&Reliability) -> f64| -> Vec<f64> {
            inside
                .iter()
                .map(|one| value(one.evaluated.by(criterion)))
                .collect()
        };
        let scores: Vec<f64> = inside
            .iter()
            .map(|one| {
                let score = one.score.expect("there is room");
                if criterion == Criterion::Nearest {
                    score.right
                } else {
                    score.guaranteed
                }
            })
            .collect();
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
            let pairs = ranks(&scores).into_iter().zip(ranks(&values(value)));
            line(&pairs.collect::<Vec<_>>()).1
        };
        let _ = writeln!(
            out,
            "| {} | {} | {} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} |",
            map.name,
            if criterion == Criterion::Nearest {
                "nearest"
            } else {
                "guaranteed"
            },
            inside.len(),
            100.0 * share,
            rho(&range(Measure::Orientation)),
            rho(&range(Measure::Altitude)),
            rho(&range(Measure::Gamma)),
            rho(&|one| one.catchment_px as f64),
        );
    }
}

/// Ranks from 1; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let below = values.iter().filter(|other| *other < value).count();
        let equal = values.iter().filter(|other| *other == value).count();
        below as f64 + (equal as f64 + 1.0) / 2.0
    };
    values.iter().map(rank).collect()
}

/// How the core with the atlas differs from f64.
fn differences(map: &TestMap, [core, f64]: &[EvaluatedTable; 2], out: &mut String) {
    let difference = core.against(f64);
    for (name, by, mean) in [
        ("nearest", &difference.nearest, &f64.mean.nearest),
        ("guaranteed", &difference.guaranteed, &f64.mean.guaranteed),
    ] {
        let _ = write!(
            out,
            "| {} | {name} | {} of {} ",
            map.name,
            by.equal,
            core.landmarks.len()
        );
        for (measure, digits) in Measure::REPORT.into_iter().zip([2, 4, 3]) {
            for side in by.mean[&measure] {
                let _ = write!(out, "| {:.digits$} ", side.expect("most fail at last"));
            }
        }
        let _ = writeln!(out, "| {:.1} | {:.0} |", by.catchment_px, mean.catchment_px);
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
    for (criterion, name) in Criterion::ALL.into_iter().zip(["nearest", "guaranteed"]) {
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
            .filter(|[low, high]| *low <= 0.2 && *high >= 5.0);
        let [mean_low, mean_high] =
            [0, 1].map(|side| mean(&limits.iter().map(|limit| limit[side]).collect::<Vec<f64>>()));
        let _ = writeln!(
            out,
            "| {} | {name} | {low:.2} | {high:.1} | {mean_low:.2} | {mean_high:.1} | {} of {} |",
            map.name,
            covering.count(),
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
    let of_all_views: Vec<[EvaluatedTable; 2]> = maps.iter().map(of_all_views).collect();
    out += SCORES;
    for (map, [_, f64]) in maps.iter().zip(&of_all_views) {
        scores(map, f64, &mut out);
    }
    out += DIFFERENCES;
    for (map, tables) in maps.iter().zip(&of_all_views) {
        differences(map, tables, &mut out);
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
f64. Means over the landmarks whose limit ends at the map's edge neither here nor at any blur or scale below; the row \"of\"
says how many those are. The report's criterion is `guaranteed`, (2.39), reconstructed; `nearest` asks only that the
landmark is the strict nearest one. Catchments are those of all eight as far as the map goes, in percent of it.
Gamma is tried in steps of 0.1 up to 10, and their reciprocals: the report's 0.5 is too coarse for guarantees.

| map | k | nearest: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % | guaranteed: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const CLAIMS: &str = "
## Claims 4 to 6

Ranges are from the lower to the upper limit, gamma in octaves; of blurs and scales, means over k = 2, 5, 10, 15 and 25,
always of the same landmarks.

| map | criterion | claim | | | | |
| --- | --- | --- | --- | --- | --- | --- |
";

const SCORES: &str = "
## The score and the separate measures

The score is the probability of a right fix under moderate deviations, all at once: ±20°, ±15 % shift, altitude to 1.2,
gamma to 2, noise; 200 views per landmark. All views of the report's layout are landmarks, 15 dimensions; Spearman's rank
correlation of the score with the range of each measure, over the landmarks with room to turn.

| map | criterion | landmarks | score of all, % | orientation | altitude | gamma | catchment |
| --- | --- | --- | --- | --- | --- | --- | --- |
";

const DIFFERENCES: &str = "
## The core with the atlas against f64

All views of the report's layout as landmarks, 15 dimensions: landmarks that agree in every limit and in their catchment,
mean differences regardless of sign (of limits that end in a failure by both), and the mean catchment in f64. Radii of the
atlas are narrowed by calibration, too.

| map | criterion | equal | orientation, ° from | to | altitude from | to | gamma from | to | catchment, px | of |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const NORMALIZED: &str = "
## Brightness with contrast normalized

Eight landmarks by profile with `--normalize std`, 15 dimensions: the lower limit that every landmark reaches, the upper
one, their means, and how many landmarks tolerate gamma 0.2 to 5.

| map | criterion | all from | to | mean from | to | 0.2 to 5 |
| --- | --- | --- | --- | --- | --- | --- |
";
