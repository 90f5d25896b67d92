"""An emulated Crazyflie plays beside virtual robots, in processes of their own and in real time."""

from collections.abc import Callable

import pytest

from vrg.testing.processes.match import LiveMatch, long_match

pytestmark = pytest.mark.system

EMULATED = "[backends.crazyflie]\nemulate = true\n\n[[players]]"


def test_a_crazyflie_plays_beside_virtual_robots_and_obeys_the_referee(start: Callable[..., LiveMatch]) -> None:
    own = 'name = "ann"\nrole = "minnow"\nbackend = '
    text = long_match("air").replace("[[players]]", EMULATED, 1)
    match = start(text.replace(f'{own}"sim"', f'{own}"crazyflie"\nmodel = "Crazyflie"'))
    seen = match.observer

    match.command("official", "halt")
    seen.wait_until(lambda: seen.standing("ann"), "the Crazyflie to hover while play is halted")
    match.go_on()

    match.command("estop", "--reason", "test")
    seen.wait_until(lambda: seen.standing("ann"), "the Crazyflie to lie on the ground after the emergency stop")
    match.command("estop", "--release")
    match.go_on()
