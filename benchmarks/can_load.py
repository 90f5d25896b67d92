"""How many bits CAN frames take on the wire, and the load of a robot's bus.

A data frame with an 11-bit identifier and n bytes has 44 + 8 n bits: start 1, identifier 11, RTR, IDE and r0 3, length
4, data 8 n, checksum 15, its delimiter 1, acknowledgement 2, end 7. Of these the first 34 + 8 n, up to the checksum's
end, are stuffed: after five equal bits comes one of the other kind, which counts for the next five. So at most one a
group of four follows the first, floor((34 + 8 n - 1) / 4). Three bits between frames are added. Sources: ISO 11898-1;
for the bound R. I. Davis et al., Controller Area Network (CAN) schedulability analysis, Real-Time Systems 35 (2007).
A remote frame has no data. Eight bytes take 135 bits at most: 1851 frames/s at 250 kbit/s.
"""

import time
from collections import Counter
from collections.abc import Callable, Sequence

from can_peers import REMOTE, Heard, Listener
from can_robots import AHEAD, PLAYER_RATE, Drives, connected, keep_driving, paced, train

from vrg.hal.can.odrive.codec import command_of
from vrg.hal.can.odrive.messages import Command
from vrg.types import Twist

BIT_RATE = 250_000
"""bit/s."""
BETWEEN = 3
"""Bits between frames."""
_POLYNOMIAL = 0x4599
"""Of the 15-bit checksum."""


def worst_bits(size: int) -> int:
    """Of a frame with `size` bytes of data, with the space after it."""
    return 44 + 8 * size + (34 + 8 * size - 1) // 4 + BETWEEN


def real_bits(frame: Heard) -> int:
    """Of this frame, with the bits that are really stuffed into it."""
    remote = bool(frame.id & REMOTE)
    size = 0 if remote else len(frame.data)
    bits = [0, *_binary(frame.id & 0x7FF, 11), int(remote), 0, 0, *_binary(len(frame.data), 4)]
    for byte in frame.data[:size]:
        bits += _binary(byte, 8)
    checksum = 0
    for bit in bits:
        top = checksum >> 14 ^ bit
        checksum = (checksum << 1 & 0x7FFF) ^ (_POLYNOMIAL if top else 0)
    bits += _binary(checksum, 15)
    stuffed, last, run = 0, -1, 0
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    return 44 + 8 * size + stuffed + BETWEEN


def _binary(value: int, width: int) -> list[int]:
    return [value >> i & 1 for i in reversed(range(width))]


def load(frames: Sequence[Heard], seconds: float) -> tuple[float, float]:
    """Share of the bus in %: at the worst stuffing, and as the frames really are."""
    worst = sum(worst_bits(0 if frame.id & REMOTE else len(frame.data)) for frame in frames)
    return 100 * worst / BIT_RATE / seconds, 100 * sum(map(real_bits, frames)) / BIT_RATE / seconds


def rows(seconds: float, tell: Callable[[str], None]) -> list[dict[str, object]]:
    """A robot of two motors that drives, at two rates of setpoints."""
    table: list[dict[str, object]] = []
    one = train("r", (0, 1))
    with Drives((0, 1)), Listener() as listener:
        for rate in (PLAYER_RATE, 50.0):
            tell(f"bus load, setpoints at {rate:g} Hz for {seconds:g} s")
            with connected(one):
                for _ in paced(rate, 0.5):
                    keep_driving(one, AHEAD)
                listener.take()
                began = time.time()
                for _ in paced(rate, seconds):
                    # Speeds that differ each time, as a player's do.
                    keep_driving(one, Twist(AHEAD.v, 0.1 * (time.time() % 1.0)))
                frames = [frame for frame in listener.take() if began <= frame.at < began + seconds]
            table.append(_row(f"2 axes, setpoints {rate:g} Hz", frames, seconds))
    return table


def _row(case: str, frames: Sequence[Heard], seconds: float) -> dict[str, object]:
    kinds = Counter(command_of(frame.id & 0x7FF) for frame in frames)
    shown = {
        "heartbeat": Command.HEARTBEAT,
        "encoder": Command.ENCODER_ESTIMATES,
        "supply": Command.BUS_VOLTAGE_CURRENT,
        "setpoint": Command.SET_INPUT_VEL,
    }
    worst, real = load(frames, seconds)
    counted = {f"{name}/s": kinds.pop(command, 0) / seconds for name, command in shown.items()}
    return {
        "case": case,
        **counted,
        "others": kinds.total(),
        "frames/s": len(frames) / seconds,
        "load at worst stuffing, %": worst,
        "load with real stuffing, %": real,
    }
