"""A bus by python-can, on one within this process."""

import pytest

from tests.hal.can.live import PATIENCE
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.link import Link
from vrg.hal.clock import REAL_CLOCK

LINK = Link(interface="virtual", channel="frames of others")


@pytest.mark.parametrize("wanted", [[Filter(0x10, 0x7FF)], None], ids=["filtered", "everything"])
def test_frames_of_others_do_not_hide_that_nothing_waits(wanted: list[Filter] | None) -> None:
    """Who is told of no frame must know that time passes, or it never finds that its own drives are silent."""
    heard: list[Frame] = []
    quiet: list[float] = []
    bus = CanBus(LINK, heard.append, on_quiet=quiet.append)
    other = CanBus(LINK, lambda _: None)
    bus.listen_to(wanted)
    bus.start()
    other.start()
    try:
        began = REAL_CLOCK.now()

        def enough() -> bool:
            other.send(Frame(0x20))
            return len(quiet) > 3 if wanted else len(heard) > 10

        assert REAL_CLOCK.wait(enough, PATIENCE)
        assert bool(heard) == (wanted is None)
        assert quiet == sorted(quiet)
        assert all(began <= at <= REAL_CLOCK.now() for at in quiet)
    finally:
        bus.stop()
        other.stop()
