"""`simrecon studio`: a result in the browser, its scene and contacts edited by hand, and run again."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from simrecon.cli import arguments, options
from simrecon.cli.commands import purpose
from simrecon.errors import InputError
from simrecon.job import Job
from simrecon.job.text import with_options
from simrecon.studio.gate import LOOPBACK

HOST = "127.0.0.1"
LARGEST_PORT = 65535


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "studio", _studio, purpose("studio"))
    parser.epilog = "Opens nothing by itself: the address that it prints is for your browser."
    parser.add_argument("path", metavar="PATH", nargs="?", help="a result, evidence, a video, or a batch")
    parser.add_argument("--scene", metavar="FILE", help="scene to begin with [that of the result]")
    parser.add_argument(
        "--contacts", metavar="FILE", help="wishes for contacts to begin with [as of the result]"
    )
    parser.add_argument("--video", metavar="FILE", help="of the evidence [as the result says]")
    parser.add_argument("--host", default=HOST, metavar="ADDRESS", help=f"address to listen on [{HOST}]")
    parser.add_argument(
        "--port", type=arguments.whole(LARGEST_PORT), default=0, metavar="N", help="0: any that is free [0]"
    )
    options.add(parser, sections=("reading", "person"))


def _studio(parsed: argparse.Namespace) -> int:
    from simrecon.studio import opening, serving
    from simrecon.studio.session import Session

    serving.check_installed()
    path = None if parsed.path is None else Path(parsed.path)
    said = options.given(parsed)
    if path is not None:
        opening.check(path)
        if said and path.is_dir():
            flag = next(iter(said))
            raise InputError(f"{path}: found --{flag.replace('_', '-')} for a result; valid: leave it out")
    if path is None and (parsed.scene or parsed.contacts):
        raise InputError("--scene, --contacts: found no PATH beside them; valid: name a result or evidence")
    reading = with_options(Job("", ""), said)
    session = Session()
    if path is not None:
        first, contacts = (None if name is None else Path(name) for name in (parsed.scene, parsed.contacts))
        session.open(path, reading, first, contacts)
    _serve(session, parsed, reading)
    return 0


def _serve(session: Any, parsed: argparse.Namespace, reading: Job) -> None:
    """Serve until it is interrupted."""
    from simrecon.studio.app import Studio

    studio = Studio(session, parsed.host, parsed.port, reading)
    if parsed.host not in LOOPBACK:
        print(
            f"warning   --host {parsed.host}: other machines can reach the studio. Whoever has the address "
            f"can read and write files as you; the connection is not encrypted",
            file=sys.stderr,
        )
    print(f"studio    {studio.address}")
    print("          open it in your browser; Ctrl-C ends the studio", flush=True)
    try:
        studio.wait()
    except KeyboardInterrupt:
        print("studio    ended; unsaved edits and runs are kept for the next time", file=sys.stderr)
    finally:
        studio.stop()
