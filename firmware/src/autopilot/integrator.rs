//! Displacements and estimates → where the vehicle is on the map, at frame rate.
//!
//! **Notation.** Meters north and east of the map's upper left corner; north is map-up, east map-right. The heading is
//! in radians, clockwise from north. Covariances are of north, east and heading, in this order.
//!
//! **Method.** Every displacement is added, along the heading that the vehicle had. A confident estimate pulls: what
//! is within the gate by and by, what is beyond it at once, and that is a reset. A weighted mean of two places whose
//! errors are related in an unknown way has at most the weighted mean of their covariances: that is what is stated.
//! Estimates come from the same displacements, so nothing less would be honest.
//!
//! **Before the first confident estimate** the place is relative to where the vehicle started, with variances of
//! [`UNKNOWN_M2`]; that estimate is a reset.
//!
//! **Limits.** An altitude that is told wrong makes the way too long by its share; that is not in the covariance.

use eigenmark_core::{
    belief::Estimate,
    math::{sin_cos, turn, wrapped},
    track::Displacement,
};
use nalgebra::{ArrayStorage, Matrix3};

/// A variance that says nothing, in squared meters: a kilometer, squared.
pub(super) const UNKNOWN_M2: f32 = 1e6;

/// The same of an angle, in squared radians: half a turn, squared.
pub(super) const UNKNOWN_RAD2: f32 = core::f32::consts::PI * core::f32::consts::PI;

/// Of a heading that is told or estimated, in squared radians: 8°, as the navigator takes it.
pub(super) const HEADING_VARIANCE: f32 = 0.14 * 0.14;

/// A place that is farther from the estimate than this, in the estimate's standard deviations, jumps to it.
pub(super) const GATE: f32 = 3.0;

/// A heading that is farther from what is told or estimated jumps to it: 20°.
pub(super) const HEADING_GATE_RAD: f32 = 20.0_f32.to_radians();

/// Within the gates, what is off shrinks to 1/e of it in this time, in seconds.
const PULL_S: f32 = 2.0;

/// For how long a vehicle that is not seen to move is taken to go on as it did, in seconds.
const GO_ON_S: f32 = 2.0;

/// Standard deviation of turns that were not seen, in radians per second.
const UNSEEN_RAD_PER_S: f32 = 0.1;

/// The longest step that is believed, in seconds.
const LONGEST_S: f32 = 60.0;

/// Covariance of north, east (meters) and heading (radians).
pub(super) type Covariance = Matrix3<f32>;

/// Where the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    /// North and east, in meters.
    pub place_m: [f32; 2],
    /// `None` as long as nothing says it.
    pub heading_rad: Option<f32>,
    pub covariance: Covariance,
}

/// What a step brings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Input<'a> {
    /// Since the step before, in seconds.
    pub step_s: f32,
    pub displacement: Option<&'a Displacement>,
    /// The next displacement covers this step, too.
    pub is_waiting: bool,
    /// Clockwise from north, in radians.
    pub heading_rad: Option<f32>,
    pub estimate: Option<&'a Estimate>,
    /// What a side of the frame's square covers at nominal altitude.
    pub side_m: f32,
    pub meters_per_px: f32,
}

/// Holds the pose, and how often it was reset.
#[derive(Clone, Debug)]
pub(super) struct Integrator {
    place_m: [f32; 2],
    heading_rad: f32,
    covariance: Covariance,
    /// The place is one on the map.
    is_placed: bool,
    /// The heading is clockwise from north.
    is_oriented: bool,
    /// As last seen, north and east, in meters per second.
    velocity: [f32; 2],
    /// Since a displacement was last taken in, in seconds.
    unseen_s: f32,
    resets: u8,
}

impl Integrator {
    pub const fn new() -> Self {
        Self {
            place_m: [0.0; 2],
            heading_rad: 0.0,
            covariance: Covariance::from_array_storage(ArrayStorage([
                [UNKNOWN_M2, 0.0, 0.0],
                [0.0, UNKNOWN_M2, 0.0],
                [0.0, 0.0, UNKNOWN_RAD2],
            ])),
            is_placed: false,
            is_oriented: false,
            velocity: [0.0; 2],
            unseen_s: 0.0,
            resets: 0,
        }
    }

    /// Begins anew, on another map. Resets are counted on.
    pub fn restart(&mut self) {
        *self = Self {
            resets: self.resets,
            ..Self::new()
        };
    }

    /// How often the pose was reset; 0 comes after 255.
    pub fn resets(&self) -> u8 {
        self.resets
    }

    /// Takes in a step, and says what time its displacement took, in seconds.
    pub fn advance(&mut self, input: &Input<'_>) -> f32 {
        let step_s = if (0.0..=LONGEST_S).contains(&input.step_s) {
            input.step_s
        } else {
            0.0
        };
        self.unseen_s = (self.unseen_s + step_s).min(LONGEST_S);
        let took_s = self.unseen_s;
        let mut pull = (step_s / PULL_S).min(1.0);
        match input.displacement.filter(|moved| is_finite(moved)) {
            Some(moved) => self.add(moved, input.side_m),
            None if input.is_waiting => return took_s,
            None => {
                self.go_on();
                // A turn that was not seen is no error of the heading.
                pull = 1.0;
            }
        }
        let estimate = input.estimate.filter(|estimate| is_usable(estimate));
        let heading_rad = estimate
            .map(|estimate| estimate.heading_rad)
            .or(input.heading_rad);
        if let Some(heading_rad) = heading_rad.filter(|heading| heading.is_finite()) {
            self.orient(heading_rad, pull);
        }
        if let Some(estimate) = estimate {
            self.correct(estimate, input.meters_per_px, (step_s / PULL_S).min(1.0));
        }
        took_s
    }

    /// Where the vehicle is now.
    pub fn pose(&self) -> Pose {
        let (way, variance) = self.unseen();
        let [north, east] = self.place_m;
        let mut covariance = self.covariance;
        covariance.m11 += variance;
        covariance.m22 += variance;
        covariance.m33 += self.unseen_rad2();
        Pose {
            place_m: [north + way[0], east + way[1]],
            heading_rad: self.is_oriented.then_some(self.heading_rad),
            covariance,
        }
    }

    /// A way along the heading that was.
    fn add(&mut self, moved: &Displacement, side_m: f32) {
        let (sin, cos) = sin_cos(self.heading_rad);
        let turned = Covariance::new(
            side_m * cos,
            -side_m * sin,
            0.0,
            side_m * sin,
            side_m * cos,
            0.0,
            0.0,
            0.0,
            1.0,
        );
        let (forward, right) = (moved.forward * side_m, moved.right * side_m);
        let way = [forward * cos - right * sin, forward * sin + right * cos];
        let of = &moved.covariance;
        let added = Covariance::new(
            of.m11, of.m12, of.m13, //
            of.m12, of.m22, of.m23, //
            of.m13, of.m23, of.m33,
        );
        // A wrong heading leads astray.
        let propagation = Covariance::new(
            1.0, 0.0, -way[1], //
            0.0, 1.0, way[0], //
            0.0, 0.0, 1.0,
        );
        self.covariance = propagation * self.covariance * propagation.transpose()
            + turned * added * turned.transpose();
        if self.unseen_s > 0.0 {
            self.velocity = way.map(|part| part / self.unseen_s);
        }
        self.shift(way);
        self.heading_rad = wrapped(self.heading_rad + moved.yaw_rad);
        self.unseen_s = 0.0;
    }

    /// As it went, when nobody will say how it did.
    fn go_on(&mut self) {
        let (way, variance) = self.unseen();
        self.covariance.m11 += variance;
        self.covariance.m22 += variance;
        self.covariance.m33 += self.unseen_rad2();
        self.shift(way);
        self.unseen_s = 0.0;
    }

    /// The way since the vehicle was last seen to move, and the variance of each part of it.
    fn unseen(&self) -> ([f32; 2], f32) {
        let way = self
            .velocity
            .map(|speed| speed * self.unseen_s.min(GO_ON_S));
        let [north, east] = self.velocity.map(|speed| speed * self.unseen_s);
        // As the navigator takes it: half of the way.
        (way, (north * north + east * east) / 4.0)
    }

    fn unseen_rad2(&self) -> f32 {
        let unseen_rad = UNSEEN_RAD_PER_S * self.unseen_s;
        unseen_rad * unseen_rad
    }

    fn shift(&mut self, way: [f32; 2]) {
        for (place, part) in self.place_m.iter_mut().zip(way) {
            *place += part;
        }
    }

    /// Turns to a heading, by a share of what is missing or at once.
    fn orient(&mut self, to_rad: f32, pull: f32) {
        let missing = turn(self.heading_rad, to_rad);
        let is_jump = missing.abs() > HEADING_GATE_RAD;
        if !self.is_oriented || is_jump {
            // What was unknown does not jump.
            if self.is_oriented {
                self.resets = self.resets.wrapping_add(1);
            }
            self.is_oriented = true;
            self.heading_rad = wrapped(to_rad);
            self.settle_heading();
        } else {
            self.heading_rad = wrapped(self.heading_rad + pull * missing);
            let of = &mut self.covariance;
            let variance = of.m33 + pull * (HEADING_VARIANCE - of.m33);
            // What is less has less to do with the place.
            let kept = (variance / of.m33).min(1.0);
            (of.m13, of.m31) = (of.m13 * kept, of.m31 * kept);
            (of.m23, of.m32) = (of.m23 * kept, of.m32 * kept);
            of.m33 = variance;
        }
    }

    /// The heading's error is a new one.
    fn settle_heading(&mut self) {
        let of = &self.covariance;
        self.covariance = Covariance::new(
            of.m11,
            of.m12,
            0.0,
            of.m12,
            of.m22,
            0.0,
            0.0,
            0.0,
            HEADING_VARIANCE,
        );
    }

    /// Pulls to an estimate, by a share of what is missing or at once.
    fn correct(&mut self, estimate: &Estimate, meters_per_px: f32, pull: f32) {
        let to = [
            -estimate.position.y_px * meters_per_px,
            estimate.position.x_px * meters_per_px,
        ];
        let square = meters_per_px * meters_per_px;
        let [xx, xy, yy] = estimate.covariance_px2.map(|part| part * square);
        let target = Covariance::new(yy, -xy, 0.0, -xy, xx, 0.0, 0.0, 0.0, self.covariance.m33);
        let [north, east] = self.place_m;
        let missing = [to[0] - north, to[1] - east];
        let distance2 = missing[0] * missing[0] + missing[1] * missing[1];
        let is_beyond = distance2 > GATE * GATE * (xx + yy);
        if !self.is_placed || is_beyond {
            self.resets = self.resets.wrapping_add(1);
            self.is_placed = true;
            self.place_m = to;
            self.covariance = target;
        } else {
            self.shift(missing.map(|part| pull * part));
            self.covariance += (target - self.covariance) * pull;
        }
    }
}

fn is_finite(moved: &Displacement) -> bool {
    let numbers = [moved.forward, moved.right, moved.yaw_rad];
    let covariance = moved.covariance.iter();
    numbers
        .iter()
        .chain(covariance)
        .all(|part| part.is_finite())
}

/// Whether an estimate is confident, and a number.
fn is_usable(estimate: &Estimate) -> bool {
    let [xx, xy, yy] = estimate.covariance_px2;
    let position = estimate.position;
    let numbers = [
        xx,
        xy,
        yy,
        position.x_px,
        position.y_px,
        estimate.heading_rad,
    ];
    estimate.is_confident() && numbers.iter().all(|part| part.is_finite()) && xx >= 0.0 && yy >= 0.0
}

#[cfg(test)]
mod tests {
    use eigenmark_core::landmark::Point;
    use proptest::{collection::vec, prelude::*};

    use super::*;

    const STEP_S: f32 = 1.0 / 32.0;

    /// 100 px of 0.5 m.
    const SIDE_M: f32 = 50.0;

    fn moved(forward: f32, right: f32, yaw_rad: f32) -> Displacement {
        let mut covariance = eigenmark_core::track::Covariance::zeros();
        covariance.m11 = 1e-6;
        covariance.m22 = 1e-6;
        covariance.m33 = 1e-6;
        Displacement {
            forward,
            right,
            yaw_rad,
            scale: 1.0,
            covariance,
            tracked: 20,
            inliers: 20,
        }
    }

    fn at(x_px: f32, y_px: f32) -> Estimate {
        Estimate {
            position: Point { x_px, y_px },
            covariance_px2: [16.0, 4.0, 36.0],
            heading_rad: 0.0,
            confidence: 1.0,
        }
    }

    fn step(
        integrator: &mut Integrator,
        displacement: Option<&Displacement>,
        estimate: Option<&Estimate>,
    ) -> f32 {
        integrator.advance(&Input {
            step_s: STEP_S,
            displacement,
            is_waiting: false,
            heading_rad: None,
            estimate,
            side_m: SIDE_M,
            meters_per_px: 0.5,
        })
    }

    fn assert_near(found: [f32; 2], expected: [f32; 2]) {
        let is_near = found
            .iter()
            .zip(expected)
            .all(|(found, expected)| (found - expected).abs() < 1e-3);
        assert!(is_near, "{found:?} instead of {expected:?}");
    }

    #[test]
    fn ways_add_up_along_the_heading() {
        let mut integrator = Integrator::new();
        for _ in 0..32 {
            step(&mut integrator, Some(&moved(0.01, 0.0, 0.0)), None);
        }
        assert_near(integrator.pose().place_m, [16.0, 0.0]);
        // To the right, and on.
        let quarter = core::f32::consts::FRAC_PI_2;
        step(&mut integrator, Some(&moved(0.0, 0.0, quarter)), None);
        step(&mut integrator, Some(&moved(0.1, 0.04, 0.0)), None);
        let pose = integrator.pose();
        assert_near(pose.place_m, [14.0, 5.0]);
        assert_eq!((pose.heading_rad, integrator.resets()), (None, 0));
        assert!(pose.covariance.m11 >= UNKNOWN_M2);
    }

    #[test]
    fn a_circle_comes_back() {
        let mut integrator = Integrator::new();
        let turn = core::f32::consts::TAU / 64.0;
        for _ in 0..64 {
            step(&mut integrator, Some(&moved(0.02, 0.0, turn)), None);
        }
        assert_near(integrator.pose().place_m, [0.0, 0.0]);
    }

    #[test]
    fn a_fix_puts_the_place_on_the_map() {
        let mut integrator = Integrator::new();
        step(
            &mut integrator,
            Some(&moved(0.1, 0.0, 0.0)),
            Some(&at(200.0, 300.0)),
        );
        let pose = integrator.pose();
        // North is up, and rows count down.
        assert_near(pose.place_m, [-150.0, 100.0]);
        assert_eq!(integrator.resets(), 1);
        let covariance = pose.covariance;
        assert_eq!(
            [covariance.m11, covariance.m12, covariance.m22],
            [9.0, -1.0, 4.0]
        );
    }

    #[test]
    fn unsure_estimates_and_those_that_are_none_change_nothing() {
        let mut integrator = Integrator::new();
        let unsure = Estimate {
            confidence: 0.98,
            ..at(1.0, 1.0)
        };
        for estimate in [unsure, at(f32::NAN, 0.0), at(0.0, f32::INFINITY)] {
            step(
                &mut integrator,
                Some(&moved(0.1, 0.0, 0.0)),
                Some(&estimate),
            );
        }
        let nothing = moved(f32::NAN, 0.0, 0.0);
        step(&mut integrator, Some(&nothing), None);
        assert_eq!(integrator.resets(), 0);
        assert!(
            integrator
                .pose()
                .place_m
                .iter()
                .all(|part| part.is_finite())
        );
    }

    #[test]
    fn small_differences_are_pulled_and_large_ones_jump() {
        let mut integrator = Integrator::new();
        let still = moved(0.0, 0.0, 0.0);
        step(&mut integrator, Some(&still), Some(&at(0.0, 0.0)));
        // The gate is at 3·√(16 + 36) = 21.6 px.
        let mut before = 0.0;
        for _ in 0..64 {
            step(&mut integrator, Some(&still), Some(&at(21.0, 0.0)));
            let [_, east] = integrator.pose().place_m;
            assert!(east > before && east - before < 10.5 * STEP_S);
            before = east;
        }
        // Two seconds: 1/e of 10.5 m is left.
        assert!((10.5 - before - 10.5 / core::f32::consts::E).abs() < 0.1);
        assert_eq!(integrator.resets(), 1);
        step(&mut integrator, Some(&still), Some(&at(60.0, 0.0)));
        assert_near(integrator.pose().place_m, [0.0, 30.0]);
        assert_eq!(integrator.resets(), 2);
    }

    #[test]
    fn resets_count_beyond_a_byte() {
        let mut integrator = Integrator::new();
        for index in 0..=256 {
            let there = at(if index % 2 == 0 { 0.0 } else { 100.0 }, 0.0);
            step(&mut integrator, Some(&moved(0.0, 0.0, 0.0)), Some(&there));
        }
        assert_eq!(integrator.resets(), 1);
        integrator.restart();
        assert_eq!(integrator.resets(), 1);
        assert_eq!(integrator.pose().heading_rad, None);
    }

    #[test]
    fn the_covariance_grows_on_the_way_and_shrinks_to_the_estimates() {
        let mut integrator = Integrator::new();
        step(
            &mut integrator,
            Some(&moved(0.0, 0.0, 0.0)),
            Some(&at(0.0, 0.0)),
        );
        let mut last = integrator.pose().covariance;
        for _ in 0..100 {
            step(&mut integrator, Some(&moved(0.02, 0.0, 0.0)), None);
            let now = integrator.pose().covariance;
            assert!(now.m11 > last.m11 && now.m22 > last.m22 && now.m33 > last.m33);
            last = now;
        }
        // 100 m ahead with a heading that may be 8° off: 14 m to the side.
        assert!((last.m22 - 4.0 - 0.14 * 0.14 * 1e4).abs() < 3.0, "{last}");
        assert!(last.m23 > 0.0 && last.determinant() > 0.0);
        for _ in 0..1000 {
            let north = integrator.pose().place_m[0];
            let there = at(0.0, -north / 0.5);
            step(&mut integrator, Some(&moved(0.0, 0.0, 0.0)), Some(&there));
        }
        let covariance = integrator.pose().covariance;
        assert!((covariance.m11 - 9.0).abs() < 0.2 && (covariance.m22 - 4.0).abs() < 0.2);
        assert!(covariance.m23.abs() < 0.01);
        assert_eq!(integrator.resets(), 1);
    }

    #[test]
    fn a_frame_that_was_passed_over_is_not_counted_twice() {
        let mut integrator = Integrator::new();
        step(&mut integrator, Some(&moved(0.0, 0.0, 0.0)), None);
        step(&mut integrator, Some(&moved(0.02, 0.0, 0.0)), None);
        let waiting = Input {
            step_s: STEP_S,
            displacement: None,
            is_waiting: true,
            heading_rad: None,
            estimate: None,
            side_m: SIDE_M,
            meters_per_px: 0.5,
        };
        integrator.advance(&waiting);
        // It goes on meanwhile.
        assert_near(integrator.pose().place_m, [2.0, 0.0]);
        let took_s = step(&mut integrator, Some(&moved(0.05, 0.0, 0.0)), None);
        assert_near(integrator.pose().place_m, [3.5, 0.0]);
        assert_eq!(took_s, 2.0 * STEP_S);
        // Nobody will say how far it went.
        let before = integrator.pose().covariance.m11;
        integrator.advance(&waiting);
        let took_s = step(&mut integrator, None, None);
        assert_near(integrator.pose().place_m, [6.0, 0.0]);
        assert_eq!(took_s, 2.0 * STEP_S);
        let grown = integrator.pose().covariance.m11 - before;
        assert!((grown - 2.5 * 2.5 / 4.0).abs() < 0.1, "{grown}");
    }

    #[test]
    fn a_camera_that_stays_away_does_not_carry_the_place_off() {
        let mut integrator = Integrator::new();
        step(&mut integrator, Some(&moved(0.02, 0.0, 0.0)), None);
        for _ in 0..100_000 {
            integrator.advance(&Input {
                step_s: STEP_S,
                displacement: None,
                is_waiting: true,
                heading_rad: None,
                estimate: None,
                side_m: SIDE_M,
                meters_per_px: 0.5,
            });
        }
        let pose = integrator.pose();
        assert_near(pose.place_m, [1.0 + 32.0 * GO_ON_S, 0.0]);
        assert!(pose.covariance.iter().all(|part| part.is_finite()));
    }

    proptest! {
        /// Whatever comes, in whatever order.
        #[test]
        fn covariances_are_those_of_something(
            steps in vec((0..4_u8, -0.2..0.2_f32, -0.2..0.2_f32, any::<bool>(), 0..3_u8), 1..200),
        ) {
            let mut integrator = Integrator::new();
            for (what, forward, yaw_rad, is_told, place) in steps {
                integrator.advance(&Input {
                    step_s: STEP_S,
                    displacement: (what > 1).then_some(&moved(forward, 0.1, yaw_rad)),
                    is_waiting: what == 1,
                    heading_rad: is_told.then_some(yaw_rad * 10.0),
                    estimate: (place > 0).then_some(&at(f32::from(place) * 40.0, 0.0)),
                    side_m: SIDE_M,
                    meters_per_px: 0.5,
                });
                let of = integrator.pose().covariance;
                prop_assert!(of.iter().all(|part| part.is_finite()));
                for (shared, first, second) in [
                    (of.m12, of.m11, of.m22),
                    (of.m13, of.m11, of.m33),
                    (of.m23, of.m22, of.m33),
                ] {
                    prop_assert!(first > 0.0 && second > 0.0);
                    prop_assert!(shared * shared <= first * second * 1.001, "{}", of);
                }
            }
        }
    }

    #[test]
    fn headings_are_pulled_and_jump_as_places_do() {
        let mut integrator = Integrator::new();
        let mut told = |heading_rad| {
            integrator.advance(&Input {
                step_s: STEP_S,
                displacement: Some(&moved(0.0, 0.0, 0.0)),
                is_waiting: false,
                heading_rad: Some(heading_rad),
                estimate: None,
                side_m: SIDE_M,
                meters_per_px: 0.5,
            });
            let pose = integrator.pose();
            (
                pose.heading_rad.expect("was told"),
                pose.covariance.m33,
                integrator.resets(),
            )
        };
        // What was unknown does not jump.
        assert_eq!(told(3.0), (3.0, HEADING_VARIANCE, 0));
        let (heading, _, resets) = told(-3.0);
        assert!(heading > 3.0 && heading < 3.02 && resets == 0);
        assert_eq!(told(2.0), (2.0, HEADING_VARIANCE, 1));
    }
}
