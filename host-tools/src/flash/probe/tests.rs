use std::fs;

use eigenmark_core::slots::Setup;
use tempfile::TempDir;

use super::{super::BOARDS, *};

/// A script in the place of the program: it notes its arguments, prints what stands in files named after addresses, keeps
/// what is written, and fails where it is told to.
const FAKE: &str = r#"#!/bin/sh
here=$(dirname "$0")
echo "$*" >>"$here/asked"
if [ -e "$here/fail-$1" ]; then
    cat "$here/fail-$1" >&2
    exit 1
fi
case $1 in
read)
    for word; do
        case $word in 0x*) cat "$here/$word" ;; esac
    done ;;
download)
    for word; do file=$word; done
    cp "$file" "$here/written.hex" ;;
esac
"#;

struct Fake(TempDir);

impl Fake {
    fn new() -> Self {
        let fake = Self(tempfile::tempdir().expect("temporary directory"));
        // By another process: a file that this one has open for writing, or one forked from it meanwhile, cannot be run.
        let mut shell = Command::new("sh");
        shell.args(["-c", r#"printf %s "$1" >"$2" && chmod +x "$2""#, "sh", FAKE]);
        assert!(
            shell
                .arg(fake.path("probe-rs"))
                .status()
                .expect("starts")
                .success()
        );
        for slot in [Slot::A, Slot::B] {
            fake.put(slot, &[0xff; RECORD_LEN]);
        }
        fake
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn probe(&self, selector: Option<&str>) -> Probe {
        Probe::by(
            self.path("probe-rs"),
            &BOARDS[0],
            selector.map(str::to_owned),
        )
    }

    fn put(&self, slot: Slot, bytes: &[u8]) {
        let mut text = String::new();
        for (line, bytes) in bytes.chunks(8).enumerate() {
            let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            text += &format!(
                "{:08x}: {}\n",
                BOARDS[0].record_at(slot) as usize + 8 * line,
                bytes.join(" ")
            );
        }
        self.print(slot, &text);
    }

    fn print(&self, slot: Slot, text: &str) {
        let name = format!("{:#010x}", BOARDS[0].record_at(slot));
        fs::write(self.path(&name), text).expect("writable");
    }

    fn asked(&self) -> Vec<String> {
        let asked = fs::read_to_string(self.path("asked")).unwrap_or_default();
        asked.lines().map(str::to_owned).collect()
    }
}

fn record(sequence: u32) -> Record {
    Record {
        sequence,
        len: 1000,
        crc: 0xff00_aa55,
        setup: Setup::default(),
    }
}

#[test]
fn records_are_read_in_both_ways_of_printing() {
    let fake = Fake::new();
    assert_eq!(fake.probe(None).records().expect("reads"), [None, None]);
    fake.put(Slot::A, &record(4).encode());
    let in_one_line: Vec<String> = record(5)
        .encode()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    fake.print(Slot::B, &(in_one_line.join(" ") + "\n"));
    let records = fake.probe(None).records().expect("reads");
    assert_eq!(records, [Some(record(4)), Some(record(5))]);
}

#[test]
fn commands_are_those_that_are_run() {
    let fake = Fake::new();
    let probe = fake.probe(Some("0483:374b:0669 FF"));
    let file = fake.path("some.hex");
    fs::write(&file, ":00000001FF\n").expect("writable");
    probe.records().expect("reads");
    probe.download(&file).expect("writes");
    probe.reset().expect("resets");
    let chip = "--non-interactive --chip STM32F405RGTx --probe 0483:374b:0669 FF";
    let expected = [
        format!("read {chip} b8 0x0809ffc0 64"),
        format!("read {chip} b8 0x080fffc0 64"),
        format!(
            "download {chip} --binary-format hex --verify --disable-progressbars {}",
            file.display()
        ),
        format!("reset {chip}"),
    ];
    assert_eq!(fake.asked(), expected);
    assert_eq!(
        fs::read(fake.path("written.hex")).expect("kept"),
        fs::read(&file).expect("written")
    );

    let program = fake.path("probe-rs");
    let written = expected.map(|line| {
        format!("{} {line}", program.display()).replace("0483:374b:0669 FF", "'0483:374b:0669 FF'")
    });
    assert_eq!(probe.commands(&file), written);
}

#[test]
fn failures_are_told_in_the_programs_words() {
    let fake = Fake::new();
    fs::write(
        fake.path("fail-read"),
        "Error: No connected probes were found.\n",
    )
    .expect("writable");
    fs::write(
        fake.path("fail-download"),
        " Error\n  0: Verification failed\n  at 0x08040010\n",
    )
    .expect("writable");
    fs::write(fake.path("fail-reset"), "").expect("writable");
    let probe = fake.probe(None);
    let ends = |result: Result<(), ProbeError>, expected: &str| {
        let error = result.expect_err(expected).to_string();
        assert!(error.ends_with(expected), "{error}");
    };
    ends(
        probe.records().map(drop),
        "read --non-interactive --chip STM32F405RGTx b8 0x0809ffc0 64 failed: Error: No connected probes were found.",
    );
    ends(
        probe.download(Path::new("x.hex")),
        "x.hex failed: Error 0: Verification failed at 0x08040010",
    );
    ends(probe.reset(), "STM32F405RGTx failed: exit status: 1");
}

#[test]
fn a_missing_program_is_told_with_how_to_install_it() {
    let probe = Probe::by("/nonexistent/probe-rs".into(), &BOARDS[0], None);
    let error = probe.records().expect_err("is missing").to_string();
    assert!(
        error.starts_with("/nonexistent/probe-rs: there is no such program: install it with"),
        "{error}"
    );
}

#[test]
fn what_is_no_record_of_bytes_is_refused() {
    let fake = Fake::new();
    for text in [
        "",
        "00 11",
        "Error: nothing",
        "ffffffff ffffffff",
        &"é ".repeat(64),
        &"+1 ".repeat(64),
    ] {
        fake.print(Slot::A, text);
        let error = fake.probe(None).records().expect_err(text);
        assert!(matches!(error, ProbeError::Unreadable { .. }), "{error}");
    }
}
