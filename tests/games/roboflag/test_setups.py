"""Which matches of RoboFlag can be played, and the reason why another one is refused."""

import math
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from tests.games.roboflag.making import Play, book, calls, contestants, judge
from vrg.config.loading import load_match, match_path
from vrg.coordinator.rulebook import Contestant
from vrg.errors import ConfigError
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings
from vrg.types import Vector

CORNERS = [(centre, home) for centre in ((-6, -4), (6, 4), (-6, 4), (6, -4)) for home in ("low", "high")]


def test_the_default_match_can_be_played_on_a_field_twice_that_of_cornell() -> None:
    setup = load_match(match_path("roboflag"))
    settings = Settings.model_validate(dict(setup.rules))
    assert settings.scale == 2.0
    assert [sum(player.role == team for player in setup.players) for team in ("red", "blue")] == [4, 4]


@pytest.mark.parametrize("tag_distance", [0.3, 0.31, 0.28, 0.19, 0.45])
def test_that_reason_says_which_scale_would_do(tag_distance: float) -> None:
    with pytest.raises(ConfigError, match="two robots touch") as error:
        RoboFlag(Settings(scale=1.0, tag_distance=tag_distance), contestants())
    told = re.search(r"a scale of at least ([0-9.]+)", str(error.value))
    assert told is not None
    places = {"red1": (-2.0, 0.0), "blue1": (2.0, 0.0)}
    enough = Settings(scale=float(told[1]), tag_distance=tag_distance)
    assert RoboFlag(enough, contestants(1, 1, moved=places))


def test_at_scale_one_small_robots_can_play() -> None:
    places = {f"{team}{i}": (x, 0.4 * i) for team, x in (("red", -1.0), ("blue", 1.0)) for i in range(1, 5)}
    assert RoboFlag(Settings(scale=1.0), contestants(size=(0.2, 0.2), moved=places))


def test_a_match_file_of_scale_one_is_refused_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "match.toml"
    file.write_text(match_path("roboflag").read_text().replace("scale = 2.0", "scale = 1.0"))
    with pytest.raises(ConfigError, match="two robots touch"):
        load_match(file)


def test_teams_may_be_of_different_sizes() -> None:
    rules = book(red=1, blue=5)
    play = Play(rules)
    assert len(play.match.names) == 6
    assert calls(judge(rules, {"red1": (2.0, 0.0), "blue5": (2.3, 0.0)})) == [("tag", "red1", "blue5")]


OUTSIDE = "the flag zone of the team {} in its half"
AT_HOME = "the flag zone of the team {} away from its home"
SIDES: list[tuple[str, str, str, Vector]] = [
    *(("red", "low", OUTSIDE, flag) for flag in ((2, 0), (-0.4, 0), (-2.6, 0), (-2, 1.6), (-2, 5))),
    *(("blue", "high", OUTSIDE, flag) for flag in ((-2, 0), (0.4, 0), (2, -1.6))),
    ("red", "low", AT_HOME, (-2.4, -1.4)),
    ("red", "high", AT_HOME, (-2.4, 1.4)),
    ("blue", "high", AT_HOME, (2.4, 1.4)),
]
STARTS = [("red1", (1, 0)), ("blue2", (-1, 0)), ("red1", (0, 0)), ("blue1", (0, 0)), ("red1", (-6.5, 0))]
NARROW = {"length": 2.0, "width": 8.0, "home_reach": 1.2, "red": {"home": "low", "flag": (-0.5, 2.0)}}
REFUSED: list[tuple[str, list[Contestant], dict[str, Any]]] = [
    *((told.format(team), contestants(), {team: {"home": home, "flag": flag}}) for team, home, told, flag in SIDES),
    *((f"the start of {name} in the half of its team", contestants(moved={name: to}), {}) for name, to in STARTS),
    ("at least one player of the team blue", contestants(4, 0), {}),
    ("at least one player of the team red", contestants(0, 4), {}),
    ("home", contestants(), {"home_reach": 3.5}),
    ("home", contestants(), NARROW),
    ("flag_zone of at least the flag_reach", contestants(), {"flag_reach": 0.6, "flag_zone": 0.5}),
    (r"two robots touch when their centres are 0.50 m apart.*tag distance of 0.30 m", contestants(), {"scale": 1.0}),
]


@pytest.mark.parametrize(("told", "players", "settings"), REFUSED)
def test_a_match_that_cannot_be_played_is_refused(
    told: str, players: list[Contestant], settings: dict[str, Any]
) -> None:
    with pytest.raises(ConfigError, match=told):
        RoboFlag(Settings.model_validate(settings), players)


def test_flag_zones_may_touch_the_borders_of_their_half() -> None:
    for x in (-2.5, -0.5):
        side = {"home": "low", "flag": (x, 1.5)}
        assert RoboFlag(Settings.model_validate({"red": side}), contestants())


def test_every_reason_is_given_at_once() -> None:
    with pytest.raises(ConfigError) as error:
        RoboFlag(
            Settings.model_validate({"scale": 1.0, "red": {"home": "low", "flag": (2.0, 0.0)}, "flag_reach": 0.8}),
            contestants(4, 1, moved={"red1": (1.0, 0.0)}),
        )
    told = str(error.value)
    for reason in ("two robots touch", "flag zone of the team red", "flag_reach", "the start of red1"):
        assert reason in told


def test_settings_that_make_no_sense_are_refused() -> None:
    changes: list[dict[str, Any]] = [
        {"scale": 0},
        {"scale": -1},
        {"scale": math.nan},
        {"scale": math.inf},
        {"tag_distance": 0},
        {"round_time": 0},
        {"sudden_death": -1},
        {"captures": 0},
        {"red": {"home": "left", "flag": (-2, 0)}},
        {"red": {"home": "low"}},
        {"red": {"home": "low", "flag": (-2, math.nan)}},
        {"lineup": "fly"},
        {"green": {"home": "low", "flag": (-2, 0)}},
    ]
    wrong = []
    for changed in changes:
        with suppress(ValidationError):
            Settings.model_validate(changed)
            wrong.append(str(changed))
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(("centre", "home"), CORNERS)
def test_a_field_with_a_corner_at_the_origin_can_be_played(centre: tuple[int, int], home: str) -> None:
    x, y = centre
    moved = {"red1": (x - 1.5, y), "blue1": (x + 1.5, y)}
    sides = {"red": {"home": home, "flag": (-2, 0)}, "blue": {"home": home, "flag": (2, 0)}}
    assert RoboFlag(Settings.model_validate({"centre": centre, **sides}), contestants(1, 1, moved=moved))
