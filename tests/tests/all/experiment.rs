//! The grid of experiments against the evaluation of single tables, one by one; and what is kept of it.

use std::{fs, path::Path};

use eigenmark::{
    evaluate::{
        Criterion, Deviation, EvaluatedLandmark, EvaluatedTable, Everywhere, Exact, Journal, Judge,
        Plan as Evaluation, Site, evaluate,
        reliability::{End, Measure, Steps},
    },
    experiment::{Asked, Cell, Grid, Method, Plan, claims, run},
    learn::{Candidates, Model, PixelBasis, Preprocess, Settings},
    map::{Integral, Map},
    output::Progress,
};
use eigenmark_core::{atlas::Blur, eigenspace::Normalize};
use image::imageops::crop_imm;

/// A part of the city: 8×6 views of 50×50 pixels, and 35 on their corners.
fn map() -> Map {
    let part = crop_imm(Map::city().luminance(), 300, 300, 400, 300).to_image();
    Map::from_luminance("part of the city", part)
}

fn plan(map: &Map) -> Plan {
    Plan {
        dimensions: vec![2, 5, 15, 83],
        methods: vec![
            Method::Profile,
            Method::IpcaProfile,
            Method::IpcaStart(0),
            Method::Fixed,
            Method::Linkage,
            Method::KMeans,
        ],
        ..Plan::report(map, 50, 8).expect("fits")
    }
}

fn asked(scales: &[f64], blurs: &[Blur]) -> Asked {
    Asked {
        scales: scales.to_vec(),
        blurs: blurs.to_vec(),
        is_fresh: false,
    }
}

fn computed(map: &Map, plan: &Plan, asked: &Asked, directory: &Path) -> Grid {
    run(map, plan, asked, directory, "test", &Progress::Hidden).expect("computes")
}

/// The same table by the evaluation of single tables: limits, and verdicts for the literal catchment.
struct Single {
    exact: Exact,
    sites: Vec<Site>,
    side: usize,
}

impl Single {
    fn new(map: &Map, settings: &Settings, dimensions: usize, landmarks: &[u32]) -> Self {
        let side = settings.view_side() as usize;
        let preprocess = Preprocess::new(side, Normalize::None, settings.blur, 0.0);
        let grid = settings.grid(map).expect("fits");
        let candidates = Candidates::new(map, &grid, &preprocess).expect("candidates");
        let model = Model::learn(&candidates, dimensions).expect("learns");
        let basis = PixelBasis::new(&model, &preprocess, 0.0);
        let coordinates = model.project(&candidates);
        let site = |&view: &u32| Site::from(&grid.candidate(view));
        Self {
            exact: Exact::new(basis, settings.metric, &coordinates, landmarks),
            sites: landmarks.iter().map(site).collect(),
            side,
        }
    }

    fn evaluate(&self, map: &Map) -> EvaluatedTable {
        let integral = Integral::new(map.luminance());
        let everywhere = [Everywhere::lazily(&self.exact, map, &integral, 50)];
        let plan = Evaluation {
            measures: Measure::REPORT.to_vec(),
            steps: Steps { gamma: 0.1 },
            deviation: Deviation::MODERATE,
            views: 0,
            seed: 1,
        };
        let found = evaluate(
            map,
            &self.sites,
            &everywhere,
            &plan,
            &Journal::none(),
            &Progress::Hidden,
        );
        let found = found.expect("nothing is written");
        EvaluatedTable::new(found.into_iter().map(|mut by| by.swap_remove(0)))
    }

    /// Positions `step` map pixels apart that are localized at a landmark and joined to it: an area in map pixels.
    fn catchment(&self, map: &Map, landmark: usize, step: i64, criterion: Criterion) -> u64 {
        let integral = Integral::new(map.luminance());
        let corner = self.sites[landmark].corner(50).map(i64::from);
        let [width, height] = [map.width(), map.height()].map(|size| i64::from(size) - 50);
        let holds = |[x, y]: [i64; 2]| {
            let (x, y) = (corner[0] + x * step, corner[1] + y * step);
            if !(0..=width).contains(&x) || !(0..=height).contains(&y) {
                return false;
            }
            let mut view = vec![0; self.side * self.side];
            integral.reduce((x as u32, y as u32), 50, self.side, &mut view);
            criterion.holds(self.exact.judge(&view), landmark as u32)
        };
        let mut found = std::collections::BTreeSet::new();
        let mut is_growing = holds([0, 0]);
        if is_growing {
            found.insert([0, 0]);
        }
        for turn in 1.. {
            if !is_growing {
                break;
            }
            is_growing = false;
            // Right side down, bottom to the left, left side up, top to the right, and the rest of the right side.
            let ring = (0..turn)
                .map(|i| [turn, i])
                .chain((0..2 * turn).map(|i| [turn - i, turn]))
                .chain((0..2 * turn).map(|i| [-turn, turn - i]))
                .chain((0..2 * turn).map(|i| [i - turn, -turn]))
                .chain((0..turn).map(|i| [turn, i - turn]));
            for [x, y] in ring {
                let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
                if near.into_iter().any(|other| found.contains(&other)) && holds([x, y]) {
                    found.insert([x, y]);
                    is_growing = true;
                }
            }
        }
        found.len() as u64 * (step * step) as u64
    }
}

#[test]
fn cells_say_of_every_table_what_its_own_evaluation_says() {
    let map = map();
    let plan = plan(&map);
    let directory = tempfile::tempdir().expect("a directory");
    // Views of 10×10 pixels, a whole ratio; and of 7×7, where 5 map pixels are the step that landmarks share best.
    for (scale, step) in [(5.0, 5), (7.0, 5)] {
        let asked = asked(&[scale], &[Blur::Gauss1, Blur::Gauss3]);
        let grid = computed(&map, &plan, &asked, directory.path());
        for (blur, methods) in [
            (
                Blur::Gauss1,
                &[Method::Profile, Method::IpcaStart(0), Method::KMeans][..],
            ),
            (
                Blur::Gauss3,
                &[Method::Fixed, Method::IpcaProfile, Method::Linkage],
            ),
        ] {
            let cell = grid.cell(scale, blur).expect("computed");
            for &method in methods {
                for k in [2, 15] {
                    let settings = Settings {
                        scale,
                        blur,
                        ..plan.settings.clone()
                    };
                    compare(&map, cell, &settings, (method, k), step);
                }
            }
        }
    }
}

/// One table of a cell.
fn compare(map: &Map, cell: &Cell, settings: &Settings, (method, k): (Method, usize), step: i64) {
    let table = cell.table(method, k).expect("selected");
    let single = Single::new(map, settings, k, &table.landmarks);
    for (landmark, expected) in single.evaluate(map).landmarks.iter().enumerate() {
        let EvaluatedLandmark { evaluated, .. } = expected;
        for (by, criterion) in Criterion::ALL.into_iter().enumerate() {
            let found = &table.tolerated[landmark][by];
            let expected = evaluated.by(criterion);
            assert_eq!(found.limits, expected.limits, "{method:?} {k} {landmark}");
            assert_eq!(found.ends, expected.ends);
            let area = single.catchment(map, landmark, step, criterion);
            assert_eq!(
                found.catchment_px, area,
                "{method:?} {k} {landmark} {criterion:?}"
            );
        }
    }
}

#[test]
fn only_what_changed_is_computed_again() {
    let map = map();
    let plan = plan(&map);
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path();
    let blurs = [Blur::None, Blur::Gauss1];
    let all = asked(&[5.0, 10.0], &blurs);
    let first = computed(&map, &plan, &asked(&[5.0], &blurs), path);
    assert_eq!((first.computed, first.cells.len()), (2, 2));
    // Another scale: the cells of the first are known. Scale 7 is not of the report's, and is not looked for.
    let second = computed(&map, &plan, &all, path);
    assert_eq!((second.computed, second.cells.len()), (2, 4));
    assert_eq!(second.cells[..2], first.cells[..]);
    let bytes = |name: &str| fs::read(path.join(name)).expect("kept");
    let kept = [
        "5-none.jsonl",
        "5-gauss1.jsonl",
        "10-none.jsonl",
        "10-gauss1.jsonl",
    ]
    .map(bytes);

    // One cell again gives the same bytes.
    let again = Asked {
        is_fresh: true,
        ..asked(&[10.0], &[Blur::Gauss1])
    };
    let third = computed(&map, &plan, &again, path);
    assert_eq!((third.computed, third.cells.len()), (1, 4));
    assert_eq!(bytes("10-gauss1.jsonl"), kept[3]);

    // A damaged cell is not believed, nor one that is cut short.
    let mut damaged = kept[0].clone();
    let middle = damaged.len() / 2;
    damaged[middle] = if damaged[middle] == b'1' { b'2' } else { b'1' };
    fs::write(path.join("5-none.jsonl"), damaged).expect("writable");
    fs::write(path.join("5-gauss1.jsonl"), &kept[1][..middle]).expect("writable");
    let fourth = computed(&map, &plan, &all, path);
    assert_eq!(fourth.computed, 2);
    assert_eq!(fourth.cells, second.cells);
    assert_eq!(bytes("5-none.jsonl"), kept[0]);

    // Other landmarks are another experiment.
    let other = Plan {
        landmarks: 5,
        ..plan.clone()
    };
    assert_eq!(
        computed(&map, &other, &asked(&[10.0], &[Blur::None]), path).computed,
        1
    );
    // And so is another map.
    let mut pixels = map.luminance().clone();
    pixels.put_pixel(7, 7, image::Luma([pixels.get_pixel(7, 7).0[0] ^ 1]));
    let moved = Map::from_luminance("another", pixels);
    assert_eq!(
        computed(&moved, &plan, &asked(&[5.0], &[Blur::None]), path).computed,
        1
    );
}

#[test]
fn claims_are_open_while_cells_are_missing() {
    let map = map();
    let plan = plan(&map);
    let directory = tempfile::tempdir().expect("a directory");
    let grid = computed(
        &map,
        &plan,
        &asked(&[5.0], &[Blur::Gauss1]),
        directory.path(),
    );
    let claims = claims::judge(&grid);
    let numbers: Vec<u32> = claims.iter().map(|claim| claim.claim).collect();
    assert_eq!(numbers, (1..=10).collect::<Vec<_>>());
    // One cell is enough for selections and clusters, not for what is said of scales, blurs, or scale 1/10.
    for (claim, is_open) in [
        (1, true),
        (2, true),
        (4, true),
        (6, true),
        (7, false),
        (8, false),
        (10, true),
    ] {
        let found = &claims[claim - 1];
        assert_eq!(found.holds.is_none(), is_open, "{found:?}");
    }
    let cell = &grid.cells[0];
    assert_eq!(
        cell.dims,
        [2, 5, 15, 82],
        "83 views span one dimension less"
    );
    let limits = &cell.table(Method::Fixed, 15).expect("selected").tolerated[0][0];
    assert!(
        limits
            .ends
            .values()
            .flatten()
            .any(|end| *end == End::Failed)
    );
}
