"""`vrg locate ...`: what is printed for a camera above the field, and what a camera sees."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from vrg.commands.options import GameArgument, write_text
from vrg.errors import ConfigError

if TYPE_CHECKING:
    from vrg_locate.camera.detection import Prints, Tag
    from vrg_locate.camera.lens import Picture

_FIRST: Final = 20
"""The pictures of a camera that are not looked at."""
CalibrationOption = Annotated[
    Path | None, typer.Option("--calibration", help="The camera's file, which `vrg locate calibrate` writes.")
]


TAGS, BOARD, FOUND = Path("tags.pdf"), Path("board.pdf"), Path("found.png")
"""The names of files that are written unless another one is named."""


def tags(
    match: GameArgument,
    size: Annotated[
        float | None,
        typer.Option(min=0.01, max=1.0, help="Side of the black square, m; the default is the match file's, or 0.15."),
    ] = None,
    floor: Annotated[
        list[int] | None,
        typer.Option("--floor", help="A tag for the floor, by its number; may be given several times."),
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The PDF file to write.")] = TAGS,
) -> None:
    """Print the tags of a match's robots, and some for the floor: a PDF of A4 pages, one for each.

    The numbers are those in the match file. If it has none yet, the robots and things that are to be located (all
    robots, if none is) are numbered from 0, and the table is shown.
    """
    from vrg.config.loading import match_path, read_match  # physics and all is for who reads matches
    from vrg.hal.location import FUSION
    from vrg.localisation.source import read_source
    from vrg_locate.camera.detection import CELLS, tag_cells
    from vrg_locate.camera.printed import PrintedTag, largest_tag, tag_sheets
    from vrg_locate.camera.source import CameraSettings

    file = read_match(match_path(match))
    known: dict[str, tuple[int, float]] = {}
    for table in file.localisation.values():
        if table.get("source") == "camera":
            settings = read_source(table)[1]
            assert isinstance(settings, CameraSettings)
            known |= {name: (tag.number, tag.size or settings.size) for name, tag in settings.tags.items()}
    names = list[str]()
    if not known:
        fused = [player.name for player in file.players if player.localisation == FUSION]
        fused += [body.name for body in file.bodies if body.localisation == FUSION]
        names = fused or [player.name for player in file.players]
        known = {name: (number, 0.15) for number, name in enumerate(names)}
    known |= {f"floor {number}": (number, size or 0.15) for number in floor or ()}
    numbers = [number for number, _ in known.values()]
    if twice := sorted({number for number in numbers if numbers.count(number) > 1}):
        raise ConfigError(f"--floor: expected numbers that no robot has, got {', '.join(map(str, twice))}")
    largest = largest_tag(CELLS)
    printed = []
    for name, (number, own) in known.items():
        wanted = size or own
        if wanted > largest:
            raise ConfigError(
                f"{name}: expected a size of at most {largest:.3f} m, as A4 has room for, got {wanted:g} m"
            )
        try:
            printed.append(PrintedTag(name, number, wanted, tag_cells(number)))
        except ValueError as error:
            raise ConfigError(f"--floor: {error}") from None
    write_text(output, tag_sheets(printed), named=output != TAGS)
    for tag in printed:
        typer.echo(f"{tag.name}: tag {tag.number}, {tag.size:g} m")
    typer.echo(f"Written to {output}. Print it at 100 %, and measure a black square.")
    if names:
        typer.echo("\nIn the match file, with the height of each tag above the floor:\n\n[localisation.overhead.tags]")
        for number, name in enumerate(names):
            typer.echo(f"{name} = {{ number = {number}, height = 0.3 }}")


def board(
    output: Annotated[Path, typer.Option("--output", "-o", help="The PDF file to write.")] = BOARD,
) -> None:
    """Print the board that a lens is calibrated with: a PDF of one A4 page. Glue it onto something flat."""
    from vrg_locate.camera.lens import Board, board_picture
    from vrg_locate.camera.printed import board_sheet

    wanted = Board()
    size = (wanted.columns * wanted.square, wanted.rows * wanted.square)
    words = (
        "Glue it onto a flat board. Take 20 sharp pictures of it: tilted to all sides, near and far, and in every "
        "corner of the picture."
    )
    write_text(output, board_sheet(board_picture(wanted, 120), size, words), named=output != BOARD)
    typer.echo(f"Written to {output}.")


def show(
    picture: Annotated[
        str, typer.Argument(metavar="PICTURE|CAMERA", help="A picture, a video, or a camera such as 0 or /dev/video0.")
    ],
    calibration: CalibrationOption = None,
    height: Annotated[
        float, typer.Option(min=0.0, max=10.0, help="The height of robots' tags above the floor, m.")
    ] = 0.0,
    prints: Annotated[
        Literal["opencv", "apriltag"], typer.Option(help="Whose prints the tags are: opencv or apriltag.")
    ] = "opencv",
    output: Annotated[Path, typer.Option("--output", "-o", help="The PNG file to write.")] = FOUND,
) -> None:
    """Find the tags in a picture, print where they are, and draw them."""
    from vrg_locate.camera.calibration import load_camera
    from vrg_locate.camera.detection import grey_of
    from vrg_locate.camera.drawing import drawn, encoded, words_of
    from vrg_locate.camera.source import NOISE

    view, size, floor = None, None, set[int]()
    if calibration is not None:
        camera = load_camera(calibration)
        size, floor = camera.lens.size, {tag.number for tag in camera.tags}
        view = camera.view(calibration) if camera.place is not None else None
    taken = picture_of(picture, size)
    found = detected(grey_of(taken), prints)
    located = [view.locate(t.corners, 0.0 if t.number in floor else height, NOISE) for t in found] if view else []
    for index, tag in enumerate(found):
        typer.echo(words_of(tag, located[index]) if located else f"tag {tag.number}: {tag.side:.0f} pixels wide")
    if not found:
        typer.echo("No tag was found: it must be flat, lit, in focus, and wider than 20 pixels, with its white border.")
    write_text(output, encoded(drawn(taken, found, view, located)), named=output != FOUND)
    typer.echo(f"Written to {output}.")


def detected(grey: "Picture", prints: "Prints" = "opencv") -> "list[Tag]":
    """The tags in a grey picture, which are of these prints.

    Raises:
        ConfigError: only its mirror image has tags.
    """
    from vrg_locate.camera.detection import TagDetector

    detector = TagDetector(prints)
    found = detector.detect(grey)
    if not found and (mirrored := detector.detect(grey[:, ::-1].copy())):
        numbers = ", ".join(str(tag.number) for tag in mirrored)
        raise ConfigError(
            f"the picture is mirrored: turned left to right it has the tags {numbers}. Switch mirroring off in the "
            "camera's settings, or print the tags again if they are mirrored"
        )
    return found


def picture_of(what: str, size: tuple[int, int] | None) -> "Picture":
    """A picture of a file, or that a camera takes now: blue, green and red.

    Args:
        what: the file, or the camera. size: that it must have: columns, rows; None for any.

    Raises:
        ConfigError: there is none, or it is of another size.
    """
    from vrg_locate.camera.readers import SUFFIXES, Wanted, open_reader, read_picture

    if Path(what).suffix.lower() in SUFFIXES:
        return _of_size(read_picture(Path(what)), what, size)
    reader = open_reader(int(what) if what.isdigit() else what, Path(), Wanted(size))
    try:
        taken = reader.read()
        # A camera needs some pictures to get used to the light.
        for _ in range(_FIRST if reader.live else 0):
            taken = reader.read() or taken
    finally:
        reader.close()
    if taken is None:
        raise ConfigError(f"camera {what}: expected a picture, it sends none: is its cable plugged in?")
    return _of_size(taken.picture, what, size)


def _of_size(picture: "Picture", what: str, size: tuple[int, int] | None) -> "Picture":
    rows, columns = picture.shape[:2]
    if size is not None and (columns, rows) != size:
        raise ConfigError(
            f"{what}: expected {size[0]} x {size[1]} pixels, as the lens was calibrated for, got {columns} x {rows}"
        )
    return picture
