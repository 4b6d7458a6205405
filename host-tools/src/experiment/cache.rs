//! Cells that are kept: a file per cell, whose first line says what it is of and the second what was found.
//!
//! A cell is used again when everything that it depends on is the same: the map's pixels, the settings, dimensions,
//! methods and landmarks, and this program's version. Anything else, damage included, is computed again.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::{Cell, Plan, cell::STEPS};
use crate::{
    evaluate::reliability::Steps,
    learn::{Settings, blur_name},
    map::Map,
    output::{OutputError, write_file},
};

/// Raised when the same settings give other cells than before.
const FORMAT: u32 = 1;

/// The largest file that is read.
const MAX_BYTES: u64 = 1 << 30;

/// What a cell depends on.
#[derive(Debug, Serialize)]
struct Key<'a, S> {
    version: &'static str,
    format: u32,
    map_crc: u32,
    map_size: [u32; 2],
    settings: S,
    dimensions: &'a [usize],
    methods: Vec<&'static str>,
    landmarks: u32,
    fixed: &'a [u32],
    is_clustered: bool,
    steps: Steps,
}

/// The first line of a file.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    /// How to make the file again.
    provenance: String,
    /// The key, as JSON.
    key: String,
    /// CRC-32 of the second line.
    crc: u32,
}

/// The cells of a plan for a map.
pub(super) struct Cache<'a> {
    directory: &'a Path,
    map: &'a Map,
    plan: &'a Plan,
    provenance: &'a str,
}

impl<'a> Cache<'a> {
    pub fn new(directory: &'a Path, map: &'a Map, plan: &'a Plan, provenance: &'a str) -> Self {
        Self {
            directory,
            map,
            plan,
            provenance,
        }
    }

    /// A cell that was kept, if it is still what the plan asks for.
    pub fn cell(&self, settings: &Settings) -> Option<Cell> {
        let cell: Cell = self.read(&name(settings), &self.key(settings))?;
        let n = settings.grid(self.map).ok()?.count() as usize;
        cell.is_sound(self.plan, settings, n).then_some(cell)
    }

    /// Keeps a cell.
    pub fn keep(&self, settings: &Settings, cell: &Cell) -> Result<(), OutputError> {
        self.write(&name(settings), &self.key(settings), cell)
    }

    /// Something that was kept under a name and with a key.
    pub fn read<T: DeserializeOwned>(&self, name: &str, key: &str) -> Option<T> {
        let path = self.path(name);
        if fs::metadata(&path).ok()?.len() > MAX_BYTES {
            return None;
        }
        let text = fs::read_to_string(&path).ok()?;
        let (head, found) = text.split_once('\n')?;
        let head: Head = serde_json::from_str(head).ok()?;
        let found = found.trim_end();
        if head.key != key || head.crc != crc(found.as_bytes()) {
            return None;
        }
        serde_json::from_str(found).ok()
    }

    /// Keeps something under a name and with a key.
    pub fn write(&self, name: &str, key: &str, found: &impl Serialize) -> Result<(), OutputError> {
        let path = self.path(name);
        let line = |value: serde_json::Result<String>| {
            value.map_err(|error| OutputError {
                path: path.clone(),
                source: error.into(),
            })
        };
        let text = line(serde_json::to_string(found))?;
        let head = line(serde_json::to_string(&Head {
            provenance: self.provenance.to_owned(),
            key: key.to_owned(),
            crc: crc(text.as_bytes()),
        }))?;
        write_file(&path, |file| writeln!(file, "{head}\n{text}"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.join(format!("{name}.jsonl"))
    }

    /// What something depends on: the map, the plan, and `settings` of its own.
    pub fn key(&self, settings: impl Serialize) -> String {
        let key = Key {
            version: env!("CARGO_PKG_VERSION"),
            format: FORMAT,
            map_crc: self.map.crc(),
            map_size: [self.map.width(), self.map.height()],
            settings,
            dimensions: &self.plan.dimensions,
            methods: self
                .plan
                .methods
                .iter()
                .map(|method| method.name())
                .collect(),
            landmarks: self.plan.landmarks,
            fixed: &self.plan.fixed,
            is_clustered: self.plan.is_clustered,
            steps: STEPS,
        };
        // Numbers and names always become JSON.
        serde_json::to_string(&key).unwrap_or_default()
    }
}

/// What a cell's file is called.
fn name(settings: &Settings) -> String {
    format!("{}-{}", settings.scale, blur_name(settings.blur))
}

pub(super) fn crc(bytes: &[u8]) -> u32 {
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}
