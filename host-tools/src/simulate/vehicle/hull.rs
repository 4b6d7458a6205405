//! The hull in the air.
//!
//! Method, per step, with the velocity through the air split along the hull (u) and across it (v):
//! - turn: the rate asked for is the heading error times a gain, limited; the actual rate follows with a time constant;
//! - ahead: u′ = D(target) − D(u), D(u) = u·(a + b·|u|/2c)/T: thrust balances drag at the commanded airspeed;
//! - across: v′ = −v·(a + b·V/c)/S, V the airspeed: the faster the hull, the harder the air pushes it back on its
//!   course; it slips outward in turns and takes gusts slowly;
//!
//! with a + b = 1 and c the cruising speed, so that T and S are the time constants at cruise.
//!
//! Velocities are added in the ground's frame, so a change of wind is felt as a change of airspeed. Altitude wanders on
//! its own.

use std::f64::consts::{PI, TAU};

use super::{Blimp, Command, Truth, swing::Swing};
use crate::simulate::chance::{Cause, Walk};

/// Share of the drag at cruise that grows with the speed; the rest grows with its square. Without the first, a blimp
/// would never stop.
const LINEAR_DRAG: f64 = 0.25;

/// A blimp in flight.
#[derive(Clone, Debug)]
pub(crate) struct Vehicle {
    blimp: Blimp,
    meters_per_px: f64,
    step_s: f64,
    position_px: [f64; 2],
    velocity_m_s: [f64; 2],
    heading_rad: f64,
    yaw_rad_s: f64,
    altitude: Walk,
    roll: Swing,
    pitch: Swing,
}

impl Vehicle {
    /// At rest in air of that velocity.
    pub(crate) fn new(
        blimp: Blimp,
        meters_per_px: f64,
        position_px: [f64; 2],
        heading_rad: f64,
        air_m_s: [f64; 2],
        seed: u64,
        step_s: f64,
    ) -> Self {
        let random = Cause::Altitude.random(seed, 0);
        let altitude = Walk::new(blimp.altitude_ratio, blimp.altitude_time_s, step_s, random);
        Self {
            blimp,
            meters_per_px,
            step_s,
            position_px,
            velocity_m_s: air_m_s,
            heading_rad: wrapped(heading_rad),
            yaw_rad_s: 0.0,
            altitude,
            roll: Swing::new(&blimp, seed, 0),
            pitch: Swing::new(&blimp, seed, 1),
        }
    }

    /// Goes on by one step. A command that is not a number keeps the heading, or stops.
    pub(crate) fn step(&mut self, command: Command, air_m_s: [f64; 2]) {
        let (blimp, step_s) = (self.blimp, self.step_s);
        let error = wrapped(f64::from(command.heading_rad) - self.heading_rad);
        let error = if error.is_nan() { 0.0 } else { error };
        let asked = (blimp.turn_gain * error).clamp(-blimp.turn_rad_s, blimp.turn_rad_s);
        self.yaw_rad_s += (asked - self.yaw_rad_s) * (step_s / blimp.turn_time_s).min(1.0);
        self.heading_rad = wrapped(self.heading_rad + self.yaw_rad_s * step_s);

        let (sin, cos) = self.heading_rad.sin_cos();
        let through = [0, 1].map(|axis| self.velocity_m_s[axis] - air_m_s[axis]);
        let ahead = through[0] * sin - through[1] * cos;
        let aside = through[0] * cos + through[1] * sin;
        let speed = f64::from(command.speed).clamp(0.0, 1.0);
        let speed = if speed.is_nan() { 0.0 } else { speed };
        let drag = |speed_m_s: f64| {
            let quadratic = (1.0 - LINEAR_DRAG) * speed_m_s.abs() / (2.0 * blimp.cruise_m_s);
            speed_m_s * (LINEAR_DRAG + quadratic) / blimp.surge_time_s
        };
        let ahead_m_s2 = drag(speed * blimp.cruise_m_s) - drag(ahead);
        let airspeed = ahead.hypot(aside) / blimp.cruise_m_s;
        let aside_m_s2 =
            -aside * (LINEAR_DRAG + (1.0 - LINEAR_DRAG) * airspeed) / blimp.sway_time_s;
        let gained = [
            ahead_m_s2 * sin + aside_m_s2 * cos,
            -ahead_m_s2 * cos + aside_m_s2 * sin,
        ];
        for (velocity, gained) in self.velocity_m_s.iter_mut().zip(gained) {
            *velocity += gained * step_s;
        }
        for (position, velocity) in self.position_px.iter_mut().zip(self.velocity_m_s) {
            *position += velocity * step_s / self.meters_per_px;
        }
        self.altitude.step();
        // What hangs below the hull stays behind: to the left in an acceleration to the right, and aft in one ahead.
        self.roll.step(&blimp, aside_m_s2, step_s);
        self.pitch.step(&blimp, -ahead_m_s2, step_s);
    }

    /// Puts it elsewhere, at the same velocity.
    pub(crate) fn kidnap(&mut self, position_px: [f64; 2]) {
        self.position_px = position_px;
    }

    /// Where it is, and how it moves.
    pub(crate) fn truth(&self) -> Truth {
        let (roll_rad, roll_rad_s) = self.roll.state();
        let (pitch_rad, pitch_rad_s) = self.pitch.state();
        Truth {
            position_px: self.position_px,
            velocity_m_s: self.velocity_m_s,
            heading_rad: self.heading_rad,
            yaw_rad_s: self.yaw_rad_s,
            altitude_ratio: self.altitude.value(),
            climb_per_s: self.altitude.rate(),
            roll_rad,
            roll_rad_s,
            pitch_rad,
            pitch_rad_s,
        }
    }
}

/// The same angle in −π..=π.
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    let turned = angle_rad - TAU * (angle_rad / TAU).round();
    turned.clamp(-PI, PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.01;

    fn at_rest(blimp: Blimp) -> Vehicle {
        Vehicle::new(blimp, 0.5, [100.0, 100.0], 0.0, [0.0; 2], 1, STEP_S)
    }

    fn fly(vehicle: &mut Vehicle, heading_rad: f32, speed: f32, air: [f64; 2], seconds: u32) {
        let command = Command { heading_rad, speed };
        (0..seconds * 100).for_each(|_| vehicle.step(command, air));
    }

    #[test]
    fn it_reaches_the_commanded_heading_and_airspeed() {
        for speed in [0.3, 0.6, 1.0] {
            let mut vehicle = at_rest(Blimp::default());
            fly(&mut vehicle, 1.0, speed, [0.0; 2], 60);
            let truth = vehicle.truth();
            assert!((truth.heading_rad - 1.0).abs() < 1e-3);
            let expected = 6.0 * f64::from(speed);
            let [x, y] = truth.velocity_m_s;
            assert!((x - expected * 1.0_f64.sin()).abs() < 0.03, "{x}");
            assert!((y + expected * 1.0_f64.cos()).abs() < 0.03, "{y}");
        }
    }

    #[test]
    fn it_turns_the_short_way_within_its_rate_and_hardly_overshoots() {
        let mut vehicle = at_rest(Blimp::default());
        let mut fastest = 0.0_f64;
        let mut farthest = 0.0_f64;
        for _ in 0..3_000 {
            vehicle.step(
                Command {
                    heading_rad: TAU as f32 - 2.5,
                    speed: 0.5,
                },
                [0.0; 2],
            );
            let truth = vehicle.truth();
            fastest = fastest.max(truth.yaw_rad_s.abs());
            farthest = farthest.min(truth.heading_rad);
        }
        let limit = Blimp::default().turn_rad_s;
        assert!(fastest <= limit && fastest > 0.98 * limit, "{fastest}");
        assert!(farthest < -2.49 && farthest > -2.6, "{farthest}");
    }

    #[test]
    fn its_place_is_the_sum_of_its_velocity() {
        let mut vehicle = at_rest(Blimp::default());
        let mut sum = [0.0; 2];
        for _ in 0..1_000 {
            vehicle.step(
                Command {
                    heading_rad: 0.7,
                    speed: 1.0,
                },
                [1.0, 0.5],
            );
            for (sum, velocity) in sum.iter_mut().zip(vehicle.truth().velocity_m_s) {
                *sum += velocity * STEP_S / 0.5;
            }
        }
        for (position, sum) in vehicle.truth().position_px.into_iter().zip(sum) {
            assert!((position - 100.0 - sum).abs() < 1e-9);
        }
    }

    #[test]
    fn without_thrust_it_ends_up_drifting_with_the_wind() {
        let mut vehicle = at_rest(Blimp::default());
        fly(&mut vehicle, 0.5, 1.0, [0.0; 2], 20);
        fly(&mut vehicle, 0.5, 0.0, [2.0, -1.0], 120);
        let [x, y] = vehicle.truth().velocity_m_s;
        assert!((x - 2.0).abs() < 0.01 && (y + 1.0).abs() < 0.01, "{x} {y}");
    }

    #[test]
    fn in_a_turn_it_slips_outward() {
        let mut vehicle = at_rest(Blimp::default());
        fly(&mut vehicle, 0.0, 1.0, [0.0; 2], 30);
        let command = Command {
            heading_rad: 1.5,
            speed: 1.0,
        };
        (0..300).for_each(|_| vehicle.step(command, [0.0; 2]));
        let truth = vehicle.truth();
        let course = truth.velocity_m_s[0].atan2(-truth.velocity_m_s[1]);
        assert!(
            course < truth.heading_rad - 0.1,
            "{course} {}",
            truth.heading_rad
        );
    }

    #[test]
    fn tilt_and_altitude_stay_within_their_limits_and_use_them() {
        let blimp = Blimp::default();
        let (mut largest, mut low, mut high) = (0.0_f64, f64::MAX, f64::MIN);
        let mut squares = 0.0;
        for seed in 0..20 {
            let mut vehicle = Vehicle::new(blimp, 0.5, [0.0; 2], 0.0, [0.0; 2], seed, STEP_S);
            for second in 0_u32..300 {
                fly(&mut vehicle, (second / 10 % 3) as f32, 1.0, [0.0; 2], 1);
                let truth = vehicle.truth();
                largest = largest.max(truth.roll_rad.abs()).max(truth.pitch_rad.abs());
                squares += truth.pitch_rad.powi(2) / 6_000.0;
                (low, high) = (
                    low.min(truth.altitude_ratio),
                    high.max(truth.altitude_ratio),
                );
            }
        }
        let deviation = squares.sqrt().to_degrees();
        assert!((1.5..3.5).contains(&deviation), "{deviation}");
        let largest = largest.to_degrees();
        assert!(largest > 6.0 && largest < 8.0, "{largest}");
        assert!((0.85..0.87).contains(&low), "{low}");
        assert!(high <= 1.2 && high > 1.18, "{high}");
    }

    #[test]
    fn a_level_blimp_is_level() {
        let mut vehicle = at_rest(Blimp::level());
        fly(&mut vehicle, 2.0, 1.0, [1.0, 1.0], 5);
        let truth = vehicle.truth();
        assert_eq!(
            (truth.roll_rad, truth.pitch_rad, truth.altitude_ratio),
            (0.0, 0.0, 1.0)
        );
        assert_eq!(
            (truth.roll_rad_s, truth.pitch_rad_s, truth.climb_per_s),
            (0.0, 0.0, 0.0)
        );
    }

    #[test]
    fn commands_that_are_no_numbers_do_no_harm() {
        let mut vehicle = at_rest(Blimp::default());
        fly(&mut vehicle, 0.3, 1.0, [0.0; 2], 20);
        fly(&mut vehicle, f32::NAN, f32::NAN, [0.0; 2], 60);
        let truth = vehicle.truth();
        assert!((truth.heading_rad - 0.3).abs() < 0.01);
        assert!(truth.velocity_m_s[0].hypot(truth.velocity_m_s[1]) < 0.1);
    }
}
