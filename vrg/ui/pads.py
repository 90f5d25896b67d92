"""Gamepads and the keyboard, both as the same buttons. Gamepads are read through SDL's mapping of game controllers.

Only one gamepad is in use: the one on which a button was pressed while none was. If it is lost, no other one takes over
before a button is pressed on it; that first press does nothing else.
"""

import os
from dataclasses import dataclass, field
from typing import Final

import pygame
from pygame._sdl2 import controller

from vrg.ui.acts import AHEAD, ASIDE, DEADMAN, FAST, PAD, PAD_AHEAD, PAD_BACK, TURBO, Act, Press
from vrg.ui.driving import Hands, radial

FULL: Final = 32767.0
"""The value of an axis at its end."""


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
        """The gamepad that is in use, in words."""
        if self.active is not None:
            return f"gamepad: {self._open[self.active].name}"
        if self._open:
            return "press a button of the gamepad to use it"
        return "no gamepad: the keyboard serves"

    @property
    def hands(self) -> Hands:
        """The present state of the controls. While a gamepad is in use and a key steers too, the key counts."""
        keys = self._keys
        if keys & {*AHEAD, *ASIDE}:
            forward = sum(AHEAD.get(key, 0.0) for key in keys)
            turn = sum(ASIDE.get(key, 0.0) for key in keys)
            return Hands(forward, turn, enabled=True, turbo=not keys.isdisjoint(FAST))
        if self.active is None:
            return Hands()
        x, y = (self._axes.get(axis, 0.0) for axis in (pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY))
        x, y = radial(x, y)
        buttons = (PAD_AHEAD in self._held) - (PAD_BACK in self._held)
        return Hands(
            max(-1.0, min(1.0, buttons - y)),
            -x,
            enabled=DEADMAN in self._held,
            turbo=TURBO in self._held,
        )

    def take(self, event: pygame.event.Event) -> Press | None:
        """Take in an event of SDL; return what a button of a gamepad asks for, if it asks for anything."""
        match event.type:
            case pygame.KEYDOWN:
                self._keys.add(event.key)
            case pygame.KEYUP:
                self._keys.discard(event.key)
            case pygame.WINDOWFOCUSLOST:
                self._keys.clear()
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

    def _disconnect(self, instance: int) -> Press | None:
        pad = self._open.pop(instance, None)
        if pad is not None:
            pad.quit()
        if instance != self.active:
            return None
        self.active = None
        self._held.clear()
        self._axes.clear()
        return Press(Act.PAD_LOST)

    def _press(self, instance: int, button: int) -> Press | None:
        press = PAD.get(button)
        # The emergency stop works from every gamepad.
        stop = press if press is not None and press.act is Act.STOP else None
        if self.active is None and instance in self._open:
            self.active = instance
            return stop
        if instance != self.active:
            return stop
        self._held.add(button)
        return press
