"""A physics engine in which every robot does at once and exactly what it is told, and nothing collides."""

from vrg.geometry import along_arc, wrap
from vrg.hal.sim.engines.engine import Engine
from vrg.types import Pose


class IdealEngine(Engine):
    def step(self, dt: float) -> None:
        for row, model in enumerate(self.models):
            if self.kinematic[row]:
                continue
            self.speeds[row] = self._targets[row]
            axes = len(model.drivetrain.axes)
            twist = model.drivetrain.twist(self.speeds[row, :axes])
            pose = along_arc(Pose(*self.poses[row]), twist, dt)
            self.poses[row] = pose.x, pose.y, wrap(pose.theta)
            self.velocities[row] = twist.v, twist.w, twist.side
            self.angles[row] += self.speeds[row] * dt

    def close(self) -> None:
        pass

    def _placed(self, row: int) -> None:
        pass

    def _moved(self, row: int, way: float, turn: float) -> None:
        pass
