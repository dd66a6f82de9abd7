"""`socialai studio`: opens the studio in a browser on this machine."""

import argparse
import contextlib
import webbrowser
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import at_once, natural
from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError
from socialai_dsl.studio import FIRST_PORT, MOST_WINDOWS

SUMMARY: Final = "write, see and play scenarios in the browser"

EXAMPLES: Final = (
    ("socialai studio", "opens the scenarios of this folder, and copies of those that ship"),
    ("socialai studio gate.yaml", "opens this file"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "path",
        nargs="?",
        type=Path,
        default=Path(),
        metavar="PATH",
        help="the file of a scenario, or a folder of scenarios (default: this folder)",
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="address to listen on (default: this machine only)",
    )
    parser.add_argument(
        "--port", type=natural, metavar="N", help=f"port (default: {FIRST_PORT}, or the next free one)"
    )
    parser.add_argument(
        "--windows",
        type=at_once,
        default=MOST_WINDOWS,
        metavar="N",
        help=f"how many windows may be open at once; each has processes of its own (default: {MOST_WINDOWS})",
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="print the address and do not open a browser"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Serve until Ctrl-C."""
    try:
        import starlette  # noqa: F401
        import uvicorn
        import websockets  # noqa: F401
    except ImportError as error:
        raise UsageError(f"the studio needs {error.name}: pip install 'socialai-dsl[studio]'") from None
    from socialai_dsl.studio.address import taken
    from socialai_dsl.studio.files import opened
    from socialai_dsl.studio.server import LARGEST_FRAME, Studio

    root, first = opened(arguments.path)
    place = taken(root, arguments.host, arguments.port)
    address = place.url(arguments.host)
    print(f"studio of {root}: {address}\nCtrl-C ends it", flush=True)
    if not arguments.no_browser and not _open(address):
        print("no browser could be opened; open the address yourself", flush=True)
    studio = Studio(root, first, place.token, arguments.host, arguments.windows)
    config = uvicorn.Config(
        studio.app, log_level="error", ws="websockets-sansio", ws_max_size=LARGEST_FRAME, access_log=False
    )
    with contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[place.listening])
    return Exit.GOOD


def _open(address: str) -> bool:
    """Open the address in a browser; whether there is one."""
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False
