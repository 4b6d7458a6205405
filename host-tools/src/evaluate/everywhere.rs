//! What a judge says at every position of the map, found out once.
//!
//! **Cost.** Four bytes per position; a verdict of a 20×20 view among 83 landmarks takes some five microseconds where it
//! is asked for, and well below one where the eigenspace in f64 is projected densely.

use std::sync::atomic::{AtomicU32, Ordering};

use super::judge::{Exact, Judge, Verdict};
use crate::{
    dense::{Dense, Part},
    learn::PixelBasis,
    map::{Integral, Map},
};

/// Verdicts by position: the windows whose top-left pixels are at every pixel of the map as far as windows fit.
pub struct Everywhere<'a> {
    judge: &'a dyn Judge,
    integral: &'a Integral,
    window_px: u32,
    columns: u32,
    rows: u32,
    /// [`UNKNOWN`], or a packed verdict.
    verdicts: Vec<AtomicU32>,
}

/// Not asked for yet.
const UNKNOWN: u32 = 0;

/// Asked for, and there is nothing to go by.
const NOTHING: u32 = 1;

impl<'a> Everywhere<'a> {
    /// Asks `judge` about a window when it is first needed. `integral` is the map's.
    ///
    /// # Panics
    /// When the window does not fit into the map.
    #[must_use]
    pub fn lazily(judge: &'a dyn Judge, map: &Map, integral: &'a Integral, window_px: u32) -> Self {
        assert!(window_px >= 1 && window_px <= map.width().min(map.height()));
        let (columns, rows) = (map.width() - window_px + 1, map.height() - window_px + 1);
        let mut verdicts = Vec::new();
        verdicts.resize_with(columns as usize * rows as usize, || AtomicU32::new(UNKNOWN));
        Self {
            judge,
            integral,
            window_px,
            columns,
            rows,
            verdicts,
        }
    }

    /// Asks `exact` about every window at once, by dense projection.
    ///
    /// # Panics
    /// When the window does not fit into the map.
    #[must_use]
    pub fn densely(exact: &'a Exact, map: &Map, integral: &'a Integral, window_px: u32) -> Self {
        let mut only = Self::nested(std::slice::from_ref(exact), map, integral, window_px);
        only.swap_remove(0)
    }

    /// The same for eigenspaces that differ only in how many of the same dimensions they have: the map is projected once.
    /// Of others, verdicts are meaningless.
    ///
    /// # Panics
    /// When there is none, or the window does not fit into the map.
    #[must_use]
    pub fn nested(
        exacts: &'a [Exact],
        map: &Map,
        integral: &'a Integral,
        window_px: u32,
    ) -> Vec<Self> {
        let lazily = |exact| Self::lazily(exact, map, integral, window_px);
        let all: Vec<Self> = exacts.iter().map(|exact| lazily(exact)).collect();
        let bases = exacts.iter().map(Exact::basis);
        let largest = bases.max_by_key(|basis| basis.dimensions());
        let largest = largest.expect("at least one eigenspace");
        project_everywhere(map, window_px, largest, None, |(x, y), coordinates| {
            for (everywhere, exact) in all.iter().zip(exacts) {
                let k = exact.basis().dimensions();
                let verdict = coordinates.map(|coordinates| exact.judge_point(&coordinates[..k]));
                everywhere
                    .slot(x, y)
                    .store(packed(verdict), Ordering::Relaxed);
            }
        });
        all
    }

    /// Who is asked.
    #[must_use]
    pub fn judge(&self) -> &'a dyn Judge {
        self.judge
    }

    /// Side of a window, in map pixels.
    #[must_use]
    pub fn window_px(&self) -> u32 {
        self.window_px
    }

    /// Columns and rows of positions.
    #[must_use]
    pub fn positions(&self) -> (u32, u32) {
        (self.columns, self.rows)
    }

    /// The verdict on the window whose top-left pixel is at (x, y).
    ///
    /// # Panics
    /// When there is no such position.
    #[must_use]
    pub fn verdict(&self, x: u32, y: u32) -> Option<Verdict> {
        let slot = self.slot(x, y);
        // Whoever comes first finds the same verdict.
        let known = slot.load(Ordering::Relaxed);
        if known != UNKNOWN {
            return unpacked(known);
        }
        let side = self.judge.side();
        let mut view = vec![0; side * side];
        self.integral
            .reduce((x, y), self.window_px, side, &mut view);
        let verdict = self.judge.judge(&view);
        slot.store(packed(verdict), Ordering::Relaxed);
        verdict
    }

    fn slot(&self, x: u32, y: u32) -> &AtomicU32 {
        assert!(x < self.columns && y < self.rows, "a position on the map");
        &self.verdicts[y as usize * self.columns as usize + x as usize]
    }
}

/// The coordinates of the window at every position of the map, or only at those of a lattice: its first corner and the
/// distance between corners. `None` where there is no contrast to normalize. `visit` is called from several threads, once
/// per position, in any order.
pub(super) fn project_everywhere(
    map: &Map,
    window_px: u32,
    basis: &PixelBasis,
    lattice: Option<((u32, u32), u32)>,
    visit: impl Fn((u32, u32), Option<&[f64]>) + Sync,
) {
    let side = basis.pixels().isqrt();
    let dense = Dense::new(map.luminance(), window_px, side, basis.weights());
    let consume = |part: Part<'_>| {
        let mut coordinates = vec![0.0; basis.dimensions()];
        for (index, &sums) in part.sums().iter().enumerate() {
            part.dots(index, &mut coordinates);
            let has_contrast = basis.finish(sums, &mut coordinates);
            visit(
                part.corner(index),
                has_contrast.then_some(coordinates.as_slice()),
            );
        }
    };
    match lattice {
        None => dense.project(consume),
        Some((first, step_px)) => dense.project_lattice(first, step_px, consume),
    }
}

fn packed(verdict: Option<Verdict>) -> u32 {
    verdict.map_or(NOTHING, |verdict| {
        let flags = 2 | u32::from(verdict.is_strict) << 2 | u32::from(verdict.is_guaranteed) << 3;
        verdict.landmark << 4 | flags
    })
}

fn unpacked(packed: u32) -> Option<Verdict> {
    (packed != NOTHING).then_some(Verdict {
        landmark: packed >> 4,
        is_strict: packed & 4 != 0,
        is_guaranteed: packed & 8 != 0,
    })
}
