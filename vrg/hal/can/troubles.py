"""Errors of a bus, in words for people who use it."""

import errno

from vrg.errors import RobotError

_FATAL_CLASSES = {
    0x00000001: "transmit time-out",
    0x00000010: "transceiver error",
    0x00000020: "no node acknowledges: is another one switched on, and the bus terminated?",
    0x00000040: "bus-off: the controller has given up after too many errors",
}
"""Classes of error frames (linux/can/error.h) after which nothing can be relied on."""
_CONTROLLER_CLASS = 0x00000004
_CONTROLLER = {
    0x01: "receive overflow in the controller: frames were lost",
    0x02: "transmit overflow in the controller: frames were lost",
    0x10: "error-passive: too many receive errors",
    0x20: "error-passive: too many transmit errors",
}
"""The meanings of the second byte of a controller's error frame, by its bits."""


class NoFdError(RobotError):
    """A CAN FD frame cannot be sent, because the bus has none."""


def describe_error(error: Exception) -> str:
    """Return the meaning of an error of python-can, for people who use the bus."""
    number = errno_of(error)
    if number == errno.ENETDOWN:
        return "the interface is down"
    if number in (errno.ENODEV, errno.ENXIO, errno.EBADF):
        return "the interface is gone"
    if is_full(error):
        return "the transmit queue is full: no node takes the frames off the bus"
    return str(error) or type(error).__name__


def is_full(error: Exception) -> bool:
    """True if a frame could not be sent because the transmit queue was full."""
    return errno_of(error) == errno.ENOBUFS


def describe_error_frame(error_class: int, data: bytes) -> str | None:
    """Return the meaning of an error frame, in words; None if it is no reason to stop."""
    found = [words for bit, words in _FATAL_CLASSES.items() if error_class & bit]
    if error_class & _CONTROLLER_CLASS and len(data) > 1:
        found += [words for bit, words in _CONTROLLER.items() if data[1] & bit]
    return "; ".join(found) or None


def errno_of(error: Exception) -> int | None:
    """The system's number of an error; python-can hides it in an attribute of its own, or in the cause."""
    for candidate in (getattr(error, "error_code", None), getattr(error, "errno", None)):
        if isinstance(candidate, int):
            return candidate
    cause = error.__cause__ or error.__context__
    return errno_of(cause) if isinstance(cause, Exception) else None
