"""Match files: everything wrong is said at once, with file, line and field."""

import importlib
import stat
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from vrg.config.loading import check_strategies, load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import NOISE, RULES, MatchSetup, radio_seed, read_setup, team_seed, write_setup
from vrg.errors import ConfigError, LaunchError
from vrg.games import GAMES
from vrg.hal.backends import BACKENDS
from vrg.hal.models import MODELS
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sim.map import load_map
from vrg.launch.strategy_class import strategy_of
from vrg.runs.run_folder import RunFolder
from vrg.testing.tiny import forms

GOOD = (
    match_path("sharks-and-minnows-table-4-2")
    .read_text(encoding="utf-8")
    .replace('name = "table-4-2"', 'name = "courtyard"')
    .replace('map = "courtyard"\n', 'map = "courtyard"\nengine = "pybullet"\n')
)


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


def but(*changes: tuple[str, str], text: str = GOOD) -> str:
    """The match of the thesis with other words."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def with_tables(tables: str, own: str = "") -> str:
    """The match of the thesis with further tables, from line 17, and with fields of the first player, from line 24."""
    place = GOOD.index("[[players]]")
    second = GOOD.index("[[players]]", place + 1)
    return GOOD[:place] + tables + GOOD[place:second] + own + GOOD[second:]


MINE = with_tables("", 'strategy = "mine.py:Spinner"\n')
WIRED = GOOD + '\n[backends.can]\nchannel = "can0"\n[backends.can.robots.player1]\nleft = [0]\nright = [1]\n'
CAN_SHARK = ('role = "shark"', 'role = "shark"\nbackend = "can"')
FIRST_AT = "x = 21.0\ny = -30.0"
LINK = "[[radio.links]]\nbetween = ['player1', {}]\n"


def test_one_table_where_a_list_of_them_belongs_is_told_by_its_brackets(load: Load) -> None:
    found = problems(load, with_tables('[bodies]\nname = "ball"\n'))
    assert found == ["17: bodies: expected any number of tables, got one: write [[bodies]] with two brackets"]


def test_the_match_of_the_thesis_is_good(load: Load) -> None:
    setup = load(GOOD)
    assert [p.name for p in setup.players] == [f"player{i}" for i in range(1, 8)]
    assert rulebook_of(setup).rounds == 2
    assert setup.player("player1").pose.theta == pytest.approx(1.5708, abs=1e-4)
    assert tuple(setup.obstacles) == load_map("courtyard").obstacles
    assert len(setup.obstacles) > 10


KNOWN = ", ".join(BACKENDS.names())
WRONG = {
    "8: sed: unknown field, did you mean 'seed'?": but(("seed = 0", "sed = 0")),
    "15: rules.zone_dept: unknown field, did you mean 'zone_depth'?": but(("zone_depth", "zone_dept")),
    "24: players.1.colour: unknown field": with_tables("", 'colour = "red"\n'),
    "24: players.1.modle: unknown field, did you mean 'model'?": with_tables("", 'modle = "P2AT"\n'),
    "24: not TOML: Cannot declare ('players',) twice (at line 24, column 9): write [[players]] for each of several": (
        GOOD.replace("[[players]]", "[players]")
    ),
    "24: players.2.name: missing": but(('name = "player2"\n', "")),
    "1: map: missing": but(('map = "courtyard"\n', "")),
    "1: players: missing": GOOD[: GOOD.index("[[players]]")],
    "66: not TOML": GOOD + "\n[[players]\n",
    "6: map: expected one of courtyard, marhes_lab, ": but(('"courtyard"\nengine', '"atlantis"\nengine')),
    "7: engine: expected one of mujoco, planar, pybullet, got 'warp'": but(('"pybullet"', '"warp"')),
    f"5: game: expected one of {', '.join(GAMES.names())}, got 'chess'": but(('"sharks-and-minnows"', '"chess"')),
    "8: rate: expected at least 0.1, got 0.0": but(("seed = 0", "rate = 0.0")),
    "10: rules: x: expected the low border first": but(("x = [16.0, 26.0]", "x = [26.0, 16.0]")),
    "19: players.1.role: expected one of shark, minnow, got 'whale'": but(('"shark"', '"whale"')),
    f"24: players.1.backend: expected one of {KNOWN}, got 'steam'": with_tables("", 'backend = "steam"\n'),
    "24: players.1.model: expected one of ATRV-Jr, ": with_tables("", 'model = "R2D2"\n'),
    "24: players.1.camera: expected true or false, got 3": with_tables("", "camera = 3\n"),
    "24: players.1.localisation: a virtual robot has fusion or none": with_tables("", 'localisation = "feed"\n'),
    "24: players.1.strategy: expected one of aggressive, ": with_tables("", 'strategy = "Nobody"\n'),
    "24: players.1.strategy: mine.py:Spinner: no such file": MINE,
    "18: players.1.name: expected 1 to 64 letters": but(('"player1"', '"player 1"')),
    "25: players.2.name: player1: expected a name of its own, got one that is taken": but(('"player2"', '"player1"')),
    "38: players.4: expected room between player4 and player5": but(("x = 21.5\ny = -16.0", "x = 21.2\ny = -15.5")),
    "17: players.1: player1 starts at (21, -33), out of bounds": but((FIRST_AT, "x = 21.0\ny = -33.0")),
    "17: players.1: player1 is a shark and starts in the zone": but((FIRST_AT, "x = 21.0\ny = -20.0")),
    "17: players.1: player1: expected a pose inside map courtyard": but((FIRST_AT, "x = 2100.0\ny = -30.0")),
    "20: players.1.x: expected a finite number, got nan": but((FIRST_AT, "x = nan\ny = -30.0")),
    "24: players.2: player2 is a minnow and starts": but(
        ('"player1"', '"shark"'), ("x = 17.0\ny = -16", "x = 17.0\ny = -20")
    ),
    "20: players.1.backend: expected a table [backends.can], found none": but(CAN_SHARK),
    "67: backends.can: expected a table [backends.can.robots.player1]": but(
        CAN_SHARK, ("robots.player1", "robots.player9"), text=WIRED
    ),
    "66: backends.can: robots.player1: node id of odrive: expected 0 to 62": but(
        ("left = [0]", "left = [99]"), text=WIRED
    ),
    "66: backends.sim: this backend has no settings": GOOD + "\n[backends.sim]\nx = 1\n",
    f"66: backends.steam: backend: expected one of {KNOWN}, got 'steam'": GOOD + "\n[backends.steam]\nx = 1\n",
    "17: sensors.lasor: expected one of altimeter": with_tables("[sensors.lasor]\nnoise = 1.0\n"),
    "18: sensors.laser.nose: expected one of beams": with_tables("[sensors.laser]\nnose = 1.0\n"),
    "18: sensors.laser.noise: expected a number of at least 0": with_tables("[sensors.laser]\nnoise = -1.0\n"),
    "17: sensors.sonar: expected range_min of at most range_max": with_tables("[sensors.sonar]\nrange_max = 0.01\n"),
    "18: sensors.laser: expected a table, got 3": with_tables("[sensors]\nlaser = 3\n"),
    "24: players.1.sensors.laser.rate: expected a number above 0": with_tables("", "sensors.laser.rate = -1\n"),
    "25: players.1.sensors.laser.nose: expected one of": with_tables("", "[players.sensors.laser]\nnose = 2\n"),
    "24: players.1.sensors.compass: expected one of": with_tables("", "[players.sensors.compass]\nrate = 2\n"),
    "25: players.1.sensors.sonar: expected a sensor that the robot ATRV-Jr has": with_tables(
        "", 'model = "ATRV-Jr"\n[players.sensors.sonar]\nrate = 2.0\n'
    ),
    "24: players.1.sensors.sonar: expected range_min of": with_tables("", "[players.sensors.sonar]\nrange_min = 6.0\n"),
    "18: radio.loss: expected at most 1, got 1.5": with_tables("[radio]\nloss = 1.5\n"),
    "18: radio.range: expected more than 0": with_tables("[radio]\nrange = 0.0\n"),
    "18: radio.delay: expected at least 0": with_tables("[radio]\ndelay = -0.1\n"),
    "18: radio.bandwidth: expected more than 0": with_tables("[radio]\nbandwidth = 0\n"),
    "18: radio.waves: unknown field": with_tables("[radio]\nwaves = 3\n"),
    "18: radio.links.1.between: expected a player of this match, got 'nobody'": with_tables(LINK.format("'nobody'")),
    "18: radio.links.1.between: expected two players, got 'player1' twice": with_tables(LINK.format("'player1'")),
    "20: radio.links.2.between: the link between": with_tables(LINK.format("'player2'") * 2),
}
"""The one thing that is told of each of these match files, with its line."""


@pytest.mark.parametrize(("told", "text"), WRONG.items(), ids=WRONG)
def test_a_mistake_is_told_once_with_its_line_before_any_code_of_players_is_loaded(
    tmp_path: Path, told: str, text: str
) -> None:
    (tmp_path / "match.toml").write_text(text, encoding="utf-8")
    [found] = problems(lambda _: load_match(tmp_path / "match.toml"), text)
    assert found.startswith(told)


def test_all_problems_are_told_at_once_in_the_order_of_the_file(load: Load) -> None:
    text = with_tables("[sensors.laser]\nnoise = -1\n", "[players.sensors.gps]\nrate = 0\n")
    changes = [("seed = 0", "seed = -1"), ("x = 19.0", 'x = "far"\ncamera = 3'), ("zone_depth = 4", "zone_depth = 40")]
    changes.append(('name = "player2"', 'name = "player2"\nmachine = "lab"\nstrategy = "nowhere.py:X"'))
    found = [p.split(": ")[:2] for p in problems(load, but(*changes, text=text))]
    assert found == [
        ["8", "seed"], ["10", "rules"], ["18", "sensors.laser.noise"], ["27", "players.1.sensors.gps.rate"],
        ["30", "players.2.machine"], ["31", "players.2.strategy"], ["40", "players.3.x"], ["41", "players.3.camera"],
    ]  # fmt: skip
    found = problems(load, but(('role = "minnow"', 'role = "shark"')))
    assert "expected at least two minnows more than sharks" in found[0]
    assert len(found) == 7
    found = problems(load, but(("left = [0]", "lift = [0]"), text=WIRED))
    assert [p.split(": ")[1] for p in found] == [f"backends.can.robots.player1.{key}" for key in ("axes", "lift")]


@pytest.mark.parametrize("engine", [None, "planar"])
def test_a_kept_match_keeps_its_engine_where_another_is_the_default(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str | None
) -> None:
    monkeypatch.setattr("vrg.hal.sim.engines.default_engine", lambda: "pybullet")
    here, kept = load_match(match_path("sharks-and-minnows"), engine=engine), tmp_path / "match.toml"
    kept.write_text(here.text)
    monkeypatch.setattr("vrg.hal.sim.engines.default_engine", lambda: "mujoco")
    assert load_match(kept).engine == here.engine == (engine or "pybullet")
    assert load_match(kept).text == here.text


def test_the_command_line_overrides_and_the_text_says_so(tmp_path: Path) -> None:
    setup = load_match(match_path("sharks-and-minnows"), engine="planar", seed=7, rate=2.5, lasers=None)
    assert (setup.engine, setup.seed, setup.rate) == ("planar", 7, 2.5)
    for line in ('engine = "planar"', "seed = 7", "rate = 2.5"):
        assert line in setup.text.splitlines()
    assert 'engine = "pybullet"' not in setup.text
    with pytest.raises(ConfigError, match="seed"):
        load_match(match_path("sharks-and-minnows"), seed=-3)
    (tmp_path / "match.toml").write_text(but(("zone_depth", "zone_dept")))
    with pytest.raises(ConfigError, match=r"match.toml:15: rules.zone_dept"):
        load_match(tmp_path / "match.toml", rate=2.0)


FORMS = forms(GOOD)


@pytest.mark.parametrize("text", FORMS.values(), ids=FORMS)
def test_what_is_good_in_any_form_of_toml_can_be_played_with_other_values(tmp_path: Path, text: str) -> None:
    path = tmp_path / "match.toml"
    path.write_text(text, encoding="utf-8")
    plain, setup = load_match(path), load_match(path, seed=7, engine="planar", rate=2.5)
    assert (setup.seed, setup.engine, setup.rate) == (7, "planar", 2.5)
    path.write_text(setup.text, encoding="utf-8")
    again = load_match(path)
    assert (again.seed, again.engine, again.rate, again.rules) == (7, "planar", 2.5, plain.rules)


def test_one_word_makes_a_robot_physical_in_the_world_and_keeps_it_in_real_time(load: Load) -> None:
    text = but(("seed = 0", "seed = 0\nrate = 4.0"), text=WIRED)
    virtual, mixed = load(text), load(but(CAN_SHARK, text=text))
    assert (virtual.physical, virtual.world.rate) == ([], 4.0)
    assert (mixed.physical, mixed.world.rate) == (["player1"], 1.0)
    assert [robot.physical for robot in mixed.world.robots] == [True] + [False] * 6
    assert mixed.companions == []
    emulated = load(but(CAN_SHARK, ("[backends.can]\n", "[backends.can]\nemulate = true\n"), text=WIRED))
    assert [c.name for c in emulated.companions] == ["drives"]
    assert mixed.roster.fed == (), "only a robot that has a feed is located by a tracker"
    assert load(but((CAN_SHARK[0], f'{CAN_SHARK[1]}\nlocalisation = "feed"'), text=WIRED)).roster.fed == ("player1",)


STRATEGY = """
from neighbour import SPEED
from vrg.types import Twist
from vrg.agents.strategy import Strategy

class Spinner(Strategy):
    def act(self, view):
        return Twist(0.0, SPEED)

class NoStrategy:
    pass
"""


def test_a_players_own_strategy_may_have_the_name_of_a_library_and_neighbours(load: Load, tmp_path: Path) -> None:
    (tmp_path / "queue.py").write_text(STRATEGY)
    (tmp_path / "neighbour.py").write_text("SPEED = 1.0\n")
    setup = load(MINE.replace("mine.py", "queue.py"))
    assert type(strategy_of(setup, "player1")).__name__ == "Spinner"
    assert type(strategy_of(setup, "player2")).__name__ == "SharksAndMinnowsPlayer"
    assert importlib.import_module("queue").Queue


@pytest.mark.parametrize(
    ("target", "told"),
    [
        ("bad.py:Spinner", "nothing_of_this_name"),
        ("nowhere:Nobody", "nowhere:Nobody: cannot"),
        ("queue.py:NoStrategy", "subclass of"),
    ],
)
def test_what_cannot_be_loaded_or_is_no_strategy_is_told_before_anything_starts(
    load: Load, tmp_path: Path, target: str, told: str
) -> None:
    (tmp_path / "bad.py").write_text("import nothing_of_this_name\n")
    (tmp_path / "queue.py").write_text(STRATEGY)
    (tmp_path / "neighbour.py").write_text("SPEED = 1.0\n")
    [found] = problems(load, MINE.replace("mine.py:Spinner", target))
    assert found.startswith("24: players.1.strategy: ")
    assert told in found


@pytest.mark.parametrize(
    "name",
    ["world", "referee", "recorder", "router", "spectator", "drives", "web", "router-lab2", "drives-2", "host-lab2"],
)
def test_names_of_other_processes_and_logs_are_refused(load: Load, name: str) -> None:
    [found] = problems(load, but(('name = "player3"', f'name = "{name}"')))
    assert found == f"32: players.3.name: {name!r} is the name of another process of a match"


def test_an_obstacle_in_an_end_zone_is_told_and_an_error_in_a_map_names_the_maps_own_line(
    load: Load, tmp_path: Path
) -> None:
    text = but(('map = "courtyard"', 'map = "yard.toml"'))
    yard = 'name = "yard"\nbounds = { x_min = 0.0, y_min = -40.0, x_max = 40.0, y_max = 0.0 }\n\n'
    for radius in (0.4, -0.4):
        (tmp_path / "yard.toml").write_text(f"{yard}[[circle]]\nx = 25.0\ny = -31.0\nradius = {radius}\n")
        with pytest.raises(ConfigError) as error:
            load(text)
        [told] = map(str, error.value.problems)
        if radius > 0.0:
            assert "the safe zone, x 16 to 26, y -32 to -28, must be free" in told
        else:
            assert told == f"{tmp_path / 'yard.toml'}:7: circle.1.radius: expected more than 0, got -0.4"


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
    path.write_text(MINE)
    if said:
        with pytest.raises(ConfigError, match=r"match.toml:24: players.1.strategy: mine.py:Spinner: .*" + said):
            load_match(path)
    else:
        assert load_match(path).player("player1").strategy == "mine.py:Spinner"
    assert not Path("imported").exists()


def test_what_a_player_gets_tells_no_other_number_of_the_match(load: Load, tmp_path: Path) -> None:
    setup = load(but(CAN_SHARK, text=WIRED)).with_secret("3f")
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
    assert read_setup(folder.setup) == setup.for_processes()
    assert not hasattr(setup.for_processes(), "text"), "the text of the match file stays in the match file"


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
    setup = load(but(CAN_SHARK, text=WIRED))
    write_setup(setup, tmp_path / "setup.json")
    assert read_setup(tmp_path / "setup.json") == setup.for_processes()
    (tmp_path / "setup.json").write_text("{}")
    with pytest.raises(LaunchError, match="of this release"):
        read_setup(tmp_path / "setup.json")


SENSORS = """
[sensors.laser]
noise = 0.03
drop_out = 0.1
[sensors.sonar]
rate = 2
"""


def test_sensors_are_set_for_all_robots_and_for_one(load: Load, tmp_path: Path) -> None:
    text = with_tables(SENSORS, "[players.sensors.laser]\nnoise = 0.0\nrate = 5.0\n")
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
    assert read_setup(tmp_path / "setup.json") == setup.for_processes()


def test_a_camera_takes_pictures_all_the_time_where_the_match_file_wants_it_and_the_robot_has_one(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = with_tables("[sensors.camera]\nrate = 1.0\ncolumns = 64\nrows = 48\n", "camera = true\n")
    setup = load(text)
    assert [robot.name for robot in setup.world.robots if robot.camera] == ["player1"]
    assert setup.player("player2").robot.sensor(CameraSpec) == setup.player("player1").robot.sensor(CameraSpec)
    blind = replace(MODELS.get("P2AT"), sensors=tuple(s for s in MODELS.get("P2AT").sensors if s.kind != "camera"))
    monkeypatch.setitem(MODELS._found, "P2AT", blind)
    [told] = problems(load, with_tables("", "camera = true\n"))
    assert told.endswith("players.1.camera: expected false, as the robot P2AT has no camera")


EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.mark.parametrize(
    ("file", "changed", "located"),
    [
        ("mixed.toml", ("[backends.can]", '[place]\ndrives = "here"\n[backends.can]'), {}),
        ("room.toml", ('source = "sim"', 'source = "sim"'), {"sue": "ceiling", "tom": "ceiling"}),
        ("room.toml", ('source = "sim"', 'source = "camera"'), {}),
    ],
    ids=["drives", "a simulated camera", "a camera"],
)
def test_all_robots_may_be_virtual_whatever_their_backends(
    tmp_path: Path, file: str, changed: tuple[str, str], located: dict[str, str]
) -> None:
    path = tmp_path / file
    path.write_text(but(changed, text=(EXAMPLES / file).read_text()))
    setup = load_match(path, virtual=True)
    assert setup.physical == setup.companions == []
    assert [player.name for player in setup.fused] == [*located]
    assert {*setup.localisation} == {*located.values()}
    path.write_text(setup.text)
    assert load_match(path).players == setup.players, "so it is kept with the run"
