"""Gamepads and the keyboard, both as the same buttons. Gamepads are read through SDL's mapping of game controllers.

Only one gamepad is in use: the one on which a button was pressed while none was. If it is lost, no other one takes over
before a button is pressed on it; that first press does nothing else.
"""

import math
import os
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import pygame
from pygame._sdl2 import controller

from vrg.ui.hands import Hands

DEAD_ZONE: Final = 0.15
"""How far from its centre a stick must be before it counts, 0 to 1."""
FULL: Final = 32767.0
"""The value of an axis at its end."""


class Act(Enum):
    """What a button asks for once, when it is pressed."""

    FACE_1 = 0
    FACE_2 = 1
    FACE_3 = 2
    FACE_4 = 3
    PLAYER_1 = 4
    PLAYER_2 = 5
    PLAYER_3 = 6
    PLAYER_4 = 7
    PAGE = 8
    ESTOP = 9
    LOST = 10
    CLOSE = 11


FACES: Final = (Act.FACE_1, Act.FACE_2, Act.FACE_3, Act.FACE_4)
PLAYERS: Final = (Act.PLAYER_1, Act.PLAYER_2, Act.PLAYER_3, Act.PLAYER_4)

PAD_BUTTONS: Final = {
    pygame.CONTROLLER_BUTTON_A: Act.FACE_1,
    pygame.CONTROLLER_BUTTON_B: Act.FACE_2,
    pygame.CONTROLLER_BUTTON_X: Act.FACE_3,
    pygame.CONTROLLER_BUTTON_Y: Act.FACE_4,
    pygame.CONTROLLER_BUTTON_DPAD_UP: Act.PLAYER_1,
    pygame.CONTROLLER_BUTTON_DPAD_RIGHT: Act.PLAYER_2,
    pygame.CONTROLLER_BUTTON_DPAD_DOWN: Act.PLAYER_3,
    pygame.CONTROLLER_BUTTON_DPAD_LEFT: Act.PLAYER_4,
    pygame.CONTROLLER_BUTTON_START: Act.PAGE,
    pygame.CONTROLLER_BUTTON_BACK: Act.ESTOP,
}
KEYS: Final = {
    pygame.K_a: Act.FACE_1,
    pygame.K_b: Act.FACE_2,
    pygame.K_x: Act.FACE_3,
    pygame.K_y: Act.FACE_4,
    pygame.K_1: Act.PLAYER_1,
    pygame.K_2: Act.PLAYER_2,
    pygame.K_3: Act.PLAYER_3,
    pygame.K_4: Act.PLAYER_4,
    pygame.K_TAB: Act.PAGE,
    pygame.K_SPACE: Act.ESTOP,
    pygame.K_q: Act.CLOSE,
}
_AHEAD: Final = {pygame.K_UP: 1.0, pygame.K_DOWN: -1.0}
_ASIDE: Final = {pygame.K_LEFT: 1.0, pygame.K_RIGHT: -1.0}
_TURBO: Final = (pygame.K_LSHIFT, pygame.K_RSHIFT)


def radial(x: float, y: float) -> tuple[float, float]:
    """The position of a stick with a round dead zone, scaled so that it grows from 0 at the zone's border to 1."""
    length = math.hypot(x, y)
    if length <= DEAD_ZONE:
        return 0.0, 0.0
    scale = min(1.0, (length - DEAD_ZONE) / (1.0 - DEAD_ZONE)) / length
    return x * scale, y * scale


@dataclass
class Pads:
    """The gamepads that are connected, and the keyboard.

    Attributes:
        active: SDL's number of the gamepad in use; None while there is none.
    """

    active: int | None = None
    _open: dict[int, controller.Controller] = field(default_factory=dict)
    _held: set[int] = field(default_factory=set)
    _axes: dict[int, float] = field(default_factory=dict)
    _keys: set[int] = field(default_factory=set)

    def start(self) -> None:
        """Let SDL tell of gamepads, also while the window has no focus."""
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        controller.init()
        controller.set_eventstate(True)

    @property
    def status(self) -> str:
        """Which gamepad is in use, in words."""
        if self.active is not None:
            return f"gamepad: {self._open[self.active].name}"
        if self._open:
            return "press a button of the gamepad to use it"
        return "no gamepad: the keyboard serves"

    @property
    def hands(self) -> Hands:
        """What is held now. While a gamepad is in use and a key steers too, the key counts."""
        keys = self._keys
        if keys & {*_AHEAD, *_ASIDE}:
            forward = sum(_AHEAD.get(key, 0.0) for key in keys)
            turn = sum(_ASIDE.get(key, 0.0) for key in keys)
            return Hands(forward, turn, enabled=True, turbo=any(key in keys for key in _TURBO))
        if self.active is None:
            return Hands()
        x, y = (self._axes.get(axis, 0.0) for axis in (pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY))
        x, y = radial(x, y)
        buttons = (pygame.CONTROLLER_BUTTON_A in self._held) - (pygame.CONTROLLER_BUTTON_B in self._held)
        return Hands(
            max(-1.0, min(1.0, buttons - y)),
            -x,
            enabled=pygame.CONTROLLER_BUTTON_RIGHTSHOULDER in self._held,
            turbo=pygame.CONTROLLER_BUTTON_LEFTSHOULDER in self._held,
        )

    def take(self, event: pygame.event.Event) -> Act | None:
        """Take in an event of SDL; return what it asks for, if it asks for anything."""
        match event.type:
            case pygame.KEYDOWN:
                self._keys.add(event.key)
                return KEYS.get(event.key)
            case pygame.KEYUP:
                self._keys.discard(event.key)
            case pygame.WINDOWFOCUSLOST:
                self._keys.clear()
            case pygame.QUIT:
                return Act.CLOSE
            case pygame.CONTROLLERDEVICEADDED:
                self._connect(event.device_index)
            case pygame.CONTROLLERDEVICEREMOVED:
                return self._disconnect(event.instance_id)
            case pygame.CONTROLLERBUTTONDOWN:
                return self._press(event.instance_id, event.button)
            case pygame.CONTROLLERBUTTONUP if event.instance_id == self.active:
                self._held.discard(event.button)
            case pygame.CONTROLLERAXISMOTION if event.instance_id == self.active:
                # SDL's lowest value is one more than its highest.
                self._axes[event.axis] = max(-1.0, event.value / FULL)
            case _:
                pass
        return None

    def rumble(self, strength: float, seconds: float) -> None:
        """Shake the gamepad in use, if it can. strength: 0 to 1."""
        if self.active is not None:
            self._open[self.active].rumble(strength, strength, round(seconds * 1000))

    def stop(self) -> None:
        """Close all gamepads."""
        for pad in self._open.values():
            pad.quit()
        self._open.clear()
        self.active = None

    def _connect(self, index: int) -> None:
        if not controller.is_controller(index):
            return
        pad = controller.Controller(index)
        self._open[pad.as_joystick().get_instance_id()] = pad

    def _disconnect(self, instance: int) -> Act | None:
        pad = self._open.pop(instance, None)
        if pad is not None:
            pad.quit()
        if instance != self.active:
            return None
        self.active = None
        self._held.clear()
        self._axes.clear()
        return Act.LOST

    def _press(self, instance: int, button: int) -> Act | None:
        if self.active is None and instance in self._open:
            self.active = instance
            return Act.ESTOP if PAD_BUTTONS.get(button) is Act.ESTOP else None
        if instance != self.active:
            # The emergency stop works from every gamepad.
            return Act.ESTOP if PAD_BUTTONS.get(button) is Act.ESTOP else None
        self._held.add(button)
        return PAD_BUTTONS.get(button)
