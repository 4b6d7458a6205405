//! Localization matrices: how dissimilar a view is to every position of the map, and what can be read off; report
//! section 4.2.
//!
//! The report gave them up because they took too long; densely projected, the map is compared with a view in a
//! second. Around the view's own position is a minimum, and ideally it is the only one. Others say where on the map the
//! view could be taken for another, and how nearly.

mod distinctness;
mod peaks;

use std::sync::atomic::{AtomicU32, Ordering};

use image::GrayImage;

use super::{everywhere::project_everywhere, judge::Exact};
use crate::map::Map;

pub use distinctness::{Distinctness, final_evaluation};
pub use peaks::{Flooding, NO_PEAK, Peak, Peaks, find_peaks};

/// Values of matrices that are computed from one projection of the map: 256 MiB, unless a single matrix has more.
const VALUES_AT_ONCE: usize = 64 << 20;

/// The same in matrices.
const MOST_AT_ONCE: usize = 16;

/// The dissimilarity of a view to the window at every position of the map, or of a lattice of positions.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalizationMatrix {
    columns: usize,
    values: Vec<f32>,
    first: (u32, u32),
    step_px: u32,
}

impl LocalizationMatrix {
    /// A matrix of all positions from its values, row by row.
    ///
    /// # Panics
    /// When there is none, or no whole number of rows.
    #[must_use]
    pub fn new(columns: usize, values: Vec<f32>) -> Self {
        Self::on_lattice((0, 0), 1, columns, values)
    }

    /// A matrix of positions that are `step_px` apart, the first at `first`.
    fn on_lattice(first: (u32, u32), step_px: u32, columns: usize, values: Vec<f32>) -> Self {
        assert!(!values.is_empty() && values.len().is_multiple_of(columns));
        Self {
            columns,
            values,
            first,
            step_px,
        }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.values.len() / self.columns)
    }

    /// The values, row by row, in the metric's unit; infinite where a window has no contrast to normalize.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The top-left pixel of the window of value `index`.
    #[must_use]
    pub fn corner(&self, index: usize) -> [u32; 2] {
        let (column, row) = (index % self.columns, index / self.columns);
        let [x, y] = [column, row].map(|at| at as u32 * self.step_px);
        [self.first.0 + x, self.first.1 + y]
    }

    /// What a value stands for: an area in map pixels.
    #[must_use]
    pub fn cell_px(&self) -> u64 {
        u64::from(self.step_px) * u64::from(self.step_px)
    }

    /// The values around value `index`: eight, fewer at the edges.
    pub(crate) fn neighbors(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = self.size();
        let (x, y) = (index % columns, index / columns);
        let around = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
        around(y, rows)
            .flat_map(move |y| around(x, columns).map(move |x| y * columns + x))
            .filter(move |&other| other != index)
    }

    /// A picture: black is most similar and white most dissimilar, as in the report.
    ///
    /// # Panics
    /// Never: a matrix is not larger than a map.
    #[must_use]
    pub fn picture(&self) -> GrayImage {
        let finite = self
            .values
            .iter()
            .copied()
            .filter(|value| value.is_finite());
        let (low, high) = finite.fold((f32::MAX, f32::MIN), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let range = (high - low).max(f32::MIN_POSITIVE);
        let levels = self
            .values
            .iter()
            .map(|value| (255.0 * (value - low) / range) as u8);
        let (columns, rows) = self.size();
        GrayImage::from_raw(columns as u32, rows as u32, levels.collect())
            .expect("as many levels as values")
    }
}

/// The matrices of some points of the eigenspace, k coordinates each, on the map of `exact`; handed to `consume` one after
/// the other, with the point's index.
///
/// # Errors
/// What `consume` fails with; the rest is then left undone.
///
/// # Panics
/// When the window does not fit into the map.
pub fn localization_matrices<E>(
    map: &Map,
    window_px: u32,
    exact: &Exact,
    points: &[&[f64]],
    mut consume: impl FnMut(usize, LocalizationMatrix) -> Result<(), E>,
) -> Result<(), E> {
    let [columns, rows] = positions(map, window_px);
    let mut indices = 0..;
    let at_once = VALUES_AT_ONCE / (columns as usize * rows as usize);
    for points in points.chunks(at_once.clamp(1, MOST_AT_ONCE)) {
        let matrices = matrices(map, window_px, exact, points, None);
        for (matrix, index) in matrices.into_iter().zip(&mut indices) {
            consume(index, matrix)?;
        }
    }
    Ok(())
}

/// The same at positions that are `step_px` apart, among them the window whose corner is at `corner`; all at once.
///
/// # Panics
/// When the window does not fit into the map, the corner is no position, or the step is zero.
#[must_use]
pub fn coarse_localization_matrices(
    map: &Map,
    window_px: u32,
    exact: &Exact,
    points: &[&[f64]],
    corner: (u32, u32),
    step_px: u32,
) -> Vec<LocalizationMatrix> {
    let [columns, rows] = positions(map, window_px);
    assert!(corner.0 < columns && corner.1 < rows, "a position");
    let first = (corner.0 % step_px, corner.1 % step_px);
    matrices(map, window_px, exact, points, Some((first, step_px)))
}

/// Columns and rows of positions.
fn positions(map: &Map, window_px: u32) -> [u32; 2] {
    assert!((1..=map.width().min(map.height())).contains(&window_px));
    [map.width(), map.height()].map(|size| size - window_px + 1)
}

fn matrices(
    map: &Map,
    window_px: u32,
    exact: &Exact,
    points: &[&[f64]],
    lattice: Option<((u32, u32), u32)>,
) -> Vec<LocalizationMatrix> {
    let ((left, top), step_px) = lattice.unwrap_or(((0, 0), 1));
    let [columns, rows] = positions(map, window_px);
    let columns = (columns - left).div_ceil(step_px) as usize;
    let len = columns * (rows - top).div_ceil(step_px) as usize;
    let values: Vec<Vec<AtomicU32>> = points
        .iter()
        .map(|_| (0..len).map(|_| AtomicU32::new(0)).collect())
        .collect();
    project_everywhere(
        map,
        window_px,
        exact.basis(),
        lattice,
        |(x, y), coordinates| {
            let (column, row) = ((x - left) / step_px, (y - top) / step_px);
            let index = row as usize * columns + column as usize;
            for (values, point) in values.iter().zip(points) {
                let value = coordinates.map_or(f64::INFINITY, |at| exact.dissimilarity(at, point));
                // Every position is visited once.
                values[index].store((value as f32).to_bits(), Ordering::Relaxed);
            }
        },
    );
    let matrix = |values: Vec<AtomicU32>| {
        let values = values
            .into_iter()
            .map(|bits| f32::from_bits(bits.into_inner()));
        LocalizationMatrix::on_lattice((left, top), step_px, columns, values.collect())
    };
    values.into_iter().map(matrix).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_have_eight_neighbors_and_fewer_at_edges() {
        let matrix = LocalizationMatrix::new(3, vec![0.0; 9]);
        assert_eq!(
            matrix.neighbors(4).collect::<Vec<_>>(),
            [0, 1, 2, 3, 5, 6, 7, 8]
        );
        assert_eq!(matrix.neighbors(0).collect::<Vec<_>>(), [1, 3, 4]);
        let single = LocalizationMatrix::new(1, vec![0.0]);
        assert_eq!(single.neighbors(0).count(), 0);
    }

    #[test]
    fn pictures_go_from_black_to_white() {
        let matrix = LocalizationMatrix::new(2, vec![0.5, 1.0, 0.75, f32::INFINITY]);
        assert_eq!(matrix.picture().into_raw(), [0, 255, 127, 255]);
    }
}
