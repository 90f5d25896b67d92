"""Learning: matches as environments for programs that learn to play, and players that play by what was learned.

`environment.MatchEnvironment` is a ParallelEnv of PettingZoo in which every player may learn, and
`single.PlayerEnvironment` an Env of Gymnasium for one player. All other modules but `table` and `batch.vector` need
numpy alone: `observation` is also what a strategy that has learned decides by in a match.
"""

from typing import Final

from vrg.plugins import Command

EXPORT: Final = Command(
    ("run", "export"),
    "Look at a recorded run (RUN; by default the newest in the folder runs)",
    "Write what players saw and did as a table to learn from",
    "vrg_learn.export_command:export",
)
