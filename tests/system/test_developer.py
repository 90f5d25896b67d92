"""The developers' view on a match of real processes: it hears every stream, and an official's buttons work."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.system.harness import PLAYERS, Match

pytestmark = [pytest.mark.system, pytest.mark.thorough]


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

        def told() -> bool:
            """Whether it shows every process running and every stream: it measures over some time."""
            print("tell", file=view.stdin, flush=True)
            said = json.loads(view.stdout.readline())
            running = {name for name, cells in said["processes"].items() if cells[1] == "running"}
            flowing = {key for key, rate in said["streams"].items() if rate > 0.0}
            reports = {f"player/{name}/report" for name in PLAYERS}
            return {"world", "referee", *PLAYERS} <= running and {"clock", *reports} <= flowing

        observer.wait_until(told, "the window to tell of everybody")
        print("HALT", file=view.stdin, flush=True)
        observer.wait_until(lambda: observer.state.halted is not None, "the halt")
        print("RESUME", file=view.stdin, flush=True)
        observer.wait_until(lambda: observer.playing, "play to go on by its button")
    finally:
        view.kill()
        view.wait()
