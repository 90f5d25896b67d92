"""What the models of all files that people write have in common."""

from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict


class Table(BaseModel):
    """A table of a TOML file: no field that is unknown, no number that is none, nothing that changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def one_of(value: str, known: Sequence[str]) -> str:
    """The value, if it is one of those known.

    Raises:
        ValueError: it is not; lists them.
    """
    if value not in known:
        raise ValueError(f"expected one of {', '.join(known)}, got {value!r}")
    return value
