"""The command `vrg run stops`, which tells how the robots of a run stopped when they had to."""

import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer
from rich.markup import escape

from vrg.commands.matches import ended_run
from vrg.commands.options import JsonOption, RunArgument, make_console, print_table

if TYPE_CHECKING:
    from vrg.recording.stops import RobotStop
    from vrg.runs.certificate import Certificate


def stops(run: RunArgument = None, as_json: JsonOption = False) -> None:
    """Show how long each robot took to stop, and how far it rolled, after each HALT, emergency stop, death and loss."""
    from vrg.runs.certificate import certificate_of, data_of, summary_line

    folder, setup = ended_run(run)
    certificate = certificate_of(setup, folder)
    if as_json:
        typer.echo(json.dumps(data_of(certificate), indent=2))
        return
    console = make_console()
    for note in certificate.notes:
        console.print(f"[yellow]{escape(note)}[/yellow]", soft_wrap=True)
    if not certificate.incidents:
        console.print("This run has no known HALT, emergency stop, death of a process or lost machine.")
        return
    heads = ("at, s", "what", "robot", "stood after, s", "rolled, m", "from, m/s")
    print_table(console, heads, list(rows(certificate)), right=(0, 3, 4, 5))
    for text in remarks(certificate):
        console.print(escape(text), soft_wrap=True)
    console.print(f"[bold]{escape(summary_line(certificate))}[/bold]", soft_wrap=True)


def rows(certificate: "Certificate") -> Iterator[tuple[str, ...]]:
    """The rows of the table: one for each robot that moved, and one for all that stood already."""
    from vrg.recording.stops import StopOutcome

    for number, incident in enumerate(certificate.incidents):
        of = [stop for stop in certificate.stops if stop.incident == number]
        first = (f"{incident.time:.2f}", incident.what)
        for stop in (stop for stop in of if stop.moved):
            yield (
                *first,
                stop.robot,
                _seconds(stop),
                f"{'>= ' if stop.gap else ''}{stop.distance:.3f}",
                f"{stop.speed:.2f}",
            )
            first = ("", "")
        for outcome in (StopOutcome.STOOD, StopOutcome.UNKNOWN):
            names = [stop.robot for stop in of if stop.outcome is outcome]
            if names:
                yield (*first, ", ".join(names), str(outcome), "", "")
                first = ("", "")
        if not of:
            yield (*first, "", "no robot has to stop", "", "")


def _seconds(stop: "RobotStop") -> str:
    from vrg.recording.stops import StopOutcome

    clock = " (real)" if stop.real else ""
    if stop.outcome is StopOutcome.STOPPED:
        return f"{stop.seconds:.2f} ± {max(stop.resolution, 0.005):.2f}{clock}"
    if stop.again is not None:
        return f"moved again after {stop.again:.2f} ({stop.seconds:.2f}){clock}"
    return f"{stop.outcome} ({stop.seconds:.2f}){clock}"


def remarks(certificate: "Certificate") -> Iterator[str]:
    """The notes below the table."""
    yield (
        "Times are match time: from the referee's decision, from the order of an emergency stop, or from the newest "
        "message of a process that died or of a machine that is away. "
        f"They are accurate to {certificate.resolution:.2f} s. docs/safety.md says which times are allowed."
    )
    if certificate.rate is not None and not math.isclose(certificate.rate, 1.0):
        took = 1 / certificate.rate
        yield f"The match was played at rate {certificate.rate:g}: a second of match time took {took:.2f} s."
