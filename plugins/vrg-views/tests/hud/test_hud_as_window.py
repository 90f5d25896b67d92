"""The display keeps the contract of all windows."""

from typing import Any

from displays import GROUND, ROBOT

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.testing.views import synthetic
from vrg.testing.views.window import WindowContract
from vrg.ui.window.window_node import WindowNode
from vrg_views.hud.node import Hud


class TestHud(WindowContract):
    by = "display of nemo"

    def make(self, keys: Keys, **more: Any) -> WindowNode:
        return Hud(
            "nemo", Mailbox(), keys, team="minnows", robot=ROBOT, start=synthetic.pose_at("nemo", 5.0), ground=GROUND,
            size=(900, 600), **more,
        )  # fmt: skip
