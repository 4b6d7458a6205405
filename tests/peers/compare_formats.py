"""Reads what `eigenmark convert` writes with other programs' readers: Intel HEX with intelhex, ELF with pyelftools.

An atlas of the built-in map goes to several addresses of both boards, with and without the record of its slot; every
byte has to come back at its address, and none elsewhere. The record is what `core/src/slots/record.rs` describes.
Prints a table and exits 1 when anything differs.

usage: compare_formats.py EIGENMARK
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

from elftools.elf.elffile import ELFFile
from intelhex import IntelHex

RECORD_LEN = 64

PLACES = [
    [],
    ["--slot", "b"],
    ["--address", "0x0804fff8"],
    ["--address", "0x20000010"],
    ["--board", "stm32h743", "--slot", "b"],
    ["--record", "--sequence", "7", "--meters-per-px", "0.3", "--field-of-view", "66"],
    ["--board", "stm32h743", "--slot", "b", "--record", "--sequence", "4294967295"],
]


def run(*command):
    output = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
    return json.loads(output.stdout)


def read_hex(path):
    """Runs of bytes by their addresses."""
    file = IntelHex(str(path))
    return {start: bytes(file.tobinarray(start=start, size=end - start)) for start, end in file.segments()}


def read_elf(path):
    with open(path, "rb") as stream:
        file = ELFFile(stream)
        machine = (file.elfclass, file.little_endian, file["e_type"], file["e_machine"], file["e_entry"])
        if machine != (32, True, "ET_EXEC", "EM_ARM", 0):
            sys.exit(f"{path}: expected a little-endian executable of 32-bit ARM without an entry, found {machine}")
        loaded = [segment for segment in file.iter_segments() if segment["p_type"] == "PT_LOAD"]
        if any(segment["p_paddr"] != segment["p_vaddr"] or segment["p_flags"] != 4 for segment in loaded):
            sys.exit(f"{path}: expected segments that are only read, where they are loaded")
        named = {section.name: section.data() for section in file.iter_sections() if section["sh_flags"] == 2}
        if list(named.values()) != [segment.data() for segment in loaded]:
            sys.exit(f"{path}: expected a section for every segment, found {list(named)}")
        return {segment["p_paddr"]: segment.data() for segment in loaded}


def record_of(atlas, told):
    """The record as its format's description has it."""
    fields = struct.pack(
        "<8sIIIff32x",
        b"EIGSLOT1",
        told["sequence"],
        len(atlas),
        told["crc"],
        told["meters_per_px"],
        # Degrees become radians in single precision.
        struct.unpack("<f", struct.pack("<f", told["field_of_view_deg"] * 0.017453292519943295))[0],
    )
    return fields + struct.pack("<I", zlib.crc32(fields))


def main():
    eigenmark = sys.argv[1]
    differences = 0
    print(f"{'where':<66}{'format':>7}{'bytes':>8}  found")
    with tempfile.TemporaryDirectory() as directory:
        directory = pathlib.Path(directory)
        path = directory / "city.atlas"
        crc = int(run(eigenmark, "train", "--map", "builtin:city", "--out", path, "--json")["crc"], 16)
        atlas = path.read_bytes()
        for place in PLACES:
            for suffix, read in [("hex", read_hex), ("elf", read_elf)]:
                out = directory / f"out.{suffix}"
                told = run(eigenmark, "convert", path, "--out", out, "--json", *place)
                expected = {told["address"]: atlas}
                if told["record"]:
                    at = told["segments"][1]["address"]
                    expected[at] = record_of(atlas, {**told["record"], "crc": crc})
                    if len(expected[at]) != RECORD_LEN or at % RECORD_LEN:
                        sys.exit("a record is 64 bytes at the end of its slot")
                found = "the same" if read(out) == expected else "OTHER"
                differences += found == "OTHER"
                print(f"{' '.join(place) or '(default)':<66}{suffix:>7}{len(atlas):>8}  {found}")
    if differences:
        sys.exit(f"{differences} files differ")


if __name__ == "__main__":
    main()
