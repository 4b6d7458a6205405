//! The topological map of an atlas: which places a vehicle can recognize, and between which it can fly.
//!
//! [`lay_out`] finds places among an atlas's landmarks, [`read`] takes them from a file; [`Network::add_to`] writes
//! them into the atlas.

mod file;
mod legs;
mod places;
#[cfg(test)]
mod tests;

use eigenmark_core::{
    atlas::{Atlas, AtlasError},
    landmark::Point,
    route::{MAX_LEGS, MAX_PLACES, Place},
};

use crate::{atlas::AtlasBuffer, map::Map, output::Progress};

pub use file::{FileError, read};

/// Places and the legs between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Network {
    /// Where places are, in map pixels.
    pub places: Vec<Point>,
    /// Pairs of places (0-based) that can be flown between, both ways: the smaller first, ascending, each once.
    pub legs: Vec<(u16, u16)>,
}

/// Finds places and legs for an atlas of `map`.
///
/// A place is a landmark that views deviated as in flight are recognized at; places are at least half a view apart.
/// A leg joins two places when no third one lies between them, and they are near enough for path integration.
#[must_use]
pub fn lay_out(map: &Map, atlas: &Atlas<'_>, progress: &Progress) -> Network {
    let places = places::recognized(map, atlas, progress);
    let legs = legs::between(&places, legs::longest_px(atlas.header().footprint_px));
    Network { places, legs }
}

/// The same without trying them: all landmarks at least half a view apart are places.
#[must_use]
pub fn of_landmarks(atlas: &Atlas<'_>) -> Network {
    let places = places::of_landmarks(atlas);
    let legs = legs::between(&places, legs::longest_px(atlas.header().footprint_px));
    Network { places, legs }
}

impl Network {
    /// The atlas with these places and legs in place of its own.
    ///
    /// # Errors
    /// What the core has against them.
    pub fn add_to(&self, atlas: &Atlas<'_>) -> Result<AtlasBuffer, AtlasError> {
        let (places, legs) = self.stored();
        AtlasBuffer::with_topology(atlas, &places, &legs)
    }

    /// As an atlas stores them.
    #[must_use]
    pub fn stored(&self) -> (Vec<Place>, Vec<u16>) {
        let mut targets = vec![Vec::new(); self.places.len()];
        for &(a, b) in &self.legs {
            targets[usize::from(a)].push(b);
            targets[usize::from(b)].push(a);
        }
        let (mut places, mut legs) = (Vec::new(), Vec::new());
        for (point, targets) in self.places.iter().zip(targets) {
            places.push(Place {
                x_px: point.x_px,
                y_px: point.y_px,
                first_leg: legs.len() as u32,
            });
            legs.extend(targets);
        }
        (places, legs)
    }

    /// Number of groups of places between which no way leads.
    #[must_use]
    pub fn islands(&self) -> usize {
        let mut group: Vec<usize> = (0..self.places.len()).collect();
        fn root(group: &mut [usize], mut of: usize) -> usize {
            while group[of] != of {
                group[of] = group[group[of]];
                of = group[of];
            }
            of
        }
        for &(a, b) in &self.legs {
            let (a, b) = (root(&mut group, a.into()), root(&mut group, b.into()));
            group[a] = b;
        }
        (0..group.len()).filter(|&of| group[of] == of).count()
    }
}

/// Places and legs that an atlas has room for: as far as both go.
const ROOM: (usize, usize) = (MAX_PLACES as usize, MAX_LEGS as usize / 2);
