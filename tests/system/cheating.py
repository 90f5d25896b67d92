"""A strategy that tries what a sealed player must not do, and says how that went. A test writes it into a file."""

CHEATING = """
import importlib
import mmap
import os
import signal
import socket
import subprocess
import threading
from pathlib import Path

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer

HERE = Path(__file__).parent
RUN = Path(os.environ["VRG_PLAYER_FOLDER"]).parent.parent
PARENT = os.getppid()
OWN = os.environ["VRG_PLAYER_FOLDER"]
KEYS = Path({keys!r})


def threads():
    done = threading.Event()
    try:
        while True:
            threading.Thread(target=done.wait, daemon=True).start()
    finally:
        done.set()


def fill():
    with open(os.environ["VRG_PLAYER_FOLDER"] + "/big", "wb") as file:
        while True:
            file.write(bytes(1_000_000))


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
    everybody=lambda: os.kill(-1, signal.SIGKILL),
    udp=lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM),
    tcp=lambda: socket.create_connection(("127.0.0.1", 9), 1.0),
    fork=os.fork,
    program=lambda: subprocess.run(["true"]),
    shared=lambda: mmap.mmap(-1, 1 << 20),
    reserved=lambda: os.posix_fallocate(os.open(OWN + "/reserved", os.O_RDWR | os.O_CREAT), 0, 1 << 20),
    opponents_module=lambda: importlib.import_module("shark"),
    threads=threads,
    fill=fill,
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
                except (OSError, RuntimeError, ImportError) as error:
                    print("cheat:", name, "refused:", type(error).__name__)
            print("cheat: done", flush=True)
            os.kill(PARENT, signal.SIGKILL)
        return super().act(view)
"""
