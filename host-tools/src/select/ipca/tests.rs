//! The lazy route against the printed algorithm, and both where views are degenerate.

use eigenmark_core::landmark::Point;
use rand::RngExt;

use super::{
    IpcaError, IpcaRanking, Stop, Until, random_start, rank_by_ipca, rank_by_ipca_literally,
};
use crate::learn::{Matrix, Rows};
use crate::select::Eligible;
use crate::simulate::seeded;

/// Residuals of the two routes, as a share of the largest: measured at most 9·10⁻¹⁶.
const ROUNDING: f64 = 1e-13;

/// Both routes' common result.
fn ranked(rows: &dyn Rows, eligible: &Eligible, start: &[u32], until: Until) -> IpcaRanking {
    let found = rank_by_ipca(rows, eligible, start, until).expect("a start");
    let literal = rank_by_ipca_literally(rows, eligible, start, until).expect("a start");
    assert_eq!(found.ranking, literal.ranking);
    assert_eq!(found.stop, literal.stop);
    assert_eq!(found.residuals.len(), found.ranking.len());
    let largest = found.residuals.iter().copied().fold(0.0, f64::max);
    for (ours, literal) in found.residuals.iter().zip(&literal.residuals) {
        assert!(
            (ours - literal).abs() <= ROUNDING * largest,
            "{ours} {literal}"
        );
    }
    found
}

fn all_of(rows: &dyn Rows) -> Eligible {
    Eligible::all(rows.count() as u32)
}

/// n views of m random gray levels.
fn random_views(stream: u64, n: usize, m: usize) -> Vec<f32> {
    let mut random = seeded(11, stream);
    (0..n * m)
        .map(|_| random.random_range(0.0..255.0))
        .collect()
}

/// Windows of 12×12 of a smooth picture, some of them overlapping: like views of a map.
fn smooth_views(stream: u64, n: usize) -> Vec<f32> {
    const SIDE: usize = 64;
    const WINDOW: usize = 12;
    let mut random = seeded(12, stream);
    let waves: Vec<[f32; 4]> = (0..40)
        .map(|_| [0.4, 0.4, 6.3, 30.0].map(|most| random.random_range(-most..most)))
        .collect();
    let picture: Vec<f32> = (0..SIDE * SIDE)
        .map(|i| {
            let (x, y) = ((i % SIDE) as f32, (i / SIDE) as f32);
            let wave =
                |[a, b, phase, strength]: &[f32; 4]| strength * (a * x + b * y + phase).sin();
            (128.0 + waves.iter().map(wave).sum::<f32>()).round()
        })
        .collect();
    let mut views = Vec::new();
    for _ in 0..n {
        let [left, top] = [0; 2].map(|_: usize| random.random_range(0..SIDE - WINDOW));
        for row in top..top + WINDOW {
            views.extend_from_slice(&picture[row * SIDE + left..][..WINDOW]);
        }
    }
    views
}

#[test]
fn pivoted_matches_literal_on_random_views() {
    for (stream, (n, m, landmarks)) in [(300, 40, 30), (50, 90, 50), (200, 3, 10), (2, 7, 2)]
        .into_iter()
        .enumerate()
    {
        let views = random_views(stream as u64, n, m);
        let rows = Matrix::new(&views, m);
        for size in [1, 2, 5] {
            if size > n {
                continue;
            }
            let start = random_start(&all_of(&rows), size, stream as u64).expect("enough");
            let found = ranked(&rows, &all_of(&rows), &start, Until::landmarks(landmarks));
            assert_eq!(found.ranking[..size], start);
            let is_complete = found.ranking.len() == landmarks;
            assert_eq!(is_complete, found.stop == Stop::Landmarks);
            assert_eq!(is_complete, landmarks <= m + 1);
            // Residuals never grow once the start list is behind.
            assert!(found.residuals[size..].is_sorted_by(|a, b| a >= b));
        }
    }
}

#[test]
fn pivoted_matches_literal_on_clustered_views() {
    let mut random = seeded(13, 0);
    let centers = random_views(20, 8, 30);
    let views: Vec<f32> = (0..400)
        .flat_map(|i| {
            let center = &centers[i % 8 * 30..][..30];
            let noisy: Vec<f32> = center
                .iter()
                .map(|level| level + random.random_range(-0.01..0.01))
                .collect();
            noisy
        })
        .collect();
    let rows = Matrix::new(&views, 30);
    let found = ranked(&rows, &all_of(&rows), &[9, 3], Until::landmarks(31));
    // One of each cluster comes first.
    let mut clusters: Vec<u32> = found.ranking[..8].iter().map(|c| (c - 1) % 8).collect();
    clusters.sort_unstable();
    assert!(clusters.into_iter().eq(0..8));
    assert_eq!(found.stop, Stop::Landmarks);
}

#[test]
fn pivoted_matches_literal_on_smooth_views() {
    for stream in 0..4 {
        let views = smooth_views(stream, 500);
        let rows = Matrix::new(&views, 144);
        let found = ranked(&rows, &all_of(&rows), &[5, 60, 2], Until::landmarks(80));
        assert_eq!(found.stop, Stop::Landmarks);
    }
}

#[test]
fn pivoted_matches_literal_where_most_residuals_are_nearly_zero() {
    // Views of eight patterns, each a tenth as strong as the one before: down to what single precision can say.
    let mut random = seeded(14, 0);
    let patterns = random_views(21, 8, 50);
    let views: Vec<f32> = (0..300)
        .flat_map(|_| {
            let parts: Vec<f32> = (0..8)
                .map(|i| random.random_range(-1.0..1.0) / 10_f32.powi(i))
                .collect();
            let pixel =
                |pixel: usize| -> f32 { (0..8).map(|i| parts[i] * patterns[i * 50 + pixel]).sum() };
            (0..50).map(pixel).collect::<Vec<f32>>()
        })
        .collect();
    let rows = Matrix::new(&views, 50);
    let found = ranked(&rows, &all_of(&rows), &[1, 2, 3], Until::landmarks(60));
    assert_eq!(found.stop, Stop::Exhausted);
    assert!(
        (7..=9).contains(&found.ranking.len()),
        "{:?}",
        found.ranking
    );
}

#[test]
fn of_views_that_look_alike_the_lowest_number_comes_first() {
    let distinct = random_views(22, 20, 12);
    // Candidate i and candidate 41 - i are the same view.
    let mut views = distinct.clone();
    views.extend(distinct.chunks_exact(12).rev().flatten());
    let rows = Matrix::new(&views, 12);
    let found = ranked(&rows, &all_of(&rows), &[38], Until::landmarks(40));
    assert_eq!(found.ranking.len(), 13);
    assert!(found.ranking[1..].iter().all(|&candidate| candidate <= 20));
    assert!(!found.ranking.contains(&3), "the same view as the first");
    assert_eq!(found.stop, Stop::Exhausted);
}

#[test]
fn equal_residuals_of_different_views_are_ranked_by_number() {
    // The corners of a simplex: always equally far from each other, whatever has been selected.
    let mut views = vec![0.0; 30 * 30];
    for i in 0..30 {
        views[i * 30 + (i * 7) % 30] = 100.0 / 3.0;
    }
    let rows = Matrix::new(&views, 30);
    let found = ranked(&rows, &all_of(&rows), &[4], Until::landmarks(30));
    let mut expected: Vec<u32> = (1..=30).filter(|&candidate| candidate != 4).collect();
    expected.insert(0, 4);
    assert_eq!(found.ranking, expected);
}

#[test]
fn start_members_that_add_nothing_are_landmarks_all_the_same() {
    let mut views = random_views(23, 60, 20);
    let (first, second) = (views[..20].to_vec(), views[20..40].to_vec());
    views[40..60].copy_from_slice(&first); // 3 is 1 again
    for (pixel, view) in views[60..80].iter_mut().enumerate() {
        *view = 0.25 * first[pixel] + 0.75 * second[pixel]; // 4 is between 1 and 2
    }
    let rows = Matrix::new(&views, 20);
    let found = ranked(&rows, &all_of(&rows), &[1, 3, 2, 4], Until::landmarks(12));
    assert_eq!(found.ranking[..4], [1, 3, 2, 4]);
    assert_eq!(found.residuals[..2], [0.0, 0.0]);
    assert!(found.residuals[2] > 1.0 && found.residuals[3] < 1e-4);
    assert_eq!(found.ranking.len(), 12);
    let without = ranked(&rows, &all_of(&rows), &[1, 2], Until::landmarks(10));
    assert_eq!(found.ranking[4..], without.ranking[2..]);
}

#[test]
fn start_members_that_differ_by_nothing_beside_the_largest_distance_span_nothing() {
    let mut views = random_views(28, 40, 10);
    for (pixel, view) in views[..20].iter_mut().enumerate() {
        *view = (pixel % 10) as f32 + if pixel == 13 { 1e-4 } else { 0.0 };
    }
    let rows = Matrix::new(&views, 10);
    let found = ranked(&rows, &all_of(&rows), &[1, 2], Until::landmarks(40));
    assert!(found.residuals[1] > 0.0);
    let without = ranked(&rows, &all_of(&rows), &[1], Until::landmarks(40));
    assert_eq!(found.ranking[2..], without.ranking[1..]);
    assert_eq!(without.ranking.len(), 11);
}

#[test]
fn where_all_views_are_equal_only_the_start_list_is_ranked() {
    let views = vec![77.0; 9 * 5];
    let rows = Matrix::new(&views, 5);
    let found = ranked(&rows, &all_of(&rows), &[6, 2], Until::landmarks(4));
    let expected = IpcaRanking {
        ranking: vec![6, 2],
        residuals: vec![0.0, 0.0],
        stop: Stop::Exhausted,
    };
    assert_eq!(found, expected);
}

#[test]
fn a_line_has_two_landmarks() {
    let views: Vec<f32> = (0..50)
        .flat_map(|i| [3.0, 1.0, 4.0].map(|x| x * i as f32))
        .collect();
    let rows = Matrix::new(&views, 3);
    let found = ranked(&rows, &all_of(&rows), &[20], Until::landmarks(10));
    assert_eq!((found.ranking, found.stop), (vec![20, 50], Stop::Exhausted));
}

#[test]
fn one_pixel_is_enough() {
    let views: Vec<f32> = vec![1.0, 8.0, 3.0, 8.0];
    let rows = Matrix::new(&views, 1);
    let found = ranked(&rows, &all_of(&rows), &[1], Until::landmarks(4));
    assert_eq!((found.ranking, found.stop), (vec![1, 2], Stop::Exhausted));
    assert_eq!(found.residuals, [0.0, 7.0]);
}

#[test]
fn a_candidate_alone_is_exhausted_at_once() {
    let views = random_views(24, 1, 6);
    let rows = Matrix::new(&views, 6);
    let found = ranked(&rows, &all_of(&rows), &[1], Until::landmarks(2));
    assert_eq!((found.ranking, found.stop), (vec![1], Stop::Exhausted));
}

#[test]
fn a_start_list_longer_than_the_table_is_cut() {
    let views = random_views(25, 9, 6);
    let rows = Matrix::new(&views, 6);
    let found = ranked(&rows, &all_of(&rows), &[4, 9, 1], Until::landmarks(2));
    assert_eq!((found.ranking, found.stop), (vec![4, 9], Stop::Landmarks));
    let none = ranked(&rows, &all_of(&rows), &[4], Until::landmarks(0));
    assert_eq!((none.ranking, none.stop), (vec![], Stop::Landmarks));
}

#[test]
fn landmarks_keep_their_spacing_in_both_routes() {
    let views = smooth_views(9, 300);
    let rows = Matrix::new(&views, 144);
    let places: Vec<Point> = (0..300)
        .map(|i| Point {
            x_px: (i % 20 * 10) as f32,
            y_px: (i / 20 * 10) as f32,
        })
        .collect();
    let eligible = Eligible::all(300).spaced(places, 35.0);
    let found = ranked(&rows, &eligible, &[150, 7], Until::landmarks(60));
    assert_eq!(found.stop, Stop::Exhausted);
    assert!(found.ranking.len() > 10);
    for (i, &landmark) in found.ranking.iter().enumerate() {
        assert!(eligible.admits(landmark, &found.ranking[..i]));
    }
    let error = rank_by_ipca(&rows, &eligible, &[150, 7, 151], Until::landmarks(60));
    let (candidate, other) = (151, 150);
    assert_eq!(error, Err(IpcaError::TooClose { candidate, other }));
}

#[test]
fn only_eligible_candidates_are_ranked() {
    let views = random_views(26, 200, 25);
    let rows = Matrix::new(&views, 25);
    let eligible = Eligible::among((0..60).map(|i| 3 * i + 2).collect());
    let found = ranked(&rows, &eligible, &[8], Until::landmarks(20));
    assert!(found.ranking.iter().all(|candidate| candidate % 3 == 2));
    let error = rank_by_ipca(&rows, &eligible, &[8, 9], Until::landmarks(20));
    assert_eq!(error, Err(IpcaError::Ineligible { candidate: 9 }));
}

#[test]
fn a_ranking_ends_below_the_residual_threshold() {
    let views = smooth_views(10, 300);
    let rows = Matrix::new(&views, 144);
    let all = ranked(&rows, &all_of(&rows), &[1, 2], Until::landmarks(60));
    let threshold = (all.residuals[29] + all.residuals[30]) / 2.0;
    let until = Until {
        landmarks: 60,
        residual: Some(threshold),
    };
    let found = ranked(&rows, &all_of(&rows), &[1, 2], until);
    assert_eq!(found.stop, Stop::Residual);
    assert_eq!(found.ranking, all.ranking[..30]);
}

#[test]
fn what_cannot_be_a_start_list_is_refused() {
    let mut views = random_views(27, 10, 4);
    let until = Until::landmarks(5);
    let error = |views: &[f32], start: &[u32]| {
        let rows = Matrix::new(views, 4);
        let eligible = all_of(&rows);
        let found = rank_by_ipca(&rows, &eligible, start, until);
        assert_eq!(
            found,
            rank_by_ipca_literally(&rows, &eligible, start, until)
        );
        found.expect_err("no start list")
    };
    assert_eq!(error(&views, &[]), IpcaError::EmptyStart);
    let repeated = error(&views, &[2, 3, 2]);
    assert_eq!(repeated, IpcaError::Repeated { candidate: 2 });
    for candidate in [0, 11] {
        let count = 10;
        assert_eq!(
            error(&views, &[1, candidate]),
            IpcaError::Unknown { candidate, count }
        );
    }
    assert_eq!(
        error(&views, &[11]).to_string(),
        "view 11 of the start list does not exist; there are 10, numbered from 1"
    );
    views[4 * 6 + 1] = f32::NAN;
    assert_eq!(error(&views, &[1]), IpcaError::NotFinite { candidate: 7 });
}

#[test]
fn a_random_start_is_distinct_and_the_same_for_the_same_seed() {
    let eligible = Eligible::among((5..40).collect());
    let start = random_start(&eligible, 10, 3).expect("enough");
    assert_eq!(start, random_start(&eligible, 10, 3).expect("enough"));
    assert_ne!(start, random_start(&eligible, 10, 4).expect("enough"));
    let mut distinct = start.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 10);
    assert!(distinct.iter().all(|candidate| (5..40).contains(candidate)));
    let (asked, found) = (36, 35);
    let error = random_start(&eligible, asked, 3);
    assert_eq!(error, Err(IpcaError::TooFew { asked, found }));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let views = smooth_views(11, 700);
    let rows = Matrix::new(&views, 144);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| rank_by_ipca(&rows, &all_of(&rows), &[3], Until::landmarks(60)))
    };
    assert_eq!(with(1), with(3));
}
