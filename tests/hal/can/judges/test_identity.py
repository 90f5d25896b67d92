"""Drives that are not those that they were."""

from tests.hal.can.judges.drives import report
from vrg.hal.can.judges.identity import DriveIdentity
from vrg.hal.can.judges.reasons import Cause


def test_who_answers_first_is_expected_from_then_on() -> None:
    axis = report()
    identity = DriveIdentity([axis], {})
    assert identity.judge() is None
    for serial, expected in (("A", None), ("A", None), ("B", (1, Cause.SWAPPED, ("B", "A")))):
        axis.serials = {serial}
        assert identity.judge() == expected


def test_a_drive_of_the_calibration_must_say_who_it_is() -> None:
    axes = [report(0), report(1)]
    identity = DriveIdentity(axes, {0: "", 1: "A"})
    assert identity.unknown == 1
    axes[1].serials = {"A"}
    assert identity.unknown is None
    identity.forget(axes)
    assert identity.unknown == 1


def test_two_drives_of_one_id_are_told_in_words_of_the_axis() -> None:
    axis = report(4)
    axis.serials = {"A", "B"}
    found = DriveIdentity([axis], {4: "A"}).judge()
    assert found == (4, Cause.REPORTED, (axis.shared,))
