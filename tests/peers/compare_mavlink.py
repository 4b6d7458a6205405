"""Compares what the firmware writes and reads of MAVLink with pymavlink.

A test of the firmware writes the stream of a simulated flight of five minutes, and beside it what every message says:
pymavlink has to read every byte of it without an error, and to find the same numbers. The other way round, pymavlink
writes streams of what an autopilot says, of both versions, signed and not; one is left as it is, in the others bytes
are flipped, lost and inserted. Of every stream the firmware has to read every message that nothing happened to, and no
other one; what pymavlink reads of the same bytes has to be among them, with the same numbers. Prints a table and exits
1 when anything differs.

usage: compare_mavlink.py
"""

import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

os.environ["MAVLINK20"] = "1"

from pymavlink.dialects.v10 import common as mavlink1  # noqa: E402
from pymavlink.dialects.v20 import common as mavlink2  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Streams are exchanged by this test.
TEST = "autopilot::peer::streams_are_exchanged_with_a_peer_that_asks_for_it"
COMMAND = ["cargo", "test", "--quiet", "--package", "eigenmark-firmware", "--lib", TEST]

WANTED = ["HEARTBEAT", "ATTITUDE", "ALTITUDE", "DISTANCE_SENSOR", "GLOBAL_POSITION_INT"]

# Messages in a stream, and of those the share that something happens to.
MESSAGES = 3000
DAMAGED = 0.3

SEEDS = range(1, 9)

# The firmware hands on what is complete: as many bytes as the longest message has.
FLUSH = bytes(280)


def numbers(value):
    """A field as the firmware tells it: a list of numbers."""
    if isinstance(value, bytes):
        return list(value.ljust(50, b"\0"))
    return list(value) if isinstance(value, (list, tuple)) else [value]


def is_same(ours, theirs):
    pairs = zip(ours, theirs)
    return len(ours) == len(theirs) and all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


def differences(ours, theirs):
    """Fields of a message that differ from those of pymavlink's."""
    found = []
    if ours["name"] != theirs.get_type():
        return [f"{ours['name']} instead of {theirs.get_type()}"]
    header = theirs.get_header()
    if ours["header"] != [header.seq, header.srcSystem, header.srcComponent]:
        found.append(f"{ours['name']}: header {ours['header']}")
    for field, value in ours["fields"].items():
        # pymavlink takes texts to be ASCII, MAVLink says UTF-8: bytes are compared.
        expected = numbers(getattr(theirs, f"_{field}_raw", getattr(theirs, field)))
        if not is_same(value, expected):
            found.append(f"{ours['name']}.{field}: {value} instead of {expected}")
    return found


def read_lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def pymavlink_reads(stream, robust):
    parser = mavlink2.MAVLink(None)
    parser.robust_parsing = robust
    messages = parser.parse_buffer(stream) or []
    return messages, parser


def compare_ours(folder):
    """What the firmware wrote: every byte is read, every number is the same."""
    stream = (folder / "ours.bin").read_bytes()
    lines = read_lines(folder / "ours.jsonl")
    # It raises what is wrong.
    messages, parser = pymavlink_reads(stream, robust=False)
    read = sum(len(message.get_msgbuf()) for message in messages)
    wrong = [text for line, message in zip(lines, messages) for text in differences(line, message)]
    if len(lines) != len(messages):
        wrong.append(f"{len(messages)} messages of {len(lines)}")
    if read != len(stream):
        wrong.append(f"{read} bytes of {len(stream)}")
    if parser.total_receive_errors:
        wrong.append(f"{parser.total_receive_errors} errors")
    sequences = [message.get_seq() for message in messages]
    if sequences != [index % 256 for index in range(len(messages))]:
        wrong.append("sequence numbers have gaps")
    kinds = {}
    for message in messages:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
    for kind in ["ODOMETRY", "OPTICAL_FLOW_RAD", "STATUSTEXT", "HEARTBEAT"]:
        if kinds.get(kind, 0) < 10:
            wrong.append(f"{kind}: {kinds.get(kind, 0)} messages")
    print(f"written by the firmware: {len(stream)} bytes, {kinds}")
    return wrong


def any_float(chance):
    return chance.choice([0.0, -0.0, math.nan, math.inf, chance.uniform(-3, 3), chance.uniform(-1e6, 1e6)])


def any_message(mavlink, chance):
    def whole(low, high):
        return chance.randint(low, high)

    floats = [any_float(chance) for _ in range(8)]
    kind = chance.choice(WANTED + ["other"])
    if kind == "HEARTBEAT":
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR,
            mavlink.MAV_AUTOPILOT_PX4,
            whole(0, 255),
            whole(0, 2**32 - 1),
            mavlink.MAV_STATE_ACTIVE,
            3,
        )
    if kind == "ATTITUDE":
        return mavlink.MAVLink_attitude_message(whole(0, 2**32 - 1), *floats[:6])
    if kind == "ALTITUDE":
        return mavlink.MAVLink_altitude_message(whole(0, 2**50), *floats[:6])
    if kind == "DISTANCE_SENSOR":
        values = [whole(0, 65535) for _ in range(3)]
        return mavlink.MAVLink_distance_sensor_message(
            whole(0, 2**32 - 1), *values, 1, whole(0, 255), whole(0, 40), whole(0, 255)
        )
    if kind == "GLOBAL_POSITION_INT":
        places = [whole(-(2**31), 2**31 - 1) for _ in range(4)]
        speeds = [whole(-(2**15), 2**15 - 1) for _ in range(3)]
        return mavlink.MAVLink_global_position_int_message(whole(0, 2**32 - 1), *places, *speeds, whole(0, 65535))
    return chance.choice(
        [
            mavlink.MAVLink_vfr_hud_message(floats[0], floats[1], 7, 9, floats[2], floats[3]),
            mavlink.MAVLink_raw_imu_message(whole(0, 2**50), *[chance.choice([-2, -3, 0xFE]) for _ in range(9)]),
            mavlink.MAVLink_statustext_message(6, bytes(whole(1, 255) for _ in range(50))),
        ]
    )


def damaged(frame, chance):
    place = chance.randrange(len(frame))
    what = chance.choice(["flip", "lose", "insert", "cut", "precede"])
    if what == "flip":
        frame[place] ^= 1 << chance.randrange(8)
    elif what == "lose":
        del frame[place]
    elif what == "insert":
        frame.insert(place, chance.randrange(256))
    elif what == "cut":
        del frame[place:]
    else:
        frame[:0] = bytes(chance.choice([0xFD, 0xFE, 0, 1, chance.randrange(256)]) for _ in range(place))


def stream_of(seed, share):
    """A stream, and the wanted messages in it that nothing happened to."""
    chance = random.Random(seed)
    writers = [(mavlink1, mavlink1.MAVLink(None, 7, 1)), (mavlink2, mavlink2.MAVLink(None, 7, 1))]
    signer = mavlink2.MAVLink(None, 7, 1)
    signer.signing.secret_key = bytes(range(32))
    signer.signing.sign_outgoing = True
    writers.append((mavlink2, signer))
    stream, intact = bytearray(), []
    for index in range(MESSAGES):
        mavlink, writer = chance.choice(writers)
        message = any_message(mavlink, chance)
        writer.seq = index % 256
        frame = bytearray(message.pack(writer))
        whole = bytes(frame)
        # Signatures are not looked at.
        checked = whole[:-13] if writer is signer else whole
        if chance.random() < share:
            damaged(frame, chance)
        if checked in frame and message.get_type() in WANTED:
            intact.append(whole)
        stream += frame
    return bytes(stream + FLUSH), intact


def compare_theirs(name, folder, stream, intact):
    """What the firmware read of a stream: what is intact in it, and nothing else."""
    lines = read_lines(folder / f"{name}.jsonl")
    *lines, counted = lines
    messages, lost, damaged = counted["fields"]["counted"]
    expected = [pymavlink_reads(frame, robust=False)[0][0] for frame in intact]
    wrong = [text for line, message in zip(lines, expected) for text in differences(line, message)]
    if len(lines) != len(expected):
        wrong.append(f"{len(lines)} messages of {len(expected)}")
    read, _ = pymavlink_reads(stream, robust=True)
    read = [message for message in read if message.get_type() in WANTED]
    # In order, each is one of those that the firmware read.
    rest = iter(lines)
    missed = [message for message in read if not any(not differences(line, message) for line in rest)]
    wrong += [f"only pymavlink reads {message}" for message in missed]
    print(
        f"{name}: {len(stream)} bytes, {len(expected)} intact, {len(lines)} read by the firmware, {len(read)} by"
        f" pymavlink; {damaged:.0f} damaged, {lost:.0f} lost"
    )
    # The zeros at the end are one stretch.
    if name == "whole" and [lost, damaged] != [0, 1]:
        wrong.append(f"{lost} lost and {damaged} damaged of a stream that nothing happened to")
    return [f"{name}: {text}" for text in wrong]


def main():
    wrong = []
    streams = {"whole": stream_of(0, 0.0)} | {f"damaged{seed}": stream_of(seed, DAMAGED) for seed in SEEDS}
    with tempfile.TemporaryDirectory() as directory:
        folder = pathlib.Path(directory)
        for name, (stream, _) in streams.items():
            (folder / f"{name}.bin").write_bytes(stream)
        environment = os.environ | {"EIGENMARK_MAVLINK": directory}
        subprocess.run(COMMAND, check=True, cwd=ROOT, env=environment, stdout=sys.stderr)
        wrong += compare_ours(folder)
        for name, (stream, intact) in streams.items():
            wrong += compare_theirs(name, folder, stream, intact)
    for text in wrong[:20]:
        print(text)
    print(f"{len(wrong)} failures")
    sys.exit(len(wrong) > 0)


if __name__ == "__main__":
    main()
