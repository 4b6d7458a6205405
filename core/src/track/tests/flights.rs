//! Flights of hundreds of frames: drift, stated covariances, tilts that are not quite known.

use std::{boxed::Box, println};

use super::*;

/// A smooth random flight: turns and climbs that last, and wind from the side.
struct Wanderer {
    sight: Sight,
    random: Random,
    turn: f64,
    climb: f64,
    /// Sides per frame.
    speed: f64,
}

impl Wanderer {
    fn new(side_px: u16, seed: u32, speed: f64) -> Self {
        let mut random = Random(seed.wrapping_mul(7919).wrapping_add(17));
        (0..9).for_each(|_| _ = random.share());
        Self {
            sight: Sight::new(side_px),
            random,
            turn: 0.0,
            climb: 0.0,
            speed,
        }
    }

    fn step(&mut self) {
        let sight = &mut self.sight;
        self.turn = 0.9 * self.turn + 0.004 * self.random.gaussian();
        let back = 0.01 * sight.altitude_ratio.ln();
        self.climb = 0.9 * self.climb + 0.001 * self.random.gaussian() - back;
        sight.heading_rad += self.turn;
        sight.altitude_ratio *= self.climb.exp();
        let (sin, cos) = sight.heading_rad.sin_cos();
        let drift = 0.3 * self.speed * (self.random.share() - 0.5);
        sight.place[0] += self.speed * sin + drift * cos;
        sight.place[1] += -self.speed * cos + drift * sin;
        sight.seed = sight.seed.wrapping_mul(69_069).wrapping_add(1);
    }
}

/// A circle of 25 sides once around: with sides of 100 m, 2.5 km.
#[test]
fn a_long_closed_loop_drifts_by_less_than_a_hundredth() {
    let mut odometry = Box::new(Odometry::whole());
    let mut sight = Sight {
        noise: 1.0,
        ..Sight::new(120)
    };
    sight.show(&mut odometry);
    let (count, radius) = (840, 4.0);
    let mut worst = 0.0_f64;
    for number in 1..=count {
        let turn = TAU * f64::from(number) / f64::from(count);
        sight.place = [radius * (1.0 - turn.cos()), -radius * turn.sin()];
        sight.heading_rad = turn;
        sight.altitude_ratio = 1.0 + 0.1 * (3.0 * turn).sin();
        sight.seed = number;
        assert!(sight.show(&mut odometry).is_some(), "frame {number}");
        worst = worst.max(distance(errors(&odometry, &sight)));
    }
    let share = worst / (radius * TAU);
    println!("drift {:.2} %", 100.0 * share);
    assert!(share < 0.01, "{share}");
}

/// Normalized squared errors are 1 on average where covariances are honest. Twenty flights give their mean of one number
/// to about 1 ± 0.3, of four to 1 ± 0.16; errors of tracking are not quite normal, nor all independent.
#[test]
fn covariances_are_honest() {
    let flights = 20;
    for (side_px, speed, noise) in [(80, 0.03, 1.0), (96, 0.015, 3.0)] {
        let (mut all, mut each) = (0.0, [0.0; 4]);
        for seed in 0..flights {
            let mut wanderer = Wanderer::new(side_px, seed, speed);
            wanderer.sight.noise = noise;
            let mut odometry = Box::new(Odometry::whole());
            wanderer.sight.show(&mut odometry);
            for _ in 0..100 {
                wanderer.step();
                assert!(wanderer.sight.show(&mut odometry).is_some());
            }
            let errors = errors(&odometry, &wanderer.sight);
            let covariance = odometry.covariance().map(f64::from);
            for (index, error) in errors.into_iter().enumerate() {
                each[index] += error * error / covariance[(index, index)] / f64::from(flights);
            }
            let errors = nalgebra::Vector4::from(errors);
            let inverse = covariance.try_inverse().expect("positive");
            all += errors.dot(&(inverse * errors)) / 4.0 / f64::from(flights);
        }
        println!("{side_px} pixels: {all:.2}, {each:.2?}");
        assert!((0.5..2.0).contains(&all), "{all} {each:?}");
        assert!(
            each.iter().all(|nees| (0.25..2.5).contains(nees)),
            "{each:?}"
        );
    }
}

/// What is told of the tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    /// Wrong by up to a degree, in every frame anew.
    Anew,
    /// Wrong by a degree in roll and in pitch, all the time; a compass and an altimeter hold heading and altitude.
    Lasting,
}

/// The place errs by what a degree moves the middle of the frame, 1.5 % of a side at this field of view, for as long as
/// the tilt does, and hardly more: over six sides, what is left is what two hundredths of the way are.
#[test]
fn errors_of_the_tilt_do_not_accumulate() {
    let degree = TAU / 360.0;
    for told in [Told::Anew, Told::Lasting] {
        let mut odometry = Box::new(Odometry::whole());
        let mut wanderer = Wanderer::new(96, 5, 0.02);
        let mut random = Random(99);
        wanderer.sight.show(&mut odometry);
        let mut way = 0.0;
        for number in 0..300 {
            let before = wanderer.sight.place;
            wanderer.step();
            let sight = &mut wanderer.sight;
            way += (sight.place[0] - before[0]).hypot(sight.place[1] - before[1]);
            sight.roll_rad = 0.06 * (f64::from(number) / 9.0).sin();
            sight.pitch_rad = 0.04 * (f64::from(number) / 13.0).sin();
            let by = match told {
                Told::Anew => [0; 2].map(|_| degree * (2.0 * random.share() - 1.0)),
                Told::Lasting => [degree, -degree],
            };
            let tilt = Sight {
                roll_rad: sight.roll_rad + by[0],
                pitch_rad: sight.pitch_rad + by[1],
                ..*sight
            };
            let displacement = show(&mut odometry, 96, &sight.pixels(), tilt.tilt());
            assert!(displacement.is_some(), "frame {number}");
            if told == Told::Lasting {
                let heading = sight.heading_rad + 0.03 * random.gaussian();
                let ratio = sight.altitude_ratio * (1.0 + 0.02 * random.gaussian());
                assert!(odometry.correct_heading(heading as f32, 0.03 * 0.03));
                assert!(odometry.correct_altitude(ratio as f32, 0.02 * 0.02));
            }
        }
        wanderer.step();
        wanderer.sight.show(&mut odometry).expect("overlaps");
        let errors = errors(&odometry, &wanderer.sight);
        println!(
            "{told:?}: {errors:.3?} after {way:.1} sides, sd {:.3?}",
            odometry.covariance().diagonal().map(f32::sqrt)
        );
        assert!(
            distance(errors) < 0.02 * way,
            "{told:?}: {errors:?} after {way}"
        );
    }
}
