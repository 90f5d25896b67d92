"""A head-up display's process whose keys are pressed by lines on its standard input, as pygame calls them: `r`, `up`.

Usage: `hud_process.py ENDPOINT RUN_FOLDER PLAYER KEYS_FOLDER`.
"""

import sys
import threading
from pathlib import Path

import pygame

from vrg.config.setup import read_setup
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import serve


def _press_keys() -> None:
    for line in sys.stdin:
        key = pygame.key.key_code(line.strip())
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode=""))


if __name__ == "__main__":
    endpoint, run, player, keys = sys.argv[1:]
    threading.Thread(target=_press_keys, daemon=True).start()
    serve("hud", read_setup(RunFolder(Path(run)).setup), router=endpoint, name=player, keys=Path(keys))
