"""The developers' view in a process of its own, whose buttons are pressed by lines on its standard input: `HALT`.

The line `tell` writes what the window shows as a line of JSON. Usage: `developer_process.py ENDPOINT RUN_FOLDER`.
"""

import json
import sys
import threading
from pathlib import Path
from typing import Any

import pygame

from vrg.config.setup import read_setup
from vrg.launch import nodes
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import serve
from vrg.ui.developer import tables
from vrg.ui.developer.deciding import Button
from vrg.ui.developer.node import DeveloperWindow

opened: list[DeveloperWindow] = []
make = nodes.developer_node


def _keep(*arguments: Any, **options: Any) -> DeveloperWindow:
    opened.append(make(*arguments, **options))
    return opened[-1]


def _obey() -> None:
    for line in sys.stdin:
        window = opened[-1]
        if line.strip() == "tell":
            rows = {
                row.cells[0].text: [cell.text for cell in row.cells] for row in tables.processes(window.insight).lines
            }
            streams = {stream.key: stream.rate for stream in window.insight.streams}
            echoes = [reading.robot for reading in window.insight.readings]
            print(json.dumps({"processes": rows, "streams": streams, "scans": echoes}), flush=True)
        elif window.shown is not None:
            place = window.shown.layout.buttons[Button[line.strip()]].center
            pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=place))


if __name__ == "__main__":
    endpoint, run = sys.argv[1:]
    nodes.developer_node = _keep
    threading.Thread(target=_obey, daemon=True).start()
    serve("developer", read_setup(RunFolder(Path(run)).setup), router=endpoint, name="developer")
