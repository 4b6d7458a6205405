use std::{fs, io::ErrorKind, process::Command};

use eigenmark_core::slots::Setup;
use object::{Object, ObjectSection, ObjectSegment, ObjectSymbol};

use super::{
    super::{BOARDS, Segment, Slot, fixture::ATLAS, record_of},
    *,
};

const FAMILY: u32 = 0x5775_5a57;

/// Addresses with and without what makes them easy: page boundaries of HEX and UF2 within the atlas, starts beside them.
const ADDRESSES: [u32; 5] = [
    0x0804_0000,
    0x080a_0000,
    0x0804_fff8,
    0x0804_0108,
    0x2000_0010,
];

fn placements() -> Vec<Placement> {
    let board = &BOARDS[0];
    let at = |address| Placement::at(address, &ATLAS, board).expect("fits");
    let record = record_of(&ATLAS, 3, &Setup::default()).expect("is valid");
    let with_record = |slot| Placement::with_record(slot, &ATLAS, &record, board).expect("fits");
    let mut placements: Vec<Placement> = ADDRESSES.into_iter().map(at).collect();
    placements.extend([Slot::A, Slot::B].map(with_record));
    // To the last byte of the address space.
    let len = ATLAS.bytes().len().next_multiple_of(8) as u32;
    placements.push(at(len.wrapping_neg()));
    placements
}

/// Memory as a file describes it: runs of bytes at addresses, joined where they meet.
fn join(parts: Vec<(u64, Vec<u8>)>) -> Vec<(u64, Vec<u8>)> {
    let mut runs: Vec<(u64, Vec<u8>)> = Vec::new();
    for (address, bytes) in parts {
        match runs.last_mut() {
            Some((start, run)) if *start + run.len() as u64 == address => run.extend(bytes),
            _ => runs.push((address, bytes)),
        }
    }
    runs
}

fn expected(placement: &Placement) -> Vec<(u64, Vec<u8>)> {
    let of_segment = |segment: &Segment| (u64::from(segment.address), segment.bytes.clone());
    placement.segments().iter().map(of_segment).collect()
}

#[test]
fn formats_are_told_by_the_ending() {
    for (name, format) in [
        ("a.bin", Format::Bin),
        ("a.HEX", Format::Hex),
        ("a.b.uf2", Format::Uf2),
        ("/x/a.elf", Format::Elf),
    ] {
        assert_eq!(Format::of(Path::new(name)), Ok(format));
    }
    for (name, found) in [("atlas", "none"), ("a.txt", ".txt"), (".hex", "none")] {
        let error = Format::of(Path::new(name))
            .expect_err("is unknown")
            .to_string();
        let expected =
            format!("expected a name that ends in .bin, .hex, .uf2 or .elf, found {found}");
        assert_eq!(error, expected);
    }
}

#[test]
fn bin_is_the_atlas_and_has_no_place_for_a_record() {
    for placement in placements() {
        let file = Format::Bin.encode(&placement, FAMILY);
        match placement.segments().len() {
            1 => assert_eq!(file.expect("encodes"), ATLAS.bytes()),
            _ => assert_eq!(file, Err(FormatError::NoAddresses)),
        }
    }
}

#[test]
fn hex_comes_back_through_its_reader() {
    for placement in placements() {
        let file = Format::Hex.encode(&placement, FAMILY).expect("encodes");
        let text = String::from_utf8(file).expect("is text");
        let (mut page, mut parts, mut is_over) = (0, Vec::new(), false);
        for record in ihex::Reader::new(&text) {
            assert!(!is_over, "records after the end");
            match record.expect("is intact") {
                ihex::Record::ExtendedLinearAddress(high) => page = u64::from(high) << 16,
                ihex::Record::Data { offset, value } => {
                    assert!(
                        usize::from(offset) + value.len() <= 1 << 16,
                        "a line wraps around"
                    );
                    parts.push((page + u64::from(offset), value));
                }
                ihex::Record::EndOfFile => is_over = true,
                other => panic!("{other:?}"),
            }
        }
        assert!(is_over);
        assert!(
            text.lines().all(|line| line.len() <= 1 + 2 * (5 + 32)),
            "lines of 32 bytes at most"
        );
        assert_eq!(join(parts), expected(&placement));
    }
}

/// A reader of UF2 that takes blocks as the specification has them: any payload up to 476 bytes, any order.
fn read_uf2(file: &[u8], family: u32) -> Vec<(u64, Vec<u8>)> {
    assert_eq!(file.len() % 512, 0);
    let count = file.len() / 512;
    let mut blocks = vec![None; count];
    for block in file.chunks_exact(512) {
        let word = |at: usize| {
            u32::from_le_bytes([block[at], block[at + 1], block[at + 2], block[at + 3]])
        };
        assert!(
            block.starts_with(b"UF2\nWQ]\x9e"),
            "begins with magic numbers"
        );
        assert_eq!(
            block[508..],
            [0x30, 0x6f, 0xb1, 0x0a],
            "ends with a magic number"
        );
        assert_eq!(word(8), 0x2000, "only the flag of families is set");
        let (address, len, number, of) = (
            word(12),
            word(16) as usize,
            word(20) as usize,
            word(24) as usize,
        );
        assert!(len <= 476);
        assert_eq!((of, word(28)), (count, family));
        let before = blocks[number].replace((u64::from(address), block[32..32 + len].to_vec()));
        assert_eq!(before, None, "numbers are given once");
    }
    join(
        blocks
            .into_iter()
            .map(|block| block.expect("no number is missing"))
            .collect(),
    )
}

#[test]
fn uf2_comes_back_through_a_reader_made_from_the_specification() {
    for placement in placements() {
        let file = Format::Uf2.encode(&placement, FAMILY).expect("encodes");
        let runs = read_uf2(&file, FAMILY);
        let mut filled = 0;
        for (start, run) in &runs {
            assert_eq!((start % 256, run.len() % 256), (0, 0), "whole pages");
            filled += run.iter().filter(|&&byte| byte != 0xff).count();
        }
        let mut wanted = 0;
        for (address, bytes) in expected(&placement) {
            let (start, run) = runs
                .iter()
                .find(|(start, run)| (*start..start + run.len() as u64).contains(&address))
                .expect("is there");
            let at = (address - start) as usize;
            assert_eq!(run[at..at + bytes.len()], bytes);
            wanted += bytes.iter().filter(|&&byte| byte != 0xff).count();
        }
        assert_eq!(filled, wanted, "the rest is as in erased flash");
    }
}

#[test]
fn elf_comes_back_through_its_reader() {
    for placement in placements() {
        let file = Format::Elf.encode(&placement, FAMILY).expect("encodes");
        let elf = object::File::parse(&*file).expect("is ELF");
        assert_eq!(elf.architecture(), object::Architecture::Arm);
        assert_eq!(elf.kind(), object::ObjectKind::Executable);
        assert!(elf.is_little_endian() && !elf.is_64() && elf.entry() == 0);
        assert_eq!(
            elf.symbols()
                .filter(|symbol| !symbol.is_undefined())
                .count(),
            0
        );
        let loaded: Vec<(u64, Vec<u8>)> = elf
            .segments()
            .map(|segment| {
                (
                    segment.address(),
                    segment.data().expect("in the file").to_vec(),
                )
            })
            .collect();
        assert_eq!(loaded, expected(&placement));
        for segment in placement.segments() {
            let section = elf.section_by_name(segment.name).expect("has a section");
            assert_eq!(section.address(), u64::from(segment.address));
            assert_eq!(section.data().expect("in the file"), segment.bytes);
            let object::SectionFlags::Elf { sh_flags, sh_type } = section.flags() else {
                panic!("no ELF section");
            };
            assert_eq!(
                (sh_type, sh_flags),
                (object::elf::SHT_PROGBITS, object::elf::SHF_ALLOC)
            );
        }
    }
}

/// What a program of the binary utilities makes of an ELF file: the bytes as `-O binary` writes them.
fn objcopy(program: &str, more: &[&str], elf: &[u8]) -> Option<Vec<u8>> {
    let directory = tempfile::tempdir().expect("temporary directory");
    let [from, to] = ["from.elf", "to.bin"].map(|name| directory.path().join(name));
    fs::write(&from, elf).expect("writable");
    let ran = Command::new(program)
        .args(more)
        .args(["-O", "binary"])
        .args([&from, &to])
        .output();
    let output = match ran {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            eprintln!("skipped: {program} is not installed");
            return None;
        }
        ran => ran.expect("starts"),
    };
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program}: {told}");
    Some(fs::read(to).expect("written"))
}

#[test]
fn elf_comes_back_through_objcopy() {
    let board = &BOARDS[0];
    let plain = Placement::at(board.start(Slot::A), &ATLAS, board).expect("fits");
    let record = record_of(&ATLAS, 3, &Setup::default()).expect("is valid");
    let whole = Placement::with_record(Slot::A, &ATLAS, &record, board).expect("fits");
    let [plain, whole] =
        [plain, whole].map(|placement| Format::Elf.encode(&placement, FAMILY).expect("encodes"));
    // Binary utilities for the host alone know files of other machines as generic ones.
    for (program, of_machine) in [
        ("objcopy", &["-I", "elf32-little"][..]),
        ("llvm-objcopy", &[]),
        ("arm-none-eabi-objcopy", &[]),
    ] {
        let Some(bytes) = objcopy(program, of_machine, &plain) else {
            continue;
        };
        assert_eq!(bytes, ATLAS.bytes(), "{program}");
        let only_atlas = [of_machine, &["-j", ".atlas"]].concat();
        let bytes = objcopy(program, &only_atlas, &whole).expect("is installed");
        assert_eq!(bytes, ATLAS.bytes(), "{program}");
        let slot = objcopy(program, of_machine, &whole).expect("is installed");
        assert_eq!(slot.len(), board.slot_len as usize, "{program}");
        assert!(
            slot.starts_with(ATLAS.bytes()) && slot.ends_with(&record.encode()),
            "{program}"
        );
    }
}
