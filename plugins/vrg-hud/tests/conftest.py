"""What the tests of the display share with those of other windows and of matches."""

from tests.system.conftest import arena, start
from tests.ui.conftest import keys

__all__ = ["arena", "keys", "start"]
