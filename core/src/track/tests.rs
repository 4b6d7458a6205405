use std::{boxed::Box, vec::Vec};

use super::*;
use crate::frame::Frame;

/// Smooth noise that repeats every 2¹⁶ units: a sum of lattices of random levels, interpolated.
pub fn texture(x: f64, y: f64) -> f64 {
    let mut level = 128.0;
    for (spacing, amplitude, seed) in [(37.0, 40.0, 1_u32), (13.0, 36.0, 2), (5.0, 24.0, 3)] {
        let (u, v) = (x / spacing, y / spacing);
        let (i, j) = (u.floor(), v.floor());
        let fade = |t: f64| t * t * (3.0 - 2.0 * t);
        let (a, b) = (fade(u - i), fade(v - j));
        let at = |i: f64, j: f64| {
            let mut hash = seed
                .wrapping_add((i as i64 as u32).wrapping_mul(0x9e37_79b9))
                .wrapping_add((j as i64 as u32).wrapping_mul(0x85eb_ca6b));
            hash ^= hash >> 15;
            hash = hash.wrapping_mul(0x2c1b_3c6d);
            hash ^= hash >> 12;
            hash = hash.wrapping_mul(0x297a_2d39);
            hash ^= hash >> 15;
            f64::from(hash) / f64::from(u32::MAX) - 0.5
        };
        let above = at(i, j) * (1.0 - a) + at(i + 1.0, j) * a;
        let below = at(i, j + 1.0) * (1.0 - a) + at(i + 1.0, j + 1.0) * a;
        level += amplitude * 2.0 * (above * (1.0 - b) + below * b);
    }
    level
}

/// A frame over the texture, of which one side is `side` units: at a placement, in sides.
pub fn render(side: u16, [x, y]: [f64; 2], heading: f64, ratio: f64) -> Vec<u8> {
    let (sin, cos) = heading.sin_cos();
    let q = f64::from(side);
    let mut pixels = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let (u, w) = (
                (f64::from(column) + 0.5 - q / 2.0) * ratio,
                (f64::from(row) + 0.5 - q / 2.0) * ratio,
            );
            let level = texture(
                x * q + u * cos - w * sin + 10_000.0,
                y * q + u * sin + w * cos + 10_000.0,
            );
            pixels.push((level + 0.5).clamp(0.0, 255.0) as u8);
        }
    }
    pixels
}

#[test]
fn a_long_closed_loop_drifts_little() {
    let side = 120;
    let mut odometry = Box::new(Odometry::new());
    let (mut worst, mut failures) = (0.0_f64, 0);
    let count = 1000;
    let mut length = 0.0;
    let mut last = [0.0, 0.0];
    for i in 0..=count {
        let turn = core::f64::consts::TAU * f64::from(i) / f64::from(count);
        let at = [4.0 * (1.0 - turn.cos()), -4.0 * turn.sin()];
        let ratio = 1.0 + 0.1 * (3.0 * turn).sin();
        length += (at[0] - last[0]).hypot(at[1] - last[1]);
        last = at;
        let pixels = render(side, at, turn, ratio);
        let frame = Frame::new(&pixels, side, side, side.into()).expect("valid");
        let moved = odometry.advance(&frame, None);
        failures += u32::from(i > 0 && moved.is_none());
        let placement = odometry.placement();
        let error = (f64::from(placement.x) - at[0]).hypot(f64::from(placement.y) - at[1]);
        worst = worst.max(error);
        if i % 50 == 0 {
            std::println!(
                "{i} {placement:?} {at:?} {error:.4} heading {:.4} ratio {:.4} sd {:.4} tracks {}",
                (f64::from(placement.heading_rad) - turn).sin(),
                f64::from(placement.altitude_ratio) / ratio,
                odometry.covariance().m11.sqrt(),
                odometry.tracks().len()
            );
        }
    }
    std::println!("worst {worst} of {length}, {failures} failures");
    assert_eq!(failures, 0);
    assert!(worst < 0.01 * length, "{worst} of {length}");
}

#[test]
fn zz_probe() {
    let mut odometry = Box::new(Odometry::new());
    let side = 200;
    let mut pixels = std::vec![0_u8; 40_000];
    see_ground(&Placement::ORIGIN, side, &mut pixels);
    let frame = Frame::new(&pixels, side, side, side.into()).expect("valid");
    odometry.advance(&frame, None);
    let before: Vec<Track> = odometry.tracks().to_vec();
    let to = Placement {
        x: 0.02,
        y: -0.035,
        heading_rad: 0.03,
        altitude_ratio: 1.01,
    };
    see_ground(&to, side, &mut pixels);
    let frame = Frame::new(&pixels, side, side, side.into()).expect("valid");
    let moved = odometry.advance(&frame, None);
    std::println!("{} {moved:?} {:?}", before.len(), odometry.placement());
    let back = to.similarity().inverse();
    for t in before {
        let g = back
            .apply([0, 1].map(|i| t.at_px[i] / 200.0 - 0.5))
            .map(|v| (v + 0.5) * 200.0);
        let now = odometry.tracks().iter().find(|n| n.id == t.id);
        std::println!(
            "{:?} true {:.2?} found {:.2?}",
            t.at_px,
            g,
            now.map(|n| n.at_px)
        );
    }
}
