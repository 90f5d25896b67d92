"""Problems that keep a match of Sharks and Minnows from being played, judged before it begins."""

from collections.abc import Sequence

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.sharks_and_minnows import MINNOW, SHARK
from vrg.games.sharks_and_minnows.lineup import LargestBody, crowded
from vrg.games.sharks_and_minnows.settings import Settings, opposite


def passes(contestants: Sequence[Contestant]) -> int:
    """The number of passes by the rule: half of what there are more minnows than sharks, rounded down."""
    minnows, sharks = (sum(c.role == role for c in contestants) for role in (MINNOW, SHARK))
    return (minnows - sharks) // 2


def problems_of(settings: Settings, contestants: Sequence[Contestant], extent: LargestBody) -> list[Problem]:
    """Everything that is wrong: too few players for a pass, no room to line up, or a start at the wrong place."""
    minnows, sharks = (sum(c.role == role for c in contestants) for role in (MINNOW, SHARK))
    problems: list[Problem] = []
    if settings.passes is None and passes(contestants) < 1:
        text = (
            f"expected at least two minnows more than sharks, got minnows: {minnows}, sharks: {sharks}; the number of "
            f"passes is floor((minnows - sharks) / 2) = {passes(contestants)}, unless `passes` in [rules] says another"
        )
        problems.append(Problem(text, ("players",)))
    elif minnows < 1:
        problems.append(Problem("expected at least one minnow, got none", ("players",)))
    if sharks < 1:
        problems.append(Problem("expected at least one shark, got none", ("players",)))
    ends = [settings.end_zone(end) for end in ("low", "high")]
    if any(crowded(len(contestants), zone, settings.field, extent) for zone in ends):
        text = (
            f"expected end zones in which {len(contestants)} robots can line up without touching one another: make "
            "zone_depth or the field larger, or play with fewer"
        )
        problems.append(Problem(text, ("rules",)))
    return problems + [
        Problem(why, ("players", c.name)) for c in contestants if (why := _misplaced(settings, c)) is not None
    ]


def _misplaced(settings: Settings, c: Contestant) -> str | None:
    """The reason why a player cannot start where it does, or None."""
    if not settings.field.contains(c.start.x, c.start.y):
        return f"{c.name} starts at ({c.start.x:g}, {c.start.y:g}), out of bounds"
    end = settings.first_goal if c.role == SHARK else opposite(settings.first_goal)
    zone = settings.end_zone(end)
    if zone.contains(c.start.x, c.start.y):
        return None
    return (
        f"{c.name} is a {c.role} and starts in the zone x {zone.x_min:g} to {zone.x_max:g}, "
        f"y {zone.y_min:g} to {zone.y_max:g}; ({c.start.x:g}, {c.start.y:g}) is outside it"
    )
