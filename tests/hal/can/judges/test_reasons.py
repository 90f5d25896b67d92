"""What judges find, in words."""

from string import Formatter

import pytest

from vrg.hal.can.judges.reasons import Cause, Reason


def test_a_reason_names_its_node_and_tells_its_values() -> None:
    assert str(Reason(3, Cause.NO_HEARTBEAT, (0.5,))) == "node 3: no heartbeat for 0.5 s"
    assert str(Reason(3, Cause.REPORTED, ("{braces}",))) == "node 3: {braces}", "a drive's own words are not a format"


@pytest.mark.parametrize("cause", Cause)
def test_each_cause_has_words_that_can_be_told(cause: Cause) -> None:
    places = [place for _, place, _, _ in Formatter().parse(cause.value) if place is not None]
    assert str(Reason(1, cause, (1.5,) * len(places))).startswith("node 1: ")
