use core::f32::consts::{FRAC_PI_2, PI};
use std::{string::String, vec::Vec};

use eigenmark_core::{
    belief::Estimate,
    landmark::Point,
    mission::{Command, State},
    track::{Covariance, Displacement},
};
use mavlink::{
    MavlinkVersion, MessageData,
    dialects::common::{
        ATTITUDE_DATA, DISTANCE_SENSOR_DATA, MavFrame, MavSensorOrientation, ODOMETRY_DATA,
        OPTICAL_FLOW_RAD_DATA,
    },
};

use super::{framer::tests::written, *};

/// 100 px of 0.5 m at 90°: a side is 50 m, the nominal altitude 25 m.
pub(super) const FOOTPRINT_PX: f32 = 100.0;
pub(super) const SETUP: Setup = Setup {
    meters_per_px: 0.5,
    field_of_view_rad: FRAC_PI_2,
};

pub(super) fn moved(forward: f32, right: f32, yaw_rad: f32) -> Displacement {
    Displacement {
        forward,
        right,
        yaw_rad,
        scale: 1.0,
        covariance: Covariance::from_diagonal_element(1e-6),
        tracked: 20,
        inliers: 15,
    }
}

pub(super) fn guided(displacement: Option<Displacement>, estimate: Option<Estimate>) -> Guidance {
    Guidance {
        command: Command {
            heading_rad: 0.0,
            speed: 0.0,
        },
        state: State::Localizing,
        leg: None,
        estimate,
        fix: None,
        displacement,
    }
}

pub(super) fn at(x_px: f32, y_px: f32, heading_rad: f32) -> Estimate {
    Estimate {
        position: Point { x_px, y_px },
        covariance_px2: [16.0, 4.0, 36.0],
        heading_rad,
        confidence: 1.0,
    }
}

pub(super) fn step<'a>(guidance: Option<&'a Guidance>, now_us: u64) -> Step<'a> {
    Step {
        now_us,
        step_s: 1.0 / 32.0,
        guidance,
        refusal: None,
        is_waiting: false,
        footprint_px: FOOTPRINT_PX,
        setup: SETUP,
    }
}

/// Tells a message as the autopilot of system 7.
pub(super) fn tell<M: MessageData>(autopilot: &mut Autopilot, message: &M, now_ms: u32) {
    for byte in written(MavlinkVersion::V2, (7, 1), 0, message) {
        autopilot.receive(byte, now_ms);
    }
}

pub(super) fn tell_attitude(autopilot: &mut Autopilot, angles_rad: [f32; 3], now_ms: u32) {
    let heartbeat = HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_AIRSHIP,
        ..HEARTBEAT_DATA::DEFAULT
    };
    tell(autopilot, &heartbeat, now_ms);
    let [roll, pitch, yaw] = angles_rad;
    let attitude = ATTITUDE_DATA {
        roll,
        pitch,
        yaw,
        ..ATTITUDE_DATA::DEFAULT
    };
    tell(autopilot, &attitude, now_ms);
    autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
}

pub(super) fn tell_altitude(autopilot: &mut Autopilot, meters: u16, now_ms: u32) {
    let range = DISTANCE_SENSOR_DATA {
        max_distance: u16::MAX,
        current_distance: meters * 100,
        orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270,
        ..DISTANCE_SENSOR_DATA::DEFAULT
    };
    tell(autopilot, &range, now_ms);
    autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
}

/// Of a message of ours, its identity and its payload.
fn taken_apart(bytes: &[u8]) -> (u32, Vec<u8>) {
    let id = u32::from_le_bytes([bytes[7], bytes[8], bytes[9], 0]);
    (id, bytes[10..bytes.len() - 2].to_vec())
}

fn decoded<M: MessageData>(sent: &[(u32, Vec<u8>)]) -> Option<M> {
    let (_, payload) = sent.iter().find(|(id, _)| *id == M::ID)?;
    Some(M::deser(MavlinkVersion::V2, payload).expect("is ours"))
}

fn reported(
    autopilot: &mut Autopilot,
    step: &Step<'_>,
) -> (ODOMETRY_DATA, Option<OPTICAL_FLOW_RAD_DATA>) {
    let mut sent = Vec::new();
    autopilot.report(step, &mut |bytes| sent.push(taken_apart(bytes)));
    (decoded(&sent).expect("for every step"), decoded(&sent))
}

fn assert_near(found: &[f32], expected: &[f32]) {
    let is_near = found.len() == expected.len()
        && found
            .iter()
            .zip(expected)
            .all(|(found, expected)| (found - expected).abs() < 1e-4);
    assert!(is_near, "{found:?} instead of {expected:?}");
}

#[test]
fn without_an_atlas_everything_is_unknown_and_failed() {
    let mut autopilot = Autopilot::new();
    let (odometry, flow) = reported(&mut autopilot, &step(None, 0));
    let unknown = [
        [odometry.x, odometry.y, odometry.z],
        [odometry.vx, odometry.vy, odometry.vz],
        [odometry.rollspeed, odometry.pitchspeed, odometry.yawspeed],
    ];
    assert!(unknown.as_flattened().iter().all(|part| part.is_nan()));
    assert!(odometry.q.iter().all(|part| part.is_nan()));
    assert!(odometry.pose_covariance[0].is_nan() && odometry.velocity_covariance[0].is_nan());
    assert_eq!((odometry.quality, odometry.reset_counter), (-1, 0));
    assert_eq!(flow, None);
}

#[test]
fn before_a_fix_the_place_is_relative_and_little_is_known_of_it() {
    let mut autopilot = Autopilot::new();
    let unsure = Estimate {
        confidence: 0.5,
        ..at(3.0, 4.0, 0.0)
    };
    let guidance = guided(Some(moved(0.1, 0.0, 0.0)), Some(unsure));
    let (odometry, flow) = reported(&mut autopilot, &step(Some(&guidance), 7_000_000_000));
    assert_eq!(
        (odometry.x, odometry.y, odometry.reset_counter),
        (5.0, 0.0, 0)
    );
    assert!(odometry.z.is_nan() && odometry.vz.is_nan() && odometry.q[0].is_nan());
    assert!(odometry.pose_covariance[0] >= 1e6 && odometry.pose_covariance[11] >= 1e6);
    assert_near(&odometry.pose_covariance[20..], &[PI * PI]);
    assert_eq!(odometry.time_usec, 7_000_000_000);
    // Confidence ½ and 15 of 20 corners.
    assert_eq!(odometry.quality, 38);
    let flow = flow.expect("moved");
    assert_eq!(
        (flow.distance, flow.quality, flow.temperature),
        (-1.0, 191, 0)
    );
    assert!(flow.integrated_xgyro.is_nan() && flow.integrated_ygyro.is_nan());
}

#[test]
fn a_confident_estimate_gives_place_attitude_and_speed() {
    let mut autopilot = Autopilot::new();
    tell_attitude(&mut autopilot, [0.0; 3], 0);
    tell_altitude(&mut autopilot, 40, 0);
    // East, and 0.1 sides of 50 m per 1/32 s.
    let guidance = guided(
        Some(moved(0.1, 0.0, 0.0)),
        Some(at(200.0, 300.0, FRAC_PI_2)),
    );
    let (odometry, flow) = reported(&mut autopilot, &step(Some(&guidance), 0));
    assert_eq!([odometry.x, odometry.y, odometry.z], [-150.0, 100.0, -40.0]);
    let half = core::f32::consts::FRAC_1_SQRT_2;
    assert_near(&odometry.q, &[half, 0.0, 0.0, half]);
    assert_near(&[odometry.vx, odometry.vy, odometry.vz], &[160.0, 0.0, 0.0]);
    assert_eq!(odometry.yawspeed, 0.0);
    assert!(odometry.rollspeed.is_nan() && odometry.pitchspeed.is_nan());
    // North is rows, and up.
    let covariance = odometry.pose_covariance;
    assert_eq!(
        [covariance[0], covariance[1], covariance[6]],
        [9.0, -1.0, 4.0]
    );
    assert_near(&covariance[11..12], &[0.72 * 0.72]);
    assert_near(&covariance[20..], &[0.14 * 0.14]);
    // 10⁻⁶ of a side's square per a 32nd of a second's.
    let found = odometry.velocity_covariance;
    assert_near(&[found[0], found[1], found[6]], &[2.56, 0.0, 2.56]);
    assert!((found[11] - 1e-6 * (40.0_f32 * 32.0).powi(2)).abs() < 1e-3);
    assert_eq!(odometry.frame_id, MavFrame::MAV_FRAME_LOCAL_NED);
    assert_eq!(odometry.child_frame_id, MavFrame::MAV_FRAME_BODY_FRD);
    assert_eq!(odometry.reset_counter, 1);
    // 5 m at 40 m: forward is positive about the axis to the right.
    let flow = flow.expect("moved");
    assert_near(&[flow.integrated_x, flow.integrated_y], &[0.0, 0.125]);
    assert_eq!((flow.distance, flow.integration_time_us), (40.0, 31_250));
}

#[test]
fn quaternions_turn_the_nose_the_right_way() {
    // Yaw, then pitch, then roll: where the axes of the body point to, by hand.
    let (yaw, pitch, roll) = (0.3_f32, 0.2_f32, -0.4_f32);
    let mut autopilot = Autopilot::new();
    tell_attitude(&mut autopilot, [roll, pitch, yaw], 0);
    let guidance = guided(None, Some(at(0.0, 0.0, yaw)));
    let (odometry, _) = reported(&mut autopilot, &step(Some(&guidance), 0));
    let [w, x, y, z] = odometry.q;
    let nose = [
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
    ];
    // North, east, and up where the nose is up.
    let expected = [
        pitch.cos() * yaw.cos(),
        pitch.cos() * yaw.sin(),
        -pitch.sin(),
    ];
    assert_near(&nose, &expected);
    // The right wing's part down: positive when the right side is down.
    assert_near(&[2.0 * (y * z + w * x)], &[pitch.cos() * roll.sin()]);
}

#[test]
fn speeds_are_in_the_axes_of_a_tilted_body() {
    let mut autopilot = Autopilot::new();
    tell_attitude(&mut autopilot, [0.0, 0.5, 0.0], 0);
    tell_altitude(&mut autopilot, 40, 0);
    let guidance = guided(Some(moved(0.1, 0.02, 0.0)), Some(at(0.0, 0.0, 0.0)));
    let (odometry, _) = reported(&mut autopilot, &step(Some(&guidance), 0));
    let (sin, cos) = 0.5_f32.sin_cos();
    let found = [odometry.vx, odometry.vy, odometry.vz];
    // Nose up, level flight goes down in the body's axes.
    let expected = [160.0 * cos, 32.0, 160.0 * sin];
    assert!(
        found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-3)
    );
    let climb = Displacement {
        scale: 1.25,
        ..moved(0.0, 0.0, 0.5)
    };
    tell_attitude(&mut autopilot, [0.0; 3], 10);
    let guidance = guided(Some(climb), Some(at(0.0, 0.0, 0.0)));
    let (odometry, _) = reported(&mut autopilot, &step(Some(&guidance), 0));
    // From 32 m to 40 m, turning.
    assert_near(
        &[odometry.vx, odometry.vz, odometry.yawspeed],
        &[0.0, -256.0, 16.0],
    );
}

#[test]
fn flow_has_the_signs_of_mavlink_and_the_camera_turns_with_it() {
    let mut autopilot = Autopilot::new();
    tell_attitude(&mut autopilot, [0.1, 0.2, 0.0], 0);
    let guidance = guided(Some(moved(0.0, 0.1, 0.0)), Some(at(0.0, 0.0, 0.0)));
    reported(&mut autopilot, &step(Some(&guidance), 0));
    tell_attitude(&mut autopilot, [0.11, 0.18, 0.0], 30);
    let (_, flow) = reported(&mut autopilot, &step(Some(&guidance), 0));
    let flow = flow.expect("moved");
    assert_near(
        &[flow.integrated_xgyro, flow.integrated_ygyro],
        &[0.01, -0.02],
    );
    // To the right is negative about the axis ahead: 5 m at 25 m.
    assert_near(
        &[flow.integrated_x, flow.integrated_y],
        &[0.01 - 0.2, -0.02],
    );
}

#[test]
fn jumps_are_counted_and_small_corrections_are_not() {
    let mut autopilot = Autopilot::new();
    let mut resets = |x_px| {
        let guidance = guided(Some(moved(0.0, 0.0, 0.0)), Some(at(x_px, 0.0, 0.0)));
        reported(&mut autopilot, &step(Some(&guidance), 0))
            .0
            .reset_counter
    };
    assert_eq!(
        [0.0, 5.0, 20.0, 90.0, 91.0, 0.0].map(&mut resets),
        [1, 1, 1, 2, 2, 3]
    );
}

#[test]
fn quality_says_when_odometry_waits_and_when_it_failed() {
    let mut autopilot = Autopilot::new();
    let guidance = guided(None, Some(at(0.0, 0.0, 0.0)));
    let mut quality = |is_waiting| {
        let step = Step {
            is_waiting,
            ..step(Some(&guidance), 0)
        };
        reported(&mut autopilot, &step).0.quality
    };
    assert_eq!((quality(true), quality(false)), (1, -1));
}

#[test]
fn numbers_that_are_none_do_not_stay() {
    let mut autopilot = Autopilot::new();
    let guidance = guided(Some(moved(0.1, 0.0, 0.0)), Some(at(1.0, 1.0, 0.0)));
    for nonsense in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
        let setup = Setup {
            meters_per_px: nonsense,
            ..SETUP
        };
        let all = [
            Step {
                setup,
                ..step(Some(&guidance), 0)
            },
            Step {
                footprint_px: nonsense,
                ..step(Some(&guidance), 0)
            },
            Step {
                step_s: nonsense,
                ..step(Some(&guidance), 0)
            },
        ];
        for step in all {
            reported(&mut autopilot, &step);
        }
    }
    let (odometry, _) = reported(&mut autopilot, &step(Some(&guidance), u64::MAX));
    assert!(odometry.x.is_finite() && odometry.q[0].is_finite() && odometry.vx.is_finite());
}

#[test]
fn texts_are_cut_between_characters_and_refusals_are_said_in_words() {
    let mut autopilot = Autopilot::new();
    let mut said = Vec::new();
    let long: String = core::iter::repeat_n('ä', 26).collect();
    let mut note = |bytes: &[u8]| {
        if let Some(text) = decoded::<STATUSTEXT_DATA>(&[taken_apart(bytes)]) {
            said.push((
                text.severity,
                String::from(text.text.to_str().expect("is UTF-8")),
            ));
        }
    };
    let odd = std::format!("a{long}");
    autopilot.say(MavSeverity::MAV_SEVERITY_CRITICAL, &odd, &mut note);
    let refused = Step {
        refusal: Some(Refusal::Unknown),
        ..step(None, 0)
    };
    autopilot.report(&refused, &mut note);
    autopilot.report(&refused, &mut note);
    let words = String::from(Refusal::Unknown.words());
    assert_eq!(
        said,
        [
            (MavSeverity::MAV_SEVERITY_CRITICAL, String::from(&odd[..49])),
            (MavSeverity::MAV_SEVERITY_NOTICE, words)
        ]
    );
}

#[test]
fn heartbeats_are_a_second_apart_and_name_the_autopilots_system() {
    let mut autopilot = Autopilot::new();
    let mut beats = Vec::new();
    let start = u32::MAX - 1500;
    for now_ms in (0..4000).step_by(20) {
        if now_ms == 1500 {
            tell_attitude(&mut autopilot, [0.0; 3], start.wrapping_add(now_ms));
        }
        let now_ms = start.wrapping_add(now_ms);
        autopilot.beat(now_ms, MavState::MAV_STATE_ACTIVE, &mut |bytes| {
            beats.push([bytes[4], bytes[5], bytes[6], bytes[10 + 7]]);
        });
    }
    let active = MavState::MAV_STATE_ACTIVE as u8;
    let expected = [(0, 1), (1, 1), (2, 7), (3, 7)].map(|(n, system)| [n, system, 197, active]);
    assert_eq!(beats, expected);
}
