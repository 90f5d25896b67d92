"""A window in a process of its own, whose keys are pressed by lines on its standard input, as pygame calls them: `h`.

Usage: `window_process.py KIND ENDPOINT RUN_FOLDER NAME [KEYS_FOLDER]`.
"""

import sys
import threading
from pathlib import Path

import pygame

from vrg.config.setup import read_setup
from vrg.kinds import KINDS
from vrg.launch.process import by_hand
from vrg.launch.process_main import serve
from vrg.runs.run_folder import RunFolder


def _press_keys() -> None:
    for line in sys.stdin:
        key = pygame.key.key_code(line.strip())
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode=""))


if __name__ == "__main__":
    kind, endpoint, run, name, *keys = sys.argv[1:]
    threading.Thread(target=_press_keys, daemon=True).start()
    found = Path(keys[0]) if keys else None
    serve(by_hand(KINDS.get(kind), name, endpoint, run=None, keys=found), read_setup(RunFolder(Path(run)).setup))
