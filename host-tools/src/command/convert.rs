//! `convert`: an atlas in another format, at an address.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::{Context, ensure};
use clap::Args;
use eigenmark::{
    atlas::AtlasBuffer,
    flash::{Board, Format, FormatError, Placement, PlacementError, Slot, record_of},
    output::{check_target, write_file},
};
use eigenmark_core::slots::Record;
use serde_json::json;

use super::{
    board::{SetupArgs, board, numbers, told},
    print_json,
};

/// Write an atlas as .bin, .hex (Intel HEX), .uf2 or .elf, at an address of a board's flash
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(value_name = "ATLAS")]
    atlas: PathBuf,
    /// Where to write it: the ending says in which format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The board: stm32f405 or stm32h743
    #[arg(long, value_name = "NAME", default_value = "stm32f405", value_parser = board)]
    board: &'static Board,
    /// The slot of the board that it is for: a or b [default: a]
    #[arg(long, value_name = "SLOT", conflicts_with = "address")]
    slot: Option<Slot>,
    /// Another address
    #[arg(long, value_name = "0x…", value_parser = address)]
    address: Option<u32>,
    /// Add the slot's record: only with it does a board tell which of two atlases is newer
    #[arg(long)]
    record: bool,
    /// The record's number in the order of writing; the largest is flown by [default: 1]
    #[arg(long, value_name = "N", requires = "record")]
    sequence: Option<u32>,
    #[command(flatten)]
    setup: SetupArgs,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let format = Format::of(&self.out).with_context(|| self.out.display().to_string())?;
        ensure!(
            self.record || !self.setup.is_given(),
            "--meters-per-px and --field-of-view are for the record: add --record"
        );
        if format == Format::Bin && self.record {
            return Err(FormatError::NoAddresses).with_context(|| self.out.display().to_string());
        }
        check_target(&self.out)?;
        let atlas = AtlasBuffer::read(&self.atlas)?;
        let record = self
            .record
            .then(|| record_of(&atlas, self.sequence.unwrap_or(1), &self.setup.setup()))
            .transpose()?;
        let placement = self
            .place(&atlas, record.as_ref())
            .with_context(|| self.atlas.display().to_string())?;
        let file = format.encode(&placement, self.board.uf2_family)?;
        write_file(&self.out, |out| out.write_all(&file))?;
        self.tell(format, &placement, record.as_ref(), file.len())
    }

    fn place(
        &self,
        atlas: &AtlasBuffer,
        record: Option<&Record>,
    ) -> Result<Placement, PlacementError> {
        let board = self.board;
        match (record, self.address, self.slot) {
            (Some(record), Some(address), _) => {
                let slot = board
                    .slot_at(address)
                    .ok_or(PlacementError::NoSlot { board, address })?;
                Placement::with_record(slot, atlas, record, board)
            }
            (Some(record), None, slot) => {
                Placement::with_record(slot.unwrap_or(Slot::A), atlas, record, board)
            }
            (None, Some(address), _) => Placement::at(address, atlas, board),
            (None, None, Some(slot)) => Placement::in_slot(slot, atlas, board),
            (None, None, None) => Placement::at(board.start(Slot::A), atlas, board),
        }
    }

    fn tell(
        &self,
        format: Format,
        placement: &Placement,
        record: Option<&Record>,
        file_bytes: usize,
    ) -> anyhow::Result<()> {
        let mut out = io::stdout().lock();
        let segments = placement.segments();
        if self.json {
            let first = segments.first();
            let list = segments.iter().map(|segment| {
                let name = segment.name.trim_start_matches('.');
                json!({"name": name, "address": segment.address, "bytes": segment.bytes.len()})
            });
            let record = record.map(|record| {
                let (meters_per_px, field_of_view_deg) = numbers(&record.setup);
                json!({
                    "sequence": record.sequence,
                    "meters_per_px": meters_per_px,
                    "field_of_view_deg": field_of_view_deg,
                })
            });
            let written = json!({
                "file": self.out,
                "format": format.name(),
                "board": self.board.name,
                "address": first.map(|segment| segment.address),
                "bytes": first.map(|segment| segment.bytes.len()),
                "file_bytes": file_bytes,
                "segments": list.collect::<Vec<_>>(),
                "record": record,
            });
            return print_json(&mut out, &written);
        }
        writeln!(
            out,
            "{}: {}, {file_bytes} bytes, for {}",
            self.out.display(),
            format.name(),
            self.board.name
        )?;
        for segment in segments {
            let (name, bytes) = (segment.name.trim_start_matches('.'), segment.bytes.len());
            let about = record
                .filter(|_| name == "record")
                .map(|record| format!(": number {}, {}", record.sequence, told(&record.setup)));
            writeln!(
                out,
                "  {name:<7}{bytes:>8} bytes at {:#010x}{}",
                segment.address,
                about.unwrap_or_default()
            )?;
        }
        Ok(())
    }
}

/// An address: hexadecimal after 0x, else decimal.
fn address(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| format!("expected an address of 32 bits such as 0x08040000, found {text:?}"))
}
