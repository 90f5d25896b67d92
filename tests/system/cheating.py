"""A strategy that tries to reach what is of others in a match, and says how that went. A test writes it into a file.

What no sealed process may do, in whatever match, is tried in `tests/launch/sandbox/test_seal.py`.
"""

CHEATING = """
import importlib
import os
import signal
from pathlib import Path

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer

HERE = Path(__file__).parent
RUN = Path(os.environ["VRG_PLAYER_FOLDER"]).parent.parent
PARENT = os.getppid()
OWN = os.environ["VRG_PLAYER_FOLDER"]
KEYS = Path({keys!r})


def nest():
    # Their path is longer than the system takes.
    os.chdir(OWN)
    for _ in range(20):
        os.makedirs("n" * 250, exist_ok=True)
        os.chdir("n" * 250)
    os.chdir("/usr")


ATTEMPTS = dict(
    memory=lambda: open(f"/proc/{{PARENT}}/mem", "rb"),
    world=lambda: (RUN / "world.snapshot").read_bytes(),
    journal=lambda: (RUN / "journal.jsonl").read_text(),
    setup=lambda: (RUN / "setup.json").read_text(),
    opponent=lambda: (HERE / "shark.py").read_text(),
    copy=lambda: (RUN / "shark.py").read_text(),
    keys=lambda: (KEYS / "player.bob" / "seat.key").read_text(),
    authority=lambda: (KEYS / "authority" / "ca.key").read_text(),
    launcher=lambda: (KEYS / "launcher" / "seat.key").read_text(),
    log=lambda: (RUN / "logs" / "referee.log").write_text(""),
    elsewhere=lambda: (HERE / "evil").touch(),
    kill=lambda: os.kill(PARENT, signal.SIGKILL),
    opponents_module=lambda: importlib.import_module("shark"),
)
TRIED = False


class Cheat(SharksAndMinnowsPlayer):
    def act(self, view):
        global TRIED
        if not TRIED and view.referee.clock > 1.0:
            TRIED = True
            nest()
            for name, attempt in ATTEMPTS.items():
                try:
                    attempt()
                    print("cheat:", name, "worked")
                except (OSError, ImportError) as error:
                    print("cheat:", name, "refused:", type(error).__name__)
            print("cheat: done", flush=True)
            os.kill(PARENT, signal.SIGKILL)
        return super().act(view)
"""
