//! What flies: camera, instruments and host → navigator → autopilot and host, one turn after the other.
//!
//! A turn never waits: it takes what has arrived, and rests when that was nothing. So a camera without frames, an
//! autopilot without a word, a host that floods its wire or an atlas that is being written hold up nothing else.

#[cfg(test)]
mod tests;

use eigenmark_core::{
    atlas::Atlas,
    link::{
        Camera as CameraSays, Damage, MAX_FRAME_LEN, MAX_REPLY_LEN, MAX_REQUEST_LEN,
        PICTURE_PART_LEN, Receiver, Refusal, Rejection, Reply, Report, Request, SlotState, encode,
    },
    mission::{Command, State},
    navigator::{BoardMemory, BoardNavigator, Guidance, Navigator, Readings},
    slots::{Choice, Progress, Region, Setup, SlotError, Target, Writer},
};
use embedded_io::{Read, ReadReady, Write};

use crate::{
    autopilot::{Autopilot, MavSeverity, MavState, Step},
    board::{AtlasFlash, Lamp, Parts, System},
    camera::{Camera, CameraError, FrameSize, Limits, Supervised},
    desk::{Access, Desk, Due, Wish},
    faults::FaultLog,
    storm::Storm,
    time::ms,
};

/// Bytes that are taken from a wire in one turn, at most.
const BYTES_PER_TURN: usize = 1024;

/// Steps longer than this are told as this, in seconds: nothing was known for so long.
const LONGEST_STEP_S: f32 = 5.0;

/// All that flies. Large parts are lent to it.
#[derive(Debug)]
pub struct Flight<'a, C, H, A, F, S> {
    parts: Parts<Supervised<C>, H, A, F, S>,
    navigator: Option<BoardNavigator<'a>>,
    pixels: &'a mut [u8; MAX_FRAME_LEN],
    setup: Setup,
    slots: [SlotState; 2],
    target: Result<Target, SlotError>,
    writer: Writer,
    faults: FaultLog<'a>,
    autopilot: Autopilot,
    autopilot_storm: Storm,
    receiver: Receiver<MAX_REQUEST_LEN>,
    host_storm: Storm,
    desk: Desk,
    frames: u32,
    /// When the last step was taken: by the camera's clock, and by ours.
    taken_us: Option<u64>,
    stepped_us: u64,
    has_seen: bool,
    /// How much has been said of what went wrong before the start.
    said: u8,
}

impl<'a, C, H, A, F, S> Flight<'a, C, H, A, F, S>
where
    C: Camera,
    H: Read + ReadReady + Write,
    A: Read + ReadReady + Write,
    F: AtlasFlash,
    S: System,
{
    /// Begins with what the slots hold. The writer is for the same slots.
    pub fn new(
        parts: Parts<C, H, A, F, S>,
        region: &Region<'a>,
        writer: Writer,
        memory: &'a mut BoardMemory,
        pixels: &'a mut [u8; MAX_FRAME_LEN],
        faults: FaultLog<'a>,
    ) -> Self {
        let choice = region.choose();
        let flown = choice.as_ref().map(|choice| choice.slot);
        let setup = choice
            .as_ref()
            .map(|choice| choice.setup)
            .unwrap_or_default();
        let navigator =
            choice.map(|Choice { atlas, .. }: Choice<'a>| Navigator::new(atlas, memory));
        Self {
            parts: Parts {
                camera: Supervised::new(parts.camera, Limits::default()),
                host: parts.host,
                autopilot: parts.autopilot,
                flash: parts.flash,
                system: parts.system,
            },
            navigator,
            pixels,
            setup,
            slots: region.states(flown),
            target: region.target(flown),
            writer,
            faults,
            autopilot: Autopilot::new(),
            autopilot_storm: Storm::default(),
            receiver: Receiver::new(),
            host_storm: Storm::default(),
            desk: Desk::default(),
            frames: 0,
            taken_us: None,
            stepped_us: 0,
            has_seen: false,
            said: 0,
        }
    }

    /// For ever.
    pub fn fly(mut self) -> ! {
        loop {
            if !self.turn() {
                self.parts.system.rest();
            }
        }
    }

    /// One turn. Says whether anything had to be done.
    pub fn turn(&mut self) -> bool {
        self.parts.system.feed();
        let now_us = self.parts.system.now_us();
        let is_busy = [
            self.listen_to_host(now_us),
            self.listen_to_autopilot(now_us),
            self.erase(),
            self.look(now_us),
        ];
        self.beat(now_us);
        is_busy.contains(&true)
    }

    /// What flies by now.
    #[must_use]
    pub fn atlas(&self) -> Option<&Atlas<'a>> {
        self.navigator.as_ref().map(Navigator::atlas)
    }

    fn listen_to_host(&mut self, now_us: u64) -> bool {
        let mut bytes = [0; 64];
        for turn in 0..BYTES_PER_TURN / bytes.len() {
            let len = received(&mut self.parts.host, &mut bytes);
            let Some(bytes) = bytes.get(..len).filter(|bytes| !bytes.is_empty()) else {
                return turn > 0;
            };
            if self.host_storm.is_ignored(now_us) {
                continue;
            }
            for &byte in bytes {
                self.hear(byte, now_us);
            }
        }
        true
    }

    /// Takes a byte from the host, and answers the request that it ends.
    fn hear(&mut self, byte: u8, now_us: u64) {
        let (reply, wish) = match self.receiver.push::<Request<'_>>(byte) {
            None => return,
            Some(Ok(request)) => {
                self.host_storm.message();
                let mut access = Access {
                    navigator: self.navigator.as_mut(),
                    pixels: self.pixels,
                    setup: self.setup,
                    slots: &mut self.slots,
                    target: &mut self.target,
                    writer: &mut self.writer,
                    flash: &mut self.parts.flash,
                    faults: &mut self.faults,
                };
                self.desk.answer(request, &mut access, now_us)
            }
            Some(Err(damage)) => {
                if self.host_storm.damage(now_us) {
                    self.note_storm("host link floods, ignored for 1 s");
                }
                (Some(damaged(damage)), None)
            }
        };
        if let Some(reply) = reply {
            self.reply(&reply);
        }
        match wish {
            None => {}
            Some(Wish::Restart) => {
                // Whoever asked is to hear that.
                let _ = self.parts.host.flush();
                self.parts.system.restart();
            }
            Some(Wish::Provoke(what)) => {
                let reply = match self.parts.system.provoke(what) {
                    Ok(()) => Reply::Done,
                    Err(_) => Reply::Rejected {
                        sequence: None,
                        reason: Rejection::Refused,
                    },
                };
                send(&mut self.parts.host, &reply);
            }
        }
    }

    fn listen_to_autopilot(&mut self, now_us: u64) -> bool {
        let mut bytes = [0; 64];
        let now_ms = ms(now_us);
        for turn in 0..BYTES_PER_TURN / bytes.len() {
            let len = received(&mut self.parts.autopilot, &mut bytes);
            let Some(bytes) = bytes.get(..len).filter(|bytes| !bytes.is_empty()) else {
                return turn > 0;
            };
            if self.autopilot_storm.is_ignored(now_us) {
                continue;
            }
            let (damaged, messages) = (self.autopilot.damaged(), self.autopilot.messages());
            for &byte in bytes {
                self.autopilot.receive(byte, now_ms);
            }
            for _ in messages..self.autopilot.messages() {
                self.autopilot_storm.message();
            }
            for _ in damaged..self.autopilot.damaged() {
                if self.autopilot_storm.damage(now_us) {
                    self.note_storm("autopilot link floods, ignored 1 s");
                }
            }
        }
        true
    }

    fn note_storm(&mut self, words: &str) {
        self.faults.count(|faults| &mut faults.link_storms);
        self.say(MavSeverity::MAV_SEVERITY_WARNING, words);
    }

    /// Erases a page for a new atlas, if there is one to be erased.
    fn erase(&mut self) -> bool {
        if self.writer.progress() != Ok(Progress::Erasing) {
            return false;
        }
        let reply = match self.writer.step(&mut self.parts.flash) {
            Ok(Progress::Erasing) => return true,
            Ok(Progress::Writing { next }) => Reply::Upload { next },
            Err(error) => Reply::Rejected {
                sequence: None,
                reason: Rejection::Slot(error),
            },
        };
        self.reply(&reply);
        true
    }

    /// Answers the host. That a page of flash is worn is noted, and told to the autopilot, too.
    fn reply(&mut self, reply: &Reply) {
        if let Reply::Rejected {
            reason: Rejection::Slot(SlotError::Worn { .. }),
            ..
        } = reply
        {
            self.faults.count(|faults| &mut faults.worn_pages);
            self.say(MavSeverity::MAV_SEVERITY_WARNING, "a flash page is worn");
        }
        send(&mut self.parts.host, reply);
    }

    /// Looks whether the camera has something, and takes a step with it.
    fn look(&mut self, now_us: u64) -> bool {
        if self.desk.is_shown(now_us) {
            return false;
        }
        let losses = self.parts.camera.losses();
        let Some(result) = self.parts.camera.poll(now_us, self.pixels.as_mut_slice()) else {
            return false;
        };
        if self.parts.camera.losses() != losses {
            self.faults.count(|faults| &mut faults.camera_losses);
            self.say(MavSeverity::MAV_SEVERITY_ERROR, "camera lost");
        }
        self.step(result, now_us);
        true
    }

    fn step(&mut self, result: Result<FrameSize, CameraError>, now_us: u64) {
        // The camera may have a clock of its own, which goes on as ours does while it gives nothing.
        let since_us = now_us.saturating_sub(self.stepped_us);
        let last_us = self.taken_us.unwrap_or(now_us);
        let told_us = result
            .ok()
            .and_then(|_| self.parts.camera.camera().taken_us());
        let taken_us = told_us
            .unwrap_or(last_us.saturating_add(since_us))
            .max(last_us);
        let since_us = taken_us.saturating_sub(last_us);
        (self.taken_us, self.stepped_us) = (Some(taken_us), now_us);
        let step_s = (since_us as f32 * 1e-6).min(LONGEST_STEP_S);
        let size = result.ok();
        let frame = size.and_then(|size| size.frame(self.pixels.as_slice()).ok());
        let (mut readings, mut guidance, mut footprint_px) = (Readings::default(), None, 0.0);
        self.has_seen |= frame.is_some();
        if let Some(navigator) = &mut self.navigator {
            footprint_px = navigator.atlas().header().footprint_px;
            readings = self
                .autopilot
                .readings(ms(now_us), &self.setup, footprint_px);
            // Before the first frame there is nothing to go on from.
            if self.has_seen {
                guidance = Some(navigator.advance(frame.as_ref(), &readings, step_s));
            }
        }
        let refusal = self.refusal(result.is_ok(), guidance.as_ref());
        let is_waiting = |navigator: &BoardNavigator<'_>| navigator.odometry().is_waiting();
        let step = Step {
            now_us: taken_us,
            step_s,
            guidance: guidance.as_ref(),
            refusal,
            is_waiting: frame.is_none() || self.navigator.as_ref().is_some_and(is_waiting),
            footprint_px,
            setup: self.setup,
        };
        let wire = &mut self.parts.autopilot;
        self.autopilot
            .report(&step, &mut |bytes| write(wire, bytes));
        self.parts
            .system
            .show(lamp(size.is_some(), guidance.as_ref()));
        let due = self.desk.due();
        if due != Due::Nothing {
            let took_us = self.parts.system.now_us().saturating_sub(now_us);
            let report = Report {
                sequence: self.frames,
                time_ms: ms(taken_us),
                step_s,
                took_us: took_us as u32,
                camera: result.map_or_else(CameraSays::from, |_| CameraSays::Frame),
                heading_rad: readings.heading_rad,
                tilt_rad: readings
                    .tilt
                    .map(|tilt| (tilt.roll_rad(), tilt.pitch_rad())),
                altitude_ratio: readings.altitude_ratio,
                estimate: guidance.and_then(|guidance| guidance.estimate),
                odometry_px: self.odometry_px(footprint_px),
                fix: guidance.and_then(|guidance| guidance.fix),
                refusal,
                state: guidance.map_or(State::Boot, |guidance| guidance.state),
                command: guidance.map_or(STAY, |guidance| guidance.command),
                damaged: self
                    .autopilot
                    .damaged()
                    .saturating_add(self.host_storm.damaged()),
            };
            send(&mut self.parts.host, &Reply::Report(report));
            if let Some(size) = size.filter(|_| due == Due::Picture) {
                self.send_picture(size);
            }
        }
        self.frames = self.frames.wrapping_add(1);
    }

    fn odometry_px(&self, footprint_px: f32) -> [f32; 2] {
        self.navigator.as_ref().map_or([0.0; 2], |navigator| {
            let placement = navigator.odometry().placement();
            [placement.x * footprint_px, placement.y * footprint_px]
        })
    }

    fn refusal(&self, has_frame: bool, guidance: Option<&Guidance>) -> Option<Refusal> {
        let Some(navigator) = &self.navigator else {
            return Some(Refusal::NoAtlas);
        };
        match guidance.and_then(|guidance| guidance.fix) {
            _ if !has_frame => Some(Refusal::NoFrame),
            None if !navigator.coverage().is_half() => Some(Refusal::Outside),
            None => Some(Refusal::Flat),
            Some(fix) if !fix.known => Some(Refusal::Unknown),
            Some(_) => None,
        }
    }

    /// The frame of the last report. The wire is given all of it, so the next frame waits for that.
    fn send_picture(&mut self, size: FrameSize) {
        let pixels = self.pixels.get(..size.len()).unwrap_or_default();
        for (part, offset) in pixels
            .chunks(PICTURE_PART_LEN)
            .zip((0..).step_by(PICTURE_PART_LEN))
        {
            self.parts.system.feed();
            let picture = Reply::Picture {
                sequence: self.frames,
                width: size.width(),
                height: size.height(),
                offset,
                bytes: heapless::Vec::from_slice(part).unwrap_or_default(),
            };
            send(&mut self.parts.host, &picture);
        }
    }

    /// A sign of life; after the first ones, what went wrong before the start.
    fn beat(&mut self, now_us: u64) {
        let state = if self.navigator.is_none() || self.parts.camera.is_lost() {
            MavState::MAV_STATE_CRITICAL
        } else if self.frames == 0 {
            MavState::MAV_STATE_STANDBY
        } else {
            MavState::MAV_STATE_ACTIVE
        };
        let wire = &mut self.parts.autopilot;
        if !self
            .autopilot
            .beat(ms(now_us), state, &mut |bytes| write(wire, bytes))
        {
            return;
        }
        if let Some(words) = crate::faults::words(self.faults.faults(), self.said) {
            self.say(MavSeverity::MAV_SEVERITY_ERROR, words);
        }
        self.said = self.said.saturating_add(1);
    }

    fn say(&mut self, severity: MavSeverity, words: &str) {
        let wire = &mut self.parts.autopilot;
        self.autopilot
            .say(severity, words, &mut |bytes| write(wire, bytes));
    }
}

/// A command to stay.
const STAY: Command = Command {
    heading_rad: 0.0,
    speed: 0.0,
};

fn lamp(has_frame: bool, guidance: Option<&Guidance>) -> Lamp {
    match guidance.and_then(|guidance| guidance.estimate) {
        _ if !has_frame => Lamp::Unfit,
        None => Lamp::Unfit,
        Some(estimate) if estimate.is_confident() => Lamp::Confident,
        Some(_) => Lamp::Searching,
    }
}

fn damaged(damage: Damage) -> Reply {
    Reply::Rejected {
        sequence: None,
        reason: Rejection::Damaged(damage),
    }
}

/// What has arrived on a wire, up to the buffer's length.
fn received(wire: &mut (impl Read + ReadReady), bytes: &mut [u8]) -> usize {
    match wire.read_ready() {
        Ok(true) => wire.read(bytes).unwrap_or(0),
        _ => 0,
    }
}

fn send(wire: &mut impl Write, reply: &Reply) {
    let (mut scratch, mut packet) = ([0; MAX_REPLY_LEN], [0; MAX_REPLY_LEN]);
    // Every reply fits: tests have the largest.
    if let Ok(packet) = encode(reply, &mut scratch, &mut packet) {
        write(wire, packet);
    }
}

/// A wire that fails loses what it was given: the other side notices, and asks again.
fn write(wire: &mut impl Write, bytes: &[u8]) {
    let mut rest = bytes;
    while !rest.is_empty() {
        match wire.write(rest) {
            Ok(len @ 1..) => rest = rest.get(len..).unwrap_or_default(),
            _ => return,
        }
    }
}
