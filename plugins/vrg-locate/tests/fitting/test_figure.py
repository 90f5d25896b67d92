"""The match in which a robot drives the figure, and the doubts for which no calibration is written."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from vrg.config.loading import read_match
from vrg.errors import ConfigError
from vrg.testing.tiny import TINY_CAN
from vrg_locate.figure import figure_match
from vrg_locate.fitting.likeness import Likeness
from vrg_locate.fitting.report import Findings, doubt_of
from vrg_locate.fitting.response import PARAMETERS, Fitted, Response

MORE = """
[machines.red]
host = "student@red"
vrg = "/home/student/vrg/.venv/bin/vrg"
[place]
eye = "red"
spectator = "red"
referee = "red"
[localisation.eye]
source = "sim"
rate = 20.0
[localisation.eye.errors.ann]
way = 0.1
[localisation.eye.errors.bob]
way = 0.2
"""


def text_of(tmp_path: Path, text: str) -> dict:
    (tmp_path / "m.toml").write_text(text)
    return tomllib.loads(figure_match(read_match(tmp_path / "m.toml"), "ann", speed=0.5, way=1.0, seconds=60.0))


def test_the_match_keeps_what_the_robot_needs(tmp_path: Path) -> None:
    own = 'name = "ann"\nlocalisation = "fusion"\nmachine = "red"\nmotion = { v_max = 0.3, a_max = 0.8 }\n'
    found = text_of(tmp_path, TINY_CAN.replace('name = "ann"\n', own) + MORE)
    (player,) = found["players"]
    assert (player["name"], player["machine"], player["backend"]) == ("ann", "red", "can")
    assert player["motion"] == {"v_max": 0.3, "a_max": 0.8}, "it is never faster than its match allows"
    assert found["machines"]["red"]["host"] == "student@red"
    assert found["place"] == {"eye": "red", "referee": "red"}
    assert found["localisation"]["eye"] == {"source": "sim", "rate": 20.0, "errors": {"ann": {"way": 0.1}}}
    assert found["rules"] == {"x": [-4.0, -2.0], "y": [3.0, 5.0], "time": 60.0}


def test_settings_that_have_the_name_of_a_player_stay(tmp_path: Path) -> None:
    text = TINY_CAN.replace('name = "bob"', 'name = "rate"').replace(
        'name = "ann"\n', 'name = "ann"\nlocalisation = "fusion"\n'
    )
    found = text_of(tmp_path, text + '[localisation.eye]\nsource = "sim"\nrate = 20.0\n')
    assert found["localisation"]["eye"]["rate"] == 20.0


def test_a_robot_that_nothing_locates_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected `localisation"):
        text_of(tmp_path, TINY_CAN)


GOOD = {"way": (0.02, 0.002), "turn": (-0.03, 0.002), "bend": (0.0, 0.005)}
FIXES = {"used": 1400, "far": 10}


def found(errors: dict = GOOD, after: float | None = 0.01) -> Findings:
    response = Response(acceleration=1.0, braking=1.0, top=0.7)
    like = None if after is None else Likeness(20, 0.1, after, {})
    return Findings(errors, Fitted(response, list(PARAMETERS), np.eye(5) * 1e-6, 40), like)


@pytest.mark.parametrize(
    ("one", "fixes", "words"),
    [
        (found(), {"used": 1300, "far": 100}, "100 of 1400 fixes were refused"),
        (found(), {"used": 1300, "turned": 100}, 'prints = "apriltag"'),
        (found(after=None), FIXES, "it has hardly moved"),
        (found(after=0.2), FIXES, "still 20.0 cm away"),
        (found(GOOD | {"way": (-0.9, 0.01)}), FIXES, "ways longer by, % -90 +- 1, expected at most 20 +- 2"),
        (found(GOOD | {"turn": (0.0, 0.2)}), FIXES, "has it driven enough?"),
        (Findings(GOOD, "it was not recorded", None), FIXES, "it was not recorded"),
    ],
)
def test_what_is_not_known_well_is_not_written(one: Findings, fixes: dict[str, int], words: str) -> None:
    assert words in str(doubt_of(one, fixes))
    assert doubt_of(found(), FIXES) is None
