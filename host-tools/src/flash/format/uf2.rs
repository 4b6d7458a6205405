//! UF2: blocks of 512 bytes, each of which is whole in itself and says where its 256 bytes belong.
//!
//! ```text
//! 0  "UF2\n"   4  9e5d5157   8  flags   12  address   16  bytes (256)   20  number   24  numbers in all   28  family
//! 32  bytes, then zeros   508  0ab16f30
//! ```
//! Numbers are little-endian. Bootloaders write whole pages, so every block is one, at a multiple of its length; what
//! no segment fills in it is 0xff, as in erased flash. Specification: <https://github.com/microsoft/uf2>. Its crates that
//! are kept only read.

use std::collections::BTreeMap;

use super::super::Segment;

const BLOCK_LEN: usize = 512;
const PAGE_LEN: usize = 256;
const ERASED: u8 = 0xff;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const END: u32 = 0x0ab1_6f30;

/// The number at byte 28 is the family's.
const HAS_FAMILY: u32 = 0x2000;

pub fn encode(segments: &[Segment], family: u32) -> Vec<u8> {
    let pages = pages(segments);
    let mut file = Vec::with_capacity(pages.len() * BLOCK_LEN);
    for (number, (address, page)) in pages.iter().enumerate() {
        let start = file.len();
        let [first, second] = MAGIC;
        let (number, count) = (number as u32, pages.len() as u32);
        let head = [
            first,
            second,
            HAS_FAMILY,
            *address,
            PAGE_LEN as u32,
            number,
            count,
            family,
        ];
        file.extend(head.iter().flat_map(|word| word.to_le_bytes()));
        file.extend(page);
        file.resize(start + BLOCK_LEN - size_of_val(&END), 0);
        file.extend(END.to_le_bytes());
    }
    file
}

/// The pages that the segments touch, by address.
fn pages(segments: &[Segment]) -> BTreeMap<u32, [u8; PAGE_LEN]> {
    let mut pages = BTreeMap::new();
    for segment in segments {
        let (mut address, mut rest) = (segment.address, segment.bytes.as_slice());
        while !rest.is_empty() {
            let offset = address as usize % PAGE_LEN;
            let (part, after) = rest.split_at(rest.len().min(PAGE_LEN - offset));
            let page = pages
                .entry(address - offset as u32)
                .or_insert([ERASED; PAGE_LEN]);
            page[offset..offset + part.len()].copy_from_slice(part);
            // The last page may end with the address space.
            (address, rest) = (address.wrapping_add(part.len() as u32), after);
        }
    }
    pages
}
