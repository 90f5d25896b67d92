"""A match in ROS 2 on the command line: where it is, and what is to be said about it."""

import socket
from pathlib import Path

import pytest

from vrg.bus.session import Session, joined
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import BusError, ConfigError
from vrg.playing.match import undriven
from vrg.plugins import CHECKS
from vrg.testing.command_line import Vrg, command_line
from vrg.testing.processes.match import long_match
from vrg_ros import check
from vrg_ros.command import BESIDE, ros_address, ros_place, typed_domain
from vrg_ros.node import ros_node

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Vrg:
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)


@pytest.fixture
def stand_in() -> MatchSetup:
    return load_match(EXAMPLES / "stand_in.toml")


def test_the_router_is_that_of_the_match_unless_it_lets_only_seats_in() -> None:
    assert ros_address(3, None, secured=False) == "3@"
    assert ros_address(0, "tcp/lab:7447", secured=True) == "0@tcp/lab:7447"
    own = ros_address(0, None, secured=True)
    assert own.startswith("0@tcp/127.0.0.1:")
    assert int(own.rpartition(":")[2]) >= BESIDE
    for wrong in ("nonsense", "tls/127.0.0.1:7448", "tcp/127.0.0.1:99999"):
        with pytest.raises(ConfigError, match="the router of ROS nodes: expected a router such as"):
            ros_address(0, wrong, secured=False)


def test_two_matches_with_seats_have_routers_of_their_own() -> None:
    first = ros_address(0, None, secured=True).partition("@")[2]
    with joined(first):
        assert ros_address(0, None, secured=True).partition("@")[2] != first


@pytest.mark.parametrize("wrong", ["abc", "-1", "233", "1.5"])
def test_a_wrong_domain_is_refused(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", wrong)
    with pytest.raises(ConfigError, match="ROS_DOMAIN_ID: expected a whole number from 0 to 232"):
        typed_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    assert typed_domain() == 0


def test_the_place_of_a_match_has_what_ros_nodes_need(stand_in: MatchSetup) -> None:
    usual = ros_place(stand_in, "0@", "tcp/127.0.0.1:7447")
    assert usual == "in ROS 2: /stand_in, domain 0, router tcp/127.0.0.1:7447; cmd_vel drives bot"
    other = ros_place(stand_in, "4@tcp/0.0.0.0:7448", "tls/127.0.0.1:7447", drives=False)
    assert "a window's keys drive no player" in other
    assert """export ZENOH_CONFIG_OVERRIDE='mode="client";connect/endpoints=["tcp/ADDRESS:7448"]'""" in other


def test_players_that_nothing_drives_are_named(stand_in: MatchSetup) -> None:
    assert undriven(stand_in) == ["bot: driven only by `vrg show ros`: run that, or play with --show ros"]
    assert undriven(stand_in, ["ros"]) == []
    assert undriven(load_match(EXAMPLES / "turtlebot.toml")) == []


def test_the_seat_of_a_window_drives_no_player(
    stand_in: MatchSetup, caplog: pytest.LogCaptureFixture, session: Session
) -> None:
    ros_node(stand_in, "0@", lambda _: session, name="ros", official=False)
    assert not [token for token in session.alive("@ros2_lv/0/**") if "%cmd_vel" in token]
    assert "a window's keys drive no player: cmd_vel of bot needs those of the official" in caplog.text
    ros_node(stand_in, "0@", lambda _: session, name="other")
    assert [token for token in session.alive("@ros2_lv/0/**") if "%cmd_vel" in token]


def test_players_whose_names_are_the_same_in_ros_are_refused(session: Session, tmp_path: Path) -> None:
    text = (EXAMPLES / "turtlebot.toml").read_text(encoding="utf-8")
    file = tmp_path / "alike.toml"
    file.write_text(text.replace("player3", "ann-1").replace("player4", "ann_1"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"where ann-1, ann_1 are the same"):
        ros_node(load_match(file), "0@", lambda _: session, name="ros")


def test_a_router_that_is_nowhere_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        wanted = f"expected a router at {endpoint}, or an address and a free port"
        with pytest.raises(BusError, match=wanted), joined(endpoint):
            pass


def test_a_robot_that_runs_ros_may_be_virtual_in_a_trial(tmp_path: Path) -> None:
    text = (EXAMPLES / "turtlebot.toml").read_text(encoding="utf-8")
    file = tmp_path / "match.toml"
    file.write_text(text.replace('backend = "ros"', 'backend = "ros"\nlocalisation = "feed"'), encoding="utf-8")
    assert load_match(file).physical == ["player2"]
    setup = load_match(file, virtual=True)
    assert setup.physical == setup.companions == setup.fused == []
    file.write_text(setup.text, encoding="utf-8")
    assert load_match(file).players == setup.players, "so it is kept with the run"


def test_the_command_line_has_it_all(vrg: Vrg) -> None:
    for typed in ("show ros --help", "node ros --help"):
        done = vrg(*typed.split())
        assert done.status == 0
        assert "ROS 2" in done.out
    assert "ros" in vrg("show").out
    said = vrg("check", str(EXAMPLES / "stand_in.toml"))
    assert said.status == 0
    assert "note: bot: driven only by `vrg show ros`" in said.out
    for typed in ("--ros", "--show=ros"):
        done = vrg("play", "sharks-and-minnows", "--in-process", typed)
        assert done.status == 2
        assert f"{typed.partition('=')[0]} needs the bus" in done.err


def test_a_player_may_have_the_name_of_the_view_but_not_beside_it(vrg: Vrg, tmp_path: Path) -> None:
    (tmp_path / "match.toml").write_text(long_match("m").replace('"ann"', '"ros"'), encoding="utf-8")
    assert vrg("check", "match.toml").status == 0
    done = vrg("play", "match.toml", "--ros", "--headless")
    assert done.status == 1
    assert "--show ros: its process has the name of the player ros: rename that one" in done.err
    done = vrg("run", "replay", "--show", "ros")
    assert done.status == 1
    assert "a view of the match: expected one of " in done.err


def test_the_doctor_looks_for_nodes_of_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "running", list)
    monkeypatch.setenv("ROS_DOMAIN_ID", "300")
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert CHECKS.get("ros") is check.check
    found = check.check()
    assert (found.what, found.good) == ("ROS 2", None)
    assert "expected a whole number from 0 to 232, got '300'" in found.text
    assert "use Jazzy or later" in found.text
