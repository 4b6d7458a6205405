//! A real atlas, damaged in every way a single fault can damage it.

use eigenmark::{
    atlas::AtlasBuffer, learn::Settings, output::Progress, select::Selection, train::train,
};
use eigenmark_core::atlas::{Atlas, AtlasError, PREAMBLE_LEN};
use eigenmark_tests::maps::TestMap;

/// Budget of the report's table of all views: 83 landmarks, 20×20 pixels, 15 dimensions.
const MAX_ATLAS_BYTES: usize = 16 * 1024;

fn atlas(selection: Selection) -> AtlasBuffer {
    let settings = Settings {
        selection,
        ..Settings::default()
    };
    train(&TestMap::city().open(), &settings, false, &Progress::Hidden)
        .expect("trains")
        .atlas
}

#[test]
fn every_truncation_of_a_real_atlas_is_reported() {
    let whole = atlas(Selection::profile(8));
    for have in 0..whole.bytes().len() {
        let needed = if have < PREAMBLE_LEN {
            PREAMBLE_LEN
        } else {
            whole.bytes().len()
        } as u32;
        let error = Atlas::parse(&whole.bytes()[..have]).expect_err("cut short");
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
fn every_flipped_bit_of_a_real_atlas_is_reported() {
    let whole = atlas(Selection::profile(8));
    let mut words: Vec<u64> = vec![0; whole.bytes().len().div_ceil(8)];
    let len = whole.bytes().len();
    let flipped: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..len];
    flipped.copy_from_slice(whole.bytes());
    for bit in 0..len * 8 {
        flipped[bit / 8] ^= 1 << (bit % 8);
        let error = Atlas::parse(flipped).expect_err("damaged");
        let is_specific = match bit / 8 {
            0..4 => matches!(error, AtlasError::Magic { .. }),
            4..6 => matches!(error, AtlasError::Version { .. }),
            8..12 => {
                matches!(
                    error,
                    AtlasError::Truncated { .. }
                        | AtlasError::Length { .. }
                        | AtlasError::Crc { .. }
                )
            }
            _ => matches!(error, AtlasError::Crc { .. }),
        };
        assert!(is_specific, "bit {bit}: {error:?}");
        flipped[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn the_reports_table_fits_its_budget() {
    let all = atlas(Selection::All);
    assert_eq!(all.atlas().landmarks().len(), 83);
    println!(
        "83 landmarks, 20×20 pixels, 15 dimensions: {} bytes",
        all.bytes().len()
    );
    assert!(all.bytes().len() <= MAX_ATLAS_BYTES);
}

#[test]
fn the_same_map_and_settings_give_the_same_bytes() {
    let selection = Selection::profile(8);
    assert_eq!(atlas(selection.clone()).bytes(), atlas(selection).bytes());
}
