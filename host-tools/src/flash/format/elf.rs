//! ELF: a program for 32-bit ARM without code, with a loaded segment and a section for each of ours.

use object::{
    Endianness, elf,
    write::elf::{FileHeader, ProgramHeader, SectionHeader, Writer},
};

use super::{super::Segment, FormatError};

/// What segments begin at a multiple of, in the file as in memory.
const ALIGNMENT: u64 = 8;

pub fn encode(segments: &[Segment]) -> Result<Vec<u8>, FormatError> {
    write(segments).map_err(|error| FormatError::Writer {
        format: "ELF",
        reason: error.to_string(),
    })
}

fn write(segments: &[Segment]) -> Result<Vec<u8>, object::write::Error> {
    let (mut file, mut headers) = (Vec::new(), Vec::new());
    let mut writer = Writer::new_single_phase(Endianness::Little, false, &mut file);
    writer.write_file_header(&FileHeader {
        os_abi: elf::ELFOSABI_NONE,
        abi_version: 0,
        e_type: elf::ET_EXEC,
        e_machine: elf::EM_ARM,
        e_entry: 0,
        e_flags: elf::EF_ARM_EABI_VER5,
    })?;
    writer.write_program_headers_placeholder(segments.len() as u32);
    let mut offsets = Vec::new();
    for segment in segments {
        offsets.push(writer.write_align(ALIGNMENT));
        writer.write(&segment.bytes);
    }
    let names: Vec<_> = segments
        .iter()
        .map(|segment| writer.add_section_name(segment.name.as_bytes()))
        .collect();
    writer.write_shstrtab()?;
    writer.write_null_section_header();
    for ((segment, name), &offset) in segments.iter().zip(names).zip(&offsets) {
        writer.write_section_header(&SectionHeader {
            sh_name: writer.section_name_offset(Some(name)),
            sh_type: elf::SHT_PROGBITS,
            sh_flags: elf::SHF_ALLOC,
            sh_addr: segment.address.into(),
            sh_offset: offset,
            sh_size: segment.bytes.len() as u64,
            sh_link: 0,
            sh_info: 0,
            sh_addralign: ALIGNMENT,
            sh_entsize: 0,
        });
    }
    writer.write_shstrtab_section_header();
    let programs: Vec<ProgramHeader> = segments
        .iter()
        .zip(&offsets)
        .map(|(segment, &offset)| ProgramHeader {
            p_type: elf::PT_LOAD,
            p_flags: elf::PF_R,
            p_offset: offset,
            p_vaddr: segment.address.into(),
            p_paddr: segment.address.into(),
            p_filesz: segment.bytes.len() as u64,
            p_memsz: segment.bytes.len() as u64,
            p_align: ALIGNMENT,
        })
        .collect();
    writer.write_headers_to(&mut headers, &programs)?;
    file[..headers.len()].copy_from_slice(&headers);
    Ok(file)
}
