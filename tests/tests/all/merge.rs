//! Training in parts: what several runs fold and one merges is what a single run learns.

use std::fs;

use eigenmark::{
    learn::{Model, Route, Rows, Settings},
    map::Map,
    output::Progress,
    select::{Best, Method, Selection, Start},
    simulate::seeded,
    train::{Part, PartError, Shard, fold_shard, joined, learn},
};
use eigenmark_tests::{cli::run, maps};
use rand::RngExt;

/// Parts that are changed at random, per kind.
const CHANGED: usize = 300;

/// How far sums in another order may be off, relative to the largest number of their kind.
const TOLERANCE: f64 = 1e-10;

fn parts(map: &Map, settings: &Settings, of: u32) -> Vec<Part> {
    let shards = (1..=of).map(|index| Shard::new(index, of).expect("one of them"));
    shards
        .map(|shard| {
            let part = fold_shard(map, settings, shard, &Progress::Hidden).expect("folded");
            Part::parse(&part.emit()).expect("what was written can be read")
        })
        .collect()
}

fn assert_same(merged: &Model, whole: &Model) {
    let same = |name: &str, merged: &[f64], whole: &[f64]| {
        assert_eq!(merged.len(), whole.len(), "{name}");
        let largest = whole
            .iter()
            .fold(0.0_f64, |largest, x| largest.max(x.abs()));
        for (merged, whole) in merged.iter().zip(whole) {
            let difference = (merged - whole).abs();
            assert!(
                difference <= TOLERANCE * largest,
                "{name}: {merged} {whole}"
            );
        }
    };
    same("mean", &merged.mean, &whole.mean);
    same("eigenvalues", &merged.eigenvalues, &whole.eigenvalues);
    same("basis", &merged.basis, &whole.basis);
    let totals = [merged.total_variance, whole.total_variance];
    same("total variance", &totals[..1], &totals[1..]);
}

/// The report's 83 views of 400 pixels, which are kept as they are, and a dense grid, whose products are summed.
#[test]
fn parts_merge_to_what_one_run_learns() {
    for test_map in maps::all() {
        let map = test_map.open();
        for stride_px in [None, Some(20)] {
            let settings = Settings {
                view_size_px: test_map.view_size_px,
                stride_px,
                ..Settings::default()
            };
            let (candidates, whole) =
                learn(&map, &settings, 0, &Progress::Hidden).expect("learned");
            for of in [1, 2, 5] {
                let mut parts = parts(&map, &settings, of);
                parts.reverse();
                let (merged_settings, _, merged) = joined(&map, parts).expect("joined");
                assert_same(&merged, &whole);
                assert_eq!(merged_settings, settings);
            }
            let expected = if stride_px.is_none() {
                Route::Gram
            } else {
                Route::Covariance
            };
            assert_eq!(whole.route, expected, "{} views", candidates.count());
        }
    }
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let map = Map::city();
    let settings = Settings::default();
    let refused = |parts: Vec<Part>| joined(&map, parts).expect_err("refused").to_string();
    let three = parts(&map, &settings, 3);
    assert_eq!(refused(Vec::new()), "part 1 of 1 is missing");
    assert_eq!(
        refused(vec![three[0].clone(), three[2].clone()]),
        "part 2 of 3 is missing"
    );
    assert_eq!(
        refused([&three[..], &three[1..2]].concat()),
        "part 2/3 is given more than once"
    );
    let other = Settings {
        scale: 8.0,
        ..settings.clone()
    };
    let other = parts(&map, &other, 3);
    assert!(
        refused(vec![three[0].clone(), other[1].clone()])
            .starts_with("part 2/3 was made with other settings")
    );
    let mut elsewhere = three.clone();
    elsewhere[1].map_crc ^= 1;
    assert!(refused(elsewhere).starts_with("part 2/3 was made from a map with CRC"));
    let mut swapped = three;
    swapped[0].fold = swapped[1].fold.clone();
    assert!(refused(swapped).starts_with("part 1/3 holds 28 views of 400 pixels, expected 27"));
}

#[test]
fn damaged_parts_are_refused() {
    let part = parts(&Map::city(), &Settings::default(), 8).remove(0);
    let bytes = part.emit();
    assert_eq!(Part::parse(&bytes), Ok(part));
    assert_eq!(Part::parse(b"EIGPART"), Err(PartError::Magic));
    for end in (0..bytes.len()).step_by(97) {
        assert!(Part::parse(&bytes[..end]).is_err(), "cut at {end}");
    }
    for index in (0..bytes.len()).step_by(89) {
        let mut changed = bytes.clone();
        changed[index] ^= 0x10;
        assert!(Part::parse(&changed).is_err(), "changed at {index}");
    }
}

/// Bytes behind a checksum that is right: nothing panics, whatever they say.
#[test]
fn changed_parts_are_refused_or_merge_to_something() {
    let map = Map::city();
    let dense = Settings {
        stride_px: Some(50),
        ..Settings::default()
    };
    let mut random = seeded(4, 4);
    let (mut refused, mut read) = (0, 0);
    for settings in [Settings::default(), dense] {
        let bytes = parts(&map, &settings, 1).remove(0).emit();
        for _ in 0..CHANGED {
            let mut changed = bytes.clone();
            let end = changed.len() - 4;
            for _ in 0..random.random_range(1..4) {
                // The settings and lengths are at the beginning.
                let most = if random.random() { end } else { end.min(100) };
                changed[random.random_range(8..most)] = random.random();
            }
            let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&changed[..end]);
            changed[end..].copy_from_slice(&crc.to_le_bytes());
            match Part::parse(&changed) {
                Err(error) => {
                    assert_eq!(error, PartError::Contents);
                    refused += 1;
                }
                Ok(part) => {
                    let _ = joined(&map, vec![part]);
                    read += 1;
                }
            }
        }
    }
    println!("{refused} refused, {read} read");
    assert!(refused > 0 && read > 0);
}

#[test]
fn parts_that_make_no_sense_are_refused() {
    let part = parts(&Map::city(), &Settings::default(), 8).remove(0);
    let refused = |change: &dyn Fn(&mut Settings)| {
        let mut changed = part.clone();
        change(&mut changed.settings);
        assert_eq!(Part::parse(&changed.emit()), Err(PartError::Contents));
    };
    refused(&|settings| settings.scale = f64::NAN);
    refused(&|settings| settings.dimensions = 0);
    refused(&|settings| settings.stride_px = Some(0));
    refused(&|settings| settings.whiten = 3.0);
    refused(&|settings| settings.selection = Selection::profile(0));
    let method = Method::Ipca {
        start: Start::Profile,
        stop_residual: Some(f64::INFINITY),
    };
    refused(&|settings| settings.selection = Selection::Best(Best::new(8, method.clone())));
}

#[test]
fn the_command_line_trains_in_parts() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let name = |file: &str| {
        directory
            .path()
            .join(file)
            .to_str()
            .expect("utf-8")
            .to_owned()
    };
    let done = |arguments: &[&str]| {
        let output = run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {stderr}");
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    let city = ["--map", "builtin:city", "--json"];
    let [one, two, merged, whole] = ["1", "2", "merged", "whole"].map(name);
    let folded = done(&[&["train"], &city[..], &["--shard", "1/2", "--out", &one]].concat());
    assert_eq!(
        (&folded["shard"], &folded["views"]),
        (&"1/2".into(), &41.into())
    );
    done(&[&["train"], &city[..], &["--shard", "2/2", "--out", &two]].concat());
    let merged_summary = done(&[&["merge"], &city[..], &["--out", &merged, &two, &one]].concat());
    let whole_summary = done(&[&["train"], &city[..], &["--out", &whole]].concat());
    // Few views are kept as they are, so nothing is summed in another order.
    assert_eq!(merged_summary, whole_summary);
    assert_eq!(
        fs::read(&merged).expect("written"),
        fs::read(&whole).expect("written")
    );

    let refused = run(&[
        "merge",
        "--map",
        "builtin:city",
        "--out",
        &name("none"),
        &one,
    ]);
    let stderr = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(stderr, "error: builtin:city: part 2 of 2 is missing\n");
    let refused = run(&[
        "merge",
        "--map",
        "builtin:city",
        "--out",
        &name("none"),
        &whole,
    ]);
    let stderr = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(stderr.contains("whole: no part of a training"), "{stderr}");
    assert!(!directory.path().join("none").exists());
}
