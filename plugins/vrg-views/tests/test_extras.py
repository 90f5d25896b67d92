"""A view whose extra is not installed says what to install, and takes nothing else with it."""

import sys

import pytest

from vrg.testing.command_line import Vrg

THREE = (
    "3d cannot be shown: the package viser is not installed, and this needs it: "
    "pip install 'virtual-robotic-games-views[three]'"
)
FOXGLOVE = (
    "foxglove cannot be shown: the package foxglove-sdk is not installed, and this needs it: "
    "pip install 'virtual-robotic-games-views[foxglove]'"
)
PAGE = "the package aiohttp is not installed, and this needs it: pip install 'virtual-robotic-games[web]'"


@pytest.fixture
def vrg(vrg: Vrg, monkeypatch: pytest.MonkeyPatch) -> Vrg:
    """The command line where no extra is installed."""
    for module in ("aiohttp", "foxglove", "segno", "viser"):
        monkeypatch.setitem(sys.modules, module, None)
    return vrg


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("play sharks-and-minnows --headless --3d", THREE),
        ("play sharks-and-minnows --headless --show 3d", THREE),
        ("show 3d", THREE),
        ("node three", THREE),
        ("run replay --3d", THREE),
        ("play sharks-and-minnows --headless --foxglove", FOXGLOVE),
        ("show foxglove", FOXGLOVE),
        ("node foxglove", FOXGLOVE),
        ("play sharks-and-minnows --headless --developer", PAGE),
        ("show developer", PAGE),
    ],
)
def test_each_door_to_a_view_names_the_extra_that_is_missing(vrg: Vrg, typed: str, said: str) -> None:
    done = vrg(*typed.split())
    assert done.status == 1
    assert said in done.err
    assert len(done.err.splitlines()) == 1


def test_the_help_pages_and_the_other_views_need_no_extra(vrg: Vrg) -> None:
    assert "--3d" in vrg("play", "--help").out
    assert {"3d", "foxglove", "developer", "hud"} <= set(vrg("show").out.split())
    assert vrg("show", "hud", "--help").status == 0
    assert vrg("play", "hud", "--headless", "--dry-run").status == 0
