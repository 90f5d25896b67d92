"""The messages that must not be overlooked: emergency stop, halt, the end, a silent world, what a stage waits for."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from vrg.bus.messages import Stage
from vrg.colours import Rgb
from vrg.ui import palette
from vrg.ui.headline import result_lines, winner_words
from vrg.ui.scene import Scene

ENDED: Final = "The match has ended"
CLOSE: Final = "Q closes the window"


class Help(Enum):
    """The means of those who look at a match: an official has keys, a terminal's user commands, a viewer nothing."""

    KEYS = "keys"
    COMMANDS = "commands"
    NONE = "none"


@dataclass(frozen=True)
class Banner:
    """A heading and what is to be read with it.

    Args:
        lines: what happened, then how it is left, where the referee tells it.
        steps: what those who look can do, in order.
        brief: one line is enough, because it is no more than news.
    """

    heading: str
    lines: tuple[str, ...]
    colour: Rgb
    steps: tuple[str, ...] = ()
    brief: bool = False

    @property
    def text(self) -> str:
        """The lines as one: news in a list, and everything else in sentences."""
        return ("; " if self.brief else ". ").join((*self.lines, *self.steps))


def banners(scene: Scene, help_: Help = Help.NONE) -> list[Banner]:
    """The banners of a scene, the gravest first."""
    found = []
    if scene.left:
        over = scene.stage is Stage.GAME_OVER
        heading, colour = winner_words(scene) if over else (ENDED, palette.CALM)
        return [Banner(heading, (CLOSE, *(result_lines(scene) if over else ())), colour)]
    if scene.estop:
        # The referee halts because of it: the reason is the same.
        reason = scene.estop_reason or scene.halted
        found.append(_stopped("EMERGENCY STOP", reason, scene, palette.ALARM, help_))
    if not scene.live:
        found.append(Banner("NO CLOCK", ("No clock from the world: what you see is old, robots stop.",), palette.LOST))
    if scene.unproved:
        lines = ("Evidence cannot be written: calls made now cannot be judged again.",)
        found.append(Banner("NO EVIDENCE", lines, palette.CAUTION))
    if scene.stage is Stage.GAME_OVER:
        heading, colour = winner_words(scene)
        found.append(Banner(heading, result_lines(scene), colour))
    elif scene.halted is not None and not scene.estop:
        found.append(_stopped("HALT", scene.halted, scene, palette.CAUTION, help_))
    elif scene.waiting and scene.halted is None:
        late = help_ is Help.COMMANDS and bool(scene.calls) and scene.calls[-1].rule == "late"
        steps = ("vrg official place PLAYER confirms where a robot was put",) if late else ()
        found.append(Banner("Waiting for", scene.waiting, palette.CALM, steps, brief=True))
    return found


def _stopped(heading: str, reason: str | None, scene: Scene, colour: Rgb, help_: Help) -> Banner:
    lines = tuple(text for text in (reason, scene.way_out) if text)
    return Banner(heading, lines, colour, _steps(scene, help_))


def _steps(scene: Scene, help_: Help) -> tuple[str, ...]:
    """The acts of those who look by which play goes on, in order."""
    latched = any(player.latched for player in scene.players)
    ways = [
        (scene.estop, "U", "vrg estop --release", "releases the stop"),
        (latched, "R", "vrg official recover", "lets robots clear their faults"),
        (scene.stage is not Stage.GAME_OVER, "C", "vrg official resume", "continues play"),
    ]
    words = [f"{command if help_ is Help.COMMANDS else key} {does}" for needed, key, command, does in ways if needed]
    if help_ is Help.NONE:
        return ()
    return tuple(words) if len(words) < 2 else tuple(f"{number}. {text}" for number, text in enumerate(words, 1))
