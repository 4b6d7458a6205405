//! The state as lines of text.

use std::time::Duration;

use eigenmark_core::link::Report;

use super::{BoardState, Judgement, LinkState, Sample, words};

/// Recent fixes in the view.
const RECENT: usize = 6;

/// Recent events in the view.
const EVENTS: usize = 4;

/// Everything in a screenful of lines.
#[must_use]
pub fn view(state: &BoardState, now: Duration) -> Vec<String> {
    let mut lines = vec![link(state, now)];
    match state.identity() {
        Some(identity) => {
            let [major, minor, patch] = identity.firmware;
            let atlas = identity.atlas.as_ref().map(words::atlas);
            lines.push(format!(
                "board     firmware {major}.{minor}.{patch}, {} m per pixel, field of view {:.1}°",
                identity.setup.meters_per_px,
                identity.setup.field_of_view_rad.to_degrees()
            ));
            lines.push(format!(
                "          {}",
                atlas.as_deref().unwrap_or("no atlas to fly by")
            ));
        }
        None => lines.push("board     has not said who it is".to_owned()),
    }
    for (slot, name) in state.slots().into_iter().flatten().zip(["a", "b"]) {
        lines.push(format!("slot {name}    {}", words::slot(slot)));
    }
    if let Some(faults) = state.faults() {
        lines.push(format!("faults    {}", words::faults(faults).join("; ")));
    }
    lines.push(String::new());
    match state.last_report() {
        Some(report) => lines.extend(place(report, state.report_age(now))),
        None => lines.push("no report yet".to_owned()),
    }
    lines.push(rates(state, now));
    lines.push(counts(state));
    lines.push(String::new());
    lines.extend(state.trail().newest().take(RECENT).map(fix));
    let events: Vec<String> = state
        .events()
        .rev()
        .take(EVENTS)
        .map(|event| format!("{:>8.1} s  {}", event.at.as_secs_f64(), event.text))
        .collect();
    if !events.is_empty() {
        lines.push(String::new());
        lines.extend(events);
    }
    lines
}

/// The most important in a line.
#[must_use]
pub fn line(state: &BoardState, now: Duration) -> String {
    let rates = state.rates(now);
    let mut parts = vec![format!("{:.0} s", now.as_secs_f64()), link_word(state)];
    if let Some(report) = state.last_report() {
        parts.push(format!("frame {}", report.sequence));
        parts.push(report.state.name().to_owned());
        parts.push(position(report));
        parts.push(fixed(report));
        parts.push(format!("{} frames/s", number(rates.frames_per_s)));
        parts.push(format!("{} known", percent(rates.known)));
        parts.push(format!("{} damaged", state.damaged_packets()));
    }
    parts.join(", ")
}

fn link_word(state: &BoardState) -> String {
    match state.link() {
        LinkState::Up => "link up".to_owned(),
        LinkState::Silent => "link silent".to_owned(),
        LinkState::Down(why) => format!("link down ({why})"),
    }
}

fn link(state: &BoardState, now: Duration) -> String {
    let since_s = now.saturating_sub(state.link_since()).as_secs();
    format!(
        "link      {}: {} for {since_s} s",
        state.link_name(),
        link_word(state)
    )
}

fn place(report: &Report, age: Option<Duration>) -> Vec<String> {
    let age_s = age.unwrap_or_default().as_secs_f64();
    let mut lines = vec![format!(
        "frame     {} at {:.1} s, {age_s:.1} s ago; camera: {}",
        report.sequence,
        f64::from(report.time_ms) / 1000.0,
        words::camera(report.camera)
    )];
    lines.push(format!("position  {}", position(report)));
    if let Some(estimate) = &report.estimate {
        let [major, minor, angle_deg] = ellipse(estimate.covariance_px2);
        lines.push(format!(
            "          heading {:.0}°, one sigma {major:.1} by {minor:.1} px, its long axis at {angle_deg:.0}°",
            degrees(estimate.heading_rad)
        ));
    }
    lines.push(format!("fix       {}", fixed(report)));
    lines.push(format!(
        "mission   {}; asks for heading {:.0}° at {:.0} % of the speed",
        report.state.name(),
        degrees(report.command.heading_rad),
        100.0 * report.command.speed
    ));
    let told = |value: Option<f32>, unit: &str| {
        value.map_or("–".to_owned(), |value| format!("{value:.2}{unit}"))
    };
    let (roll, pitch) = report.tilt_rad.unzip();
    lines.push(format!(
        "autopilot heading {}, roll {}, pitch {}, altitude {}",
        told(report.heading_rad.map(degrees), "°"),
        told(roll.map(f32::to_degrees), "°"),
        told(pitch.map(f32::to_degrees), "°"),
        told(report.altitude_ratio, "×")
    ));
    lines
}

fn position(report: &Report) -> String {
    match &report.estimate {
        Some(estimate) => {
            let is = if estimate.is_confident() {
                "confident"
            } else {
                "not confident"
            };
            format!(
                "({:.1}, {:.1}) px, {is} ({:.1} %)",
                estimate.position.x_px,
                estimate.position.y_px,
                100.0 * estimate.confidence
            )
        }
        None => "nowhere yet".to_owned(),
    }
}

fn fixed(report: &Report) -> String {
    judged(
        report.fix.map(|fix| fix.landmark),
        Judgement::of(report),
        report.refusal.map(|refusal| refusal.words()),
    )
}

fn fix(sample: &Sample) -> String {
    let what = judged(
        sample.landmark,
        sample.fix.map(|(_, judgement)| judgement),
        sample.refusal.map(|refusal| refusal.words()),
    );
    format!("{:>8.1} s  {what}", f64::from(sample.time_ms) / 1000.0)
}

fn judged(landmark: Option<u32>, judgement: Option<Judgement>, why: Option<&str>) -> String {
    let mut text = match landmark {
        Some(rank) => format!("landmark {}", u64::from(rank) + 1),
        None => "none".to_owned(),
    };
    for more in [judgement.map(Judgement::name), why].into_iter().flatten() {
        text.push_str(": ");
        text.push_str(more);
    }
    text
}

fn rates(state: &BoardState, now: Duration) -> String {
    let rates = state.rates(now);
    let worst = rates.took_us_worst.map(f64::from);
    let in_ms = |us: Option<f64>| number(us.map(|us| us / 1000.0));
    format!(
        "last 10 s {} frames/s, {} fixes/s; known {}, guaranteed {}; step {} ms, at worst {} ms",
        number(rates.frames_per_s),
        number(rates.fixes_per_s),
        percent(rates.known),
        percent(rates.guaranteed),
        in_ms(rates.took_us_mean),
        in_ms(worst)
    )
}

fn counts(state: &BoardState) -> String {
    let board = state.last_report().map_or(0, |report| report.damaged);
    let mut text = format!(
        "so far    {} reports, {} lost; damaged packets: {} here, {board} at the board",
        state.reports(),
        state.lost_reports(),
        state.damaged_packets()
    );
    for (why, count) in state.refusals() {
        text.push_str(&format!("; {}: {count}", why.words()));
    }
    text
}

fn number(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.1}"))
}

fn percent(share: Option<f64>) -> String {
    share.map_or("–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}

/// Radians as degrees from 0 to below 360.
fn degrees(rad: f32) -> f32 {
    rad.to_degrees().rem_euclid(360.0)
}

/// Half axes of the ellipse of one sigma, in pixels, and the direction of the longer one, in degrees clockwise from
/// map-up, 0 to 180.
fn ellipse([xx, xy, yy]: [f32; 3]) -> [f64; 3] {
    let [xx, xy, yy] = [xx, xy, yy].map(f64::from);
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let radius = half.hypot(xy);
    let axis = |variance: f64| variance.max(0.0).sqrt();
    // Of x right, y down; map-up is −y.
    let angle = 0.5 * xy.atan2(half);
    let angle_deg = (angle.to_degrees() + 90.0).rem_euclid(180.0);
    [axis(mean + radius), axis(mean - radius), angle_deg]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipses_lie_along_the_larger_variance() {
        assert_eq!(ellipse([9.0, 0.0, 4.0]), [3.0, 2.0, 90.0]);
        assert_eq!(ellipse([4.0, 0.0, 9.0]).map(f64::round), [3.0, 2.0, 0.0]);
        // Down and right is south-east.
        let [major, minor, angle_deg] = ellipse([2.0, 2.0, 2.0]);
        assert_eq!((major, minor, angle_deg.round()), (2.0, 0.0, 135.0));
    }

    #[test]
    fn headings_are_degrees_of_a_compass() {
        assert_eq!(degrees(-std::f32::consts::FRAC_PI_2), 270.0);
        assert_eq!(degrees(0.0), 0.0);
    }
}
