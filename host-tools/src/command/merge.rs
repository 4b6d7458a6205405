//! `merge`: parts of a training become its atlas.

use std::{fs, path::PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use eigenmark::{
    map::Map,
    output::{Progress, check_target},
    train::{MAX_PART_BYTES, Part, merge},
};

use super::train::deliver;

/// Join the parts that `train --shard` wrote to the atlas that one run would write
#[derive(Debug, Args)]
pub struct Cmd {
    /// The parts, in any order; all of them
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// The aerial map they were made from
    #[arg(long, value_name = "FILE")]
    map: String,
    /// Where to write the atlas
    #[arg(long, value_name = "ATLAS")]
    out: PathBuf,
    /// Print what was made as JSON
    #[arg(long)]
    json: bool,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        check_target(&self.out)?;
        let parts: Vec<Part> = self
            .parts
            .iter()
            .map(|path| read(path).with_context(|| path.display().to_string()))
            .collect::<anyhow::Result<_>>()?;
        let map = Map::open(&self.map)?;
        let trained =
            merge(&map, parts, false, &Progress::Stderr).with_context(|| self.map.clone())?;
        deliver(&trained, &self.out, self.json)
    }
}

fn read(path: &PathBuf) -> anyhow::Result<Part> {
    let bytes = fs::metadata(path)?.len();
    ensure!(
        bytes <= MAX_PART_BYTES,
        "{bytes} bytes are too many for a part of a training, which has at most {MAX_PART_BYTES}"
    );
    Ok(Part::parse(&fs::read(path)?)?)
}
