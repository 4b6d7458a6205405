//! The maps that tests run on: the built-in city always, the real ones where they are.
//!
//! Real maps lie in the directory that `EIGENMARK_DATA` names, else in `../shared/data` beside the project. Tests say
//! so when they are absent; with `EIGENMARK_REQUIRE_DATA` set, absence fails.

use std::{
    env,
    path::{Path, PathBuf},
};

use eigenmark::map::{BUILTIN_CITY, Map};

/// A map and the view size that gives it a grid of about 8×6.
#[derive(Clone, Debug)]
pub struct TestMap {
    /// Short name, for tables.
    pub name: &'static str,
    /// What to open.
    pub path: String,
    /// Side of a view's footprint, in map pixels.
    pub view_size_px: u32,
}

/// The real maps, by file name and view size.
const REAL: [(&str, &str, u32); 3] = [
    ("wellington", "wellington.jpg", 200),
    ("nust", "nust.png", 140),
    ("kitsap", "kitsap.png", 125),
];

impl TestMap {
    /// The built-in city.
    #[must_use]
    pub fn city() -> Self {
        Self {
            name: "city",
            path: BUILTIN_CITY.to_owned(),
            view_size_px: 200,
        }
    }

    /// Opens it.
    ///
    /// # Panics
    /// When it does not open.
    #[must_use]
    pub fn open(&self) -> Map {
        Map::open(&self.path).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The city and every real map that is there; prints what is absent.
///
/// # Panics
/// When real maps are absent and `EIGENMARK_REQUIRE_DATA` is set.
#[must_use]
pub fn all() -> Vec<TestMap> {
    let aerial = data().join("aerial");
    let mut maps = vec![TestMap::city()];
    for (name, file, view_size_px) in REAL {
        let path = aerial.join(file);
        if path.is_file() {
            maps.push(TestMap {
                name,
                path: path.to_string_lossy().into_owned(),
                view_size_px,
            });
        } else {
            let absent = format!(
                "{} is absent; set EIGENMARK_DATA to the directory of the real maps",
                path.display()
            );
            assert!(env::var_os("EIGENMARK_REQUIRE_DATA").is_none(), "{absent}");
            println!("skipped: {absent}");
        }
    }
    maps
}

/// The top of the workspace.
#[must_use]
pub fn workspace() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest
        .parent()
        .map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

fn data() -> PathBuf {
    // A relative path is meant from the top of the workspace, wherever the test runs.
    let data = env::var_os("EIGENMARK_DATA").unwrap_or_else(|| "../shared/data".into());
    workspace().join(data)
}
