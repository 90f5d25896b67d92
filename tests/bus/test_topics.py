"""The key map."""

import pytest

from vrg.bus.topics import Keys, Qos, key_matches, name_in
from vrg.errors import ConfigError
from vrg.hal.sensors import message_class
from vrg.hal.sensors.laser import Laser


def test_every_key_of_a_match_is_under_its_name_and_tells_that_of_its_robot() -> None:
    keys = Keys("final")
    for topic in (keys.clock, keys.poses, keys.drive("a"), keys.report("a"), keys.referee_state, keys.estop):
        assert topic.key.startswith("vrg/final/")
    assert name_in(keys.drive("r7").key) == "r7"


@pytest.mark.parametrize("name", ["", "a/b", "*", "two words", "-x", "a" * 65, "a$b", "../x"])
def test_a_name_that_cannot_be_part_of_a_key_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="match name"):
        Keys(name)


@pytest.mark.parametrize(
    ("expression", "key", "expected"),
    [
        ("a/*/c", "a/b/c", True), ("a/*/c", "a/b/d", False), ("a/*", "a/b/c", False), ("a/**", "a/b/c", True),
        ("a/**", "a", True), ("a/b", "a/b", True), ("a/b", "a/bb", False),
    ],
)  # fmt: skip
def test_key_expressions_match_as_in_zenoh(expression: str, key: str, expected: bool) -> None:
    assert key_matches(expression, key) is expected


def test_a_key_finds_its_topic() -> None:
    keys = Keys("m")
    found = keys.topic_of("vrg/m/robot/r2/sensor/laser/front", message_class)
    assert found is not None
    assert found.type is Laser
    assert keys.topic_of("vrg/m/robot/r2/sensor/nose/front", message_class) is None
    assert keys.topic_of("vrg/m/robot/r2/pose") == keys.robot_pose()
    assert keys.topic_of("vrg/m/robot/r2/recover") == keys.recover()
    assert keys.topic_of("vrg/m/robot/r2/nothing") is None
    assert keys.topic_of("vrg/other/clock") is None


def test_the_referee_is_told_to_late_joiners_and_calls_are_never_lost() -> None:
    keys = Keys("m")
    assert keys.referee_state.qos is Qos.STATE
    assert keys.speed_limit("a").qos is Qos.STATE
    assert {keys.referee_event.qos, keys.official.qos, keys.estop.qos, keys.recover("a").qos} == {Qos.EVENT}
    assert {keys.drive("a").qos, keys.clock.qos, keys.sensor(Laser, "a").qos, keys.robot_pose("a").qos} == {Qos.LATEST}
