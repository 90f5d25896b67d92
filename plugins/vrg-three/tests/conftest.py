"""What the tests of the view in three dimensions share with those of the other views."""

from tests.ui.conftest import recorded

__all__ = ["recorded"]
