"""The kernel's interpreter of BPF, as far as filters of system calls use it."""

import struct
from collections.abc import Sequence

from vrg.launch.sandbox.bpf import Instruction


def run(program: Sequence[Instruction], number: int, arguments: Sequence[int] = (), audit: int = 0xC000003E) -> int:
    """What the filter answers to a system call."""
    padded = [value & 0xFFFFFFFFFFFFFFFF for value in (*arguments, *[0] * (6 - len(arguments)))]
    data = struct.pack("<IIQ6Q", number & 0xFFFFFFFF, audit, 0, *padded)
    place = accumulator = 0
    while True:
        code, yes, no, k = program[place]
        place += 1
        if code == 0x20:  # BPF_LD | BPF_W | BPF_ABS
            (accumulator,) = struct.unpack_from("<I", data, k)
        elif code == 0x54:  # BPF_ALU | BPF_AND | BPF_K
            accumulator &= k
        elif code == 0x15:  # BPF_JMP | BPF_JEQ | BPF_K
            place += yes if accumulator == k else no
        elif code == 0x35:  # BPF_JMP | BPF_JGE | BPF_K
            place += yes if accumulator >= k else no
        elif code == 0x06:  # BPF_RET | BPF_K
            return k
        else:
            raise AssertionError(f"no such instruction: {code:#x}")
