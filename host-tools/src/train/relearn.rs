//! From an atlas and its map back to the eigenspace in f64 that it was made of.

use eigenmark_core::{atlas::Atlas, landmark::Record};

use super::{TrainError, cut};
use crate::{
    learn::{Model, Preprocess, Space},
    map::{Grid, Map},
};

/// The eigenspace of an atlas before it was quantized, and its candidates in it.
#[derive(Clone, Debug)]
pub struct Relearned {
    /// The eigenspace, and the candidates in it as they are matched.
    pub space: Space,
    /// Candidate numbers of the landmarks, best first.
    pub landmarks: Vec<u32>,
}

/// Why an atlas cannot be learned again.
#[derive(Debug, thiserror::Error)]
pub enum RelearnError {
    /// The map is not the one that the atlas was trained on.
    #[error(
        "the atlas was trained on a map of {}×{} pixels with CRC {expected_crc:08x}, and this one has {}×{} and CRC \
         {found_crc:08x}",
        expected_px.0, expected_px.1, found_px.0, found_px.1
    )]
    OtherMap {
        /// Size of the map that it was trained on, in pixels.
        expected_px: (u32, u32),
        /// CRC-32 of its luminance.
        expected_crc: u32,
        /// Size of this map.
        found_px: (u32, u32),
        /// CRC-32 of its luminance.
        found_crc: u32,
    },
    /// It could not have been trained like that.
    #[error(transparent)]
    Train(#[from] TrainError),
}

impl Relearned {
    /// Learns the eigenspace of `atlas` again from its map.
    ///
    /// High-pass and whitening are those of the atlas, which holds them in single precision.
    ///
    /// # Errors
    /// When the map is another one, or the atlas does not fit it.
    pub fn new(map: &Map, atlas: &Atlas<'_>) -> Result<Self, RelearnError> {
        let header = atlas.header();
        let training = header.training;
        let (found_px, found_crc) = ((map.width(), map.height()), map.crc());
        if found_px != header.map_px || found_crc != training.map_crc {
            return Err(RelearnError::OtherMap {
                expected_px: header.map_px,
                expected_crc: training.map_crc,
                found_px,
                found_crc,
            });
        }
        // A footprint between pixels leaves corners between pixels: it is refused there.
        let grid = Grid::of(map, header.footprint_px.round() as u32, &header.survey)
            .map_err(TrainError::Grid)?;
        let preprocess = Preprocess::new(
            usize::from(header.view_side),
            header.normalize,
            training.blur,
            f64::from(training.highpass),
        );
        let candidates = cut(map, &grid, &preprocess, header.dimensions)?;
        let model =
            Model::learn(&candidates, usize::from(header.dimensions)).map_err(TrainError::Pca)?;
        let whiten = f64::from(training.whiten);
        let records = atlas.landmarks().records();
        Ok(Self {
            space: Space::new(candidates, model, whiten, header.metric),
            landmarks: records.iter().map(|&Record { view, .. }| view).collect(),
        })
    }
}
