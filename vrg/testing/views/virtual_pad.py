"""A gamepad that exists only in this process, made by the SDL that pygame has loaded."""

import ctypes
from pathlib import Path

AXES, BUTTONS = 6, 15
UNKNOWN, GAME_CONTROLLER = 0, 1
"""SDL's numbers of two kinds of devices: it maps the buttons and axes of the second by itself."""


def _sdl() -> ctypes.CDLL:
    maps = Path("/proc/self/maps").read_text()
    path = next(line.split()[-1] for line in maps.splitlines() if "libSDL2-2" in line)
    return ctypes.CDLL(path)


class VirtualPad:
    """A gamepad that is connected from its construction to `unplug`; `kind` is SDL's number of its kind."""

    def __init__(self, kind: int = GAME_CONTROLLER) -> None:
        self._sdl = _sdl()
        self._index = self._sdl.SDL_JoystickAttachVirtual(kind, AXES, BUTTONS, 1)
        assert self._index >= 0, "SDL makes no virtual joystick"
        self._sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
        self._joystick = ctypes.c_void_p(self._sdl.SDL_JoystickOpen(self._index))

    def button(self, number: int, down: bool) -> None:
        """Press or release a button."""
        self._sdl.SDL_JoystickSetVirtualButton(self._joystick, number, ctypes.c_uint8(down))

    def axis(self, number: int, value: float) -> None:
        """Move an axis: -1 to 1."""
        self._sdl.SDL_JoystickSetVirtualAxis(self._joystick, number, ctypes.c_int16(round(value * 32767)))

    def unplug(self) -> None:
        """Take the gamepad away."""
        self._sdl.SDL_JoystickDetachVirtual(self._index)
