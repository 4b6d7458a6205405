//! What an exploration keeps.

use super::{
    Chart,
    window::{CONTRAST, PIXELS},
};
use crate::{
    explore::{Explorer, Growth},
    route::Router,
    track::Odometry,
};

/// Dimensions of the eigenspace of landmarks, and one for the residual.
pub(super) const SLOTS: usize = 16;

/// Views that differ by less than this share of their contrast (root mean square) show the same place.
const NOVELTY: f32 = 0.9;

/// Room for `PLACES` places and `LEGS` legs, four to eight for each place. Const-constructible, for a `static` on a
/// board; a box on a host.
#[derive(Clone, Debug)]
pub struct Memory<const PLACES: usize, const LEGS: usize> {
    pub(super) odometry: Odometry,
    pub(super) explorer: Explorer<PIXELS, SLOTS, PLACES>,
    pub(super) chart: Chart<PLACES, LEGS>,
    pub(super) router: Router<PLACES>,
}

// Beside a stack of 16 KiB in the 128 KiB of an STM32F405.
const _: () = assert!(size_of::<Memory<128, 1024>>() <= 112 * 1024);

impl<const PLACES: usize, const LEGS: usize> Memory<PLACES, LEGS> {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            odometry: Odometry::new(),
            explorer: Explorer::new(NOVELTY * CONTRAST, Growth::Fixed),
            chart: Chart::new(),
            router: Router::new(),
        }
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        // One after the other, where they are: all at once would take as much stack.
        self.odometry = Odometry::new();
        self.explorer = Explorer::new(NOVELTY * CONTRAST, Growth::Fixed);
        self.chart = Chart::new();
        self.router = Router::new();
    }
}

impl<const PLACES: usize, const LEGS: usize> Default for Memory<PLACES, LEGS> {
    fn default() -> Self {
        Self::new()
    }
}
