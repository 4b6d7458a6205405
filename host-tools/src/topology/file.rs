//! Places and legs from a file.
//!
//! ```json
//! {"places": [{"x_px": 100, "y_px": 250}, {"x_px": 300, "y_px": 250}], "legs": [[1, 2]]}
//! ```
//! Places are numbered from 1. Without `legs`, they are joined as for places that were found.

use std::{
    collections::BTreeSet,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use eigenmark_core::landmark::Point;
use serde::Deserialize;

use super::{Network, ROOM, legs};

/// The largest file that is read: as many places and legs as there is room for fit twice.
const MAX_BYTES: u64 = 4 << 20;

/// Why a file holds no places and legs.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file cannot be read.
    #[error("{}: cannot read places: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It is not what is expected.
    #[error("{}: expected {{\"places\": [{{\"x_px\", \"y_px\"}}, …], \"legs\": [[1, 2], …]}}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where it is not.
        source: serde_json::Error,
    },
    /// What it says does not fit the map or an atlas.
    #[error("{}: {what}", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// What was expected, and what was found.
        what: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    places: Vec<WrittenPlace>,
    legs: Option<Vec<(u32, u32)>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenPlace {
    x_px: f32,
    y_px: f32,
}

/// Reads places and legs for an atlas of a map of that width and height, with views of that side, in map pixels. The
/// atlas need not be there yet.
///
/// # Errors
/// When the file cannot be read, or is not what it should be.
pub fn read(path: &Path, map_px: (u32, u32), footprint_px: f32) -> Result<Network, FileError> {
    let failed = |source| FileError::Read {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(failed)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    let wrong = |what: String| FileError::Contents {
        path: path.to_owned(),
        what,
    };
    if bytes.len() as u64 > MAX_BYTES {
        return Err(wrong(format!("more than {MAX_BYTES} bytes")));
    }
    let written: Written = serde_json::from_slice(&bytes).map_err(|source| FileError::Format {
        path: path.to_owned(),
        source,
    })?;
    network(&written, map_px, footprint_px).map_err(wrong)
}

fn network(
    written: &Written,
    (width, height): (u32, u32),
    footprint_px: f32,
) -> Result<Network, String> {
    let count = written.places.len();
    if count > ROOM.0 {
        return Err(format!("{count} places; an atlas has room for {}", ROOM.0));
    }
    let mut places = Vec::with_capacity(count);
    for (place, number) in written.places.iter().zip(1..) {
        let (x_px, y_px) = (place.x_px, place.y_px);
        let is_on = (0.0..=width as f32).contains(&x_px) && (0.0..=height as f32).contains(&y_px);
        if !is_on {
            return Err(format!(
                "place {number} at ({x_px}, {y_px}) is not on the map of {width}×{height} pixels"
            ));
        }
        places.push(Point { x_px, y_px });
    }
    let Some(pairs) = &written.legs else {
        let legs = legs::between(&places, legs::longest_px(footprint_px));
        return Ok(Network { places, legs });
    };
    let mut legs = BTreeSet::new();
    for &(a, b) in pairs {
        let index = |number: u32| {
            let index = (number as usize).checked_sub(1)?;
            (index < count).then_some(index as u16)
        };
        let (Some(from), Some(to)) = (index(a), index(b)) else {
            return Err(format!("leg [{a}, {b}]; places are numbered 1 to {count}"));
        };
        if places[usize::from(from)] == places[usize::from(to)] {
            return Err(format!("leg [{a}, {b}] leads to where it starts"));
        }
        legs.insert((from.min(to), from.max(to)));
    }
    if legs.len() > ROOM.1 {
        return Err(format!(
            "{} legs; an atlas has room for {}",
            legs.len(),
            ROOM.1
        ));
    }
    Ok(Network {
        places,
        legs: legs.into_iter().collect(),
    })
}
