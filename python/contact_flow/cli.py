# SPDX-License-Identifier: BSD-3-Clause
"""The command contact_flow: simulate, derive, compare, orbit, stabilize, report, sweep, models, robot.

SYSTEM is the name of a model in C++, a YAML of config/ (with a key `model`), the YAML of a robot, or a
URDF. Exit status: 0 where all is well, 1 where the answer is a reason why not, 2 for misuse.
"""
from __future__ import annotations

import argparse
import json
import math
import os
import sys
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from . import cli_commands, cli_sweep
from ._core import BudgetExceeded, Model, NoDerivative, NotPiecewiseLinear, Robot, System, load_configuration
from .progress import Progress

Loaded = Tuple[System, Dict[str, Any], Dict[str, Any]]


def load(name: str, parameters: Dict[str, float]) -> Loaded:
    """(system, options of runs, options of derivatives)."""
    if name.endswith((".yaml", ".yml")):
        try:
            with open(name, encoding="utf-8") as file:
                is_model = any(line.startswith("model:") for line in file)
        except OSError as error:
            raise ValueError(str(error)) from None
        if is_model:
            system, options, derivative = load_configuration(name)
            return system.with_parameters(**parameters), options, derivative
    if name.endswith((".yaml", ".yml", ".urdf", ".xacro", ".xml")):
        return Robot(name).with_parameters(**parameters), {}, {}
    return Model(name, **parameters), {}, {}


def pair(text: str) -> Tuple[str, float]:
    """NAME=VALUE."""
    name, equals, value = text.rpartition("=")
    try:
        return name, float(value) if equals and name else float("")
    except ValueError:
        raise argparse.ArgumentTypeError("'%s' is not NAME=NUMBER" % text) from None


def option(text: str) -> Tuple[str, Any]:
    """NAME=VALUE of an option: a number, true, false or a word."""
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError("'%s' is not NAME=VALUE" % text)
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            pass
    return name, {"true": True, "false": False}.get(value.lower(), value)


def plain(value: Any) -> Any:
    """What JSON has: arrays as lists, numbers that are not finite as null."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="contact_flow", description=__doc__,
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(name: str, about: str, run: Callable[..., Tuple[Any, str, bool]],
            system: bool = True) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=about, description=about)
        command.set_defaults(run=run)
        command.add_argument("--json", action="store_true", help="print the answer as JSON")
        if system:
            command.add_argument("system", metavar="SYSTEM")
            command.add_argument("-p", "--parameter", type=pair, action="append", default=[],
                                 metavar="NAME=VALUE", help="a value of a parameter")
        return command

    def add_run(command: argparse.ArgumentParser) -> None:
        command.add_argument("-x", "--state", type=pair, action="append", default=[],
                             metavar="NAME=VALUE",
                             help="a number of the initial state, over the nominal one; 'd/dt NAME' a rate")
        command.add_argument("-u", "--input", type=pair, action="append", default=[],
                             metavar="NAME=VALUE", help="a constant input, over the nominal one")
        command.add_argument("-t", "--duration", type=float, metavar="SECONDS")
        command.add_argument("-o", "--option", type=option, action="append", default=[],
                             metavar="NAME=VALUE", help="an option of simulate, as relative_tolerance=1e-12")

    def add_derivative(command: argparse.ArgumentParser) -> None:
        command.add_argument("--by", nargs="+", default=["state"], metavar="NAME",
                             help="state, inputs, parameters, or names of parameters")
        command.add_argument("-w", "--direction", action="append", default=[], metavar="+NAME or NAME=VALUE",
                             help="a unit direction each, or together one of these numbers")

    def add_orbit(command: argparse.ArgumentParser) -> None:
        section = command.add_mutually_exclusive_group(required=True)
        section.add_argument("--apex", metavar="NAME", help="where the velocity of a coordinate falls through 0")
        section.add_argument("--crossing", type=pair, metavar="NAME=VALUE", help="where it has this value")
        section.add_argument("--touchdown", metavar="NAME", help="just behind the impact of a contact")
        section.add_argument("--after", type=float, metavar="SECONDS")
        command.add_argument("--translation", nargs="+", default=[], metavar="NAME",
                             help="coordinates whose common shift is set aside")

    add("models", "names of the models in C++", cli_commands.models, system=False)
    add("robot", "what a system is made of: names, units, parameters", cli_commands.robot)
    simulate = add("simulate", "a run: events, contact modes, final state", cli_commands.simulate)
    add_run(simulate)
    simulate.add_argument("--csv", metavar="FILE", help="write the motion there, '-' for the terminal")
    simulate.add_argument("--samples", type=int, default=200, help="instants of the CSV")
    derive = add("derive", "the B-derivative of the final state along directions", cli_commands.derive)
    add_run(derive)
    add_derivative(derive)
    compare = add("compare", "the derivative beside difference quotients of perturbed runs",
                  cli_commands.compare)
    add_run(compare)
    add_derivative(compare)
    compare.add_argument("--alphas", type=float, nargs="+", default=[1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
    orbit = add("orbit", "a periodic orbit near the state, and its stability", cli_commands.orbit)
    add_run(orbit)
    add_orbit(orbit)
    orbit.add_argument("--free", nargs="+", default=[], metavar="PARAMETER")
    orbit.add_argument("--condition", type=json.loads, action="append", default=[], metavar="JSON",
                       help="""as {"kind": "period", "value": 0.8}""")
    stabilize = add("stabilize", "inputs that are set once a step and make the orbit through the state stable",
                    cli_commands.stabilize)
    add_run(stabilize)
    add_orbit(stabilize)
    stabilize.add_argument("--inputs", nargs="+", metavar="NAME", help="that are set; all otherwise")
    stabilize.add_argument("--piecewise", action="store_true", help="a gain for each piece of the return map")
    stabilize.add_argument("--starts", type=int, default=20, help="perturbed ones that are simulated")
    stabilize.add_argument("--away", type=float, default=0.01, help="of these from the orbit, in SI units together")
    stabilize.add_argument("--returns", type=int, default=50)
    report = add("report", "one HTML file of a run, of a SYSTEM or of a recorded bag: contacts, events, states, "
                 "forces, motion, derivative", cli_commands.report)
    add_run(report)
    report.add_argument("--by", nargs="+", metavar="NAME",
                        help="state, inputs, parameters, or names of parameters")
    report.add_argument("--number", type=int, default=-1, metavar="K",
                        help="of a bag, its run number K, from 0 on; the last one otherwise")
    report.add_argument("file", metavar="FILE.html", nargs="?", help="the SYSTEM's name with .html otherwise")
    sweep = add("sweep", "many runs from drawn starts and parameters, as a YAML file says",
                cli_sweep.sweep_command, system=False)
    sweep.add_argument("file", metavar="FILE.yaml", nargs="?")
    sweep.add_argument("--runs", type=int, metavar="N", help="instead of the file's")
    sweep.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores")
    sweep.add_argument("--directory", metavar="DIR", help="a Zarr store that is written chunk by chunk")
    sweep.add_argument("--chunk", type=int, default=0, metavar="RUNS", help="runs of a chunk; 0: some seconds")
    sweep.add_argument("--resume", metavar="DIR", help="run what is missing in a store")
    sweep.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, whose workers run the chunks")
    sweep.add_argument("--report", metavar="FILE.html", help="a page of it and of the run without draws")
    sweep.add_argument("--quiet", action="store_true", help="no progress")
    return top


def joined(words: Sequence[str]) -> List[str]:
    """`-w -name` as one word: argparse takes a word that begins with - for an option."""
    found: List[str] = []
    for word in words:
        if found and found[-1] in ("-w", "--direction"):
            found[-1] = "--direction=" + word
        else:
            found.append(word)
    return found


def main(words: Optional[Sequence[str]] = None) -> int:
    arguments = parser().parse_args(joined(sys.argv[1:] if words is None else words))
    try:
        with Progress(sys.stderr) as progress:
            arguments.tell = progress.tell
            answer, text, ok = arguments.run(arguments, load)
    except (NoDerivative, NotPiecewiseLinear, BudgetExceeded) as error:   # reasons why not
        print("contact_flow: %s" % error, file=sys.stderr)
        return 1
    except (ValueError, TypeError, OSError, ImportError, RuntimeError, ArithmeticError) as error:
        print("contact_flow: %s" % error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("contact_flow: interrupted", file=sys.stderr)
        return 130
    try:
        print(json.dumps(plain(answer), indent=1) if arguments.json else text, flush=True)
    except BrokenPipeError:   # `… | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0 if ok else 1
