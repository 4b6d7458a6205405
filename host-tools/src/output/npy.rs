//! NumPy files: f64, row-major.

use std::path::Path;

use npyz::WriterBuilder;

use super::{OutputError, write_file};

/// Writes `values` as an array of `shape`, streamed.
///
/// # Errors
/// When the file cannot be written, or there are not as many values as the shape says.
pub fn write_npy(
    path: &Path,
    shape: &[u64],
    values: impl IntoIterator<Item = f64>,
) -> Result<(), OutputError> {
    write_file(path, |file| {
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .writer(file)
            .begin_nd()?;
        writer.extend(values)?;
        writer.finish()
    })
}
