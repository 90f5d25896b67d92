"""The fingerprint of a run: what computed it, as far as that may change the last bits of its numbers.

A seed gives the same journal on every computer, and two journals are compared byte for byte. So what differs between
computers stands in a file beside the journal and not in its head, and is never compared as a part of a match: it only
helps to explain why two runs differ. The process that writes the journal makes the fingerprint once, when it begins.
"""

import logging
import os
import platform
import re
import subprocess
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct

from vrg import __version__
from vrg.bus.codec import DIGESTS
from vrg.errors import FileError, LaunchError
from vrg.files import decoded, read_bytes, write_whole
from vrg.packages import PACKAGES, release_of
from vrg.portable.scalars import VERSION
from vrg.registry import plugins
from vrg.runs.run_folder import RunFolder
from vrg.types import printable

log = logging.getLogger(__name__)

FEATURES: Final = frozenset({"avx", "avx2", "avx512dq", "avx512f", "fma", "fma4", "sse4_1", "sve", "sve2"})
"""The features of processors by which C libraries, numpy and its BLAS choose code that rounds otherwise."""
SETTINGS: Final = ("GLIBC_TUNABLES", "LD_PRELOAD", "NPY_DISABLE_CPU_FEATURES", "OPENBLAS_CORETYPE")
"""The environment variables that let these choose as on another processor, or replace them."""
NONE: Final = "none"
"""Stands where a fingerprint has no value."""
_WITHOUT_PACKAGE: Final = "planar"
"""The engine that needs no package: nobody looks for who adds it."""
_SHOWN: Final = 200
"""The number of characters of a value that are shown."""
_NAMES: Final = {"vrg": "VRG", "python": "Python"}


class Fingerprint(Struct, frozen=True, kw_only=True):
    """What computed a run: the process that wrote its journal, and the computer on which that ran.

    Args:
        releases: the releases of `vrg`, `python`, `numpy`, and of the engine's package if it has one, by their names.
        engine: the name of the engine.
        portable: `vrg.portable.scalars.VERSION`. digests: `vrg.bus.codec.DIGESTS`.
        libc: the C library and its version, such as `glibc 2.36`; empty if they are not known.
        machine: the kind of processor, such as `x86_64`.
        features: those of FEATURES that the processor has, sorted; empty where the system does not tell.
        settings: the values of those of SETTINGS that are set. They may switch off what `features` lists.
        system: the operating system, such as `Linux`.
    """

    releases: dict[str, str]
    engine: str
    portable: int
    libc: str
    machine: str
    features: list[str]
    settings: dict[str, str]
    system: str
    digests: int = 1


def fingerprint(engine: str) -> Fingerprint:
    """The fingerprint of what this process computes. No package is loaded for it.

    Args:
        engine: the name of the match's engine.
    """
    releases = {"vrg": __version__, "python": platform.python_version(), "numpy": release_of("numpy")}
    if engine in PACKAGES:
        releases[engine] = release_of(engine)
    elif engine != _WITHOUT_PACKAGE:
        plugin = plugins("vrg.engines").get(engine)
        if plugin is not None and plugin.dist is not None:
            releases[plugin.dist.name] = plugin.dist.version
    return Fingerprint(
        releases={name: release for name, release in releases.items() if release},
        engine=engine,
        portable=VERSION,
        libc=_libc(),
        machine=platform.machine(),
        features=_features(),
        settings={name: value for name in SETTINGS if (value := os.environ.get(name))},
        system=platform.system(),
        digests=DIGESTS,
    )


def keep_fingerprint(folder: RunFolder, engine: str) -> None:
    """Write the fingerprint of what this process computes into a run folder. A failure is only logged.

    Args:
        engine: as for `fingerprint`.
    """
    try:
        write_whole(folder.fingerprint, msgspec.json.format(msgspec.json.encode(fingerprint(engine))) + b"\n")
    except OSError as error:
        log.warning("%s: cannot be written: %s", folder.fingerprint, error.strerror)


def read_fingerprint(folder: RunFolder) -> Fingerprint | None:
    """The fingerprint of a run; None if it has none, as those of earlier releases.

    Raises:
        LaunchError: it is damaged, or cannot be read.
    """
    path = folder.fingerprint
    try:
        return decoded(msgspec.json.Decoder(Fingerprint), read_bytes(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise LaunchError(f"{path}: cannot be read: {error.strerror}") from None
    except FileError as error:
        text = f"expected the fingerprint of a run: {error}: delete this file, which nothing else needs"
        raise LaunchError(f"{path}: {text}") from None


def unlike(fingerprints: Sequence[Fingerprint]) -> list[str]:
    """What differs between fingerprints, such as `C libraries: glibc 2.36 and musl 1.2.5`; values in their order."""
    common = set.intersection(*(set(one.features) for one in fingerprints)) if fingerprints else set()
    facts = [_facts(one, common) for one in fingerprints]
    found = []
    for what in dict.fromkeys(what for one in facts for what in one):
        values = list(dict.fromkeys(printable(one.get(what) or NONE)[:_SHOWN] for one in facts))
        if len(values) > 1:
            found.append(f"{printable(what)}: {', '.join(values[:-1])} and {values[-1]}")
    return found


def _facts(one: Fingerprint, common: set[str]) -> dict[str, str]:
    """The values of a fingerprint, by the words for what they are.

    Args:
        common: the features that are not worth a word.
    """
    return {
        **{f"releases of {_NAMES.get(name, name)}": release for name, release in one.releases.items()},
        "engines": one.engine,
        "versions of the portable arithmetic": str(one.portable),
        "versions of the digests of steps": str(one.digests),
        "C libraries": one.libc,
        "machines": one.machine,
        "features of the processor": " ".join(name for name in one.features if name not in common),
        **{f"values of {name}": value for name, value in one.settings.items()},
        "systems": one.system,
    }


def features_in(lines: Iterable[str]) -> list[str]:
    """Those of FEATURES that the first processor has, sorted.

    Args:
        lines: of /proc/cpuinfo. On x86-64 `flags` lists the features, on ARM `Features` does.
    """
    for line in lines:
        key, _, value = line.partition(":")
        if key.strip() in ("flags", "Features"):
            return sorted(FEATURES.intersection(value.split()))
    return []


def _features() -> list[str]:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            return features_in(file)
    except OSError:
        return []


def _libc() -> str:
    """The C library of this process and its version. Those of macOS and Windows belong to the system."""
    if (system := platform.system()) == "Darwin":
        return f"libSystem {platform.release()}"
    if system == "Windows":
        return f"ucrt {platform.version()}"
    with suppress(ValueError, OSError, AttributeError):  # the C library does not know this name
        if found := os.confstr("CS_GNU_LIBC_VERSION"):
            return found
    return _musl(sorted(Path("/lib").glob("ld-musl-*.so.1")))


def _musl(loaders: Iterable[Path]) -> str:
    """The version of musl, which its loader prints."""
    for loader in loaders:
        with suppress(OSError, subprocess.SubprocessError):
            said = subprocess.run([loader], capture_output=True, stdin=subprocess.DEVNULL, timeout=5.0, check=False)
            if found := re.search(rb"Version (\S+)", said.stderr):
                return f"musl {found[1].decode(errors='replace')}"
    return ""
