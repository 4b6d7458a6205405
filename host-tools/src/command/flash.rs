//! `flash`: an atlas into a slot of a board, through a debug probe or over the board's link.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;
use eigenmark::{
    atlas::AtlasBuffer,
    flash::{Board, Format, Placement, Probe, Slot, Turn, record_of},
    link::{BoardLink, DEFAULT_BAUD, RestartError, restart, upload},
    output::Progress,
};
use eigenmark_core::slots::Setup;
use serde_json::json;

use super::{
    Unmet,
    board::{SetupArgs, board, numbers, told},
    print_json,
};

/// Write an atlas into a slot of a board: through a debug probe by `probe-rs`, or over the board's link
///
/// By default the slot is written that does not hold the newest atlas. The board flies by the new one after its next
/// start.
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(value_name = "ATLAS")]
    atlas: PathBuf,
    /// The slot: a or b [default: the one that does not hold the newest atlas]
    #[arg(long, value_name = "SLOT")]
    slot: Option<Slot>,
    /// The board: stm32f405 or stm32h743
    #[arg(long, value_name = "NAME", default_value = "stm32f405", value_parser = board)]
    board: &'static Board,
    /// The debug probe, if there are several: VENDOR:PRODUCT or VENDOR:PRODUCT:SERIAL
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
    #[command(flatten)]
    setup: SetupArgs,
    /// Print what would be run, for a board without records, and run nothing
    #[arg(long)]
    dry_run: bool,
    /// Upload over the board's link instead: a serial port, or tcp:HOST:PORT. The board chooses the slot
    #[arg(long, value_name = "PORT", conflicts_with_all = ["slot", "board", "probe", "dry_run"])]
    link: Option<String>,
    /// Bits per second of the serial port
    #[arg(long, value_name = "N", default_value_t = DEFAULT_BAUD, requires = "link")]
    baud: u32,
    /// Start the board anew after the upload, and see that it flies by the atlas; boards that fly refuse
    #[arg(long, requires = "link")]
    restart: bool,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let atlas = AtlasBuffer::read(&self.atlas)?;
        let setup = self.setup.setup();
        // What no board takes is refused before it is asked.
        record_of(&atlas, 1, &setup)?;
        match &self.link {
            Some(name) => self.upload(name, &atlas, &setup),
            None => self.download(&atlas, &setup),
        }
    }

    /// Through a debug probe.
    fn download(&self, atlas: &AtlasBuffer, setup: &Setup) -> anyhow::Result<()> {
        let probe = Probe::new(self.board, self.probe.clone());
        if self.dry_run {
            return self.rehearse(&probe, atlas, setup);
        }
        let step = Progress::Stderr.step("reading the slots' records");
        let records = probe.records()?;
        drop(step);
        let turn = Turn::after(&records, self.slot)?;
        let hex = self.hex(atlas, setup, turn)?;
        let file = tempfile::Builder::new().suffix(".hex").tempfile()?;
        file.as_file().write_all(&hex)?;
        let step = Progress::Stderr.step("writing and reading back");
        probe.download(file.path())?;
        drop(step);
        let started = probe.reset();
        started
            .with_context(|| format!("slot {} is written; start the board by hand", turn.slot))?;

        let (address, bytes) = (self.board.start(turn.slot), atlas.bytes().len());
        let mut out = io::stdout().lock();
        if self.json {
            let (meters_per_px, field_of_view_deg) = numbers(setup);
            let done = json!({
                "atlas": self.atlas,
                "board": self.board.name,
                "chip": self.board.chip,
                "slot": turn.slot.to_string(),
                "address": address,
                "bytes": bytes,
                "crc": format!("{:08x}", atlas.atlas().crc()),
                "sequence": turn.sequence,
                "sequences_before": records.map(|record| record.map(|record| record.sequence)),
                "meters_per_px": meters_per_px,
                "field_of_view_deg": field_of_view_deg,
            });
            return print_json(&mut out, &done);
        }
        writeln!(
            out,
            "slot {} of {}: {bytes} bytes at {address:#010x}, number {}; {}",
            turn.slot,
            self.board.name,
            turn.sequence,
            told(setup)
        )?;
        Ok(())
    }

    /// Prints what would be run.
    fn rehearse(&self, probe: &Probe, atlas: &AtlasBuffer, setup: &Setup) -> anyhow::Result<()> {
        let turn = Turn::after(&[None, None], self.slot)?;
        self.hex(atlas, setup, turn)?;
        let commands = probe.commands(Path::new("atlas.hex"));
        let mut out = io::stdout().lock();
        if self.json {
            let rehearsed = json!({
                "dry_run": true,
                "slot": turn.slot.to_string(),
                "sequence": turn.sequence,
                "commands": commands,
            });
            return print_json(&mut out, &rehearsed);
        }
        for command in commands {
            writeln!(out, "{command}")?;
        }
        Ok(())
    }

    /// The atlas and its record as Intel HEX.
    fn hex(&self, atlas: &AtlasBuffer, setup: &Setup, turn: Turn) -> anyhow::Result<Vec<u8>> {
        let record = record_of(atlas, turn.sequence, setup)?;
        let placement = Placement::with_record(turn.slot, atlas, &record, self.board)
            .with_context(|| self.atlas.display().to_string())?;
        Ok(Format::Hex.encode(&placement, self.board.uf2_family)?)
    }

    /// Over the board's link.
    fn upload(&self, name: &str, atlas: &AtlasBuffer, setup: &Setup) -> anyhow::Result<()> {
        let mut link = BoardLink::open(name, self.baud)?;
        let uploaded = upload(&mut link, atlas, setup, &Progress::Stderr)?;
        if self.restart {
            restart(&mut link, atlas.atlas().crc()).map_err(|error| match error {
                RestartError::Other { .. } => Unmet(error.to_string()).into(),
                error => anyhow::Error::new(error).context("the atlas is uploaded"),
            })?;
        }
        let slot = if uploaded.slot == 0 { Slot::A } else { Slot::B };
        let bytes = atlas.bytes().len();
        let mut out = io::stdout().lock();
        if self.json {
            let (meters_per_px, field_of_view_deg) = numbers(setup);
            let done = json!({
                "atlas": self.atlas,
                "link": name,
                "slot": slot.to_string(),
                "bytes": bytes,
                "crc": format!("{:08x}", atlas.atlas().crc()),
                "sequence": uploaded.sequence,
                "resumed_at": uploaded.resumed_at,
                "repeated": uploaded.repeated,
                "damaged": link.damaged(),
                "meters_per_px": meters_per_px,
                "field_of_view_deg": field_of_view_deg,
                "restarted": self.restart,
            });
            return print_json(&mut out, &done);
        }
        let flown = if self.restart {
            "is flown by"
        } else {
            "is flown by after the next start"
        };
        writeln!(
            out,
            "slot {slot} of {name}: {bytes} bytes, number {}; {}; {flown}",
            uploaded.sequence,
            told(setup)
        )?;
        Ok(())
    }
}
