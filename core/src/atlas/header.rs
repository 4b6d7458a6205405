//! The postcard header, and the layout of the blobs that follows from it.

use serde::{Deserialize, Serialize};

use super::{ALIGNMENT, PREAMBLE_LEN};
use crate::{
    eigenspace::{MeanRow, Normalize, Row, padded_pixels, weight_count},
    landmark::{Metric, Record, Survey, Width, row_len},
    route::Place,
};

/// What an atlas says about itself. Sizes, then meaning, then how it was trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Pixels per side of a view, v.
    pub view_side: u8,
    /// Dimensions of the eigenspace, k.
    pub dimensions: u8,
    /// Number of landmarks, l.
    pub landmarks: u32,
    /// Width of the landmarks' coefficients.
    pub width: Width,
    /// Pixels per side of the landmarks' thumbnails; 0 for none.
    pub thumbnail_side: u8,
    /// Contrast normalization.
    pub normalize: Normalize,
    /// Metric of the table.
    pub metric: Metric,
    /// Eigenspace units per step of a coefficient, after whitening.
    pub step: f32,
    /// Euclidean distance of a view's coefficients from the exact ones, at most, in steps; clamped views excepted.
    pub error: f32,
    /// What counts as known.
    pub limits: Limits,
    /// Factors of the mean row.
    pub mean: MeanRow,
    /// Side of a view's footprint on the map, in map pixels.
    pub footprint_px: f32,
    /// Width and height of the map, in pixels.
    pub map_px: (u32, u32),
    /// Where candidates lie, and how they are seen.
    pub survey: Survey,
    /// What a distance says about where the vehicle is.
    pub likelihood: Likelihood,
    /// Number of places of the topological map; 0 for none.
    pub places: u32,
    /// Number of legs between them.
    pub legs: u32,
    /// How it was trained; informative.
    pub training: Training,
}

/// A fix is known when both distances are at most these.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Distance to the landmark, in the metric's unit.
    pub distance: f32,
    /// Distance from feature space.
    pub from_feature_space: f32,
}

/// How much likelier a frame is where a landmark was seen than elsewhere: exp(−sharpness · min(δ, ceiling)) of the
/// squared dissimilarity δ, which is ‖a − b‖² (Euclid), nSSD, or 1 − cos (cosine).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Likelihood {
    /// Fall of the logarithm per unit of δ.
    pub sharpness: f32,
    /// From here on δ says nothing more: the view is of somewhere else, or hidden. Also δ where no landmark is near.
    pub ceiling: f32,
}

/// How an atlas was trained. Nothing here changes a fix: it is folded into the weights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// Map pixels per view pixel, as asked for (scale 10 is the report's 1/10).
    pub scale: f32,
    /// Gaussian blur of the views.
    pub blur: Blur,
    /// Sigma of the high-pass in view pixels; 0 for none.
    pub highpass: f32,
    /// Whitening exponent α: coefficients were multiplied by λ^(−α/2); 0 for none.
    pub whiten: f32,
    /// Share of the candidates' variance that the dimensions cover, report (2.8).
    pub covered_variance: f32,
    /// CRC-32 of the map's luminance, row-major.
    pub map_crc: u32,
}

/// Gaussian blur of the views; report table 3.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Blur {
    /// No blur.
    None,
    /// 3×3 pixels, σ = 0.48.
    Gauss1,
    /// 5×5 pixels, σ = 0.65.
    Gauss2,
    /// 7×7 pixels, σ = 0.76.
    Gauss3,
}

/// Where the blobs of an atlas lie, in bytes from its start; each starts at a multiple of [`ALIGNMENT`].
///
/// 64-bit, so that no header makes it overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// i16 weights of the basis, in the order of [`weight_index`](crate::eigenspace::weight_index).
    pub weights: Blob,
    /// Factors of the basis rows.
    pub rows: Blob,
    /// i8 weights of the mean row, in picture order, padded to whole groups.
    pub mean_weights: Blob,
    /// Coefficients of the landmarks.
    pub coefficients: Blob,
    /// u32 squared norms of the landmarks.
    pub squared_norms: Blob,
    /// Candidate numbers and radii of the landmarks.
    pub records: Blob,
    /// u8 thumbnails of the landmarks.
    pub thumbnails: Blob,
    /// Places of the topological map.
    pub places: Blob,
    /// u16 places that legs lead to.
    pub legs: Blob,
    /// Length of the whole atlas.
    pub total_len: u64,
}

/// A run of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blob {
    /// First byte.
    pub start: u64,
    /// Length in bytes.
    pub len: u64,
}

impl Layout {
    /// The layout that follows from a header of `header_len` encoded bytes.
    #[must_use]
    pub fn of(header: &Header, header_len: usize) -> Self {
        let (side, k) = (header.view_side, header.dimensions);
        let landmarks = u64::from(header.landmarks);
        let thumbnail = u64::from(header.thumbnail_side) * u64::from(header.thumbnail_side);
        let row_bytes = (row_len(k, header.width) * size_of::<u32>()) as u64;

        let mut end = (PREAMBLE_LEN + header_len) as u64;
        let mut next = |len: u64| {
            let start = end.next_multiple_of(ALIGNMENT as u64);
            end = start + len;
            Blob { start, len }
        };
        let weights = next((weight_count(side, k) * size_of::<i16>()) as u64);
        let rows = next((usize::from(k) * size_of::<Row>()) as u64);
        let mean_weights = next(padded_pixels(side) as u64);
        let coefficients = next(landmarks * row_bytes);
        let squared_norms = next(landmarks * size_of::<u32>() as u64);
        let records = next(landmarks * size_of::<Record>() as u64);
        let thumbnails = next(landmarks * thumbnail);
        let places = next(u64::from(header.places) * size_of::<Place>() as u64);
        let legs = next(u64::from(header.legs) * size_of::<u16>() as u64);
        Self {
            weights,
            rows,
            mean_weights,
            coefficients,
            squared_norms,
            records,
            thumbnails,
            places,
            legs,
            total_len: end,
        }
    }

    /// All blobs in the order they lie in.
    #[must_use]
    pub fn blobs(&self) -> [Blob; 9] {
        [
            self.weights,
            self.rows,
            self.mean_weights,
            self.coefficients,
            self.squared_norms,
            self.records,
            self.thumbnails,
            self.places,
            self.legs,
        ]
    }
}

impl Blob {
    /// The bytes of this blob; none when the atlas is shorter than its layout.
    #[must_use]
    pub fn of<'a>(&self, atlas: &'a [u8]) -> &'a [u8] {
        atlas.get(self.range()).unwrap_or_default()
    }

    /// Its range as indices.
    #[must_use]
    pub fn range(&self) -> core::ops::Range<usize> {
        self.start as usize..(self.start + self.len) as usize
    }
}
