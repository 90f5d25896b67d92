"""The spectator's window on a made-up match: `python -m tests.ui.demo`. Keys are answered on the terminal."""

import time
from pathlib import Path

from tests.ui import synthetic
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.ui.spectator import Spectator


def main() -> None:
    """Run in real time until the window is closed."""
    keys = Keys("demo")
    window = Spectator("demo", Mailbox(), keys, obstacles=synthetic.OBSTACLES, pictures=Path("/tmp"))
    match = synthetic.Match(keys)
    number = 0
    while not window.closed:
        match.step(window, (number * window.period) % (2 * synthetic.PASS_TIME), number)
        for out in window.mailbox.collect():
            print(out.message.key, out.message.body, flush=True)
            match.say(window.mailbox, out.topic, out.message.body, out.message.stamp, out.message.sequence)
        number += 1
        time.sleep(window.period)


if __name__ == "__main__":
    main()
