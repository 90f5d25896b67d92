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


def told(*lines: str, now: float = 0.0) -> list[str]:
    return Refusals(0.0).read("".join(lines).encode(), now)


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


def test_what_is_only_worked_out_is_no_refusal() -> None:
    assert told(SEEN, decided("Put (ingress) on vrg/m/clock")) == []


def test_what_is_allowed_is_not_told() -> None:
    allowed = cached("Put (ingress) on vrg/m/estop", verdict="authorized")
    assert told(SEEN, allowed * 100) == []


def test_threads_are_not_mixed_up() -> None:
    other = STAMP.replace("rx-0 ThreadId(08)", "rx-1 ThreadId(09)")
    lines = (
        SEEN,
        cached("Put (ingress) on vrg/m/clock"),
        cached("Put (ingress) on vrg/m/poses", stamp=other),
        intercepted(),
        intercepted(other),
    )
    assert told(*lines) == [
        "player.ann may not publish on vrg/m/clock: dropped",
        "player.ann may not publish on vrg/m/poses: dropped",
    ]


def test_a_session_that_was_never_named_is_told_by_its_id() -> None:
    assert told(cached("Put (ingress) on vrg/m/clock"), intercepted()) == [
        f"session {ANN} may not publish on vrg/m/clock: dropped"
    ]


def test_the_routers_own_routing_is_no_refusal_of_anybodys() -> None:
    assert told(SEEN, cached("Declare Liveliness Subscriber (egress) on vrg/m/**"), intercepted()) == []


def test_what_comes_again_and_again_is_told_at_powers_of_ten() -> None:
    refusals = Refusals(0.0)
    once = (cached("Put (ingress) on vrg/m/clock") + intercepted()).encode()
    refusals.read(SEEN.encode(), 0.0)
    said = [line for _ in range(1000) for line in refusals.read(once, 0.0)]
    clock = "player.ann may not publish on vrg/m/clock: dropped"
    assert said == [clock, *(f"{clock} ({count} times by now)" for count in (10, 100, 1000))]


BOB = "1cbaed3d270eb4e23efdbf4c9273d2b8"


def of_bob(lines: str) -> str:
    return lines.replace(ANN, BOB).replace("player.ann", "player.bob")


def flood(number: int) -> bytes:
    return "".join(cached(f"Put (ingress) on vrg/m/{n}") + intercepted() for n in range(number)).encode()


def test_a_flood_of_different_refusals_is_counted_and_not_written() -> None:
    refusals = Refusals(0.0)
    assert len(refusals.read(SEEN.encode() + flood(200), 1.0)) == MAX_LINES
    assert refusals.read(flood(400)[: len(flood(200))], 2.0) == []
    later = refusals.read(SEEN.encode(), REFUSAL_WINDOW + 1.0)
    assert later == [f"player.ann: {200 - MAX_LINES} further refusals within 10 s were not listed"]
    new = "".join(cached(f"Put (ingress) on vrg/n/{n}") + intercepted() for n in range(200)).encode()
    assert len(refusals.read(new, REFUSAL_WINDOW + 2.0)) == MAX_LINES, "the next window begins anew"


def test_the_flood_of_one_seat_does_not_hide_what_another_one_does() -> None:
    refusals = Refusals(0.0)
    refusals.read(SEEN.encode() + flood(200), 1.0)
    other = of_bob(SEEN + cached("Put (ingress) on vrg/m/clock") + intercepted())
    assert refusals.read(other.encode(), 2.0) == ["player.bob may not publish on vrg/m/clock: dropped"]


def test_however_great_the_flood_of_one_seat_is_the_others_are_known_by_name() -> None:
    refusals, many = Refusals(0.0), 6000
    refusals.read(SEEN.encode() + flood(many), 1.0)
    once = cached("Put (ingress) on vrg/m/clock") + intercepted()
    assert refusals.read(of_bob(SEEN + once).encode(), 2.0) == ["player.bob may not publish on vrg/m/clock: dropped"]
    assert refusals.read(b"\n", REFUSAL_WINDOW + 1.0) == [
        f"player.ann: {many - MAX_LINES} further refusals within 10 s were not listed"
    ]


def test_what_was_not_listed_is_told_at_the_end_of_the_log() -> None:
    refusals = Refusals(0.0)
    refusals.read(SEEN.encode() + flood(MAX_LINES + 3), 1.0)
    assert refusals.end() == ["player.ann: 3 further refusals within 10 s were not listed"]
    assert refusals.end() == []


def test_who_does_not_get_in_is_told() -> None:
    warning = (
        "2026-11-22T18:43:48.805163Z  WARN acc-0 ThreadId(05) zenoh_link_tls::unicast: invalid peer certificate: "
        "BadSignature. Hint: increase the system open file limit.\n"
    )
    assert told(warning) == ["a process was not let in: invalid peer certificate: BadSignature"]
    info = (
        f"2026-11-22T18:43:49.018166Z  INFO acc-0 ThreadId(05) {PLACE}::access_control: {ANN} did not match any "
        "configured ACL subject. Default permission `Deny` will be applied on all messages\n"
    )
    assert told(info) == ["a process has connected whose certificate is of no seat of this match: it may do nothing"]


def test_other_warnings_of_zenoh_are_kept() -> None:
    line = "2026-11-22T18:43:48.8Z ERROR rx-0 ThreadId(05) zenoh_transport::common: something is wrong\n"
    assert told(line) == ["zenoh: something is wrong"]


WHOLE = (SEEN + cached("Put (ingress) on vrg/m/clock") + intercepted() + cached("Put (ingress) on vrg/m/ł")).encode()


@given(st.lists(st.integers(0, len(WHOLE)), max_size=6))
def test_bytes_may_come_in_any_pieces(cuts: list[int]) -> None:
    refusals, said = Refusals(0.0), []
    ends = [0, *sorted(cuts), len(WHOLE)]
    for begin, end in pairwise(ends):
        said += refusals.read(WHOLE[begin:end], 0.0)
    assert said == ["player.ann may not publish on vrg/m/clock: dropped"]


@given(st.binary(max_size=300))
def test_no_bytes_break_it(data: bytes) -> None:
    refusals = Refusals(0.0)
    for now in (0.0, REFUSAL_WINDOW + 1.0):
        assert all(isinstance(line, str) for line in refusals.read(data + b"\n", now))
