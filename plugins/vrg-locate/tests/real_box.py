"""A real box, as a match file has it."""

from vrg.hal.sim.config import BodySetup
from vrg.types import Pose

BOX = BodySetup(
    name="box", kind="box", pose=Pose(0.0, 0.0, 0.0), corners=((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)),
    mass=2.0, height=0.2, friction=0.3, restitution=0.1, tracked=True,
)  # fmt: skip
