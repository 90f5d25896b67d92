"""The requests to the world: to add robots, to remove them, or to put them somewhere else."""

from collections.abc import Mapping

from vrg.bus.messages import RequestKind, WorldRequest
from vrg.errors import ConfigError, WorldError
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import overlap, place_problems
from vrg.hal.sim.world import World
from vrg.types import Pose


def grant(world: World, request: WorldRequest) -> None:
    """Do what a request asks for. A physical robot cannot be placed or reset, because only people can move it.

    Raises:
        WorldError: the request cannot be granted, or only for some robots, with those robots and the reason.
    """
    match request.kind:
        case RequestKind.SPAWN:
            _spawn(world, request)
        case RequestKind.REMOVE:
            world.remove(_named(request))
        case RequestKind.PLACE:
            if not request.places:
                raise WorldError("place: expected places, got none")
            _place(world, request.places)
        case RequestKind.RESET:
            chosen = world.virtual if request.robot is None else [request.robot]
            _place(world, {name: world.member(name).start for name in chosen})


def _spawn(world: World, request: WorldRequest) -> None:
    name = _named(request)
    if request.model is None or request.pose is None:
        raise WorldError(f"spawn {name}: expected a model and a pose")
    if name in world.names:
        raise WorldError(f"spawn {name}: expected a name that is not in the world")
    try:
        model = world.config.description(name, request.model)
    except ConfigError as error:
        raise WorldError(f"spawn {name}: {error}") from None
    _require_room(world, name, model, request.pose, set())
    world.add(name, model, request.pose)


def _place(world: World, places: Mapping[str, Pose]) -> None:
    """Put robots somewhere, as many as there is room for; the others stay where they are.

    Raises:
        WorldError: some stay; tells which, and why.
    """
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
            _require_room(world, name, world.member(name).model, pose, set(places))
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


def _named(request: WorldRequest) -> str:
    if request.robot is None:
        raise WorldError(f"{request.kind}: expected a robot, got none")
    return request.robot
