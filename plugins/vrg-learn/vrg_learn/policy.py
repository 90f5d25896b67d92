"""A policy: what has been learned, in one file, and the player that plays by it. It needs numpy alone.

A policy file (`policy.npz`) holds arrays of numbers and a header in JSON, and no code: to read a stranger's is safe.
It belongs to one game, and plays whatever role its player is given, with any number of others.
"""

import io
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Final

import msgspec
import numpy as np
from msgspec import Meta, Struct

from vrg.agents.strategy import Action, Strategy, View, decided
from vrg.bus.messages import Stage
from vrg.errors import ConfigError
from vrg.games import GAMES, STRATEGIES
from vrg.hal.models import RobotModel
from vrg.registry import load_object
from vrg_learn.action import limits_of, twist_of
from vrg_learn.learning import learning_of
from vrg_learn.network import Network, Parameters, layout_of, shapes
from vrg_learn.observation import observe

FORMAT: Final = 1
"""The number of the format that is written and read."""
MOST_BYTES: Final = 8_000_000
"""The size that a policy file may have, packed and unpacked."""
HEADER, SPREAD = "header", "log_std"
"""The names of the arrays that are no parameters of the network: the header, and how much exploration is left."""
_WRITTEN_BY = "examples/learning/train.py writes such files"


class Header(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a policy file says of itself.

    Args:
        format: the number of the format. game: the game's name.
        own, slot: the names of the values that it decides by, as in `vrg_learn.network.Layout`.
        actions: how many numbers it answers with. trained: by what it was made, in words.
    """

    format: int
    game: str
    own: tuple[str, ...]
    slot: tuple[str, ...]
    actions: Annotated[int, Meta(ge=2, le=3)]
    trained: Annotated[str, Meta(max_length=500)] = ""


class _Format(Struct):
    """The part of a header that is the same in every format."""

    format: int


@dataclass(frozen=True)
class Policy:
    """What has been learned.

    Args:
        game: the game's name. network: its outputs are the motion before it is bounded to -1 to 1.
        log_std: the logarithm of the standard deviation by which motions were tried out, shape (actions,).
        trained: by what it was made, in words.
    """

    game: str
    network: Network
    log_std: np.ndarray
    trained: str = ""

    def means(self, observations: np.ndarray) -> np.ndarray:
        """The motions for observations, shape (rows, actions), within -1 to 1."""
        return np.tanh(self.network(observations))


def save(policy: Policy, file: Path) -> None:
    """Write a policy file.

    Raises:
        ConfigError: it cannot be written, or the policy is none of the game.
    """
    layout = layout_of(learning_of(policy.game, file))
    header = Header(
        format=FORMAT,
        game=policy.game,
        own=layout.own,
        slot=layout.slot,
        actions=len(policy.log_std),
        trained=policy.trained,
    )
    arrays = {**policy.network.parameters, SPREAD: policy.log_std}
    _check_arrays(file, header, arrays)
    written = io.BytesIO()
    np.savez(written, **{HEADER: np.array(msgspec.json.encode(header).decode())}, **arrays)  # type: ignore[arg-type]
    part = file.with_name(f".{file.name}.part")
    try:
        part.write_bytes(written.getvalue())
        part.replace(file)  # who reads it meanwhile, or is left by a full disk, has the one before
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ConfigError(f"{file}: cannot be written: {error.strerror}: choose another place") from None


def load(file: Path) -> Policy:
    """Read a policy file.

    Raises:
        ConfigError: it is not one, or not one of this version of VRG; the message says what is wrong.
    """
    arrays = _read(file)
    text = arrays.pop(HEADER, None)
    if text is None or text.shape != () or text.dtype.kind != "U":
        raise ConfigError(f"{file}: expected a policy file, found an archive without a header: {_WRITTEN_BY}")
    header = _header(file, str(text))
    layout = layout_of(learning_of(header.game, file))
    for part, expected, got in (("own", layout.own, header.own), ("slot", layout.slot, header.slot)):
        if got != expected:
            raise ConfigError(
                f"{file}: expected a policy that sees what this version of VRG shows in {header.game}, but "
                f"{_difference(part, expected, got)}: train it again"
            )
    _check_arrays(file, header, arrays)
    log_std = arrays.pop(SPREAD)
    return Policy(header.game, Network(arrays), log_std, header.trained)


def _read(file: Path) -> Parameters:
    """All arrays of a file, by name."""
    if not file.is_file():  # to open a named pipe waits for ever
        raise ConfigError(f"{file}: no such file: expected a policy: {_WRITTEN_BY}")
    try:
        data = _bounded(file)
        if not zipfile.is_zipfile(io.BytesIO(data)):
            what = "a pickle" if data[:1] == b"\x80" else "something else"
            raise ConfigError(f"{file}: expected a policy, an archive of numpy (npz), got {what}: {_WRITTEN_BY}")
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(item.file_size for item in archive.infolist())
        if unpacked > MOST_BYTES:
            raise ConfigError(f"{file}: {_too_large(unpacked)}")
        with np.load(io.BytesIO(data), allow_pickle=False) as found:
            return {name: np.asarray(found[name]) for name in found.files}
    except (OSError, ValueError, EOFError, KeyError, MemoryError, NotImplementedError, RuntimeError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"{file}: cannot be read as a policy: {error}: {_WRITTEN_BY}") from None
    except (zipfile.BadZipFile, zlib.error) as error:
        raise ConfigError(f"{file}: the archive is damaged: {error}: copy it again") from None


def _bounded(file: Path) -> bytes:
    with file.open("rb") as stream:
        data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise ConfigError(f"{file}: {_too_large(file.stat().st_size)}")
    return data


def _too_large(size: int) -> str:
    return (
        f"expected a policy of at most {MOST_BYTES / 1e6:g} MB, got {size / 1e6:.1f} MB: if this is what a training "
        "goes on from, name the policy that it writes beside it"
    )


def _header(file: Path, text: str) -> Header:
    try:
        number = msgspec.json.decode(text, type=_Format).format
        if number != FORMAT:
            raise ConfigError(
                f"{file}: expected a policy file of format {FORMAT}, got {number}: train it again, or use the version "
                "of VRG that wrote it"
            )
        return msgspec.json.decode(text, type=Header)
    except (msgspec.DecodeError, RecursionError) as error:
        raise ConfigError(f"{file}: the header is wrong: {error}: {_WRITTEN_BY}") from None


def _difference(part: str, expected: Sequence[str], got: Sequence[str]) -> str:
    if len(expected) != len(got):
        return f"there are {len(expected)} values {part!r}, and it was trained with {len(got)}"
    number = next(n for n, pair in enumerate(zip(expected, got, strict=True)) if pair[0] != pair[1])
    return f"value {number} of {part!r} is {expected[number]!r}, and it was trained with {got[number]!r}"


def _check_arrays(file: Path, header: Header, arrays: Mapping[str, np.ndarray]) -> None:
    """Check that the arrays are those of the network that the header tells of.

    Raises:
        ConfigError: they are not.
    """
    expected = {**shapes(len(header.own), len(header.slot), header.actions), SPREAD: (header.actions,)}
    if missing := [name for name in expected if name not in arrays]:
        raise ConfigError(f"{file}: expected the arrays of a policy, found no {', '.join(missing)}: {_WRITTEN_BY}")
    if strange := [name for name in arrays if name not in expected]:
        raise ConfigError(
            f"{file}: expected the arrays of a policy alone, found {', '.join(sorted(strange)[:5])} too: if a "
            "training continues from this file, name the policy that it writes beside it"
        )
    for name, shape in expected.items():
        array = arrays[name]
        if array.shape != shape or array.dtype != np.float32:
            raise ConfigError(
                f"{file}: {name}: expected float32 of shape {shape}, got {array.dtype} of {array.shape}: {_WRITTEN_BY}"
            )
        if not np.isfinite(array).all():
            raise ConfigError(
                f"{file}: {name}: expected finite numbers, got NaN or infinity: the training has failed; use an "
                "earlier policy, or a lower learning rate"
            )


class PolicyPlayer(Strategy):
    """Plays by a policy. `player_of` makes a class of it for a file.

    The game's own strategy lines the robot up between rounds. Where the rules need more of a player than its motion,
    such as bids, it goes on telling that.
    """

    policy: ClassVar[Policy]

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._learning = learning_of(self.policy.game)
        actions = len(self.policy.log_std)
        self._limits = limits_of(robot)[:actions]
        if len(self._limits) < actions:
            raise ConfigError(f"{robot.name}: expected a robot that can drive sideways, as those of its training do")
        self._other: Strategy | None = None

    @property
    def mode(self) -> str:
        """The mode, for spectators."""
        return "Policy"

    def act(self, view: View) -> Action:
        """The motion that the policy takes for the best one; in a line-up that of the game's own strategy."""
        playing = view.referee.stage is Stage.PLAY_ROUND
        action = decided(self._own(view.me.role), view)[0] if self._learning.talks or not playing else Action()
        if not playing:
            return action
        seen = observe(view, self._learning)
        return msgspec.structs.replace(action, twist=twist_of(self.policy.means(seen[None])[0], self._limits))

    def _own(self, role: str) -> Strategy:
        """The strategy that comes with the game for a role."""
        if self._other is None:
            target = GAMES.get(self.policy.game).strategy_of(role)
            kind: type[Strategy] = load_object(target) if ":" in target else STRATEGIES.get(target)
            self._other = kind(self.name, self.robot)
            self._other.seed = self.seed
        return self._other


def player_of(file: Path) -> type[PolicyPlayer]:
    """The class of the players that play by a policy file, which is read now.

    Raises:
        ConfigError: it is not one; see `load`.
    """
    learned = load(file)

    class FilePlayer(PolicyPlayer):
        """Plays by the policy of one file."""

        policy = learned
        games = (learned.game,)

    return FilePlayer
