//! Intel HEX: lines of text, each with its checksum. Addresses have 32 bits (records of type 04).

use ihex::{Record, create_object_file_representation};

use super::{super::Segment, FormatError};

/// Bytes in a line.
const LINE_LEN: usize = 32;

/// Bytes between records that say which 64 KiB the lines are in.
const PAGE_LEN: u32 = 1 << 16;

pub fn encode(segments: &[Segment]) -> Result<String, FormatError> {
    let mut records = Vec::new();
    let mut page = None;
    for segment in segments {
        let (mut address, mut rest) = (segment.address, segment.bytes.as_slice());
        while !rest.is_empty() {
            if page != Some(address / PAGE_LEN) {
                page = Some(address / PAGE_LEN);
                records.push(Record::ExtendedLinearAddress((address / PAGE_LEN) as u16));
            }
            let offset = address % PAGE_LEN;
            let len = rest.len().min(LINE_LEN).min((PAGE_LEN - offset) as usize);
            let (line, after) = rest.split_at(len);
            records.push(Record::Data {
                offset: offset as u16,
                value: line.to_vec(),
            });
            // The last line may end with the address space.
            (address, rest) = (address.wrapping_add(len as u32), after);
        }
    }
    records.push(Record::EndOfFile);
    create_object_file_representation(&records).map_err(|error| FormatError::Writer {
        format: "Intel HEX",
        reason: error.to_string(),
    })
}
