"""What the robots of a world do with their actuators."""

from collections.abc import Mapping

from vrg.hal.actuators import Dribbler, Gripper, Kicker
from vrg.hal.permission import Permission
from vrg.hal.sim.bodies import Bodies
from vrg.hal.sim.engines.engine import Floats
from vrg.hal.sim.front import Pull, kick
from vrg.hal.sim.robot import VirtualRobot
from vrg.types import Pose, Twist


class Uses:
    """What robots were last told to do with their actuators, as far as they may.

    A kick and a grip happen at the next tick, or not at all. A dribbler pulls until the next command of its robot, or
    until the robot is held.

    Args:
        bodies: the passive bodies.
    """

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        self._wanted: dict[str, tuple[VirtualRobot, Mapping[str, float]]] = {}

    def hear(self, robot: VirtualRobot, use: Mapping[str, float]) -> None:
        """Take in a command of a robot, which replaces its last one, but for kicks and grips that are still to come."""
        _, last = self._wanted.pop(robot.name, (robot, {}))
        kinds = {name: type(robot.model.actuator(name)) for name in {**last, **use}}
        coming = {name: value for name, value in last.items() if kinds[name] is not Dribbler}
        kicks = {name: max(value, use.get(name, 0.0)) for name, value in coming.items() if kinds[name] is Kicker}
        if wanted := {**coming, **use, **kicks}:
            self._wanted[robot.name] = robot, wanted

    def act(self, now: float, permission: Permission, poses: Floats, velocities: Floats) -> list[Pull]:
        """Kick, grip and let go at match time `now`, s, and return what dribblers do in this tick.

        Args:
            poses, velocities: those of the robots; see `Engine`.
        """
        wanted, self._wanted = self._wanted, {}
        pulls: list[Pull] = []
        for robot, use in wanted.values():
            if robot.command is None or not permission.may_use(robot.name, now):
                continue
            model, row, lasting = robot.model, robot.row, {}
            pose = Pose(*poses[row].tolist())
            for name, value in use.items():
                actuator = model.actuator(name)
                share = 0.0 if actuator is None else min(value, actuator.most)
                if isinstance(actuator, Gripper):
                    self._bodies.grip(row, pose, model, actuator, share > 0.0)
                elif isinstance(actuator, Kicker) and share > 0.0 and now >= robot.ready.get(name, 0.0):
                    twist, bodies = Twist(*velocities[row].tolist()), (body for _, body in self._bodies)
                    if kick(bodies, pose, twist, model, actuator, share):
                        robot.ready[name] = now + actuator.pause
                elif isinstance(actuator, Dribbler) and share > 0.0:
                    lasting[name] = value
                    pulls.append(Pull(row, model.length / 2, actuator, share * actuator.pull))
            if lasting:
                self._wanted[robot.name] = robot, lasting
        return pulls
