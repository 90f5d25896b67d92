"""Settings of sensors: which numbers can be set, how they are checked, and that the world measures by them."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from vrg.errors import ConfigError
from vrg.hal.models import MODELS, robot_model
from vrg.hal.models.settings import merged, settable_fields, setting_problems, with_settings
from vrg.hal.sensors import SENSORS
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.config import RobotSetup, WorldConfig, fingerprint
from vrg.hal.sim.world import World
from vrg.types import Pose

P2AT = robot_model("P2AT")


def told(settings: dict[str, Any]) -> list[str]:
    return [str(problem) for problem in setting_problems(settings)]


@pytest.mark.parametrize("kind", SENSORS.names())
def test_every_sensor_has_a_rate_and_a_share_of_readings_that_drop_out(kind: str) -> None:
    assert {"rate", "drop_out"} <= settable_fields(SENSORS.get(kind)).keys()


@pytest.mark.parametrize("name", MODELS.names())
def test_every_number_of_every_model_is_within_its_own_bounds(name: str) -> None:
    model = MODELS.get(name)
    numbers = {s.kind: {field: getattr(s, field) for field in settable_fields(type(s))} for s in model.sensors}
    assert told(numbers) == []
    assert with_settings(model, numbers) == model


def test_settings_change_the_sensors_of_their_kind_and_nothing_else() -> None:
    changed = with_settings(P2AT, {"laser": {"noise": 0.03, "beams": 19}, "touch": {}})
    assert changed.sensor(LaserSpec) == replace(P2AT.sensor(LaserSpec), noise=0.03, beams=19)  # type: ignore[type-var]
    assert replace(changed, sensors=P2AT.sensors) == P2AT
    assert [spec for spec in changed.sensors if spec.kind != "laser"] == [
        spec for spec in P2AT.sensors if spec.kind != "laser"
    ]


def test_settings_hold_for_all_sensors_of_their_kind_and_a_whole_number_becomes_a_number() -> None:
    assert with_settings(P2AT, {}) is P2AT
    assert P2AT.sensor(LaserSpec) is not None
    two = replace(P2AT, sensors=(P2AT.sensor(LaserSpec), replace(P2AT.sensor(LaserSpec), name="rear")))
    rates = [spec.rate for spec in with_settings(two, {"laser": {"rate": 5}}).sensors]
    assert rates == [5.0, 5.0]
    assert all(isinstance(rate, float) for rate in rates)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"lazer": {"noise": 0.1}}, "lazer: expected one of altimeter, battery, "),
        ({"lazer": {"noise": 0.1}}, "did you mean 'laser'?"),
        ({"laser": {"nose": 0.1}}, "laser.nose: expected one of beams, drop_out, "),
        ({"laser": {"nose": 0.1}}, "got 'nose', did you mean 'noise'?"),
        ({"laser": {"name": "front"}}, "laser.name: expected one of beams"),
        ({"sonar": {"places": 3}}, "sonar.places: expected one of cone"),
        ({"laser": {"noise": -0.1}}, "laser.noise: expected a number of at least 0 and at most 100000, got -0.1"),
        ({"laser": {"drop_out": 1.5}}, "laser.drop_out: expected a number of at least 0 and at most 1, got 1.5"),
        ({"laser": {"rate": 0}}, "laser.rate: expected a number above 0 and at most 50, got 0"),
        ({"laser": {"rate": 100.0}}, "laser.rate: expected a number above 0 and at most 50, got 100.0"),
        ({"laser": {"beams": 0}}, "laser.beams: expected a whole number of at least 1 and at most 10000, got 0"),
        ({"laser": {"beams": 3.5}}, "laser.beams: expected a whole number, got 3.5"),
        ({"laser": {"noise": "much"}}, "laser.noise: expected a number, got 'much'"),
        ({"laser": {"noise": True}}, "laser.noise: expected a number, got True"),
        ({"laser": {"noise": math.nan}}, "got nan"),
        ({"laser": {"noise": math.inf}}, "got inf"),
        ({"laser": {"resolution": 0.0}}, "laser.resolution: expected a number above 0"),
        ({"sonar": {"resolution": 0}}, "sonar.resolution: expected a number above 0"),
        ({"gps": {"correlation": 0}}, "gps.correlation: expected a number above 0"),
        ({"laser": {"noise": 10**400}}, "laser.noise: expected a number of at least 0 and at most 100000, got 1000"),
        (
            {"laser": {"beams": 10**400}},
            "laser.beams: expected a whole number of at least 1 and at most 10000, got 1000",
        ),
        ({"sonar": {"cone": 4.0}}, "sonar.cone: expected a number above 0 and below 3.141592654, got 4.0"),
    ],
)
def test_wrong_settings_are_told_in_words(settings: dict[str, Any], words: str) -> None:
    assert words in "\n".join(told(settings))
    with pytest.raises(ConfigError):
        with_settings(P2AT, settings)


def test_numbers_that_do_not_fit_together_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"sonar: expected range_min of at most range_max, 0\.05 m, got 0\.1 m"):
        with_settings(P2AT, {"sonar": {"range_max": 0.05}})


@given(st.floats(), st.sampled_from(["noise", "drop_out", "rate", "beams", "range_max", "fov", "resolution"]))
def test_any_number_is_either_refused_or_used(value: float, field: str) -> None:
    settings = {"laser": {field: value}}
    if setting_problems(settings):
        with pytest.raises(ConfigError):
            with_settings(P2AT, settings)
    else:
        assert getattr(with_settings(P2AT, settings).sensor(LaserSpec), field) == value


def test_the_settings_of_a_player_hold_before_those_of_the_match() -> None:
    match = {"laser": {"noise": 0.1, "beams": 9}, "gps": {"rate": 2.0}}
    assert merged(match, {"laser": {"noise": 0.0}, "ins": {"rate": 5.0}}) == {
        "gps": {"rate": 2.0},
        "ins": {"rate": 5.0},
        "laser": {"beams": 9, "noise": 0.0},
    }
    assert list(merged(match, {})) == ["gps", "laser"]


def test_a_spec_of_another_package_is_set_by_its_annotations() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Sounding(SensorSpec):
        message = Laser
        depth: Annotated[float, Meta(ge=0.0), Meta(le=11_000.0)] = 10.0
        plain: int = 3
        word: str = ""
        yes: bool = True

    assert settable_fields(Sounding).keys() == {"rate", "drop_out", "depth", "plain"}


def test_what_is_too_large_for_a_float_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True, kw_only=True)
    class Free(SensorSpec):
        message = Laser
        plain: float = 1.0

    monkeypatch.setitem(SENSORS._found, "laser", Free)
    with pytest.raises(ConfigError, match="laser: int too large"):
        with_settings(replace(P2AT, sensors=(Free(),)), {"laser": {"plain": 10**400}})


def test_a_spec_whose_annotations_cannot_be_read_cannot_be_set(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True, kw_only=True)
    class Odd(SensorSpec):
        message = Laser
        depth: "Fathoms" = 1.0  # type: ignore[name-defined]  # noqa: F821

    monkeypatch.setitem(SENSORS._found, "laser", Odd)
    assert "laser: its fields cannot be read, so they cannot be set" in told({"laser": {"depth": 2.0}})[0]


def world(*, noise: bool = True, **settings: dict[str, float]) -> WorldConfig:
    robot = RobotSetup(name="a", model="P2AT", pose=Pose(0, 0, 0), sensors=settings)
    other = RobotSetup(name="b", model="P2AT", pose=Pose(3, 0, 0))
    return WorldConfig(map="open", engine="planar", noise=noise, robots=(robot, other))


def scans(config: WorldConfig, robot: str, ticks: int = 50) -> list[Laser]:
    simulated = World(config)
    found = []
    for _ in range(ticks):
        simulated.step()
        found += [m for name, _, m in simulated.sense() if name == robot and isinstance(m, Laser)]
    return found


def test_the_world_measures_by_the_settings_of_each_robot() -> None:
    config = world(laser={"beams": 5, "rate": 5.0, "range_max": 2.0})
    changed, usual = scans(config, "a"), scans(config, "b")
    assert (len(changed), len(usual)) == (5, 10)
    assert (len(changed[0].ranges), len(usual[0].ranges)) == (5, 181)
    assert changed[0].range_max == 2.0


def test_a_laser_may_have_one_beam_which_is_straight_ahead() -> None:
    [scan] = scans(world(noise=False, laser={"beams": 1, "rate": 1.0}), "a")
    assert scan.ranges.tolist() == pytest.approx([3.0 - 0.15 - P2AT.length / 2], abs=1e-5)
    assert scan.angles.tolist() == [0.0]


def test_readings_drop_out_but_not_where_sensors_are_perfect() -> None:
    half = {"laser": {"drop_out": 0.5}}
    assert 20 < len(scans(world(**half), "a", 500)) < 80
    assert len(scans(world(noise=False, **half), "a", 500)) == 100
    assert scans(world(laser={"drop_out": 1.0}), "a") == []


def test_a_restarted_world_keeps_the_settings() -> None:
    config = world(laser={"beams": 5})
    assert fingerprint(config) != fingerprint(world())
    first = World(config)
    second = World(config, first.snapshot())
    assert second.model("a").sensor(LaserSpec) == first.model("a").sensor(LaserSpec)
    assert second.model("a").sensor(LaserSpec) != P2AT.sensor(LaserSpec)
    assert second.model("b") == P2AT
