//! Which landmarks make places.

use eigenmark_core::{atlas::Atlas, landmark::Point};

use super::ROOM;
use crate::{
    evaluate::{Deviation, fixes_around},
    map::Map,
    output::Progress,
};

/// Places are at least this far apart, in sides of a view.
const SPACING: f32 = 0.5;

/// Views that are tried per place, and how many of them must be recognized.
const VIEWS: usize = 8;
const RECOGNIZED: usize = 4;

/// A view is recognized when its fix is nearer than this, in sides of a view.
const NEAR: f32 = 0.5;

/// Seed of the deviations.
const SEED: u64 = 0x0091_ace5;

/// Landmarks at least half a view apart, at which views deviated as in flight are recognized.
pub(super) fn recognized(map: &Map, atlas: &Atlas<'_>, progress: &Progress) -> Vec<Point> {
    let spaced = spaced(atlas);
    let footprint_px = atlas.header().footprint_px;
    let landmarks: Vec<usize> = spaced.iter().map(|&(landmark, _)| landmark).collect();
    let fixes = fixes_around(
        map,
        atlas,
        &landmarks,
        &Deviation::FLIGHT,
        VIEWS,
        SEED,
        progress,
    );
    let kept = spaced.into_iter().zip(fixes).filter(|((_, at), fixes)| {
        let is_right = |position: Point| position.distance_px(*at) <= NEAR * footprint_px;
        let right = fixes
            .iter()
            .flatten()
            .filter(|fix| is_right(fix.position))
            .count();
        right >= RECOGNIZED
    });
    kept.map(|((_, at), _)| at).take(ROOM.0).collect()
}

/// All landmarks at least half a view apart.
pub(super) fn of_landmarks(atlas: &Atlas<'_>) -> Vec<Point> {
    let spaced = spaced(atlas).into_iter();
    spaced.map(|(_, at)| at).take(ROOM.0).collect()
}

/// Whether a point is far enough inside a dense table that a vehicle can turn there without flying off it; elsewhere
/// everything is.
fn inside(atlas: &Atlas<'_>, margin_px: f32) -> impl Fn(Point) -> bool {
    let dense = match atlas.header().survey.lattices.as_slice() {
        [lattice] if atlas.landmarks().is_whole() && lattice.stride_px <= margin_px => {
            Some(*lattice)
        }
        _ => None,
    };
    move |at| {
        dense.is_none_or(|lattice| {
            let (first, last) = (
                lattice.origin,
                lattice.point(u32::from(lattice.columns) - 1, u32::from(lattice.rows) - 1),
            );
            let is_within = |at: f32, first: f32, last: f32| {
                // Of a narrow table, the middle.
                let margin = margin_px.min((last - first) / 2.0);
                (first + margin..=last - margin).contains(&at)
            };
            is_within(at.x_px, first.x_px, last.x_px) && is_within(at.y_px, first.y_px, last.y_px)
        })
    }
}

/// Landmarks (0-based) and where they are, best first, as far as they are far enough from those before. In a table of
/// whole lattices they are taken row by row, which leaves a regular grid.
fn spaced(atlas: &Atlas<'_>) -> Vec<(usize, Point)> {
    let spacing = SPACING * atlas.header().footprint_px;
    let is_inside = inside(atlas, spacing / 2.0);
    // Buckets of that size: whoever is too near is in one of nine.
    let bucket = |at: Point| ((at.x_px / spacing) as i64, (at.y_px / spacing) as i64);
    let mut taken = std::collections::HashMap::<(i64, i64), Vec<Point>>::new();
    let mut spaced = Vec::new();
    for (index, record) in atlas.landmarks().records().iter().enumerate() {
        let Some(at) = atlas.header().survey.place(record.view) else {
            continue;
        };
        if !is_inside(at) {
            continue;
        }
        let (column, row) = bucket(at);
        let mut near = (-1..=1)
            .flat_map(|right| (-1..=1).map(move |down| (column + right, row + down)))
            .filter_map(|bucket| taken.get(&bucket))
            .flatten();
        // Rounding must not decide about a grid of just that spacing.
        if near.any(|other| other.distance_px(at) < spacing * 0.999) {
            continue;
        }
        taken.entry((column, row)).or_default().push(at);
        spaced.push((index, at));
    }
    spaced
}
