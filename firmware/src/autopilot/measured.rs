//! A step, and what was told when it began → ODOMETRY and OPTICAL_FLOW_RAD.

use eigenmark_core::{math::sin_cos, navigator::Guidance, track::Displacement};
use mavlink::dialects::common::{MavEstimatorType, MavFrame, ODOMETRY_DATA, OPTICAL_FLOW_RAD_DATA};
use nalgebra::{Matrix3, Vector3};

use super::{
    Step,
    instruments::{Attitude, Told, nominal_altitude_m},
    integrator::{Pose, UNKNOWN_M2, UNKNOWN_RAD2},
};

/// Standard deviation of an altitude that is told, as a share of it, as the navigator takes it.
const ALTIMETER_SHARE: f32 = 0.018;

/// Variance of roll and pitch that are told: 1°, squared.
const TILT_VARIANCE: f32 = 1.0_f32.to_radians() * 1.0_f32.to_radians();

/// Variances of speeds of which nothing is known: of 100 m/s and of 10 rad/s.
const UNKNOWN_SPEED2: f32 = 1e4;
const UNKNOWN_RATE2: f32 = 1e2;

/// The quality of an odometry that has failed, and the worst and the best.
const FAILED: i8 = -1;
const WORST: f32 = 1.0;
const BEST: f32 = 100.0;

/// What is known of a step beside what it brings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Context {
    pub told: Told,
    /// `None` before the first frame.
    pub pose: Option<Pose>,
    pub resets: u8,
    /// What time the displacement took.
    pub took_s: f32,
    /// The attitude when it began.
    pub before: Option<Attitude>,
    /// What a side of the frame's square covers at nominal altitude.
    pub side_m: f32,
}

/// The pose and the speed.
pub(super) fn odometry(step: &Step<'_>, context: &Context) -> ODOMETRY_DATA {
    let altitude_m = context.told.altitude.map(|altitude| altitude.meters);
    let (place_m, q, pose_covariance) = posed(context, altitude_m);
    let moved = step.guidance.and_then(|guidance| guidance.displacement);
    let speed = moved.map(|moved| Speed::of(&moved, context, altitude_m));
    let velocity = speed.map_or([f32::NAN; 3], |speed| speed.velocity);
    ODOMETRY_DATA {
        time_usec: step.now_us,
        x: place_m[0],
        y: place_m[1],
        z: altitude_m.map_or(f32::NAN, |altitude_m| -altitude_m),
        q,
        vx: velocity[0],
        vy: velocity[1],
        vz: velocity[2],
        rollspeed: f32::NAN,
        pitchspeed: f32::NAN,
        yawspeed: speed.map_or(f32::NAN, |speed| speed.yaw),
        pose_covariance,
        velocity_covariance: speed.map_or_else(unknown, |speed| speed.covariance),
        frame_id: MavFrame::MAV_FRAME_LOCAL_NED,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        reset_counter: context.resets,
        estimator_type: MavEstimatorType::MAV_ESTIMATOR_TYPE_VISION,
        quality: quality(step, moved.as_ref()),
    }
}

/// What the camera saw of the ground go by; `None` without a displacement.
pub(super) fn flow(step: &Step<'_>, context: &Context) -> Option<OPTICAL_FLOW_RAD_DATA> {
    let moved = step.guidance?.displacement?;
    let nominal_m = nominal_altitude_m(&step.setup, step.footprint_px);
    let altitude = context.told.altitude;
    // Without an altimeter, path integration took it to be nominal to begin with.
    let altitude_m = altitude.map_or(nominal_m, |altitude| altitude.meters);
    // Displacements are those of the ground, levelled: the camera turned besides.
    let angle = context.side_m / altitude_m;
    let turned = (context.before.zip(context.told.attitude)).map(|(before, now)| {
        [
            now.roll_rad - before.roll_rad,
            now.pitch_rad - before.pitch_rad,
        ]
    });
    // Without an attitude nothing was levelled: turns are in the displacement, and nobody knows them.
    let [roll, pitch] = turned.unwrap_or([0.0; 2]);
    let [roll_gyro, pitch_gyro] = turned.unwrap_or([f32::NAN; 2]);
    let since_ms = altitude.map_or(0, |altitude| {
        context.told.at_ms.wrapping_sub(altitude.at_ms)
    });
    Some(OPTICAL_FLOW_RAD_DATA {
        time_usec: step.now_us,
        integration_time_us: (context.took_s * 1e6) as u32,
        integrated_x: roll - moved.right * angle,
        integrated_y: pitch + moved.forward * angle,
        integrated_xgyro: roll_gyro,
        integrated_ygyro: pitch_gyro,
        integrated_zgyro: moved.yaw_rad,
        time_delta_distance_us: since_ms.saturating_mul(1000),
        distance: altitude.map_or(-1.0, |altitude| altitude.meters),
        temperature: 0,
        sensor_id: 0,
        quality: (share(&moved) * 255.0) as u8,
    })
}

/// North and east, the attitude, and the covariance of both.
fn posed(context: &Context, altitude_m: Option<f32>) -> ([f32; 2], [f32; 4], [f32; 21]) {
    let Some(pose) = context.pose else {
        return ([f32::NAN; 2], [f32::NAN; 4], unknown());
    };
    let attitude = context.told.attitude;
    // As the navigator takes it: level.
    let (roll, pitch) = attitude.map_or((0.0, 0.0), |told| (told.roll_rad, told.pitch_rad));
    let q = pose.heading_rad.map_or([f32::NAN; 4], |heading_rad| {
        quaternion([roll, pitch, heading_rad])
    });
    let down = altitude_m.map_or(UNKNOWN_M2, |altitude_m| {
        let deviation = ALTIMETER_SHARE * altitude_m;
        deviation * deviation
    });
    let tilt = attitude.map_or(UNKNOWN_RAD2, |_| TILT_VARIANCE);
    let of = &pose.covariance;
    let heading = of.m33.min(UNKNOWN_RAD2);
    let covariance = [
        of.m11, of.m12, 0.0, 0.0, 0.0, of.m13, //
        of.m22, 0.0, 0.0, 0.0, of.m23, //
        down, 0.0, 0.0, 0.0, //
        tilt, 0.0, 0.0, //
        tilt, 0.0, //
        heading,
    ];
    (pose.place_m, q, covariance)
}

/// A displacement over the time that it took, in the body's axes.
#[derive(Clone, Copy)]
struct Speed {
    /// Forward, right and down, in meters per second.
    velocity: [f32; 3],
    /// Clockwise, in radians per second.
    yaw: f32,
    covariance: [f32; 21],
}

impl Speed {
    fn of(moved: &Displacement, context: &Context, altitude_m: Option<f32>) -> Self {
        let per_s = 1.0 / context.took_s;
        if !per_s.is_finite() {
            return Self {
                velocity: [f32::NAN; 3],
                yaw: f32::NAN,
                covariance: unknown(),
            };
        }
        // Along the heading that is, not the one that was.
        let (sin, cos) = sin_cos(moved.yaw_rad);
        let rate = context.side_m * per_s;
        let forward = (moved.forward * cos + moved.right * sin) * rate;
        let right = (moved.right * cos - moved.forward * sin) * rate;
        let of = &moved.covariance;
        let (rate2, per_s2) = (rate * rate, per_s * per_s);
        // Not knowing the altitude, it is taken to stay.
        let climb_rate = altitude_m.map(|altitude_m| altitude_m * per_s);
        let climb = climb_rate.map_or(0.0, |rate| (1.0 - 1.0 / moved.scale) * rate);
        let climb_variance = climb_rate.map_or(UNKNOWN_SPEED2, |rate| of.m44 * rate * rate);
        let level = Matrix3::new(
            of.m11 * rate2,
            of.m12 * rate2,
            0.0,
            of.m12 * rate2,
            of.m22 * rate2,
            0.0,
            0.0,
            0.0,
            climb_variance,
        );
        let attitude = context.told.attitude;
        let (roll, pitch) = attitude.map_or((0.0, 0.0), |told| (told.roll_rad, told.pitch_rad));
        let to_body = to_body(roll, pitch);
        let body = to_body * Vector3::new(forward, right, -climb);
        let c = to_body * level * to_body.transpose();
        Self {
            velocity: [
                body.x,
                body.y,
                if altitude_m.is_some() {
                    body.z
                } else {
                    f32::NAN
                },
            ],
            yaw: moved.yaw_rad * per_s,
            covariance: [
                c.m11,
                c.m12,
                c.m13,
                0.0,
                0.0,
                0.0, //
                c.m22,
                c.m23,
                0.0,
                0.0,
                0.0, //
                c.m33,
                0.0,
                0.0,
                0.0, //
                UNKNOWN_RATE2,
                0.0,
                0.0, //
                UNKNOWN_RATE2,
                0.0, //
                of.m33 * per_s2,
            ],
        }
    }
}

/// From forward, right and down, level, to the axes of a body that is tilted.
fn to_body(roll_rad: f32, pitch_rad: f32) -> Matrix3<f32> {
    let (sr, cr) = sin_cos(roll_rad);
    let (sp, cp) = sin_cos(pitch_rad);
    Matrix3::new(cp, 0.0, -sp, sp * sr, cr, cp * sr, sp * cr, -sr, cp * cr)
}

/// w, x, y and z, of roll, pitch and yaw: from the body's axes to north, east and down.
fn quaternion(angles_rad: [f32; 3]) -> [f32; 4] {
    let [(sr, cr), (sp, cp), (sy, cy)] = angles_rad.map(|angle| sin_cos(angle / 2.0));
    [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
}

/// From how much of the belief is at one place, and how many corners agree.
fn quality(step: &Step<'_>, moved: Option<&Displacement>) -> i8 {
    let Some(moved) = moved else {
        return if step.is_waiting { WORST as i8 } else { FAILED };
    };
    let confidence = step
        .guidance
        .and_then(|guidance: &Guidance| guidance.estimate)
        .map_or(0.0, |estimate| estimate.confidence.clamp(0.0, 1.0));
    (WORST + (BEST - WORST) * confidence * share(moved)) as i8
}

/// How many of the corners that were found again agree: 0 to 1.
fn share(moved: &Displacement) -> f32 {
    if moved.tracked == 0 {
        0.0
    } else {
        (f32::from(moved.inliers) / f32::from(moved.tracked)).min(1.0)
    }
}

/// A covariance of which nothing is known.
fn unknown() -> [f32; 21] {
    let mut covariance = [0.0; 21];
    covariance[0] = f32::NAN;
    covariance
}
