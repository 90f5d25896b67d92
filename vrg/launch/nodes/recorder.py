"""The recorder of a match."""

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.launch.context import Made, NodeContext
from vrg.recording.recorder import Recorder
from vrg.runs.run_folder import RunFolder


def recorder_node(setup: MatchSetup, folder: RunFolder) -> Recorder:
    """Make the recorder, which records a match for Foxglove."""
    return Recorder(
        "recorder",
        Mailbox(),
        setup.keys,
        folder.recording,
        models={player.name: player.robot for player in setup.players},
        obstacles=setup.obstacles,
    )


def recorder(on: NodeContext) -> Made:
    """The recorder."""
    return Made(recorder_node(on.setup, on.folder))
