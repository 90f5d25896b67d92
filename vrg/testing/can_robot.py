"""What those share who drive a robot on a simulated CAN bus: its wiring, its adapter, and the messages that it gets."""

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.workshop.simulation import Port

RATIO = 50.0
"""Turns of a motor for one turn of its wheel."""


def adapter_of(driver: CanDriver) -> Port:
    """The adapter of a driver on a simulated bus."""
    port = driver._bus
    assert isinstance(port, Port)
    return port


def deliver(mailbox: Mailbox, message: Received[Message]) -> None:
    """Give a message to all who subscribe to its key; alarms sound at once."""
    for inlet in mailbox.inlets:
        if inlet.topic.key == message.key:
            inlet.offer(message)
