//! Bytes → atlas. Every check happens here, once, in a fixed order: preamble, header, lengths and gaps, basis,
//! landmarks, places and legs.

use bytemuck::Pod;
use postcard::ser_flavors::Size;

use super::{
    ALIGNMENT, Atlas, AtlasError, Header, Layout, MAGIC, MAX_HEADER_LEN, PREAMBLE_LEN, Part,
    VERSION, checksum,
};
use crate::{
    eigenspace::{
        Eigenspace, MAX_DIMENSIONS, Normalize, ROWS_PER_BLOCK, padded_pixels, squared_norm,
        weight_count,
    },
    landmark::{LandmarkTable, MAX_ALTITUDES, MAX_HEADINGS, Record, Survey, row_len},
    preprocess::{MAX_ALTITUDE_RATIO, MAX_VIEW_SIDE, MIN_ALTITUDE_RATIO, MIN_VIEW_SIDE},
    route::{MAX_LEGS, MAX_PLACES, TopologicalMap},
};

/// The largest accepted width and height of a map, in pixels: whole numbers up to here, and halves, are exact in f32.
const MAX_MAP_SIDE_PX: u32 = 1 << 20;

/// Floats of the header that must be finite and at least zero, or above zero.
enum Sign {
    NotNegative,
    Positive,
    Any,
}

impl<'a> Atlas<'a> {
    /// Reads an atlas from the start of `bytes`; bytes after its end (the rest of a flash region) are not looked at.
    ///
    /// # Errors
    /// The first check that failed.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, AtlasError> {
        let offset = bytes.as_ptr().addr() % ALIGNMENT;
        if offset != 0 {
            return Err(AtlasError::Misaligned {
                offset: offset as u8,
            });
        }
        let (bytes, header_len, crc) = check_preamble(bytes)?;
        let total_len = bytes.len() as u32;
        let header = decode_header(bytes, header_len)?;
        check_header(&header)?;

        let layout = Layout::of(&header, usize::from(header_len));
        if layout.total_len != u64::from(total_len) {
            return Err(AtlasError::Length {
                expected: layout.total_len,
                found: total_len,
            });
        }
        check_gaps(bytes, &layout, usize::from(header_len))?;

        let eigenspace = Eigenspace {
            side: header.view_side,
            normalize: header.normalize,
            limit: header.width.limit(header.dimensions),
            mean: header.mean,
            mean_weights: cast(layout.mean_weights.of(bytes), Part::MeanWeights)?,
            rows: cast(layout.rows.of(bytes), Part::Rows)?,
            weights: cast(layout.weights.of(bytes), Part::Weights)?,
        };
        check_eigenspace(&eigenspace)?;

        let coefficients = layout.coefficients.of(bytes);
        let candidates = header.survey.count();
        let records: &[Record] = cast(layout.records.of(bytes), Part::Records)?;
        let mut in_order = records
            .iter()
            .zip(1..)
            .map(|(record, view)| record.view == view);
        let landmarks = LandmarkTable {
            metric: header.metric,
            dimensions: header.dimensions,
            step: header.step,
            width: header.width,
            row_len: row_len(header.dimensions, header.width),
            is_whole: header.landmarks == candidates && in_order.all(|is_next| is_next),
            coefficients: cast(coefficients, Part::Coefficients)?,
            squared_norms: cast(layout.squared_norms.of(bytes), Part::Records)?,
            records,
        };
        check_landmarks(&landmarks, candidates)?;

        let thumbnails = layout.thumbnails.of(bytes);
        let topology = TopologicalMap::new(
            cast(layout.places.of(bytes), Part::Places)?,
            cast(layout.legs.of(bytes), Part::Legs)?,
            header.map_px,
        )?;
        Ok(Self {
            header,
            total_len,
            crc,
            eigenspace,
            landmarks,
            thumbnails,
            topology,
        })
    }
}

/// What the first bytes of an atlas say: [`HEAD_LEN`](super::HEAD_LEN) of them, or all of a shorter one.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// The header.
    pub header: Header,
    /// Bytes of the atlas.
    pub total_len: u32,
    /// Its CRC-32: what it should be.
    pub crc: u32,
}

impl Head {
    /// Reads the first bytes of an atlas of which the rest is not at hand.
    ///
    /// # Errors
    /// The first check that failed. Those of what follows the header, and of the CRC, are not made.
    pub fn read(bytes: &[u8]) -> Result<Self, AtlasError> {
        let preamble = Preamble::read(bytes)?;
        let header = decode_header(bytes, preamble.header_len)?;
        check_header(&header)?;
        let (expected, found) = (
            Layout::of(&header, usize::from(preamble.header_len)).total_len,
            preamble.total_len,
        );
        if expected != u64::from(found) {
            return Err(AtlasError::Length { expected, found });
        }
        Ok(Self {
            header,
            total_len: found,
            crc: preamble.crc,
        })
    }
}

struct Preamble {
    header_len: u16,
    total_len: u32,
    crc: u32,
}

impl Preamble {
    fn read(bytes: &[u8]) -> Result<Self, AtlasError> {
        let Some((
            &[
                m0,
                m1,
                m2,
                m3,
                v0,
                v1,
                h0,
                h1,
                t0,
                t1,
                t2,
                t3,
                c0,
                c1,
                c2,
                c3,
            ],
            _,
        )) = bytes.split_first_chunk::<PREAMBLE_LEN>()
        else {
            return Err(truncated(bytes, PREAMBLE_LEN as u32));
        };
        let magic = [m0, m1, m2, m3];
        if magic != MAGIC {
            return Err(AtlasError::Magic { found: magic });
        }
        let version = u16::from_le_bytes([v0, v1]);
        if version != VERSION {
            return Err(AtlasError::Version { found: version });
        }
        Ok(Self {
            header_len: u16::from_le_bytes([h0, h1]),
            total_len: u32::from_le_bytes([t0, t1, t2, t3]),
            crc: u32::from_le_bytes([c0, c1, c2, c3]),
        })
    }
}

fn truncated(bytes: &[u8], needed: u32) -> AtlasError {
    AtlasError::Truncated {
        needed,
        have: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
    }
}

/// Checks the preamble and the CRC; gives the atlas without what follows it, the header's length and the CRC.
fn check_preamble(bytes: &[u8]) -> Result<(&[u8], u16, u32), AtlasError> {
    let Preamble {
        header_len,
        total_len,
        crc,
    } = Preamble::read(bytes)?;
    let Some(bytes) = bytes.get(..total_len as usize) else {
        return Err(truncated(bytes, total_len));
    };
    if bytes.len() < PREAMBLE_LEN {
        return Err(AtlasError::Length {
            expected: PREAMBLE_LEN as u64,
            found: total_len,
        });
    }
    let (stored, computed) = (crc, checksum(bytes));
    if stored != computed {
        return Err(AtlasError::Crc { stored, computed });
    }
    Ok((bytes, header_len, stored))
}

fn decode_header(bytes: &[u8], len: u16) -> Result<Header, AtlasError> {
    let error = AtlasError::Header { len };
    if usize::from(len) > MAX_HEADER_LEN {
        return Err(error);
    }
    let encoded = bytes
        .get(PREAMBLE_LEN..PREAMBLE_LEN + usize::from(len))
        .ok_or(error)?;
    let (header, rest) = postcard::take_from_bytes(encoded).map_err(|_| error)?;
    if !rest.is_empty() || !is_shortest(encoded, &header) {
        return Err(error);
    }
    Ok(header)
}

/// Whether a header is encoded as [`emit`](super::emit()) does it: the same number can also be written with more bytes,
/// and in no other way.
fn is_shortest(encoded: &[u8], header: &Header) -> bool {
    postcard::serialize_with_flavor(header, Size::default()) == Ok(encoded.len())
}

fn check_header(header: &Header) -> Result<(), AtlasError> {
    range(
        Part::ViewSide,
        header.view_side.into(),
        MIN_VIEW_SIDE.into(),
        MAX_VIEW_SIDE.into(),
    )?;
    let pixels = u32::from(header.view_side) * u32::from(header.view_side);
    range(
        Part::Dimensions,
        header.dimensions.into(),
        1,
        pixels.min(MAX_DIMENSIONS.into()),
    )?;
    range(Part::Landmarks, header.landmarks, 1, u32::MAX)?;
    range(Part::Map, header.map_px.0, 1, MAX_MAP_SIDE_PX)?;
    range(Part::Map, header.map_px.1, 1, MAX_MAP_SIDE_PX)?;
    check_survey(&header.survey, header.map_px)?;
    range(Part::Places, header.places, 0, MAX_PLACES)?;
    range(Part::Legs, header.legs, 0, MAX_LEGS)?;
    check_numbers(Part::Footprint, &[header.footprint_px], &Sign::Positive)?;
    check_numbers(Part::Step, &[header.step], &Sign::Positive)?;
    check_numbers(Part::Error, &[header.error], &Sign::NotNegative)?;
    check_numbers(
        Part::Limits,
        &[header.limits.distance, header.limits.from_feature_space],
        &Sign::NotNegative,
    )?;
    check_numbers(Part::MeanRow, &[header.mean.scale], &Sign::Positive)?;
    check_numbers(
        Part::MeanRow,
        &[header.mean.base, header.mean.energy],
        &Sign::NotNegative,
    )?;
    let likelihood = header.likelihood;
    check_numbers(
        Part::Likelihood,
        &[likelihood.sharpness, likelihood.ceiling],
        &Sign::Positive,
    )?;
    let training = header.training;
    let settings = [
        training.scale,
        training.highpass,
        training.whiten,
        training.covered_variance,
    ];
    check_numbers(Part::Training, &settings, &Sign::NotNegative)
}

fn check_survey(survey: &Survey, (width_px, height_px): (u32, u32)) -> Result<(), AtlasError> {
    range(Part::Lattices, survey.lattices.len() as u32, 1, 2)?;
    for lattice in &survey.lattices {
        range(Part::Lattice, lattice.count(), 1, u32::MAX)?;
        check_numbers(Part::Lattice, &[lattice.stride_px], &Sign::Positive)?;
        let numbers = [lattice.origin.x_px, lattice.origin.y_px];
        check_numbers(Part::Lattice, &numbers, &Sign::NotNegative)?;
        // With the first and the last place, all are on the map.
        let last = lattice.point(u32::from(lattice.columns) - 1, u32::from(lattice.rows) - 1);
        let room = [width_px as f32 - last.x_px, height_px as f32 - last.y_px];
        check_numbers(Part::Lattice, &room, &Sign::NotNegative)?;
    }
    range(
        Part::Headings,
        survey.headings.into(),
        1,
        MAX_HEADINGS.into(),
    )?;
    let altitudes = survey.altitudes.len() as u32;
    range(Part::Altitudes, altitudes, 1, MAX_ALTITUDES as u32)?;
    let mut lowest = MIN_ALTITUDE_RATIO;
    for (&ratio, index) in survey.altitudes.iter().zip(0..) {
        if !(lowest..=MAX_ALTITUDE_RATIO).contains(&ratio) {
            let part = Part::Altitudes;
            return Err(AtlasError::Number { part, index });
        }
        lowest = ratio.next_up();
    }
    Ok(())
}

fn range(part: Part, found: u32, min: u32, max: u32) -> Result<(), AtlasError> {
    if (min..=max).contains(&found) {
        Ok(())
    } else {
        Err(AtlasError::Range {
            part,
            found,
            min,
            max,
        })
    }
}

/// Bytes between blobs are zero, so that the same contents always have the same bytes.
fn check_gaps(bytes: &[u8], layout: &Layout, header_len: usize) -> Result<(), AtlasError> {
    let mut end = PREAMBLE_LEN + header_len;
    for blob in layout.blobs() {
        let range = blob.range();
        let gap = bytes.get(end..range.start).unwrap_or_default();
        if gap.iter().any(|&byte| byte != 0) {
            return Err(AtlasError::Padding { part: Part::Gap });
        }
        end = range.end;
    }
    Ok(())
}

fn check_eigenspace(eigenspace: &Eigenspace<'_>) -> Result<(), AtlasError> {
    let (side, k) = (eigenspace.side, eigenspace.rows.len());
    let pixels = usize::from(side) * usize::from(side);
    for row in eigenspace.rows {
        check_numbers(Part::Rows, &[row.scale, row.spread], &Sign::Positive)?;
        check_numbers(Part::Rows, &[row.offset], &Sign::Any)?;
    }

    let weights = eigenspace.stored_weights();
    let is_balanced = eigenspace.normalize != Normalize::None;
    for row in 0..k {
        let (mut sum, mut magnitude) = (0_i32, 0_u32);
        for pixel in 0..pixels {
            let weight = eigenspace.weight(row, pixel);
            sum += i32::from(weight);
            magnitude += u32::from(weight.unsigned_abs());
        }
        if u64::from(magnitude) * 255 >= 1 << 31 {
            return Err(AtlasError::Weights {
                row: row as u32,
                sum: magnitude,
            });
        }
        if is_balanced && sum != 0 {
            return Err(AtlasError::Unbalanced {
                row: row as u32,
                sum,
            });
        }
    }
    let sum = eigenspace
        .stored_mean_weights()
        .iter()
        .map(|&weight| i32::from(weight))
        .sum();
    if is_balanced && sum != 0 {
        return Err(AtlasError::Unbalanced { row: k as u32, sum });
    }

    let surplus = eigenspace.stored_mean_weights().iter().skip(pixels);
    if surplus.into_iter().any(|&weight| weight != 0) {
        return Err(AtlasError::Padding {
            part: Part::MeanWeights,
        });
    }

    // Rows beyond k and pixels beyond m have weight zero: count what is not, everywhere and where it may be.
    let stored = weights.iter().filter(|&&weight| weight != 0).count();
    let used = (0..k)
        .flat_map(|row| (0..pixels).map(move |pixel| eigenspace.weight(row, pixel)))
        .filter(|&weight| weight != 0)
        .count();
    debug_assert_eq!(weights.len(), weight_count(side, k as u8));
    debug_assert_eq!(weights.len() % (ROWS_PER_BLOCK * padded_pixels(side)), 0);
    if stored != used {
        return Err(AtlasError::Padding {
            part: Part::Weights,
        });
    }
    Ok(())
}

fn check_landmarks(table: &LandmarkTable<'_>, candidates: u32) -> Result<(), AtlasError> {
    let limit = table.width().limit(table.dimensions);
    for ((record, &found), index) in table.records.iter().zip(table.squared_norms).zip(0_u32..) {
        if record.view == 0 || record.view > candidates {
            return Err(AtlasError::View {
                landmark: index,
                found: record.view,
                candidates,
            });
        }
        if !(record.radius.is_finite() && record.radius >= 0.0) {
            return Err(AtlasError::Number {
                part: Part::Records,
                index,
            });
        }
        let is_beyond = |coefficient: &i16| coefficient.unsigned_abs() > limit.unsigned_abs();
        if let Some(found) = table.coefficients(index as usize).find(is_beyond) {
            return Err(AtlasError::Coefficient {
                landmark: index,
                found,
                limit,
            });
        }
        let expected = squared_norm(table.coefficients(index as usize));
        if found != expected {
            return Err(AtlasError::Norm {
                landmark: index,
                found,
                expected,
            });
        }
    }

    // What follows the last coefficient of a row is zero.
    let (k, width) = (usize::from(table.dimensions), table.width);
    let mut rows = table.coefficients.chunks_exact(table.row_len.max(1));
    let rows_are_padded = rows.all(|row| {
        let row: &[i16] = bytemuck::cast_slice(row);
        let surplus = k..row.len() * width.per_number();
        surplus
            .clone()
            .all(|index| width.unpack(row, index) == Some(0))
    });
    if rows_are_padded {
        Ok(())
    } else {
        Err(AtlasError::Padding {
            part: Part::Coefficients,
        })
    }
}

#[inline(never)] // once in flash
fn check_numbers(part: Part, numbers: &[f32], sign: &Sign) -> Result<(), AtlasError> {
    for (&number, index) in numbers.iter().zip(0..) {
        let has_sign = match sign {
            Sign::NotNegative => number >= 0.0,
            Sign::Positive => number > 0.0,
            Sign::Any => true,
        };
        if !number.is_finite() || !has_sign {
            return Err(AtlasError::Number { part, index });
        }
    }
    Ok(())
}

/// A blob as numbers. Blobs are aligned and whole by construction, so this does not fail.
fn cast<T: Pod>(blob: &[u8], part: Part) -> Result<&[T], AtlasError> {
    bytemuck::try_cast_slice(blob).map_err(|_| AtlasError::Number { part, index: 0 })
}
