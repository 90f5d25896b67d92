"""The requests to the world: to add robots, to remove them, or to put them somewhere else."""

from vrg.bus.messages import RequestKind, WorldRequest
from vrg.errors import ConfigError, WorldError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.sim.config import overlap, place_problems
from vrg.hal.sim.world import World
from vrg.types import Pose


def grant(world: World, request: WorldRequest) -> None:
    """Do what a request asks for. A physical robot cannot be placed or reset, because only people can move it.

    Raises:
        WorldError: the request cannot be granted; nothing has changed.
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
        model = robot_model(request.model)
    except ConfigError as error:
        raise WorldError(f"spawn {name}: {error}") from None
    _require_room(world, name, model, request.pose, set())
    world.add(name, model, request.pose)


def _place(world: World, places: dict[str, Pose]) -> None:
    for name, pose in places.items():
        _require_room(world, name, world.member(name).model, pose, set(places))
        for other, other_pose in places.items():
            if other < name and overlap(world.model(name), pose, world.model(other), other_pose):
                raise WorldError(f"place {name}: expected room, but it would overlap {other}")
    for name, pose in places.items():
        world.place(name, pose)


def _require_room(world: World, name: str, model: RobotModel, pose: Pose, leaving: set[str]) -> None:
    """Raise WorldError unless the pose is free of walls and of robots other than `name` and those leaving."""
    problem = place_problems(world.map, name, model, pose)
    if problem is not None:
        raise WorldError(f"robot {name}: {problem}")
    for other in world.names:
        if other != name and other not in leaving and overlap(model, pose, world.model(other), world.pose(other)):
            raise WorldError(f"place {name}: expected room, but it would overlap {other}")


def _named(request: WorldRequest) -> str:
    if request.robot is None:
        raise WorldError(f"{request.kind}: expected a robot, got none")
    return request.robot
