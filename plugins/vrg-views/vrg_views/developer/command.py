"""The command `vrg show developer`."""

from vrg.commands.groups import MatchOptions
from vrg.commands.options import ListenOption, TlsOption
from vrg.commands.page import serve_page


def developer(on: MatchOptions, listen: ListenOption = None, tls: TlsOption = False) -> None:
    """Show a running match in browsers; the official's link opens the details: players, referee, streams, processes."""
    serve_page(on, listen, tls=tls, drawer="details")
