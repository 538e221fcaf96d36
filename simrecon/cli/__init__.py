"""The command line: arguments, progress and messages; all else happens in the modules below.

A command is a row of `commands.COMMANDS` and a module with a function `add(commands)`, which is imported when
the command is asked for, so that help comes at once.
"""

from __future__ import annotations

import errno
import io
import os
import sys
import traceback

import simrecon
from simrecon.cli import commands
from simrecon.cli.arguments import Parser
from simrecon.errors import InputError, SimreconError, printable
from simrecon.system import signals

NOTHING = "nothing was written"
EXIT_FAILED, EXIT_PIPE = 1, 141
PURPOSE = "Reconstruct physically simulated human motion from what one camera saw."


def main(argv: list[str] | None = None) -> int:
    """Run a command.

    Args:
        argv: arguments without the program's name; those of the process if None.

    Returns:
        Exit status: 0 all simulated, 1 failed, 2 bad usage or input, 3 finished with frames on kinematic
        fallback, 130 interrupted, 143 ended by SIGTERM, 141 nobody reads what it prints any more.
    """
    for stream in (sys.stdout, sys.stderr):  # paths may hold bytes that are no text
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    os.environ.setdefault("MUJOCO_GL", "disable")  # or it starts a process that looks for a screen
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")  # or lines of its own stand beside those of errors
    try:
        with signals.interruptible():
            status = _status(sys.argv[1:] if argv is None else argv)
        sys.stdout.flush()
    except BrokenPipeError:  # of `simrecon … | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is flushed at the end
        return EXIT_PIPE
    return status


def _status(words: list[str]) -> int:
    """Run the command and say how it failed."""
    try:
        parsed = _parser(words).parse_args(words)
        from simrecon.sim.quiet import unwarned  # not before help is shown: it imports MuJoCo

        with unwarned():  # rollouts that diverge are expected, and counted
            done: int = parsed.command(parsed)
            return done
    except SystemExit as end:  # argparse, after -h and --version
        return int(end.code or 0)
    except BrokenPipeError:
        raise
    except KeyboardInterrupt as error:
        return _interrupted(error)
    except Exception as error:
        if (ended := signals.received()) is not None:
            return _interrupted(ended)
        debug = "--debug" in words
        if debug:
            traceback.print_exc()
        message, status = str(error), EXIT_FAILED
        if isinstance(error, SimreconError):
            status = error.exit_status
        elif _leads_nowhere(error):
            message, status = f"{message[:200]}; valid: a path that can be followed", InputError.exit_status
        else:  # a defect
            message = f"{type(error).__name__}: {message}{'' if debug else '; --debug shows where'}"
        print("simrecon: error:", printable(" ".join(message.split())), file=sys.stderr)
        return status


def _leads_nowhere(error: Exception) -> bool:
    """Whether the system can't follow a path that was given: its name, its links, or who may go there."""
    if isinstance(error, RuntimeError):  # `Path.resolve` before Python 3.13
        return str(error).startswith("Symlink loop")
    if isinstance(error, ValueError):  # of the system's calls
        return str(error).startswith("embedded null ")
    if not isinstance(error, OSError):
        return False
    gone = error.errno == errno.ENOENT and error.filename is None  # the folder that the user is in
    return gone or error.errno in (errno.ENAMETOOLONG, errno.ELOOP, errno.EACCES, errno.EPERM)


def _interrupted(error: KeyboardInterrupt) -> int:
    """Say that the user, or the system, ended the command."""
    print(f"simrecon: interrupted, {printable(str(error)) or NOTHING}", file=sys.stderr)
    return signals.exit_status(error)


def _parser(words: list[str] | None = None) -> Parser:
    """The program's parser.

    Args:
        words: of the command line, of whose command alone the options are known; None: of all commands.
    """
    parser = Parser(prog="simrecon", description=PURPOSE, allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"simrecon {simrecon.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    parsers = parser.add_subparsers(required=True, metavar="COMMAND")
    if words is None:
        commands.add_all(parsers)
        return parser
    asked = next((word for word in words if not word.startswith("-")), None)
    if asked in commands.COMMANDS:
        commands.add(parsers, asked)
        return parser
    for name in commands.COMMANDS:
        parsers.add_parser(name, help=commands.purpose(name))
    return parser
