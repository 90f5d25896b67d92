"""Gamepads and the keyboard, both as the same buttons. Gamepads are read through SDL's mapping of game controllers.

Only one gamepad is in use: the one on which a button was pressed while none was. If it is lost, no other one takes over
before a button is pressed on it; that first press does nothing else.

What is held counts only while a person is known to hold it: after `let_go`, and where a gamepad has sent nothing for
SILENCE s, as one whose battery is empty while its dongle is plugged in, it must be let go and be held again.
"""

import contextlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import pygame
from pygame._sdl2 import controller

from vrg.ui.acts import AHEAD, ASIDE, DEADMAN, FAST, PAD, PAD_AHEAD, PAD_BACK, TURBO, UPWARDS, Act, Press, press_of
from vrg.ui.driving import SILENCE, Hands, radial

FULL: Final = 32767.0
"""The value of an axis at its end."""
UNMAPPED: Final = "SDL does not know the buttons of {}: set SDL_GAMECONTROLLERCONFIG"
"""What a person must do about a gamepad that cannot be used."""


@dataclass
class Pads:
    """The gamepads that are connected, and the keyboard.

    Attributes:
        active: SDL's number of the gamepad in use; None while there is none.
        now: returns monotonic time, s.
    """

    active: int | None = None
    now: Callable[[], float] = time.monotonic
    _open: dict[int, controller.Controller] = field(default_factory=dict)
    _held: set[int] = field(default_factory=set)
    _axes: dict[int, float] = field(default_factory=dict)
    _keys: set[int] = field(default_factory=set)
    _unmapped: dict[int, str] = field(default_factory=dict)
    _barred: set[int] = field(default_factory=set)
    """The keys that must be let go before they count again."""
    _free: bool = True
    """The dead-man's switch counts: it was released since `let_go`."""
    _heard: float = 0.0
    """When the gamepad in use was heard last, s."""

    def start(self) -> None:
        """Let SDL report gamepads, also while the window has no focus."""
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        controller.init()
        pygame.joystick.init()
        controller.set_eventstate(True)

    @property
    def status(self) -> str:
        """The gamepad that is in use, in words."""
        if self.active is not None:
            return f"gamepad: {self._open[self.active].name}"
        if self._open:
            return "press a button of the gamepad to use it"
        return self.unknown or "no gamepad: use the keyboard"

    @property
    def unknown(self) -> str:
        """The gamepads that cannot be used, and what to do, in words; empty where there is none."""
        return UNMAPPED.format(" and ".join(self._unmapped.values())) if self._unmapped else ""

    @property
    def hands(self) -> Hands:
        """The present state of the controls. While a gamepad is in use and a key steers too, the key counts."""
        keys = self._keys - self._barred
        if keys & {*AHEAD, *ASIDE, *UPWARDS}:
            forward, turn, climb = (sum(way.get(key, 0.0) for key in keys) for way in (AHEAD, ASIDE, UPWARDS))
            return Hands(forward, turn, climb, enabled=True, turbo=not keys.isdisjoint(FAST))
        if self.active is None:
            return Hands()
        x, y = radial(*(self._axes.get(a, 0.0) for a in (pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY)))
        _, down = radial(0.0, self._axes.get(pygame.CONTROLLER_AXIS_RIGHTY, 0.0))
        buttons = (PAD_AHEAD in self._held) - (PAD_BACK in self._held)
        return Hands(
            max(-1.0, min(1.0, buttons - y)),
            -x,
            -down,
            enabled=DEADMAN in self._held and self._free and self.now() - self._heard <= SILENCE,
            turbo=TURBO in self._held,
        )

    def take(self, event: pygame.event.Event) -> Press | None:
        """Take in an event of SDL; return what a key or a button of a gamepad asks for, if one has gone down."""
        if getattr(event, "instance_id", None) == self.active is not None:
            self._hear()
        match event.type:
            case pygame.KEYDOWN:
                again = event.key in self._keys
                self._keys.add(event.key)
                return press_of(event, again=again)
            case pygame.KEYUP:
                self._keys.discard(event.key)
                self._barred.discard(event.key)
            case pygame.WINDOWFOCUSLOST:
                self._keys.clear()
                self._barred.clear()
            case pygame.JOYDEVICEADDED if not controller.is_controller(event.device_index):
                with contextlib.suppress(pygame.error):  # it may be gone again
                    joystick = pygame.joystick.Joystick(event.device_index)
                    self._unmapped[joystick.get_instance_id()] = described(joystick)
                    return Press(Act.PAD_UNKNOWN)
            case pygame.JOYDEVICEREMOVED:
                self._unmapped.pop(event.instance_id, None)
            case pygame.CONTROLLERDEVICEADDED:
                self._connect(event.device_index)
            case pygame.CONTROLLERDEVICEREMOVED:
                return self._disconnect(event.instance_id)
            case pygame.CONTROLLERBUTTONDOWN:
                return self._press(event.instance_id, event.button)
            case pygame.CONTROLLERBUTTONUP if event.instance_id == self.active:
                self._held.discard(event.button)
                self._free |= event.button == DEADMAN
            case pygame.CONTROLLERAXISMOTION if event.instance_id == self.active:
                # SDL's lowest value is one more than its highest.
                self._axes[event.axis] = max(-1.0, event.value / FULL)
            case _:
                pass
        return None

    def type(self, key: int) -> None:
        """A key that is held belongs to a text: it steers nothing before it is released."""
        self._barred.add(key)

    def let_go(self) -> None:
        """Hold nothing any more, as the match's clock has stopped: what is still held must first be let go."""
        self._barred |= self._keys
        self._free = DEADMAN not in self._held

    def _hear(self) -> None:
        """The gamepad in use has sent something; after a long silence its switch must be pressed again."""
        now = self.now()
        self._free &= now - self._heard <= SILENCE or DEADMAN not in self._held
        self._heard = now

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
        self.active, self._free = None, True
        self._held.clear()
        self._axes.clear()
        return Press(Act.PAD_LOST)

    def _press(self, instance: int, button: int) -> Press | None:
        press = PAD.get(button)
        # The emergency stop works from every gamepad.
        stop = press if press is not None and press.act is Act.STOP else None
        if self.active is None and instance in self._open:
            self.active, self._heard = instance, self.now()
            return stop
        if instance != self.active:
            return stop
        self._held.add(button)
        return press


def described(joystick: pygame.joystick.JoystickType) -> str:
    """The name of a gamepad, and the number by which lists of mappings know it."""
    return f"{joystick.get_name()} ({joystick.get_guid()})"


def connected() -> list[str]:
    """The gamepads that are connected, in words, and what keeps one from being used. It needs no window."""
    controller.init()
    pygame.joystick.init()
    found = []
    for index in range(pygame.joystick.get_count()):
        name = described(pygame.joystick.Joystick(index))
        found.append(name if controller.is_controller(index) else UNMAPPED.format(name))
    return found
