"""Requests to put robots of a world somewhere else."""

from collections.abc import Mapping

from vrg.errors import WorldError
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import overlap, place_problems
from vrg.hal.sim.world import World
from vrg.types import Pose


def place(world: World, places: Mapping[str, Pose]) -> None:
    """Put robots somewhere, as many as there is room for; the others stay where they are.

    A physical robot cannot be placed, because only people can move it.

    Raises:
        WorldError: there are no places, or some robots stay; the error names them, each with the reason.
    """
    if not places:
        raise WorldError("place: expected places, got none")
    refused: dict[str, str] = {}
    # Who stays is in the way of others, so that one refusal may lead to more.
    while wrong := _without_room(world, {name: pose for name, pose in places.items() if name not in refused}):
        refused |= wrong
    for name, pose in places.items():
        if name not in refused:
            world.place(name, pose)
    if refused:
        raise WorldError("; ".join(refused.values()))


def _without_room(world: World, places: Mapping[str, Pose]) -> dict[str, str]:
    """The robots that cannot be put where they should be, each with the reason."""
    found = {}
    for name, pose in places.items():
        try:
            _require_room(world, name, world.robot(name).model, pose, set(places))
        except WorldError as error:
            found[name] = str(error)
            continue
        for other, other_pose in places.items():
            if other < name and overlap(world.model(name), pose, world.model(other), other_pose):
                found[name] = f"place {name}: expected room, but it would overlap {other}"
    return found


def _require_room(world: World, name: str, model: RobotModel, pose: Pose, leaving: set[str]) -> None:
    """Raise WorldError unless the pose is free of walls and of robots other than `name` and those leaving."""
    problem = place_problems(world.map, name, model, pose)
    if problem is not None:
        raise WorldError(f"robot {name}: {problem}")
    for other in world.names:
        if other != name and other not in leaving and overlap(model, pose, world.model(other), world.pose(other)):
            kind = ", a physical robot" if other not in world.virtual else ""
            raise WorldError(f"place {name}: expected room, but it would overlap {other}{kind}")
