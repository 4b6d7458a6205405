//! The bytes of an atlas, aligned as its format wants them, known to be valid.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use eigenmark_core::{
    atlas::{Atlas, AtlasError, Contents, Header, emit, emitted_len},
    landmark::Record,
    route::Place,
};

/// The largest atlas file that is read: more than any microcontroller's flash.
const MAX_FILE_BYTES: u64 = 256 << 20;

/// A valid atlas in memory.
#[derive(Clone, Debug)]
pub struct AtlasBuffer {
    words: Vec<u64>,
    len: usize,
}

/// Why a file is not an atlas.
#[derive(Debug, thiserror::Error)]
pub enum AtlasFileError {
    /// The file cannot be read.
    #[error("{}: cannot read the atlas: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not an atlas.
    #[error("{}: {error}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: AtlasError,
    },
    /// The file goes on after the atlas.
    #[error("{}: expected an atlas of {expected} bytes, found {found}", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Length of the atlas.
        expected: u64,
        /// Length of the file.
        found: u64,
    },
}

impl AtlasBuffer {
    /// Writes an atlas.
    ///
    /// # Errors
    /// What the core has against the contents.
    pub fn emit(contents: &Contents<'_>) -> Result<Self, AtlasError> {
        let len = emitted_len(contents.header)?;
        let Ok(len) = usize::try_from(len) else {
            return Err(AtlasError::NoRoom {
                needed: len,
                have: u32::MAX,
            });
        };
        let mut words = vec![0; len.div_ceil(size_of::<u64>())];
        emit(contents, &mut bytemuck::cast_slice_mut(&mut words)[..len])?;
        Ok(Self { words, len })
    }

    /// Writes `atlas` again with another header and other records.
    ///
    /// # Errors
    /// What the core has against them.
    pub fn with(
        atlas: &Atlas<'_>,
        header: &Header,
        records: &[Record],
    ) -> Result<Self, AtlasError> {
        let topology = atlas.topology();
        Self::again(
            atlas,
            header,
            records,
            topology.places(),
            topology.stored_legs(),
        )
    }

    fn again(
        atlas: &Atlas<'_>,
        header: &Header,
        records: &[Record],
        places: &[Place],
        legs: &[u16],
    ) -> Result<Self, AtlasError> {
        let (eigenspace, landmarks) = (atlas.eigenspace(), atlas.landmarks());
        let rows = (0..landmarks.len()).flat_map(|index| landmarks.coefficients(index));
        Self::emit(&Contents {
            header,
            weights: eigenspace.stored_weights(),
            rows: eigenspace.rows(),
            mean_weights: eigenspace.stored_mean_weights(),
            coefficients: &rows.collect::<Vec<i16>>(),
            records,
            thumbnails: atlas.thumbnails(),
            places,
            legs,
        })
    }

    /// Writes `atlas` again with other places and legs.
    ///
    /// # Errors
    /// What the core has against them.
    pub fn with_topology(
        atlas: &Atlas<'_>,
        places: &[Place],
        legs: &[u16],
    ) -> Result<Self, AtlasError> {
        let mut header = atlas.header().clone();
        (header.places, header.legs) = (places.len() as u32, legs.len() as u32);
        Self::again(atlas, &header, atlas.landmarks().records(), places, legs)
    }

    /// Copies an atlas from bytes.
    ///
    /// # Errors
    /// What the core has against the bytes. Bytes after the end of the atlas are kept out.
    pub fn copy_of(bytes: &[u8]) -> Result<Self, AtlasError> {
        let mut words = vec![0; bytes.len().div_ceil(size_of::<u64>())];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        let len = Atlas::parse(&bytemuck::cast_slice(&words)[..bytes.len()])?.total_len() as usize;
        Ok(Self { words, len })
    }

    /// Reads an atlas file.
    ///
    /// # Errors
    /// When the file cannot be read, is not an atlas, or goes on after it.
    pub fn read(path: &Path) -> Result<Self, AtlasFileError> {
        let read = |source| AtlasFileError::Read {
            path: path.to_owned(),
            source,
        };
        let mut bytes = Vec::new();
        File::open(path)
            .map_err(read)?
            .take(MAX_FILE_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(read)?;
        let atlas = Self::copy_of(&bytes).map_err(|error| AtlasFileError::Invalid {
            path: path.to_owned(),
            error,
        })?;
        if atlas.len != bytes.len() {
            let (expected, found) = (atlas.len as u64, bytes.len() as u64);
            return Err(AtlasFileError::TooLong {
                path: path.to_owned(),
                expected,
                found,
            });
        }
        Ok(atlas)
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }

    /// The atlas.
    ///
    /// # Panics
    /// Never: the bytes were checked when this buffer was made.
    #[must_use]
    pub fn atlas(&self) -> Atlas<'_> {
        Atlas::parse(self.bytes()).expect("checked when it was made")
    }
}
