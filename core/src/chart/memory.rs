//! What an exploration keeps.

use super::{
    Chart,
    window::{CONTRAST, PIXELS},
};
use crate::{
    explore::{Explorer, Growth},
    route::Router,
    track::BoardOdometry,
};

/// Dimensions of the eigenspace of landmarks, and one for the residual.
pub(super) const SLOTS: usize = 24;

/// Views of which landmarks leave at least this share of the contrast unexplained (root mean square) are new.
const NOVELTY: f32 = 0.7;

/// Room for `PLACES` places and `LEGS` legs, four to eight for each place. Const-constructible, for a `static` on a
/// board; a box on a host.
#[derive(Clone, Debug)]
pub struct Memory<const PLACES: usize, const LEGS: usize> {
    pub(super) odometry: BoardOdometry,
    pub(super) explorer: Explorer<PIXELS, SLOTS, PLACES>,
    pub(super) chart: Chart<PLACES, LEGS>,
    pub(super) router: Router<PLACES>,
}

// Beside 20 KiB of stack and a frame of 120×120 in the 128 KiB of an STM32F405.
const _: () = assert!(size_of::<Memory<128, 1024>>() + 120 * 120 <= 100 * 1024);

impl<const PLACES: usize, const LEGS: usize> Memory<PLACES, LEGS> {
    /// Nothing yet: all zeros, so that a static one needs no copy in flash. The threshold comes with
    /// [`Exploration::new`](super::Exploration::new).
    #[must_use]
    pub const fn new() -> Self {
        Self {
            odometry: BoardOdometry::new(),
            explorer: Explorer::new(0.0, Growth::Fixed),
            chart: Chart::new(),
            router: Router::new(),
        }
    }

    /// Nothing again, in place: it is too large for the stack of a board.
    pub(super) fn reset(&mut self) {
        let Self {
            odometry,
            explorer,
            chart,
            router,
        } = self;
        odometry.reset();
        explorer.reset(NOVELTY * CONTRAST);
        chart.reset();
        router.reset();
    }
}

impl<const PLACES: usize, const LEGS: usize> Default for Memory<PLACES, LEGS> {
    fn default() -> Self {
        Self::new()
    }
}
