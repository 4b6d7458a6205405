//! `demo`: the whole job on the built-in map.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use clap::Args;
use eigenmark::{
    atlas::Summary,
    evaluate::{Deviation, Outcome, deviated_fixes},
    learn::Settings,
    map::{Map, city},
    output::{Progress, create_dir, write_file},
    report::{AtlasReport, FlightReport, atlas_cell, atlas_report},
    simulate::{Legs, Waypoint, fly_legs},
    train::train,
};
use eigenmark_core::landmark::Point;
use serde_json::json;

use super::{print_json, train::space};

/// Do the whole job on the built-in map: train, evaluate, write an atlas and a report, fly
#[derive(Debug, Args)]
pub struct Cmd {
    /// Where to write the atlas and the report
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Print the results as JSON
    #[arg(long)]
    json: bool,
}

const DEFAULT_OUT: &str = "target/demo";

/// Views per landmark of each trial.
const TRIAL_VIEWS: usize = 250;

/// Seed of trials and flight.
const SEED: u64 = 1;

const FLIGHT: Legs = Legs {
    spacing_px: 8.0,
    heading_rad: 2.0 * std::f64::consts::PI / 180.0,
    altitude: 0.02,
    noise: 2.0,
    seed: SEED,
};

impl Default for Cmd {
    fn default() -> Self {
        Self {
            out: PathBuf::from(DEFAULT_OUT),
            json: false,
        }
    }
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        create_dir(&self.out)?;
        let map = Map::city();
        let trained = train(&map, &Settings::default(), true, &Progress::Stderr)?;
        let atlas = trained.atlas();
        let atlas_path = self.out.join("city.atlas");
        write_file(&atlas_path, |file| file.write_all(trained.atlas.bytes()))?;

        let trial = |deviation| {
            let fixes = deviated_fixes(
                &map,
                &atlas,
                deviation,
                TRIAL_VIEWS,
                SEED,
                &Progress::Stderr,
            );
            Outcome::of_landmarks(&fixes)
        };
        let trials = [
            (
                "slight: ±2°, ±2 % shift, ±2 % altitude, gamma to 1.05",
                trial(&Deviation::SLIGHT),
            ),
            (
                "moderate: ±20°, ±15 % shift, altitude to 1.2, gamma to 2",
                trial(&Deviation::MODERATE),
            ),
        ];
        let places: Vec<Point> = trained
            .selected
            .landmarks
            .iter()
            .map(|&view| trained.candidates.grid().place(view))
            .collect();
        let waypoints = fly_legs(&map, &atlas, &places, &FLIGHT);

        let provenance = format!(
            "eigenmark {} · eigenmark demo · map CRC {:08x} · atlas CRC {:08x} · seed {SEED}",
            env!("CARGO_PKG_VERSION"),
            map.crc(),
            atlas.crc()
        );
        let summary = Summary::of(&atlas);
        let space = space(&trained);
        let cell = atlas_cell(&map, &summary, &space, &Progress::Stderr)?;
        let page = atlas_report(&AtlasReport {
            map: &map,
            picture: Some(&city::draw().into()),
            summary: &summary,
            space: &space,
            cell: cell.as_ref(),
            trials: &trials,
            flight: Some(FlightReport {
                waypoints: &waypoints,
                description: "From landmark to landmark in order of rank, a frame every 8 map pixels, heading within \
                              2° and altitude within 2 % of nominal.",
            }),
            provenance: &provenance,
        });
        let report_path = self.out.join("report.html");
        write_file(&report_path, |file| file.write_all(page.as_bytes()))?;

        let slight: Outcome = trials[0].1.iter().copied().sum();
        let moderate: Outcome = trials[1].1.iter().copied().sum();
        let flown = Flown::of(&waypoints);
        let mut out = io::stdout().lock();
        if self.json {
            let flight = json!({"frames": flown.frames, "known": flown.known, "median_error_px": flown.median_error_px});
            let value = json!({
                "atlas": atlas_path, "report": report_path, "summary": summary,
                "slight": slight, "moderate": moderate, "flight": flight,
            });
            return print_json(&mut out, &value);
        }
        writeln!(
            out,
            "trained    {} landmarks of {} views, {} dimensions ({:.1} % of the variance)",
            summary.landmarks,
            summary.candidates,
            summary.dims,
            100.0 * summary.covered_variance
        )?;
        for (name, outcome) in [("slight", slight), ("moderate", moderate)] {
            writeln!(
                out,
                "evaluated  {} {name}ly deviated views: {:.1} % right, {:.1} % guaranteed ({} wrongly), {:.1} % known",
                outcome.views,
                outcome.percent(outcome.right),
                outcome.percent(outcome.guaranteed),
                outcome.guaranteed_wrong,
                outcome.percent(outcome.known)
            )?;
        }
        writeln!(
            out,
            "flew       {} frames from landmark to landmark: {} known fixes, median error {:.0} map pixels",
            flown.frames, flown.known, flown.median_error_px
        )?;
        writeln!(
            out,
            "wrote      {} ({} bytes)",
            atlas_path.display(),
            summary.flash_bytes
        )?;
        writeln!(
            out,
            "wrote      {} (open it in a browser)",
            report_path.display()
        )?;
        Ok(())
    }
}

/// A flight in numbers.
struct Flown {
    frames: usize,
    known: usize,
    /// Of the known fixes; zero without any.
    median_error_px: f32,
}

impl Flown {
    fn of(waypoints: &[Waypoint]) -> Self {
        let mut errors: Vec<f32> = waypoints
            .iter()
            .filter_map(|waypoint| {
                let fix = waypoint.fix.filter(|fix| fix.known)?;
                let (dx, dy) = (
                    fix.position.x_px - waypoint.place.x_px,
                    fix.position.y_px - waypoint.place.y_px,
                );
                Some(dx.hypot(dy))
            })
            .collect();
        errors.sort_by(f32::total_cmp);
        let median_error_px = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
        Self {
            frames: waypoints.len(),
            known: errors.len(),
            median_error_px,
        }
    }
}
