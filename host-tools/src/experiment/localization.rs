//! Localization matrices of landmarks: report section 4.2, claim 10.

use image::{
    DynamicImage, GrayImage, Luma,
    imageops::{self, FilterType},
};
use serde::{Deserialize, Serialize};

use crate::{
    evaluate::{
        Exact,
        localization::{Flooding, LocalizationMatrix, coarse_localization_matrices, find_peaks},
    },
    learn::Space,
    map::{Integral, Map},
    output::jpeg_uri,
    simulate::{Camera, Scene, seeded},
};

/// Dimensions that matrices are computed in: those of figure 4.4, and few.
const DIMENSIONS: [usize; 2] = [3, 18];

/// Those that claims are about.
const CLAIMED_IN: usize = 18;

/// How far a view is turned that its matrix is asked where it is, in degrees.
const TURNED_DEG: [f64; 2] = [-10.0, 10.0];

/// Width of a picture, in pixels.
const PICTURE_PX: u32 = 320;

/// Peaks that are named.
const PEAKS: usize = 12;

/// Positions per side of a footprint: the same at every scale, so that minima can be counted against each other.
const PER_FOOTPRINT: u32 = 20;

/// The matrix of a landmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Localized {
    /// Dimensions, k.
    pub dims: usize,
    /// Its candidate number.
    pub landmark: u32,
    /// A picture as large as the map, as a data URI: black is most similar.
    pub uri: String,
    /// Dissimilarity at black.
    pub least: f32,
    /// Dissimilarity at white.
    pub most: f32,
    /// Local minima: positions that are more similar than all eight around them.
    pub minima: usize,
    /// Centers of the windows of the first peaks, in map pixels.
    pub peaks: Vec<[u32; 2]>,
    /// Local minima in the matrices of all landmarks that were asked for, on average.
    pub mean_minima: f64,
    /// Share of views of those landmarks, turned by ten degrees, whose global minimum lies half a footprint or farther
    /// away; `None` when none could be turned on the map.
    pub elsewhere: Option<f64>,
}

/// The matrices of the first of some landmarks, and numbers about all of them.
#[must_use]
pub fn localize(map: &Map, space: &Space, landmarks: &[u32]) -> Vec<Localized> {
    let mut dims: Vec<usize> = DIMENSIONS.map(|k| k.min(space.dimensions())).to_vec();
    dims.dedup();
    dims.into_iter()
        .map(|k| of_dimensions(map, space, landmarks, k))
        .collect()
}

fn of_dimensions(map: &Map, space: &Space, landmarks: &[u32], k: usize) -> Localized {
    let is_claimed = k == CLAIMED_IN.min(space.dimensions());
    let asked = if is_claimed {
        landmarks
    } else {
        &landmarks[..1]
    };
    let window_px = space.candidates.grid().window_px();
    let exact = Exact::new(space.basis.first(k), space.metric, &space.first(k), asked);
    // A landmark's own matrix, then those of its turned views.
    let of_landmark = |(landmark, &view): (usize, &u32)| {
        let turned = if is_claimed {
            turned(map, &exact, space, view)
        } else {
            Vec::new()
        };
        let points: Vec<&[f64]> = std::iter::once(exact.point(landmark))
            .chain(turned.iter().map(Vec::as_slice))
            .collect();
        let corner = space.candidates.grid().corner(view);
        let step_px = (window_px / PER_FOOTPRINT).max(1);
        coarse_localization_matrices(map, window_px, &exact, &points, corner, step_px)
    };
    let matrices: Vec<Vec<LocalizationMatrix>> =
        asked.iter().enumerate().map(of_landmark).collect();
    let minima: Vec<usize> = matrices.iter().map(|own| local_minima(&own[0])).collect();
    let turned: Vec<bool> = asked
        .iter()
        .zip(&matrices)
        .flat_map(|(&view, own)| {
            own[1..]
                .iter()
                .map(move |matrix| is_elsewhere(matrix, space, view))
        })
        .collect();
    let elsewhere = turned.iter().filter(|is_elsewhere| **is_elsewhere).count();

    let matrix = &matrices[0][0];
    let finite = matrix
        .values()
        .iter()
        .copied()
        .filter(|value| value.is_finite());
    let (least, most) = finite.fold((f32::MAX, f32::MIN), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let flooding = Flooding {
        most: PEAKS,
        ..Flooding::of(matrix)
    };
    let peaks = find_peaks(matrix, flooding).peaks;
    let center = |corner: [u32; 2]| corner.map(|at| at + window_px / 2);
    Localized {
        dims: k,
        landmark: asked[0],
        uri: jpeg_uri(&DynamicImage::ImageLuma8(picture(map, matrix, window_px))),
        least,
        most,
        minima: minima[0],
        peaks: peaks.iter().map(|peak| center(peak.corner)).collect(),
        mean_minima: minima.iter().sum::<usize>() as f64 / minima.len() as f64,
        elsewhere: (!turned.is_empty()).then(|| elsewhere as f64 / turned.len() as f64),
    }
}

/// The coordinates of a candidate's view, turned to both sides as far as the map goes.
fn turned(map: &Map, exact: &Exact, space: &Space, view: u32) -> Vec<Vec<f64>> {
    let grid = space.candidates.grid();
    let camera = Camera::finest(grid.window_px());
    let mut frame = camera.frame();
    let scenes = TURNED_DEG.map(|degrees| Scene {
        heading_rad: degrees.to_radians(),
        ..Scene::nominal(grid.place(view))
    });
    let on_map = scenes
        .into_iter()
        .filter(|scene| camera.is_on_map(map, scene));
    on_map
        .filter_map(|scene| {
            camera.render(map, &scene, &mut seeded(0, 0), &mut frame);
            let side = space.side();
            let mut pixels = vec![0; side * side];
            let width = usize::from(frame.width);
            Integral::of(&frame.pixels, width).reduce((0, 0), width as u32, side, &mut pixels);
            exact.basis().project(&pixels)
        })
        .collect()
}

/// Whether the global minimum lies half a footprint or farther away from where the view is.
fn is_elsewhere(matrix: &LocalizationMatrix, space: &Space, view: u32) -> bool {
    let grid = space.candidates.grid();
    let values = matrix.values().iter().enumerate();
    let least = values
        .min_by(|a, b| a.1.total_cmp(b.1))
        .map_or(0, |(index, _)| index);
    let ([x, y], (own_x, own_y)) = (matrix.corner(least), grid.corner(view));
    let away = f64::from(x.abs_diff(own_x)).hypot(f64::from(y.abs_diff(own_y)));
    away >= f64::from(grid.window_px()) / 2.0
}

fn local_minima(matrix: &LocalizationMatrix) -> usize {
    let values = matrix.values();
    let is_minimum = |&index: &usize| {
        let mut others = matrix.neighbors(index);
        values[index].is_finite() && others.all(|other| values[index] < values[other])
    };
    (0..values.len()).filter(is_minimum).count()
}

/// The matrix as it lies on the map: the color of a position is at the center of its window.
fn picture(map: &Map, matrix: &LocalizationMatrix, window_px: u32) -> GrayImage {
    let widest = f64::from(PICTURE_PX) / f64::from(map.width());
    let scale = widest.min(2.0 * f64::from(PICTURE_PX) / f64::from(map.height()));
    let scaled = |px: u32| (f64::from(px) * scale).round().max(1.0) as u32;
    let small = matrix.picture();
    let first = matrix.corner(0);
    let last = matrix.corner(matrix.values().len() - 1);
    let [columns, rows] = [0, 1].map(|axis| scaled(last[axis] - first[axis] + 1));
    let small = imageops::resize(&small, columns, rows, FilterType::Triangle);
    let mut whole = GrayImage::from_pixel(scaled(map.width()), scaled(map.height()), Luma([255]));
    let [left, top] = first.map(|at| i64::from(scaled(at + window_px / 2)));
    imageops::overlay(&mut whole, &small, left, top);
    whole
}
