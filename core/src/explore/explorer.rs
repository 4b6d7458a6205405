//! Landmarks selected online: algorithm 2.4's criterion, during exploration.
//!
//! **What.** Each view is measured against the eigenspace of the landmarks so far. When its residual is above a
//! threshold it becomes a landmark, the eigenspace takes it in, and the coordinates of the earlier landmarks are
//! carried along; no view is kept. Otherwise the nearest landmark is reported.
//!
//! **Method.** Algorithm 2.4, corrected, with the threshold that the report's section 2.3.3 mentions instead of a
//! search for the largest residual. Deviations:
//! 1. The threshold is absolute, a root mean square in gray levels per pixel. A share of ‖x − x̄‖ would make a landmark
//!    of every second view, whose residual is all of its deviation, and of noise over even ground.
//! 2. Once dimensions have been dropped, landmarks themselves have residuals. A view is also known when, for some
//!    landmark, ‖g − g_i‖² + (‖r‖ − ‖r_i‖)² is within the threshold: at most the squared distance of the two views.
//!    Until then r_i = 0, and this says nothing that the residual does not.
//!
//! **Cost.** A measurement (about a quarter of an update) per view, an update per landmark, l·k² to carry the others.
//!
//! **Limits.** Dropped dimensions of different updates are taken as orthogonal; ‖r_i‖ is an estimate.

use heapless::Vec;

use super::{Coordinates, Growth, IncrementalPca};
use crate::math::sqrt;

/// What is kept of a landmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory<const SLOTS: usize> {
    /// Its coordinates in the eigenspace of now.
    pub coordinates: Coordinates<SLOTS>,
    /// Energy outside of the eigenspace, ‖r_i‖²: what dropped dimensions held of it.
    pub left_out: f32,
}

/// What a view turned out to be. Landmarks are numbered from 0; distances and residuals are root mean squares in gray
/// levels per pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sighting {
    /// Something new: it is a landmark from now on.
    New {
        /// Its number.
        landmark: usize,
        /// Its residual; of the first view, all of it.
        residual: f32,
    },
    /// Something known.
    Known {
        /// The nearest landmark.
        landmark: usize,
        /// Distance to it.
        distance: f32,
        /// The view's residual.
        residual: f32,
    },
    /// Something new, and no room for it.
    Full {
        /// The nearest landmark.
        landmark: usize,
        /// Distance to it.
        distance: f32,
        /// The view's residual.
        residual: f32,
    },
}

/// Landmarks, at most `LANDMARKS`, and the eigenspace of their views.
///
/// ```
/// use eigenmark_core::explore::{Explorer, Growth, Sighting};
///
/// let mut explorer = Explorer::<4, 3, 8>::new(10.0, Growth::Fixed);
/// let (left, right) = ([200_u8, 0, 200, 0], [0_u8, 200, 0, 200]);
/// assert!(matches!(explorer.observe(&left), Some(Sighting::New { landmark: 0, .. })));
/// assert!(matches!(explorer.observe(&right), Some(Sighting::New { landmark: 1, .. })));
/// let almost_left = [198_u8, 4, 201, 2];
/// assert!(matches!(explorer.observe(&almost_left), Some(Sighting::Known { landmark: 0, .. })));
/// ```
#[derive(Clone, Debug)]
pub struct Explorer<const PIXELS: usize, const SLOTS: usize, const LANDMARKS: usize> {
    threshold: f32,
    eigenspace: IncrementalPca<PIXELS, SLOTS>,
    landmarks: Vec<Memory<SLOTS>, LANDMARKS>,
}

impl<const PIXELS: usize, const SLOTS: usize, const LANDMARKS: usize>
    Explorer<PIXELS, SLOTS, LANDMARKS>
{
    /// Nothing is known yet. `threshold` is in gray levels per pixel (root mean square).
    #[must_use]
    pub const fn new(threshold: f32, growth: Growth) -> Self {
        const {
            assert!(LANDMARKS >= 1);
        }
        Self {
            threshold,
            eigenspace: IncrementalPca::new(growth),
            landmarks: Vec::new(),
        }
    }

    /// Nothing is known again, in place, and there is another threshold; the growth stays.
    pub fn reset(&mut self, threshold: f32) {
        self.threshold = threshold;
        self.eigenspace.reset();
        self.landmarks.clear();
    }

    /// The eigenspace of the landmarks.
    #[must_use]
    pub fn eigenspace(&self) -> &IncrementalPca<PIXELS, SLOTS> {
        &self.eigenspace
    }

    /// The landmarks, in the order of their discovery.
    #[must_use]
    pub fn landmarks(&self) -> &[Memory<SLOTS>] {
        &self.landmarks
    }

    /// Looks at a view. `None`, and nothing happens, when its squared norm is not finite.
    pub fn observe<P: Copy + Into<f32>>(&mut self, view: &[P; PIXELS]) -> Option<Sighting> {
        let projection = self.eigenspace.project(view)?;
        let m = PIXELS as f32;
        let residual = projection.residual / sqrt(m);
        if let Some((landmark, squared)) =
            self.nearest(&projection.coordinates, projection.residual, |_| true)
        {
            let distance = sqrt(squared / m);
            if residual <= self.threshold || distance <= self.threshold {
                return Some(Sighting::Known {
                    landmark,
                    distance,
                    residual,
                });
            }
            if self.landmarks.is_full() {
                return Some(Sighting::Full {
                    landmark,
                    distance,
                    residual,
                });
            }
        }
        let step = self.eigenspace.absorb(view, &projection);
        for landmark in &mut self.landmarks {
            landmark.left_out += step.carry.carry(&mut landmark.coordinates);
        }
        let landmark = self.landmarks.len();
        let memory = Memory {
            coordinates: step.coordinates,
            left_out: step.left_out,
        };
        // There is room: a full table has a nearest landmark.
        let _ = self.landmarks.push(memory);
        Some(Sighting::New { landmark, residual })
    }

    /// The nearest to a view of those landmarks that are plausible, and its distance (root mean square, in gray levels).
    /// Nothing is learned.
    pub fn recall<P: Copy + Into<f32>>(
        &mut self,
        view: &[P; PIXELS],
        is_plausible: impl Fn(usize) -> bool,
    ) -> Option<(usize, f32)> {
        let projection = self.eigenspace.project(view)?;
        let (landmark, squared) =
            self.nearest(&projection.coordinates, projection.residual, is_plausible)?;
        Some((landmark, sqrt(squared / PIXELS as f32)))
    }

    /// The landmark with the smallest ‖g − g_i‖² + (‖r‖ − ‖r_i‖)² of those that take part, and that; the first of
    /// equals.
    fn nearest(
        &self,
        coordinates: &Coordinates<SLOTS>,
        residual: f32,
        takes_part: impl Fn(usize) -> bool,
    ) -> Option<(usize, f32)> {
        let mut nearest = None;
        let landmarks = self.landmarks.iter().enumerate();
        for (i, landmark) in landmarks.filter(|&(i, _)| takes_part(i)) {
            let outside = residual - sqrt(landmark.left_out);
            let mut squared = outside * outside;
            for (a, b) in coordinates.iter().zip(&landmark.coordinates) {
                squared += (a - b) * (a - b);
            }
            if nearest.is_none_or(|(_, least)| squared < least) {
                nearest = Some((i, squared));
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sides of the test places' views.
    const PIXELS: usize = 36;

    /// Gray levels of noise, half range; its root mean square is 2.6.
    const NOISE: u32 = 4;

    /// Above all noise, far below the difference of two places (74 gray levels, root mean square, on average).
    const THRESHOLD: f32 = 10.0;

    /// Integer noise: the same everywhere.
    fn hash(x: u32) -> u32 {
        let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
        let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
        x ^ (x >> 16)
    }

    /// A view of `place`, with noise that depends on `visit`.
    fn view(place: u32, visit: u32) -> [u8; PIXELS] {
        core::array::from_fn(|pixel| {
            let pixel = pixel as u32;
            let level = 30 + hash(place * 1000 + pixel) % 180;
            let noise = hash(hash(visit * 1000 + place) ^ pixel) % (2 * NOISE + 1);
            (level + noise - NOISE) as u8
        })
    }

    fn known(sighting: Option<Sighting>) -> Option<usize> {
        match sighting {
            Some(Sighting::Known { landmark, .. }) => Some(landmark),
            _ => None,
        }
    }

    #[test]
    fn each_place_becomes_one_landmark_and_is_known_again() {
        let mut explorer = Explorer::<PIXELS, 16, 32>::new(THRESHOLD, Growth::Fixed);
        let mut found = 0;
        for visit in 0..400 {
            // Twelve places, discovered one after the other, then visited in no order.
            let place = hash(visit) % (visit / 8 + 1).min(12);
            match explorer.observe(&view(place, visit)) {
                Some(Sighting::New { landmark, .. }) => {
                    assert_eq!(landmark, found);
                    found += 1;
                }
                Some(Sighting::Known {
                    distance, residual, ..
                }) => {
                    assert!(distance < THRESHOLD && residual < THRESHOLD);
                }
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(explorer.landmarks().len(), 12);
        assert_eq!(explorer.eigenspace().views(), 12);
        assert_eq!(explorer.eigenspace().eigenvalues().len(), 11);
        let mut landmarks: std::vec::Vec<_> = (0..12)
            .map(|place| known(explorer.observe(&view(place, 5000))).expect("known"))
            .collect();
        landmarks.sort_unstable();
        assert!(landmarks.into_iter().eq(0..12));
    }

    #[test]
    fn what_is_recalled_is_plausible_and_nearest_and_changes_nothing() {
        let mut explorer = Explorer::<PIXELS, 16, 32>::new(THRESHOLD, Growth::Fixed);
        for place in 0..8 {
            explorer.observe(&view(place, 0));
        }
        for place in 0..8 {
            let seen = view(place, 7);
            let (landmark, distance) = explorer.recall(&seen, |_| true).expect("known");
            assert_eq!(landmark, place as usize);
            assert!(distance > 0.0 && distance < THRESHOLD);
            let other = explorer.recall(&seen, |other| other != landmark);
            assert!(other.is_some_and(|(other, farther)| other != landmark && farther > THRESHOLD));
        }
        assert_eq!(explorer.recall(&view(9, 0), |_| false), None);
        assert_eq!(explorer.landmarks().len(), 8);
    }

    #[test]
    fn places_are_known_again_although_dimensions_were_dropped() {
        let mut explorer = Explorer::<PIXELS, 9, 24>::new(THRESHOLD, Growth::Fixed);
        for place in 0..24 {
            let sighting = explorer.observe(&view(place, 0));
            assert!(
                matches!(sighting, Some(Sighting::New { .. })),
                "place {place}: {sighting:?}"
            );
        }
        assert!(explorer.eigenspace().covered() < 0.9);
        for place in 0..24 {
            let sighting = explorer.observe(&view(place, 1));
            let landmark = match sighting {
                Some(Sighting::Known { landmark, .. } | Sighting::Full { landmark, .. }) => {
                    landmark
                }
                _ => panic!("{sighting:?}"),
            };
            assert_eq!(landmark, place as usize, "{sighting:?}");
        }
    }

    #[test]
    fn a_full_table_says_so_and_stays_as_it_is() {
        let mut explorer = Explorer::<PIXELS, 4, 2>::new(THRESHOLD, Growth::Fixed);
        explorer.observe(&view(0, 0));
        explorer.observe(&view(1, 0));
        let before = explorer.landmarks().to_vec();
        let sighting = explorer.observe(&view(2, 0));
        assert!(
            matches!(sighting, Some(Sighting::Full { .. })),
            "{sighting:?}"
        );
        assert_eq!(explorer.landmarks(), before);
        assert_eq!(known(explorer.observe(&view(1, 1))), Some(1));
    }

    #[test]
    fn views_that_are_not_finite_are_not_looked_at() {
        let mut explorer = Explorer::<4, 3, 4>::new(1.0, Growth::Fixed);
        assert_eq!(explorer.observe(&[f32::NAN; 4]), None);
        assert!(explorer.landmarks().is_empty());
        assert!(explorer.observe(&[0.0_f32; 4]).is_some());
        assert_eq!(explorer.observe(&[0.0, f32::INFINITY, 0.0, 0.0]), None);
    }

    #[test]
    fn black_views_are_one_landmark() {
        let mut explorer = Explorer::<4, 3, 4>::new(1.0, Growth::Fixed);
        explorer.observe(&[0_u8; 4]);
        for _ in 0..100 {
            assert_eq!(known(explorer.observe(&[0_u8; 4])), Some(0));
        }
    }
}
