//! The built-in aerial city: districts of streets and roofs, parks, and a river. 1600×1200 pixels.
//!
//! Drawn from integer hashes and IEEE additions, multiplications, divisions, floors and roots only, so that every
//! machine draws the same bytes. Each pixel is decided on its own, from what lies at its place: river, bridge, avenue
//! between districts, street, or the ground of a block.

use image::{Rgb, RgbImage};

/// Width of the city, in pixels.
pub const WIDTH: u32 = 1600;

/// Height of the city, in pixels.
pub const HEIGHT: u32 = 1200;

/// Half of the river's width, in pixels.
const RIVER_HALF_WIDTH: f64 = 46.0;

/// Half of the width of the avenues between districts, in pixels.
const AVENUE_HALF_WIDTH: f64 = 9.0;

/// Distance between two bridges along the river, in pixels.
const BRIDGE_SPACING: f64 = 330.0;

const ASPHALT: Color = Color(96.0, 96.0, 100.0);
const PAVEMENT: Color = Color(168.0, 164.0, 156.0);
const GRASS: Color = Color(92.0, 122.0, 70.0);
const CROWN: Color = Color(50.0, 84.0, 46.0);
const WATER: Color = Color(44.0, 70.0, 86.0);
const SHADOW: f64 = 0.55;

/// A part of the city with streets of its own direction and blocks of its own size.
struct District {
    x: f64,
    y: f64,
    /// Direction of the streets: exact (cos, sin) from Pythagorean triples.
    direction: (f64, f64),
    block: (f64, f64),
    street: f64,
    roof: Color,
    /// How many of 100 blocks are parks.
    parks: u32,
}

const DISTRICTS: [District; 9] = [
    district(
        (180.0, 160.0),
        (1.0, 0.0),
        (92.0, 64.0),
        11.0,
        Color(176.0, 92.0, 66.0),
        8,
    ),
    district(
        (620.0, 130.0),
        (0.8, 0.6),
        (120.0, 120.0),
        14.0,
        Color(150.0, 146.0, 142.0),
        12,
    ),
    district(
        (1130.0, 210.0),
        (12.0 / 13.0, -5.0 / 13.0),
        (78.0, 70.0),
        9.0,
        Color(188.0, 108.0, 76.0),
        6,
    ),
    district(
        (1490.0, 330.0),
        (1.0, 0.0),
        (150.0, 110.0),
        13.0,
        Color(196.0, 190.0, 180.0),
        18,
    ),
    district(
        (230.0, 640.0),
        (15.0 / 17.0, 8.0 / 17.0),
        (70.0, 58.0),
        9.0,
        Color(164.0, 84.0, 60.0),
        10,
    ),
    district(
        (760.0, 590.0),
        (0.96, 0.28),
        (64.0, 52.0),
        7.0,
        Color(172.0, 98.0, 72.0),
        5,
    ),
    district(
        (1290.0, 740.0),
        (0.6, 0.8),
        (110.0, 80.0),
        12.0,
        Color(132.0, 126.0, 124.0),
        14,
    ),
    district(
        (420.0, 1040.0),
        (1.0, 0.0),
        (170.0, 130.0),
        12.0,
        Color(204.0, 200.0, 196.0),
        22,
    ),
    district(
        (1060.0, 1080.0),
        (24.0 / 25.0, -7.0 / 25.0),
        (84.0, 96.0),
        10.0,
        Color(182.0, 100.0, 70.0),
        9,
    ),
];

#[derive(Clone, Copy)]
struct Color(f64, f64, f64);

/// Draws the city.
#[must_use]
pub fn draw() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let color = at(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let grain = 0.94 + 0.12 * unit(x, y, 1);
        let light =
            grain * (0.92 + 0.16 * smooth_noise(f64::from(x) / 90.0, f64::from(y) / 90.0, 2));
        let Color(red, green, blue) = color.times(light);
        Rgb([red, green, blue].map(|level| level.clamp(0.0, 255.0) as u8))
    })
}

const fn district(
    (x, y): (f64, f64),
    direction: (f64, f64),
    block: (f64, f64),
    street: f64,
    roof: Color,
    parks: u32,
) -> District {
    District {
        x,
        y,
        direction,
        block,
        street,
        roof,
        parks,
    }
}

/// What lies at a place.
fn at(x: f64, y: f64) -> Color {
    let bank = (x - river_x(y)).abs();
    if bank < RIVER_HALF_WIDTH {
        let along = y - (y / BRIDGE_SPACING).floor() * BRIDGE_SPACING - BRIDGE_SPACING / 2.0;
        if along.abs() < 10.0 {
            return if along.abs() < 7.0 { ASPHALT } else { PAVEMENT };
        }
        let ripple = smooth_noise(x / 9.0, y / 21.0, 3);
        return WATER.times(0.85 + 0.3 * ripple);
    }
    if bank < RIVER_HALF_WIDTH + 8.0 {
        return PAVEMENT;
    }
    if bank < RIVER_HALF_WIDTH + 26.0 {
        return green(x, y, 40);
    }
    let (nearest, border) = nearest_district(x, y);
    if border < AVENUE_HALF_WIDTH {
        let is_marking = border < 1.0 && ((x + y) / 12.0).floor() as i64 % 2 == 0;
        return if is_marking {
            Color(214.0, 212.0, 204.0)
        } else {
            ASPHALT
        };
    }
    in_district(&DISTRICTS[nearest], nearest as u32, x, y)
}

/// The river's middle: a cubic through the map, so that it bends twice.
fn river_x(y: f64) -> f64 {
    let t = y / f64::from(HEIGHT) - 0.5;
    880.0 + 420.0 * t - 2100.0 * t * (t - 0.42) * (t + 0.38)
}

/// The district whose center is nearest, and how far its border with the next is.
fn nearest_district(x: f64, y: f64) -> (usize, f64) {
    // Bend the borders a little, so that avenues are not perfectly straight.
    let x = x + 26.0 * smooth_noise(x / 170.0, y / 170.0, 4);
    let y = y + 26.0 * smooth_noise(x / 170.0, y / 170.0, 5);
    let (mut nearest, mut first, mut second) = (0, f64::MAX, f64::MAX);
    for (index, district) in DISTRICTS.iter().enumerate() {
        let distance =
            ((x - district.x) * (x - district.x) + (y - district.y) * (y - district.y)).sqrt();
        if distance < first {
            (nearest, second, first) = (index, first, distance);
        } else if distance < second {
            second = distance;
        }
    }
    (nearest, (second - first) / 2.0)
}

/// Streets, and the ground of blocks.
fn in_district(district: &District, number: u32, x: f64, y: f64) -> Color {
    let (cos, sin) = district.direction;
    let (dx, dy) = (x - district.x, y - district.y);
    let (u, v) = (cos * dx + sin * dy, cos * dy - sin * dx);
    let (column, row) = (
        (u / district.block.0).floor(),
        (v / district.block.1).floor(),
    );
    let (u, v) = (u - column * district.block.0, v - row * district.block.1);
    let (width, depth) = (
        district.block.0 - district.street,
        district.block.1 - district.street,
    );
    if u >= width || v >= depth {
        return ASPHALT.times(if u < width + 1.5 || v < depth + 1.5 {
            1.3
        } else {
            1.0
        });
    }
    let block = hash(column as i64 as u32, row as i64 as u32, 10 + number);
    let inset = u.min(v).min(width - u).min(depth - v);
    if inset < 2.5 {
        return PAVEMENT;
    }
    match block % 100 {
        kind if kind < district.parks => park(x, y, u - width / 2.0, v - depth / 2.0, block),
        kind if kind < district.parks + 9 => hall(u, v, width, depth, block),
        kind if kind < district.parks + 15 => car_park(u, v),
        _ => houses(district, u, v, width, depth, block),
    }
}

/// Grass with trees and, in some parks, paths or a pond.
fn park(x: f64, y: f64, u: f64, v: f64, block: u32) -> Color {
    let radius = (u * u + v * v).sqrt();
    match block / 100 % 4 {
        0 if radius < 13.0 => WATER,
        1 if (u - v).abs() < 2.5 || (u + v).abs() < 2.5 => PAVEMENT.times(1.08),
        2 if (radius - 20.0).abs() < 2.5 => PAVEMENT.times(1.08),
        _ => green(x, y, 30 + block / 400 % 45),
    }
}

/// Grass with round trees; `density` of 100 places have one.
fn green(x: f64, y: f64, density: u32) -> Color {
    const SPACING: f64 = 11.0;
    let (column, row) = ((x / SPACING).floor(), (y / SPACING).floor());
    let (tree_column, tree_row) = (column as u32, row as u32);
    if hash(tree_column, tree_row, 6) % 100 < density {
        let dx = x - (column + 0.35 + 0.3 * unit(tree_column, tree_row, 7)) * SPACING;
        let dy = y - (row + 0.35 + 0.3 * unit(tree_column, tree_row, 8)) * SPACING;
        let radius = 2.6 + 2.4 * unit(tree_column, tree_row, 9);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < radius {
            return CROWN.times(1.1 - 0.25 * (dx + dy) / radius);
        }
        if ((dx - 2.0) * (dx - 2.0) + (dy - 2.0) * (dy - 2.0)).sqrt() < radius {
            return GRASS.times(SHADOW);
        }
    }
    GRASS.times(0.9 + 0.2 * smooth_noise(x / 17.0, y / 17.0, 11))
}

/// One large flat roof with a rim, sometimes around a court.
fn hall(u: f64, v: f64, width: f64, depth: f64, block: u32) -> Color {
    let roof = Color(1.0, 1.0, 0.97).times(f64::from(120 + block / 100 % 110));
    let inset = (u - 6.0)
        .min(v - 6.0)
        .min(width - 8.0 - u)
        .min(depth - 8.0 - v);
    let has_court = (block / 700).is_multiple_of(2);
    if inset < 0.0 {
        let is_shaded = u > 8.0 && v > 8.0 && (u > width - 8.0 || v > depth - 8.0);
        return PAVEMENT.times(if is_shaded { SHADOW } else { 0.95 });
    }
    if has_court && inset > 13.0 {
        return GRASS.times(if inset < 17.0 { SHADOW } else { 1.0 });
    }
    roof.times(if inset < 1.5 { 0.8 } else { 1.0 })
}

/// Marked bays with cars.
fn car_park(u: f64, v: f64) -> Color {
    let (bay, lane) = ((u / 5.0).floor(), (v / 16.0).floor());
    let (across, along) = (u - bay * 5.0, v - lane * 16.0);
    let has_car = !hash(bay as u32, lane as u32, 12).is_multiple_of(3);
    if has_car && (1.0..4.2).contains(&across) && (1.0..8.5).contains(&along) {
        let paint = f64::from(60 + hash(bay as u32, lane as u32, 13) % 180);
        return Color(paint, paint * 0.97, paint);
    }
    if across < 0.7 && along < 9.0 {
        Color(200.0, 200.0, 196.0)
    } else {
        ASPHALT.times(1.15)
    }
}

/// Lots with gabled houses, their shadows, and gardens.
fn houses(district: &District, u: f64, v: f64, width: f64, depth: f64, block: u32) -> Color {
    let lot_width = width / f64::from(2 + block / 100 % 4);
    let lot_depth = depth / 2.0;
    let (column, row) = ((u / lot_width).floor(), (v / lot_depth).floor());
    let lot = hash(column as u32, row as u32, block);
    let (u, v) = (u - column * lot_width, v - row * lot_depth);
    let (left, top) = (2.0 + f64::from(lot % 4), 2.0 + f64::from(lot / 4 % 6));
    let right = lot_width - 2.0 - f64::from(lot / 24 % 4);
    let bottom = (lot_depth - 3.0 - f64::from(lot / 96 % 6)).max(top + 6.0);
    let is_house = (left..right).contains(&u) && (top..bottom).contains(&v);
    if is_house {
        let is_lit = if (lot / 576).is_multiple_of(2) {
            v < (top + bottom) / 2.0
        } else {
            u < (left + right) / 2.0
        };
        let tint = 0.78 + 0.44 * unit(lot, block, 14);
        return district
            .roof
            .times(if is_lit { tint * 1.14 } else { tint * 0.8 });
    }
    if (left + 3.0..right + 3.0).contains(&u) && (top + 3.0..bottom + 3.0).contains(&v) {
        return GRASS.times(SHADOW);
    }
    if (lot / 1152).is_multiple_of(3) {
        PAVEMENT.times(0.9)
    } else {
        GRASS.times(0.88 + 0.24 * unit(lot, block, 15))
    }
}

/// Smooth noise in 0..1: bilinear between hashed lattice points.
fn smooth_noise(x: f64, y: f64, seed: u32) -> f64 {
    let (column, row) = (x.floor(), y.floor());
    let (u, v) = (x - column, y - row);
    let (u, v) = (u * u * (3.0 - 2.0 * u), v * v * (3.0 - 2.0 * v));
    let (column, row) = (column as i64 as u32, row as i64 as u32);
    let corner = |dx: u32, dy: u32| unit(column.wrapping_add(dx), row.wrapping_add(dy), seed);
    let top = corner(0, 0) * (1.0 - u) + corner(1, 0) * u;
    let bottom = corner(0, 1) * (1.0 - u) + corner(1, 1) * u;
    top * (1.0 - v) + bottom * v
}

/// A hash as a number in 0..1.
fn unit(a: u32, b: u32, seed: u32) -> f64 {
    f64::from(hash(a, b, seed) >> 8) / f64::from(1 << 24)
}

/// Mixes three numbers; the finalizer is MurmurHash3's.
fn hash(a: u32, b: u32, seed: u32) -> u32 {
    let mut h = a
        .wrapping_mul(0x9e37_79b1)
        .wrapping_add(b.rotate_left(16).wrapping_mul(0x85eb_ca77))
        .wrapping_add(seed.wrapping_mul(0xc2b2_ae3d));
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

impl Color {
    fn times(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1 * factor, self.2 * factor)
    }
}
