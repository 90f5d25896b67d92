"""A mouse that explores by flood fill. It knows its place by odometry and by the walls that its sensors see."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.agents import Strategy, View
from vrg.geometry import along_arc, compose, inverse, wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.portable.arrays import product
from vrg.portable.scalars import cos_sin, square
from vrg.types import STILL, Pose, Twist, Vector
from vrg_games.micromouse.maze import (
    CELL,
    EAST,
    NORTH,
    START,
    WALL,
    Cell,
    Edge,
    border,
    edge,
    flood,
    goal_cells,
    neighbour,
)

HEADINGS: Final = (math.pi / 2, 0.0, -math.pi / 2, math.pi)
"""The headings to the north, east, south and west, rad."""
GATE, NEAR_POST, STRAIGHT = 0.03, 0.03, 0.25
"""A range that differs from that of a wall by up to GATE, m, is one. Walls are noted only by beams that meet them more
than NEAR_POST, m, from a post, while the mouse is within STRAIGHT, rad, of a direction of the grid."""
NOISE: Final = 0.005
"""The standard deviation of a range, with what walls differ from the grid, m."""
SURE, CUT, ARRIVED = 0.13, 0.09, 0.008
"""The distances before the middle of a cell, m, at which its walls are known while the mouse searches, at which the
mouse begins to turn on an arc, and at which it has arrived."""
SLOW, AT_SLOW = 0.45, 0.02
"""The speed of the search and of arcs, m/s, and the way by which the mouse has that speed before it could stop, less
CUT, m."""
LAG, REACTION = 0.04, 0.15
"""The time from a reading to when the motors act on it, and that for which a speed is held before braking, s."""
TURNED: Final = 0.25
"""The angle up to which the mouse drives on the line while it turns into it, rad."""
DECELERATION, TURN_DECELERATION = 2.5, 60.0
"""With which the mouse plans to stop driving, m/s^2, and turning, rad/s^2."""


class Localisation:
    """An extended Kalman filter of the pose in the maze, and the walls that the beams have seen.

    Args:
        size: the number of cells along a side of the maze. mount: the distance of the sensors ahead of the centre, m.

    Attributes:
        pose: the mouse's estimate, in the maze's frame. walls: True where there is a wall, False where there is none.
    """

    def __init__(self, size: int, mount: float) -> None:
        self._mount = mount
        self.pose = Pose(CELL / 2, CELL / 2, HEADINGS[NORTH])
        self.walls = {**dict.fromkeys(border(size), True), edge(START, EAST): True, edge(START, NORTH): False}
        self._covariance = np.diag([1e-4, 1e-4, 4e-4])
        self._odometry: Pose | None = None

    def move(self, odometry: Pose) -> None:
        """Predict the pose by the way since the odometry before."""
        way = compose(inverse(self._odometry or odometry), odometry)
        self._odometry, before, self.pose = odometry, self.pose, compose(self.pose, way)
        dx, dy, far = self.pose.x - before.x, self.pose.y - before.y, math.hypot(way.x, way.y)
        by_heading = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
        slip = square(0.03 * far), square(0.03 * far), square(0.3 * far + 0.08 * abs(way.theta))
        self._covariance = product(product(by_heading, self._covariance), by_heading.T) + np.diag(slip)

    def see(self, scan: Laser) -> None:
        """Note the walls that beams meet and those that they miss, and correct the pose by those that are known."""
        straight = abs(math.remainder(self.pose.theta, math.pi / 2)) < STRAIGHT
        for turn, distance in zip(scan.angles.tolist(), scan.ranges.tolist(), strict=True):
            for expected, place, post, by_pose in self._crossed(turn, scan.range_max - GATE):
                if distance < expected - GATE or (post < NEAR_POST and not self.walls.get(place)):
                    break
                met = distance < expected + GATE
                if straight:
                    self.walls.setdefault(place, met)
                if met and self.walls.get(place):
                    self._correct(distance - expected, np.array(by_pose))
                if met or place not in self.walls:
                    break

    def _crossed(self, turn: float, reach: float) -> list[tuple[float, Edge, float, tuple[float, float, float]]]:
        """The places of walls that a beam crosses, the nearest first.

        Args:
            turn: of the beam in the mouse's frame, rad. reach: its length, m.

        Returns:
            for each the range of a wall there, m; the place; the distance from the nearest post, m; and the derivatives
            of the range by the pose.
        """
        mount, beam = cos_sin(self.pose.theta), cos_sin(self.pose.theta + turn)
        at = self.pose.x + self._mount * mount[0], self.pose.y + self._mount * mount[1]
        found = []
        for axis, along in enumerate(beam):
            step = 1 if along > 0.0 else -1
            line = math.floor(at[axis] / CELL) + (step > 0)
            # A beam that grazes a wall tells little.
            while abs(along) > 0.6 and (far := (line * CELL - step * WALL / 2 - at[axis]) / along) < reach:
                across = (at[1 - axis] + far * beam[1 - axis]) / CELL
                cell = math.floor(across)
                place = (cell, line - 1, NORTH) if axis else (line - 1, cell, EAST)
                dx, dy = (self._mount * mount[i] + far * beam[i] for i in (0, 1))
                by_pose = (0.0, -1 / along, -dx / along) if axis else (-1 / along, 0.0, dy / along)
                found.append((far, place, min(across - cell, cell + 1 - across) * CELL, by_pose))
                line += step
        return sorted(found)

    def _correct(self, error: float, by_pose: npt.NDArray[np.float64]) -> None:
        shared = product(self._covariance, by_pose)
        gain = shared / (float(product(by_pose[None, :], shared)[0]) + square(NOISE))
        self._covariance = self._covariance - gain[:, None] * shared[None, :]
        dx, dy, turn = (gain * error).tolist()
        self.pose = Pose(self.pose.x + dx, self.pose.y + dy, wrap(self.pose.theta + turn))


class FloodFill(Strategy):
    """Searches the middle as if no wall were where none was seen, returns in the same way, and runs the shortest way
    over cells that it knows, once no unknown wall could be missing on a shorter one. It stops only to turn round.
    """

    games = ("micromouse",)
    mode = "Search"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._place: Localisation | None = None
        self._goals = [START]
        self._target, self._side = START, NORTH

    def act(self, view: View) -> Twist:
        """Take in the odometry and the ranges, and drive on."""
        field, spec = view.zone("field"), self.robot.sensor(LaserSpec)
        odometry, scan = view.readings.latest(Odometry), view.readings.latest(Laser)
        if field is None or spec is None or odometry is None or scan is None:
            return STILL
        if self._place is None:
            size = round(field.bounds[2] / CELL)
            self._place, self._goals = Localisation(size, spec.x), goal_cells(size)
        self._place.move(odometry.value.pose)
        self._place.see(scan.value)
        if not view.me.may_move:
            return STILL
        pose = along_arc(self._place.pose, odometry.value.twist, LAG)
        return self._drive(self._place.walls, pose, odometry.value.twist.v)

    def _drive(self, walls: dict[Edge, bool], pose: Pose, speed: float) -> Twist:
        """Choose the next cells as far as their walls are known, and drive towards them."""
        goals, corner = [START] if self.mode == "Return" else self._goals, False
        while True:
            left = self._offset(pose)[0]
            if self._target in goals:
                if left > ARRIVED:
                    break
                self.mode = "Return" if self.mode != "Return" else self._next_mode(walls)
                return STILL
            if left > SURE and self.mode != "Run":
                break
            side = self._way(walls, goals)
            is_open, turns = walls.get(edge(self._target, side)) is False, (side - self._side) % 4
            corner = is_open and turns in (1, 3)
            if is_open and (turns == 0 or (corner and left <= CUT)):
                self._target = neighbour(self._target, side)
            elif left > ARRIVED or turns == 0:
                break
            self._side, corner = side, False
        return self._steer(pose, left + AT_SLOW if corner else left, speed)

    def _next_mode(self, walls: dict[Edge, bool]) -> str:
        """Run if no unknown wall could make the way shorter."""
        known = flood(self._goals, lambda place: walls.get(place) is False)
        return "Run" if known.get(START) == flood(self._goals, lambda place: not walls.get(place))[START] else "Search"

    def _way(self, walls: dict[Edge, bool], goals: list[Cell]) -> int:
        """The direction from the target to the nearest goal: straight ahead if that is as short."""
        unknown = self.mode == "Run"
        steps = flood(goals, lambda place: not walls.get(place, unknown))
        sides = [side for side in range(4) if not walls.get(edge(self._target, side), unknown)] or [self._side]
        return min(
            sides, key=lambda side: (steps.get(neighbour(self._target, side), math.inf), (side - self._side) % 4)
        )

    def _offset(self, pose: Pose) -> Vector:
        """The middle of the target ahead and to the left of the mouse, m, in the frame of the present direction."""
        cos, sin = cos_sin(HEADINGS[self._side])
        dx, dy = (self._target[0] + 0.5) * CELL - pose.x, (self._target[1] + 0.5) * CELL - pose.y
        return cos * dx + sin * dy, cos * dy - sin * dx

    def _steer(self, pose: Pose, left: float, speed: float) -> Twist:
        """Turn on an arc that ends on the middle line to the target, or in place; then drive on that line.

        Args:
            left: the way in which the mouse must be able to stop, m. speed: its present speed, m/s.
        """
        turn, aside = wrap(HEADINGS[self._side] - pose.theta), self._offset(pose)[1]
        if abs(turn) > TURNED:
            w = _braking(turn, TURN_DECELERATION)
            radius = max(0.0, -math.copysign(aside, turn * aside)) / (1.0 - cos_sin(turn)[0])
            slower = min(1.0, SLOW / max(1e-9, radius * abs(w)))
            return Twist(radius * abs(w) * slower, w * slower)
        fastest = self.robot.v_max if self.mode == "Run" else SLOW
        # Wheels that speed up as fast as they can leave nothing to steer with.
        v = min(fastest, _braking(left, DECELERATION), speed + 0.07 * self.robot.a_max)
        return Twist(v, (turn + max(-0.2, min(0.2, aside / (0.1 + 0.3 * abs(v))))) / 0.2)


def _braking(left: float, deceleration: float) -> float:
    """The speed with which one can still stop in a way or an angle that is left, if one holds it for REACTION first."""
    speed = deceleration * (math.sqrt(REACTION * REACTION + 2 * abs(left) / deceleration) - REACTION)
    return math.copysign(speed, left)
