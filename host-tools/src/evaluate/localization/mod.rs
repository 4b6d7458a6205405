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

/// The dissimilarity of a view to the window at every position of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalizationMatrix {
    columns: usize,
    values: Vec<f32>,
}

impl LocalizationMatrix {
    /// A matrix from its values, row by row.
    ///
    /// # Panics
    /// When there is none, or no whole number of rows.
    #[must_use]
    pub fn new(columns: usize, values: Vec<f32>) -> Self {
        assert!(!values.is_empty() && values.len().is_multiple_of(columns));
        Self { columns, values }
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
        [(index % self.columns) as u32, (index / self.columns) as u32]
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
    assert!((1..=map.width().min(map.height())).contains(&window_px));
    let columns = (map.width() - window_px + 1) as usize;
    let positions = columns * (map.height() - window_px + 1) as usize;
    let mut indices = 0..;
    for points in points.chunks((VALUES_AT_ONCE / positions).clamp(1, MOST_AT_ONCE)) {
        let values: Vec<Vec<AtomicU32>> = points
            .iter()
            .map(|_| (0..positions).map(|_| AtomicU32::new(0)).collect())
            .collect();
        project_everywhere(map, window_px, exact.basis(), |(x, y), coordinates| {
            let index = y as usize * columns + x as usize;
            for (values, point) in values.iter().zip(points) {
                let value = coordinates.map_or(f64::INFINITY, |at| exact.dissimilarity(at, point));
                // Every position is visited once.
                values[index].store((value as f32).to_bits(), Ordering::Relaxed);
            }
        });
        for (values, index) in values.into_iter().zip(&mut indices) {
            let values = values
                .into_iter()
                .map(|bits| f32::from_bits(bits.into_inner()));
            consume(index, LocalizationMatrix::new(columns, values.collect()))?;
        }
    }
    Ok(())
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
