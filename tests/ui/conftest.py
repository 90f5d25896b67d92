"""No display, no sound card; scenes of the made-up match."""

from collections.abc import Callable, Iterator

import pytest
from matplotlib.axes import Axes

from tests.ui.pictures import kept_axes
from vrg.testing.views import synthetic
from vrg.testing.views.fixtures import keys, recorded
from vrg.ui.scene import Scene

__all__ = ["keys", "recorded"]


@pytest.fixture
def scene_at() -> Callable[..., Scene]:
    """Makes the scene at a time of the made-up match; fields of the referee's state can be replaced."""
    return synthetic.scene_at


@pytest.fixture
def drawn() -> Iterator[list[Axes]]:
    """The axes of each plot that is made."""
    with kept_axes() as kept:
        yield kept
