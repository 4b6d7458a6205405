//! What training made, on one page: the map with its landmarks, the eigenspace, the profile, how the core judges
//! deviated views, and a flight.

use std::fmt::Write;

use eigenmark_core::landmark::Point;
use image::{DynamicImage, GrayImage};

use super::{
    Page, map_picture,
    page::escape,
    plot::{Axes, line_plot},
};
use crate::{
    atlas::Summary, evaluate::Outcome, learn::Model, map::Map, output::png_uri, simulate::Waypoint,
    train::Trained,
};

/// Eigenimages that are shown.
const EIGENIMAGES: usize = 15;

/// What the page is about.
#[derive(Clone, Copy, Debug)]
pub struct TrainingReport<'a> {
    /// The map that was trained on.
    pub map: &'a Map,
    /// The map as a person would like to see it, if there is more than its luminance.
    pub picture: Option<&'a DynamicImage>,
    /// What training made.
    pub trained: &'a Trained,
    /// Names of deviations, and their outcomes per landmark.
    pub trials: &'a [(&'a str, Vec<Outcome>)],
    /// A flight, if there was one.
    pub flight: Option<FlightReport<'a>>,
    /// How to make this page again.
    pub provenance: &'a str,
}

/// A flight to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct FlightReport<'a> {
    /// What happened.
    pub waypoints: &'a [Waypoint],
    /// What was flown, in a sentence.
    pub description: &'a str,
}

/// The page.
#[must_use]
pub fn training_report(report: &TrainingReport<'_>) -> String {
    let summary = Summary::of(&report.trained.atlas());
    let mut page = Page::new(
        &format!("Eigenmark: {}", report.map.name()),
        "An aerial map became an atlas: views cut from the map, an eigenspace learned from them, landmarks selected, \
         everything quantized for a microcontroller, and judged by the code that runs there.",
    );
    page.section("Landmarks on the map", landmarks_on_map(report));
    page.section("Atlas", atlas_table(&summary));
    page.section("Eigenspace", eigenspace(report.trained));
    page.section("Landmarks", landmark_table(report, &summary));
    if !report.trials.is_empty() {
        page.section("How the core judges deviated views", trials(report.trials));
    }
    if let Some(flight) = report.flight {
        page.section("A short flight", flight_map(report, flight));
    }
    page.finish(report.provenance)
}

/// The map with an SVG drawing in map pixels over it.
fn map_with(report: &TrainingReport<'_>, drawing: &str) -> String {
    let (width, height) = (report.map.width(), report.map.height());
    format!(
        "<div class=\"map\"><img alt=\"the map\" src=\"{}\">\
         <svg viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\">{drawing}</svg></div>",
        map_picture(report.map, report.picture)
    )
}

fn landmarks_on_map(report: &TrainingReport<'_>) -> String {
    let grid = report.trained.candidates.grid();
    let (half, side) = (grid.window_px() as f32 / 2.0, grid.window_px());
    let mut drawing = String::new();
    for (&view, rank) in report.trained.selected.landmarks.iter().zip(1..) {
        let Point { x_px, y_px } = grid.place(view);
        // Writing to a string does not fail.
        let _ = write!(
            drawing,
            "<rect x=\"{}\" y=\"{}\" width=\"{side}\" height=\"{side}\" fill=\"none\" stroke=\"#ff4d61\" \
             stroke-width=\"5\"/><text x=\"{x_px}\" y=\"{}\" text-anchor=\"middle\" font-size=\"46\" \
             font-weight=\"700\" style=\"fill:#fff;stroke:#000;stroke-width:6;paint-order:stroke\">{rank}</text>",
            x_px - half,
            y_px - half,
            y_px + 16.0,
        );
    }
    let caption = format!(
        "<p>{} of {} views, numbered by rank. Frames overlap where views do.</p>",
        report.trained.selected.landmarks.len(),
        grid.count()
    );
    map_with(report, &drawing) + &caption
}

fn atlas_table(summary: &Summary) -> String {
    let settings = &summary.settings;
    let rows = [
        ("Flash", format!("{} bytes", summary.flash_bytes)),
        (
            "RAM of the localizer, without frames",
            format!("{} bytes", summary.ram_bytes),
        ),
        (
            "View",
            format!(
                "{0} × {0} pixels of a {1} pixel window",
                summary.view_side, settings.view_size
            ),
        ),
        (
            "Blur, normalization",
            format!("{}, {}", settings.blur, settings.normalize),
        ),
        (
            "Dimensions",
            format!(
                "{} ({:.1} % of the variance)",
                summary.dims,
                100.0 * summary.covered_variance
            ),
        ),
        (
            "Metric, coefficients",
            format!("{}, {}", settings.metric, settings.coefficients),
        ),
        (
            "Known up to the distance",
            format!("{:.4}", summary.known.distance),
        ),
        (
            "and up to the distance from feature space",
            format!("{:.3e}", summary.known.from_feature_space),
        ),
    ];
    let rows: String = rows
        .iter()
        .map(|(name, value)| format!("<tr><td>{name}</td><td>{value}</td></tr>"))
        .collect();
    format!("<div class=\"scroll\"><table>{rows}</table></div>")
}

fn eigenspace(trained: &Trained) -> String {
    let model = &trained.model;
    let total = model.total_variance;
    let mut covered = 0.0;
    let variance: Vec<(f64, f64)> = model
        .eigenvalues
        .iter()
        .zip(1..)
        .map(|(value, k)| {
            covered += value;
            (f64::from(k), 100.0 * covered / total)
        })
        .collect();
    let axes = Axes {
        title: "Covered variance",
        x: "dimensions",
        y: "percent",
    };
    let mut plots = line_plot(axes, &variance, (0.0, 100.0));
    if let Some(profiled) = &trained.selected.profiled {
        let sorted: Vec<(f64, f64)> = profiled
            .ranking
            .iter()
            .zip(1..)
            .map(|(&view, rank)| (f64::from(rank), profiled.values[view as usize - 1]))
            .collect();
        let (high, low) = (sorted[0].1, sorted[sorted.len() - 1].1);
        let margin = 0.05 * (high - low).max(1e-9);
        let axes = Axes {
            title: "Distance profile, sorted",
            x: "rank",
            y: "mean dissimilarity",
        };
        plots += &line_plot(axes, &sorted, (low - margin, high + margin));
    }
    let images: String = (0..model.dimensions.min(EIGENIMAGES))
        .map(|r| {
            let uri = png_uri(&eigenimage(model, r));
            format!(
                "<figure><img alt=\"eigenimage {0}\" src=\"{uri}\">{0}</figure>",
                r + 1
            )
        })
        .collect();
    format!(
        "<div class=\"plots\">{plots}</div><p>The first eigenimages:</p><div class=\"row\">{images}</div>"
    )
}

/// A basis row as a picture: zero is gray.
fn eigenimage(model: &Model, r: usize) -> GrayImage {
    let row = &model.basis[r * model.pixels..(r + 1) * model.pixels];
    let largest = row
        .iter()
        .fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()));
    let side = model.pixels.isqrt() as u32;
    let pixels = row
        .iter()
        .map(|x| (127.5 * (1.0 + x / largest)).round() as u8)
        .collect();
    GrayImage::from_raw(side, side, pixels).unwrap_or_default()
}

fn landmark_table(report: &TrainingReport<'_>, summary: &Summary) -> String {
    let mut rows = String::new();
    for landmark in &summary.table {
        let pixels = report.trained.candidates.reduced(landmark.view);
        let side = u32::from(summary.view_side);
        let picture = GrayImage::from_raw(side, side, pixels).unwrap_or_default();
        let [x, y] = landmark.place;
        // Writing to a string does not fail.
        let _ = write!(
            rows,
            "<tr><td>{}</td><td><img alt=\"view {1}\" src=\"{2}\"></td><td>{1}</td><td>{x}, {y}</td><td>{3:.4}</td></tr>",
            landmark.landmark,
            landmark.view,
            png_uri(&picture),
            landmark.radius,
        );
    }
    format!(
        "<div class=\"scroll\"><table><tr><th>rank</th><th></th><th>view</th><th>place, map pixels</th>\
         <th>radius</th></tr>{rows}</table></div><p>A fix nearer than the radius is guaranteed.</p>"
    )
}

fn trials(trials: &[(&str, Vec<Outcome>)]) -> String {
    let mut rows = String::new();
    for (name, outcomes) in trials {
        let all: Outcome = outcomes.iter().copied().sum();
        let percent = |count| all.percent(count);
        // Writing to a string does not fail.
        let _ = write!(
            rows,
            "<tr><td>{}</td><td>{}</td><td>{:.1}</td><td>{:.1}</td><td>{}</td><td>{:.1}</td></tr>",
            escape(name),
            all.views,
            percent(all.right),
            percent(all.guaranteed),
            all.guaranteed_wrong,
            percent(all.known),
        );
    }
    format!(
        "<div class=\"scroll\"><table><tr><th>deviation</th><th>views</th><th>right, %</th><th>guaranteed, %</th>\
         <th>guaranteed and wrong</th><th>known, %</th></tr>{rows}</table></div>"
    )
}

fn flight_map(report: &TrainingReport<'_>, flight: FlightReport<'_>) -> String {
    let mut drawing = String::new();
    let path: Vec<String> = flight
        .waypoints
        .iter()
        .map(|w| format!("{:.0},{:.0}", w.place.x_px, w.place.y_px))
        .collect();
    // Writing to a string does not fail.
    let _ = write!(
        drawing,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"5\" stroke-dasharray=\"16 10\"/>",
        path.join(" ")
    );
    let mut known = 0;
    for waypoint in flight.waypoints {
        let Some(fix) = waypoint.fix.filter(|fix| fix.known) else {
            continue;
        };
        known += 1;
        let color = if fix.guaranteed { "#3ddc84" } else { "#ffc53d" };
        let Point { x_px, y_px } = waypoint.place;
        let _ = write!(
            drawing,
            "<line x1=\"{x_px:.0}\" y1=\"{y_px:.0}\" x2=\"{:.0}\" y2=\"{:.0}\" stroke=\"{color}\" stroke-width=\"4\"/>\
             <circle cx=\"{x_px:.0}\" cy=\"{y_px:.0}\" r=\"9\" fill=\"{color}\"/>",
            fix.position.x_px, fix.position.y_px
        );
    }
    let caption = format!(
        "<p>{} {} of {} frames gave a known fix: green dots are guaranteed, yellow ones are not, and each is joined to \
         the landmark it was found at. Between landmarks nothing is claimed.</p>",
        escape(flight.description),
        known,
        flight.waypoints.len()
    );
    map_with(report, &drawing) + &caption
}
