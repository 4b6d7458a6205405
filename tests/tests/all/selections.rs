//! What each way to select landmarks is worth on every map: radii, and how often the core is right. The measured table
//! is committed in `tests/selections.md`; set `EIGENMARK_BLESS` to renew it.

use eigenmark::{
    atlas::{AtlasBuffer, Folded, radii},
    evaluate::{Deviation, Outcome, deviated_fixes},
    learn::{Candidates, Model, Settings},
    map::Map,
    output::Progress,
    select::{
        Attention, Best, Eligible, Method, Preselection, Selection, Start, farthest_points, select,
    },
    train::learn,
};
use eigenmark_core::{atlas::Training, eigenspace::Normalize, landmark::Metric};
use eigenmark_tests::{
    maps::{self, TestMap},
    record::compare_or_bless,
};

/// Landmarks per selection, as in the report.
const LANDMARKS: u32 = 8;

/// Moderately deviated views per landmark: 1,000 per selection.
const VIEWS_PER_LANDMARK: usize = 125;

/// Seed of the deviations.
const SEED: u64 = 2004;

/// Shares may differ by this many percentage points from the committed ones, as in `judgements.rs`.
const TOLERANCE_PERCENT: f64 = 0.5;

/// Radii and their ratios may differ by this share: they are printed with three digits at least.
const RADIUS_TOLERANCE: f64 = 0.01;

/// The rounding of f32 that radii are given in, each a few of 2⁻²⁴.
const ROUNDING: f64 = 1e-6;

/// How candidates are laid out and compared.
#[derive(Clone, Copy, PartialEq)]
enum Setting {
    Report,
    Dense,
}

/// How landmarks are selected.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Profile,
    Ipca,
    Farthest,
    Reliable,
    Attentive(Attention),
}

/// A selection and what it is worth.
struct Row {
    setting: Setting,
    map: &'static str,
    way: Way,
    is_spaced: bool,
    smallest_radius: f64,
    mean_radius: f64,
    outcome: Outcome,
}

const IPCA: Method = Method::Ipca {
    start: Start::Profile,
    stop_residual: None,
};

const WAYS: [Way; 4] = [Way::Profile, Way::Ipca, Way::Farthest, Way::Reliable];

const ATTENTIVE: [Way; 3] = [
    Way::Attentive(Attention::Harris),
    Way::Attentive(Attention::Edges),
    Way::Attentive(Attention::Entropy),
];

impl Setting {
    fn name(self) -> &'static str {
        match self {
            Self::Report => "report",
            Self::Dense => "dense",
        }
    }

    fn of(self, map: &TestMap) -> Settings {
        let settings = Settings {
            view_size_px: map.view_size_px,
            ..Settings::default()
        };
        match self {
            Self::Report => settings,
            Self::Dense => Settings {
                stride_px: Some(map.view_size_px / 5),
                normalize: Normalize::Std,
                metric: Metric::Euclid,
                ..settings
            },
        }
    }
}

impl Way {
    fn name(self) -> &'static str {
        match self {
            Self::Profile => "profile",
            Self::Ipca => "ipca",
            Self::Farthest => "farthest",
            Self::Reliable => "reliable",
            Self::Attentive(Attention::Harris) => "harris, profile",
            Self::Attentive(Attention::Edges) => "edges, profile",
            Self::Attentive(Attention::Entropy) => "entropy, profile",
        }
    }

    /// `None` for what no user can ask for.
    fn best(self, spacing_px: f32) -> Option<Best> {
        let (method, attention) = match self {
            Self::Profile => (Method::Profile, None),
            Self::Ipca => (IPCA, None),
            Self::Farthest => return None,
            Self::Reliable => (Method::Reliable, None),
            Self::Attentive(attention) => (Method::Profile, Some(attention)),
        };
        Some(Best {
            spacing_px,
            preselection: attention.map(|attention| Preselection {
                attention,
                keep: None,
            }),
            ..Best::new(LANDMARKS, method)
        })
    }
}

/// A map and the eigenspace of its candidates.
struct Learned {
    map: Map,
    settings: Settings,
    candidates: Candidates,
    model: Model,
    coordinates: Vec<f64>,
}

impl Learned {
    fn new(setting: Setting, map: &TestMap) -> Self {
        let (map, settings) = (map.open(), setting.of(map));
        let (candidates, model) = learn(&map, &settings, 0, &Progress::Hidden).expect("learns");
        let coordinates = model.project(&candidates);
        Self {
            map,
            settings,
            candidates,
            model,
            coordinates,
        }
    }

    fn select(&self, way: Way, spacing_px: f32) -> Vec<u32> {
        let Some(best) = way.best(spacing_px) else {
            let grid = self.candidates.grid();
            let places = (1..=grid.count()).map(|view| grid.place(view)).collect();
            let eligible = Eligible::all(grid.count()).spaced(places, spacing_px);
            return farthest_points(
                self.settings.metric,
                &self.coordinates,
                self.model.dimensions,
                &eligible,
                LANDMARKS as usize,
            );
        };
        let settings = Settings {
            selection: Selection::Best(best),
            ..self.settings.clone()
        };
        select(
            &self.map,
            &self.candidates,
            &self.coordinates,
            &settings,
            false,
        )
        .expect("there is room")
        .landmarks
    }

    fn radii(&self, landmarks: &[u32], error: f64) -> Vec<f32> {
        let (metric, k) = (self.settings.metric, self.model.dimensions);
        radii(metric, &self.coordinates, k, landmarks, error)
    }

    /// Radii as the formula gives them: narrowed by quantization, but not by calibration.
    fn atlas(&self, landmarks: &[u32]) -> AtlasBuffer {
        let (model, settings) = (&self.model, &self.settings);
        let folded = Folded::new(model, &self.coordinates, &self.candidates, settings);
        let training = Training {
            scale: settings.scale as f32,
            blur: settings.blur,
            highpass: 0.0,
            whiten: 0.0,
            covered_variance: model.covered_variance() as f32,
            map_crc: self.map.crc(),
        };
        let radii = self.radii(landmarks, folded.error());
        folded
            .atlas(&self.map, &self.candidates, landmarks, &radii, training)
            .expect("few landmarks")
    }

    fn outcome(&self, landmarks: &[u32]) -> Outcome {
        let atlas = self.atlas(landmarks);
        let fixes = deviated_fixes(
            &self.map,
            &atlas.atlas(),
            &Deviation::MODERATE,
            VIEWS_PER_LANDMARK,
            SEED,
            &Progress::Hidden,
        );
        Outcome::of_landmarks(&fixes).into_iter().sum()
    }
}

/// All selections of a map.
fn rows(setting: Setting, map: &TestMap) -> Vec<Row> {
    let learned = Learned::new(setting, map);
    let row = |way, is_spaced| {
        let spacing_px = if is_spaced {
            map.view_size_px as f32
        } else {
            0.0
        };
        let landmarks = learned.select(way, spacing_px);
        assert_eq!(landmarks.len(), LANDMARKS as usize);
        assert!(are_apart(&learned.candidates, &landmarks, spacing_px));
        let radii = learned.radii(&landmarks, 0.0);
        let radii = || radii.iter().map(|&radius| f64::from(radius));
        Row {
            setting,
            map: map.name,
            way,
            is_spaced,
            smallest_radius: radii().fold(f64::INFINITY, f64::min),
            mean_radius: radii().sum::<f64>() / landmarks.len() as f64,
            outcome: learned.outcome(&landmarks),
        }
    };
    let anywhere = WAYS.into_iter().chain(ATTENTIVE).map(|way| row(way, false));
    let spaced = WAYS.into_iter().map(|way| row(way, true));
    anywhere.chain(spaced).collect()
}

fn are_apart(candidates: &Candidates, landmarks: &[u32], spacing_px: f32) -> bool {
    let places: Vec<_> = landmarks
        .iter()
        .map(|&view| candidates.grid().place(view))
        .collect();
    places.iter().enumerate().all(|(index, a)| {
        places[..index]
            .iter()
            .all(|b| (a.x_px - b.x_px).hypot(a.y_px - b.y_px) >= spacing_px)
    })
}

#[test]
fn reliable_selections_have_the_largest_radii_and_their_table_is_up_to_date() {
    let mut table = String::from(HEAD);
    let mut all = Vec::new();
    for setting in [Setting::Report, Setting::Dense] {
        for map in maps::all() {
            let rows = rows(setting, &map);
            assert_radii_are_bounded(&rows);
            rows.iter().for_each(|row| table.push_str(&row.line()));
            all.extend(rows);
        }
    }
    table.push_str(SUMMARY_HEAD);
    for setting in [Setting::Report, Setting::Dense] {
        for (way, is_spaced) in all[..WAYS.len() * 2 + ATTENTIVE.len()]
            .iter()
            .map(|row| (row.way, row.is_spaced))
        {
            table.push_str(&summary_line(&all, setting, way, is_spaced));
        }
    }
    compare_or_bless("selections.md", &table, |column, committed| match column {
        5 | 6 => RADIUS_TOLERANCE * committed.abs(),
        _ => TOLERANCE_PERCENT,
    });
}

/// Asserts on the selections of one map what must hold on any.
fn assert_radii_are_bounded(rows: &[Row]) {
    let smallest = |way, is_spaced| {
        let mut rows = rows.iter();
        let row = rows.find(|row| row.way == way && row.is_spaced == is_spaced);
        row.map_or(f64::NAN, |row| row.smallest_radius)
    };
    for row in rows {
        let reliable = smallest(Way::Reliable, row.is_spaced);
        let farthest = smallest(Way::Farthest, row.is_spaced);
        let line = row.line();
        // Exchanges begin with farthest points, and never make the smallest radius smaller.
        assert!(reliable >= farthest * (1.0 - ROUNDING), "{line}");
        // Not proven, but exchanges end only where none of 8 landmarks could be exchanged for a better one.
        assert!(reliable >= row.smallest_radius * (1.0 - ROUNDING), "{line}");
        // Farthest points without spacing are half as far apart as any selection; radii in nSSD are squares.
        let factor = match row.setting {
            Setting::Report => 0.25,
            Setting::Dense => 0.5,
        };
        let bound = factor * row.smallest_radius * (1.0 - ROUNDING);
        assert!(smallest(Way::Farthest, false) >= bound, "{line}");
    }
}

impl Row {
    fn spacing(&self) -> &'static str {
        spacing(self.is_spaced)
    }

    fn line(&self) -> String {
        let outcome = &self.outcome;
        let digits = match self.setting {
            Setting::Report => 5,
            Setting::Dense => 3,
        };
        format!(
            "| {} {} | {} | {} | {} | {:.digits$} | {:.digits$} | {:.1} | {:.1} | {:.1} |\n",
            self.setting.name(),
            self.map,
            self.way.name(),
            self.spacing(),
            outcome.views,
            self.smallest_radius,
            self.mean_radius,
            outcome.percent(outcome.right),
            outcome.percent(outcome.guaranteed),
            outcome.percent(outcome.guaranteed_wrong),
        )
    }
}

fn spacing(is_spaced: bool) -> &'static str {
    if is_spaced { "one view" } else { "none" }
}

/// The mean over the real maps of one way; radii relative to those of the profile's first landmarks anywhere.
fn summary_line(all: &[Row], setting: Setting, way: Way, is_spaced: bool) -> String {
    let real = |way, is_spaced| {
        let rows = all
            .iter()
            .filter(move |row| row.setting == setting && row.map != "city");
        rows.filter(move |row| row.way == way && row.is_spaced == is_spaced)
    };
    let count = real(way, is_spaced).count() as f64;
    let ratio = |of: fn(&Row) -> f64| {
        let pairs = real(way, is_spaced).zip(real(Way::Profile, false));
        pairs
            .map(|(row, profile)| of(row) / of(profile))
            .sum::<f64>()
            / count
    };
    let share = |of: fn(&Outcome) -> u64| {
        let shares = real(way, is_spaced).map(|row| row.outcome.percent(of(&row.outcome)));
        shares.sum::<f64>() / count
    };
    let views: u64 = real(way, is_spaced).map(|row| row.outcome.views).sum();
    format!(
        "| {} | {} | {} | {views} | {:.2} | {:.2} | {:.1} | {:.1} | {:.1} |\n",
        setting.name(),
        way.name(),
        spacing(is_spaced),
        ratio(|row| row.smallest_radius),
        ratio(|row| row.mean_radius),
        share(|outcome| outcome.right),
        share(|outcome| outcome.guaranteed),
        share(|outcome| outcome.guaranteed_wrong),
    )
}

const HEAD: &str = "\
# What selections are worth, measured

Written by `tests/tests/all/selections.rs`, which fails when a bound breaks or a number moves. Eight landmarks at scale
1/10, gauss1, k = 15.

- *Report*: the report's layout of 83 views (113 on the square kitsap), no normalization, nSSD.
- *Dense*: a view every fifth of a footprint, zero mean and unit variance, Euclidean distance.
- *Farthest*: farthest points. *Reliable*: the same after exchanges.
- *Spacing*: landmarks anywhere, or at least a footprint apart. Without it, landmarks may overlap, and a view of one is
  then also a view of the other, but counts as wrong.
- *Harris*, *edges*, *entropy*: the profile of the quarter of the views that attracts most attention.
- *Radius*: by the formula, in the metric's unit; on board it is narrowed by quantization. Calibration, which narrows
  radii that trying shows to be too wide, is left out: *guaranteed wrong* is what it has to remove.
- Views deviate moderately, as in `judgements.md`; shares in percent.

| map | selection | spacing | views | smallest radius | mean radius | right | guaranteed | guaranteed wrong |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const SUMMARY_HEAD: &str = "
The mean over the real maps; radii relative to those of the profile without spacing.

| setting | selection | spacing | views | smallest radius | mean radius | right | guaranteed | guaranteed wrong |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";
