//! `merge`: parts of a training become its atlas.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use eigenmark::{
    map::Map,
    output::{Progress, check_target},
    train::{Part, merge},
};

use super::train::{PlacesArgs, check_export, deliver};

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
    /// Also write views, eigenspace, distances and ranking as NumPy files into this directory
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    #[command(flatten)]
    places: PlacesArgs,
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
            .map(|path| Part::read(path).with_context(|| path.display().to_string()))
            .collect::<anyhow::Result<_>>()?;
        let map = Map::open(&self.map)?;
        let settings = &parts
            .first()
            .context("at least one part is needed")?
            .settings;
        if let Some(directory) = &self.export {
            check_export(&map, settings, directory).with_context(|| self.map.clone())?;
        }
        let places = self.places.read(&map, settings)?;
        let with_profile = self.export.is_some();
        let mut trained = merge(&map, parts, with_profile, &Progress::Stderr)
            .with_context(|| self.map.clone())?;
        places.add_to(&map, &mut trained)?;
        deliver(&trained, &self.out, self.export.as_deref(), self.json)
    }
}
