"""The words of the pages, one file a language, and which of them a browser gets."""

import functools
from collections.abc import Collection, Mapping
from importlib.resources import files
from typing import Any, Final

import msgspec

ENGLISH: Final = "en"
"""The language that has all words."""


def preferred(accepted: str, known: Collection[str]) -> str:
    """The language of a browser among those that there are; English if it wants none of them.

    Args:
        accepted: the header Accept-Language (RFC 9110, 12.5.4), such as `de-CH,de;q=0.9,en;q=0.8`.
    """
    wanted = []
    for place, part in enumerate(accepted[:500].split(",")):
        tag, _, quality = part.replace(" ", "").partition(";q=")
        try:
            wanted.append((-float(quality or 1.0), place, tag.lower().split("-")[0]))
        except ValueError:
            continue
    return next((tag for weight, _, tag in sorted(wanted) if weight < 0 and tag in (*known, ENGLISH)), ENGLISH)


@functools.cache
def words() -> Mapping[str, Mapping[str, Any]]:
    """The words of the pages by language. Words that a language lacks are English."""
    found = {
        file.name.removesuffix(".json"): msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
        for file in (files("vrg_class") / "words").iterdir()
        if file.name.endswith(".json")
    }
    return {language: _with(found[ENGLISH], own) for language, own in found.items()}


def _with(usual: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Words, and those of a language in place of them."""
    return {
        key: _with(value, own.get(key, {})) if isinstance(value, dict) else own.get(key, value)
        for key, value in usual.items()
    }
