//! A lattice of windows and what was found of each.

use super::Sums;

/// What was found of some of the windows: `columns`×`rows` of them, their corners `step_px` apart.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    pub(super) first: (u32, u32),
    pub(super) step_px: u32,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The planes of k weight rows, one number per window, `stride` apart.
    pub(super) dots: &'a [f64],
    pub(super) stride: usize,
    pub(super) sums: &'a [Sums],
}

impl Part<'_> {
    /// Number of windows.
    #[must_use]
    pub fn windows(&self) -> usize {
        self.columns * self.rows
    }

    /// Windows per row.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of windows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The top-left corner of window `index`, in map pixels; windows are counted row by row.
    ///
    /// # Panics
    /// When there is no such window.
    #[must_use]
    pub fn corner(&self, index: usize) -> (u32, u32) {
        assert!(
            index < self.windows(),
            "window {index} of {}",
            self.windows()
        );
        let (column, row) = (index % self.columns, index / self.columns);
        let [x, y] = [column, row].map(|at| at as u32 * self.step_px);
        (self.first.0 + x, self.first.1 + y)
    }

    /// w·y for weight row `row`, one number per window.
    ///
    /// # Panics
    /// When there is no such weight row.
    #[must_use]
    pub fn plane(&self, row: usize) -> &[f64] {
        &self.dots[row * self.stride..][..self.windows()]
    }

    /// w·y of window `index` for the first weight rows, as many as `out` holds.
    ///
    /// # Panics
    /// When there is no such window, or there are fewer weight rows.
    pub fn dots(&self, index: usize, out: &mut [f64]) {
        for (row, dot) in out.iter_mut().enumerate() {
            *dot = self.plane(row)[index];
        }
    }

    /// Σy and Σy² of every window.
    #[must_use]
    pub fn sums(&self) -> &[Sums] {
        self.sums
    }
}
