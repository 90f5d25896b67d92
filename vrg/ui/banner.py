"""Says what must not be overlooked: emergency stop, halt, the end, a silent world, and what a stage waits for."""

from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Stage
from vrg.colours import Rgb
from vrg.coordinator.rulebook import DRAW, NOBODY
from vrg.games import game_of
from vrg.games.game import sentence, title
from vrg.ui import palette
from vrg.ui.scene import Scene

GAME_OVER: Final = "GAME OVER"


@dataclass(frozen=True)
class Banner:
    """A heading and what is to be said about it.

    Args:
        lines: what happened, then how it is left, where the referee says so.
        hint: the key that helps, where there are keys; empty where the lines already say what to do.
        brief: it is told in one line, because it is no more than news.
    """

    heading: str
    lines: tuple[str, ...]
    colour: Rgb
    hint: str = ""
    brief: bool = False

    @property
    def text(self) -> str:
        """The lines as one: news in a list, and everything else in sentences."""
        return ("; " if self.brief else ". ").join(self.lines)


def banners(scene: Scene) -> list[Banner]:
    """The banners of a scene, the gravest first."""
    found = []
    if scene.estop:
        # The referee halts because of it: the reason is the same.
        reason = scene.estop_reason or scene.halted
        hint = "U releases it; robots stay still until they are armed"
        found.append(_stopped("EMERGENCY STOP", reason, scene.way_out, palette.ALARM, hint))
    if not scene.live:
        found.append(Banner("NO CLOCK", ("No clock from the world: what you see is old, robots stop.",), palette.LOST))
    if scene.stage is Stage.GAME_OVER:
        found.append(Banner(GAME_OVER, _result(scene), palette.GOOD, "Q closes the window"))
    elif scene.halted is not None and not scene.estop:
        latched = any(player.latched for player in scene.players)
        hint = "R lets robots clear their faults, then C continues" if latched else "C continues"
        found.append(_stopped("HALT", scene.halted, scene.way_out, palette.CAUTION, hint))
    elif scene.waiting and scene.halted is None:
        found.append(Banner("Waiting for", scene.waiting, palette.CALM, brief=True))
    return found


def _stopped(heading: str, reason: str | None, way_out: str | None, colour: Rgb, hint: str) -> Banner:
    lines = tuple(text for text in (reason, way_out) if text)
    return Banner(heading, lines, colour, "" if way_out else hint)


def _result(scene: Scene) -> tuple[str, ...]:
    score = " · ".join(f"{title(team)} {points}" for team, points in scene.score)
    if scene.ended is not None:
        result = sentence(scene.ended)
    elif scene.winner is None or scene.winner == NOBODY:
        result = "No winner"
    else:
        result = "A draw" if scene.winner == DRAW else f"Winner: {title(scene.winner)}"
    why = game_of(scene.game).won_words.get(scene.winner or "")
    return tuple(line for line in (f"{result} ({why})" if why else result, score) if line)
