//! What tests place and write.

use std::sync::LazyLock;

use crate::{atlas::AtlasBuffer, learn::Settings, map::Map, output::Progress, train::train};

/// An atlas of the built-in city: some 16 KiB, neither a whole number of lines nor of pages.
pub static ATLAS: LazyLock<AtlasBuffer> = LazyLock::new(|| {
    let trained = train(&Map::city(), &Settings::default(), false, &Progress::Hidden);
    trained.expect("trains").atlas
});
