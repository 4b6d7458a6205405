//! The state as JSON: for scripts, and for the page.

use std::time::Duration;

use eigenmark_core::{belief::Estimate, landmark::Point, link::Report, localizer::Fix};
use serde_json::{Value, json};

use super::{BoardState, Judgement, LinkState, Sample, words};

/// Samples in one answer, at most; who wants more asks again.
const MAX_SAMPLES: usize = 2_000;

/// Recent samples that are told in words.
const RECENT: usize = 12;

/// A report as one JSON object: places in map pixels, landmarks from 1, angles in radians; what is missing or no number
/// is null.
#[must_use]
pub fn report_json(report: &Report) -> Value {
    let (roll_rad, pitch_rad) = report.tilt_rad.unzip();
    json!({
        "sequence": report.sequence,
        "time_ms": report.time_ms,
        "step_s": report.step_s,
        "took_us": report.took_us,
        "camera": words::camera(report.camera),
        "heading_rad": report.heading_rad,
        "roll_rad": roll_rad,
        "pitch_rad": pitch_rad,
        "altitude_ratio": report.altitude_ratio,
        "estimate": report.estimate.as_ref().map(estimate),
        "odometry_px": report.odometry_px,
        "fix": report.fix.as_ref().map(fix),
        "judgement": Judgement::of(report).map(Judgement::name),
        "refusal": report.refusal.map(|refusal| refusal.words()),
        "state": report.state.name(),
        "command": { "heading_rad": report.command.heading_rad, "speed": report.command.speed },
        "damaged": report.damaged,
    })
}

fn pair(point: Point) -> [f32; 2] {
    [point.x_px, point.y_px]
}

fn estimate(of: &Estimate) -> Value {
    json!({
        "position": pair(of.position),
        "covariance_px2": of.covariance_px2,
        "heading_rad": of.heading_rad,
        "confidence": of.confidence,
        "confident": of.is_confident(),
    })
}

fn fix(of: &Fix) -> Value {
    json!({
        "landmark": u64::from(of.landmark) + 1,
        "view": of.view,
        "place": pair(of.place),
        "position": pair(of.position),
        "distance": of.distance,
        "second": of.second,
        "margin": of.margin,
        "guaranteed": of.guaranteed,
        "known": of.known,
    })
}

/// The state at `now`, with the samples from number `from` on.
pub(super) fn state_json(state: &BoardState, now: Duration, from: u64) -> Value {
    let (link, why) = match state.link() {
        LinkState::Up => ("up", None),
        LinkState::Silent => ("silent", None),
        LinkState::Down(why) => ("down", Some(why)),
    };
    let identity = state.identity().map(|identity| {
        let [major, minor, patch] = identity.firmware;
        json!({
            "firmware": format!("{major}.{minor}.{patch}"),
            "atlas": identity.atlas.as_ref().map(words::atlas),
            "atlas_crc": identity.atlas.map(|atlas| format!("{:08x}", atlas.crc)),
            "map_crc": identity.atlas.map(|atlas| format!("{:08x}", atlas.map_crc)),
            "meters_per_px": identity.setup.meters_per_px,
            "field_of_view_rad": identity.setup.field_of_view_rad,
        })
    });
    let (first, samples) = state.trail().since(from);
    let samples: Vec<Value> = samples.take(MAX_SAMPLES).map(sample).collect();
    let events = state.events().rev().take(RECENT);
    let refusals = state.refusals();
    json!({
        "now_s": now.as_secs_f64(),
        "link": {
            "name": state.link_name(),
            "state": link,
            "why": why,
            "since_s": state.link_since().as_secs_f64(),
            "heard_s": state.last_heard().map(|at| at.as_secs_f64()),
        },
        "identity": identity,
        "slots": state.slots().map(|slots| slots.each_ref().map(words::slot)),
        "faults": state.faults().map(words::faults),
        "report": state.last_report().map(report_json),
        "report_age_s": state.report_age(now).map(|age| age.as_secs_f64()),
        "rates": state.rates(now),
        "refusals": refusals.map(|(why, count)| json!([why.words(), count])).collect::<Vec<_>>(),
        "reports": state.reports(),
        "lost_reports": state.lost_reports(),
        "restarts": state.restarts(),
        "damaged_packets": state.damaged_packets(),
        "broken_pictures": state.broken_pictures(),
        "picture": state.picture().map(|it| json!([it.sequence, it.frame.width, it.frame.height])),
        "events": events.map(|it| json!([it.at.as_secs_f64(), it.text])).collect::<Vec<_>>(),
        "recent": state.trail().newest().take(RECENT).map(recent).collect::<Vec<_>>(),
        "samples": { "first": first, "next": first + samples.len() as u64, "of": samples },
    })
}

/// x, y, confident, x and y of the fix, its judgement (0 guaranteed, 1 known, 2 refused), begun anew; in tenths of pixels.
fn sample(of: &Sample) -> Value {
    let tenths = |point: Point| pair(point).map(|px| (f64::from(px) * 10.0).round());
    let (fix, judgement) = of.fix.unzip();
    let judgement = judgement.map(|it| match it {
        Judgement::Guaranteed => 0,
        Judgement::Known => 1,
        Judgement::Refused => 2,
    });
    json!([
        of.position.map(tenths),
        u8::from(of.confident),
        fix.map(tenths),
        judgement,
        u8::from(of.restarted)
    ])
}

fn recent(of: &Sample) -> Value {
    json!({
        "sequence": of.sequence,
        "time_ms": of.time_ms,
        "landmark": of.landmark.map(|rank| u64::from(rank) + 1),
        "judgement": of.fix.map(|(_, judgement)| judgement.name()),
        "refusal": of.refusal.map(|refusal| refusal.words()),
    })
}
