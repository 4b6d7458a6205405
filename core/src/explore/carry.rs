//! From the coordinates before an update to those after it, without the views: report (2.24), corrected.

use nalgebra::{SMatrix, SVector};

use super::Coordinates;

/// How coordinates change with an update: g′ = Rᵀ([g; 0] + η), without the dimensions that were dropped.
///
/// Whoever keeps coordinates of earlier views passes each through every update's carry, in order. They stay what
/// projecting the view again would give as long as nothing is truncated; then they are coordinates of what was kept
/// of the view.
#[derive(Clone, Debug, PartialEq)]
pub struct Carry<const SLOTS: usize> {
    pub(super) rotation: SMatrix<f32, SLOTS, SLOTS>,
    pub(super) shift: SVector<f32, SLOTS>,
    pub(super) dimensions: usize,
}

impl<const SLOTS: usize> Carry<SLOTS> {
    /// R, (k + 1)×(k + 1) and orthogonal: column j is the new dimension j in the old ones, whose last is the
    /// residual's. Dimensions that do not exist are zero-valued and rotate into nothing but each other.
    #[must_use]
    pub fn rotation(&self) -> &SMatrix<f32, SLOTS, SLOTS> {
        &self.rotation
    }

    /// Rᵀη, what the move of the mean adds; η = −[g; γ]/(n + 1) with g of the newest view.
    #[must_use]
    pub fn shift(&self) -> &SVector<f32, SLOTS> {
        &self.shift
    }

    /// Dimensions after the update, k′.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Brings coordinates up to date. Returns the energy that fell into the dropped dimension: 0 unless the update
    /// truncated.
    pub fn carry(&self, coordinates: &mut Coordinates<SLOTS>) -> f32 {
        *coordinates = self.rotation.tr_mul(coordinates) + self.shift;
        self.truncate(coordinates)
    }

    /// Empties the dimensions that were dropped and returns the energy that was in them.
    pub(super) fn truncate(&self, coordinates: &mut Coordinates<SLOTS>) -> f32 {
        let mut energy = 0.0;
        for value in coordinates.iter_mut().skip(self.dimensions) {
            energy += *value * *value;
            *value = 0.0;
        }
        energy
    }
}
