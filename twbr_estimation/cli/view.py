"""`twbr view BAG...`: recordings in the browser, with a slider for the time."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from ..configuration.filter_settings import DEFAULT_FILTER
from ..printing.text import say
from .arguments import add_request, request_of

FEW = ("ins_odometer", "complementary")
"""Filters that run where none is named: the first one is drawn as the active one."""


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "view",
        description="Serve a web page with the robot, tilt and error against time. Runs "
        f"{' and '.join(FEW)} unless --filter names others. Ctrl-C ends it.",
    )
    add_request(parser, default=f"{' and '.join(FEW)}; all for every one")
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to serve on; default: %(default)s"
    )
    parser.add_argument("--port", type=int, default=8080, help="TCP port; default: %(default)s")
    parser.add_argument(
        "--token", default="", help="what other computers must give; default: a new one each time"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the filters, then serve the page until Ctrl-C."""
    from ..dashboard.recorded import RecordedSource
    from ..dashboard.server import ServerSettings, serve

    request = request_of(arguments)
    if not arguments.filter:
        request = replace(request, names=FEW)
    elif arguments.filter[0] == "all":  # no order was given
        first = [name for name in request.names if name == DEFAULT_FILTER]
        request = replace(request, names=tuple(dict.fromkeys([*first, *request.names])))
    settings = ServerSettings(arguments.host, arguments.port, arguments.token).secured()
    running = ", ".join(request.names)
    say(f"running {running} on {', '.join(map(str, arguments.bags))}", error=True, flush=True)
    sources = [
        RecordedSource(path.name, request.runs(path, reference=False)) for path in arguments.bags
    ]
    serve(sources, settings, lambda addresses: say(f"open {addresses}", flush=True))
    return 0
