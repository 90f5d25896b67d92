"""Supplies that no battery of the robot has."""

import pytest

from tests.hal.can.judges.drives import NOW, started
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.supply import ANY_SUPPLY, SUPPLY_TIMEOUT, Supply

EMPTY, FULL = 20.0, 25.2


def told(supply: Supply, *volts: float, period: float = SUPPLY_TIMEOUT / 2, armed: bool = True) -> Reason | None:
    """What is found once a drive has told these voltages, one each period."""
    axis, found = started(), None
    for number, voltage in enumerate(volts):
        axis.voltage, axis.supplied = voltage, NOW + number * period
        found = supply.judge(axis, armed=armed)
    return found


@pytest.mark.parametrize(
    ("volts", "expected"),
    [
        ((12.0, 12.0, 12.0), (1, Cause.LOW_SUPPLY, (12.0, EMPTY))),
        ((40.0, 40.0, 40.0), (1, Cause.HIGH_SUPPLY, (40.0, FULL))),
        ((12.0, 12.0), None),
        ((12.0, 12.0, 24.0, 24.0, 12.0, 12.0), None),
        ((17.0, 17.0, 17.0, 31.0, 31.0, 31.0), None),
        ((), None),
    ],
    ids=["low", "high", "for a moment", "with pauses", "a little beside", "not told"],
)
def test_what_a_supply_tells(volts: tuple[float, ...], expected: Reason | None) -> None:
    assert told(Supply(EMPTY, FULL), *volts) == expected


def test_motors_that_are_off_may_have_no_supply() -> None:
    supply = Supply(EMPTY, FULL)
    assert told(supply, 0.0, 0.0, 0.0, armed=False) is None
    assert told(supply, 0.0, 0.0) is None, "it is counted from when the robot is armed"


def test_where_the_battery_is_not_known_any_supply_is_one() -> None:
    assert told(Supply(*ANY_SUPPLY), 0.0, 0.0, 0.0, 900.0, 900.0, 900.0) is None
