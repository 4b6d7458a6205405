//! Sprites: many small pictures in one.

use image::{
    GrayImage,
    imageops::{self, FilterType},
};
use serde::{Deserialize, Serialize};

use crate::{
    learn::{Rows, Space},
    output::png_uri,
};

/// The longest side of a tile, in pixels.
const TILE_PX: u32 = 48;

/// Tiles per row of eigenimages.
const PER_ROW: usize = 5;

/// Eigenimages that are shown: figure 3.3.
const EIGENIMAGES: usize = 25;

/// Views that are recovered: figure A.2.
const RECOVERED_VIEWS: [u32; 5] = [3, 13, 15, 29, 75];

/// Dimensions that they are recovered from, beside all.
const RECOVERED_DIMENSIONS: [usize; 4] = [1, 5, 20, 50];

/// The first eigenimages: five per row, zero is gray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Eigenimages {
    /// The picture, as a data URI.
    pub uri: String,
    /// Side of a tile.
    pub tile_px: u32,
    /// How many there are.
    pub count: usize,
}

/// Views recovered from few dimensions: a row per number of dimensions, a column per view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recovered {
    /// The picture, as a data URI.
    pub uri: String,
    /// Side of a tile.
    pub tile_px: u32,
    /// Candidate numbers.
    pub views: Vec<u32>,
    /// Numbers of dimensions; 0 stands for the view itself.
    pub dims: Vec<usize>,
}

impl Eigenimages {
    /// Those of a space.
    #[must_use]
    pub fn of(space: &Space) -> Self {
        let count = space.dimensions().min(EIGENIMAGES);
        let tiles = space.model.rows().take(count).map(|row| {
            let largest = row
                .iter()
                .fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            tile(space, row.iter().map(|x| 127.5 * (1.0 + x / largest)))
        });
        let (uri, tile_px) = sprite(&tiles.collect::<Vec<_>>(), PER_ROW);
        Self {
            uri,
            tile_px,
            count,
        }
    }
}

impl Recovered {
    /// The report's views, as far as there are so many, and its dimensions, as far as they are learned.
    #[must_use]
    pub fn of(space: &Space) -> Self {
        let (k, m) = (space.dimensions(), space.model.pixels);
        let mut views = RECOVERED_VIEWS
            .map(|view| view.min(space.count() as u32))
            .to_vec();
        views.dedup();
        let mut dims = vec![0];
        dims.extend(RECOVERED_DIMENSIONS.into_iter().filter(|&some| some < k));
        dims.push(k);
        let coordinates = space.model.project(&space.candidates);
        let mut tiles = Vec::with_capacity(views.len() * dims.len());
        for &some in &dims {
            for &view in &views {
                let index = view as usize - 1;
                tiles.push(if some == 0 {
                    let mut vector = vec![0.0; m];
                    space.candidates.read(index, &mut vector);
                    stretched(
                        space,
                        &vector.into_iter().map(f64::from).collect::<Vec<_>>(),
                    )
                } else {
                    let mut some_only = coordinates[index * k..][..k].to_vec();
                    some_only[some..].fill(0.0);
                    stretched(space, &space.model.reconstruct(&some_only))
                });
            }
        }
        let (uri, tile_px) = sprite(&tiles, views.len());
        Self {
            uri,
            tile_px,
            views,
            dims,
        }
    }
}

/// A vector of pixels as a tile: gray levels as they are, or stretched where they are none.
fn stretched(space: &Space, vector: &[f64]) -> GrayImage {
    let (low, high) = vector.iter().fold((f64::MAX, f64::MIN), |(low, high), &x| {
        (low.min(x), high.max(x))
    });
    if space.candidates.preprocess().keeps_levels() {
        tile(space, vector.iter().copied())
    } else {
        let range = (high - low).max(f64::MIN_POSITIVE);
        tile(space, vector.iter().map(|x| 255.0 * (x - low) / range))
    }
}

fn tile(space: &Space, levels: impl Iterator<Item = f64>) -> GrayImage {
    let side = space.side() as u32;
    let pixels = levels.map(|level| level.round() as u8).collect();
    let picture = GrayImage::from_raw(side, side, pixels).unwrap_or_default();
    if side > TILE_PX {
        imageops::resize(&picture, TILE_PX, TILE_PX, FilterType::Triangle)
    } else {
        picture
    }
}

/// Tiles of the same size, side by side: the picture, and the side of a tile.
fn sprite(tiles: &[GrayImage], per_row: usize) -> (String, u32) {
    let side = tiles.first().map_or(1, GrayImage::width);
    let rows = tiles.len().div_ceil(per_row).max(1) as u32;
    let mut sprite = GrayImage::new(side * per_row as u32, side * rows);
    for (index, tile) in tiles.iter().enumerate() {
        let (column, row) = (index % per_row, index / per_row);
        let [x, y] = [column, row].map(|at| i64::from(side) * at as i64);
        imageops::replace(&mut sprite, tile, x, y);
    }
    (png_uri(&sprite), side)
}
