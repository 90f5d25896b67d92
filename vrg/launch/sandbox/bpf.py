"""Programs of the kernel's classic packet filter (BPF) as seccomp runs them for each system call; pure functions.

An instruction is the kernel's `struct sock_filter`: a code, two relative jumps, and a number. Jumps to labels are
resolved here. See the kernel's Documentation/userspace-api/seccomp_filter.rst.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

LOAD, AND, EQUAL, AT_LEAST, RETURN = 0x20, 0x54, 0x15, 0x35, 0x06
"""BPF_LD|BPF_W|BPF_ABS, BPF_ALU|BPF_AND|BPF_K, BPF_JMP|BPF_JEQ|BPF_K, BPF_JMP|BPF_JGE|BPF_K and BPF_RET|BPF_K."""
NUMBER, ARCHITECTURE = 0, 4
"""The offsets in `struct seccomp_data` of the number of the system call and of the processor's."""
LONGEST_JUMP = 255
"""The number of instructions that a conditional jump can pass over."""


@dataclass(frozen=True)
class ProgramLine:
    """One instruction, or a label if it has a name and no code.

    Args:
        code: of the instruction. k: its number.
        yes, no: the labels to go on at after a comparison; empty means the next instruction.
        label: what this place is called.
    """

    code: int = 0
    k: int = 0
    yes: str = ""
    no: str = ""
    label: str = ""


Instruction = tuple[int, int, int, int]
"""Code, jump if true, jump if false, number."""


def argument(number: int) -> int:
    """The offset in `struct seccomp_data` of the lower 32 bits of an argument, on a little-endian machine.

    Args:
        number: from 0 to 5.
    """
    return 16 + 8 * number


def assembled(steps: Sequence[ProgramLine]) -> list[Instruction]:
    """The instructions of a program.

    Raises:
        ValueError: a label is missing, lies before its jump, or is too far away.
    """
    places: dict[str, int] = {}
    count = 0
    for step in steps:
        if step.label:
            places[step.label] = count
        else:
            count += 1
    found: list[Instruction] = []
    for step in steps:
        if not step.label:
            here = len(found) + 1
            found.append((step.code, _jump(step.yes, here, places), _jump(step.no, here, places), step.k))
    return found


def _jump(label: str, here: int, places: dict[str, int]) -> int:
    if not label:
        return 0
    if label not in places:
        raise ValueError(f"expected a label of this program, got {label!r}")
    jump = places[label] - here
    if not 0 <= jump <= LONGEST_JUMP:
        raise ValueError(f"expected a jump of 0 to {LONGEST_JUMP} instructions to {label!r}, got {jump}")
    return jump


def program_bytes(program: Sequence[Instruction]) -> bytes:
    """The program as the kernel reads it."""
    return b"".join(struct.pack("=HBBI", *instruction) for instruction in program)
