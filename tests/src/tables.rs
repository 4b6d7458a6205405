//! The atlases that `cycles` measures, all of the built-in city. Those that several tests need are trained once by a
//! program.

use std::sync::{Mutex, PoisonError};

use eigenmark::{
    atlas::AtlasBuffer,
    learn::Settings,
    map::Map,
    output::Progress,
    select::Selection,
    train::{TrainError, train},
};
use eigenmark_core::{
    eigenspace::Normalize,
    landmark::{Metric, Width},
    route::Place,
};

/// The report's table of all 83 views.
///
/// # Errors
/// None that the built-in city gives.
pub fn report(progress: &Progress) -> Result<AtlasBuffer, TrainError> {
    static TABLE: Table = Table::new(None);
    shared(&TABLE, &all(), progress)
}

/// What lies in the flash of each run of `cycles`, slot by slot: the report's table and 1,326 landmarks of as many
/// dimensions; then the dense tables, with 48 dimensions of 16 bits and with 96 of 8 bits, as large as the chip's flash
/// allows at the same step; then the one that is flown by.
///
/// # Errors
/// None that the built-in city gives.
pub fn of_cycles(progress: &Progress) -> Result<Vec<Vec<AtlasBuffer>>, TrainError> {
    let more = Settings {
        stride_px: Some(32),
        ..all()
    };
    let wide = Settings {
        dimensions: 48,
        highpass_px: 0.0,
        width: Width::I16,
        ..narrow()
    };
    Ok(vec![
        vec![report(progress)?, trained(&more, progress)?],
        vec![trained(&wide, progress)?],
        vec![dense(progress)?],
        vec![flown(progress)?],
    ])
}

/// A dense table of 48 dimensions of 8 bits, and a way between places.
///
/// # Errors
/// None that the built-in city gives.
pub fn flown(progress: &Progress) -> Result<AtlasBuffer, TrainError> {
    static TABLE: Table = Table::new(None);
    let settings = Settings {
        dimensions: 48,
        ..narrow()
    };
    Ok(with_way(&shared(&TABLE, &settings, progress)?))
}

/// The same atlas with a way through its map: five places in a row, each a leg from the next.
///
/// # Panics
/// When its map is not as large as that of any atlas is.
#[must_use]
pub fn with_way(atlas: &AtlasBuffer) -> AtlasBuffer {
    let atlas = atlas.atlas();
    let (width, height) = atlas.header().map_px;
    let [right, down] = [width, height].map(|side| side as f32 / 6.0);
    let places = [
        (1.0, 1.0, 0),
        (2.0, 1.0, 1),
        (3.0, 2.0, 3),
        (4.0, 4.0, 5),
        (5.0, 4.0, 7),
    ];
    let places = places.map(|(x, y, first_leg)| Place {
        x_px: x * right,
        y_px: y * down,
        first_leg,
    });
    let legs = [1, 0, 2, 1, 3, 2, 4, 3];
    AtlasBuffer::with_topology(&atlas, &places, &legs).expect("places on the map")
}

/// A dense table of 96 dimensions of 8 bits.
///
/// # Errors
/// None that the built-in city gives.
pub fn dense(progress: &Progress) -> Result<AtlasBuffer, TrainError> {
    static TABLE: Table = Table::new(None);
    shared(&TABLE, &narrow(), progress)
}

fn narrow() -> Settings {
    Settings {
        stride_px: Some(20),
        dimensions: 96,
        normalize: Normalize::Std,
        highpass_px: 3.0,
        whiten: 0.5,
        metric: Metric::Cosine,
        width: Width::I8,
        ..all()
    }
}

fn all() -> Settings {
    Settings {
        selection: Selection::All,
        ..Settings::default()
    }
}

/// Held while it is trained: who needs it meanwhile waits.
type Table = Mutex<Option<AtlasBuffer>>;

fn shared(
    table: &Table,
    settings: &Settings,
    progress: &Progress,
) -> Result<AtlasBuffer, TrainError> {
    let mut table = table.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(atlas) = &*table {
        return Ok(atlas.clone());
    }
    let atlas = trained(settings, progress)?;
    Ok(table.insert(atlas).clone())
}

fn trained(settings: &Settings, progress: &Progress) -> Result<AtlasBuffer, TrainError> {
    Ok(train(&Map::city(), settings, false, progress)?.atlas)
}
