//! Atlas → bytes: the mirror of [`parse`](super::parse).

use bytemuck::bytes_of;

use super::{
    Atlas, AtlasError, Header, Layout, MAGIC, MAX_HEADER_LEN, PREAMBLE_LEN, VERSION, checksum,
};
use crate::{
    eigenspace::{Row, squared_norm},
    landmark::{Record, row_len},
    route::Place,
};

/// Everything that goes into an atlas. Lengths follow from the header.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    /// The header; its counts say how long the slices are.
    pub header: &'a Header,
    /// Basis weights as stored, see [`weight_index`](crate::eigenspace::weight_index).
    pub weights: &'a [i16],
    /// Factors of the k basis rows.
    pub rows: &'a [Row],
    /// Weights of the mean row in picture order, padded with zeros to whole groups of four.
    pub mean_weights: &'a [i8],
    /// Coefficients of the landmarks: l rows of k, not padded.
    pub coefficients: &'a [i16],
    /// Candidate numbers and radii of the landmarks.
    pub records: &'a [Record],
    /// Thumbnails of the landmarks, or nothing.
    pub thumbnails: &'a [u8],
    /// Places of the topological map, or nothing.
    pub places: &'a [Place],
    /// The places that legs lead to, in the order of the places they start from.
    pub legs: &'a [u16],
}

/// Bytes that [`emit`] will write for this header.
///
/// # Errors
/// When the header does not encode within its limit.
pub fn emitted_len(header: &Header) -> Result<u64, AtlasError> {
    let mut buffer = [0; MAX_HEADER_LEN];
    let len = encode_header(header, &mut buffer)?.len();
    Ok(Layout::of(header, len).total_len)
}

/// Writes an atlas to the start of `buffer`, parses what it wrote, and returns it. `buffer` must be 8-aligned.
///
/// # Errors
/// [`AtlasError::NoRoom`] when the buffer is too small, otherwise what [`Atlas::parse`] has against the contents.
///
/// # Panics
/// When a slice in `contents` does not have the length that the header states.
pub fn emit<'b>(contents: &Contents<'_>, buffer: &'b mut [u8]) -> Result<Atlas<'b>, AtlasError> {
    let header = contents.header;
    let mut encoded = [0; MAX_HEADER_LEN];
    let encoded = encode_header(header, &mut encoded)?;
    let layout = Layout::of(header, encoded.len());
    let have = u32::try_from(buffer.len()).unwrap_or(u32::MAX);
    let total_len = u32::try_from(layout.total_len)
        .ok()
        .filter(|&len| len <= have);
    let total_len = total_len.ok_or(AtlasError::NoRoom {
        needed: layout.total_len,
        have,
    })?;

    let atlas = &mut buffer[..total_len as usize];
    atlas.fill(0);
    atlas[..4].copy_from_slice(&MAGIC);
    atlas[4..6].copy_from_slice(&VERSION.to_le_bytes());
    atlas[6..8].copy_from_slice(&(encoded.len() as u16).to_le_bytes());
    atlas[8..12].copy_from_slice(&total_len.to_le_bytes());
    atlas[PREAMBLE_LEN..PREAMBLE_LEN + encoded.len()].copy_from_slice(encoded);

    write(
        &mut atlas[layout.weights.range()],
        contents.weights.iter().map(bytes_of),
    );
    write(
        &mut atlas[layout.rows.range()],
        contents.rows.iter().map(bytes_of),
    );
    write(
        &mut atlas[layout.mean_weights.range()],
        contents.mean_weights.iter().map(bytes_of),
    );
    write_landmarks(contents, atlas, &layout);
    write(
        &mut atlas[layout.records.range()],
        contents.records.iter().map(bytes_of),
    );
    atlas[layout.thumbnails.range()].copy_from_slice(contents.thumbnails);
    write(
        &mut atlas[layout.places.range()],
        contents.places.iter().map(bytes_of),
    );
    write(
        &mut atlas[layout.legs.range()],
        contents.legs.iter().map(bytes_of),
    );

    let crc = checksum(atlas);
    atlas[12..PREAMBLE_LEN].copy_from_slice(&crc.to_le_bytes());
    Atlas::parse(buffer)
}

fn encode_header<'b>(
    header: &Header,
    buffer: &'b mut [u8; MAX_HEADER_LEN],
) -> Result<&'b [u8], AtlasError> {
    let encoded = postcard::to_slice(header, buffer);
    encoded
        .map(|bytes| &*bytes)
        .map_err(|_| AtlasError::Header { len: u16::MAX })
}

/// Copies items one after the other; together they fill `target`.
fn write<'a>(target: &mut [u8], items: impl Iterator<Item = &'a [u8]>) {
    let mut rest = target;
    for item in items {
        let (place, after) = rest.split_at_mut(item.len());
        place.copy_from_slice(item);
        rest = after;
    }
    assert!(
        rest.is_empty(),
        "contents are {} bytes shorter than their header states",
        rest.len()
    );
}

/// Coefficients, padded to whole words per row, and their squared norms.
fn write_landmarks(contents: &Contents<'_>, atlas: &mut [u8], layout: &Layout) {
    let header = contents.header;
    let (k, width) = (usize::from(header.dimensions), header.width);
    let row_bytes = row_len(header.dimensions, width) * size_of::<u32>();
    assert_eq!(
        contents.coefficients.len(),
        header.landmarks as usize * k,
        "coefficients of the landmarks"
    );
    for (index, coefficients) in contents.coefficients.chunks_exact(k.max(1)).enumerate() {
        let start = layout.coefficients.range().start + index * row_bytes;
        let row = atlas[start..start + row_bytes].chunks_exact_mut(size_of::<i16>());
        for (place, values) in row.zip(coefficients.chunks(width.per_number())) {
            let number = width.pack(values[0], values.get(1).copied().unwrap_or(0));
            place.copy_from_slice(&number.to_le_bytes());
        }
        let norm = squared_norm(coefficients.iter().copied());
        let start = layout.squared_norms.range().start + index * size_of::<u32>();
        atlas[start..start + size_of::<u32>()].copy_from_slice(&norm.to_le_bytes());
    }
}
