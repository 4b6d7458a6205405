//! A camera with a clock: what is late, what is lost, and when it is tried again.
//!
//! ```text
//!           begin             frame, or a bad one
//! ┌─ Due ─────────▶ Waiting ─────────────────────▶ Due
//! │   ▲  absent, bus   │ late, absent, bus: recover
//! │   │                ▼
//! │   └──────────── Resting   a while; while the camera is lost, a long one
//! └─────────────────▶┘
//! ```
//!
//! Time is in microseconds since any moment. It may wrap; only differences count.

use super::{Camera, CameraError, FrameSize};

/// How long is late, and how often is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Limits {
    /// From the request of a frame until it is late, in microseconds.
    pub frame_us: u64,
    /// The same for the first frame after the camera is set up, which takes its time.
    pub first_frame_us: u64,
    /// From an answer that there is no camera, or that its bus failed, to the next try.
    pub rest_us: u64,
    /// From one try to the next while the camera is lost.
    pub retry_us: u64,
    /// Requests in a row without a frame after which the camera is lost.
    pub failures: u8,
}

/// A camera that is watched: it is asked for frames, recovered when it stumbles, and given up for a while when it is
/// lost.
#[derive(Debug)]
pub struct Supervised<C> {
    camera: C,
    limits: Limits,
    phase: Phase,
    /// Whether the camera is still to give its first frame after it was set up.
    is_first: bool,
    /// Requests in a row without a frame.
    failures: u8,
    is_lost: bool,
    losses: u16,
    error: Option<CameraError>,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    /// The next frame is to be asked for.
    Due,
    /// A frame was asked for.
    Waiting { since_us: u64 },
    /// Nothing is done.
    Resting { since_us: u64, for_us: u64 },
}

impl Limits {
    /// 200 ms for a frame, 2 s for the first (Zephyr's driver allows an Arducam Mega 1.5 s to come back from a reset),
    /// 200 ms of rest, a try every second, lost after 3 failures.
    pub const DEFAULT: Self = Self {
        frame_us: 200_000,
        first_frame_us: 2_000_000,
        rest_us: 200_000,
        retry_us: 1_000_000,
        failures: 3,
    };
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl<C: Camera> Supervised<C> {
    /// Watches `camera`, which is looked for and set up at the first [`poll`](Self::poll).
    pub const fn new(camera: C, limits: Limits) -> Self {
        Self {
            camera,
            limits,
            phase: Phase::Due,
            is_first: true,
            failures: 0,
            is_lost: false,
            losses: 0,
            error: None,
        }
    }

    /// Goes on: to be called often, with the time, and with the same `pixels` until a frame lies there
    /// (see [`Camera::take`]). The next frame is asked for by the call after the one that returns this one, so
    /// `pixels` can be used until then.
    ///
    /// Returns a frame's size, or what became of a request that gave none; nothing while there is nothing to say. The
    /// error that makes the camera [lost](Self::is_lost) is the last one until there is a frame again.
    pub fn poll(
        &mut self,
        now_us: u64,
        pixels: &mut [u8],
    ) -> Option<Result<FrameSize, CameraError>> {
        match self.phase {
            Phase::Due => match self.camera.begin() {
                Ok(()) => {
                    self.phase = Phase::Waiting { since_us: now_us };
                    None
                }
                Err(error) => self.fail(now_us, error),
            },
            Phase::Waiting { since_us } => match self.camera.take(pixels) {
                Ok(Some(size)) => {
                    (self.phase, self.is_first) = (Phase::Due, false);
                    (self.failures, self.is_lost, self.error) = (0, false, None);
                    Some(Ok(size))
                }
                Ok(None) if now_us.wrapping_sub(since_us) < self.limit_us() => None,
                Ok(None) => self.fail(now_us, CameraError::Late),
                Err(error) => self.fail(now_us, error),
            },
            Phase::Resting { since_us, for_us } => {
                if now_us.wrapping_sub(since_us) >= for_us {
                    self.phase = Phase::Due;
                }
                None
            }
        }
    }

    /// Whether so many requests in a row gave no frame that the camera is only tried from time to time.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// Times that the camera was lost.
    #[must_use]
    pub fn losses(&self) -> u16 {
        self.losses
    }

    /// What became of the last request; none when it gave a frame, or when there was none yet.
    #[must_use]
    pub fn error(&self) -> Option<CameraError> {
        self.error
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &C {
        &self.camera
    }

    fn limit_us(&self) -> u64 {
        if self.is_first {
            self.limits.first_frame_us
        } else {
            self.limits.frame_us
        }
    }

    fn fail(&mut self, now_us: u64, error: CameraError) -> Option<Result<FrameSize, CameraError>> {
        let was_lost = self.is_lost;
        self.error = Some(error);
        self.failures = self.failures.saturating_add(1);
        if !was_lost && self.failures >= self.limits.failures {
            self.is_lost = true;
            self.losses = self.losses.saturating_add(1);
        }
        let rest_us = match error {
            _ if self.is_lost => Some(self.limits.retry_us),
            CameraError::Absent | CameraError::Bus => Some(self.limits.rest_us),
            CameraError::Late => Some(0),
            CameraError::Short { .. } | CameraError::Torn | CameraError::Room { .. } => None,
        };
        self.phase = match rest_us {
            Some(for_us) => {
                self.camera.recover();
                self.is_first = true;
                Phase::Resting {
                    since_us: now_us,
                    for_us,
                }
            }
            None => Phase::Due,
        };
        (!was_lost).then_some(Err(error))
    }
}

#[cfg(test)]
mod tests;
