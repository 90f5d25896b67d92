"""The kinds of processes: each is described once, also one of another package."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.kinds import BY_PROCESS, COMMANDER, KINDS, ROUTER, SPECTATOR, Kind
from vrg.launch.plan import planned, processes_at, window_of
from vrg.launch.process import Process
from vrg.registry import load_object
from vrg.testing.command_line import command_line


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [
        ("player", "ann", ["player.ann"]),
        ("coordinator", "", ["referee"]),
        ("world", "", ["world"]),
        ("recorder", "", ["recorder"]),
        ("router", "", ["router"]),
        ("spectator", "window", ["official", "window"]),
        ("tracker", "overhead", ["tracker"]),
        ("commander", "red", ["commander.red"]),
    ],
)
def test_a_process_may_take_these_seats(kind: str, name: str, expected: list[str]) -> None:
    assert [str(seat) for seat in KINDS.get(kind).seats_of(name)] == expected


@pytest.mark.parametrize("name", KINDS.names())
def test_a_process_of_each_kind_can_be_started_by_hand(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = command_line(monkeypatch, capsys)("node", name, "--help")
    assert done.status == 0
    kind = KINDS.get(name)
    for target in filter(None, (kind.node, kind.command, kind.runner)):
        load_object(target)


def test_each_process_of_a_match_is_of_a_kind() -> None:
    setup = load_match(match_path("sharks-and-minnows"))
    views = [Process(name="web", kind="web")]
    assert [process.kind for process in planned(setup, window=True, record=True, views=views)] == [
        "router", "world", "coordinator", "recorder", "spectator", "web", *["player"] * len(setup.players)
    ]  # fmt: skip
    assert BY_PROCESS["router"] is ROUTER


@pytest.mark.parametrize(
    ("window", "expected"), [("spectator", (SPECTATOR, "window")), ("commander", (COMMANDER, "red"))]
)
def test_a_game_names_the_window_that_is_opened(
    monkeypatch: pytest.MonkeyPatch, window: str, expected: tuple[Kind, str]
) -> None:
    game, setup = GAMES.get("roboflag"), load_match(match_path("roboflag"))
    assert game.window == "spectator"
    monkeypatch.setattr("vrg.launch.plan.game_of", lambda _: replace(game, window=window))
    assert window_of(setup) == expected
    found = {process.name: process.of for process in planned(setup, window=True, record=False)}
    assert found[SPECTATOR.process] is expected[0]


@pytest.mark.parametrize(
    ("window", "said"),
    [
        ("web", "game roboflag: window: expected the kind of a window, got 'web'"),
        ("player", "game roboflag: window: expected the kind of a window, got 'player'"),
        ("hud", "got 'hud', which the package virtual-robotic-games-views adds: run `make setup`"),
        ("spektator", "did you mean 'spectator'?"),
    ],
)
def test_what_is_no_window_is_refused(monkeypatch: pytest.MonkeyPatch, window: str, said: str) -> None:
    game, setup = GAMES.get("roboflag"), load_match(match_path("roboflag"))
    monkeypatch.setattr("vrg.registry.added", dict)
    monkeypatch.setattr(KINDS, "_found", {})
    monkeypatch.setattr("vrg.launch.plan.game_of", lambda _: replace(game, window=window))
    with pytest.raises(ConfigError, match=re.escape(said)):
        window_of(setup)


def test_a_match_without_a_window_does_not_need_the_kind_that_its_game_opens(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    game, setup = GAMES.get("roboflag"), load_match(match_path("roboflag"))
    monkeypatch.setattr("vrg.launch.plan.game_of", lambda _: replace(game, window="nowhere"))
    found = processes_at(setup, tmp_path, "tcp/127.0.0.1:7447", window=False, record=True)
    assert "spectator" not in {spec.name for spec in found}
    with pytest.raises(ConfigError, match="nowhere"):
        processes_at(setup, tmp_path, "tcp/127.0.0.1:7447", window=True, record=True)
