//! Every rejection is provoked, by name; the document's dump is decoded; nothing panics.

use std::{boxed::Box, format, string::String, vec, vec::Vec};

use proptest::prelude::*;

use super::*;
use crate::{
    eigenspace::{MeanRow, Normalize, Row, weight_count, weight_index},
    frame::Frame,
    landmark::{Lattice, Lattices, Metric, Point, Record, Survey, Width},
    localizer::Localizer,
    preprocess::Pose,
    route::{MAX_LEGS, MAX_PLACES, MapError, Place},
};

/// The atlas that `core/docs/atlas-format.md` dumps: 2×2 views, one dimension, two landmarks.
struct Sample {
    header: Header,
    weights: Vec<i16>,
    rows: Vec<Row>,
    mean_weights: Vec<i8>,
    coefficients: Vec<i16>,
    records: Vec<Record>,
    thumbnails: Vec<u8>,
    places: Vec<Place>,
    legs: Vec<u16>,
}

/// Bytes at an 8-aligned address.
struct Aligned(Box<[u64]>, usize);

impl Aligned {
    fn zeros(len: usize) -> Self {
        Self(vec![0; len.div_ceil(8)].into(), len)
    }

    fn copy_of(bytes: &[u8]) -> Self {
        let mut copy = Self::zeros(bytes.len());
        copy.bytes_mut().copy_from_slice(bytes);
        copy
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.0)[..self.1]
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.0)[..self.1]
    }

    /// Makes the CRC right again, so that later checks are reached.
    fn seal(&mut self) {
        let crc = checksum(self.bytes());
        self.bytes_mut()[12..16].copy_from_slice(&crc.to_le_bytes());
    }

    fn error(&self) -> AtlasError {
        Atlas::parse(self.bytes()).expect_err("must be rejected")
    }
}

impl Sample {
    fn new() -> Self {
        let mut lattices = Lattices::new();
        let origin = Point {
            x_px: 100.0,
            y_px: 100.0,
        };
        lattices
            .push(Lattice {
                origin,
                stride_px: 200.0,
                columns: 2,
                rows: 1,
            })
            .expect("room");
        let mut weights = vec![0; 20];
        for (pixel, weight) in [1000, -2000, 3000, -4000].into_iter().enumerate() {
            weights[weight_index(2, 0, pixel)] = weight;
        }
        Self {
            header: Header {
                view_side: 2,
                dimensions: 1,
                landmarks: 2,
                width: Width::I16,
                thumbnail_side: 0,
                normalize: Normalize::None,
                metric: Metric::Nssd,
                step: 0.5,
                error: 1.5,
                limits: Limits {
                    distance: 0.25,
                    from_feature_space: 1024.0,
                },
                mean: MeanRow {
                    base: 128.0,
                    scale: 1.0,
                    energy: 65536.0,
                },
                footprint_px: 200.0,
                map_px: (400, 200),
                survey: Survey::nominal(lattices),
                likelihood: Likelihood {
                    sharpness: 8.0,
                    ceiling: 0.5,
                },
                places: 2,
                legs: 2,
                training: Training {
                    scale: 100.0,
                    blur: Blur::Gauss1,
                    highpass: 0.0,
                    whiten: 0.0,
                    covered_variance: 1.0,
                    map_crc: 0x1234_5678,
                },
            },
            weights,
            rows: vec![Row {
                scale: 0.001,
                offset: -256.0,
                spread: 0.5,
            }],
            mean_weights: vec![1, 2, -3, 0],
            coefficients: vec![300, -200],
            records: vec![
                Record {
                    view: 2,
                    radius: 0.125,
                },
                Record {
                    view: 1,
                    radius: 0.25,
                },
            ],
            thumbnails: Vec::new(),
            places: [100.0, 300.0]
                .into_iter()
                .zip(0..)
                .map(|(x_px, first_leg)| Place {
                    x_px,
                    y_px: 100.0,
                    first_leg,
                })
                .collect(),
            legs: vec![1, 0],
        }
    }

    fn contents(&self) -> Contents<'_> {
        Contents {
            header: &self.header,
            weights: &self.weights,
            rows: &self.rows,
            mean_weights: &self.mean_weights,
            coefficients: &self.coefficients,
            records: &self.records,
            thumbnails: &self.thumbnails,
            places: &self.places,
            legs: &self.legs,
        }
    }

    fn emit(&self) -> Aligned {
        let len = emitted_len(&self.header).expect("header fits") as usize;
        let mut buffer = Aligned::zeros(len);
        emit(&self.contents(), buffer.bytes_mut()).expect("valid");
        buffer
    }

    /// What is wrong with the sample after `change`.
    fn error_after(change: impl FnOnce(&mut Self)) -> AtlasError {
        let mut sample = Self::new();
        change(&mut sample);
        let len = emitted_len(&sample.header).expect("header fits") as usize;
        let mut buffer = Aligned::zeros(len);
        emit(&sample.contents(), buffer.bytes_mut()).expect_err("must be rejected")
    }
}

#[test]
fn what_is_emitted_is_parsed_back() {
    let sample = Sample::new();
    let bytes = sample.emit();
    let atlas = Atlas::parse(bytes.bytes()).expect("valid");
    assert_eq!(*atlas.header(), sample.header);
    assert_eq!(atlas.landmarks().records(), sample.records);
    assert_eq!(atlas.eigenspace().rows(), sample.rows);
    assert!(atlas.landmarks().coefficients(1).eq([-200]));
    assert_eq!(atlas.topology().places(), sample.places);
    assert_eq!(atlas.topology().stored_legs(), sample.legs);
    assert_eq!(atlas.total_len() as usize, bytes.bytes().len());
    assert_eq!(
        [0, 1, 2, 3].map(|pixel| atlas.eigenspace().weight(0, pixel)),
        [1000, -2000, 3000, -4000]
    );
}

#[test]
fn thumbnails_come_back() {
    let mut sample = Sample::new();
    sample.header.thumbnail_side = 2;
    sample.thumbnails = vec![1, 2, 3, 4, 5, 6, 7, 8];
    let bytes = sample.emit();
    let atlas = Atlas::parse(bytes.bytes()).expect("valid");
    assert_eq!(atlas.thumbnail(1), Some(&[5, 6, 7, 8][..]));
    assert_eq!(atlas.thumbnail(2), None);
    let plain = Sample::new().emit();
    assert_eq!(
        Atlas::parse(plain.bytes()).expect("valid").thumbnail(0),
        None
    );
}

#[test]
fn bytes_after_the_end_are_not_looked_at() {
    let mut bytes = Sample::new().emit().bytes().to_vec();
    bytes.extend([0xff; 64]);
    assert!(Atlas::parse(Aligned::copy_of(&bytes).bytes()).is_ok());
}

#[test]
fn every_truncation_is_reported() {
    let whole = Sample::new().emit();
    let len = whole.bytes().len();
    for have in 0..len {
        let needed = if have < PREAMBLE_LEN {
            PREAMBLE_LEN
        } else {
            len
        } as u32;
        let error = Atlas::parse(&whole.bytes()[..have]).expect_err("truncated");
        assert_eq!(
            error,
            AtlasError::Truncated {
                needed,
                have: have as u32
            }
        );
    }
}

#[test]
fn every_flipped_bit_is_reported_as_what_it_is() {
    let whole = Sample::new().emit();
    let len = whole.bytes().len();
    for bit in 0..len * 8 {
        let mut flipped = Aligned::copy_of(whole.bytes());
        flipped.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
        let stated = u32::from_le_bytes(flipped.bytes()[8..12].try_into().expect("four bytes"));
        match (bit / 8, flipped.error()) {
            (0..4, AtlasError::Magic { found }) => assert_eq!(found, flipped.bytes()[..4]),
            (4..6, AtlasError::Version { found }) => assert_eq!((found ^ VERSION).count_ones(), 1),
            (8..12, AtlasError::Truncated { needed, have }) => {
                assert!(needed == stated && have as usize == len && stated as usize > len);
            }
            (8..12, AtlasError::Length { found, .. }) => assert!(found == stated && found < 16),
            (6..8 | 8..12 | 12.., AtlasError::Crc { stored, computed }) => {
                assert_ne!(stored, computed);
            }
            (byte, error) => panic!("bit {bit} in byte {byte} gave {error:?}"),
        }
    }
}

#[test]
fn misaligned_bytes_are_refused() {
    let whole = Sample::new().emit();
    let mut shifted = Aligned::zeros(whole.bytes().len() + 1);
    shifted.bytes_mut()[1..].copy_from_slice(whole.bytes());
    assert!(matches!(
        Atlas::parse(&shifted.bytes()[1..]),
        Err(AtlasError::Misaligned { offset: 1 })
    ));
}

#[test]
fn headers_that_do_not_decode_are_reported() {
    let mut bytes = Sample::new().emit();
    bytes.bytes_mut()[6] -= 1; // one byte short
    bytes.seal();
    assert!(matches!(bytes.error(), AtlasError::Header { .. }));
    bytes.bytes_mut()[6..8].copy_from_slice(&u16::MAX.to_le_bytes());
    bytes.seal();
    assert_eq!(bytes.error(), AtlasError::Header { len: u16::MAX });
}

#[test]
fn headers_that_could_be_shorter_are_reported() {
    // The number of landmarks as two bytes: the header is one byte longer, and the gap behind it is another.
    let bytes = Sample::new().emit();
    let mut bytes = bytes.bytes().to_vec();
    let len = u16::from_le_bytes([bytes[6], bytes[7]]);
    assert_eq!(bytes[18], 2);
    let end = PREAMBLE_LEN + usize::from(len);
    let gap = |end: usize| end.next_multiple_of(8) - end;
    bytes.splice(end + 1..end + 1 + gap(end), vec![0; gap(end + 1)]);
    let total_len = bytes.len() as u32;
    bytes[6..8].copy_from_slice(&(len + 1).to_le_bytes());
    bytes[8..12].copy_from_slice(&total_len.to_le_bytes());
    let mut longer = Aligned::copy_of(&bytes);
    longer.seal();
    assert_eq!(longer.error(), AtlasError::Header { len: len + 1 });
}

#[test]
fn sizes_out_of_range_are_reported() {
    let range = |part, found, min, max| AtlasError::Range {
        part,
        found,
        min,
        max,
    };
    assert_eq!(
        Sample::error_after(|s| s.header.map_px.1 = 0),
        range(Part::Map, 0, 1, 1 << 20)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.survey.lattices.clear()),
        range(Part::Lattices, 0, 1, 2)
    );
    assert_eq!(
        Sample::error_after(|s| {
            s.header.places = MAX_PLACES + 1;
            s.places = vec![s.places[0]; s.header.places as usize];
        }),
        range(Part::Places, MAX_PLACES + 1, 0, MAX_PLACES)
    );
    assert_eq!(
        Sample::error_after(|s| {
            s.header.legs = MAX_LEGS + 1;
            s.legs = vec![1; s.header.legs as usize];
        }),
        range(Part::Legs, MAX_LEGS + 1, 0, MAX_LEGS)
    );
    let no_columns = Sample::error_after(|s| s.header.survey.lattices[0].columns = 0);
    assert_eq!(no_columns, range(Part::Lattice, 0, 1, u32::MAX));
    for headings in [0, 73] {
        let error = Sample::error_after(|s| s.header.survey.headings = headings);
        assert_eq!(error, range(Part::Headings, headings.into(), 1, 72));
    }
    let no_altitude = Sample::error_after(|s| s.header.survey.altitudes.clear());
    assert_eq!(no_altitude, range(Part::Altitudes, 0, 1, 4));
    let no_dimensions = Sample::error_after(|s| {
        s.header.dimensions = 0;
        s.weights.clear();
        s.rows.clear();
        s.coefficients.clear();
    });
    assert_eq!(no_dimensions, range(Part::Dimensions, 0, 1, 4));
    // Sizes that change the layout are damaged after the fact.
    for (byte, part, max) in [
        (16, Part::ViewSide, 50),
        (17, Part::Dimensions, 4),
        (18, Part::Landmarks, u32::MAX),
    ] {
        let mut bytes = Sample::new().emit();
        bytes.bytes_mut()[byte] = 0;
        bytes.seal();
        let min = if part == Part::ViewSide { 2 } else { 1 };
        assert_eq!(bytes.error(), range(part, 0, min, max));
    }
}

#[test]
fn a_length_that_the_header_does_not_imply_is_reported() {
    let mut bytes = Sample::new().emit();
    let len = bytes.bytes().len() as u32;
    bytes.bytes_mut()[18] = 3; // landmarks
    bytes.seal();
    let expected = u64::from(len) + 4 + 4 + 8;
    assert!(
        matches!(bytes.error(), AtlasError::Length { expected: e, found } if found == len && e >= expected)
    );
}

#[test]
fn numbers_that_make_no_sense_are_reported() {
    let number = |part, index| AtlasError::Number { part, index };
    assert_eq!(
        Sample::error_after(|s| s.header.step = 0.0),
        number(Part::Step, 0)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.error = f32::NAN),
        number(Part::Error, 0)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.footprint_px = f32::NAN),
        number(Part::Footprint, 0)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.limits.from_feature_space = -1.0),
        number(Part::Limits, 1)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.mean.energy = f32::INFINITY),
        number(Part::MeanRow, 1)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.likelihood.ceiling = 0.0),
        number(Part::Likelihood, 1)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.training.scale = f32::NAN),
        number(Part::Training, 0)
    );
    assert_eq!(
        Sample::error_after(|s| s.header.survey.lattices[0].stride_px = -1.0),
        number(Part::Lattice, 0)
    );
    for (altitudes, index) in [
        ([0.24, 1.0], 0),
        ([1.0, 4.5], 1),
        ([1.0, 1.0], 1),
        ([f32::NAN, 1.0], 0),
    ] {
        let altitudes = altitudes.into_iter().collect();
        let error = Sample::error_after(|s| s.header.survey.altitudes = altitudes);
        assert_eq!(error, number(Part::Altitudes, index));
    }
    assert_eq!(
        Sample::error_after(|s| s.rows[0].spread = 0.0),
        number(Part::Rows, 1)
    );
    assert_eq!(
        Sample::error_after(|s| s.rows[0].offset = f32::NAN),
        number(Part::Rows, 0)
    );
    assert_eq!(
        Sample::error_after(|s| s.records[1].radius = -0.5),
        number(Part::Records, 1)
    );
}

#[test]
fn weights_that_do_not_add_up_are_reported() {
    let unbalanced = Sample::error_after(|s| s.header.normalize = Normalize::Mean);
    assert_eq!(unbalanced, AtlasError::Unbalanced { row: 0, sum: -2000 });
    let unbalanced = Sample::error_after(|s| {
        s.header.normalize = Normalize::Std;
        s.weights[weight_index(2, 0, 3)] = -2000;
        s.mean_weights[0] = 2;
    });
    assert_eq!(unbalanced, AtlasError::Unbalanced { row: 1, sum: 1 });
    let mean_padding = Sample::error_after(|s| {
        s.header.view_side = 3;
        s.weights = vec![0; weight_count(3, 1)];
        s.mean_weights = vec![0; 12];
        s.mean_weights[9] = 1;
    });
    assert_eq!(
        mean_padding,
        AtlasError::Padding {
            part: Part::MeanWeights
        }
    );

    let padding = Sample::error_after(|s| s.weights[weight_index(2, 1, 0)] = 1);
    assert_eq!(
        padding,
        AtlasError::Padding {
            part: Part::Weights
        }
    );
}

#[test]
fn weights_that_could_overflow_are_reported() {
    let mut sample = Sample::new();
    sample.header.view_side = 50;
    sample.weights = vec![0; 5 * 2500];
    for pixel in 0..300 {
        sample.weights[weight_index(50, 0, pixel)] = i16::MIN;
    }
    sample.mean_weights = vec![0; 2500];
    let mut buffer = Aligned::zeros(40_000);
    let error = emit(&sample.contents(), buffer.bytes_mut()).expect_err("overflow");
    assert_eq!(
        error,
        AtlasError::Weights {
            row: 0,
            sum: 300 * 32768
        }
    );
}

#[test]
fn landmarks_that_contradict_the_rest_are_reported() {
    let view = Sample::error_after(|s| s.records[1].view = 3);
    assert_eq!(
        view,
        AtlasError::View {
            landmark: 1,
            found: 3,
            candidates: 2
        }
    );
    let large = Sample::error_after(|s| s.coefficients[0] = i16::MIN);
    assert_eq!(
        large,
        AtlasError::Coefficient {
            landmark: 0,
            found: i16::MIN,
            limit: 16_383
        }
    );

    let sample = Sample::new();
    let mut bytes = sample.emit();
    let header_len = usize::from(bytes.bytes()[6]);
    let layout = Layout::of(&sample.header, header_len);
    bytes.bytes_mut()[layout.squared_norms.range()][4] ^= 1;
    bytes.seal();
    assert_eq!(
        bytes.error(),
        AtlasError::Norm {
            landmark: 1,
            found: 40_001,
            expected: 40_000
        }
    );

    let mut bytes = sample.emit();
    bytes.bytes_mut()[layout.coefficients.range()][2] = 1; // k = 1 is stored as 2
    bytes.seal();
    assert_eq!(
        bytes.error(),
        AtlasError::Padding {
            part: Part::Coefficients
        }
    );

    assert_eq!(
        Sample::error_after(|s| s.legs[1] = 1),
        AtlasError::Topology(MapError::Leg { leg: 0, found: 1 })
    );

    let mut bytes = sample.emit();
    bytes.bytes_mut()[layout.mean_weights.range().start - 1] = 1;
    bytes.seal();
    assert_eq!(bytes.error(), AtlasError::Padding { part: Part::Gap });
}

#[test]
fn candidates_are_those_of_every_layer() {
    let mut sample = Sample::new();
    sample.header.survey.headings = 4;
    sample.header.survey.altitudes = [0.9, 1.1].into_iter().collect();
    sample.records[0].view = 2 * 8;
    let bytes = sample.emit();
    let atlas = Atlas::parse(bytes.bytes()).expect("valid");
    assert!(!atlas.landmarks().is_whole());
    let pixels = [128; 32 * 32];
    let frame = Frame::new(&pixels, 32, 32, 32).expect("valid");
    let among = core::iter::once(0..1);
    let pose = Pose::new(1.0, 2.0).expect("in range");
    let mut localizer = Localizer::new(atlas);
    let fix = localizer
        .locate_among(&frame, &pose, among)
        .expect("one landmark");
    assert_eq!((fix.view, fix.place.x_px), (16, 300.0));
    assert_eq!(fix.heading_rad, 270_f32.to_radians());
    assert_eq!(fix.altitude_from(&pose), 2.2);
    let expected = 1.0 + 270_f32.to_radians();
    assert!((fix.heading_from(&pose) - expected).abs() < 1e-6);

    let error = Sample::error_after(|s| {
        s.header.survey.headings = 4;
        s.records[0].view = 9;
    });
    let (landmark, found, candidates) = (0, 9, 8);
    assert_eq!(
        error,
        AtlasError::View {
            landmark,
            found,
            candidates
        }
    );
}

#[test]
fn a_buffer_that_is_too_small_is_reported() {
    let sample = Sample::new();
    let needed = emitted_len(&sample.header).expect("header fits");
    let error = emit(&sample.contents(), Aligned::zeros(64).bytes_mut()).expect_err("no room");
    assert_eq!(error, AtlasError::NoRoom { needed, have: 64 });
}

#[test]
fn errors_read_as_sentences() {
    let truncated = AtlasError::Truncated {
        needed: 16,
        have: 3,
    };
    assert_eq!(
        format!("{truncated}"),
        "the atlas is cut short: 16 bytes needed, 3 found"
    );
    let range = AtlasError::Range {
        part: Part::ViewSide,
        found: 51,
        min: 2,
        max: 50,
    };
    assert_eq!(
        format!("{range}"),
        "pixels per side of a view: expected 2 to 50, found 51"
    );
}

#[test]
fn the_documents_dump_is_the_sample() {
    let document = include_str!("../../docs/atlas-format.md");
    let bytes: Vec<u8> = document
        .lines()
        .filter(|line| {
            line.len() > 10
                && line.is_char_boundary(8)
                && u32::from_str_radix(&line[..8], 16).is_ok()
        })
        .flat_map(|line| {
            line[8..]
                .split('|')
                .next()
                .unwrap_or_default()
                .split_whitespace()
        })
        .map(|byte| u8::from_str_radix(byte, 16).expect("hex"))
        .collect();
    assert_eq!(dump(&bytes), dump(Sample::new().emit().bytes()));
}

/// The dump as the document shows it.
fn dump(bytes: &[u8]) -> String {
    bytes
        .chunks(16)
        .enumerate()
        .map(|(i, line)| {
            let hex: Vec<_> = line.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("{:08x}  {}\n", i * 16, hex.join(" "))
        })
        .collect()
}

proptest! {
    /// Whatever a sealed atlas contains, it is rejected or answers every frame with finite numbers.
    #[test]
    fn sealed_nonsense_never_panics(
        changes in proptest::collection::vec((16_usize..240, any::<u8>()), 1..4), gray in any::<[u8; 4]>(),
    ) {
        let mut bytes = Sample::new().emit();
        let len = bytes.bytes().len();
        for (at, value) in changes {
            bytes.bytes_mut()[at % len] = value;
        }
        bytes.seal();
        if let Ok(atlas) = Atlas::parse(bytes.bytes()) {
            let mut pixels = [gray[0]; 32 * 32];
            pixels[..256].fill(gray[1]);
            pixels[512..900].fill(gray[2]);
            pixels[900..].fill(gray[3]);
            let frame = Frame::new(&pixels, 32, 32, 32).expect("valid");
            if let Some(fix) = Localizer::new(atlas).locate(&frame) {
                let numbers = [fix.distance, fix.second, fix.margin, fix.from_feature_space, fix.heading_rad];
                prop_assert!(numbers.iter().all(|number| number.is_finite()), "{fix:?}");
            }
        }
    }
}
