//! The autopilot: what it tells over MAVLink, and what it is told.
//!
//! **In.** [`Autopilot::receive`] takes bytes one by one, of MAVLink 1 or 2, damaged or not. Of the autopilot (the
//! first component 1 whose heartbeat is heard) HEARTBEAT, ATTITUDE, and an altitude are taken: DISTANCE_SENSOR
//! downward, or else altitude_terrain or altitude_relative of ALTITUDE, or else relative_alt of GLOBAL_POSITION_INT.
//! Signatures are not checked: a signed message is taken as an unsigned one is. [`Autopilot::readings`] makes of it
//! what a navigator takes.
//!
//! **Out.** [`Autopilot::report`] sends ODOMETRY for every step, OPTICAL_FLOW_RAD for every displacement, and
//! STATUSTEXT with the reason when a fix is refused; [`Autopilot::beat`] sends HEARTBEAT. Every message is handed out
//! in one piece, of at most [`MAX_MESSAGE_LEN`] bytes. At 30 frames a second that is 9.0 KB/s: 78 % of 115,200 baud.
//!
//! **Axes.** Map-up is taken to be north. So ODOMETRY is in LOCAL_NED: x north (map-up), y east (map-right), z down,
//! in meters from the map's upper left corner; z is minus the altitude above the ground that is told. Speeds are in
//! BODY_FRD. Roll, pitch and yaw have the same signs in MAVLink and here: right side down, nose up, clockwise from
//! above.
//!
//! **Unknown** is NaN, for places, attitudes, speeds and rates, and as the first number of a covariance of which
//! nothing is known. What is unknown beside something known has a variance that says nothing: 10⁶ m², π² rad², 10⁴
//! (m/s)², 100 (rad/s)². Variances of altitude (1.8 % of it, squared), roll and pitch (1°, squared) are assumptions:
//! they were told without.

mod checksum;
mod framer;
mod instruments;
mod integrator;
mod measured;
mod sender;
mod texts;

#[cfg(test)]
mod peer;
#[cfg(test)]
mod tests;

use eigenmark_core::{
    link::Refusal,
    navigator::{Guidance, Readings},
    slots::Setup,
};
use mavlink::dialects::common::{
    HEARTBEAT_DATA, MavAutopilot, MavModeFlag, MavType, STATUSTEXT_DATA,
};

use crate::time::ms;

use framer::{Framer, Heard};
use instruments::{Attitude, Instruments, Told};
use integrator::{Input, Integrator};
use measured::Context;
use sender::Sender;
use texts::Texts;

pub use mavlink::dialects::common::{MavSeverity, MavState};
pub use sender::MAX_MESSAGE_LEN;

/// Between two heartbeats.
const BEAT_MS: u32 = 1000;

/// The system that is named as long as the autopilot's is not known.
const ANY_SYSTEM: u8 = 1;

/// Bytes of a text, at most.
pub const MAX_TEXT_LEN: usize = 50;

/// The link to an autopilot. Times are since the start; those in milliseconds may come round.
#[derive(Clone, Debug)]
pub struct Autopilot {
    framer: Framer,
    instruments: Instruments,
    told: Told,
    /// When the last displacement ended.
    before: Option<Attitude>,
    integrator: Integrator,
    sender: Sender,
    texts: Texts,
    beat_ms: Option<u32>,
}

/// What became of a step, to be told to an autopilot.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// When the frame was taken, in microseconds.
    pub now_us: u64,
    /// Since the step before, in seconds.
    pub step_s: f32,
    /// What the navigator made of it; `None` without an atlas.
    pub guidance: Option<&'a Guidance>,
    /// Why there is no fix, or why it does not count.
    pub refusal: Option<Refusal>,
    /// There was no frame, or it was passed over
    /// ([`Odometry::is_waiting`](eigenmark_core::track::Odometry::is_waiting)): the next displacement will be that of
    /// this step, too.
    pub is_waiting: bool,
    /// Side of the atlas's footprint, in pixels of the map.
    pub footprint_px: f32,
    /// What was written with the atlas.
    pub setup: Setup,
}

/// Most of it is a message that is not complete.
const _: () = assert!(size_of::<Autopilot>() <= 512);

impl Autopilot {
    /// Nothing was heard yet, and nothing said.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            framer: Framer::new(),
            instruments: Instruments::new(),
            told: Told::NOTHING,
            before: None,
            integrator: Integrator::new(),
            sender: Sender::new(),
            texts: Texts::new(),
            beat_ms: None,
        }
    }

    /// Takes in a byte, and says whether it completed a message that is of use.
    pub fn receive(&mut self, byte: u8, now_ms: u32) -> bool {
        let Self {
            framer,
            instruments,
            ..
        } = self;
        let mut is_of_use = false;
        framer.push(byte, |heard| match heard {
            Heard::Message(message) => is_of_use |= instruments.take(&message, now_ms),
            Heard::Other(header) => instruments.pass(&header),
        });
        is_of_use
    }

    /// What the instruments say now, and nothing that is old: attitudes for half a second, altitudes for a second.
    /// What is said here is what the next [`report`](Self::report) goes by. `footprint_px` is the side of the atlas's
    /// footprint, in pixels of the map.
    pub fn readings(&mut self, now_ms: u32, setup: &Setup, footprint_px: f32) -> Readings {
        self.told = self.instruments.told(now_ms);
        self.told.readings(setup, footprint_px)
    }

    /// Whether the autopilot's heartbeat was heard in the last three seconds.
    #[must_use]
    pub fn is_connected(&self, now_ms: u32) -> bool {
        self.instruments.is_present(now_ms)
    }

    /// Whether it is connected, and armed.
    #[must_use]
    pub fn is_armed(&self, now_ms: u32) -> bool {
        self.instruments.is_armed(now_ms)
    }

    /// Its system, once its heartbeat was heard.
    #[must_use]
    pub fn system(&self) -> Option<u8> {
        self.instruments.system()
    }

    /// Stretches of bytes that belong to no message, since the start.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.framer.damaged()
    }

    /// Messages of the autopilot that sequence numbers say are missing, since the start: at least those.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.instruments.lost()
    }

    /// Messages of the autopilot that were taken in, since the start.
    #[must_use]
    pub fn messages(&self) -> u32 {
        self.instruments.messages()
    }

    /// Begins anew on another map.
    pub fn restart(&mut self) {
        self.integrator.restart();
    }

    /// Sends what became of a step: the reason when a fix is refused, when it changes and at most every second; the
    /// pose; what was seen of the ground to go by.
    pub fn report(&mut self, step: &Step<'_>, send: &mut impl FnMut(&[u8])) {
        // Milliseconds may come round.
        let now_ms = ms(step.now_us);
        if let Some(refusal) = self.texts.due(step.refusal, now_ms) {
            self.say(texts::severity(refusal), refusal.words(), send);
        }
        let context = self.advance(step);
        let odometry = measured::odometry(step, &context);
        self.send(&odometry, send);
        if let Some(flow) = measured::flow(step, &context) {
            self.send(&flow, send);
        }
    }

    /// Sends a text, of at most [`MAX_TEXT_LEN`] bytes: what is more is left out.
    pub fn say(&mut self, severity: MavSeverity, text: &str, send: &mut impl FnMut(&[u8])) {
        let mut end = text.len().min(MAX_TEXT_LEN);
        while !text.is_char_boundary(end) {
            end = end.saturating_sub(1);
        }
        let mut bytes = [0; MAX_TEXT_LEN];
        for (byte, from) in bytes.iter_mut().zip(text.bytes().take(end)) {
            *byte = from;
        }
        let text = STATUSTEXT_DATA {
            severity,
            text: bytes.into(),
            ..STATUSTEXT_DATA::DEFAULT
        };
        self.send(&text, send);
    }

    /// Sends a heartbeat when the last one is a second old, and says whether it did.
    pub fn beat(&mut self, now_ms: u32, state: MavState, send: &mut impl FnMut(&[u8])) -> bool {
        self.instruments.forget(now_ms);
        let is_due = self
            .beat_ms
            .is_none_or(|at_ms| now_ms.wrapping_sub(at_ms) >= BEAT_MS);
        if is_due {
            self.beat_ms = Some(now_ms);
            let heartbeat = HEARTBEAT_DATA {
                mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
                autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
                base_mode: MavModeFlag::empty(),
                system_status: state,
                ..HEARTBEAT_DATA::DEFAULT
            };
            self.send(&heartbeat, send);
        }
        is_due
    }

    /// Moves the pose on.
    fn advance(&mut self, step: &Step<'_>) -> Context {
        let told = self.told;
        let side_m = step.footprint_px * step.setup.meters_per_px;
        let is_set_up = step.setup.is_valid() && side_m > 0.0 && side_m.is_finite();
        let guidance = step.guidance.filter(|_| is_set_up);
        let displacement = guidance.and_then(|guidance| guidance.displacement.as_ref());
        let estimate = guidance.and_then(|guidance| guidance.estimate.as_ref());
        let took_s = self.integrator.advance(&Input {
            step_s: step.step_s,
            displacement,
            is_waiting: step.is_waiting,
            heading_rad: told.attitude.map(|attitude| attitude.yaw_rad),
            estimate,
            side_m,
            meters_per_px: step.setup.meters_per_px,
        });
        let before = self.before;
        if !step.is_waiting || displacement.is_some() {
            self.before = told.attitude;
        }
        Context {
            told,
            // Before the first frame there is no estimate.
            pose: estimate.map(|_| self.integrator.pose()),
            resets: self.integrator.resets(),
            took_s,
            before,
            side_m,
        }
    }

    fn send(&mut self, message: &impl mavlink::MessageData, send: &mut impl FnMut(&[u8])) {
        let system = self.instruments.system().unwrap_or(ANY_SYSTEM);
        self.sender.send(system, message, send);
    }
}

impl Default for Autopilot {
    fn default() -> Self {
        Self::new()
    }
}
