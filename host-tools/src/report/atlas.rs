//! One atlas on one page: what is in it, its landmarks, how the core judges deviated views, a flight, and everything that a
//! grid of experiments says of one cell.

use std::fmt::Write;

use eigenmark_core::{atlas::Blur, landmark::Point};
use image::{DynamicImage, GrayImage};

use super::{Explorer, Page, map_picture, page::escape};
use crate::{
    atlas::Summary,
    evaluate::Outcome,
    experiment::{Cell, ExperimentError, Plan, REPORT_BLURS, of_landmarks},
    learn::{Space, blur_name},
    map::Map,
    output::{Progress, png_uri},
    simulate::Waypoint,
};

/// Candidates of which every pair is drawn, at most.
const MOST_CANDIDATES: usize = 500;

/// What the page is about.
#[derive(Clone, Copy, Debug)]
pub struct AtlasReport<'a> {
    /// The map that was trained on.
    pub map: &'a Map,
    /// The map as a person would like to see it, if there is more than its luminance.
    pub picture: Option<&'a DynamicImage>,
    /// What is in the atlas.
    pub summary: &'a Summary,
    /// What its landmarks were selected in.
    pub space: &'a Space,
    /// What was measured, if it was.
    pub cell: Option<&'a (Plan, Cell)>,
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

/// What a grid would say of an atlas; `None` when it has too many candidates.
///
/// # Errors
/// When nothing can be measured.
pub fn atlas_cell(
    map: &Map,
    summary: &Summary,
    space: &Space,
    progress: &Progress,
) -> Result<Option<(Plan, Cell)>, ExperimentError> {
    if space.count() > MOST_CANDIDATES {
        return Ok(None);
    }
    let landmarks: Vec<u32> = summary.table.iter().map(|landmark| landmark.view).collect();
    let is_named = |&blur: &Blur| blur_name(blur) == summary.settings.blur;
    let blur = REPORT_BLURS
        .into_iter()
        .find(is_named)
        .unwrap_or(Blur::None);
    let name = (f64::from(summary.settings.scale), blur);
    of_landmarks(map, space, name, &landmarks, progress).map(Some)
}

/// The page.
#[must_use]
pub fn atlas_report(report: &AtlasReport<'_>) -> String {
    let mut page = Page::new(
        &format!("Eigenmark: {}", report.map.title()),
        "An aerial map became an atlas: views cut from the map, an eigenspace learned from them, landmarks selected, \
         everything quantized for a microcontroller, and judged by the code that runs there.",
    );
    page.section("Atlas", atlas_table(report.summary));
    page.section("Landmarks", landmark_table(report));
    if !report.trials.is_empty() {
        page.section("How the core judges deviated views", trials(report.trials));
    }
    if let Some(flight) = report.flight {
        page.section("A short flight", flight_map(report, flight));
    }
    match report.cell {
        Some((plan, cell)) => Explorer {
            map: report.map,
            picture: report.picture,
            grid: report.space.candidates.grid(),
            plan,
            cells: std::slice::from_ref(cell),
            claims: &[],
            segmentation: None,
        }
        .add_to(&mut page),
        None => page.section("Landmarks on the map", landmarks_on_map(report)),
    }
    page.finish(report.provenance)
}

/// The map with an SVG drawing in map pixels over it; `label` says what is drawn.
fn map_with(report: &AtlasReport<'_>, label: &str, drawing: &str) -> String {
    let (width, height) = (report.map.width(), report.map.height());
    format!(
        "<div class=\"map\"><img alt=\"the map\" src=\"{}\">\
         <svg role=\"img\" aria-label=\"{label}\" viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\">{drawing}</svg></div>",
        map_picture(report.map, report.picture)
    )
}

fn landmarks_on_map(report: &AtlasReport<'_>) -> String {
    let grid = report.space.candidates.grid();
    let (half, side) = (grid.window_px() as f32 / 2.0, grid.window_px());
    let mut drawing = String::new();
    for (landmark, rank) in report.summary.table.iter().zip(1..) {
        let Point { x_px, y_px } = grid.place(landmark.view);
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
        "<p>{} of {} views, numbered by rank. Frames overlap where views do. Pairs of views are not drawn: there are too \
         many.</p>",
        report.summary.table.len(),
        grid.count()
    );
    map_with(report, "Landmarks on the map", &drawing) + &caption
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

fn landmark_table(report: &AtlasReport<'_>) -> String {
    let mut rows = String::new();
    for landmark in &report.summary.table {
        let pixels = report.space.candidates.reduced(landmark.view);
        let side = u32::from(report.summary.view_side);
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

fn flight_map(report: &AtlasReport<'_>, flight: FlightReport<'_>) -> String {
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
    map_with(report, "The flight on the map", &drawing) + &caption
}
