"""The contacts of discs and convex outlines."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.sim.contact import Placed, contacts, form_of, moments, placed, rectangle
from vrg.regions import Polygon

COORDINATES = st.floats(-1.0, 1.0)
FORMS = st.one_of(
    st.floats(0.05, 1.0).map(lambda radius: form_of(radius, ())),
    st.builds(rectangle, st.floats(0.1, 2.0), st.floats(0.1, 2.0)),
    st.just(form_of(0.0, ((0.6, -0.3), (0.0, 0.7), (-0.6, -0.4)))),
)
PLACES = st.builds(placed, FORMS, COORDINATES, COORDINATES, st.floats(-4.0, 4.0))


@given(PLACES, PLACES)
def test_two_forms_touch_each_other_alike(a: Placed, b: Placed) -> None:
    there, back = contacts(a, b), contacts(b, a)
    assert len(there) == len(back)
    if there:
        deepest, other = (max(found, key=lambda c: c.depth) for found in (there, back))
        assert deepest.depth == pytest.approx(other.depth, abs=1e-9)
        # Where two axes separate as well as each other, either may be taken.
    for contact in there:
        assert math.hypot(contact.nx, contact.ny) == pytest.approx(1.0)
        assert contact.depth > 0.0


@given(PLACES, PLACES)
def test_who_goes_back_along_the_normal_by_the_greatest_depth_touches_no_more(a: Placed, b: Placed) -> None:
    found = contacts(a, b)
    if found:
        deepest = max(found, key=lambda c: c.depth)
        way = deepest.depth + 1e-7
        x, y = way * deepest.nx, way * deepest.ny
        moved = a._replace(x=a.x + x, y=a.y + y, corners=[(u + x, v + y) for u, v in a.corners])
        assert contacts(moved, b) == []


@given(PLACES, PLACES)
def test_a_point_of_contact_is_at_both_forms(a: Placed, b: Placed) -> None:
    def far(form: Placed, x: float, y: float) -> float:
        if not form.corners:
            return math.hypot(x - form.x, y - form.y) - form.radius
        near = Polygon(tuple(form.corners)).nearest(x, y)
        return math.dist(near, (x, y))

    for contact in contacts(a, b):
        assert far(a, contact.x, contact.y) <= contact.depth + 1e-6
        assert far(b, contact.x, contact.y) <= contact.depth + 1e-6


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (placed(form_of(0.1, ()), 0.55, 0.0, 0.0), placed(rectangle(1.0, 1.0), 0.0, 0.0, 0.0), [(0.5, 0.0, 0.05)]),
        (placed(form_of(0.1, ()), 0.0, 0.55, 0.0), placed(form_of(0.5, ()), 0.0, 0.0, 0.0), [(0.0, 0.5, 0.05)]),
        (
            placed(rectangle(1.0, 1.0), 0.95, 0.2, 0.0),
            placed(rectangle(1.0, 1.0), 0.0, 0.0, 0.0),
            [(0.45, 0.5, 0.05), (0.45, -0.3, 0.05)],
        ),
    ],
)
def test_known_contacts(a: Placed, b: Placed, expected: list[tuple[float, float, float]]) -> None:
    found = [value for contact in contacts(a, b) for value in (contact.x, contact.y, contact.depth)]
    assert found == pytest.approx([value for contact in expected for value in contact])


@given(st.floats(0.1, 3.0), st.floats(0.1, 3.0), COORDINATES, COORDINATES)
def test_moments_of_a_rectangle(length: float, width: float, x: float, y: float) -> None:
    corners = [(u + x, v + y) for u, v in rectangle(length, width).corners]
    area, middle, gyration = moments(corners)
    assert (area, *middle) == pytest.approx((length * width, x, y))
    assert gyration == pytest.approx((length * length + width * width) / 12)


def test_the_circle_about_an_outline() -> None:
    assert form_of(0.0, ((3.0, 4.0), (-1.0, 0.0), (0.0, -1.0))).radius == 5.0
