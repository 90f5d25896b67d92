"""Foxglove on the command line: its kind of process, the place that it is given, and what is started by hand."""

import socket
from pathlib import Path

import pytest

from vrg.config.loading import load_match, match_path
from vrg.errors import LaunchError
from vrg.kinds import KINDS, SPECTATOR, Opening, kind_shown
from vrg.launch.plan import processes_at
from vrg.launch.process import Process
from vrg.registry import load_object
from vrg.testing.command_line import Vrg
from vrg_views.foxglove import KIND
from vrg_views.foxglove.command import open_foxglove


def opened(typed: str | None) -> Opening:
    return open_foxglove(load_match(match_path("sharks-and-minnows")), typed, secured=False)


def test_it_is_a_kind_of_process_with_the_seats_of_a_window() -> None:
    assert KINDS.get("foxglove") is kind_shown("foxglove", "opens") is KIND
    assert [str(seat) for seat in KIND.seats_of("127.0.0.1:8765")] == ["official", "window"]
    assert KIND.pulse == SPECTATOR.name
    assert load_object(KIND.opens) is open_foxglove
    assert callable(load_object(KIND.node))


def test_in_a_match_it_is_one_process_which_may_die(tmp_path: Path) -> None:
    setup, at = load_match(match_path("sharks-and-minnows")), "127.0.0.1:8765"
    views = [Process(name=KIND.process, kind=KIND.name, node=at)]
    found = processes_at(setup, tmp_path, "tcp/h:1", window=False, record=False, views=views)
    [spec] = [spec for spec in found if spec.name == "foxglove"]
    assert spec.of is KIND
    assert not spec.essential
    assert at in repr(spec.arguments)


def test_it_listens_at_the_next_free_port_or_at_the_one_that_was_typed() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with pytest.raises(LaunchError, match=f"Foxglove's server cannot be served: port {taken} of 127.0.0.1"):
            opened(f"127.0.0.1:{taken}")
    place = opened(f"127.0.0.1:{taken}")
    assert place.name == f"127.0.0.1:{taken}"
    assert place.words("tcp/h:1").endswith(f"Foxglove WebSocket, ws://127.0.0.1:{taken}")
    host, _, port = opened(None).name.rpartition(":")
    assert (host, int(port) >= 8765) == ("127.0.0.1", True)


def test_it_can_be_started_by_hand(vrg: Vrg) -> None:
    for typed in ("show foxglove --help", "node foxglove --help"):
        done = vrg(*typed.split())
        assert done.status == 0
        assert "Foxglove" in done.out
    assert "foxglove" in vrg("show").out
