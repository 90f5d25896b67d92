"""Emulated drives on a real bus, in real time, for the few tests that are about that."""

import random
import threading
from collections.abc import Sequence

from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.emulated import DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.run import run_drives
from vrg.hal.clock import REAL_CLOCK

PATIENCE = 60.0
"""s of real time for a condition that a test waits for."""


class LiveDrives:
    """Emulated drives in a thread of their own, with their own socket on the bus; a context manager."""

    def __init__(self, protocol: str, nodes: Sequence[int], link: Link) -> None:
        spoken = PROTOCOLS.get(protocol)
        told = spoken.axis_type.options_type.model_validate(spoken.drive_type.wiring)
        self.drives: list[EmulatedDrive] = [
            spoken.drive_type(
                node,
                DriveOptions(serial=0x1000 + i, watchdog=0.25, protocol=told),
                REAL_CLOCK.now(),
                random.Random(i),
            )
            for i, node in enumerate(nodes)
        ]
        self._stop = threading.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(
            target=run_drives, args=(link, self.drives, self._stop), kwargs={"ready": self._ready.set}
        )

    def __enter__(self) -> "LiveDrives":
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
