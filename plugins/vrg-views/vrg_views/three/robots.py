"""The look of robots: the solids of a robot model in the frame of its body, on the ground, heading along +x."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from vrg.figures import rounded
from vrg.games import look
from vrg.games.game import Marker
from vrg.hal.models import RobotModel
from vrg.types import Vector
from vrg.ui import palette
from vrg_views.three.shapes import Mesh, circle, joined, loft, prism, raised, star

CABIN: Final = -0.2
"""The middle of the cabin, as a part of the robot's length ahead of its middle."""


@dataclass(frozen=True)
class RobotLook:
    """The parts of a robot, by what colours them.

    Args:
        paint: in the colour of its role. dark: rubber and windows. light: lamps and the housing of the range finder.
        tyre, hub: of one wheel, about its axle along y; empty for what flies. roof: the height at which its marker
            lies, m. eye: the viewpoint of a driver in it: how far ahead and how high, m.
    """

    paint: Mesh
    dark: Mesh
    light: Mesh
    tyre: Mesh
    hub: Mesh
    roof: float
    eye: Vector


@cache
def robot_look(model: RobotModel) -> RobotLook:
    """The parts of a robot of this model. Its drivetrain decides where the hull fits between the wheels."""
    train = model.drivetrain
    if not train.wheels:
        return _multirotor_look(model)
    radius, length, width = train.wheel_radius, model.length, model.width
    beside = [abs(wheel.y) for wheel in train.wheels if abs(math.sin(wheel.heading)) < 0.5]
    narrow = 2 * min(beside) - train.wheel_width - 0.02 if beside else 0.7 * width
    narrow = min(max(narrow, 0.3 * width), width)
    arch = min(2.06 * radius, 0.82 * model.height)
    belly, edge = 0.4 * radius, min(0.05, (model.height - arch) / 2)
    deck = rounded(length, width, 0.16 * width)
    hull = loft(
        raised(rounded(0.78 * length, narrow, 0.05), belly),
        raised(rounded(0.96 * length, narrow, 0.05), 0.5 * (belly + arch)),
        raised(rounded(0.96 * length, narrow, 0.05), arch),
    )
    fender = loft(
        raised(deck, arch, 0.97), raised(deck, arch + edge / 2), raised(deck, model.height - edge),
        raised(deck, model.height, 0.9),
    )  # fmt: skip
    tall = max(0.05, 0.28 * model.height)
    roof = model.height + tall
    shell = rounded(0.44 * length, 0.7 * width, 0.09)
    cabin = loft(
        raised(shell, model.height - 0.01), raised(shell, model.height + 0.35 * tall), raised(shell, roof - 0.01, 0.84),
        raised(shell, roof, 0.8),
    ).moved(CABIN * length)  # fmt: skip
    window = loft(
        raised(shell, model.height + 0.36 * tall, 1.01), raised(shell, roof - 0.012, 0.86)
    ).moved(CABIN * length)  # fmt: skip
    bumper = prism(rounded(0.05, 0.8 * narrow, 0.02), belly + 0.02, belly + 0.07).moved(0.48 * length)
    lamps = [
        prism(rounded(0.03, 0.14 * width, 0.012), arch + 0.15 * edge, model.height - edge).moved(
            0.49 * length, side * 0.3 * width
        )
        for side in (1, -1)
    ]
    dark, light, eye = [window, bumper], [*lamps], (0.1 * length, roof + 0.1)
    if model.scanner is not None and model.scanner.sweep is not None:
        mount, beam = model.scanner.sweep.mount, getattr(model.scanner, "height", roof)
        eye = mount.x + 0.11, max(roof, beam) + 0.1
        light.append(_housing(model.height - 0.01, beam).moved(mount.x, mount.y))
        dark.append(prism(circle(0.072, 20), beam - 0.022, beam + 0.022).moved(mount.x + 0.018, mount.y))
    return RobotLook(
        paint=joined([hull, fender, cabin]),
        dark=joined(dark),
        light=joined(light),
        tyre=_tyre(radius, train.wheel_width),
        hub=_axial(star(0.62 * radius, 0.3 * radius, 5), train.wheel_width + 0.012),
        roof=roof,
        eye=eye,
    )


def _multirotor_look(model: RobotModel) -> RobotLook:
    """A pod in the middle, from which four arms lead to rotors at the corners."""
    length, width, height = model.length, model.width, model.height
    radius = 0.24 * min(length, width)
    x, y = length / 2 - radius, width / 2 - radius
    corners = [(x, y), (-x, y), (-x, -y), (x, -y)]
    reach, thick = math.hypot(x, y), 0.03 * min(length, width)
    arms = [
        prism([(reach * c + thick * s, reach * s - thick * c), (reach * c - thick * s, reach * s + thick * c),
               (-reach * c - thick * s, -reach * s + thick * c), (-reach * c + thick * s, -reach * s - thick * c)],
              0.3 * height, 0.5 * height)
        for c, s in ((x / reach, y / reach), (-x / reach, y / reach))
    ]  # fmt: skip
    pod = prism(rounded(0.34 * length, 0.34 * width, 0.05 * width), 0.0, 0.7 * height, 0.02 * width)
    rotors = [prism(circle(radius), 0.85 * height, height).moved(*corner) for corner in corners]
    lamp = prism(rounded(0.04 * length, 0.12 * width, 0.01 * width), 0.2 * height, 0.5 * height).moved(0.18 * length)
    return RobotLook(
        paint=joined([pod, *rotors]), dark=joined(arms), light=lamp, tyre=joined([]), hub=joined([]), roof=height,
        eye=(0.2 * length, height),
    )  # fmt: skip


def _housing(bottom: float, beam: float) -> Mesh:
    """A laser range finder that stands on a deck and looks out at the height of its beam."""
    box = rounded(0.155, 0.155, 0.03)
    return joined([prism(box, bottom, beam - 0.024, 0.01), prism(box, beam + 0.024, beam + 0.07, 0.02)])


def _tyre(radius: float, width: float) -> Mesh:
    return _axial_rings((circle(0.86 * radius, 24), -width / 2), (circle(radius, 24), -0.32 * width),
                        (circle(radius, 24), 0.32 * width), (circle(0.86 * radius, 24), width / 2))  # fmt: skip


def _axial(outline: list[tuple[float, float]], width: float) -> Mesh:
    return _axial_rings((outline, -width / 2), (outline, width / 2))


def _axial_rings(*rings: tuple[list[tuple[float, float]], float]) -> Mesh:
    """A solid along the y axis of outlines in the plane of x and z."""
    flat = loft(*(raised(outline, at) for outline, at in rings))
    # (x, y, z) becomes (x, -z, y), a turn by which no triangle is turned inside out.
    turned = flat.vertices[:, [0, 2, 1]] * np.array((1, -1, 1), dtype=np.float32)
    return Mesh(turned, flat.faces)


@cache
def marker_mesh(marker: Marker) -> Mesh:
    """The sign of a role as a plate of about 1 m across, as windows draw it."""
    sign = look.marker(marker, 0.5, palette.TEXT)
    return prism(circle(sign.radius, 24) if sign.radius else sign.points, 0.0, 0.06)
