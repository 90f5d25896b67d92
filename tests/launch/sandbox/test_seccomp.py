"""Which system calls the filter refuses, on both processors."""

import errno
import itertools
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.launch.sandbox.machine import run
from vrg.launch.sandbox.bpf import LONGEST_JUMP, RETURN, Instruction, ProgramLine, assembled, program_bytes
from vrg.launch.sandbox.seccomp import ALLOW, ERRNO, REFUSED_CALLS, program, rules
from vrg.launch.sandbox.syscalls import ARCHITECTURES, NEWEST, Architecture

PID = 4711
NOT_PERMITTED, DENIED, UNKNOWN = (ERRNO | number for number in (errno.EPERM, errno.EACCES, errno.ENOSYS))
CONDITIONAL = {rule.call for rule in rules(PID)} - set(REFUSED_CALLS)


@pytest.fixture(params=ARCHITECTURES.values(), ids=ARCHITECTURES)
def architecture(request: pytest.FixtureRequest) -> Architecture:
    found: Architecture = request.param
    return found


@pytest.fixture
def filtering(architecture: Architecture) -> list[Instruction]:
    return program(architecture, rules(PID))


def asked(architecture: Architecture, filtering: list[Instruction], call: str, *arguments: int) -> int:
    return run(filtering, architecture.numbers[call], arguments, architecture.audit)


def test_what_is_refused_altogether_is_refused(architecture: Architecture, filtering: list[Instruction]) -> None:
    there = [name for name in REFUSED_CALLS if name in architecture.numbers]
    assert len(there) > 80
    assert {asked(architecture, filtering, name) for name in there} == {NOT_PERMITTED}


def test_every_rule_names_a_system_call_of_some_processor() -> None:
    known = set().union(*(architecture.numbers for architecture in ARCHITECTURES.values()))
    named = {rule.call for rule in rules(PID)}
    assert named == known
    assert len(named) == len(rules(PID))


def test_no_two_system_calls_have_one_number(architecture: Architecture) -> None:
    assert len(set(architecture.numbers.values())) == len(architecture.numbers)


def test_every_other_system_call_is_allowed(architecture: Architecture, filtering: list[Instruction]) -> None:
    others = set(range(NEWEST + 1)) - set(architecture.numbers.values())
    assert {run(filtering, number, audit=architecture.audit) for number in others} == {ALLOW}


@given(number=st.integers(NEWEST + 1, 2**32 - 1))
def test_a_newer_system_call_or_one_of_x32_is_unknown(number: int) -> None:
    for architecture in ARCHITECTURES.values():
        assert run(program(architecture, rules(PID)), number, audit=architecture.audit) == UNKNOWN


@given(audit=st.integers(0, 2**32 - 1), number=st.integers(0, NEWEST))
def test_a_call_of_another_processor_is_refused(audit: int, number: int) -> None:
    for architecture in ARCHITECTURES.values():
        if audit != architecture.audit:
            assert run(program(architecture, rules(PID)), number, audit=audit) == NOT_PERMITTED


def test_threads_are_made_and_processes_are_not(architecture: Architecture, filtering: list[Instruction]) -> None:
    thread = 0x3D0F00  # what the C library's pthread_create asks for
    assert asked(architecture, filtering, "clone", thread) == ALLOW
    assert asked(architecture, filtering, "clone", 0x1200011) == NOT_PERMITTED  # its fork
    assert asked(architecture, filtering, "clone", 0x4111) == NOT_PERMITTED  # its vfork
    assert asked(architecture, filtering, "clone3") == UNKNOWN


def test_signals_are_sent_and_bounds_looked_up_for_oneself_only(
    architecture: Architecture, filtering: list[Instruction]
) -> None:
    answers = {PID: ALLOW, 1: NOT_PERMITTED, 0: NOT_PERMITTED, -1: NOT_PERMITTED, -PID: NOT_PERMITTED}
    calls = itertools.product(("kill", "tgkill", "rt_sigqueueinfo"), answers.items())
    wrong = [f"{call} to {to}" for call, (to, answer) in calls if asked(architecture, filtering, call, to) != answer]
    assert not wrong, "\n".join(wrong)
    assert [asked(architecture, filtering, "prlimit64", pid) for pid in (0, PID, 1)] == [ALLOW, ALLOW, NOT_PERMITTED]


CLOEXEC = 0o2000000
TCP = (2, socket.SOCK_STREAM, 0)
UDP = (2, socket.SOCK_DGRAM, 0)
CAN = (29, 3, 1)
SOCKETS = {
    "tcp": (TCP, True),
    "tcp by its number": ((2, 1 | CLOEXEC, 6), True),
    "tcp over ipv6": ((10, 1 | CLOEXEC, 0), True),
    "udp": (UDP, False),
    "udp over ipv6": ((10, 2, 17), False),
    "raw": ((2, 3, 1), False),
    "multipath tcp": ((2, 1, 262), False),
    "sctp": ((2, 1, 132), False),
    "unix": ((1, 1, 0), False),
    "netlink": ((16, 3, 0), False),
    "packets": ((17, 3, 0), False),
    "crypto": ((38, 5, 0), False),
    "virtual machines": ((40, 1, 0), False),
    "bluetooth": ((31, 1, 3), False),
    "can": (CAN, False),
}


def test_only_sockets_of_tcp_are_made(architecture: Architecture, filtering: list[Instruction]) -> None:
    wrong = [
        name
        for name, (arguments, allowed) in SOCKETS.items()
        if asked(architecture, filtering, "socket", *arguments) != (ALLOW if allowed else DENIED)
    ]
    assert not wrong, "\n".join(wrong)


def test_nothing_is_bound(architecture: Architecture, filtering: list[Instruction]) -> None:
    assert asked(architecture, filtering, "bind", 3) == DENIED


def test_an_event_loop_gets_its_pair_of_sockets(architecture: Architecture, filtering: list[Instruction]) -> None:
    assert asked(architecture, filtering, "socketpair", 1, 1 | CLOEXEC) == ALLOW
    assert asked(architecture, filtering, "socketpair", 1, 2) == DENIED


def test_nothing_is_sent_by_fast_open_and_no_open_file_over_a_socket(
    architecture: Architecture, filtering: list[Instruction]
) -> None:
    assert asked(architecture, filtering, "sendto", 3, 0, 0, 0x4000) == ALLOW
    assert asked(architecture, filtering, "sendto", 3, 0, 0, 0x20004000) == DENIED
    assert {asked(architecture, filtering, call, 3, 0, 0) for call in ("sendmsg", "sendmmsg")} == {DENIED}


def test_no_signals_go_out_by_way_of_files(architecture: Architecture, filtering: list[Instruction]) -> None:
    assert {asked(architecture, filtering, "fcntl", 3, command) for command in (8, 10, 15)} == {NOT_PERMITTED}
    assert {asked(architecture, filtering, "fcntl", 3, command) for command in (1, 2, 3, 4, 1030)} == {ALLOW}
    asked_for = (0x8901, 0x8902, 0x5412, 0x541C)
    assert {asked(architecture, filtering, "ioctl", 3, request) for request in asked_for} == {NOT_PERMITTED}
    assert {asked(architecture, filtering, "ioctl", 3, request) for request in (0x5401, 0x5421, 0x541B)} == {ALLOW}


def test_what_is_above_32_bits_of_an_argument_does_not_count(
    architecture: Architecture, filtering: list[Instruction]
) -> None:
    assert asked(architecture, filtering, "kill", PID | 1 << 40) == ALLOW
    assert asked(architecture, filtering, "socket", 1 | 1 << 40, 1, 0) == DENIED


def test_a_program_is_packed_as_the_kernel_reads_it(filtering: list[Instruction]) -> None:
    assert program_bytes(filtering[:1]) == b"\x20\x00\x00\x00\x04\x00\x00\x00"
    assert len(program_bytes(filtering)) == 8 * len(filtering)
    assert len(filtering) < 4096


@pytest.mark.parametrize("between", [LONGEST_JUMP, LONGEST_JUMP + 1])
def test_a_jump_goes_only_so_far(between: int) -> None:
    returns = [ProgramLine(RETURN)] * between
    steps = [ProgramLine(0x15, 1, yes="far"), *returns, ProgramLine(label="far"), ProgramLine(RETURN)]
    if between == LONGEST_JUMP:
        assert assembled(steps)[0] == (0x15, LONGEST_JUMP, 0, 1)
    else:
        with pytest.raises(ValueError, match="expected a jump of 0 to 255 instructions to 'far', got 256"):
            assembled(steps)


@pytest.mark.parametrize(
    "steps", [[ProgramLine(0x15, 1, yes="gone")], [ProgramLine(label="back"), ProgramLine(0x15, 1, yes="back")]]
)
def test_a_jump_needs_a_label_ahead(steps: list[ProgramLine]) -> None:
    with pytest.raises(ValueError, match="expected a"):
        assembled(steps)
