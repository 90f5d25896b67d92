"""A sensor of somebody else stands on the display in its own words."""

import math

from displays import GROUND, KEYS

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.hal.models import MODELS
from vrg.hal.sensors import message_class
from vrg.types import Pose
from vrg_views.hud.dashboard import Line, status
from vrg_views.hud.node import Hud


def test_its_reading_stands_on_the_display_of_its_player(needle: None) -> None:
    display = Hud(
        "ann", Mailbox(), KEYS, team="red", robot=MODELS.get("Pathfinder"), start=Pose(0.0, 0.0, 0.0), ground=GROUND
    )
    message = message_class("needle")
    assert message is not None
    try:
        display.tick(Tick(1.0))
        assert Line("NEEDLE", "no reading yet") in status(display.board)
        body = message(heading=math.pi / 2)
        topic = KEYS.sensor(type(body), "ann", "main")
        for inlet in display.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(Received(topic.key, 1.0, 0, body))
        display.mailbox.handover(1.1)
        display.tick(Tick(1.1))
        assert Line("NEEDLE", "90° from east") in status(display.board)
    finally:
        display.stop()
