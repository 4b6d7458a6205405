//! Bytes → atlas → a fix, and back to the same bytes.

use std::f32::consts::TAU;

use eigenmark_core::{
    atlas::{Atlas, Contents, Header, PREAMBLE_LEN, checksum, emit, emitted_len},
    eigenspace::{Normalize, Row, padded_pixels, weight_count, weight_index},
    frame::Frame,
    landmark::Record,
    localizer::{Fix, Localizer},
    preprocess::View,
    route::{MAX_PLACES, Place},
};

use super::input::Input;

/// The largest atlas that is made of a described one: larger ones take long and show nothing new.
const MAX_LEN: u64 = 16 << 10;

/// Parses the input in one of three readings, by its first byte: as it is; with its lengths and its CRC made right; as a
/// header and what to fill an atlas of it with. What parses locates a frame, and is emitted again to the same bytes.
///
/// # Panics
/// When a promise is broken.
pub fn atlas(input: &[u8]) {
    let words = words_of(input).unwrap_or_default();
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    if let Ok(atlas) = Atlas::parse(bytes) {
        locate(&atlas);
        emit_again(&atlas, bytes);
    }
}

/// Whether the target reads an atlas in the input: seeds are worth little that do not come as far.
#[must_use]
pub fn holds_atlas(input: &[u8]) -> bool {
    words_of(input).is_some_and(|words| Atlas::parse(bytemuck::cast_slice(&words)).is_ok())
}

/// The bytes that the input stands for; `None` when it describes no atlas.
fn words_of(input: &[u8]) -> Option<Vec<u64>> {
    let mut input = Input(input);
    match input.byte() % 3 {
        0 => Some(aligned(input.0)),
        1 => Some(sealed(input.0)),
        _ => described(input),
    }
}

/// The bytes at an aligned address, and zeros up to a whole word.
fn aligned(bytes: &[u8]) -> Vec<u64> {
    let mut words = vec![0; bytes.len().div_ceil(size_of::<u64>())];
    bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
    words
}

/// The bytes with their own length and CRC.
fn sealed(bytes: &[u8]) -> Vec<u64> {
    let mut words = aligned(bytes);
    let atlas = &mut bytemuck::cast_slice_mut(&mut words)[..bytes.len()];
    if atlas.len() >= PREAMBLE_LEN {
        atlas[8..12].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
        let crc = checksum(atlas);
        atlas[12..16].copy_from_slice(&crc.to_le_bytes());
    }
    words
}

/// An atlas with the header that the bytes begin with, filled with the rest of them so that sums and limits are kept.
fn described(input: Input<'_>) -> Option<Vec<u64>> {
    let (mut header, rest) = postcard::take_from_bytes::<Header>(input.0).ok()?;
    header.places %= MAX_PLACES + 1;
    header.legs = 2 * header.places.saturating_sub(1);
    let mut input = Input(rest);
    let len = emitted_len(&header).ok().filter(|&len| len <= MAX_LEN)?;
    let (side, k, l) = (
        header.view_side,
        usize::from(header.dimensions),
        header.landmarks as usize,
    );
    let shift = input.byte() % 16;
    let fill = input.repeated(input.0.len().next_multiple_of(2).max(2));
    let mut fill = fill.as_chunks::<2>().0.iter().cycle();
    let mut number = || fill.next().map_or(0, |&bytes| i16::from_le_bytes(bytes));

    let mut weights = vec![0; weight_count(side, header.dimensions)];
    let pixels = usize::from(side) * usize::from(side);
    for row in 0..k {
        // What mirrored pixels weigh cancels out.
        for pixel in 0..pixels / 2 {
            let weight = (number() >> shift).max(-i16::MAX);
            weights[weight_index(side, row, pixel)] = weight;
            weights[weight_index(side, row, pixels - 1 - pixel)] = -weight;
        }
    }
    let factor = |number: i16| f32::from(number.unsigned_abs().max(1)) / 256.0;
    let rows: Vec<Row> = (0..k)
        .map(|_| Row {
            scale: factor(number()) / 4096.0,
            offset: factor(number()) - 64.0,
            spread: factor(number()),
        })
        .collect();
    let mut mean_weights: Vec<i8> = (0..padded_pixels(side)).map(|_| number() as i8).collect();
    mean_weights[pixels..].fill(0);
    if header.normalize != Normalize::None {
        let (first, rest) = mean_weights[..pixels].split_at_mut(pixels / 2);
        // The middle of an odd number has no mirror.
        let (middle, second) = rest.split_at_mut(pixels % 2);
        middle.fill(0);
        for (weight, mirrored) in first.iter_mut().zip(second.iter_mut().rev()) {
            *weight = (*weight).max(-i8::MAX);
            *mirrored = -*weight;
        }
    }
    let limit = header.width.limit(header.dimensions);
    let coefficients: Vec<i16> = (0..l * k).map(|_| number() % (limit + 1)).collect();
    let records: Vec<Record> = (0..l)
        .map(|landmark| Record {
            view: landmark as u32 + 1,
            radius: factor(number()),
        })
        .collect();
    let side = usize::from(header.thumbnail_side);
    let thumbnails: Vec<u8> = (0..l * side * side).map(|_| number() as u8).collect();
    // Places in a row, and legs from each to the next and back.
    let width = header.map_px.0 as f32;
    let places: Vec<Place> = (0..header.places)
        .map(|place| Place {
            x_px: width * place as f32 / header.places as f32,
            y_px: 0.0,
            first_leg: (2 * place).saturating_sub(1),
        })
        .collect();
    let legs: Vec<u16> = (1..header.places as u16)
        .flat_map(|place| [place, place - 1])
        .collect();

    let contents = Contents {
        header: &header,
        weights: &weights,
        rows: &rows,
        mean_weights: &mean_weights,
        coefficients: &coefficients,
        records: &records,
        thumbnails: &thumbnails,
        places: &places,
        legs: &legs,
    };
    let mut words = vec![0; (len as usize).div_ceil(size_of::<u64>())];
    emit(&contents, bytemuck::cast_slice_mut(&mut words)).ok()?;
    Some(words)
}

/// A frame and a view have a fix whose numbers are as it says.
fn locate(atlas: &Atlas<'_>) {
    let pixels: [u8; 36 * 33] = core::array::from_fn(|i| (i * i / 7 + i) as u8);
    let frame = Frame::new(&pixels, 36, 33, 36).expect("a frame");
    let mut localizer = Localizer::new(atlas.clone());
    let fixes = [
        localizer.locate(&frame),
        localizer.locate_view(&View::black(atlas.eigenspace().side())),
    ];
    for fix in fixes.into_iter().flatten() {
        let Fix {
            place,
            position,
            heading_rad,
            altitude_ratio,
            distance,
            second,
            margin,
            from_feature_space,
            ..
        } = fix;
        let numbers = [
            place.x_px,
            place.y_px,
            position.x_px,
            position.y_px,
            heading_rad,
            altitude_ratio,
            distance,
            second,
            margin,
            from_feature_space,
        ];
        assert!(numbers.iter().all(|number| number.is_finite()), "{fix:?}");
        assert!(
            distance >= 0.0 && second >= distance && margin >= 1.0 && from_feature_space >= 0.0,
            "{fix:?}"
        );
        assert!((0.0..TAU).contains(&heading_rad), "{fix:?}");
        assert_eq!(
            atlas.survey().altitude_ratio(fix.view),
            Some(altitude_ratio)
        );
        let record = atlas.landmarks().records()[fix.landmark as usize];
        assert_eq!(record.view, fix.view);
    }
}

fn emit_again(atlas: &Atlas<'_>, bytes: &[u8]) {
    let (eigenspace, landmarks) = (atlas.eigenspace(), atlas.landmarks());
    let coefficients: Vec<i16> = (0..landmarks.len())
        .flat_map(|landmark| landmarks.coefficients(landmark))
        .collect();
    let contents = Contents {
        header: atlas.header(),
        weights: eigenspace.stored_weights(),
        rows: eigenspace.rows(),
        mean_weights: eigenspace.stored_mean_weights(),
        coefficients: &coefficients,
        records: landmarks.records(),
        thumbnails: atlas.thumbnails(),
        places: atlas.topology().places(),
        legs: atlas.topology().stored_legs(),
    };
    let mut again = vec![0_u64; bytes.len().div_ceil(size_of::<u64>())];
    let again: &mut [u8] = bytemuck::cast_slice_mut(&mut again);
    let emitted = emit(&contents, again).expect("valid");
    assert_eq!(emitted.total_len(), atlas.total_len());
    let len = atlas.total_len() as usize;
    assert_eq!(again[..len], bytes[..len]);
}
