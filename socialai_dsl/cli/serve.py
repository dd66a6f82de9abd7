"""`socialai serve`: serves scenarios to trainers of language models."""

import argparse
import socket
import sys
from importlib.util import find_spec
from typing import Final

from socialai_dsl.checking.briefing import brief
from socialai_dsl.cli.arguments import (
    TELL_OPTIONS,
    add_scenario,
    add_seats,
    add_tell,
    port,
    positive,
    seconds,
    typed_options,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.model_options import add_option
from socialai_dsl.errors import UsageError

SUMMARY: Final = "serve a scenario to programs that train language models"

EXAMPLES: Final = (("socialai serve talkitout --protocol openenv", "serves OpenEnv clients"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser)
    parser.add_argument(
        "--protocol",
        choices=("openenv",),
        default="openenv",
        help="protocol (default: openenv)",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="NAME",
        help="further name or address under which clients may ask (repeatable); they always may under that of --host, "
        "localhost and 127.0.0.1, and all others are refused",
    )
    parser.add_argument(
        "--port", type=port, default=8000, metavar="N", help="port (default: 8000); 0 takes any free one"
    )
    add_option(parser, "style")
    add_seats(parser, "; clients play the first seat that is left")
    add_tell(parser)
    parser.add_argument(
        "--sessions",
        type=positive,
        default=100,
        metavar="N",
        help="largest number of sessions at once (default: 100)",
    )
    parser.add_argument(
        "--idle",
        type=seconds,
        metavar="SECONDS",
        help="end a session that sends nothing for so long (default: 900)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Serve until interrupted."""
    if find_spec("openenv") is None:
        raise UsageError("serving OpenEnv needs openenv: pip install 'socialai-dsl[openenv]'")
    import uvicorn

    from socialai_dsl.episodes.partners import beside
    from socialai_dsl.llm.gate import IDLE, MOST_BYTES
    from socialai_dsl.llm.openenv import application

    played = beside(arguments.seat, arguments.scenario)
    briefing = brief(played.loaded, **typed_options(arguments, TELL_OPTIONS))
    hosts = [arguments.host, *arguments.allow]
    app = application(
        played, arguments.style or "prose", briefing, arguments.sessions, hosts, arguments.idle or IDLE
    )
    family = socket.AF_INET6 if ":" in arguments.host else socket.AF_INET
    try:
        listening = socket.create_server((arguments.host, arguments.port), family=family)
    except (OSError, OverflowError) as error:
        raise UsageError(f"cannot serve on {arguments.host}:{arguments.port}: {error}") from None
    with listening:
        address, number = listening.getsockname()[:2]
        shown = f"[{address}]" if ":" in address else address
        print(
            f"{played.program.name} at http://{shown}:{number}, Ctrl-C stops it", file=sys.stderr, flush=True
        )
        config = uvicorn.Config(app, log_level="warning", ws_max_size=MOST_BYTES)
        uvicorn.Server(config).run(sockets=[listening])
    return Exit.GOOD
