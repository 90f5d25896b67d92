"""A match as one file of HTML: the page that shows recorded matches, with all that it shows, without a server."""

import base64
import gzip
import html
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any, Final

import msgspec

from vrg.ui.timeline import Timeline
from vrg.ui.web.parts import call, encode, parts, welcome

STEP: Final = 0.1
"""The match time in s between two instants of a file."""
MOST: Final = 3000
"""The instants of a file; those of a longer match are further apart. Between them bodies are shown on their way."""
_POLICY: Final = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'"
_IMPORT: Final = re.compile(r'^import \{ ([^}]+) \} from "\./([\w.]+)";\n', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export ((?:async )?(?:function|class|const) (\w+))", re.MULTILINE)


def shared(recording: str, title: str) -> str:
    """The file of a match.

    Args:
        recording: see `recorded`. title: of the page.
    """
    static = files("vrg.ui.web") / "static"
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    data = base64.b64encode(gzip.compress(recording.encode(), mtime=0)).decode()
    taken = {
        "<title>VRG</title>": f"<title>{html.escape(title)}</title>{policy}",
        '<link rel="icon" href="icon.svg" type="image/svg+xml">\n': "",
        '<link rel="stylesheet" href="style.css">': f"<style>{_read(static, 'style.css')}</style>",
        '<script type="module" src="main.js"></script>\n': "",
        "</body>": f'<script type="text/plain" id="recorded">{data}</script>\n'
        f"<script>{bundled(static, 'replay.js')}</script>\n</body>",
    }
    page = _read(static, "index.html")
    for there, instead in taken.items():
        page = page.replace(there, instead)
    return page


def recorded(timeline: Timeline, name: str, reasons: Mapping[int, Sequence[str]], step: float = STEP) -> str:
    """What the page shows, as a text of JSON: what it needs once, and each part of the scene whenever it has changed.

    Args:
        name: of the match. reasons: the numbers that decided the calls, by the number of the call.
        step: the match time in s between two instants, or more.
    """
    begin, end = timeline.begin, timeline.end
    count = min(MOST, int((end - begin) / step) + 1)
    kept: dict[str, tuple[object, str]] = {}
    shown: dict[str, str] = {}
    found = []
    for number in range(count + 1):
        time = begin + (end - begin) * number / count
        for kind, text in parts(timeline.at(time), kept).items():
            if shown.get(kind) != text:
                shown[kind] = text
                found.append(f'{{"time":{time:.3f},"part":{text}}}')
    game = timeline.at(end).game
    marks: list[dict[str, Any]] = [
        {
            "time": mark.time, "text": mark.text, "number": mark.call.number, "rule": mark.call.rule,
            "call": msgspec.json.decode(call(mark.call, game)) | {"why": reasons.get(mark.call.number, [])},
        }
        for mark in timeline.calls
    ]  # fmt: skip
    about = welcome(name) | {"begin": begin, "end": end, "marks": marks}
    return f'{{"about":{encode(about)},"parts":[{",".join(found)}]}}'


def bundled(folder: Traversable, entry: str) -> str:
    """A program of modules as one script, as browsers load no modules from files.

    Args:
        folder: of the modules, whose imports have the form `import { one, two as three } from "./other.js";`.
    """
    done: dict[str, str] = {}

    def add(name: str) -> None:
        text = _read(folder, name)
        for _, other in _IMPORT.findall(text):
            if other not in done:
                add(other)
        names = ", ".join(found for _, found in _EXPORT.findall(text))
        text = _IMPORT.sub(_taken, _EXPORT.sub(r"\1", text))
        done[name] = f'modules["{name}"] = (() => {{\n{text}return {{ {names} }};\n}})();\n'

    add(entry)
    return f'"use strict";\nconst modules = {{}};\n{"".join(done.values())}'


def _taken(found: re.Match[str]) -> str:
    """The line that takes the imported names from a module that stands before it in the file."""
    return f'const {{ {found[1].replace(" as ", ": ")} }} = modules["{found[2]}"];\n'


def _read(folder: Traversable, name: str) -> str:
    return (folder / name).read_text(encoding="utf-8")
