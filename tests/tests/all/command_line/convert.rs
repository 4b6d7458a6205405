//! `convert`: files of every format, what they say of themselves, and what is refused. What the formats hold is tested
//! beside them.

use std::fs;

use eigenmark_core::slots::{RECORD_LEN, Record};
use eigenmark_tests::cli::run;
use object::{Object, ObjectSection};
use serde_json::{Value, json};

use super::Fixture;

const SLOT_A: u64 = 0x0804_0000;
const SLOT_B: u64 = 0x080a_0000;
const SLOT_LEN: u64 = 384 << 10;

/// What `convert good.atlas --out NAME …` says of itself.
fn convert(fixture: &Fixture, out: &str, more: &[&str]) -> Value {
    let (atlas, out) = (fixture.name("good.atlas"), fixture.name(out));
    let output = run(&[&["convert", &atlas, "--out", &out, "--json"], more].concat());
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("utf-8"));
    assert!(output.status.success(), "{more:?}: {stderr}");
    serde_json::from_str(&stdout).expect("one value")
}

#[test]
fn every_format_is_written_and_says_what_it_is() {
    let fixture = Fixture::new();
    let atlas = fs::read(fixture.path("good.atlas")).expect("written");
    for format in ["bin", "hex", "uf2", "elf"] {
        let name = format!("out.{format}");
        let told = convert(&fixture, &name, &[]);
        let file = fs::read(fixture.path(&name)).expect("written");
        let expected = json!({
            "file": fixture.name(&name), "format": format, "board": "stm32f405", "address": SLOT_A, "bytes": atlas.len(),
            "file_bytes": file.len(), "segments": [{"name": "atlas", "address": SLOT_A, "bytes": atlas.len()}],
            "record": null,
        });
        assert_eq!(told, expected);
        let begins: &[u8] = match format {
            "bin" => &atlas,
            "hex" => b":020000040804EE\n",
            "uf2" => b"UF2\n",
            _ => b"\x7fELF\x01\x01",
        };
        assert!(file.starts_with(begins), "{format}");
    }
    assert_eq!(fs::read(fixture.path("out.bin")).expect("written"), atlas);
}

#[test]
fn addresses_come_from_the_slot_the_board_or_the_user() {
    let fixture = Fixture::new();
    for (more, address) in [
        (&["--slot", "b"][..], SLOT_B),
        (&["--board", "stm32h743"], 0x0810_0000),
        (&["--board", "stm32h743", "--slot", "b"], 0x0818_0000),
        (&["--address", "0x20000010"], 0x2000_0010),
        (&["--address", "134217728"], 0x0800_0000),
    ] {
        let told = convert(&fixture, "out.elf", more);
        assert_eq!(told["address"], json!(address), "{more:?}");
        let file = fs::read(fixture.path("out.elf")).expect("written");
        let elf = object::File::parse(&*file).expect("is ELF");
        let section = elf.section_by_name(".atlas").expect("has the atlas");
        assert_eq!(section.address(), address, "{more:?}");
    }
}

#[test]
fn a_record_says_what_it_was_told() {
    let fixture = Fixture::new();
    let more = "--slot b --record --sequence 9 --meters-per-px 0.25 --field-of-view 47.5";
    let more: Vec<&str> = more.split(' ').collect();
    let told = convert(&fixture, "out.elf", &more);
    let record = json!({"sequence": 9, "meters_per_px": 0.25, "field_of_view_deg": 47.5});
    assert_eq!(told["record"], record);
    let record_at = SLOT_B + SLOT_LEN - RECORD_LEN as u64;
    assert_eq!(
        told["segments"][1],
        json!({"name": "record", "address": record_at, "bytes": RECORD_LEN})
    );
    let file = fs::read(fixture.path("out.elf")).expect("written");
    let elf = object::File::parse(&*file).expect("is ELF");
    let section = elf.section_by_name(".record").expect("has the record");
    let bytes = section
        .data()
        .expect("in the file")
        .try_into()
        .expect("64 bytes");
    let record = Record::decode(bytes).expect("is one");
    let atlas = fs::read(fixture.path("good.atlas")).expect("written");
    assert_eq!((record.sequence, record.len), (9, atlas.len() as u32));
    assert_eq!(record.setup.meters_per_px, 0.25);
    assert_eq!(record.setup.field_of_view_rad, 47.5_f32.to_radians());
}

#[test]
fn what_cannot_be_converted_is_refused_in_one_clear_line() {
    let fixture = Fixture::new();
    let convert =
        |more: &[&str], expected: &str| fixture.refuses(&[&["convert"], more].concat(), expected);
    let with = |more: &[&str], expected: &str| {
        convert(
            &[&["@good.atlas", "--out", "@x.hex"], more].concat(),
            expected,
        );
    };
    convert(
        &["@good.atlas", "--out", "@x.s19"],
        "expected a name that ends in .bin, .hex, .uf2 or .elf, found .s19",
    );
    convert(&["@good.atlas", "--out", "@none/x.hex"], "cannot write");
    convert(&["@cut.atlas", "--out", "@x.hex"], "cut.atlas");
    convert(
        &["@long.atlas", "--out", "@x.hex"],
        "long.atlas: expected an atlas of",
    );
    convert(&["@map.png", "--out", "@x.hex"], "map.png");
    convert(
        &["@absent.atlas", "--out", "@x.hex"],
        "cannot read the atlas",
    );
    convert(
        &["@good.atlas", "--out", "@x.bin", "--record"],
        "a .bin file has no addresses, and so no record",
    );
    with(
        &["--address", "0x08040004"],
        "expected an address that is a multiple of 8, found 0x08040004",
    );
    with(
        &["--address", "0x080ffff8"],
        "there is room for 8 from 0x080ffff8 on in the board's slots",
    );
    with(
        &["--address", "0x108000000"],
        "expected an address of 32 bits",
    );
    with(&["--address", "here"], "expected an address of 32 bits");
    with(
        &["--address", "0x08040008", "--record"],
        "a record needs an atlas at the start of a slot of stm32f405",
    );
    with(
        &["--address", "0x08040000", "--slot", "a"],
        "cannot be used with",
    );
    with(
        &["--board", "uno"],
        "expected a board (stm32f405, stm32h743), found",
    );
    with(&["--slot", "c"], "expected a or b");
    with(&["--sequence", "2"], "--record");
    with(&["--meters-per-px", "2"], "add --record");
    with(
        &["--record", "--meters-per-px", "0"],
        "expected meters per pixel above 0",
    );
    with(
        &["--record", "--field-of-view", "180"],
        "a field of view between 0 and 180°",
    );
}
