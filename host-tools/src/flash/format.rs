//! Files that carry bytes and their addresses.

mod elf;
mod hex;
mod uf2;

use std::path::Path;

use super::Placement;

/// A format of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The bytes of the atlas as they are: whoever writes them must know where to.
    Bin,
    /// Intel HEX.
    Hex,
    /// UF2, as bootloaders that show themselves as disks take it.
    Uf2,
    /// ELF, as debuggers take it.
    Elf,
}

/// Why there is no such file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// The file's ending says nothing of its format.
    #[error("expected a name that ends in .bin, .hex, .uf2 or .elf, found {found}")]
    Unknown {
        /// The ending.
        found: String,
    },
    /// A file without addresses has no place for a record.
    #[error("a .bin file has no addresses, and so no record; .hex, .uf2 and .elf have")]
    NoAddresses,
    /// What writes the format has something against the contents.
    #[error("cannot write {format}: {reason}")]
    Writer {
        /// The format.
        format: &'static str,
        /// What it says.
        reason: String,
    },
}

impl Format {
    /// The format of files of that name, by its ending.
    ///
    /// # Errors
    /// [`FormatError::Unknown`].
    pub fn of(path: &Path) -> Result<Self, FormatError> {
        let ending = path
            .extension()
            .map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("bin") => Ok(Self::Bin),
            Some("hex") => Ok(Self::Hex),
            Some("uf2") => Ok(Self::Uf2),
            Some("elf") => Ok(Self::Elf),
            ending => Err(FormatError::Unknown {
                found: ending.map_or_else(|| "none".to_owned(), |ending| format!(".{ending}")),
            }),
        }
    }

    /// What it is called: the ending of its files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bin => "bin",
            Self::Hex => "hex",
            Self::Uf2 => "uf2",
            Self::Elf => "elf",
        }
    }

    /// A file of what is placed; `family` is the chip's, as UF2 numbers them.
    ///
    /// # Errors
    /// When the format has no place for it.
    pub fn encode(self, placement: &Placement, family: u32) -> Result<Vec<u8>, FormatError> {
        let segments = placement.segments();
        match self {
            Self::Bin => match segments {
                [atlas] => Ok(atlas.bytes.clone()),
                _ => Err(FormatError::NoAddresses),
            },
            Self::Hex => hex::encode(segments).map(String::into_bytes),
            Self::Uf2 => Ok(uf2::encode(segments, family)),
            Self::Elf => elf::encode(segments),
        }
    }
}

#[cfg(test)]
mod tests;
