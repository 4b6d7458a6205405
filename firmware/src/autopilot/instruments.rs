//! Messages of the autopilot → what its instruments say.

use eigenmark_core::{
    math::{sin_cos, wrapped},
    navigator::Readings,
    preprocess::{MAX_ALTITUDE_RATIO, MIN_ALTITUDE_RATIO, Pose},
    slots::Setup,
};
use mavlink::{
    MessageData,
    dialects::common::{
        ALTITUDE_DATA, ATTITUDE_DATA, DISTANCE_SENSOR_DATA, GLOBAL_POSITION_INT_DATA,
        HEARTBEAT_DATA, MavAutopilot, MavComponent, MavModeFlag, MavSensorOrientation, MavType,
    },
};

use super::framer::{Header, Message};

/// An autopilot whose last heartbeat is older is absent. Three are expected meanwhile.
const ABSENT_AFTER_MS: u32 = 3000;

/// What is older says nothing about a frame.
const ATTITUDE_FOR_MS: u32 = 500;
const ALTITUDE_FOR_MS: u32 = 1000;

/// Altitudes in meters that are believed.
const ALTITUDES_M: core::ops::RangeInclusive<f32> = 0.05..=20_000.0;

/// The component that flies.
const AUTOPILOT: u8 = MavComponent::MAV_COMP_ID_AUTOPILOT1 as u8;

/// Roll, pitch and yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Attitude {
    /// Right side down, in radians.
    pub roll_rad: f32,
    /// Nose up, in radians.
    pub pitch_rad: f32,
    /// Clockwise from north, in radians.
    pub yaw_rad: f32,
}

/// Where an altitude comes from, the best last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Source {
    /// Above where the vehicle started, of GLOBAL_POSITION_INT.
    Position,
    /// The same, of ALTITUDE.
    Relative,
    /// Above the ground, of ALTITUDE.
    Terrain,
    /// Measured downward.
    Rangefinder,
}

/// An altitude above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Altitude {
    pub meters: f32,
    pub source: Source,
    /// When it was told.
    pub at_ms: u32,
}

/// What was told when readings were last taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    pub attitude: Option<Attitude>,
    pub altitude: Option<Altitude>,
    /// When they were taken.
    pub at_ms: u32,
}

/// The autopilot, as far as it was heard.
#[derive(Clone, Debug)]
pub(super) struct Instruments {
    /// Its system, known from its first heartbeat on.
    system: Option<u8>,
    /// When the last heartbeat came, while it is present.
    beat_ms: Option<u32>,
    is_armed: bool,
    /// The sequence number that comes next.
    next: Option<u8>,
    messages: u32,
    lost: u32,
    attitude: Option<(Attitude, u32)>,
    altitude: Option<Altitude>,
}

impl Instruments {
    pub const fn new() -> Self {
        Self {
            system: None,
            beat_ms: None,
            is_armed: false,
            next: None,
            messages: 0,
            lost: 0,
            attitude: None,
            altitude: None,
        }
    }

    pub fn system(&self) -> Option<u8> {
        self.system
    }

    /// Messages that were taken.
    pub fn messages(&self) -> u32 {
        self.messages
    }

    /// Messages that sequence numbers say are missing.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    pub fn is_present(&self, now_ms: u32) -> bool {
        self.beat_ms
            .is_some_and(|at_ms| now_ms.wrapping_sub(at_ms) <= ABSENT_AFTER_MS)
    }

    pub fn is_armed(&self, now_ms: u32) -> bool {
        self.is_armed && self.is_present(now_ms)
    }

    /// Forgets what is too old: later, times would come round again.
    pub fn forget(&mut self, now_ms: u32) {
        if !self.is_present(now_ms) {
            self.beat_ms = None;
        }
        self.attitude = self
            .attitude
            .filter(|&(_, at_ms)| now_ms.wrapping_sub(at_ms) <= ATTITUDE_FOR_MS);
        self.altitude = self
            .altitude
            .filter(|altitude| now_ms.wrapping_sub(altitude.at_ms) <= ALTITUDE_FOR_MS);
    }

    /// What is told now.
    pub fn told(&mut self, now_ms: u32) -> Told {
        self.forget(now_ms);
        Told {
            attitude: self.attitude.map(|(attitude, _)| attitude),
            altitude: self.altitude,
            at_ms: now_ms,
        }
    }

    /// Takes note of a message that is not wanted.
    pub fn pass(&mut self, header: &Header) {
        // Its header is not checked: only what is expected is believed.
        if self.is_autopilot(header) && self.next == Some(header.sequence) {
            self.next = Some(header.sequence.wrapping_add(1));
        }
    }

    /// Takes in a wanted message, and says whether it is of use.
    pub fn take(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        self.forget(now_ms);
        let header = &message.header;
        if header.id == HEARTBEAT_DATA::ID {
            self.meet(message, now_ms);
        }
        if !self.is_autopilot(header) {
            return false;
        }
        if let Some(next) = self.next {
            let missing = header.sequence.wrapping_sub(next);
            self.lost = self.lost.saturating_add(missing.into());
        }
        self.next = Some(header.sequence.wrapping_add(1));
        self.messages = self.messages.saturating_add(1);
        match header.id {
            HEARTBEAT_DATA::ID => self.beat(message, now_ms),
            ATTITUDE_DATA::ID => self.turn(message, now_ms),
            DISTANCE_SENSOR_DATA::ID => self.range(message, now_ms),
            ALTITUDE_DATA::ID => self.rise(message, now_ms),
            GLOBAL_POSITION_INT_DATA::ID => self.place(message, now_ms),
            _ => false,
        }
    }

    fn is_autopilot(&self, header: &Header) -> bool {
        self.system == Some(header.system) && header.component == AUTOPILOT
    }

    /// The first autopilot that is heard is ours, until it is absent and another one is heard.
    fn meet(&mut self, message: &Message<'_>, now_ms: u32) {
        let header = &message.header;
        let is_free = self.system != Some(header.system) && !self.is_present(now_ms);
        if is_free && header.component == AUTOPILOT && heartbeat(message).is_some() {
            let (messages, lost) = (self.messages, self.lost);
            *self = Self {
                system: Some(header.system),
                messages,
                lost,
                ..Self::new()
            };
        }
    }

    fn beat(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        let is_armed = heartbeat(message);
        if let Some(is_armed) = is_armed {
            self.is_armed = is_armed;
            self.beat_ms = Some(now_ms);
        }
        is_armed.is_some()
    }

    fn turn(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        let Some(told) = decoded::<ATTITUDE_DATA>(message) else {
            return false;
        };
        // What is beyond a turn is an error, not an angle.
        let angles = -core::f32::consts::TAU..=core::f32::consts::TAU;
        let is_usable = [told.roll, told.pitch, told.yaw]
            .iter()
            .all(|angle| angles.contains(angle));
        if is_usable {
            let attitude = Attitude {
                roll_rad: told.roll,
                pitch_rad: told.pitch,
                yaw_rad: told.yaw,
            };
            self.attitude = Some((attitude, now_ms));
        }
        is_usable
    }

    fn range(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        let Some(told) = decoded::<DISTANCE_SENSOR_DATA>(message) else {
            return false;
        };
        let is_downward = told.orientation == MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270;
        let is_in_range =
            told.current_distance > told.min_distance && told.current_distance < told.max_distance;
        // 0 is an unknown quality, 1 an invalid measurement.
        is_downward
            && is_in_range
            && told.signal_quality != 1
            && self.climb(
                f32::from(told.current_distance) * 0.01,
                Source::Rangefinder,
                now_ms,
            )
    }

    fn rise(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        decoded::<ALTITUDE_DATA>(message).is_some_and(|told| {
            self.climb(told.altitude_terrain, Source::Terrain, now_ms)
                || self.climb(told.altitude_relative, Source::Relative, now_ms)
        })
    }

    fn place(&mut self, message: &Message<'_>, now_ms: u32) -> bool {
        decoded::<GLOBAL_POSITION_INT_DATA>(message).is_some_and(|told| {
            self.climb(told.relative_alt as f32 * 0.001, Source::Position, now_ms)
        })
    }

    /// Takes an altitude that is in range, unless a better one is known, and says whether it is in range.
    fn climb(&mut self, meters: f32, source: Source, now_ms: u32) -> bool {
        // NaN is in no range.
        let is_usable = ALTITUDES_M.contains(&meters);
        if is_usable && self.altitude.is_none_or(|known| known.source <= source) {
            self.altitude = Some(Altitude {
                meters,
                source,
                at_ms: now_ms,
            });
        }
        is_usable
    }
}

impl Told {
    pub const NOTHING: Self = Self {
        attitude: None,
        altitude: None,
        at_ms: 0,
    };

    /// As a navigator takes them, for a camera whose frames show squares of that side in pixels of the map.
    pub fn readings(&self, setup: &Setup, footprint_px: f32) -> Readings {
        let tilt = self.attitude.and_then(|attitude| {
            let pose = Pose::NOMINAL.tilted(
                attitude.roll_rad,
                attitude.pitch_rad,
                setup.field_of_view_rad,
            );
            pose.ok()?.tilt()
        });
        let nominal_m = nominal_altitude_m(setup, footprint_px);
        let ratios = MIN_ALTITUDE_RATIO..=MAX_ALTITUDE_RATIO;
        Readings {
            heading_rad: self.attitude.map(|attitude| wrapped(attitude.yaw_rad)),
            tilt,
            altitude_ratio: self
                .altitude
                .map(|altitude| altitude.meters / nominal_m)
                .filter(|ratio| ratios.contains(ratio)),
        }
    }
}

/// Altitude in meters at which the frame's square covers a side in pixels of the map. NaN of a setup without sense.
pub(super) fn nominal_altitude_m(setup: &Setup, footprint_px: f32) -> f32 {
    let (sin, cos) = sin_cos(setup.field_of_view_rad / 2.0);
    if setup.is_valid() && footprint_px > 0.0 && footprint_px.is_finite() {
        footprint_px * setup.meters_per_px * cos / (2.0 * sin)
    } else {
        f32::NAN
    }
}

/// Whether an autopilot's heartbeat says that it is armed; `None` when it is not an autopilot's. Read by hand: mavlink
/// refuses a vehicle of a type that it does not know.
fn heartbeat(message: &Message<'_>) -> Option<bool> {
    let [_, _, _, _, kind, autopilot, mode, ..] = *message.payload else {
        return None;
    };
    let is_autopilot = kind != MavType::MAV_TYPE_GCS as u8
        && autopilot != MavAutopilot::MAV_AUTOPILOT_INVALID as u8;
    let armed = MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED.bits();
    is_autopilot.then_some(mode & armed != 0)
}

/// `None` when a field has a value that does not exist.
fn decoded<M: MessageData>(message: &Message<'_>) -> Option<M> {
    M::deser(message.header.version, message.payload).ok()
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use mavlink::{MavlinkVersion, dialects::common::VFR_HUD_DATA};

    use super::*;
    use crate::autopilot::{
        Autopilot,
        framer::tests::{signed, written},
    };

    /// 100 px of 0.5 m at 90°: a nominal altitude of 25 m.
    const FOOTPRINT_PX: f32 = 100.0;
    const SETUP: Setup = Setup {
        meters_per_px: 0.5,
        field_of_view_rad: core::f32::consts::FRAC_PI_2,
    };

    const BEAT: HEARTBEAT_DATA = HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_AIRSHIP,
        base_mode: MavModeFlag::empty(),
        ..HEARTBEAT_DATA::DEFAULT
    };

    const ATTITUDE: ATTITUDE_DATA = ATTITUDE_DATA {
        roll: 0.1,
        pitch: -0.2,
        yaw: 1.5,
        ..ATTITUDE_DATA::DEFAULT
    };

    fn hear(autopilot: &mut Autopilot, bytes: &[u8], now_ms: u32) {
        for &byte in bytes {
            autopilot.receive(byte, now_ms);
        }
    }

    /// Tells a message as the autopilot of system 7, all with the same number.
    fn tell<M: MessageData>(autopilot: &mut Autopilot, message: &M, now_ms: u32) {
        let bytes = written(MavlinkVersion::V2, (7, 1), 0, message);
        hear(autopilot, &bytes, now_ms);
    }

    fn met() -> Autopilot {
        let mut autopilot = Autopilot::new();
        tell(&mut autopilot, &BEAT, 0);
        autopilot
    }

    fn ratio(autopilot: &mut Autopilot, now_ms: u32) -> Option<f32> {
        let readings = autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
        // Rounded: the tangent is off in its last bit.
        readings
            .altitude_ratio
            .map(|ratio| (ratio * 1024.0).round() / 1024.0)
    }

    fn relative(meters: f32) -> ALTITUDE_DATA {
        ALTITUDE_DATA {
            altitude_terrain: f32::NAN,
            altitude_relative: meters,
            ..ALTITUDE_DATA::DEFAULT
        }
    }

    fn range(centimeters: u16) -> DISTANCE_SENSOR_DATA {
        DISTANCE_SENSOR_DATA {
            min_distance: 20,
            max_distance: 4000,
            current_distance: centimeters,
            orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270,
            ..DISTANCE_SENSOR_DATA::DEFAULT
        }
    }

    #[test]
    fn an_autopilot_is_known_by_its_heartbeat_and_missed_after_three_seconds() {
        let mut autopilot = Autopilot::new();
        let others = [
            ((7, 2), BEAT),
            (
                (255, 1),
                HEARTBEAT_DATA {
                    mavtype: MavType::MAV_TYPE_GCS,
                    ..BEAT
                },
            ),
            (
                (7, 1),
                HEARTBEAT_DATA {
                    autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
                    ..BEAT
                },
            ),
        ];
        for (from, beat) in others {
            hear(
                &mut autopilot,
                &written(MavlinkVersion::V2, from, 0, &beat),
                0,
            );
            assert_eq!(
                (autopilot.system(), autopilot.is_connected(0)),
                (None, false)
            );
        }
        tell(&mut autopilot, &BEAT, 1000);
        assert_eq!(autopilot.system(), Some(7));
        assert!(autopilot.is_connected(4000) && !autopilot.is_armed(4000));
        assert!(!autopilot.is_connected(4001));
        let armed = HEARTBEAT_DATA {
            base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
            ..BEAT
        };
        tell(&mut autopilot, &armed, 5000);
        assert!(autopilot.is_armed(5000) && !autopilot.is_armed(9000));
    }

    #[test]
    fn a_vehicle_of_an_unknown_type_is_known_all_the_same() {
        let mut bytes = written(MavlinkVersion::V2, (7, 1), 0, &BEAT);
        bytes[10 + 4] = 250;
        let end = bytes.len() - 2;
        let checksum = mavlink::calculate_crc(&bytes[1..end], HEARTBEAT_DATA::EXTRA_CRC);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
        let mut autopilot = Autopilot::new();
        hear(&mut autopilot, &bytes, 0);
        assert_eq!(autopilot.system(), Some(7));
    }

    #[test]
    fn another_autopilot_is_listened_to_only_when_the_first_is_absent() {
        let mut autopilot = met();
        let other = written(MavlinkVersion::V2, (8, 1), 0, &BEAT);
        let attitude = written(MavlinkVersion::V2, (8, 1), 1, &ATTITUDE);
        for (now_ms, system) in [(3000, 7), (3001, 8)] {
            hear(&mut autopilot, &other, now_ms);
            hear(&mut autopilot, &attitude, now_ms);
            assert_eq!(autopilot.system(), Some(system));
            let readings = autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
            assert_eq!(readings.heading_rad.is_some(), system == 8);
        }
    }

    #[test]
    fn attitudes_become_headings_and_tilts_with_the_same_signs() {
        let mut autopilot = met();
        let bytes = written(MavlinkVersion::V2, (7, 1), 1, &ATTITUDE);
        hear(
            &mut autopilot,
            &signed(bytes, ATTITUDE_DATA::EXTRA_CRC),
            100,
        );
        let readings = autopilot.readings(600, &SETUP, FOOTPRINT_PX);
        assert_eq!(readings.heading_rad, Some(1.5));
        let tilt = readings.tilt.expect("was told");
        let found = (tilt.roll_rad(), tilt.pitch_rad(), tilt.field_of_view_rad());
        assert_eq!(found, (0.1, -0.2, SETUP.field_of_view_rad));
        assert_eq!(
            autopilot.readings(601, &SETUP, FOOTPRINT_PX),
            Readings::default()
        );
        // What is forgotten does not come back when times come round.
        let readings = autopilot.readings(200, &SETUP, FOOTPRINT_PX);
        assert_eq!(readings, Readings::default());
    }

    #[test]
    fn attitudes_that_are_none_are_ignored() {
        let mut autopilot = met();
        for (roll, pitch, yaw) in [
            (f32::NAN, 0.0, 0.0),
            (0.0, f32::INFINITY, 0.0),
            (0.0, 0.0, 7.0),
        ] {
            let attitude = ATTITUDE_DATA {
                roll,
                pitch,
                yaw,
                ..ATTITUDE_DATA::DEFAULT
            };
            tell(&mut autopilot, &attitude, 0);
            let readings = autopilot.readings(0, &SETUP, FOOTPRINT_PX);
            assert_eq!(readings, Readings::default());
        }
        // Upside down is an attitude, but no tilt that a camera can be levelled by.
        let attitude = ATTITUDE_DATA {
            roll: 3.0,
            ..ATTITUDE
        };
        tell(&mut autopilot, &attitude, 0);
        let readings = autopilot.readings(0, &SETUP, FOOTPRINT_PX);
        assert_eq!((readings.heading_rad, readings.tilt), (Some(1.5), None));
    }

    #[test]
    fn the_best_altitude_counts_as_long_as_it_is_told() {
        let mut autopilot = met();
        let position = GLOBAL_POSITION_INT_DATA {
            relative_alt: 12_500,
            ..GLOBAL_POSITION_INT_DATA::DEFAULT
        };
        tell(&mut autopilot, &position, 0);
        assert_eq!(ratio(&mut autopilot, 0), Some(0.5));
        tell(&mut autopilot, &relative(25.0), 10);
        tell(&mut autopilot, &position, 20);
        assert_eq!(ratio(&mut autopilot, 20), Some(1.0));
        let terrain = ALTITUDE_DATA {
            altitude_terrain: 50.0,
            ..relative(25.0)
        };
        tell(&mut autopilot, &terrain, 30);
        assert_eq!(ratio(&mut autopilot, 30), Some(2.0));
        tell(&mut autopilot, &range(3750), 40);
        tell(&mut autopilot, &terrain, 50);
        assert_eq!(ratio(&mut autopilot, 1040), Some(1.5));
        // Nothing was told for a second; a worse one is better than none.
        assert_eq!(ratio(&mut autopilot, 1041), None);
        tell(&mut autopilot, &position, 1041);
        assert_eq!(ratio(&mut autopilot, 1041), Some(0.5));
    }

    #[test]
    fn altitudes_that_are_none_are_ignored() {
        let mut autopilot = met();
        let forward = DISTANCE_SENSOR_DATA {
            orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_NONE,
            ..range(1000)
        };
        let invalid = DISTANCE_SENSOR_DATA {
            signal_quality: 1,
            ..range(1000)
        };
        for told in [range(20), range(4000), range(0), forward, invalid] {
            tell(&mut autopilot, &told, 0);
            assert_eq!(ratio(&mut autopilot, 0), None);
        }
        for meters in [f32::NAN, -3.0, 0.0, f32::INFINITY, 1e6] {
            tell(&mut autopilot, &relative(meters), 0);
            assert_eq!(ratio(&mut autopilot, 0), None);
        }
        // In range, but not of a view: 4 times the nominal altitude is the most.
        tell(&mut autopilot, &relative(101.0), 0);
        assert_eq!(ratio(&mut autopilot, 0), None);
        let nonsense = Setup {
            meters_per_px: 0.0,
            ..SETUP
        };
        tell(&mut autopilot, &relative(25.0), 0);
        let readings = autopilot.readings(0, &nonsense, FOOTPRINT_PX);
        assert_eq!(readings.altitude_ratio, None);
    }

    #[test]
    fn sequence_numbers_say_what_is_lost() {
        let mut autopilot = Autopilot::new();
        let hud = VFR_HUD_DATA::DEFAULT;
        let mut stream = Vec::new();
        for sequence in [254, 255, 0, 2, 3, 7] {
            stream.extend(if sequence % 2 == 0 {
                written(MavlinkVersion::V2, (7, 1), sequence, &BEAT)
            } else {
                written(MavlinkVersion::V2, (7, 1), sequence, &hud)
            });
            // Others count for themselves.
            stream.extend(written(MavlinkVersion::V1, (7, 100), sequence, &BEAT));
        }
        stream.extend(written(MavlinkVersion::V2, (7, 1), 8, &BEAT));
        hear(&mut autopilot, &stream, 0);
        // 1, 4, 5 and 6, and 7, which is not checked and not what was expected.
        assert_eq!((autopilot.lost(), autopilot.messages()), (5, 4));
        assert_eq!(autopilot.damaged(), 0);
    }
}
