//! What is said of a board on the command line.

use clap::Args;
use eigenmark::flash::Board;
use eigenmark_core::slots::Setup;

/// What the board is told with the atlas.
#[derive(Clone, Copy, Debug, Args)]
pub struct SetupArgs {
    /// Meters per map pixel, for the record [default: 1]
    #[arg(long, value_name = "M")]
    meters_per_px: Option<f32>,
    /// Angle over the side of the camera's square, in degrees, for the record [default: 60]
    #[arg(long, value_name = "DEG")]
    field_of_view: Option<f32>,
}

impl SetupArgs {
    /// Whether any of it was said.
    pub fn is_given(&self) -> bool {
        self.meters_per_px.is_some() || self.field_of_view.is_some()
    }

    /// The setup; it may have numbers out of their ranges.
    pub fn setup(&self) -> Setup {
        let default = Setup::default();
        let field_of_view_rad = self.field_of_view.map(f32::to_radians);
        Setup {
            meters_per_px: self.meters_per_px.unwrap_or(default.meters_per_px),
            field_of_view_rad: field_of_view_rad.unwrap_or(default.field_of_view_rad),
        }
    }
}

/// The board of that name.
pub fn board(name: &str) -> Result<&'static Board, String> {
    Board::named(name)
}

/// A setup for people.
pub fn told(setup: &Setup) -> String {
    format!(
        "{} m per pixel, field of view {}°",
        setup.meters_per_px,
        degrees(setup)
    )
}

/// A setup for programs: meters per pixel, and the field of view in degrees.
pub fn numbers(setup: &Setup) -> (f64, f64) {
    // As it was given: the shortest number that is this f32, not the nearest f64.
    let shortest = setup.meters_per_px.to_string().parse();
    (
        shortest.unwrap_or_else(|_| setup.meters_per_px.into()),
        degrees(setup),
    )
}

/// Field of view in degrees, to a ten-thousandth: as it was given.
fn degrees(setup: &Setup) -> f64 {
    (f64::from(setup.field_of_view_rad).to_degrees() * 1e4).round() / 1e4
}
