"""Match files: everything wrong is said at once, with file, line and field."""

import importlib
import json
import re
import stat
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from vrg.config.loading import check_strategies, load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import NOISE, RULES, MatchSetup, radio_seed, read_setup, team_seed, write_setup
from vrg.errors import ConfigError, LaunchError
from vrg.evaluation.contenders import teams_of
from vrg.evaluation.experiment import written
from vrg.hal.models import MODELS
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sim.map import load_map
from vrg.launch.nodes import strategy_of
from vrg.launch.run_folder import RunFolder

GOOD = match_path("sharks-and-minnows").read_text(encoding="utf-8")


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str], MatchSetup]:
    def write_and_load(text: str) -> MatchSetup:
        path = tmp_path / "match.toml"
        path.write_text(text, encoding="utf-8")
        setup = load_match(path)
        check_strategies(setup, strategy_of)
        return setup

    return write_and_load


Load = Callable[[str], MatchSetup]


def problems(load: Load, text: str) -> list[str]:
    with pytest.raises(ConfigError) as error:
        load(text)
    return [str(p).split("match.toml:")[1] for p in error.value.problems]


def test_the_match_of_the_thesis_is_good(load: Load) -> None:
    setup = load(GOOD)
    assert [p.name for p in setup.players] == [f"player{i}" for i in range(1, 8)]
    assert rulebook_of(setup).rounds == 2
    assert setup.player("player1").pose.theta == pytest.approx(1.5708, abs=1e-4)


def test_an_unknown_key_is_told_with_its_line(load: Load) -> None:
    assert problems(load, GOOD.replace("seed = 0", "sed = 0")) == ["8: sed: unknown field, did you mean 'seed'?"]
    assert problems(load, GOOD.replace('role = "shark"', 'role = "shark"\ncolour = "red"')) == [
        "20: players.1.colour: unknown field"
    ]
    assert problems(load, GOOD.replace("zone_depth", "zone_dept")) == [
        "15: rules.zone_dept: unknown field, did you mean 'zone_depth'?"
    ]


def test_what_is_missing_is_told_at_its_table(load: Load) -> None:
    assert problems(load, GOOD.replace('name = "player2"\n', "")) == ["24: players.2.name: missing"]
    assert problems(load, GOOD.replace('map = "courtyard"\n', "")) == ["1: map: missing"]


def test_all_problems_are_told_at_once_in_the_order_of_the_file(load: Load) -> None:
    text = GOOD.replace("seed = 0", "seed = -1").replace("x = 19.0", 'x = "east"')
    text = text.replace("zone_depth = 4.0", "zone_depth = 40.0")
    found = problems(load, text)
    assert [int(p.split(":")[0]) for p in found] == sorted(int(p.split(":")[0]) for p in found)
    assert [p.split(": ")[1] for p in found] == ["seed", "rules", "players.3.x"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('map = "courtyard"', 'map = "atlantis"', "atlantis"),
        ('engine = "pybullet"', 'engine = "warp"', "expected one of"),
        (
            'game = "sharks-and-minnows"',
            'game = "chess"',
            "game: expected one of hud, practice, pursuit-evasion, roboflag, sharks-and-minnows, got",
        ),
        ('role = "shark"', 'role = "whale"', "players.1.role: expected one of shark, minnow, got 'whale'"),
        ('role = "shark"', 'role = "shark"\nbackend = "steam"', "players.1.backend: expected one of"),
        ('role = "shark"', 'role = "shark"\nmodel = "R2D2"', "players.1.model: expected one of"),
        ('role = "shark"', 'role = "shark"\nstrategy = "nowhere:Nobody"', "players.1.strategy: nowhere:Nobody: cannot"),
        (
            'role = "shark"',
            'role = "shark"\nstrategy = "Nobody"',
            "or `module:Class`, `file.py:Class`, or the file of a policy",
        ),
        ('name = "player1"', 'name = "player 1"', "players.1.name: expected 1 to 64 letters"),
        ('name = "player2"', 'name = "player1"', "player1"),
        ("x = 21.5\ny = -16.0", "x = 21.2\ny = -15.5", "overlap"),
        ("x = 21.0\ny = -30.0", "x = 21.0\ny = -33.0", "out of bounds"),
        ("x = 21.0\ny = -30.0", "x = 21.0\ny = -20.0", "starts in the zone"),
        ("x = 21.0\ny = -30.0", "x = 2100.0\ny = -30.0", "player1"),
        ("x = 21.0\ny = -30.0", "x = nan\ny = -30.0", "finite"),
        ('role = "minnow"', 'role = "shark"', "at least two minnows more than sharks"),
        ("seed = 0", "rate = 0.0", "rate: "),
        ("x = [16.0, 26.0]", "x = [26.0, 16.0]", "low border first"),
    ],
)
def test_set_ups_that_cannot_be_played_are_refused(load: Load, old: str, new: str, told: str) -> None:
    assert old in GOOD
    found = problems(load, GOOD.replace(old, new))
    assert any(told in p for p in found), found
    assert all(p.split(":")[0].isdigit() for p in found), "every problem has its line"


def test_what_is_wrong_with_a_player_is_told_at_that_player_beside_others_with_mistakes(load: Load) -> None:
    text = GOOD.replace('role = "shark"', 'role = "shark"\ncamera = 3')
    text = text.replace('name = "player2"', 'name = "player2"\nmachine = "lab"')
    assert problems(load, text) == [
        "20: players.1.camera: expected true or false, got 3",
        "27: players.2.machine: expected one of here, got 'lab'",
    ]


def test_what_is_no_toml_is_told_with_its_line(load: Load) -> None:
    assert problems(load, GOOD + "\n[[players]\n")[0].startswith("66: not TOML")


def test_no_players_are_refused(load: Load) -> None:
    head = GOOD[: GOOD.index("[[players]]")]
    assert any("players: missing" in p for p in problems(load, head))


def test_a_file_or_a_game_can_be_named(tmp_path: Path) -> None:
    assert match_path("sharks-and-minnows").is_file()
    with pytest.raises(ConfigError, match="no such file"):
        match_path("nothing.toml")
    with pytest.raises(ConfigError, match="expected a match file"):
        match_path("chess")


def test_the_command_line_overrides_and_the_text_says_so() -> None:
    setup = load_match(match_path("sharks-and-minnows"), engine="planar", seed=7, rate=2.5, lasers=None)
    assert (setup.engine, setup.seed, setup.rate) == ("planar", 7, 2.5)
    for line in ('engine = "planar"', "seed = 7", "rate = 2.5"):
        assert line in setup.text.splitlines()
    assert 'engine = "pybullet"' not in setup.text


def _inline(table: dict[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }"


DATA = tomllib.loads(GOOD)
HEAD, FIRST = GOOD[: GOOD.index("[rules]")], GOOD.index("[[players]]")
FORMS = {
    "players in a list": f"{HEAD}players = [\n{','.join(map(_inline, DATA['players']))}]\n{GOOD[len(HEAD) : FIRST]}",
    "rules in one line": f"{HEAD}rules = {_inline(DATA['rules'])}\n{GOOD[FIRST:]}",
    "dotted keys": HEAD + "".join(f"rules.{k} = {json.dumps(v)}\n" for k, v in DATA["rules"].items()) + GOOD[FIRST:],
    "quoted keys": GOOD.replace("seed =", '"seed" =').replace("[[players]]", '[["players"]]'),
    "odd signs": GOOD.replace("[rules]", "secret = 'a#[b]' # \u2028[[players]]\n[rules] # \x85engine = 1"),
}


@pytest.mark.parametrize("text", FORMS.values(), ids=FORMS)
def test_what_is_good_in_any_form_of_toml_can_be_played_with_other_values(tmp_path: Path, text: str) -> None:
    path = tmp_path / "match.toml"
    path.write_text(text, encoding="utf-8")
    plain, setup = load_match(path), load_match(path, seed=7, engine="planar", rate=2.5)
    assert (setup.seed, setup.engine, setup.rate) == (7, "planar", 2.5)
    setup = written(setup, {team: f"{team}.x:Player" for team in teams_of(setup)}, "secret")
    path.write_text(setup.text, encoding="utf-8")
    again = load_match(path)
    assert (again.seed, again.engine, again.rate, again.rules) == (7, "planar", 2.5, plain.rules)
    assert {player.strategy for player in again.players} == {f"{team}.x:Player" for team in teams_of(setup)}


def test_a_physical_robot_is_in_the_world_as_one_and_keeps_it_in_real_time(load: Load) -> None:
    virtual = load(GOOD.replace("seed = 0", "seed = 0\nrate = 4.0"))
    assert (virtual.physical, virtual.world.rate) == ([], 4.0)
    can = '[backends.can]\nchannel = "vcan0"\n[backends.can.robots.player1]\nleft = [0]\nright = [1]\nratio = 50.0\n'
    text = GOOD.replace("seed = 0", "seed = 0\nrate = 4.0").replace("[rules]", f"{can}[rules]")
    mixed = load(text.replace('role = "shark"', 'role = "shark"\nbackend = "can"', 1))
    assert mixed.physical == ["player1"]
    assert mixed.world.rate == 1.0
    assert [robot.physical for robot in mixed.world.robots] == [True] + [False] * 6


def test_an_overridden_value_is_checked_too() -> None:
    with pytest.raises(ConfigError, match="seed"):
        load_match(match_path("sharks-and-minnows"), seed=-3)


STRATEGY = """
from vrg.types import Twist
from vrg.agents.strategy import Strategy

class Spinner(Strategy):
    def act(self, view):
        return Twist(0.0, 1.0)

class NoStrategy:
    pass

class Half(Strategy):
    pass
"""


def test_a_players_own_strategy_is_found_beside_the_match_file(load: Load, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(STRATEGY)
    setup = load(GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "mine.py:Spinner"'))
    assert type(strategy_of(setup, "player1")).__name__ == "Spinner"
    assert type(strategy_of(setup, "player2")).__name__ == "SharksAndMinnowsPlayer"


def test_a_file_with_an_error_in_it_is_told_before_anything_starts(load: Load, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("import nothing_of_this_name\n")
    found = problems(load, GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "mine.py:Spinner"'))
    assert "players.1.strategy" in found[0]
    assert "nothing_of_this_name" in found[0]


def test_what_is_no_strategy_is_refused(load: Load, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(STRATEGY)
    for name, told in (("NoStrategy", "subclass of"), ("Half", "expected a method `act` in this class, found none")):
        found = problems(load, GOOD.replace('role = "shark"', f'role = "shark"\nstrategy = "mine.py:{name}"'))
        assert told in found[0]


def test_a_strategy_file_may_have_the_name_of_a_library_and_neighbours(load: Load, tmp_path: Path) -> None:
    (tmp_path / "queue.py").write_text("from neighbour import SPEED\n" + STRATEGY)
    (tmp_path / "neighbour.py").write_text("SPEED = 1.0\n")
    setup = load(GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "queue.py:Spinner"'))
    assert type(strategy_of(setup, "player1")).__name__ == "Spinner"
    assert importlib.import_module("queue").Queue


def test_the_first_player_that_a_problem_names_gives_the_line(load: Load) -> None:
    """Also where a player is called like a word of the rules."""
    text = GOOD.replace('name = "player1"', 'name = "shark"').replace("x = 17.0\ny = -16.0", "x = 17.0\ny = -20.0")
    assert problems(load, text)[0].startswith("24: players.2: player2 is a minnow and starts")


@pytest.mark.parametrize("name", ["world", "referee", "recorder", "router", "spectator"])
def test_names_of_other_processes_are_refused(load: Load, name: str) -> None:
    assert any("another process" in p for p in problems(load, GOOD.replace('name = "player3"', f'name = "{name}"')))


def test_end_zones_must_be_free_of_the_maps_obstacles(load: Load, tmp_path: Path) -> None:
    (tmp_path / "yard.toml").write_text(
        'name = "yard"\n[bounds]\nx_min = 0.0\ny_min = -40.0\nx_max = 40.0\ny_max = 0.0\n'
        "[[circle]]\nx = 25.0\ny = -31.0\nradius = 0.4\n"
    )
    found = problems(load, GOOD.replace('map = "courtyard"', 'map = "yard.toml"'))
    assert len(found) == 1
    assert "the safe zone, x 16 to 26, y -32 to -28, must be free" in found[0]


def test_an_override_does_not_shift_the_lines(tmp_path: Path) -> None:
    path = tmp_path / "match.toml"
    path.write_text(GOOD.replace("zone_depth", "zone_dept"))
    with pytest.raises(ConfigError, match=r"match.toml:15: rules.zone_dept"):
        load_match(path, rate=2.0)


def test_an_unknown_player_is_answered_with_the_known_ones(load: Load) -> None:
    with pytest.raises(ConfigError, match="player1, player2"):
        load(GOOD).player("player9")


WIRED = GOOD + '\n[backends.can]\nchannel = "can0"\n[backends.can.robots.player1]\nleft = [0]\nright = [1]\n'
CAN_SHARK = ('role = "shark"', 'role = "shark"\nbackend = "can"')


def test_one_word_makes_a_robot_physical(load: Load) -> None:
    assert load(WIRED).physical == []
    mixed = load(WIRED.replace(*CAN_SHARK))
    assert mixed.physical == ["player1"]
    assert [r.physical for r in mixed.world.robots] == [True] + [False] * 6
    assert mixed.companions == []
    emulated = load(WIRED.replace(*CAN_SHARK).replace("[backends.can]\n", "[backends.can]\nemulate = true\n"))
    assert [c.name for c in emulated.companions] == ["drives"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD.replace(*CAN_SHARK), "20: players.1.backend: expected a table [backends.can], found none"),
        (WIRED.replace("robots.player1", "robots.player9").replace(*CAN_SHARK), "[backends.can.robots.player1]"),
        (WIRED.replace("left = [0]", "left = [99]"), "expected 0 to 62, got 99"),
        (WIRED.replace("left = [0]", "lift = [0]"), "backends.can.robots.player1.lift: unknown field"),
        (GOOD + "\n[backends.sim]\nx = 1\n", "backends.sim: this backend has no settings"),
        (GOOD + "\n[backends.steam]\nx = 1\n", "expected one of can, ros, sim, got 'steam'"),
        (GOOD.replace('name = "player2"', 'name = "drives"'), "name of another process"),
        (GOOD.replace('name = "player2"', 'name = "web"'), "name of another process"),
    ],
)
def test_tables_of_backends_are_checked(load: Load, text: str, words: str) -> None:
    found = problems(load, text)
    assert any(words in problem for problem in found), found


def test_a_row_of_a_long_array_is_no_table(load: Load) -> None:
    """Lines after it keep their numbers."""
    text = GOOD.replace("x = [16.0, 26.0]", "x = [\n  16.0,\n  26.0,\n]\npasses = [\n  [10, 8]\n]").replace(
        "zone_depth", "zone_dept"
    )
    found = problems(load, text)
    assert [p.split(": ")[0:2] for p in found] == [["15", "rules.passes"], ["21", "rules.zone_dept"]]


def test_an_error_in_a_map_names_the_maps_own_line(load: Load, tmp_path: Path) -> None:
    (tmp_path / "yard.toml").write_text(
        'name = "yard"\nbounds = { x_min = 0.0, y_min = -40.0, x_max = 40.0, y_max = 0.0 }\n\n'
        "[[circle]]\nx = 25.0\ny = -31.0\nradius = -0.4\n"
    )
    with pytest.raises(ConfigError) as error:
        load(GOOD.replace('map = "courtyard"', 'map = "yard.toml"'))
    assert [str(p) for p in error.value.problems] == [
        f"{tmp_path / 'yard.toml'}:7: circle.1.radius: expected more than 0, got -0.4"
    ]


def test_a_match_file_can_be_checked_without_the_players_code(tmp_path: Path) -> None:
    """So a student's import that hangs, hangs nobody but its own player."""
    (tmp_path / "mine.py").write_text("raise SystemExit\n")
    path = tmp_path / "match.toml"
    path.write_text(GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "mine.py:Spinner"'))
    assert load_match(path).player("player1").strategy == "mine.py:Spinner"


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("class Spinner(Strategy):\n    def atc(self, view): ...", "found none, did you mean 'atc'?"),
        ("class Base(Strategy): ...\nclass Spinner(Base): ...", "found none"),
        ("class Base(Strategy):\n    def act(self, view): ...\nclass Spinner(Base): ...", ""),
        ("from other import Base\nclass Spinner(Base): ...", ""),
        ("class Spinner(Strategy):\n    act = print", ""),
        ("class Spinner(", ""),
    ],
)
def test_a_class_without_act_is_told_before_anything_is_imported(tmp_path: Path, code: str, said: str) -> None:
    (tmp_path / "mine.py").write_text(f"from vrg.agents import Strategy\nopen('imported', 'w')\n{code}\n")
    path = tmp_path / "match.toml"
    path.write_text(GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "mine.py:Spinner"'))
    if said:
        with pytest.raises(ConfigError, match=r"match.toml:20: players.1.strategy: mine.py:Spinner: .*" + said):
            load_match(path)
    else:
        assert load_match(path).player("player1").strategy == "mine.py:Spinner"
    assert not Path("imported").exists()


def test_the_line_of_a_name_that_is_taken_is_told(load: Load) -> None:
    text = GOOD.replace('name = "player2"', 'name = "player1"')
    line = text[: text.rindex('name = "player1"')].count("\n") + 1
    assert f"{line}: players.2.name: player1: expected a name of its own, got one that is taken" in problems(load, text)


def test_a_strategy_file_that_is_not_there_is_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "match.toml"
    path.write_text(GOOD.replace('role = "shark"', 'role = "shark"\nstrategy = "mine.py:Spinner"'))
    with pytest.raises(ConfigError, match=r"match.toml:20: players.1.strategy: mine.py:Spinner: no such file"):
        load_match(path)


def test_only_a_physical_robot_is_localised(load: Load) -> None:
    found = problems(load, GOOD.replace('role = "shark"', 'role = "shark"\nlocalisation = "feed"'))
    assert found == ["20: players.1.localisation: a virtual robot has fusion or none"]


def test_only_the_robots_that_have_a_feed_are_located_by_a_tracker(load: Load) -> None:
    line, wired = CAN_SHARK
    assert load(WIRED.replace(line, wired)).roster.fed == ()
    assert load(WIRED.replace(line, f'{wired}\nlocalisation = "feed"')).roster.fed == ("player1",)


def test_what_a_player_gets_tells_no_other_number_of_the_match(load: Load, tmp_path: Path) -> None:
    setup = load(WIRED.replace(*CAN_SHARK)).with_secret("3f")
    folder = RunFolder(tmp_path)
    folder.hand_out(setup)
    for player in setup.players:
        got = folder.setup_of(player.name)
        assert stat.S_IMODE(got.stat().st_mode) == 0o600
        own = {team_seed(player.team), radio_seed(player.name)}
        assert read_setup(got).drawn == {purpose: setup.draw(purpose) for purpose in own}
        assert strategy_of(read_setup(got), player.name).seed == strategy_of(setup, player.name).seed
        with pytest.raises(KeyError):
            read_setup(got).draw(RULES)
        assert '"secret":""' in got.read_text()
        assert "seed = " not in got.read_text(), "the match file has the seed"
    assert read_setup(folder.setup) == setup


@given(seed=st.integers(0, 2**40), secret=st.text(max_size=16), other=st.text(max_size=16))
def test_each_purpose_and_each_secret_has_numbers_of_its_own(seed: int, secret: str, other: str) -> None:
    setup = structs.replace(load_match(match_path("sharks-and-minnows")), seed=seed)
    first, second = setup.with_secret(secret), setup.with_secret(other)
    purposes = [RULES, NOISE, team_seed("shark"), radio_seed("shark")]
    drawn = [first.draw(purpose) for purpose in purposes]
    assert len(set(drawn)) == len(purposes)
    assert all(0 <= number < 2**63 for number in drawn)
    assert (drawn == [second.draw(purpose) for purpose in purposes]) is (secret == other)
    assert first.world.seed == first.draw(NOISE)


def test_a_match_has_one_secret_even_if_its_processes_are_started_again(tmp_path: Path) -> None:
    first, second = RunFolder(tmp_path / "a"), RunFolder(tmp_path / "b")
    first.prepare()
    second.prepare()
    assert len(first.secret()) == 32
    assert RunFolder(first.path).secret() == first.secret() != second.secret()
    assert stat.S_IMODE((first.path / "secret").stat().st_mode) == 0o600


def test_the_set_up_that_processes_read_is_the_one_that_was_checked(load: Load, tmp_path: Path) -> None:
    setup = load(WIRED.replace(*CAN_SHARK))
    write_setup(setup, tmp_path / "setup.json")
    assert read_setup(tmp_path / "setup.json") == setup
    (tmp_path / "setup.json").write_text("{}")
    with pytest.raises(LaunchError, match="of this release"):
        read_setup(tmp_path / "setup.json")


def test_everything_is_told_at_once_whatever_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "match.toml").write_text(
        """name = "no good!"
game = "sharks-and-minnows"
map = "open"
seed = -1
[rules]
x = [-10.0, 10.0]
y = [-20.0, 20.0]
zone_depht = 4.0
[[players]]
name = "a"
role = "sherk"
x = 0.0
y = -19.0
[[players]]
name = "b"
role = "minnow"
x = "far"
y = 19.0
[[players]]
name = "c"
role = "minnow"
strategy = "nowhere.py:X"
x = 0.0
y = 19.0
"""
    )
    with pytest.raises(ConfigError) as caught:
        load_match(tmp_path / "match.toml")
    assert [problem.line for problem in caught.value.problems] == [1, 4, 8, 11, 17, 22]


def test_a_set_up_holds_the_walls_and_obstacles_of_its_map() -> None:
    setup = load_match(match_path("sharks-and-minnows"))
    assert tuple(setup.obstacles) == load_map("courtyard").obstacles
    assert len(setup.obstacles) > 10


SENSORS = """
[sensors.laser]
noise = 0.03
drop_out = 0.1
[sensors.sonar]
rate = 2
"""


def with_sensors(tables: str, own: str = "") -> str:
    """The match of the thesis with settings of sensors, and with settings of the first player's own."""
    place = GOOD.index("[[players]]")
    second = GOOD.index("[[players]]", place + 1)
    return GOOD[:place] + tables + GOOD[place:second] + own + GOOD[second:]


def test_sensors_are_set_for_all_robots_and_for_one(load: Load, tmp_path: Path) -> None:
    text = with_sensors(SENSORS, "[players.sensors.laser]\nnoise = 0.0\nrate = 5.0\n")
    setup = load(text.replace("x = 19.0", 'model = "ATRV-Jr"\nx = 19.0'))
    first, second, other = (player.robot.sensor(LaserSpec) for player in setup.players[:3])
    assert first is not None
    assert second is not None
    assert (first.noise, first.drop_out, first.rate) == (0.0, 0.1, 5.0)
    assert (second.noise, second.drop_out, second.rate) == (0.03, 0.1, 10.0)
    assert "sonar" not in setup.players[2].sensors, "an ATRV-Jr has no sonar"
    assert other is not None
    assert other.noise == 0.03
    assert [robot.description for robot in setup.world.robots] == [player.robot for player in setup.players]
    assert strategy_of(setup, "player1").robot == setup.players[0].robot
    write_setup(setup, tmp_path / "setup.json")
    assert read_setup(tmp_path / "setup.json") == setup


def line(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("[sensors.lasor]\nnoise = 1.0", "sensors.lasor: expected one of battery"),
        ("[sensors.laser]\nnose = 1.0", "sensors.laser.nose: expected one of beams"),
        ("[sensors.laser]\nnoise = -1.0", "sensors.laser.noise: expected a number of at least 0"),
        ("[sensors.laser]\nrate = 0", "sensors.laser.rate: expected a number above 0"),
        ("[sensors.laser]\nbeams = 2.5", "sensors.laser.beams: expected a whole number, got 2.5"),
        ("[sensors.sonar]\nrange_max = 0.01", "sensors.sonar: expected range_min of at most range_max"),
        ("[sensors]\nlaser = 3", "sensors.laser: expected a table, got 3"),
    ],
)
def test_wrong_settings_of_sensors_are_told_once_with_their_line(load: Load, wrong: str, told: str) -> None:
    text = with_sensors(wrong + "\n")
    found = problems(load, text)
    assert len(found) == 1, found
    at, _, words = found[0].partition(": ")
    assert words.startswith(told)
    field = words.partition(": ")[0].count(".") == 2 or "table" in told
    assert int(at) == line(text, wrong) + field


@pytest.mark.parametrize(
    ("own", "told"),
    [
        ("[players.sensors.laser]\ndrop_out = 2", "players.1.sensors.laser.drop_out: expected a number of at least 0"),
        ("[players.sensors.laser]\nnose = 2", "players.1.sensors.laser.nose: expected one of"),
        ("sensors.laser.rate = -1\n", "players.1.sensors.laser.rate: expected a number above 0"),
        ("[players.sensors.compass]\nrate = 2", "players.1.sensors.compass: expected one of"),
        (
            'model = "ATRV-Jr"\n[players.sensors.sonar]\nrate = 2.0',
            "players.1.sensors.sonar: expected a sensor that the robot ATRV-Jr has",
        ),
        ("[players.sensors.sonar]\nrange_min = 6.0", "players.1.sensors.sonar: expected range_min of at most"),
    ],
)
def test_wrong_settings_of_one_player_are_told_at_that_player(load: Load, own: str, told: str) -> None:
    found = problems(load, with_sensors("", own + "\n"))
    assert len(found) == 1, found
    assert found[0].partition(": ")[2].startswith(told)
    text = with_sensors("", own + "\n")
    assert line(text, own) <= int(found[0].split(":")[0]) <= line(text, own) + 2


def test_wrong_settings_of_the_match_and_of_players_are_told_at_once(load: Load) -> None:
    text = with_sensors("[sensors.laser]\nnoise = -1\n", "[players.sensors.gps]\nrate = 0\n")
    assert [p.split(": ")[1] for p in problems(load, text)] == ["sensors.laser.noise", "players.1.sensors.gps.rate"]


def test_a_camera_takes_pictures_all_the_time_where_the_match_file_wants_it(load: Load) -> None:
    setup = load(with_sensors("[sensors.camera]\nrate = 1.0\ncolumns = 64\nrows = 48\n", "camera = true\n"))
    assert [robot.name for robot in setup.world.robots if robot.camera] == ["player1"]
    assert setup.player("player2").robot.sensor(CameraSpec) == setup.player("player1").robot.sensor(CameraSpec)
    assert "camera: expected true or false" in problems(load, with_sensors("", "camera = 3\n"))[0]


def test_a_robot_without_a_camera_takes_no_pictures(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    blind = replace(MODELS.get("P2AT"), sensors=tuple(s for s in MODELS.get("P2AT").sensors if s.kind != "camera"))
    monkeypatch.setitem(MODELS._found, "P2AT", blind)
    [told] = problems(load, with_sensors("", "camera = true\n"))
    assert told.endswith("players.1.camera: expected false, as the robot P2AT has no camera")


@pytest.mark.parametrize(
    ("radio", "said"),
    [
        ("[radio]\nloss = 1.5", "radio.loss: expected at most 1, got 1.5"),
        ("[radio]\nrange = 0.0", "radio.range: expected more than 0"),
        ("[radio]\ndelay = -0.1", "radio.delay: expected at least 0"),
        ("[radio]\nbandwidth = 0", "radio.bandwidth: expected more than 0"),
        ("[radio]\nwaves = 3", "radio.waves: unknown"),
        ("[radio]\n[[radio.links]]\nbetween = ['player1', 'nobody']", "expected a player of this match, got 'nobody'"),
        ("[radio]\n[[radio.links]]\nbetween = ['player1', 'player1']", "expected two players, got 'player1' twice"),
        (
            "[radio]\n[[radio.links]]\nbetween = ['player1', 'player2']\n"
            "[[radio.links]]\nbetween = ['player2', 'player1']",
            "the link between player2 and player1 is here already",
        ),
    ],
)
def test_a_radio_that_cannot_be_is_refused_with_its_line(tmp_path: Path, radio: str, said: str) -> None:
    text = match_path("sharks-and-minnows").read_text().replace("[rules]", f"{radio}\n\n[rules]")
    path = tmp_path / "match.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as refused:
        load_match(path)
    [problem] = [str(p) for p in refused.value.problems if said in str(p)] or [str(refused.value)]
    assert said in problem
    assert re.search(r"match\.toml:1[0-9]: ", problem)
