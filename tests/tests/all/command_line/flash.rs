//! `flash` through a debug probe, with a program in the place of `probe-rs` that keeps a board's flash in a file. What
//! uploads over a link do is tested beside them.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output},
};

use eigenmark_core::slots::{RECORD_LEN, Record};
use eigenmark_tests::cli::eigenmark;
use serde_json::{Value, json};

use super::Fixture;

const SLOTS: [u32; 2] = [0x0804_0000, 0x080a_0000];
const SLOT_LEN: usize = 384 << 10;

/// Notes what it is asked in `asked`; keeps the region of both slots in `flash`; writes whole sectors, and reads back. A
/// file `fail-COMMAND` makes that command fail in its words; with `worn` there, a bit of flash does not keep what is
/// written.
const FAKE: &str = r#"#!/usr/bin/env python3
import os, sys
here = os.path.dirname(os.path.abspath(__file__))
path = lambda name: os.path.join(here, name)
BASE, LEN, SECTOR = 0x08040000, 768 << 10, 128 << 10
command, words = sys.argv[1], sys.argv[2:]
with open(path("asked"), "a") as asked:
    print(*sys.argv[1:], file=asked)
if os.path.exists(path("fail-" + command)):
    sys.exit(open(path("fail-" + command)).read())
flash = bytearray(b"\xff" * LEN)
if os.path.exists(path("flash")):
    flash[:] = open(path("flash"), "rb").read()
if command == "read":
    assert words[-3] == "b8", words
    start, count = int(words[-2], 16), int(words[-1])
    for at in range(start, start + count, 8):
        print(f"{at:08x}:", *(f"{byte:02x}" for byte in flash[at - BASE:min(at + 8, start + count) - BASE]))
elif command == "download":
    assert words[words.index("--binary-format") + 1] == "hex", words
    page, bytes_at = 0, {}
    for line in open(words[-1]):
        record = bytes.fromhex(line.strip()[1:])
        assert sum(record) % 256 == 0 and len(record) == record[0] + 5, line
        if record[3] == 4:
            page = int.from_bytes(record[4:6], "big") << 16
        elif record[3] == 0:
            start = page + int.from_bytes(record[1:3], "big") - BASE
            bytes_at.update(enumerate(record[4:-1], start))
    for sector in {at // SECTOR for at in bytes_at}:
        flash[sector * SECTOR:(sector + 1) * SECTOR] = b"\xff" * SECTOR
    for at, byte in bytes_at.items():
        flash[at] = byte
    if os.path.exists(path("worn")):
        flash[min(bytes_at)] ^= 1
    open(path("flash"), "wb").write(flash)
    if "--verify" in words and any(flash[at] != byte for at, byte in bytes_at.items()):
        sys.exit("Error: The data in flash does not match\n\nCaused by:\n    contents differ")
"#;

/// An atlas, and a probe with a board.
struct Bench {
    fixture: Fixture,
}

impl Bench {
    /// None where there is no Python.
    fn new() -> Option<Self> {
        if !Command::new("python3")
            .arg("--version")
            .output()
            .is_ok_and(|output| output.status.success())
        {
            eprintln!("skipped: python3 is not installed");
            return None;
        }
        let bench = Self {
            fixture: Fixture::new(),
        };
        fs::create_dir(bench.path("")).expect("writable");
        // By another process: a file that this one has open for writing, or one forked from it meanwhile, cannot be run.
        let mut shell = Command::new("sh");
        shell.args(["-c", r#"printf %s "$1" >"$2" && chmod +x "$2""#, "sh", FAKE]);
        assert!(
            shell
                .arg(bench.path("probe-rs"))
                .status()
                .expect("starts")
                .success()
        );
        Some(bench)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.fixture.path("probe").join(name)
    }

    /// Runs `flash good.atlas …` with the program on the path.
    fn run(&self, more: &[&str]) -> Output {
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(self.path("")).chain(std::env::split_paths(&paths));
        Command::new(eigenmark())
            .args(["flash", &self.fixture.name("good.atlas")])
            .args(more)
            .env("PATH", std::env::join_paths(paths).expect("no separators"))
            .env_remove("EIGENMARK_PROBE_RS")
            .output()
            .expect("starts")
    }

    fn done(&self, more: &[&str]) -> Value {
        let output = self.run(&[&["--json"], more].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{more:?}: {stderr}");
        serde_json::from_slice(&output.stdout).expect("one value")
    }

    fn fails(&self, more: &[&str], expected: &str) {
        let output = self.run(more);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(
            stderr.contains(expected),
            "{more:?}: expected …{expected}…, found {stderr}"
        );
        assert!(output.stdout.is_empty(), "{more:?} printed a result");
    }

    fn asked(&self) -> Vec<String> {
        let asked = fs::read_to_string(self.path("asked")).unwrap_or_default();
        asked.lines().map(str::to_owned).collect()
    }

    /// What is in the slots.
    fn slots(&self) -> [Vec<u8>; 2] {
        let flash = fs::read(self.path("flash")).expect("was written");
        let (a, b) = flash.split_at(SLOT_LEN);
        [a.to_vec(), b.to_vec()]
    }

    fn sequences(&self) -> [Option<u32>; 2] {
        self.slots().map(|slot| {
            Record::decode(slot.last_chunk().expect("long enough")).map(|record| record.sequence)
        })
    }
}

#[test]
fn slots_take_turns_and_the_newest_is_kept() {
    let Some(bench) = Bench::new() else { return };
    let atlas = fs::read(bench.fixture.path("good.atlas")).expect("written");
    for (turn, sequences) in [[Some(1), None], [Some(1), Some(2)], [Some(3), Some(2)]]
        .into_iter()
        .enumerate()
    {
        let before = if turn == 0 {
            [None, None]
        } else {
            bench.sequences()
        };
        let (slot, letter) = (turn % 2, ["a", "b"][turn % 2]);
        let done = bench.done(&["--meters-per-px", "0.1", "--field-of-view", "70"]);
        let expected = json!({
            "atlas": bench.fixture.name("good.atlas"), "board": "stm32f405", "chip": "STM32F405RGTx",
            "slot": letter, "address": SLOTS[slot], "bytes": atlas.len(), "crc": done["crc"],
            "sequence": turn + 1, "sequences_before": before, "meters_per_px": 0.1, "field_of_view_deg": 70.0,
        });
        assert_eq!(done, expected);
        assert_eq!(bench.sequences(), sequences);
        let contents = &bench.slots()[slot];
        assert!(contents.starts_with(&atlas));
        let record = Record::decode(contents.last_chunk().expect("long enough")).expect("has one");
        assert_eq!(record.len as usize, atlas.len());
        assert_eq!(json!(format!("{:08x}", record.crc)), done["crc"]);
        assert_eq!(
            (record.setup.meters_per_px, record.setup.field_of_view_rad),
            (0.1, 70_f32.to_radians())
        );
        let between = &contents[atlas.len()..SLOT_LEN - RECORD_LEN];
        assert!(between.iter().all(|&byte| byte == 0xff));
    }
    let asked = bench.asked();
    let commands: Vec<&str> = asked
        .iter()
        .filter_map(|line| line.split(' ').next())
        .collect();
    assert_eq!(commands, ["read", "read", "download", "reset"].repeat(3));
}

#[test]
fn the_slot_the_board_and_the_probe_can_be_named() {
    let Some(bench) = Bench::new() else { return };
    bench.done(&["--slot", "b", "--probe", "0483:374b"]);
    assert_eq!(bench.sequences(), [None, Some(1)]);
    assert!(
        bench
            .asked()
            .iter()
            .all(|line| line.contains("--chip STM32F405RGTx --probe 0483:374b"))
    );
    bench.done(&["--slot", "b"]);
    assert_eq!(bench.sequences(), [None, Some(2)]);
}

#[test]
fn failures_end_the_command_in_the_programs_words() {
    let Some(bench) = Bench::new() else { return };
    fs::write(
        bench.path("fail-read"),
        "Error: No connected probes were found.\n",
    )
    .expect("writable");
    bench.fails(&[], "read --non-interactive --chip STM32F405RGTx b8 0x0809ffc0 64 failed: Error: No connected probes");
    assert_eq!(bench.asked().len(), 1, "nothing is tried after that");
    fs::remove_file(bench.path("fail-read")).expect("was written");

    fs::write(bench.path("worn"), "").expect("writable");
    bench.fails(
        &[],
        "Error: The data in flash does not match Caused by: contents differ",
    );
    assert!(!bench.asked().iter().any(|line| line.starts_with("reset")));
    fs::remove_file(bench.path("worn")).expect("was written");

    fs::write(bench.path("fail-reset"), "Error: no answer\n").expect("writable");
    bench.fails(
        &["--slot", "a"],
        "slot a is written; start the board by hand",
    );
}

#[test]
fn nothing_is_asked_of_a_board_in_vain() {
    let Some(bench) = Bench::new() else { return };
    bench.fails(
        &["--board", "uno"],
        "expected a board (stm32f405, stm32h743), found",
    );
    bench.fails(&["--slot", "c"], "expected a or b");
    bench.fails(
        &["--meters-per-px", "0"],
        "expected meters per pixel above 0",
    );
    bench.fails(
        &["--field-of-view", "200"],
        "a field of view between 0 and 180°",
    );
    bench.fails(
        &["--link", "tcp:127.0.0.1:1", "--slot", "a"],
        "cannot be used with",
    );
    bench.fails(
        &["--link", "tcp:127.0.0.1:1"],
        "tcp:127.0.0.1:1: cannot open the link",
    );
    bench.fails(&["--restart"], "--link");
    assert!(bench.asked().is_empty());
    bench.fixture.refuses(&["flash", "@cut.atlas"], "cut.atlas");
}

#[test]
fn a_missing_program_is_told_with_how_to_install_it() {
    let fixture = Fixture::new();
    let output = Command::new(eigenmark())
        .args(["flash", &fixture.name("good.atlas")])
        .env("EIGENMARK_PROBE_RS", "/nonexistent/probe-rs")
        .output()
        .expect("starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    let expected = "/nonexistent/probe-rs: there is no such program: install it with `cargo install probe-rs-tools";
    assert!(stderr.contains(expected), "{stderr}");
}

#[test]
fn a_dry_run_prints_what_would_be_run_and_runs_nothing() {
    let Some(bench) = Bench::new() else { return };
    let output = bench.run(&["--dry-run", "--slot", "b", "--board", "stm32h743"]);
    assert!(output.status.success());
    let chip = "--non-interactive --chip STM32H743VITx";
    let expected = format!(
        "probe-rs read {chip} b8 0x0817ffc0 64\nprobe-rs read {chip} b8 0x081fffc0 64\n\
         probe-rs download {chip} --binary-format hex --verify --disable-progressbars atlas.hex\nprobe-rs reset {chip}\n"
    );
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    assert!(bench.asked().is_empty());
    let rehearsed = bench.done(&["--dry-run"]);
    assert_eq!(
        (&rehearsed["slot"], &rehearsed["sequence"]),
        (&json!("a"), &json!(1))
    );
}
