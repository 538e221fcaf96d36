"""The commands of the program, known without importing any of them."""

from __future__ import annotations

import importlib
from typing import Any

COMMANDS = {
    "demo": ("run", "run the example that ships with simrecon"),
    "run": ("run", "reconstruct a simulated motion from a clip"),
    "look": ("look", "show who is in a video, and how well the person is followed"),
    "rerun": ("rerun", "simulate a finished result again, starting from its motion"),
    "retarget": ("retarget", "put the motion of a finished result on another body, and simulate it"),
    "synthesize": ("synthesize", "predict what a person may do next, several times, and simulate it"),
    "report": ("report", "make report.html of a result: its motion in 3D, curves and figures"),
    "export": ("export", "write a result in the formats of other programs"),
    "eval": ("evaluate", "score a result against a reference"),
    "picture": ("picture", "draw frames of a result, with its forces"),
    "scene": ("scene", "make, edit, check and show a scene"),
    "contacts": ("contacts", "write what touched in a result, as a start for editing"),
    "bench": ("bench", "run a suite of clips and make its tables"),
    "batch": ("batch", "run many clips, one after another or side by side"),
    "doctor": ("doctor", "look what is installed, and what to type for what is missing"),
    "models": ("weights", "weights of the pose network, for videos"),
    "studio": ("studio", "look at a result in the browser, edit scene and contacts, and run again"),
    "completion": ("completion", "print what makes a shell complete commands and options"),
}
"""By name, in the order of help: the module of the package `cli` that adds a command, and what it is for."""


def purpose(name: str) -> str:
    """What a command is for, one line in lower case."""
    return COMMANDS[name][1]


def add(commands: Any, name: str) -> None:
    """Add a command to the subparsers of the program, with those that its module adds beside it."""
    importlib.import_module(f"simrecon.cli.{COMMANDS[name][0]}").add(commands)


def add_all(commands: Any) -> None:
    """Add all commands, those of a module once."""
    for module in dict.fromkeys(module for module, _ in COMMANDS.values()):
        importlib.import_module(f"simrecon.cli.{module}").add(commands)
