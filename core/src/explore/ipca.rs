//! One view more in an eigenspace: incremental principal component analysis.
//!
//! **Method.** Report (2.19)–(2.27), corrected: the view's coordinates g and its residual r to the old mean and basis
//! (Gram-Schmidt, twice), the eigenproblem of D in k + 1 dimensions, one rotation of the basis with the residual's
//! direction appended, and the smallest dimension dropped where [`Growth`] says so.
//!
//! **Cost.** All slots take part in every pass, whether they are in use or not: only the eigenproblem is quicker in
//! fewer dimensions. In a static, an eigenspace with [`Growth::Fixed`] is all zeros and takes no flash.
//!
//! **Limits.** n counts up to 2³² − 1 and stays there; from 2²⁴ on its reciprocal is what single precision has.

use nalgebra::{ArrayStorage, SMatrix, SVector};

use super::{Carry, pixels, rank_one};
use crate::math::sqrt;

/// Residuals below this share of the view's deviation, or of the mean where that is larger, are rounding: they have no
/// direction worth a dimension.
///
/// Rounding turns the basis out of the views' subspace by 10⁻⁵ in 10,000 updates, and moves the mean by 2·10⁻⁶ of its
/// norm. One gray level in one pixel of 2,500 is at least 8·10⁻⁵ of any view.
pub const RESIDUAL_TOLERANCE: f32 = 5e-5;

/// ‖x − x̄‖² and ‖x̄‖² may not be above this: n times it is still finite. 2,500 white pixels have 1.6·10⁸.
pub const MAX_ENERGY: f32 = 1e28;

/// Coordinates of a view in an eigenspace: k numbers, then zeros.
pub type Coordinates<const SLOTS: usize> = SVector<f32, SLOTS>;

/// When an eigenspace gets a dimension more for a view that it cannot express; report 2.1.2. Otherwise the dimension
/// with the smallest eigenvalue is dropped, as it is when there is no slot left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Growth {
    /// Always, up to the k that there is room for: from then on k is fixed.
    Fixed,
    /// When the residual's norm ‖r‖ is above this.
    Residual {
        /// In gray levels; √m times a root mean square per pixel.
        above: f32,
    },
    /// When all that has not been covered so far, with this view's part in the dimension to be dropped, is above this:
    /// the sum of squared reconstruction errors.
    LostEnergy {
        /// In squared gray levels, summed over views and pixels; see [`IncrementalPca::lost_energy`].
        above: f32,
    },
    /// When the smallest eigenvalue of the larger eigenspace is above this.
    Eigenvalue {
        /// In squared gray levels.
        above: f32,
    },
}

/// What became of the dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Change {
    /// The first view: it is the mean now, and there are no dimensions yet.
    First,
    /// The view lies in the eigenspace; nothing was lost.
    Kept,
    /// One dimension more; nothing was lost.
    Grown,
    /// As many as before: the smallest of k + 1 was dropped.
    Truncated,
}

/// What an eigenspace says about a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection<const SLOTS: usize> {
    /// g = Tᵀ(x − x̄), report (2.20).
    pub coordinates: Coordinates<SLOTS>,
    /// ‖x − x̄‖, in gray levels.
    pub deviation: f32,
    /// ‖r‖, report (2.21), in gray levels: how badly the eigenspace expresses the view.
    pub residual: f32,
    /// Residuals up to this are rounding.
    tolerance: f32,
}

/// What an update did.
#[derive(Clone, Debug, PartialEq)]
pub struct Step<const SLOTS: usize> {
    /// What became of the dimensions.
    pub change: Change,
    /// ‖x − x̄‖ to the old mean, in gray levels.
    pub deviation: f32,
    /// ‖r‖ to the old eigenspace, in gray levels.
    pub residual: f32,
    /// The view in the new eigenspace.
    pub coordinates: Coordinates<SLOTS>,
    /// Energy of the view in the dimension that was dropped.
    pub left_out: f32,
    /// Brings coordinates of earlier views up to date.
    pub carry: Carry<SLOTS>,
}

/// An eigenspace (x̄, T, Λ, n) of all views so far: m pixels, at most `SLOTS` − 1 dimensions.
///
/// The pixels of a [`View`](crate::preprocess::View) of 20×20 are `view.pixels().first_chunk::<400>()`.
///
/// ```
/// use eigenmark_core::explore::{Change, Growth, IncrementalPca};
///
/// // Two pixels, one dimension: three views on a line through (2, 2).
/// let mut pca = IncrementalPca::<2, 2>::new(Growth::Fixed);
/// assert_eq!(pca.update(&[2_u8, 2]).unwrap().change, Change::First);
/// assert_eq!(pca.update(&[5_u8, 6]).unwrap().residual, 5.0); // ‖(3, 4)‖
/// assert_eq!(pca.eigenvalues(), [6.25]); // mean (3.5, 4): both are 2.5 away from it
/// assert_eq!(pca.update(&[8_u8, 10]).unwrap().change, Change::Kept);
/// ```
#[derive(Clone, Debug)]
pub struct IncrementalPca<const PIXELS: usize, const SLOTS: usize> {
    growth: Growth,
    views: u32,
    dimensions: usize,
    lost_energy: f32,
    mean: SVector<f32, PIXELS>,
    rows: SMatrix<f32, SLOTS, PIXELS>,
    eigenvalues: SVector<f32, SLOTS>,
}

// Fits the 128 KiB of an STM32F405 beside everything else.
const _: () = assert!(size_of::<IncrementalPca<400, 16>>() <= 27 * 1024);

impl<const PIXELS: usize, const SLOTS: usize> IncrementalPca<PIXELS, SLOTS> {
    /// An eigenspace of no views.
    #[must_use]
    pub const fn new(growth: Growth) -> Self {
        const {
            assert!(SLOTS >= 2 && PIXELS >= 1);
        }
        Self {
            growth,
            views: 0,
            dimensions: 0,
            lost_energy: 0.0,
            mean: SMatrix::from_array_storage(ArrayStorage([[0.0; PIXELS]])),
            rows: SMatrix::from_array_storage(ArrayStorage([[0.0; SLOTS]; PIXELS])),
            eigenvalues: SMatrix::from_array_storage(ArrayStorage([[0.0; SLOTS]])),
        }
    }

    /// Of no views again, in place; the growth stays.
    pub fn reset(&mut self) {
        let Self {
            growth: _,
            views,
            dimensions,
            lost_energy,
            mean,
            rows,
            eigenvalues,
        } = self;
        (*views, *dimensions, *lost_energy) = (0, 0, 0.0);
        mean.fill(0.0);
        rows.fill(0.0);
        eigenvalues.fill(0.0);
    }

    /// Views so far, n.
    #[must_use]
    pub fn views(&self) -> u32 {
        self.views
    }

    /// The k eigenvalues of the covariance (1/n)·A·Aᵀ, descending, in squared gray levels.
    #[must_use]
    pub fn eigenvalues(&self) -> &[f32] {
        &self.eigenvalues.as_slice()[..self.dimensions]
    }

    /// x̄, in gray levels.
    #[must_use]
    pub fn mean(&self) -> &SVector<f32, PIXELS> {
        &self.mean
    }

    /// The value of `pixel` in eigenimage `dimension` (0-based, by descending eigenvalue); 0 outside the basis.
    #[must_use]
    pub fn eigenimage(&self, dimension: usize, pixel: usize) -> f32 {
        if dimension >= self.dimensions {
            return 0.0;
        }
        self.rows.get((dimension, pixel)).copied().unwrap_or(0.0)
    }

    /// n times the variance that was dropped: ‖x_i − x̄‖² summed over all views, less what the eigenvalues cover.
    #[must_use]
    pub fn lost_energy(&self) -> f32 {
        self.lost_energy
    }

    /// Covered variance, report (2.8): 1 when nothing was dropped, or there is nothing to cover.
    #[must_use]
    pub fn covered(&self) -> f32 {
        let covered = self.eigenvalues().iter().sum::<f32>() * self.views as f32;
        let total = covered + self.lost_energy;
        if total > 0.0 { covered / total } else { 1.0 }
    }

    /// Where a view is in the eigenspace, and how far outside. `None` beyond [`MAX_ENERGY`] and for what is not finite.
    ///
    /// The eigenspace does not change; only its room for a residual does.
    pub fn project<P: Copy + Into<f32>>(
        &mut self,
        view: &[P; PIXELS],
    ) -> Option<Projection<SLOTS>> {
        let rows = &mut self.rows.data.0;
        let (energy, mean_energy) = pixels::load(rows, self.mean.as_slice(), view);
        // NaN is not within it either.
        if !(energy.max(mean_energy) <= MAX_ENERGY && energy >= 0.0) {
            return None;
        }
        let first = pixels::correlate(rows, SLOTS - 1);
        pixels::subtract(rows, &first);
        // Once more: what rounding has left of the eigenimages in the residual.
        let second = pixels::correlate(rows, SLOTS - 1);
        let residual_energy = pixels::subtract(rows, &second);
        Some(Projection {
            coordinates: Coordinates::from(first) + Coordinates::from(second),
            deviation: sqrt(energy),
            residual: sqrt(residual_energy),
            tolerance: RESIDUAL_TOLERANCE * sqrt(energy.max(mean_energy)),
        })
    }

    /// Takes a view in: its pixels, or what normalization has made of them. `None`, and nothing happens, beyond
    /// [`MAX_ENERGY`] and for what is not finite.
    pub fn update<P: Copy + Into<f32>>(&mut self, view: &[P; PIXELS]) -> Option<Step<SLOTS>> {
        let projection = self.project(view)?;
        Some(self.absorb(view, &projection))
    }

    /// The second half of an update: `projection` is this view's, and its residual is still in the last slots.
    pub(super) fn absorb<P: Copy + Into<f32>>(
        &mut self,
        view: &[P; PIXELS],
        projection: &Projection<SLOTS>,
    ) -> Step<SLOTS> {
        let n = self.views as f32;
        let part = 1.0 / (n + 1.0);
        for (mean, &pixel) in self.mean.as_mut_slice().iter_mut().zip(view) {
            *mean += (pixel.into() - *mean) * part;
        }
        let is_first = self.views == 0;
        let is_new = !is_first && projection.residual > projection.tolerance;
        let gamma = if is_new { projection.residual } else { 0.0 };
        let mut extended = projection.coordinates;
        extended[SLOTS - 1] = gamma;

        let poles = (self.eigenvalues * (n * part)).data.0[0];
        let vector = (extended * (sqrt(n) * part)).data.0[0];
        let eigen = rank_one::decompose(&poles, &vector);

        let change = match (is_first, is_new) {
            (true, _) => Change::First,
            (_, false) => Change::Kept,
            (_, true) => self.grow_or_truncate(gamma, &eigen.values),
        };
        let basis = self.basis_rotation(&eigen.vectors, gamma);
        pixels::rotate(&mut self.rows.data.0, &basis);
        for (i, (eigenvalue, value)) in self.eigenvalues.iter_mut().zip(eigen.values).enumerate() {
            *eigenvalue = if i < self.dimensions { value } else { 0.0 };
        }
        self.views = self.views.saturating_add(1);

        let turned: Coordinates<SLOTS> = eigen.vectors.tr_mul(&extended);
        let carry = Carry {
            rotation: eigen.vectors,
            shift: turned * -part,
            dimensions: self.dimensions,
        };
        let mut coordinates = turned * (n * part);
        Step {
            change,
            deviation: projection.deviation,
            residual: projection.residual,
            left_out: carry.truncate(&mut coordinates),
            coordinates,
            carry,
        }
    }

    /// Decides about the dimension with the smallest of the k + 1 eigenvalues, and keeps account of what is lost.
    fn grow_or_truncate(&mut self, gamma: f32, eigenvalues: &[f32; SLOTS]) -> Change {
        let smallest = eigenvalues
            .get(self.dimensions)
            .copied()
            .unwrap_or_default();
        let lost_energy = self.lost_energy + smallest * (self.views as f32 + 1.0);
        let grows = match self.growth {
            Growth::Fixed => true,
            Growth::Residual { above } => gamma > above,
            Growth::LostEnergy { above } => lost_energy > above,
            Growth::Eigenvalue { above } => smallest > above,
        };
        if grows && self.dimensions + 1 < SLOTS {
            self.dimensions += 1;
            Change::Grown
        } else {
            self.lost_energy = lost_energy;
            Change::Truncated
        }
    }

    /// What to multiply the rows [T, r] with: R without the dropped columns, the residual's row divided by its norm,
    /// and one basis vector straightened.
    #[inline(never)]
    fn basis_rotation(
        &self,
        rotation: &SMatrix<f32, SLOTS, SLOTS>,
        gamma: f32,
    ) -> [[f32; SLOTS]; SLOTS] {
        let mut basis = [[0.0; SLOTS]; SLOTS];
        for (j, column) in rotation.column_iter().enumerate().take(self.dimensions) {
            for (row, value) in basis.iter_mut().zip(column.iter()) {
                row[j] = *value;
            }
        }
        let scale = if gamma > 0.0 { 1.0 / gamma } else { 0.0 };
        for value in &mut basis[SLOTS - 1] {
            *value *= scale;
        }
        if let Some(column) = (self.views as usize).checked_rem(self.dimensions) {
            straighten(&mut basis, &self.rows.data.0, column);
        }
        basis
    }
}

impl IncrementalPca<400, 16> {
    /// [`update`](Self::update) by a view of 20×20 pixels, in 15 dimensions. What is generic is compiled with the
    /// program that uses it, and firmware is made small: there it takes five times as long. This is compiled with the
    /// core, which is made fast.
    #[inline(never)]
    pub fn update_20x20(&mut self, view: &[u8; 400]) -> Option<Step<16>> {
        self.update(view)
    }
}

/// Makes `column` of the eigenimages a unit vector and orthogonal to the others again, on the way to the new basis.
///
/// TᵀT = I + E with E of the size of rounding; T(I − E/2) is orthonormal up to E². Here only the row and the column of
/// E that belong to `column` are measured and undone: the others have their turn.
fn straighten<const SLOTS: usize>(
    basis: &mut [[f32; SLOTS]; SLOTS],
    rows: &[[f32; SLOTS]],
    column: usize,
) {
    let column = column.min(SLOTS - 1);
    let mut errors = pixels::correlate(rows, column);
    if errors[column] == 0.0 {
        return; // It is the one that this update adds.
    }
    errors[column] -= 1.0;
    let own = basis[column];
    let mut total = [0.0; SLOTS];
    for (error, row) in errors.iter().zip(basis.iter_mut()) {
        let half = 0.5 * error;
        for ((value, total), own) in row.iter_mut().zip(&mut total).zip(&own) {
            *total += half * *value;
            *value -= half * own;
        }
    }
    for ((value, own), total) in basis[column].iter_mut().zip(&own).zip(&total) {
        *value = own - total;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_view_a_thousand_times_is_its_own_mean() {
        for gray in [0_u8, 1, 127, 255] {
            let mut pca = IncrementalPca::<9, 4>::new(Growth::Fixed);
            for turn in 0..1000 {
                let step = pca.update(&[gray; 9]).expect("finite");
                let expected = if turn == 0 {
                    Change::First
                } else {
                    Change::Kept
                };
                assert_eq!(step.change, expected, "gray {gray}, turn {turn}");
                assert!(step.coordinates.iter().all(|&g| g == 0.0));
            }
            assert_eq!((pca.eigenvalues().len(), pca.lost_energy()), (0, 0.0));
            assert!(pca.mean().iter().all(|&mean| mean == f32::from(gray)));
            assert_eq!(pca.covered(), 1.0);
        }
    }

    #[test]
    fn two_views_in_turn_span_one_dimension() {
        let (black, white) = ([0_u8; 4], [255_u8; 4]);
        let mut pca = IncrementalPca::<4, 8>::new(Growth::Fixed);
        for _ in 0..1000 {
            pca.update(&black).expect("finite");
            pca.update(&white).expect("finite");
        }
        // Half of ‖white − black‖ = 510 on either side of the mean.
        assert_eq!(pca.eigenvalues().len(), 1);
        let [eigenvalue] = pca.eigenvalues() else {
            panic!()
        };
        assert!((eigenvalue / 65_025.0 - 1.0).abs() < 1e-5, "{eigenvalue}");
        assert!((0..4).all(|pixel| (pca.eigenimage(0, pixel).abs() - 0.5).abs() < 1e-6));
        assert_eq!(pca.eigenimage(1, 0), 0.0);
        assert_eq!(pca.eigenimage(0, 4), 0.0);
    }

    #[test]
    fn views_that_are_not_finite_change_nothing() {
        let mut pca = IncrementalPca::<4, 3>::new(Growth::Fixed);
        for view in [
            [1.0_f32, 2.0, 3.0, 4.0],
            [4.0, 1.0, 2.0, 3.0],
            [9.0, 1.0, 2.0, 0.0],
        ] {
            pca.update(&view).expect("finite");
        }
        let before = pca.clone();
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e15] {
            assert_eq!(pca.update(&[1.0, 2.0, bad, 4.0]), None);
            assert_eq!(pca.mean(), before.mean());
            assert_eq!(pca.eigenvalues(), before.eigenvalues());
            assert_eq!(pca.views(), 3);
        }
        assert!(pca.update(&[1.0_f32, 2.0, 3.0, 5.0]).is_some());
    }

    #[test]
    fn extreme_views_stay_finite() {
        for scale in [1e-30_f32, 1e-20, 1e-10, 1.0, 1e10, 1e13] {
            let mut pca = IncrementalPca::<4, 3>::new(Growth::Fixed);
            for turn in 0..50_u8 {
                let view = [turn % 7, turn % 5, turn % 3, turn % 2];
                let step = pca.update(&view.map(|pixel| f32::from(pixel) * scale));
                let step = step.expect("finite");
                assert!(step.coordinates.iter().all(|g| g.is_finite()));
                assert!(step.carry.rotation().iter().all(|r| r.is_finite()));
            }
            assert!(pca.eigenvalues().iter().all(|value| value.is_finite()));
            assert!(pca.covered().is_finite());
        }
    }

    /// Views on the axes, with growing deviations: what each policy makes of them.
    fn dimensions_after(growth: Growth, amplitudes: &[f32]) -> usize {
        let mut pca = IncrementalPca::<8, 6>::new(growth);
        pca.update(&[0.0_f32; 8]).expect("finite");
        for (axis, &amplitude) in amplitudes.iter().enumerate() {
            let mut view = [0.0_f32; 8];
            view[axis] = amplitude;
            pca.update(&view).expect("finite");
        }
        pca.eigenvalues().len()
    }

    #[test]
    fn the_fixed_policy_grows_until_there_is_no_slot() {
        assert_eq!(dimensions_after(Growth::Fixed, &[9.0, 1.0, 9.0]), 3);
        assert_eq!(dimensions_after(Growth::Fixed, &[9.0; 8]), 5);
    }

    #[test]
    fn the_residual_policy_ignores_views_that_are_almost_expressed() {
        let growth = Growth::Residual { above: 5.0 };
        assert_eq!(dimensions_after(growth, &[9.0, 1.0, 9.0, 2.0]), 2);
        assert_eq!(dimensions_after(growth, &[1.0, 1.0, 1.0]), 0);
    }

    #[test]
    fn the_lost_energy_policy_grows_when_too_much_has_been_lost() {
        // The first is half lost with the mean: 9²·1/2 = 40.5.
        assert_eq!(
            dimensions_after(Growth::LostEnergy { above: 40.0 }, &[9.0]),
            1
        );
        assert_eq!(
            dimensions_after(Growth::LostEnergy { above: 41.0 }, &[9.0]),
            0
        );
        assert_eq!(
            dimensions_after(Growth::LostEnergy { above: 41.0 }, &[9.0, 9.0]),
            1
        );
    }

    #[test]
    fn the_eigenvalue_policy_wants_variance_in_every_dimension() {
        // The first has variance 9²/4 = 20.25.
        assert_eq!(
            dimensions_after(Growth::Eigenvalue { above: 20.0 }, &[9.0]),
            1
        );
        assert_eq!(
            dimensions_after(Growth::Eigenvalue { above: 21.0 }, &[9.0]),
            0
        );
        assert_eq!(
            dimensions_after(Growth::Eigenvalue { above: 1.0 }, &[9.0, 1.0, 9.0]),
            2
        );
    }
}
