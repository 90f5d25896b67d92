"""`vrg run clip`: the seconds around a call of the referee, as a picture that moves."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.commands.matches import ended_run, need_shown
from vrg.commands.options import RunArgument, echo
from vrg.errors import LaunchError

if TYPE_CHECKING:
    from vrg.ui.scene import Scene

STEP: Final = 0.08
"""The real time in s for which a picture is shown; a GIF counts hundredths of a second."""

MOST: Final = 1000
"""The number of pictures of a clip."""


def clip(
    run: RunArgument = None,
    call: Annotated[int, typer.Option("--call", help="Number of the call; `vrg run why` lists them.")] = 1,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; the default is call-N.gif in the run folder.")
    ] = None,
    before: Annotated[float, typer.Option(min=0.0, max=60.0, help="Match time before the call, s.")] = 4.0,
    after: Annotated[float, typer.Option(min=0.0, max=60.0, help="Match time after the call, s.")] = 2.0,
    speed: Annotated[float, typer.Option(min=0.1, max=16.0, help="Match seconds per second.")] = 1.0,
    width: Annotated[int, typer.Option(min=200, max=1920, help="Width, pixels.")] = 800,
) -> None:
    """Write the seconds around a call of the referee as a GIF animation, for pages and messages."""
    from vrg.playing.replay import read_for_window

    folder, setup = ended_run(run)
    need_shown(folder)
    timeline = read_for_window(folder, setup).timeline
    mark = next((mark for mark in timeline.calls if mark.call.number == call), None)
    if mark is None:
        known = ", ".join(str(mark.call.number) for mark in timeline.calls)
        raise LaunchError(f"--call: expected the number of a call, one of {known or 'none'}, got {call}")
    begin, end = max(timeline.begin, mark.time - before), min(timeline.end, mark.time + after)
    times = [begin + number * STEP * speed for number in range(int((end - begin) / (STEP * speed) + 1e-6) + 1)]
    if len(times) > MOST:
        raise LaunchError(f"expected at most {MOST} pictures, got {len(times)}: ask for less time, or more --speed")
    file = output or folder.path / f"call-{call}.gif"
    try:
        _draw([timeline.at(time) for time in times], width, file)
    except OSError as error:
        raise LaunchError(f"{file}: cannot be written: {error.strerror or error}") from None
    echo(f"Written to {file}: {mark.text}; {file.stat().st_size / 1000:.0f} kB.")


def _draw(scenes: "list[Scene]", width: int, file: Path) -> None:
    """Write scenes as a GIF.

    Raises:
        OSError: it cannot be written.
    """
    import pygame
    from PIL import Image

    from vrg.ui.window.draw import Painter

    painter, surface = Painter(panel_width=0), pygame.Surface((width, width * 5 // 8))
    pictures: list[Image.Image] = []
    for scene in scenes:
        painter.draw(surface, scene)
        picture = Image.frombytes("RGB", surface.get_size(), pygame.image.tobytes(surface, "RGB"))
        # With the colours of the first one for all, what stands still does not flicker, and takes no room.
        pictures.append(picture.quantize(palette=pictures[0]) if pictures else picture.quantize(128))
    pictures[0].save(file, format="GIF", save_all=True, append_images=pictures[1:], duration=STEP * 1000, loop=0)
