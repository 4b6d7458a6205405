//! Line plots as inline SVG.

use std::fmt::Write;

use super::page::escape;

/// Labels of a plot's axes; units belong into them.
#[derive(Clone, Copy, Debug)]
pub struct Axes<'a> {
    /// What the plot shows.
    pub title: &'a str,
    /// The horizontal axis.
    pub x: &'a str,
    /// The vertical axis.
    pub y: &'a str,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 44.0;

/// One curve; the vertical axis spans `y_range`, the horizontal one the points.
#[must_use]
pub fn line_plot(axes: Axes<'_>, points: &[(f64, f64)], y_range: (f64, f64)) -> String {
    let x_range = points.iter().fold((f64::MAX, f64::MIN), |(low, high), p| {
        (low.min(p.0), high.max(p.0))
    });
    let x_at = |x: f64| {
        LEFT + (x - x_range.0) / (x_range.1 - x_range.0).max(1e-12) * (WIDTH - LEFT - RIGHT)
    };
    let y_at = |y: f64| {
        HEIGHT - BOTTOM - (y - y_range.0) / (y_range.1 - y_range.0) * (HEIGHT - TOP - BOTTOM)
    };
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\" font-size=\"12\">\
         <text x=\"{LEFT}\" y=\"18\" font-weight=\"600\">{}</text>",
        escape(axes.title),
        escape(axes.title)
    );
    // Writing to a string does not fail.
    for i in 0..=4 {
        let share = f64::from(i) / 4.0;
        let (x, y) = (
            x_range.0 + share * (x_range.1 - x_range.0),
            y_range.0 + share * (y_range.1 - y_range.0),
        );
        let _ = write!(
            svg,
            "<line class=\"axis\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{:.1}\" y2=\"{:.1}\" opacity=\".25\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{x:.0}</text>",
            WIDTH - RIGHT,
            y_at(y),
            y_at(y),
            LEFT - 6.0,
            y_at(y) + 4.0,
            tick(y),
            x_at(x),
            HEIGHT - BOTTOM + 16.0,
        );
    }
    let path: Vec<String> = points
        .iter()
        .map(|&(x, y)| format!("{:.1},{:.1}", x_at(x), y_at(y)))
        .collect();
    let _ = write!(
        svg,
        "<polyline class=\"curve\" points=\"{}\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg>",
        path.join(" "),
        (LEFT + WIDTH - RIGHT) / 2.0,
        HEIGHT - 8.0,
        escape(axes.x),
        (TOP + HEIGHT - BOTTOM) / 2.0,
        escape(axes.y),
    );
    svg
}

fn tick(y: f64) -> String {
    if y.abs() >= 10.0 {
        format!("{y:.0}")
    } else {
        format!("{y:.2}")
    }
}
