"""`vrg locate calibrate ...`: the lens of a camera, and where the camera is above the field."""

import math
from pathlib import Path
from typing import Annotated, Final

import typer

from vrg.commands.options import write_text
from vrg.errors import ConfigError
from vrg_locate.locate_command import detected, picture_of

_FIT: Final = 4.0
"""The root mean square error of the points on the floor from which on they are refused, pixels per 1000 of width."""


def _squares(text: str) -> tuple[int, int]:
    columns, cross, rows = text.partition("x")
    if not (cross and columns.isdigit() and rows.isdigit() and 3 <= int(columns) <= 50 and 3 <= int(rows) <= 50):
        raise typer.BadParameter(f"expected the squares across and down, such as 10x7, got {text!r}")
    return int(columns), int(rows)


def lens(
    pictures: Annotated[list[Path], typer.Argument(metavar="PICTURES...", help="Pictures of the board, about 20.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The camera's file to write.")] = Path("cam.toml"),
    chessboard: Annotated[
        tuple[int, int] | None,
        typer.Option(metavar="COLUMNSxROWS", parser=_squares, help="A chessboard of this size, without markers."),
    ] = None,
) -> None:
    """Measure a camera's lens, from pictures of the board that `vrg locate board` prints.

    A place in the file is removed, because it was measured with another lens.
    """
    from vrg_locate.camera.calibration import CameraFile, LensTable, camera_text
    from vrg_locate.camera.detection import grey_of
    from vrg_locate.camera.lens import Board, calibrated, find_board
    from vrg_locate.camera.readers import read_picture

    wanted = Board() if chessboard is None else Board(*chessboard, marker=None)
    views, names = [], []
    for file in pictures:
        view = find_board(grey_of(read_picture(file)), wanted)
        if view is None:
            typer.echo(f"{file}: no board, or too little of it: is it sharp, lit and in the picture?")
        elif (refusal := view.refusal) is not None:
            typer.echo(f"{file}: {refusal}")
        else:
            views.append(view)
            names.append(file)
    try:
        found = calibrated(views)
    except ValueError as error:
        raise ConfigError(str(error)) from None
    for file, view, off in zip(names, views, found.each, strict=True):
        typer.echo(f"{file}: {len(view.points)} corners, off by {off:.2f} pixels")
    camera = CameraFile(lens=LensTable.of(found.lens, found.error))
    write_text(output, camera_text(camera))
    typer.echo(f"{len(views)} pictures; corners are off by {found.error:.2f} pixels. Written to {output}.")
    typer.echo("Next: put the camera up, and `vrg locate calibrate field`.")


def _numbers(text: str, whole: str) -> tuple[float, float]:
    try:
        first, second = map(float, text.split(","))
        if not (math.isfinite(first) and math.isfinite(second)):
            raise ValueError
    except ValueError:
        raise typer.BadParameter(f"expected two numbers such as 1.5,-2, got {text!r} in {whole!r}") from None
    return first, second


def _corner(text: str) -> tuple[float, float, float, float]:
    place, _, pixel = text.partition("=")
    return *_numbers(place, text), *_numbers(pixel, text)


def _tag(text: str) -> tuple[int, float, float]:
    number, _, place = text.partition("=")
    if not number.isdigit():
        raise typer.BadParameter(f"expected a tag and its place such as 20=1.5,-2, got {text!r}")
    return int(number), *_numbers(place, text)


def field(
    picture: Annotated[str, typer.Argument(metavar="PICTURE|CAMERA", help="A picture of the field, or a camera.")],
    calibration: Annotated[
        Path, typer.Option("--calibration", help="The camera's file, with its lens; the place is added to it.")
    ],
    tag: Annotated[
        list[str] | None,
        typer.Option("--tag", metavar="NUMBER=X,Y", help="A tag on the floor, and where its middle is, m."),
    ] = None,
    corner: Annotated[
        list[str] | None,
        typer.Option("--corner", metavar="X,Y=U,V", help="A point on the floor, m, and where it is seen, pixels."),
    ] = None,
) -> None:
    """Find out where the camera is, by four or more tags or points on the floor whose places are known."""
    import numpy as np  # the other commands need none

    from vrg_locate.camera.calibration import FloorTag, PlaceTable, camera_text, load_camera
    from vrg_locate.camera.detection import grey_of
    from vrg_locate.camera.field import fitted

    camera = load_camera(calibration)
    points = [(f"{x:g},{y:g}", (x, y), (u, v)) for x, y, u, v in map(_corner, corner or ())]
    placed = [_tag(one) for one in tag or ()]
    taken = grey_of(picture_of(picture, camera.lens.size))
    seen = detected(taken)
    for number, x, y in placed:
        own = [one for one in seen if one.number == number]
        if len(own) != 1:
            known = ", ".join(str(one.number) for one in seen) or "none"
            raise ConfigError(f"--tag {number}: expected it once in {picture}, got it {len(own)} times (seen: {known})")
        points.append((f"tag {number}", (x, y), own[0].centre))
    try:
        found = fitted(camera.lens.lens, [place for _, place, _ in points], np.array([p for _, _, p in points]))
    except ValueError as error:
        raise ConfigError(str(error)) from None
    for (name, _, _), off in zip(points, found.errors.tolist(), strict=True):
        typer.echo(f"{name}: off by {off:.1f} pixels")
    if found.rms > _FIT * camera.lens.size[0] / 1000:
        worst = points[int(found.errors.argmax())][0]
        raise ConfigError(
            f"the points do not fit together: they are off by {found.rms:.1f} pixels, most of all {worst}: is it where "
            "you say, and does x go to the right of y as on the map?"
        )
    floor = tuple(FloorTag(number=number, x=x, y=y) for number, x, y in placed)
    place = PlaceTable.of(found.place, found.rms)
    write_text(calibration, camera_text(camera.model_copy(update={"place": place, "tags": floor})))
    x, y, z = place.position
    typer.echo(f"The camera is at x {x:.3f} m, y {y:.3f} m, {z:.3f} m above the floor.")
    typer.echo(f"The points are off by {found.rms:.2f} pixels.")
    typer.echo(
        f"Written to {calibration}."
        + (
            " Leave the tags there: they show whether the camera is moved."
            if len(floor) >= 2
            else " Nothing will tell whether the camera is moved: lay at least two tags on the floor, and name them "
            "with --tag, or poses become less and less certain."
        )
    )
