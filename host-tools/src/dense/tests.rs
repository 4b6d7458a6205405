use std::sync::Mutex;

use image::Luma;
use rand::RngExt;

use super::*;
use crate::simulate::seeded;

/// Weights by kind: of both signs, of one, whole numbers of 16 bits.
#[derive(Clone, Copy, PartialEq)]
enum Weights {
    Both,
    Positive,
    Whole,
}

const ROWS: usize = 3;

fn picture(width: u32, height: u32) -> GrayImage {
    let mut random = seeded(17, u64::from(width * height));
    GrayImage::from_fn(width, height, |x, y| {
        let level = if (x ^ y) & 8 == 0 { 255 } else { 40 };
        Luma([level - random.random_range(0..40)])
    })
}

fn weights(side: usize, kind: Weights) -> Vec<f64> {
    let mut random = seeded(23, side as u64);
    let mut draw = || match kind {
        Weights::Both => random.random_range(-1.0..1.0),
        Weights::Positive => random.random_range(0.0..1.0),
        Weights::Whole => f64::from(random.random_range(-32767..=32767)),
    };
    (0..ROWS * side * side).map(|_| draw()).collect()
}

/// What `consume` is told, per window in order of rows and columns; every window once.
fn collect(
    dense: &Dense<'_>,
    project: impl Fn(&(dyn Fn(Part<'_>) + Sync)),
) -> Vec<(Vec<f64>, Sums)> {
    let (columns, rows) = dense.positions();
    let all = Mutex::new(vec![None; (columns * rows) as usize]);
    project(&|part| {
        let mut all = all.lock().expect("no panics");
        for (index, &sums) in part.sums().iter().enumerate() {
            let (x, y) = part.corner(index);
            let mut dots = vec![0.0; dense.rows()];
            part.dots(index, &mut dots);
            let before = all[(y * columns + x) as usize].replace((dots, sums));
            assert!(before.is_none(), "{x}, {y} twice");
        }
    });
    let all = all.into_inner().expect("no panics");
    all.into_iter().map(|one| one.expect("seen")).collect()
}

fn fast(dense: &Dense<'_>) -> Vec<(Vec<f64>, Sums)> {
    collect(dense, |consume| dense.project(consume))
}

fn direct(dense: &Dense<'_>) -> Vec<(Vec<f64>, Sums)> {
    collect(dense, |consume| dense.project_directly(consume))
}

/// The largest difference of fast and direct dots, in the unit of the tolerance.
fn difference(dense: &Dense<'_>) -> f64 {
    let norms: Vec<f64> = dense
        .rows
        .chunks_exact(dense.side * dense.side)
        .map(|row| row.iter().map(|w| w * w).sum::<f64>().sqrt())
        .collect();
    let mut largest = 0.0_f64;
    for ((fast, fast_sums), (direct, direct_sums)) in fast(dense).iter().zip(&direct(dense)) {
        assert_eq!(fast_sums, direct_sums);
        for ((a, b), norm) in fast.iter().zip(direct).zip(&norms) {
            largest = largest.max((a - b).abs() / (norm * 255.0 * dense.side as f64));
        }
    }
    largest
}

#[test]
fn projections_match_reference() {
    for (width, height, window_px, side) in [
        (40, 31, 7, 7),
        (61, 53, 20, 20),
        (53, 47, 20, 10),
        (107, 93, 60, 6),
        (24, 24, 24, 8),
        (9, 9, 9, 9),
        (83, 16, 16, 16),
        (16, 59, 16, 4),
        (11, 8, 1, 1),
        (150, 141, 100, 100),
    ] {
        let picture = picture(width, height);
        for kind in [Weights::Both, Weights::Positive] {
            let rows = weights(side, kind);
            let mut dense = Dense::new(&picture, window_px, side, &rows);
            for largest in [layout::LARGEST, 16] {
                dense.largest = largest;
                let difference = difference(&dense);
                assert!(
                    difference < TOLERANCE,
                    "{window_px} to {side} on {width}×{height}: {difference}"
                );
            }
        }
    }
}

#[test]
fn small_tiles_are_many() {
    let rows = weights(7, Weights::Both);
    let mut dense = Dense::new(&picture(61, 40), 7, 7, &rows);
    dense.largest = 16;
    assert!(Layout::new(&dense.task(1), dense.largest).tiles.len() >= 20);
    assert!(difference(&dense) < TOLERANCE);
}

#[test]
fn ratios_that_are_not_whole_are_projected_directly() {
    let rows = weights(12, Weights::Both);
    let dense = Dense::new(&picture(70, 55), 50, 12, &rows);
    assert_eq!(fast(&dense), direct(&dense));
}

#[test]
fn a_lattice_is_what_all_windows_say_of_it() {
    for (window_px, side, step_px) in [(60, 20, 3), (60, 20, 4), (50, 12, 4), (50, 12, 7)] {
        let rows = weights(side, Weights::Both);
        let picture = picture(107, 93);
        let dense = Dense::new(&picture, window_px, side, &rows);
        let (columns, lines) = dense.positions();
        let all = fast(&dense);
        for first in [(0, 0), (2, 1), (step_px, 0)] {
            let seen = Mutex::new(0);
            dense.project_lattice(first, step_px, |part| {
                for (index, sums) in part.sums().iter().enumerate() {
                    let (x, y) = part.corner(index);
                    assert!((x - first.0).is_multiple_of(step_px));
                    assert!((y - first.1).is_multiple_of(step_px));
                    let mut dots = vec![0.0; ROWS];
                    part.dots(index, &mut dots);
                    let (expected, expected_sums) = &all[(y * columns + x) as usize];
                    assert_eq!(sums, expected_sums);
                    for (dot, expected) in dots.iter().zip(expected) {
                        assert!((dot - expected).abs() < TOLERANCE * 255.0 * (side * side) as f64);
                    }
                    *seen.lock().expect("no panics") += 1;
                }
            });
            let count = |size: u32, at: u32| (size - at).div_ceil(step_px);
            let seen = seen.into_inner().expect("no panics");
            assert_eq!(seen, count(columns, first.0) * count(lines, first.1));
        }
    }
}

#[test]
fn whole_weights_round_to_the_exact_dots() {
    for (window_px, side) in [(50, 50), (100, 20)] {
        let picture = picture(140, 120);
        let rows = weights(side, Weights::Whole);
        let dense = Dense::new(&picture, window_px, side, &rows);
        // Whole numbers below 2⁵³ add up exactly.
        for ((fast, _), (direct, _)) in fast(&dense).iter().zip(direct(&dense)) {
            let rounded: Vec<f64> = fast.iter().map(|dot| dot.round()).collect();
            assert_eq!(rounded, direct);
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let rows = weights(20, Weights::Both);
    let mut dense = Dense::new(&picture(131, 99), 20, 20, &rows);
    dense.largest = 64;
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| fast(&dense))
    });
    assert_eq!(one, three);
}

#[test]
#[should_panic(expected = "windows of 33 pixels on a map of 64×32")]
fn windows_lie_on_the_map() {
    let _ = Dense::new(&picture(64, 32), 33, 33, &[0.0; 33 * 33]);
}

#[test]
#[should_panic(expected = "10 weights for views of 3×3 pixels")]
fn rows_are_whole() {
    let _ = Dense::new(&picture(64, 32), 3, 3, &[0.0; 10]);
}
