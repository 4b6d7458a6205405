//! Training in parts: each folds some of the candidates, and one goes on with all of them.
//!
//! **Limits.** Candidates are read a second time when parts are merged: coordinates need the eigenspace of all. That costs
//! k multiply-adds per pixel where folding costs m/2.

use super::{Part, Shard, TrainError, Trained, finish, lay_out};
use crate::{
    learn::{Candidates, Fold, Model, Rows, Settings},
    map::Map,
    output::Progress,
};

/// Why parts could not be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There are not as many parts as they say.
    #[error("part {missing} of {of} is missing")]
    MissingPart {
        /// Its number.
        missing: u32,
        /// How many there should be.
        of: u32,
    },
    /// A part is there more than once.
    #[error("part {shard} is given more than once")]
    SamePart {
        /// The part.
        shard: Shard,
    },
    /// A part was made for another atlas.
    #[error(
        "part {shard} was made with other settings, or of another number of parts, than part {first}"
    )]
    OtherSettings {
        /// The part.
        shard: Shard,
        /// The first part given.
        first: Shard,
    },
    /// A part was made from another map.
    #[error("part {shard} was made from a map with CRC {expected:08x}; this one has {found:08x}")]
    OtherMap {
        /// The part.
        shard: Shard,
        /// CRC of its map.
        expected: u32,
        /// CRC of this map.
        found: u32,
    },
    /// A part does not hold its share of the candidates.
    #[error(
        "part {shard} holds {found} views of {found_pixels} pixels, expected {expected} of {pixels}"
    )]
    OtherShare {
        /// The part.
        shard: Shard,
        /// Vectors in it.
        found: usize,
        /// Numbers per vector in it.
        found_pixels: usize,
        /// Views of its share.
        expected: usize,
        /// Pixels per view.
        pixels: usize,
    },
    /// Something that would also keep a single run from training.
    #[error(transparent)]
    Train(#[from] TrainError),
}

/// Folds one share of the candidates.
///
/// # Errors
/// See [`TrainError`].
pub fn fold_shard(
    map: &Map,
    settings: &Settings,
    shard: Shard,
    progress: &Progress,
) -> Result<Part, TrainError> {
    let _step = progress.step("folding views");
    let candidates = lay_out(map, settings)?;
    let (first, end) = shard.range(candidates.count());
    Ok(Part {
        shard,
        settings: settings.clone(),
        map_crc: map.crc(),
        fold: Fold::of(&candidates, first, end),
    })
}

/// Trains an atlas from parts of its candidates, in any order; as [`train`](super::train) does from all at once.
///
/// # Errors
/// When the parts are not those of one training on this map, and as [`train`](super::train).
pub fn merge(
    map: &Map,
    parts: Vec<Part>,
    with_profile: bool,
    progress: &Progress,
) -> Result<Trained, MergeError> {
    let step = progress.step("joining parts");
    let (settings, candidates, model) = joined(map, parts)?;
    drop(step);
    Ok(finish(
        map,
        &settings,
        candidates,
        model,
        with_profile,
        progress,
    )?)
}

/// What the parts, in any order, were made for, and the eigenspace of all of them.
///
/// # Errors
/// As [`merge`].
pub fn joined(
    map: &Map,
    mut parts: Vec<Part>,
) -> Result<(Settings, Candidates, Model), MergeError> {
    parts.sort_by_key(|part| part.shard.index());
    let settings = check(&parts, map.crc())?;
    let candidates = lay_out(map, &settings)?;
    let mut joined: Option<Fold> = None;
    for part in parts {
        let (first, end) = part.shard.range(candidates.count());
        let other_share = MergeError::OtherShare {
            shard: part.shard,
            found: part.fold.count(),
            found_pixels: part.fold.pixels(),
            expected: end - first,
            pixels: candidates.pixels(),
        };
        if part.fold.count() != end - first || part.fold.pixels() != candidates.pixels() {
            return Err(other_share);
        }
        joined = Some(match joined {
            None => part.fold,
            Some(before) => before.join(part.fold).map_err(|_| other_share)?,
        });
    }
    let fold = joined.ok_or(MergeError::MissingPart { missing: 1, of: 1 })?;
    let model = Model::of_fold(&fold, usize::from(settings.dimensions)).map_err(TrainError::Pca)?;
    Ok((settings, candidates, model))
}

/// Checks that these parts, in the order of their numbers, are all of one training on one map; gives its settings.
fn check(parts: &[Part], map_crc: u32) -> Result<Settings, MergeError> {
    let Some(first) = parts.first() else {
        return Err(MergeError::MissingPart { missing: 1, of: 1 });
    };
    for part in parts {
        let shard = part.shard;
        if part.settings != first.settings || shard.of() != first.shard.of() {
            return Err(MergeError::OtherSettings {
                shard,
                first: first.shard,
            });
        }
        if part.map_crc != map_crc {
            return Err(MergeError::OtherMap {
                shard,
                expected: part.map_crc,
                found: map_crc,
            });
        }
    }
    if let Some(pair) = parts.windows(2).find(|pair| pair[0].shard == pair[1].shard) {
        return Err(MergeError::SamePart {
            shard: pair[0].shard,
        });
    }
    let of = first.shard.of();
    let is_missing = |index: &u32| {
        let part = parts.get(*index as usize - 1);
        part.is_none_or(|part| part.shard.index() != *index)
    };
    match (1..=of).find(is_missing) {
        Some(missing) => Err(MergeError::MissingPart { missing, of }),
        None => Ok(first.settings.clone()),
    }
}
