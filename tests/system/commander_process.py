"""A commander's process with a virtual gamepad, whose buttons are pressed by lines on its standard input.

Usage: `commander_process.py ENDPOINT MATCH TEAM`. A line is `button NUMBER 0|1`, `axis NUMBER VALUE` or `unplug`.
"""

import os
import sys
import threading
from typing import TextIO

os.environ |= {
    "SDL_VIDEODRIVER": "dummy",
    "SDL_AUDIODRIVER": "dummy",
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
}

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.process import run_node
from vrg.bus.session import open_session
from vrg.bus.stopping import stop_on_signals
from vrg.bus.topics import Keys
from vrg.testing.views.virtual_pad import VirtualPad
from vrg.ui.commander.node import Commander


class Coached(Commander):
    """Takes its orders from a file in place of a person's fingers."""

    def __init__(self, team: str, keys: Keys, orders: TextIO) -> None:
        super().__init__(team, Mailbox(), keys, size=(640, 480))
        self._orders: list[str] = []
        self._pad: VirtualPad | None = None
        threading.Thread(target=self._read, args=(orders,), daemon=True).start()

    def _read(self, orders: TextIO) -> None:
        for line in orders:
            self._orders.append(line)

    def tick(self, tick: Tick) -> None:
        """Press what was asked for, then do what a commander does."""
        super().tick(tick)
        if self._pad is None:
            self._pad = VirtualPad()
            print("ready", flush=True)
        elif self._orders:  # one at a tick: SDL sees only how a button is when it looks
            match self._orders.pop(0).split():
                case ["button", number, down]:
                    self._pad.button(int(number), down == "1")
                case ["axis", number, value]:
                    self._pad.axis(int(number), float(value))
                case ["unplug"]:
                    self._pad.unplug()


def main() -> None:
    """Run until a signal comes."""
    endpoint, match, team = sys.argv[1:4]
    keys = Keys(match)
    with stop_on_signals() as stop, open_session(endpoint, stop=stop) as session:
        node = Coached(team, keys, sys.stdin)
        run_node(node, session, keys, stop, finished=lambda: node.closed, idle=1 / 30)


if __name__ == "__main__":
    main()
