"""Solids as triangles. Lengths are in m, z points up, and outlines are convex or star-shaped, counter-clockwise."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrg.types import Vector

Floats = npt.NDArray[np.float32]
"""An array of 32-bit floats, as the browser's graphics library takes them."""


@dataclass(frozen=True)
class Mesh:
    """Triangles.

    Args:
        vertices: shape (n, 3), m. faces: the numbers of the corners of each triangle, seen from outside
            counter-clockwise, shape (m, 3).
    """

    vertices: Floats
    faces: npt.NDArray[np.uint32]

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> "Mesh":
        """The same solid elsewhere."""
        return Mesh(self.vertices + np.array((x, y, z), dtype=np.float32), self.faces)


def joined(meshes: Iterable[Mesh]) -> Mesh:
    """Several solids as one; without any it has no triangle."""
    vertices, faces, count = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.uint32)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.uint32(count))
        count += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def loft(*rings: npt.ArrayLike) -> Mesh:
    """The solid whose skin runs from ring to ring, closed at both ends.

    Args:
        rings: each of shape (k, 3) with the same k, from the lowest to the highest.
    """
    stack = np.asarray(rings, dtype=np.float32)
    levels, count, _ = stack.shape
    here = np.arange(count, dtype=np.uint32)
    after = np.roll(here, -1)
    faces = []
    for level in range(levels - 1):
        low, high = level * count, (level + 1) * count
        faces.append(np.stack((here + low, after + low, after + high), axis=1))
        faces.append(np.stack((here + low, after + high, here + high), axis=1))
    bottom, top = np.uint32(levels * count), np.uint32(levels * count + 1)
    faces.append(np.stack((after, here, np.full(count, bottom)), axis=1))
    last = (levels - 1) * count
    faces.append(np.stack((here + last, after + last, np.full(count, top)), axis=1))
    middles = np.stack((stack[0].mean(axis=0), stack[-1].mean(axis=0)))
    vertices = np.concatenate((stack.reshape(-1, 3), middles))
    return Mesh(vertices, np.concatenate(faces).astype(np.uint32))


def raised(outline: npt.ArrayLike, z: float, scale: float = 1.0) -> Floats:
    """An outline as a ring at a height, scaled about the origin."""
    points = np.asarray(outline, dtype=np.float32) * scale
    return np.column_stack((points, np.full(len(points), z, dtype=np.float32)))


def prism(outline: npt.ArrayLike, bottom: float, top: float, chamfer: float = 0.0) -> Mesh:
    """An outline drawn up from one height to another; `chamfer` breaks its upper edge, m."""
    if chamfer <= 0.0:
        return loft(raised(outline, bottom), raised(outline, top))
    return loft(raised(outline, bottom), raised(outline, top - chamfer), raised(inset(outline, chamfer), top))


def sheet(outline: npt.ArrayLike, z: float) -> Mesh:
    """An outline as a flat surface that is seen from above."""
    ring = raised(outline, z)
    here = np.arange(len(ring), dtype=np.uint32)
    faces = np.stack((here, np.roll(here, -1), np.full(len(ring), len(ring), np.uint32)), axis=1)
    return Mesh(np.concatenate((ring, ring.mean(axis=0)[None])), faces)


def band(outline: npt.ArrayLike, width: float, z: float) -> Mesh:
    """A flat strip along the inner side of an outline; a width below 0 lays it along the outer side."""
    outer, inner = raised(outline, z), raised(inset(outline, width), z)
    if width < 0.0:
        outer, inner = inner, outer
    count = len(outer)
    here = np.arange(count, dtype=np.uint32)
    after = np.roll(here, -1)
    faces = np.concatenate(
        (np.stack((here, after, after + count), axis=1), np.stack((here, after + count, here + count), axis=1))
    )
    return Mesh(np.concatenate((outer, inner)), faces.astype(np.uint32))


def inset(outline: npt.ArrayLike, margin: float) -> Floats:
    """An outline whose sides lie further inside by `margin`, m."""
    points = np.asarray(outline, dtype=np.float32)
    side = np.roll(points, -1, axis=0) - points
    inward = np.column_stack((-side[:, 1], side[:, 0])) / np.maximum(np.linalg.norm(side, axis=1), 1e-9)[:, None]
    before = np.roll(inward, 1, axis=0)
    spread = 1.0 + np.sum(inward * before, axis=1)
    found: Floats = (points + margin * (inward + before) / np.maximum(spread, 0.2)[:, None]).astype(np.float32)
    return found


def circle(radius: float, count: int = 28) -> list[Vector]:
    """The corners of a regular polygon about the origin."""
    return [(radius * math.cos(a), radius * math.sin(a)) for a in _turns(count)]


def star(outer: float, inner: float, count: int) -> list[Vector]:
    """The corners of a star with `count` points about the origin."""
    return [(r * math.cos(a), r * math.sin(a)) for a, r in zip(_turns(2 * count), (outer, inner) * count, strict=True)]


def _turns(count: int) -> list[float]:
    return [math.tau * k / count for k in range(count)]
