"""What `make setup` shows of an installation by pip."""

import runpy
from collections.abc import Callable, Iterator
from pathlib import Path

SAID = """\
Looking in indexes: somewhere
Collecting aiohttp==3.14.5 (from -r requirements.lock (line 1))
  Downloading aiohttp-3.14.5-cp311-cp311-manylinux2014_x86_64.whl (60.5 MB)
     ━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━ 60.5/60.5 MB 9.0 MB/s eta 0:00:00
  Using cached numpy-2.4.6-cp311-cp311-manylinux.whl (500 kB)
Processing ./wheels/rich-14.0.0-py3-none-any.whl (from -r requirements.lock (line 9))
ERROR: this one is wrong
Installing collected packages: aiohttp, numpy, rich
  Attempting uninstall: setuptools
      Successfully uninstalled setuptools-65.5.0
Successfully installed aiohttp-3.14.5 numpy-2.4.6 rich-14.0.0
""".splitlines()
told: Callable[..., Iterator[str]] = runpy.run_path(
    str(Path(__file__).parent.parent / "scripts" / "fetched"), run_name="fetched"
)["told"]


def test_where_there_is_no_terminal_it_prints_how_far_it_is_what_it_does_and_errors() -> None:
    assert list(filter(None, told(SAID, 121.0, live=False))) == [
        f"  [{'#' * 10:<20}]   60 of some 121 MB, 1 packages\n",
        "ERROR: this one is wrong\n",
        "setup: 2 of 3: unpacking 3 packages (about half a minute)\n",
    ]


def test_on_a_terminal_it_is_one_line_that_changes() -> None:
    pieces = list(told(SAID, 122.0, live=True))
    bars = [piece for piece in pieces if piece.startswith("\r")]
    assert [bar.split()[-1] for bar in bars] == ["aiohttp", "numpy", "rich"]
    assert "61 of some 122 MB, 3 packages" in bars[-1]
    assert len({len(bar) for bar in bars}) == 1, "each covers the one before it"
