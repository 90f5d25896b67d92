"""Lines for people out of zenoh's log. The lines here are those of zenoh 1.10.2."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.refusals import MAX_LINES, REFUSAL_WINDOW, Refusals

PLACE = "zenoh::net::routing::interceptor"
ANN = "59cd8d120c72236df11b13fe32460599"
SUBJECT = f"{ANN} on Interface(lo)+CertCommonName(player.ann)+Transport(Tls)+{ANN}"
STAMP = "2026-11-22T18:43:47.833157Z TRACE  rx-0 ThreadId(08)"


def decided(what: str, *, who: str = SUBJECT, stamp: str = STAMP, verdict: str = "unauthorized") -> str:
    return f"{stamp} {PLACE}::access_control: {who} is {verdict} to {what}\n"


def cached(what: str, stamp: str = STAMP, verdict: str = "unauthorized") -> str:
    return f"{stamp} {PLACE}::access_control: Using cached result: {ANN} is {verdict} to {what}\n"


def intercepted(stamp: str = STAMP) -> str:
    return f"{stamp} {PLACE}: Msg intercepted!\n"


SEEN = decided("Query (ingress) on vrg/m/clock")
"""Zenoh works out at once all that a session may do on a key. That tells who it is, and refuses nothing."""


def told(*lines: str) -> list[str]:
    return Refusals(0.0).read("".join(lines).encode(), 0.0)


@pytest.mark.parametrize(
    ("what", "expected"),
    [
        ("Put (ingress) on vrg/m/clock", "may not publish on vrg/m/clock: dropped"),
        ("Declare Subscriber (ingress) on vrg/m/poses", "may not listen to vrg/m/poses: refused"),
        ("Query (ingress) on vrg/m/poses/@adv/**", "may not ask for vrg/m/poses/@adv/**: refused"),
        ("Declare Queryable (ingress) on vrg/m/x/@adv/**", "may not answer for vrg/m/x/@adv/**: refused"),
        ("Liveliness Token (ingress) on vrg/m/alive/w/w/1", "may not be present as vrg/m/alive/w/w/1: refused"),
        ("Liveliness Query (ingress) on vrg/m/x/@adv/**", "may not look who is present as vrg/m/x/@adv/**: refused"),
        ("Declare Liveliness Subscriber (ingress) on vrg/m/*", "may not look who is present as vrg/m/*: refused"),
        ("Reply (ingress) on vrg/m/referee/state", "may not answer for vrg/m/referee/state: dropped"),
        ("Put (egress) on vrg/m/poses", "may not hear vrg/m/poses: withheld"),
    ],
)
def test_a_refusal_tells_who_and_what(what: str, expected: str) -> None:
    assert told(SEEN, cached(what), intercepted()) == [f"player.ann {expected}"]
    assert told(decided(what), intercepted()) == [f"player.ann {expected}"]


PUT, CLOCK = "Put (ingress) on vrg/m/clock", "player.ann may not publish on vrg/m/clock: dropped"
OTHER = STAMP.replace("rx-0 ThreadId(08)", "rx-1 ThreadId(09)")


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([SEEN, decided(PUT)], []),
        ([SEEN, cached("Put (ingress) on vrg/m/estop", verdict="authorized") * 100], []),
        ([SEEN, cached("Declare Liveliness Subscriber (egress) on vrg/m/**"), intercepted()], []),
        ([cached(PUT), intercepted()], [f"session {ANN} may not publish on vrg/m/clock: dropped"]),
        (
            [SEEN, cached(PUT), cached(PUT.replace("clock", "poses"), OTHER), intercepted(), intercepted(OTHER)],
            [CLOCK, CLOCK.replace("clock", "poses")],
        ),
        (
            ["2026-11-22T18:43:48.8Z WARN acc-0 ThreadId(05) zenoh_link_tls::unicast: invalid peer certificate: "
             "BadSignature. Hint: increase the system open file limit.\n"],
            ["a process was not let in: invalid peer certificate: BadSignature"],
        ),
        (
            [f"2026-11-22T18:43:49.0Z  INFO acc-0 ThreadId(05) {PLACE}::access_control: {ANN} did not match any "
             "configured ACL subject. Default permission `Deny` will be applied on all messages\n"],
            ["a process has connected whose certificate is of no seat of this match: it may do nothing"],
        ),
        (
            ["2026-11-22T18:43:48.8Z ERROR rx-0 ThreadId(05) zenoh_transport::common: something is wrong\n"],
            ["zenoh: something is wrong"],
        ),
    ],
    ids=["only worked out", "allowed", "the router's own routing", "never named", "two threads", "not let in",
         "of no seat", "another warning of zenoh"],
)  # fmt: skip
def test_of_a_log_is_told(lines: list[str], said: list[str]) -> None:
    assert told(*lines) == said


def test_what_comes_again_and_again_is_told_at_powers_of_ten() -> None:
    refusals = Refusals(0.0)
    once = (cached(PUT) + intercepted()).encode()
    refusals.read(SEEN.encode(), 0.0)
    said = [line for _ in range(1000) for line in refusals.read(once, 0.0)]
    assert said == [CLOCK, *(f"{CLOCK} ({count} times by now)" for count in (10, 100, 1000))]


BOB = "1cbaed3d270eb4e23efdbf4c9273d2b8"


def flood(number: int, match: str = "m") -> bytes:
    return "".join(cached(f"Put (ingress) on vrg/{match}/{n}") + intercepted() for n in range(number)).encode()


def test_a_flood_of_different_refusals_is_counted_and_not_written() -> None:
    refusals = Refusals(0.0)
    assert len(refusals.read(SEEN.encode() + flood(200), 1.0)) == MAX_LINES
    assert refusals.read(flood(400)[: len(flood(200))], 2.0) == []
    later = refusals.read(SEEN.encode(), REFUSAL_WINDOW + 1.0)
    assert later == [f"player.ann: {200 - MAX_LINES} further refusals within 10 s were not listed"]
    assert len(refusals.read(flood(200, "n"), REFUSAL_WINDOW + 2.0)) == MAX_LINES, "the next window begins anew"


@pytest.mark.parametrize("many", [200, 6000])
def test_however_great_the_flood_of_one_seat_is_the_others_are_known_by_name(many: int) -> None:
    refusals = Refusals(0.0)
    refusals.read(SEEN.encode() + flood(many), 1.0)
    other = (SEEN + cached(PUT) + intercepted()).replace(ANN, BOB).replace("player.ann", "player.bob")
    assert refusals.read(other.encode(), 2.0) == ["player.bob may not publish on vrg/m/clock: dropped"]
    assert refusals.read(b"\n", REFUSAL_WINDOW + 1.0) == [
        f"player.ann: {many - MAX_LINES} further refusals within 10 s were not listed"
    ]


def test_what_was_not_listed_is_told_at_the_end_of_the_log() -> None:
    refusals = Refusals(0.0)
    refusals.read(SEEN.encode() + flood(MAX_LINES + 3), 1.0)
    assert refusals.end() == ["player.ann: 3 further refusals within 10 s were not listed"]
    assert refusals.end() == []


WHOLE = (SEEN + cached(PUT) + intercepted() + cached("Put (ingress) on vrg/m/ł")).encode()


@given(st.lists(st.integers(0, len(WHOLE)), max_size=6))
def test_bytes_may_come_in_any_pieces(cuts: list[int]) -> None:
    refusals, said = Refusals(0.0), []
    ends = [0, *sorted(cuts), len(WHOLE)]
    for begin, end in pairwise(ends):
        said += refusals.read(WHOLE[begin:end], 0.0)
    assert said == [CLOCK]


@given(st.binary(max_size=300))
def test_no_bytes_break_it(data: bytes) -> None:
    refusals = Refusals(0.0)
    for now in (0.0, REFUSAL_WINDOW + 1.0):
        assert all(isinstance(line, str) for line in refusals.read(data + b"\n", now))
