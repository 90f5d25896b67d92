"""The PyBullet engine: rigid bodies that stand on wheels, and wheels that slip and scrub.

PyBullet computes the bodies: their weight, inertia, and contacts with walls and each other. The wheels stand on the
ground without friction, and get the forces of vrg.hal.sim.engines.traction. PyBullet's own friction at a wheel is a
pyramid along the map's axes (or, as a cone, far too weak), which made the turn rate vary by 15 to 40 % with the heading
at any affordable number of iterations.

A kinematic body has no mass. Before each physics step it is set to its place, with its speed, so that the solver pushes
the other bodies at that speed. It is far taller than they are, so that no body is ever pushed on top of it.

A step gives the same bits again on one computer, but not on every one: PyBullet takes sines and arc tangents from the C
library, whose last bits vary with the processor.
"""

import math
from collections.abc import Sequence

import numpy as np

from vrg.hal.models import RobotModel
from vrg.hal.sim.engines import check_installed
from vrg.hal.sim.engines.engine import CONTACT, Engine, Floats, Push, Start, bumper_bit
from vrg.hal.sim.engines.traction import MAX_PHYSICS_STEP, Traction
from vrg.hal.sim.map import WALL_HEIGHT, Map
from vrg.hal.sim.robot import GRAVITY
from vrg.hal.sim.shapes import Box, box_gap, circle_gap
from vrg.modules import silent_errors
from vrg.portable.scalars import atan2, cos_sin, total

check_installed("pybullet")
with silent_errors():
    import pybullet

ITERATIONS = 10
"""The number of iterations of the constraint solver."""
BODY_FRICTION = 0.2
"""The coefficient of friction between bodies, and between a body and a wall."""
_CLEARANCE = 0.05
"""The ground clearance of a body, m."""
_RAY, _GROUND, _WALL, _BODY, _WHEEL, _KINEMATIC = 1, 2, 4, 8, 16, 32
"""The collision groups. Wheels meet only the ground, bodies meet bodies and walls, and kinematic bodies meet only the
other bodies. PyBullet's rays are in group 1."""
_TALL = 10.0
"""The height of a kinematic body above and below the axles, m."""
_SQUEEZED = 0.02
"""The depth in m that a body may be pressed into a wall. Beyond it the kinematic body lets the other body through."""


class BulletEngine(Engine):
    """An engine that moves rigid bodies with PyBullet, in a physics client of its own without a window."""

    def __init__(self, map_: Map, robots: Sequence[Start]) -> None:
        super().__init__(map_, robots)
        self._client = pybullet.connect(pybullet.DIRECT)
        self._open = True
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=self._client)
        self._build_map()
        self._bodies = [
            self._build_kinematic(robot.model) if robot.kinematic else self._build_robot(robot.model)
            for robot in robots
        ]
        self._passing: set[tuple[int, int]] = set()
        """The pairs of a kinematic body and a body that it lets through until the two are apart."""
        self._traction = Traction(robots)
        self._forces: Floats = np.zeros((len(robots), 3))
        self._places = [(0.0, 0.0, 0.0)] * len(robots)
        """The place of each body, m."""
        self._cos, self._sin, self._rates = np.ones(len(robots)), np.zeros(len(robots)), np.zeros((len(robots), 3))
        """The cosine and the sine of each heading; the speeds along x and y in m/s, and the turn rate in rad/s."""
        for row in range(len(robots)):
            self._placed(row)

    def step(self, dt: float) -> None:
        """Advance by dt seconds, in physics steps of at most MAX_PHYSICS_STEP."""
        client = self._client
        steps = max(1, math.ceil(dt / MAX_PHYSICS_STEP - 1e-9))
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=dt / steps,
            numSolverIterations=ITERATIONS,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        self._accelerate(dt)
        aims = self.speeds
        aims[self._braking] = 0.0  # the wheels lock at once; friction decides how fast that stops the body
        self.angles += aims * dt
        rims = self._traction.rims(aims)
        carried = self.kinematic.nonzero()[0].tolist()
        driven = (~self.kinematic).nonzero()[0].tolist()
        for remaining_steps in range(steps, 0, -1):
            for row in carried:
                self._carry(row, remaining_steps * dt / steps)
            self._pull(dt / steps, rims, driven)
            pybullet.stepSimulation(physicsClientId=client)
            for row in carried:
                self._restrain(row)
            self._look(driven)
        self._read()
        for row in carried:
            self.touch[row] = self._pressed(self._bodies[row], self.models[row], *self.poses[row].tolist())
        if self._passing:
            self._let_through()

    def close(self) -> None:
        """Disconnect from the physics client. Idempotent."""
        if self._open:
            self._open = False
            pybullet.disconnect(physicsClientId=self._client)

    def _placed(self, row: int) -> None:
        body, model = self._bodies[row], self.models[row]
        x, y, theta = self.poses[row].tolist()
        self._traction.release(row)
        pybullet.resetBasePositionAndOrientation(
            body, (x, y, model.drivetrain.wheel_radius), _turn(theta), physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(body, (0, 0, 0), (0, 0, 0), physicsClientId=self._client)
        self._look([row])

    def _pushed(self, push: Push) -> None:
        client, body = self._client, self._bodies[push.row]
        (vx, vy, vz), (wx, wy, wz) = pybullet.getBaseVelocity(body, physicsClientId=client)
        if push.dx or push.dy:
            (x, y, z), turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
            place = (x + push.dx, y + push.dy, z)
            pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=client)
        speeds = (vx + push.vx, vy + push.vy, vz)
        pybullet.resetBaseVelocity(body, speeds, (wx, wy, wz + push.w), physicsClientId=client)
        self._look([push.row])

    def _moved(self, row: int, way: float, turn: float) -> None:
        """Do nothing: the next step moves the body there."""

    def _carry(self, row: int, ahead: float) -> None:
        """Set a kinematic body to where it is `ahead` seconds before it reaches its pose."""
        client, body, model = self._client, self._bodies[row], self.models[row]
        x, y, theta = self.poses[row].tolist()
        v, w, side = self.velocities[row].tolist()
        # A measured speed may be wrong by any amount; a body must not be pushed faster than a robot drives.
        v, side = max(-model.v_max, min(v, model.v_max)), max(-model.v_max, min(side, model.v_max))
        w = max(-model.w_max, min(w, model.w_max))
        c, s = cos_sin(theta)
        vx, vy = v * c - side * s, v * s + side * c
        place = (x - vx * ahead, y - vy * ahead, model.drivetrain.wheel_radius)
        turn = _turn(theta - w * ahead)
        pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=client)
        pybullet.resetBaseVelocity(body, (vx, vy, 0.0), (0.0, 0.0, w), physicsClientId=client)

    def _restrain(self, row: int) -> None:
        """Keep a kinematic body from throwing the bodies that it touches away or through a wall.

        A kinematic body may appear deep inside another body, and the solver drives the two apart at any speed.
        """
        client = self._client
        contacts = pybullet.getContactPoints(bodyA=self._bodies[row], physicsClientId=client)
        met = {contact[2] for contact in contacts}
        for body in sorted(met):
            model = self.models[self._bodies.index(body)]
            (vx, vy, vz), (wx, wy, wz) = pybullet.getBaseVelocity(body, physicsClientId=client)
            scale = min(1.0, max(model.v_max, self.models[row].v_max) / max(math.hypot(vx, vy), 1e-9))
            turn = max(-model.w_max, min(wz, model.w_max))
            if scale < 1.0 or turn != wz:
                pybullet.resetBaseVelocity(body, (vx * scale, vy * scale, vz), (wx, wy, turn), physicsClientId=client)
        if met:
            self._relieve(self._bodies[row], met)

    def _relieve(self, kinematic: int, met: set[int]) -> None:
        """Let bodies through that are caught between a kinematic body and a wall, also if others are in between."""
        chain, new = set(met), set(met)
        while new:
            touched = {
                contact[2]
                for body in new
                for contact in pybullet.getContactPoints(bodyA=body, linkIndexA=-1, physicsClientId=self._client)
            }
            new = {b for b in touched if b in self._bodies and not self.kinematic[self._bodies.index(b)]} - chain
            chain |= new
        if any(self._wall_depth(body) > _SQUEEZED for body in chain):
            for body in met:
                self._meet((kinematic, body), False)

    def _meet(self, pair: tuple[int, int], do: bool) -> None:
        """Set whether a kinematic body and another body collide from now on."""
        pybullet.setCollisionFilterPair(*pair, -1, -1, int(do), physicsClientId=self._client)
        if do:
            self._passing.discard(pair)
        else:
            self._passing.add(pair)

    def _let_through(self) -> None:
        """Press the bumpers of bodies that are being let through, and let those collide again that are apart now."""
        for pair in sorted(self._passing):
            rows = [self._bodies.index(body) for body in pair]
            gap = box_gap(*(self._footprint(row) for row in rows))
            if gap.distance > CONTACT:
                self._meet(pair, True)
                continue
            for row in rows:
                x, y, theta = self.poses[row].tolist()
                self.touch[row] |= bumper_bit(self.models[row], atan2(gap.y - y, gap.x - x) - theta)

    def _wall_depth(self, body: int) -> float:
        """The depth in m by which a body is in a wall or an obstacle; negative if it touches none."""
        (x, y, _), turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        model = self.models[self._bodies.index(body)]
        box = Box(x, y, _yaw(turn), model.length, model.width)
        gaps = [box_gap(box, wall).distance for wall in self.map.boxes]
        gaps += [circle_gap(box, disc).distance for disc in self.map.circles]
        return -min(gaps, default=0.0)

    def _footprint(self, row: int) -> Box:
        x, y, theta = self.poses[row].tolist()
        return Box(x, y, theta, self.models[row].length, self.models[row].width)

    def _pull(self, dt: float, rims: Floats, rows: list[int]) -> None:
        """Apply the traction of the wheels of these bodies for the next physics step, of dt seconds.

        Args:
            rims: the speeds of the rims of all wheels, m/s.
        """
        self._traction.press(dt, self._cos, self._sin, self._rates, rims, self._forces)
        client, forces = self._client, self._forces.tolist()
        for row in rows:
            (x, y, moment), body = forces[row], self._bodies[row]
            place = self._places[row]
            pybullet.applyExternalForce(body, -1, (x, y, 0.0), place, pybullet.WORLD_FRAME, physicsClientId=client)
            pybullet.applyExternalTorque(body, -1, (0.0, 0.0, moment), pybullet.WORLD_FRAME, physicsClientId=client)

    def _look(self, rows: list[int]) -> None:
        """Find where these bodies are, and how they move."""
        for row in rows:
            body = self._bodies[row]
            place, (x, y, z, w) = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
            (vx, vy, _), (_, _, rate) = pybullet.getBaseVelocity(body, physicsClientId=self._client)
            cos, sin = 1.0 - 2.0 * (y * y + z * z), 2.0 * (w * z + x * y)
            length = math.sqrt(cos * cos + sin * sin)  # below 1 of a body that leans
            self._places[row] = place
            self._cos[row], self._sin[row], self._rates[row] = cos / length, sin / length, (vx, vy, rate)

    def _read(self) -> None:
        turns, rates = zip(self._cos.tolist(), self._sin.tolist(), strict=True), self._rates.tolist()
        for row, ((x, y, _), (cos, sin), (vx, vy, w)) in enumerate(zip(self._places, turns, rates, strict=True)):
            if self.kinematic[row]:
                continue
            theta = atan2(sin, cos)
            self.poses[row] = x, y, theta
            self.velocities[row] = vx * cos + vy * sin, w, vy * cos - vx * sin
            self.touch[row] = self._pressed(self._bodies[row], self.models[row], x, y, theta)

    def _pressed(self, body: int, model: RobotModel, x: float, y: float, theta: float) -> int:
        """The bumpers in contact, as bits. A side against something touches it at both ends, so the middle counts."""
        points: dict[int, list[tuple[float, float]]] = {}
        for contact in pybullet.getContactPoints(bodyA=body, linkIndexA=-1, physicsClientId=self._client):
            if contact[8] < CONTACT:
                points.setdefault(contact[2], []).append(contact[5][:2])
        touch = 0
        for places in points.values():
            px, py = (total(axis) / len(places) for axis in zip(*places, strict=True))
            touch |= bumper_bit(model, atan2(py - y, px - x) - theta)
        return touch

    def _build_map(self) -> None:
        client = self._client
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        ground = pybullet.createMultiBody(0, plane, physicsClientId=client)
        pybullet.changeDynamics(ground, -1, lateralFriction=1.0, physicsClientId=client)
        pybullet.setCollisionFilterGroupMask(ground, -1, _GROUND, _WHEEL, physicsClientId=client)
        height = (0.0, 0.0, WALL_HEIGHT / 2)
        for box in self.map.boxes:
            half = (box.length / 2, box.width / 2, WALL_HEIGHT / 2)
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
            self._fix(shape, (box.x, box.y, height[2]), _turn(box.heading))
        for circle in self.map.circles:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER, radius=circle.radius, height=WALL_HEIGHT, physicsClientId=client
            )
            self._fix(shape, (circle.x, circle.y, height[2]), (0.0, 0.0, 0.0, 1.0))

    def _fix(self, shape: int, place: tuple[float, float, float], turn: tuple[float, float, float, float]) -> None:
        client = self._client
        body = pybullet.createMultiBody(0, shape, basePosition=place, baseOrientation=turn, physicsClientId=client)
        pybullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=client)
        pybullet.setCollisionFilterGroupMask(body, -1, _WALL, _BODY | _RAY, physicsClientId=client)

    def _build_robot(self, model: RobotModel) -> int:
        """Build a box on a sphere for each wheel. Its origin and its centre of mass are at the height of the axles."""
        client, drivetrain = self._client, model.drivetrain
        tall = model.height - _CLEARANCE
        hull = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=(model.length / 2, model.width / 2, tall / 2),
            collisionFramePosition=(0.0, 0.0, _CLEARANCE + tall / 2 - drivetrain.wheel_radius),
            physicsClientId=client,
        )
        wheel = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=drivetrain.wheel_radius, physicsClientId=client
        )
        places = [(wheel.x, wheel.y, 0.0) for wheel in drivetrain.wheels]
        count = len(places)
        flat = (0.0, 0.0, 0.0, 1.0)
        body: int = pybullet.createMultiBody(
            model.mass,
            hull,
            linkMasses=[0.0] * count,
            linkCollisionShapeIndices=[wheel] * count,
            linkVisualShapeIndices=[-1] * count,
            linkPositions=places,
            linkOrientations=[flat] * count,
            linkInertialFramePositions=[(0.0, 0.0, 0.0)] * count,
            linkInertialFrameOrientations=[flat] * count,
            linkParentIndices=[0] * count,
            linkJointTypes=[pybullet.JOINT_FIXED] * count,
            linkJointAxis=[(0.0, 1.0, 0.0)] * count,
            physicsClientId=client,
        )
        m, a, b, h = model.mass / 12, model.length, model.width, tall
        inertia = (m * (b * b + h * h), m * (a * a + h * h), m * (a * a + b * b))
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=BODY_FRICTION,
            linearDamping=0.0,
            angularDamping=0.0,
            localInertiaDiagonal=inertia,
            physicsClientId=client,
        )
        pybullet.setCollisionFilterGroupMask(body, -1, _BODY, _BODY | _WALL | _RAY | _KINEMATIC, physicsClientId=client)
        for link in range(count):
            pybullet.changeDynamics(body, link, lateralFriction=0.0, physicsClientId=client)
            pybullet.setCollisionFilterGroupMask(body, link, _WHEEL, _GROUND, physicsClientId=client)
        return body

    def _build_kinematic(self, model: RobotModel) -> int:
        client = self._client
        half = (model.length / 2, model.width / 2, _TALL)
        hull = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
        body: int = pybullet.createMultiBody(0.0, hull, physicsClientId=client)
        pybullet.changeDynamics(body, -1, lateralFriction=BODY_FRICTION, physicsClientId=client)
        pybullet.setCollisionFilterGroupMask(body, -1, _KINEMATIC, _BODY | _RAY, physicsClientId=client)
        return body


def _turn(heading: float) -> tuple[float, float, float, float]:
    """The quaternion of a heading in rad, as PyBullet orders its parts."""
    cos, sin = cos_sin(heading / 2)
    return 0.0, 0.0, sin, cos


def _yaw(quaternion: tuple[float, float, float, float]) -> float:
    x, y, z, w = quaternion
    return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
