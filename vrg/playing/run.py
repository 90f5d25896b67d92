"""A run as a Python object: what its folder holds, read when it is asked for."""

import base64
import html
import os
from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrg.bus.messages import Call
from vrg.bus.stopping import StopSignal, stop_on_signals
from vrg.config.setup import MatchSetup, read_setup
from vrg.coordinator.journal import read_journal
from vrg.errors import ConfigError, LaunchError, VrgError
from vrg.packages import lacking
from vrg.recording.reader import RobotPoses, read_tracks
from vrg.runs.change import changes_at
from vrg.runs.result import conclusion, plot, read_result, summary
from vrg.runs.run_folder import RunFolder

if TYPE_CHECKING:
    import pyarrow

    from vrg.ui.plots.proof import Proof


class PngFile:
    """A picture: a file that a notebook shows.

    Args:
        path: of the PNG file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __repr__(self) -> str:
        return str(self.path)

    def html(self, text: str) -> str:
        """It as a part of a page, with a text for those who do not see it; empty if there is no such file."""
        if not self.path.is_file():
            return ""
        data = base64.b64encode(self._repr_png_()).decode()
        return f'<img alt="{text}" style="max-width: 100%" src="data:image/png;base64,{data}">'

    def _repr_png_(self) -> bytes:
        return self.path.read_bytes()


class Why:
    """The reason of a call: sentences and, where there is something to see, a picture to scale."""

    def __init__(self, proof: "Proof") -> None:
        self._proof = proof

    def __str__(self) -> str:
        return "\n".join((self._proof.heading, *self._proof.lines))

    def __repr__(self) -> str:
        return str(self)

    def png(self) -> bytes | None:
        """The picture as a PNG file; None if there is nothing to see."""
        if self._proof.now is None:
            return None
        from vrg.ui.plots.proof import SIZE, ProofPainter  # noqa: PLC0415 - pygame takes half a second to load
        from vrg.ui.window.text import Fonts  # noqa: PLC0415 - as above
        from vrg.ui.window.window import png  # noqa: PLC0415

        return png(ProofPainter(Fonts()).picture(self._proof, SIZE, 1.0))

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        picture = self.png()
        return {"text/plain": str(self)} | ({} if picture is None else {"image/png": picture})


class Run:
    """A match that was played, by its run folder. Everything is read when it is asked for; a notebook shows it.

    Args:
        path: the run folder.

    Attributes:
        path: the run folder.

    Raises:
        LaunchError: it is no run folder.
    """

    def __init__(self, path: str | Path) -> None:
        if not isinstance(path, str | os.PathLike):
            raise LaunchError(f"expected the path of a run folder, got {path!r}")
        self.path = Path(path)
        self._folder = RunFolder(self.path)
        if not self._folder.setup.is_file():
            raise LaunchError(f"{path}: expected a run folder with a {self._folder.setup.name}, found none")

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r}): {self.conclusion}"

    @cached_property
    def setup(self) -> MatchSetup:
        """The set-up of the match.

        Raises:
            LaunchError: it is damaged.
        """
        return read_setup(self._folder.setup)

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """The content of result.json.

        Raises:
            LaunchError: there is none, or it is damaged: `vrg run result` makes it.
        """
        try:
            found = read_result(self._folder)
            _ = found["winner"], conclusion(found), summary(found)  # all that is shown of it
        except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
            raise LaunchError(f"{self._folder.result}: cannot be read: {error}: `vrg run result` makes it") from None
        return found

    @property
    def winner(self) -> str | None:
        """The team that has won, or `draw` or `nobody`; None if the game did not come to its end."""
        winner: str | None = self.result["winner"]
        return winner

    @property
    def score(self) -> Mapping[str, int]:
        """The points of each team."""
        score: Mapping[str, int] = self.result["score"]
        return score

    @property
    def conclusion(self) -> str:
        """The end of the match, why it has ended so, and its score, in words."""
        try:
            return f"{conclusion(dict(self.result))}{summary(dict(self.result))}"
        except LaunchError:
            return "it has no result"

    @cached_property
    def calls(self) -> list[Call]:
        """The calls of the referee, from the journal.

        Raises:
            JournalError: it is damaged.
        """
        return [call for record in read_journal(self._folder.journal)[1] for call in record.calls]

    @cached_property
    def tracks(self) -> dict[str, RobotPoses]:
        """The track of each robot, from the recording: arrays of match time (s), x, y (m) and theta (rad).

        Raises:
            LaunchError: there is no recording. MessageError: it is damaged.
        """
        parts = self._folder.recordings()
        if not parts:
            raise LaunchError(f"{self.path}: expected a recording, found none: play without `record=False`")
        return read_tracks(parts)

    def to_arrow(self) -> "pyarrow.Table":
        """The tracks as one table, a row a pose: robot, time (s), x, y, z (m), theta (rad), role, state, round, and
        playing.

        Its schema has the units, as `unit` in the metadata of these fields.

        Raises:
            ModuleNotFoundError: pyarrow is not installed. LaunchError, MessageError: as `tracks`.
        """
        import pyarrow as pa  # noqa: PLC0415 - most runs are read without tables

        tables = [
            pa.table(
                {
                    "robot": [name] * len(track.times), "time": track.times, "x": track.x, "y": track.y,
                    "z": track.z if track.z.size else [0.0] * len(track.times), "theta": track.theta,
                    "role": track.roles, "state": track.states, "round": track.rounds, "playing": track.playing,
                }
            )
            for name, track in self.tracks.items()
        ]  # fmt: skip
        whole, units = pa.concat_tables(tables), {"time": "s", "x": "m", "y": "m", "z": "m", "theta": "rad"}
        fields = [kind.with_metadata({"unit": units[kind.name]} if kind.name in units else {}) for kind in whole.schema]
        return pa.Table.from_arrays(whole.columns, schema=pa.schema(fields))

    def to_pandas(self) -> Any:
        """The table of `to_arrow` as a DataFrame of pandas.

        Raises:
            ConfigError: pandas is not installed. Others as `to_arrow`.
        """
        if find_spec("pandas") is None:
            raise ConfigError(["to_pandas: pandas is not installed: `pip install pandas`, or take `to_arrow`"])
        return self.to_arrow().to_pandas()

    def why(self, call: int) -> Why:
        """Why the referee made a call: the rule, who and where, and the number that decided.

        Args:
            call: its number.

        Raises:
            LaunchError: there is no such call. JournalError: a file cannot be read.
        """
        from vrg.runs.explaining import explain  # noqa: PLC0415 - it loads what draws

        return Why(explain(self.path, call))

    def html(self) -> str:
        """The match as one file of HTML that any browser shows, as `vrg run share` writes it.

        Raises:
            LaunchError: there is nothing to show. JournalError: the journal or the evidence cannot be read.
        """
        from vrg.playing.sharing import shared_run  # noqa: PLC0415 - it loads what draws

        return shared_run(self._folder, self.setup)

    def plot(self) -> PngFile:
        """Draw the trajectories.

        Raises:
            LaunchError: there is no recording, or it cannot be drawn.
        """
        try:
            plot(self.setup, self._folder)
        except (ModuleNotFoundError, OSError, ValueError) as error:
            raise LaunchError(f"{self.path}: cannot be plotted: {lacking('matplotlib') or error}") from None
        return PngFile(self._folder.plot)

    def branch(
        self,
        at: float,
        *,
        players: Mapping[str, str] | None = None,
        settings: Mapping[str, Any] | None = None,
        runs: str | Path = "runs",
        sandbox: bool = True,
        stop: StopSignal | None = None,
    ) -> "Run":
        """Take the match up from an instant, with other strategies, rules, radio or noise, and play it to its end.

        Args:
            at: the match time of the instant, s.
            players: another strategy by player, or by team for all its players, as `vrg.play` takes it.
            settings: other values by field of the match file, such as `{"rules.passes": 3}`.
            runs: the folder for the new run folder.
            sandbox: strategies that are files are sealed in processes of their own; False lets them do what you can.
            stop: what breaks this off when it is set, such as a `threading.Event`. No run is left then.

        Raises:
            ConfigError: a player, a strategy or a field does not exist.
            LaunchError: the match was not played in steps, or cannot be repeated, or `stop` has broken this off.
            KeyboardInterrupt: this was broken off by Ctrl-C, which only the main thread hears.
        """
        from vrg.playing.branch import play_branch  # noqa: PLC0415 - as above
        from vrg.playing.match import strangers  # noqa: PLC0415 - it loads all that plays a match

        if not (players or settings):
            raise ConfigError(
                ["branch: expected another strategy in `players`, or other values in `settings`, got none"]
            )
        if not isinstance(at, int | float):
            raise ConfigError([f"at: expected a match time in s, got {at!r}"])
        changes = changes_at(self.setup, at, players or {}, settings or {})
        with strangers(self._folder, changes, sandbox=sandbox) as apart, stop_on_signals(stop) as ends:
            try:
                folder = play_branch(
                    self._folder, changes, Path(runs), datetime.now(), progress=lambda _: None, stop=ends, apart=apart
                )
            except LaunchError:
                if ends.is_set() and not (stop is not None and stop.is_set()):
                    raise KeyboardInterrupt from None
                raise
        return Run(folder.path)

    def _repr_html_(self) -> str:
        rows = [("match", self.setup.name), ("game", f"{self.setup.game}, seed {self.setup.seed}, {self.setup.engine}")]
        rows += [("end", self.conclusion), ("calls", str(len(self.calls))), ("folder", str(self.path))]
        lines = "".join(f"<tr><th>{html.escape(what)}</th><td>{html.escape(text)}</td></tr>" for what, text in rows)
        frame, style = "", "width: 100%; height: 36rem; border: 0"
        with suppress(VrgError):  # there may be nothing to show
            frame = f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{html.escape(self.html())}"></iframe>'
        return f"<table>{lines}</table>{frame}"
