"""The developers' view on a match of real processes: it hears every stream, and an official's buttons work."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.system.harness import PLAYERS, Match

pytestmark = pytest.mark.system


def test_it_hears_streams_and_processes_and_its_buttons_halt_and_continue(match: Match, display: str) -> None:
    root = Path(__file__).parents[2]
    paths = [str(root), *filter(None, [os.environ.get("PYTHONPATH")])]
    gone = ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_AUDIODRIVER")
    inherited = {name: value for name, value in os.environ.items() if name not in gone}
    view = subprocess.Popen(
        [sys.executable, "-m", "tests.system.developer_process", match.endpoint, str(match.run.path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, cwd=root, text=True,
        env={**inherited, "DISPLAY": display, "PYGAME_HIDE_SUPPORT_PROMPT": "1", "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert view.stdin is not None
    assert view.stdout is not None
    observer = match.observer
    try:
        pulses = observer.heard.pulses
        observer.wait_until(lambda: pulses["spectator/developer"] > 6, "the window to have drawn for a while")
        print("tell", file=view.stdin, flush=True)
        told = json.loads(view.stdout.readline())
        assert {"world", "referee", *PLAYERS} <= set(told["processes"])
        assert all(told["processes"][name][1] == "running" for name in PLAYERS)
        assert all(told["streams"][f"player/{name}/report"] > 1.0 for name in PLAYERS)
        assert told["streams"]["clock"] > 10.0
        print("HALT", file=view.stdin, flush=True)
        observer.wait_until(lambda: observer.state.halted is not None, "the halt")
        print("RESUME", file=view.stdin, flush=True)
        observer.wait_until(lambda: observer.playing, "play to go on")
    finally:
        view.kill()
        view.wait()
