//! Networks from files, and of the built-in city.

use std::{fs, path::PathBuf, sync::LazyLock};

use rand::RngExt;
use tempfile::TempDir;

use eigenmark_core::eigenspace::Normalize;

use super::*;
use crate::{learn::Settings, select::Selection, simulate::seeded, train::train};

/// Width and height of the map, and side of a view on it.
const MAP_PX: (u32, u32) = (1600, 1200);
const FOOTPRINT_PX: f32 = 200.0;

/// A dense table of the built-in city.
static DENSE: LazyLock<AtlasBuffer> = LazyLock::new(|| {
    let settings = Settings {
        selection: Selection::All,
        stride_px: Some(50),
        dimensions: 50,
        normalize: Normalize::Std,
        ..Settings::default()
    };
    let trained = train(&Map::city(), &settings, false, &Progress::Hidden);
    trained.expect("trains").atlas
});

/// A directory with one file.
struct Written(TempDir);

impl Written {
    fn new(text: impl AsRef<[u8]>) -> Self {
        let written = Self(tempfile::tempdir().expect("temporary directory"));
        fs::write(written.path(), text).expect("writable");
        written
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("places.json")
    }

    fn read(&self) -> Result<Network, FileError> {
        read(&self.path(), MAP_PX, FOOTPRINT_PX)
    }
}

/// Places at x = 100, 300, 500, ….
fn json(count: usize, legs: &str) -> String {
    let places: Vec<String> = (0..count)
        .map(|index| {
            format!(
                r#"{{"x_px": {}, "y_px": {}}}"#,
                100 + index % 7 * 200,
                index / 7
            )
        })
        .collect();
    format!(r#"{{"places": [{}]{legs}}}"#, places.join(", "))
}

#[test]
fn legs_are_stored_with_their_places_both_ways() {
    let at = |x_px| Point { x_px, y_px: 0.0 };
    let network = Network {
        places: vec![at(0.0), at(10.0), at(20.0), at(90.0)],
        legs: vec![(0, 1), (1, 2)],
    };
    let (places, legs) = network.stored();
    assert_eq!(legs, [1, 0, 2, 1]);
    let first: Vec<u32> = places.iter().map(|place| place.first_leg).collect();
    assert_eq!(first, [0, 1, 3, 4]);
    assert_eq!(network.islands(), 2);
}

#[test]
fn files_are_read_as_they_are_written() {
    let network = Written::new(json(4, r#", "legs": [[3, 2], [1, 2], [2, 1]]"#)).read();
    let network = network.expect("valid");
    assert_eq!(
        network.places[3],
        Point {
            x_px: 700.0,
            y_px: 0.0
        }
    );
    assert_eq!(
        network.legs,
        [(0, 1), (1, 2)],
        "each once, the smaller place first"
    );
    let charted = network.add_to(&DENSE.atlas()).expect("valid");
    assert_eq!(charted.atlas().topology().stored_legs(), [1, 0, 2, 1]);
    let again = network.add_to(&charted.atlas()).expect("valid");
    assert_eq!(again.bytes(), charted.bytes(), "its own are replaced");

    let joined = Written::new(json(4, "")).read().expect("valid");
    assert_eq!(joined.legs, [(0, 1), (1, 2), (2, 3)], "joined as they lie");
    let none = Written::new(json(4, r#", "legs": []"#))
        .read()
        .expect("valid");
    assert_eq!((none.legs.len(), none.islands()), (0, 4));
    let empty = Written::new(r#"{"places": []}"#).read().expect("valid");
    assert_eq!(empty, Network::default());
}

#[test]
fn every_fault_of_a_file_is_named() {
    let contents = |text: String, expected: &str| {
        let written = Written::new(text);
        let error = written.read().expect_err(expected);
        let FileError::Contents { path, what } = &error else {
            panic!("{error}, not {expected}");
        };
        assert_eq!((path, what.as_str()), (&written.path(), expected));
        assert_eq!(
            error.to_string(),
            format!("{}: {expected}", written.path().display())
        );
    };
    for (place, found) in [
        (r#"{"x_px": -1, "y_px": 5}"#, "(-1, 5)"),
        (r#"{"x_px": 1600.5, "y_px": 5}"#, "(1600.5, 5)"),
        (r#"{"x_px": 5, "y_px": 1201}"#, "(5, 1201)"),
    ] {
        contents(
            format!(r#"{{"places": [{{"x_px": 5, "y_px": 5}}, {place}]}}"#),
            &format!("place 2 at {found} is not on the map of 1600×1200 pixels"),
        );
    }
    let legs =
        |legs: &str, expected: &str| contents(json(2, &format!(r#", "legs": {legs}"#)), expected);
    legs("[[1, 2], [2, 3]]", "leg [2, 3]; places are numbered 1 to 2");
    legs("[[0, 1]]", "leg [0, 1]; places are numbered 1 to 2");
    legs(
        "[[4294967295, 1]]",
        "leg [4294967295, 1]; places are numbered 1 to 2",
    );
    legs("[[2, 2]]", "leg [2, 2] leads to where it starts");
    contents(json(8193, ""), "8193 places; an atlas has room for 8192");
    let all: Vec<[usize; 2]> = (1..=182)
        .flat_map(|a| (a + 1..=182).map(move |b| [a, b]))
        .collect();
    contents(
        json(182, &format!(r#", "legs": {all:?}"#)),
        "16471 legs; an atlas has room for 16384",
    );
    contents(" ".repeat(5 << 20), "more than 4194304 bytes");

    for (text, expected) in [
        ("", "EOF"),
        (r#"{"places": ["#, "EOF"),
        ("[]", "expected"),
        ("{}", "missing field `places`"),
        (r#"{"places": [{"x_px": 1}]}"#, "missing field `y_px`"),
        (r#"{"places": [], "spots": []}"#, "unknown field `spots`"),
        (
            r#"{"places": [{"x_px": 1, "y_px": 1, "z": 1}]}"#,
            "unknown field `z`",
        ),
        (r#"{"places": [{"x_px": 1e39, "y_px": 1}]}"#, "out of range"),
        (r#"{"places": [], "legs": [[1]]}"#, "tuple"),
        (r#"{"places": [], "legs": [[-1, 2]]}"#, "invalid value"),
        (r#"{"places": []} more"#, "trailing"),
    ] {
        let written = Written::new(text);
        let error = written.read().expect_err(text);
        assert!(matches!(error, FileError::Format { .. }), "{text}: {error}");
        let message = error.to_string();
        assert!(message.contains(expected), "{text}: {message}");
        assert!(message.starts_with(&format!("{}: expected", written.path().display())));
    }

    let written = Written::new("");
    for path in [written.0.path().join("absent"), written.0.path().to_owned()] {
        let error = read(&path, MAP_PX, FOOTPRINT_PX).expect_err("no file");
        assert!(matches!(error, FileError::Read { .. }), "{error}");
        assert!(
            error
                .to_string()
                .starts_with(&format!("{}: cannot read", path.display()))
        );
    }
}

#[test]
fn damaged_files_give_an_error_or_a_network_that_is_sound() {
    let whole = json(12, r#", "legs": [[1, 2], [2, 3], [3, 12], [7, 9]]"#).into_bytes();
    let (mut read, mut refused) = (0, 0);
    for seed in 0..300 {
        let mut random = seeded(seed, 0);
        let mut bytes = whole.clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..16) {
                0 => bytes[at] = random.random(),
                1 => drop(bytes.remove(at)),
                2 => bytes.insert(at, b"0123456789,[]-.e"[random.random_range(0..16)]),
                3 => bytes.truncate(at.max(1)),
                // Another number, most of the time.
                _ => {
                    let mut digits = bytes.iter_mut().filter(|byte| byte.is_ascii_digit());
                    if let Some(digit) = digits.nth(at % 60) {
                        *digit = b'0' + random.random_range(0..10);
                    }
                }
            }
        }
        match Written::new(&bytes).read() {
            Ok(network) => {
                network
                    .add_to(&DENSE.atlas())
                    .expect("what is read is sound");
                read += 1;
            }
            Err(error) => {
                assert!(error.to_string().contains("places.json: "), "{error}");
                refused += 1;
            }
        }
    }
    assert!(read > 20 && refused > 20, "{read} {refused}");
}

#[test]
fn places_of_a_dense_table_keep_off_its_border() {
    let network = of_landmarks(&DENSE.atlas());
    // Centers lie 100 to 1500 and 100 to 1100, places half a view apart from a quarter of one inside.
    assert_eq!(network.places.len(), 14 * 10);
    for place in &network.places {
        let is_inside =
            (150.0..=1450.0).contains(&place.x_px) && (150.0..=1050.0).contains(&place.y_px);
        assert!(is_inside, "{place:?}");
    }
    // Of a square grid: neighbours and diagonals.
    assert_eq!(network.legs.len(), 13 * 10 + 14 * 9 + 2 * 13 * 9);
    assert_eq!(network.islands(), 1);
}

#[test]
fn selected_landmarks_are_places_wherever_they_are() {
    let trained = train(&Map::city(), &Settings::default(), false, &Progress::Hidden);
    let buffer = trained.expect("trains").atlas;
    let network = of_landmarks(&buffer.atlas());
    let atlas = buffer.atlas();
    let records = atlas.landmarks().records();
    let landmarks: Vec<Point> = records
        .iter()
        .filter_map(|record| atlas.survey().place(record.view))
        .collect();
    assert!(network.places.iter().all(|place| landmarks.contains(place)));
    assert_eq!(network.places[0], landmarks[0], "the best one first");
    // Whatever is left out is near one that is not.
    for landmark in landmarks {
        let nearest = network
            .places
            .iter()
            .map(|place| place.distance_px(landmark));
        assert!(nearest.fold(f32::MAX, f32::min) < FOOTPRINT_PX / 2.0);
    }
}

#[test]
fn the_city_is_laid_out_by_what_is_recognized() {
    let map = Map::city();
    let network = lay_out(&map, &DENSE.atlas(), &Progress::Hidden);
    let all = of_landmarks(&DENSE.atlas());
    println!(
        "{} of {} landmarks are places, {} legs",
        network.places.len(),
        all.places.len(),
        network.legs.len()
    );
    assert!(
        network
            .places
            .iter()
            .all(|place| all.places.contains(place))
    );
    assert!(network.places.len() > all.places.len() / 2);
    assert_eq!(network.islands(), 1);
    for &(a, b) in &network.legs {
        let [from, to] = [a, b].map(|place| network.places[usize::from(place)]);
        assert!(a < b && from.distance_px(to) <= 4.0 * FOOTPRINT_PX);
    }
    assert_eq!(
        lay_out(&map, &DENSE.atlas(), &Progress::Hidden),
        network,
        "the same every time"
    );
}
