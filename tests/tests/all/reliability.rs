//! How far landmarks can be trusted on every map, what the combined score has to do with the separate measures, and what
//! contrast normalization is worth. The measured tables are committed in `tests/reliability.md`; set `EIGENMARK_BLESS` to renew them.

use std::fmt::Write;

use eigenmark::{
    evaluate::{
        Criterion, Deviation, EvaluatedTable, Everywhere, Exact, Journal, Onboard, Plan, Site,
        evaluate,
        reliability::{End, Measure, Reliability, Steps},
    },
    experiment::claims::rank_correlation,
    learn::{Candidates, Model, PixelBasis, Settings, first_columns},
    map::{Integral, Map},
    output::Progress,
    select::{Selection, select},
    train::{learn, train},
};
use eigenmark_core::eigenspace::Normalize;
use eigenmark_tests::{
    maps::{self, TestMap},
    record::compare_or_bless,
};

/// Numbers of dimensions from 2 to 35, as in (3.2).
const DIMENSIONS: [usize; 11] = [2, 3, 5, 7, 10, 12, 15, 18, 20, 25, 35];

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
    let site = |&view: &u32| Site::from(&candidates.grid().candidate(view));
    landmarks.iter().map(site).collect()
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
}

/// The mean catchment of all landmarks, as far as the map goes, in percent of the map.
fn catchment(table: &EvaluatedTable, by: usize) -> f64 {
    100.0 * table.mean.by(Criterion::ALL[by]).catchment_share
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
}

impl Measured {
    fn new(map: &TestMap) -> Self {
        let opened = map.open();
        let learned = Learned::new(&opened, settings(map));
        let all = learned.evaluate(&opened, &DIMENSIONS, &report_plan(0));
        Self {
            name: map.name,
            inside: Inside::of(&all.iter().collect::<Vec<_>>()),
            all,
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
            let pairs = scores.iter().copied().zip(values(value));
            rank_correlation(&pairs.collect::<Vec<_>>())
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
