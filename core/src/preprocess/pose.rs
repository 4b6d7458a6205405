//! How a frame was taken: what an autopilot knows about the vehicle besides where it is.
//!
//! ```text
//!   heading                     roll, seen from behind         pitch, seen from the right
//!
//!   map-up    frame-up          left side up                                    nose up
//!      │      ╱                   ──__                                      __──
//!      │ h  ╱                         ──__   level                      __──   pitch
//!      │  ╱                     ┈┈┈┈┈┈┈┈┈┈──__┈┈┈┈┈┈┈              ┈┈__──┈┈┈┈┈┈┈┈ level
//!      │╱                            ╱  roll  ──              tail    ╲
//!                               the camera looks left           the camera looks ahead
//! ```
//!
//! **Notation.** Angles in radians. The altitude ratio is actual over nominal altitude, so the frame's centered square
//! covers ratio × footprint. Rotations are applied as in aerospace: heading, then pitch, then roll (Z-Y-X), in axes
//! forward, right, down. The field of view is the angle over the side of the frame's largest centered square; only a
//! tilted camera needs it.
//!
//! **Limits.** A pinhole camera without distortion, over flat ground, fixed to the vehicle with frame-up forward.

use core::{
    f32::consts::{FRAC_PI_3, TAU},
    fmt,
};

/// The largest heading to either side, in radians: a whole turn.
pub const MAX_HEADING_RAD: f32 = TAU;

/// The smallest altitude ratio: the frame's square shows a sixteenth of the view then.
pub const MIN_ALTITUDE_RATIO: f32 = 0.25;

/// The largest altitude ratio: the view takes a sixteenth of the square then.
pub const MAX_ALTITUDE_RATIO: f32 = 4.0;

/// The largest roll and pitch to either side, in radians: 60°.
pub const MAX_TILT_RAD: f32 = FRAC_PI_3;

/// The smallest field of view, in radians: 10°.
pub const MIN_FIELD_OF_VIEW_RAD: f32 = 10.0_f32.to_radians();

/// The largest field of view, in radians: 150°.
pub const MAX_FIELD_OF_VIEW_RAD: f32 = 150.0_f32.to_radians();

/// Heading, altitude and tilt of the camera; a pose that exists is in the ranges above.
///
/// # Examples
/// ```
/// use eigenmark_core::preprocess::Pose;
/// let level = Pose::new(0.5, 1.1)?;
/// let tilted = level.tilted(0.1, -0.05, 60_f32.to_radians())?;
/// assert_eq!(tilted.tilted(0.0, 0.0, 1.0)?, level);
/// assert!(Pose::new(0.0, 0.0).is_err());
/// # Ok::<(), eigenmark_core::preprocess::PoseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    heading_rad: f32,
    altitude_ratio: f32,
    tilt: Option<Tilt>,
}

/// Roll and pitch, not both zero, and the field of view that says what they do to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tilt {
    roll_rad: f32,
    pitch_rad: f32,
    field_of_view_rad: f32,
}

/// Why numbers are not a pose. Each variant carries the number found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PoseError {
    /// The heading is not within [`MAX_HEADING_RAD`].
    Heading(f32),
    /// The altitude ratio is not in [`MIN_ALTITUDE_RATIO`]..=[`MAX_ALTITUDE_RATIO`].
    Altitude(f32),
    /// The roll is not within [`MAX_TILT_RAD`].
    Roll(f32),
    /// The pitch is not within [`MAX_TILT_RAD`].
    Pitch(f32),
    /// The field of view is not in [`MIN_FIELD_OF_VIEW_RAD`]..=[`MAX_FIELD_OF_VIEW_RAD`].
    FieldOfView(f32),
}

impl Pose {
    /// Straight down, frame-up map-up, at nominal altitude.
    pub const NOMINAL: Self = Self {
        heading_rad: 0.0,
        altitude_ratio: 1.0,
        tilt: None,
    };

    /// A camera that looks straight down: heading in radians, clockwise from map-up to frame-up, and actual over
    /// nominal altitude.
    ///
    /// # Errors
    /// When a number is out of its range or not a number.
    pub fn new(heading_rad: f32, altitude_ratio: f32) -> Result<Self, PoseError> {
        // NaN is in no range.
        if !(-MAX_HEADING_RAD..=MAX_HEADING_RAD).contains(&heading_rad) {
            return Err(PoseError::Heading(heading_rad));
        }
        if !(MIN_ALTITUDE_RATIO..=MAX_ALTITUDE_RATIO).contains(&altitude_ratio) {
            return Err(PoseError::Altitude(altitude_ratio));
        }
        Ok(Self {
            heading_rad,
            altitude_ratio,
            tilt: None,
        })
    }

    /// The same pose with the vehicle tilted: roll (right side down) and pitch (nose up) in radians, in place of any
    /// it had, and the field of view over the side of the frame's square.
    ///
    /// # Errors
    /// When a number is out of its range or not a number.
    pub fn tilted(
        self,
        roll_rad: f32,
        pitch_rad: f32,
        field_of_view_rad: f32,
    ) -> Result<Self, PoseError> {
        let tilts = -MAX_TILT_RAD..=MAX_TILT_RAD;
        if !tilts.contains(&roll_rad) {
            return Err(PoseError::Roll(roll_rad));
        }
        if !tilts.contains(&pitch_rad) {
            return Err(PoseError::Pitch(pitch_rad));
        }
        if !(MIN_FIELD_OF_VIEW_RAD..=MAX_FIELD_OF_VIEW_RAD).contains(&field_of_view_rad) {
            return Err(PoseError::FieldOfView(field_of_view_rad));
        }
        let tilt = Tilt {
            roll_rad,
            pitch_rad,
            field_of_view_rad,
        };
        Ok(Self {
            tilt: (roll_rad != 0.0 || pitch_rad != 0.0).then_some(tilt),
            ..self
        })
    }

    /// The same pose with a tilt that exists in place of any it had, or with none.
    #[must_use]
    pub fn with_tilt(self, tilt: Option<Tilt>) -> Self {
        Self { tilt, ..self }
    }

    /// Heading in radians, clockwise from map-up to frame-up.
    #[must_use]
    pub fn heading_rad(&self) -> f32 {
        self.heading_rad
    }

    /// Actual over nominal altitude.
    #[must_use]
    pub fn altitude_ratio(&self) -> f32 {
        self.altitude_ratio
    }

    /// Roll and pitch, unless both are zero.
    #[must_use]
    pub fn tilt(&self) -> Option<Tilt> {
        self.tilt
    }

    /// Whether this is [`NOMINAL`](Self::NOMINAL), exactly.
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        *self == Self::NOMINAL
    }
}

impl Tilt {
    /// Roll in radians, right side down.
    #[must_use]
    pub fn roll_rad(&self) -> f32 {
        self.roll_rad
    }

    /// Pitch in radians, nose up.
    #[must_use]
    pub fn pitch_rad(&self) -> f32 {
        self.pitch_rad
    }

    /// Angle over the side of the frame's square, in radians.
    #[must_use]
    pub fn field_of_view_rad(&self) -> f32 {
        self.field_of_view_rad
    }
}

impl fmt::Display for PoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, found, lowest, highest) = match *self {
            Self::Heading(found) => ("a heading", found, -MAX_HEADING_RAD, MAX_HEADING_RAD),
            Self::Altitude(found) => {
                return write!(
                    f,
                    "an altitude ratio of {found}; expected {MIN_ALTITUDE_RATIO} to {MAX_ALTITUDE_RATIO}"
                );
            }
            Self::Roll(found) => ("a roll", found, -MAX_TILT_RAD, MAX_TILT_RAD),
            Self::Pitch(found) => ("a pitch", found, -MAX_TILT_RAD, MAX_TILT_RAD),
            Self::FieldOfView(found) => (
                "a field of view",
                found,
                MIN_FIELD_OF_VIEW_RAD,
                MAX_FIELD_OF_VIEW_RAD,
            ),
        };
        // People think in degrees; tenths hide the rounding of radians.
        write!(
            f,
            "{name} of {:.1}°; expected {:.0} to {:.0}°",
            found.to_degrees(),
            lowest.to_degrees(),
            highest.to_degrees()
        )
    }
}

impl core::error::Error for PoseError {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn numbers_out_of_range_are_named() {
        let fails = |pose: Result<Pose, PoseError>| pose.expect_err("out of range").to_string();
        assert_eq!(
            fails(Pose::new(7.0, 1.0)),
            "a heading of 401.1°; expected -360 to 360°"
        );
        assert_eq!(
            fails(Pose::new(0.0, 0.2)),
            "an altitude ratio of 0.2; expected 0.25 to 4"
        );
        let tilted =
            |roll, pitch, view| Pose::new(0.0, 1.0).and_then(|pose| pose.tilted(roll, pitch, view));
        assert_eq!(
            fails(tilted(1.2, 0.0, 1.0)),
            "a roll of 68.8°; expected -60 to 60°"
        );
        assert_eq!(
            fails(tilted(0.0, f32::NAN, 1.0)),
            "a pitch of NaN°; expected -60 to 60°"
        );
        assert_eq!(
            fails(tilted(0.0, 0.1, 0.1)),
            "a field of view of 5.7°; expected 10 to 150°"
        );
        assert!(fails(Pose::new(f32::INFINITY, 1.0)).contains("inf"));
        assert!(matches!(
            Pose::new(0.0, f32::NAN),
            Err(PoseError::Altitude(_))
        ));
    }

    #[test]
    fn a_pose_without_turn_climb_or_tilt_is_nominal() {
        let pose = Pose::new(-0.0, 1.0).and_then(|pose| pose.tilted(0.0, -0.0, 1.0));
        assert!(pose.expect("in range").is_nominal());
        assert!(!Pose::new(1e-6, 1.0).expect("in range").is_nominal());
    }

    #[test]
    fn a_tilt_can_be_handed_on() {
        let tilted = Pose::NOMINAL.tilted(0.1, -0.2, 1.0).expect("in range");
        let turned = Pose::new(0.5, 1.1).expect("in range");
        assert_eq!(
            turned.with_tilt(tilted.tilt()),
            turned.tilted(0.1, -0.2, 1.0).expect("in range")
        );
        assert_eq!(turned.with_tilt(None), turned);
    }

    #[test]
    fn the_limits_themselves_are_accepted_in_degrees() {
        let radians = |degrees: f64| degrees.to_radians() as f32;
        let pose = Pose::new(radians(360.0), 4.0).expect("in range");
        for view in [10.0, 150.0] {
            assert!(
                pose.tilted(radians(60.0), radians(-60.0), radians(view))
                    .is_ok()
            );
        }
    }
}
