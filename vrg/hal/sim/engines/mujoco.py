"""The MuJoCo engine: rigid bodies in the plane, on wheels that slip and scrub.

Each body has three joints: it slides along both axes of the map, and it turns. So poses and velocities are rows of
MuJoCo's own arrays, and this module reads and presses all robots at once. The traction of the wheels is that of
vrg.hal.sim.engines.traction; MuJoCo finds the contacts and solves for their forces, without friction.

For the contacts this module sets the accelerations that the solver aims for (`efc_aref`). MuJoCo's own are those of a
stiff spring, which throws bodies far apart that begin deep inside one another. These let two bodies come as near in a
physics step as they are apart, so that nothing is tunnelled, and part at EASE if they overlap.

A kinematic body is set to its place, with its speed, before each physics step. During the step it has its mass, so that
what it presses with is bounded: a body that is caught between it and a wall overlaps with it rather than with the wall.

The state is in the arrays of `Engine`, and in the stretch of the tyres. The solver starts again in each step.

A step gives the same bits on every x86-64 computer with the same build of MuJoCo. That would take the sines of the
hinges from the C library, whose last bits vary with the processor. So the zero of a body's hinge is always where the
body heads, which takes no sine, and what turns with the body is the frame of its inertia, to which its shape belongs:
this module sets both (`_settle`). The rest of a step is sums, products, quotients and roots. Builds of MuJoCo for other
processors contract a product and a sum into one operation, so that their last bits are others.
"""

import math
from collections.abc import Sequence

import numpy as np

from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.engines import MUJOCO, check_installed
from vrg.hal.sim.engines.engine import CONTACT, Engine, Floats, Start, bumper_bit
from vrg.hal.sim.engines.traction import MAX_PHYSICS_STEP, Traction
from vrg.hal.sim.map import Map
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import atan2, cos_sin

check_installed(MUJOCO)

import mujoco  # noqa: E402 - what is wrong with it is said before

EASE = 0.5
"""The speed in m/s at which bodies that overlap part at most."""
_PARTING = 0.2
"""The part of an overlap that is undone in one physics step, unless that takes a speed above EASE."""
_NEAR = 0.05
"""The distance in m below which a contact is solved for: two bodies come nearer by it in a physics step at 5 m/s."""
_HARDNESS = 0.99
"""The part of the aimed acceleration that a contact reaches against what presses on it."""
_WALL, _BODY, _KINEMATIC = 1, 2, 4
"""The kinds of shapes. Bodies meet all of them; neither walls nor kinematic bodies meet kinematic bodies."""
_JOINTS = (
    (mujoco.mjtJoint.mjJNT_SLIDE, (1, 0, 0)),
    (mujoco.mjtJoint.mjJNT_SLIDE, (0, 1, 0)),
    (mujoco.mjtJoint.mjJNT_HINGE, (0, 0, 1)),
)


class MujocoEngine(Engine):
    """An engine that moves rigid bodies with MuJoCo."""

    def __init__(self, map_: Map, robots: Sequence[Start]) -> None:
        super().__init__(map_, robots)
        self._traction = Traction(robots)
        self._carried = self.kinematic.nonzero()[0]
        self._walls = len(map_.boxes) + len(map_.circles)
        self._model = self._build()
        self._data = mujoco.MjData(self._model)
        self._places, self._speeds, self._forces = (
            array.reshape(-1, 3) for array in (self._data.qpos, self._data.qvel, self._data.qfrc_applied)
        )
        self._zeros = self._model.qpos0.reshape(-1, 3)
        self._frames = self._model.body_iquat[1:]
        self._cos, self._sin = np.ones(len(robots)), np.zeros(len(robots))
        """Those of the headings in `_places`; `_settle` keeps them up to date."""
        self._bodies = self._places, self._speeds, self._zeros, self._frames, self._cos, self._sin
        self._fastest = np.array([(m.v_max, m.v_max, m.w_max) for m in self.models]).reshape(-1, 3)
        self._bound = 2.0 * self._fastest.max(axis=0, initial=0.0)
        self._unbound = np.full(3, math.inf)

    def step(self, dt: float) -> None:
        """Advance by dt seconds, in physics steps of at most MAX_PHYSICS_STEP."""
        if not self.names:
            return
        self._accelerate(dt)
        aims = self.speeds
        aims[self._braking] = 0.0  # the wheels lock at once; friction decides how fast that stops the body
        self.angles += aims * dt
        steps = max(1, math.ceil(dt / MAX_PHYSICS_STEP - 1e-9))
        self._model.opt.timestep = dt / steps
        self._depart()
        self._move(dt / steps, steps, self._traction.rims(aims))
        self._arrive()
        self._feel()

    def close(self) -> None:
        """Do nothing: this engine holds nothing that must be released."""

    def _placed(self, row: int) -> None:
        self._traction.release(row)

    def _moved(self, row: int, way: float, turn: float) -> None:
        """Do nothing: the next step moves the body there."""

    def _move(self, dt: float, steps: int, rims: Floats) -> None:
        """Make the physics steps, of dt seconds each.

        Args:
            rims: the speeds of the rims of all wheels, m/s.
        """
        model, data, places, speeds = self._model, self._data, self._places, self._speeds
        carried = self._carried
        if carried.size:
            # A measured speed may be wrong by any amount; a body must not be pushed faster than a robot drives.
            rates = np.clip(speeds[carried], -self._fastest[carried], self._fastest[carried])
            ends = places[carried]
        for left_over in range(steps, 0, -1):
            if carried.size:
                places[carried] = ends - rates * (left_over * dt)
                speeds[carried] = rates
                self._settle(self._unbound)
            self._traction.press(dt, self._cos, self._sin, speeds, rims, self._forces)
            mujoco.mj_step1(model, data)
            if data.nefc:  # one row for each contact
                gaps = data.efc_pos
                wanted = np.minimum(np.where(gaps > 0.0, -1.0, -_PARTING) * gaps / dt, EASE)
                data.efc_aref[:] = (wanted - data.efc_vel) / dt
            mujoco.mj_step2(model, data)
            # A body that is pressed from several sides at once must not be thrown out.
            self._settle(self._bound)

    def _depart(self) -> None:
        """Give MuJoCo's bodies the poses and velocities of the robots."""
        if kernel is not None:
            kernel.depart(*self._bodies, self.poses, self.velocities)
            return
        self._places[:] = self.poses
        self._settle(self._unbound)
        cos, sin, (v, w, side) = self._cos, self._sin, self.velocities.T
        self._speeds[:] = np.array((v * cos - side * sin, v * sin + side * cos, w)).T

    def _settle(self, bound: Floats) -> None:
        """Bound the speeds, turn the frames of bodies whose headings have changed, and find their cosines and sines.

        Args:
            bound: the highest speeds along x and y in m/s, and the highest turn rate in rad/s.
        """
        if kernel is not None:
            kernel.settle(*self._bodies, bound)
            return
        np.maximum(self._speeds, -bound, out=self._speeds)
        np.minimum(self._speeds, bound, out=self._speeds)
        turned = (self._places[:, 2] != self._zeros[:, 2]).nonzero()[0]
        if not turned.size:
            return
        headings = self._places[turned, 2]
        cos, sin = cos_sin_array(headings * 0.5)
        self._zeros[turned, 2] = headings
        self._frames[turned, 0], self._frames[turned, 3] = cos, sin
        self._cos[turned], self._sin[turned] = cos * cos - sin * sin, 2.0 * cos * sin

    def _arrive(self) -> None:
        """Give the robots that drive themselves the poses and velocities of MuJoCo's bodies."""
        if kernel is not None:
            kernel.arrive(*self._bodies, self.kinematic, self.poses, self.velocities)
            return
        heading, (vx, vy, w), drives = self._places[:, 2], self._speeds.T, ~self.kinematic[:, None]
        cos, sin = self._cos, self._sin
        heading -= np.round(heading / (2 * math.pi)) * (2 * math.pi)
        np.copyto(self.poses, self._places, where=drives)
        np.copyto(self.velocities, np.array((vx * cos + vy * sin, w, vy * cos - vx * sin)).T, where=drives)

    def _feel(self) -> None:
        """Find the bumpers in contact. A side against something touches it at both ends, so the middle counts."""
        self.touch = [0] * len(self.names)
        if not self._data.ncon:
            return
        contacts = self._data.contact
        near = contacts.dist < CONTACT
        if not near.any():
            return
        sums: dict[tuple[int, int], list[float]] = {}  # of each pair of shapes: of x, of y, and of contacts
        pairs = contacts.geom[near] - self._walls
        for (first, second), (x, y) in zip(pairs.tolist(), contacts.pos[near, :2].tolist(), strict=True):
            total = sums.setdefault((first, second), [0.0, 0.0, 0.0])
            total[:] = total[0] + x, total[1] + y, total[2] + 1.0
        for pair, (x, y, count) in sums.items():
            for row in pair:
                if row >= 0:
                    at_x, at_y, theta = self.poses[row].tolist()
                    self.touch[row] |= bumper_bit(self.models[row], atan2(y / count - at_y, x / count - at_x) - theta)

    def _build(self) -> mujoco.MjModel:
        """Build the model of the map and of all robots, in the plane of the joints.

        Boxes are as tall as they are wide, so that the shortest way out of one is sideways. A column is a sphere: what
        is upright meets it there as it meets a circle, and at one point.
        """
        off = mujoco.mjtDisableBit
        spec, shape = mujoco.MjSpec(), mujoco.mjtGeom
        spec.option.disableflags = off.mjDSBL_GRAVITY | off.mjDSBL_WARMSTART
        contact = {"margin": _NEAR, "condim": 1, "solimp": (_HARDNESS, _HARDNESS, 1.0, 0.5, 1.0)}
        for box in self.map.boxes:
            cos, sin = cos_sin(box.heading / 2)
            spec.worldbody.add_geom(
                type=shape.mjGEOM_BOX,
                size=_half(box.length, box.width),
                pos=(box.x, box.y, 0.0),
                quat=(cos, 0.0, 0.0, sin),
                contype=_WALL,
                conaffinity=0,
                **contact,
            )
        for circle in self.map.circles:
            at, size = (circle.x, circle.y, 0.0), (circle.radius, 0.0, 0.0)
            spec.worldbody.add_geom(
                type=shape.mjGEOM_SPHERE, size=size, pos=at, contype=_WALL, conaffinity=0, **contact
            )
        for model, kinematic in zip(self.models, self.kinematic.tolist(), strict=True):
            body = spec.worldbody.add_body()
            for kind, axis in _JOINTS:
                body.add_joint(type=kind, axis=axis)
            body.add_geom(
                type=shape.mjGEOM_BOX,
                size=_half(model.length, model.width),
                mass=model.mass,
                contype=_KINEMATIC if kinematic else _BODY,
                conaffinity=0 if kinematic else _WALL | _BODY | _KINEMATIC,
                **contact,
            )
        built = spec.compile()
        built.body_sameframe[1:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        built.geom_sameframe[self._walls :] = mujoco.mjtSameFrame.mjSAMEFRAME_INERTIA
        return built


def _half(length: float, width: float) -> tuple[float, float, float]:
    """The half sizes of a box that is as tall as its diagonal, m."""
    return length / 2, width / 2, math.hypot(length, width) / 2
