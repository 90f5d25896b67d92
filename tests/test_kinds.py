"""The kinds of processes: each is described once, also one of another package."""

import pytest

from tests.command_line import command_line
from vrg.config.loading import load_match, match_path
from vrg.kinds import BY_PROCESS, KINDS, ROUTER
from vrg.launch.specs import kind_of, placed
from vrg.registry import load_object


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [
        ("player", "ann", ["player.ann"]),
        ("coordinator", "", ["referee"]),
        ("world", "", ["world"]),
        ("recorder", "", ["recorder"]),
        ("router", "", ["router"]),
        ("spectator", "window", ["official", "window"]),
        ("hud", "ann", ["hud.ann"]),
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
    found = {name: kind_of(setup, name) for name in placed(setup, window=True, record=True, served=["web"])}
    assert [kind.name for kind in found.values() if kind is not None] == [
        "router", "world", "coordinator", "recorder", "spectator", "web", *["player"] * len(setup.players)
    ]  # fmt: skip
    assert BY_PROCESS["router"] is ROUTER
