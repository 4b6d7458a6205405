"""An autopilot for a board under test: pymavlink on the board's wire.

It listens for the emulated board's wire on a port of its own, which it prints first, as JSON. Every line of its input is
JSON: what its instruments read. It tells the board that, as MAVLink 2, with some of it damaged on the way if that is
asked for. Everything that the board says is parsed: at the end of its input it prints, as JSON, how many messages of each
kind came, how many bytes were none of any, how many messages sequence numbers say are missing, and the texts.

usage: autopilot.py SHARE   (of its messages that are damaged, 0 to 1)
"""

import collections
import json
import os
import random
import selectors
import socket
import sys
import time

os.environ["MAVLINK20"] = "1"

from pymavlink.dialects.v20 import common as mavlink  # noqa: E402

# How long the board may take to say the last of it after the end of the input, in seconds.
LAST_S = 1.0


class Heard:
    """What the board has said."""

    def __init__(self):
        self.parser = mavlink.MAVLink(None)
        self.parser.robust_parsing = True
        self.messages = collections.Counter()
        self.texts = []
        self.errors = 0
        self.lost = 0
        self.sequence = None
        self.resets = set()

    def take(self, data):
        for message in self.parser.parse_buffer(data) or []:
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.errors += 1
                continue
            self.messages[kind] += 1
            sequence = message.get_seq()
            # A board that starts anew counts from 0.
            if self.sequence is not None and sequence != 0:
                self.lost += (sequence - self.sequence - 1) % 256
            self.sequence = sequence
            if kind == "STATUSTEXT":
                self.texts.append(message.text)
            elif kind == "ODOMETRY":
                self.resets.add(message.reset_counter)

    def summary(self):
        return {
            "messages": self.messages,
            "errors": self.errors + self.parser.total_receive_errors,
            "lost": self.lost,
            "texts": list(dict.fromkeys(self.texts)),
            "resets": len(self.resets),
        }


class Voice:
    """What the board is told."""

    def __init__(self, share):
        self.writer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.share = share
        self.random = random.Random(1)
        self.damaged = 0
        self.started = time.monotonic()
        self.beat_s = None

    def pack(self, message):
        data = bytearray(message.pack(self.writer))
        self.writer.seq = (self.writer.seq + 1) % 256
        if self.random.random() < self.share:
            self.damaged += 1
            at = self.random.randrange(len(data))
            match self.random.randrange(3):
                case 0:
                    data[at] ^= 1 << self.random.randrange(8)
                case 1:
                    del data[at]
                case _:
                    data.insert(at, self.random.randrange(256))
        return bytes(data)

    def tell(self, line):
        read = json.loads(line)
        now_s = time.monotonic() - self.started
        now_ms = int(now_s * 1000)
        data = b""
        if self.beat_s is None or now_s - self.beat_s >= 1:
            self.beat_s = now_s
            beat = mavlink.MAVLink_heartbeat_message(
                mavlink.MAV_TYPE_AIRSHIP, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
            )
            data += self.pack(beat)
        if read["yaw"] is not None:
            angles = (read["roll"], read["pitch"], read["yaw"])
            data += self.pack(mavlink.MAVLink_attitude_message(now_ms, *angles, 0.0, 0.0, 0.0))
        if read["altitude"] is not None:
            meters = round(read["altitude"] * 1000)
            data += self.pack(mavlink.MAVLink_global_position_int_message(now_ms, 0, 0, meters, meters, 0, 0, 0, 65535))
        return data


def main():
    heard, voice = Heard(), Voice(float(sys.argv[1]))
    listener = socket.create_server(("127.0.0.1", 0))
    print(json.dumps({"address": "127.0.0.1:%d" % listener.getsockname()[1]}), flush=True)
    wire, _ = listener.accept()
    wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    waiting = selectors.DefaultSelector()
    waiting.register(wire, selectors.EVENT_READ)
    waiting.register(sys.stdin.buffer.raw, selectors.EVENT_READ)
    line, end_s, is_open = b"", None, True
    while end_s is None or (is_open and time.monotonic() < end_s):
        for key, _ in waiting.select(0.1):
            if key.fileobj is wire:
                try:
                    data = wire.recv(65536)
                except ConnectionResetError:
                    data = b""
                if not data:
                    waiting.unregister(wire)
                    is_open = False
                heard.take(data)
                continue
            data = sys.stdin.buffer.raw.read(65536)
            if not data:
                waiting.unregister(sys.stdin.buffer.raw)
                end_s = time.monotonic() + LAST_S
                continue
            *lines, line = (line + data).split(b"\n")
            for read in lines:
                if is_open:
                    try:
                        wire.sendall(voice.tell(read))
                    except (BrokenPipeError, ConnectionResetError):
                        pass
    summary = heard.summary() | {"damaged": voice.damaged}
    print(json.dumps(summary), flush=True)


if __name__ == "__main__":
    main()
