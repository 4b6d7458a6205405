//! `demo`: the whole job on the built-in map.

use std::path::PathBuf;

use clap::Args;

/// Do the whole job on the built-in map: train, evaluate, write an atlas and a report, fly
#[derive(Debug, Args)]
pub struct Cmd {
    /// Where to write the atlas and the report
    #[arg(long, value_name = "DIR", default_value = "target/demo")]
    out: PathBuf,
}

impl Default for Cmd {
    fn default() -> Self {
        Self {
            out: PathBuf::from("target/demo"),
        }
    }
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("{}", self.out.display())
    }
}
