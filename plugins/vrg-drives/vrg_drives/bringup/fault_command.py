"""`vrg can fault`: lets something go wrong in emulated drives."""

import enum
from typing import Annotated

import typer

from vrg.commands import drives
from vrg.commands.drives import EmulatedBusOptions
from vrg.commands.options import lasting
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link, Medium
from vrg.hal.can.workshop.faults import WHAT, FaultKind, FaultRequest, decode_answer, encode_fault

FaultName = enum.StrEnum("FaultName", {kind.name: kind.name.lower() for kind in FaultKind})  # type: ignore[misc]


def fault(
    kind: Annotated[FaultName, typer.Argument(help="; ".join(f"{k.name.lower()}: {w}" for k, w in WHAT.items()))],
    id_: Annotated[list[int], typer.Option("--id", help="An emulated drive's id; may be given several times.")],
    on: EmulatedBusOptions,
    seconds: Annotated[float, lasting("How long the fault lasts; 0 = until `end`.", 0, 655)] = 0.0,
    value: Annotated[str, typer.Option(help="Error bits or turns, such as 0x200.")] = "0",
) -> None:
    """Inject a fault into an emulated drive. Real drives ignore it."""
    try:
        number = int(value, 0)
    except ValueError:
        raise typer.BadParameter(
            f"expected a whole number such as 512 or 0x200, got {value!r}", param_hint="--value"
        ) from None
    request = FaultRequest(FaultKind[kind.name], seconds, number - (1 << 32) if number >= 1 << 31 else number)
    link = on.link()
    failed = False
    for one in id_:
        done = ask_for(drives.medium(), link, one, request)
        failed |= not done
        if done:
            typer.echo(f"node {one}: {kind} ({WHAT[request.kind].split(':')[0]})")
        elif done is None:
            typer.echo(f"node {one}: not emulated on {link}; real drives ignore this", err=True)
        else:
            typer.echo(f"node {one}: a drive of its protocol cannot have this fault", err=True)
    if failed:
        raise typer.Exit(1)


ANSWER_TIMEOUT = 2.0
"""s for a drive to answer."""


def ask_for(medium: Medium, link: Link, node: int, request: FaultRequest) -> bool | None:
    """Ask a drive for a fault.

    Returns:
        whether it can have this fault; None without an answer within ANSWER_TIMEOUT.

    Raises:
        RobotError: the bus cannot be opened, or the request cannot be sent.
        ValueError: the request does not fit into a frame.
    """
    question = encode_fault(node, request)
    answers: list[bool] = []

    def hear(frame: Frame) -> None:
        done = decode_answer(frame, node, request.kind)
        if done is not None:
            answers.append(done)

    bus = medium.bus(link, hear)
    bus.start()
    try:
        bus.send(question)
        medium.clock.wait(lambda: answers, ANSWER_TIMEOUT)
    finally:
        bus.stop()
    return answers[0] if answers else None
