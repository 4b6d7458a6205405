//! The report's grid of experiments (section 3.1): on every map, at every scale, blur and dimension, the fast routes rank
//! as the report's algorithms do.

use eigenmark::{
    evaluate::REPORT_DIMENSIONS,
    learn::{Candidates, Matrix, Model, Preprocess, Rows, Settings},
    map::Map,
    output::Progress,
    select::{
        Dissimilarity, Eligible, Order, Profile, Route, Until, rank_by_ipca, rank_by_ipca_literally,
    },
    train::learn,
};
use eigenmark_core::{atlas::Blur, eigenspace::Normalize};
use eigenmark_tests::maps::{self, TestMap};
use rayon::prelude::*;

/// Scale factors of table 3.1.
const SCALES: [f64; 11] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0];

/// Blurs of table 3.2.
const BLURS: [Blur; 4] = [Blur::None, Blur::Gauss1, Blur::Gauss2, Blur::Gauss3];

/// Start lists rnd1 to rnd5, as tables A.13 to A.15 have them.
const STARTS: [[u32; 3]; 5] = [
    [20, 51, 79],
    [2, 29, 69],
    [9, 36, 62],
    [34, 77, 78],
    [15, 62, 77],
];

/// Landmarks of the report's tables.
const LANDMARKS: usize = 8;

/// Views of more pixels are ranked up to [`LANDMARKS`], others to the last: the literal algorithm takes long.
const RANKED_WHOLE_UP_TO: usize = 100;

/// How many rankings were compared.
#[derive(Default)]
struct Compared {
    profile: usize,
    ipca: usize,
}

#[test]
fn fast_routes_rank_as_the_reports_algorithms_on_its_whole_grid() {
    for test_map in maps::all() {
        let map = test_map.open();
        let cells: Vec<(f64, Blur)> = SCALES
            .iter()
            .flat_map(|&scale| BLURS.map(|blur| (scale, blur)))
            .collect();
        let compared: Vec<Compared> = cells
            .par_iter()
            .map(|&(scale, blur)| compare(&test_map, &map, scale, blur))
            .collect();
        println!(
            "{}: {} cells, {} profile rankings, {} IPCA rankings",
            test_map.name,
            cells.len(),
            compared.iter().map(|cell| cell.profile).sum::<usize>(),
            compared.iter().map(|cell| cell.ipca).sum::<usize>()
        );
    }
}

/// Landmarks of an IPCA ranking of a dense grid.
const MANY_LANDMARKS: usize = 30;

/// Some thousand views, as only the fast routes are meant for: the routes that are taken by themselves.
#[test]
fn dense_grids_are_ranked_as_the_reports_algorithms_do() {
    for test_map in maps::all() {
        let settings = Settings {
            view_size_px: test_map.view_size_px,
            stride_px: Some(test_map.view_size_px / 7),
            ..Settings::default()
        };
        let (candidates, model) =
            learn(&test_map.open(), &settings, 0, &Progress::Hidden).expect("learned");
        let (n, k) = (candidates.count(), model.dimensions);
        let coordinates = model.project(&candidates);
        for dissimilarity in [
            Dissimilarity::Nssd,
            Dissimilarity::NssdCentered,
            Dissimilarity::Ssd,
            Dissimilarity::Euclid,
            Dissimilarity::Angle,
        ] {
            let fast = Route::automatic(dissimilarity, n);
            assert_ne!(fast, Route::Literal);
            let [literal, fast] = [Route::Literal, fast]
                .map(|route| Profile::new(dissimilarity, &coordinates, k, route));
            for order in [Order::MostDissimilar, Order::LeastDissimilar] {
                assert_eq!(
                    fast.rank(order, n).candidates,
                    literal.rank(order, n).candidates,
                    "{} {dissimilarity:?} {order:?}",
                    test_map.name
                );
            }
        }
        let eligible = Eligible::all(n as u32);
        let until = Until::landmarks(MANY_LANDMARKS);
        let [literal, fast] = [
            rank_by_ipca_literally(&candidates, &eligible, &[1, 2, 3], until),
            rank_by_ipca(&candidates, &eligible, &[1, 2, 3], until),
        ]
        .map(|ranked| ranked.expect("ranked").ranking);
        assert_eq!(fast, literal, "{}", test_map.name);
        println!("{}: {n} views", test_map.name);
    }
}

/// All rankings of one scale and blur.
fn compare(test_map: &TestMap, map: &Map, scale: f64, blur: Blur) -> Compared {
    let settings = Settings {
        scale,
        view_size_px: test_map.view_size_px,
        ..Settings::default()
    };
    let side = settings.view_side() as usize;
    let preprocess = Preprocess::new(side, Normalize::None, blur, 0.0);
    let grid = settings.grid(map).expect("fits");
    let candidates = Candidates::new(map, &grid, &preprocess).expect("windows are frames");
    let mut vectors = vec![0.0; candidates.count() * candidates.pixels()];
    candidates.read(0, &mut vectors);
    let rows = Matrix::new(&vectors, candidates.pixels());

    let spanned = (rows.count() - 1).min(rows.pixels());
    let model = Model::learn(&rows, spanned).expect("views of a map are independent");
    let coordinates = model.project(&rows);
    let mut compared = Compared::default();
    let mut starts = STARTS.map(Vec::from).to_vec();
    // The last means all: 83 views span 82.
    for k in REPORT_DIMENSIONS.map(|k| k.min(spanned)) {
        let points: Vec<f64> = coordinates
            .chunks_exact(spanned)
            .flat_map(|row| &row[..k])
            .copied()
            .collect();
        let cell = format!("{} 1/{scale} {blur:?} k = {k}", test_map.name);
        let best = compare_profiles(&points, k, &cell, &mut compared);
        starts.push(best[..3].to_vec());
    }
    starts.sort();
    starts.dedup();
    let eligible = Eligible::all(rows.count() as u32);
    let until = Until::landmarks(if rows.pixels() <= RANKED_WHOLE_UP_TO {
        rows.count()
    } else {
        LANDMARKS
    });
    for start in starts {
        let literal = rank_by_ipca_literally(&rows, &eligible, &start, until).expect("ranked");
        let fast = rank_by_ipca(&rows, &eligible, &start, until).expect("ranked");
        assert!(literal.ranking.len() >= LANDMARKS, "no dashes");
        assert_eq!(
            (&fast.ranking, fast.stop),
            (&literal.ranking, literal.stop),
            "{} 1/{scale} {blur:?} from {start:?}",
            test_map.name
        );
        compared.ipca += 1;
    }
    compared
}

/// Compares the profile rankings of `points`; gives the literal one by nSSD.
fn compare_profiles(points: &[f64], k: usize, cell: &str, compared: &mut Compared) -> Vec<u32> {
    let n = points.len() / k;
    let rank = |dissimilarity, route, order| {
        Profile::new(dissimilarity, points, k, route)
            .rank(order, n)
            .candidates
    };
    for (dissimilarity, routes) in [
        (Dissimilarity::Nssd, &[Route::Blocked, Route::Fast][..]),
        (Dissimilarity::Ssd, &[Route::Blocked, Route::Fast]),
        (Dissimilarity::NssdCentered, &[Route::Fast]),
        (Dissimilarity::Euclid, &[Route::Blocked]),
        (Dissimilarity::Angle, &[Route::Blocked]),
    ] {
        for order in [Order::MostDissimilar, Order::LeastDissimilar] {
            let literal = rank(dissimilarity, Route::Literal, order);
            for &route in routes {
                let fast = rank(dissimilarity, route, order);
                assert_eq!(
                    fast, literal,
                    "{cell} {dissimilarity:?} {route:?} {order:?}"
                );
                compared.profile += 1;
            }
        }
    }
    rank(Dissimilarity::Nssd, Route::Literal, Order::MostDissimilar)
}
