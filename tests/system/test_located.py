"""Robots that only the fusion centre locates stand when nothing sees them, and go on when something does again."""

import signal
from collections.abc import Callable

import pytest

from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match

pytestmark = [pytest.mark.system, pytest.mark.thorough]

LOCATED = ("ann", "bob")


def match_text() -> str:
    """The long match, in which a simulated camera locates two minnows."""
    text = long_match("located").replace("[[players]]", '[localisation.overhead]\nsource = "sim"\n\n[[players]]', 1)
    for name in LOCATED:
        text = text.replace(f'name = "{name}"', f'name = "{name}"\nlocalisation = "fusion"')
    return text


def test_robots_stand_while_nothing_locates_them(start: Callable[..., LiveMatch]) -> None:
    match = start(match_text(), seats=True)
    observer = match.observer
    observer.wait_moving(*MINNOWS)

    source = match.child("overhead")
    source.send_signal(signal.SIGSTOP)
    lost = "it has not been located for 0.5 s"
    observer.wait_until(lambda: any(lost in call.text for call in observer.heard.calls), "play to be halted")
    observer.wait_until(lambda: observer.standing(*LOCATED), "robots that nothing sees to stand")
    match.wait_replaced("overhead", source)  # a frozen process is started again
    match.go_on()
    observer.wait_moving(*MINNOWS)

    centre = match.child("fusion")
    before = sum(lost in call.text for call in observer.heard.calls)
    centre.kill()
    observer.wait_until(lambda: sum(lost in call.text for call in observer.heard.calls) > before, "the next halt")
    match.wait_replaced("fusion", centre)
    match.go_on()
    observer.wait_moving(*MINNOWS)
    assert "fusion" in match.said()
