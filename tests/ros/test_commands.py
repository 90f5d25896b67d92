"""A match in ROS 2 on the command line: where it is, and what is to be said about it."""

import os
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from vrg.bus.session import Session, joined
from vrg.commands.ros import BESIDE, ros_address, ros_place, typed_domain, undriven
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import BusError, ConfigError
from vrg.launch import running
from vrg.launch.nodes.ros import ros_node
from vrg.launch.running import RunningMatch, registered

EXAMPLES = Path(__file__).parents[2] / "examples"


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
        with pytest.raises(ConfigError, match="--to: expected a router such as"):
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


def test_what_shows_a_match_of_this_machine_ends_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(running, "LOOK", 0.0)
    match = RunningMatch("m", "tcp/127.0.0.1:1", str(tmp_path), os.getpid())
    with registered(match):
        has_ended = running.gone(match.match, match.router)
        elsewhere = running.gone("other", match.router)
        assert not has_ended()
    with registered(replace(match, pid=match.pid + 1)):
        assert has_ended(), "another match of that name has begun there"
    assert not elsewhere()


def test_players_that_nothing_drives_are_named(stand_in: MatchSetup) -> None:
    assert undriven(stand_in) == ["bot: driven by ROS 2 alone: add --ros, or run vrg show ros"]
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
