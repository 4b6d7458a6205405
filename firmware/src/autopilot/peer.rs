//! Streams for a peer that reads and writes MAVLink, too; see `tests/peers/compare_mavlink.py`.

use std::{env, format, fs, path::Path, string::String, vec::Vec};

use mavlink::{
    MAVLinkV2MessageRaw, MavlinkVersion, Message as _, MessageData,
    dialects::common::{
        ALTITUDE_DATA, ATTITUDE_DATA, DISTANCE_SENSOR_DATA, GLOBAL_POSITION_INT_DATA, MavMessage,
        ODOMETRY_DATA, OPTICAL_FLOW_RAD_DATA,
    },
};

use super::{
    framer::{Header, Message},
    tests::{FOOTPRINT_PX, SETUP, at, guided, moved, step, tell_altitude, tell_attitude},
    *,
};

/// A folder in which streams are exchanged: `ours.bin` is written with `ours.jsonl`, and of every other `*.bin` a
/// `*.jsonl` says what was taken of it.
const FOLDER: &str = "EIGENMARK_MAVLINK";

/// Five minutes of 32 frames a second.
const STEPS: u32 = 5 * 60 * 32;

/// A flight in circles during which everything that can be unknown is, now and then.
fn fly(mut send: impl FnMut(&[u8])) {
    const REASONS: [Refusal; 5] = [
        Refusal::NoAtlas,
        Refusal::NoFrame,
        Refusal::Flat,
        Refusal::Outside,
        Refusal::Unknown,
    ];
    let mut autopilot = Autopilot::new();
    for frame in 0..STEPS {
        let now_us = u64::from(frame) * 31_250;
        let now_ms = (now_us / 1000) as u32;
        let heading = eigenmark_core::math::wrapped(frame as f32 * 0.01);
        if frame > 500 && frame % 700 > 100 {
            let tilt = 0.2 * (frame as f32 * 0.05).sin();
            tell_attitude(&mut autopilot, [tilt, -tilt / 2.0, heading], now_ms);
        }
        if frame % 900 > 100 {
            tell_altitude(&mut autopilot, (20 + frame % 30) as u16, now_ms);
        }
        autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
        let is_waiting = frame % 50 == 7;
        let is_seen = !is_waiting && frame % 400 > 5;
        let mut displacement = moved(0.02, 0.001 * (frame % 7) as f32, 0.01);
        displacement.scale = 1.0 + 0.001 * (frame % 5) as f32;
        displacement.inliers = (frame % 21) as u8;
        let mut estimate = at(
            800.0 + 200.0 * heading.sin() + (frame / 2000) as f32 * 40.0,
            600.0 - 200.0 * heading.cos(),
            heading,
        );
        estimate.confidence = if frame % 600 < 100 { 0.7 } else { 0.995 };
        let guidance = guided(
            is_seen.then_some(displacement),
            (frame > 20).then_some(estimate),
        );
        let refusal = (frame % 3 == 0).then(|| REASONS[(frame / 90) as usize % REASONS.len()]);
        let step = Step {
            refusal,
            is_waiting,
            ..step((frame > 10).then_some(&guidance), now_us)
        };
        autopilot.report(&step, &mut send);
        autopilot.beat(now_ms, MavState::MAV_STATE_ACTIVE, &mut send);
        if frame % 1000 == 999 {
            autopilot.say(
                MavSeverity::MAV_SEVERITY_ERROR,
                "watchdog: 21 °C, µ ↯",
                &mut send,
            );
        }
    }
}

/// A message as JSON in a line: every field is a list of numbers.
fn line(header: [u8; 3], name: &str, fields: &[(&str, Vec<f64>)]) -> String {
    let fields: Vec<String> = (fields.iter())
        .map(|(name, numbers)| {
            // As Python's JSON has it.
            let numbers = format!("{numbers:?}").replace("inf", "Infinity");
            format!("\"{name}\":{numbers}")
        })
        .collect();
    format!(
        "{{\"name\":\"{name}\",\"header\":{header:?},\"fields\":{{{}}}}}\n",
        fields.join(",")
    )
}

/// Names and values of fields.
macro_rules! fields {
    ($message:ident: $($name:ident)*; arrays $($array:ident)*; enums $($enum:ident)*) => {
        [
            $((stringify!($name), [f64::from($message.$name)].to_vec()),)*
            $((stringify!($array), $message.$array.iter().map(|&part| f64::from(part)).collect()),)*
            $((stringify!($enum), [f64::from($message.$enum as u8)].to_vec()),)*
        ]
    };
}

fn described(header: [u8; 3], id: u32, version: MavlinkVersion, payload: &[u8]) -> String {
    fn deser<M: MessageData>(version: MavlinkVersion, payload: &[u8]) -> M {
        M::deser(version, payload).expect("its values exist")
    }
    match id {
        HEARTBEAT_DATA::ID => {
            let m: HEARTBEAT_DATA = deser(version, payload);
            let mut fields = fields!(m: custom_mode mavlink_version; arrays; enums autopilot
                system_status)
            .to_vec();
            fields.push(("type", [f64::from(m.mavtype as u8)].to_vec()));
            fields.push(("base_mode", [f64::from(m.base_mode.bits())].to_vec()));
            line(header, HEARTBEAT_DATA::NAME, &fields)
        }
        ODOMETRY_DATA::ID => {
            let m: ODOMETRY_DATA = deser(version, payload);
            let mut fields = fields!(m: x y z vx vy vz rollspeed pitchspeed yawspeed reset_counter
                quality; arrays q pose_covariance velocity_covariance; enums frame_id
                child_frame_id estimator_type)
            .to_vec();
            fields.push(("time_usec", [m.time_usec as f64].to_vec()));
            line(header, ODOMETRY_DATA::NAME, &fields)
        }
        OPTICAL_FLOW_RAD_DATA::ID => {
            let m: OPTICAL_FLOW_RAD_DATA = deser(version, payload);
            let mut fields = fields!(m: integration_time_us integrated_x integrated_y
                integrated_xgyro integrated_ygyro integrated_zgyro time_delta_distance_us distance
                temperature sensor_id quality; arrays; enums)
            .to_vec();
            fields.push(("time_usec", [m.time_usec as f64].to_vec()));
            line(header, OPTICAL_FLOW_RAD_DATA::NAME, &fields)
        }
        STATUSTEXT_DATA::ID => {
            let m: STATUSTEXT_DATA = deser(version, payload);
            let fields = fields!(m: id chunk_seq; arrays text; enums severity);
            line(header, STATUSTEXT_DATA::NAME, &fields)
        }
        ATTITUDE_DATA::ID => {
            let m: ATTITUDE_DATA = deser(version, payload);
            let fields = fields!(m: time_boot_ms roll pitch yaw rollspeed pitchspeed yawspeed;
                arrays; enums);
            line(header, ATTITUDE_DATA::NAME, &fields)
        }
        ALTITUDE_DATA::ID => {
            let m: ALTITUDE_DATA = deser(version, payload);
            let mut fields = fields!(m: altitude_monotonic altitude_amsl altitude_local
                altitude_relative altitude_terrain bottom_clearance; arrays; enums)
            .to_vec();
            fields.push(("time_usec", [m.time_usec as f64].to_vec()));
            line(header, ALTITUDE_DATA::NAME, &fields)
        }
        DISTANCE_SENSOR_DATA::ID => {
            let m: DISTANCE_SENSOR_DATA = deser(version, payload);
            let fields = fields!(m: time_boot_ms min_distance max_distance current_distance id
                covariance horizontal_fov vertical_fov signal_quality; arrays quaternion;
                enums orientation);
            line(header, DISTANCE_SENSOR_DATA::NAME, &fields)
        }
        GLOBAL_POSITION_INT_DATA::ID => {
            let m: GLOBAL_POSITION_INT_DATA = deser(version, payload);
            let fields = fields!(m: time_boot_ms lat lon alt relative_alt vx vy vz hdg; arrays;
                enums);
            line(header, GLOBAL_POSITION_INT_DATA::NAME, &fields)
        }
        _ => panic!("message {id} is not ours"),
    }
}

/// Of a stream, what was taken of it, and what the counters say in the end.
fn taken(stream: &[u8]) -> String {
    let mut lines = String::new();
    let mut framer = Framer::new();
    let mut autopilot = Autopilot::new();
    for (&byte, index) in stream.iter().zip(0_u32..) {
        framer.push(byte, |heard| {
            if let Heard::Message(Message { header, payload }) = heard {
                let Header {
                    version,
                    sequence,
                    system,
                    component,
                    id,
                    ..
                } = header;
                lines += &described([sequence, system, component], id, version, payload);
            }
        });
        // 115,200 baud.
        let now_ms = index / 11;
        autopilot.receive(byte, now_ms);
        autopilot.readings(now_ms, &SETUP, FOOTPRINT_PX);
    }
    let counted = [autopilot.messages(), autopilot.lost(), autopilot.damaged()];
    let system = autopilot.system().unwrap_or(0);
    lines
        + &line(
            [system, 0, 0],
            "counted",
            &[("counted", counted.map(f64::from).to_vec())],
        )
}

#[test]
fn what_is_sent_is_read_by_mavlink_itself() {
    let (mut sequence, mut others) = (0_u8, 0);
    fly(|bytes| {
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.as_mut_slice()[..bytes.len()].copy_from_slice(bytes);
        assert!(raw.has_valid_crc::<MavMessage>());
        assert_eq!((raw.raw_bytes(), raw.sequence()), (bytes, sequence));
        let message = MavMessage::parse(MavlinkVersion::V2, raw.message_id(), raw.payload());
        if !matches!(
            message,
            Ok(MavMessage::ODOMETRY(_) | MavMessage::OPTICAL_FLOW_RAD(_))
        ) {
            others += 1;
        }
        sequence = sequence.wrapping_add(1);
    });
    // A heartbeat a second, a text at most every second, and errors.
    assert!((300..=620).contains(&others), "{others}");
}

#[test]
fn streams_are_exchanged_with_a_peer_that_asks_for_it() {
    let Some(folder) = env::var_os(FOLDER) else {
        return;
    };
    let folder = Path::new(&folder);
    let (mut stream, mut lines) = (Vec::new(), String::new());
    fly(|bytes| {
        let id = u32::from_le_bytes([bytes[7], bytes[8], bytes[9], 0]);
        let payload = &bytes[10..bytes.len() - 2];
        lines += &described(
            [bytes[4], bytes[5], bytes[6]],
            id,
            MavlinkVersion::V2,
            payload,
        );
        stream.extend_from_slice(bytes);
    });
    let files = fs::read_dir(folder).expect("the folder is there");
    for path in files.map(|file| file.expect("it can be read").path()) {
        if path.extension().is_some_and(|extension| extension == "bin") {
            let stream = fs::read(&path).expect("it can be read");
            fs::write(path.with_extension("jsonl"), taken(&stream)).expect("it can be written");
        }
    }
    fs::write(folder.join("ours.bin"), stream).expect("it can be written");
    fs::write(folder.join("ours.jsonl"), lines).expect("it can be written");
}
