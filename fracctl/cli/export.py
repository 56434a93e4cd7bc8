"""`fracctl export`: the controller of a composed run as it would fly, for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.errors import ArgumentError, ConfigurationError, UnsupportedError, UsageError

if TYPE_CHECKING:
    from fracctl.loop import ClosedLoop
    from fracctl.sampled import Memory

SUMMARY = "write a run's controller as a discrete state space (JSON, npz) and as C"

_DESCRIPTION = """\
Sample the law of a composed run and write controller.json, controller.npz and controller.c: a linear discrete state
space in SI units, m and m/s in, m/s^2 out. Derivatives and integrals of fractional order are kept by a memory of fixed
length, chosen so that their frequency response keeps a tolerance a decade to both sides of the loop's crossover."""

_EXAMPLES = """\
  fracctl export --to mine controller=pd_alpha controller.alpha_w=0.91 controller.k_p_w=0.85
  fracctl export --to mine --period-s 5 --delay 0.5 --memory oustaloup --tolerance 0.02 controller=pd_alpha
  fracctl export --to mine --memory window --samples 159 controller.alpha_w=0.91"""

_FLAGS = {"period": "--period-s", "delay": "--delay", "tolerance": "--tolerance", "samples": "--samples"}


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("export", "--to DIR [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides()
    parser.add_config_dir()
    parser.add_json("one JSON object: what was written, and where")
    parser.add_argument("--to", type=Path, metavar="DIR", required=True, help="directory to write to")
    parser.add_argument("--period-s", type=float, default=10.0, metavar="S", help="sample period in s (default: 10)")
    parser.add_argument(
        "--delay", type=float, default=0.0, metavar="P", help="from measurement to control, in periods (default: 0)"
    )
    parser.add_argument(
        "--memory",
        choices=("exponentials", "oustaloup", "window"),
        default="exponentials",
        help="sum of exponentials (default), Oustaloup's filter, or Grünwald and Letnikov's window of samples",
    )
    parser.add_argument(
        "--tolerance", type=float, default=0.01, metavar="T", help="relative, of the response (default: 0.01)"
    )
    parser.add_argument("--samples", type=int, metavar="M", help="length of the window, instead of a tolerance")
    parser.add_argument(
        "--feed",
        choices=("position", "velocity"),
        default="position",
        help="what derivatives are made of: measured positions (default) or velocities",
    )
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose
    from fracctl.controllers.linear import ModelBasedLaw
    from fracctl.plants import LinearPlant
    from fracctl.sampled import SampledLaw, dimensionless_time, export

    if options.samples is not None and options.memory != "window":
        raise UsageError(f"--samples is the length of a window; it goes with --memory window, not {options.memory}")
    evaluation, _ = build_checked(compose(options.overrides, options.config_dir))
    loop = evaluation.loop({})
    law = loop.controller
    loop.law_terms  # noqa: B018 - refuses what is no linear law
    if isinstance(law, ModelBasedLaw):
        assert isinstance(loop.plant, LinearPlant)
        law = law.for_plant(loop.plant)
    try:
        period = dimensionless_time(loop.plant, options.period_s)
        memory = _memory(options, loop, period)
        sampled = SampledLaw(law, memory, period, options.delay, options.feed)  # type: ignore[arg-type]
        exported = export(loop.plant, sampled)
    except ArgumentError as error:
        if error.name not in _FLAGS:
            raise
        given = getattr(options, _FLAGS[error.name].removeprefix("--").replace("-", "_"))
        raise UsageError(f"{_FLAGS[error.name]} {error.allowed}, but is {given}") from error
    except UnsupportedError as error:
        raise ConfigurationError(str(error)) from error
    if not exported.gains:
        raise ConfigurationError(
            "all gains of the controller are 0; set those that shall fly, as controller.k_p_w=0.85"
        )
    paths = exported.write(options.to)
    if options.json:
        output.say_json(
            {
                "description": exported.description,
                "states": exported.controller.n_states,
                "operations": exported.controller.operations,
                "gains": list(exported.gains),
                "files": [str(path) for path in paths],
            }
        )
        return 0
    output.say(exported.description)
    output.say(f"{exported.controller.n_states} states, {exported.controller.operations} multiply-adds a step")
    for gain in exported.gains:
        output.say(f"{gain['of']}, orders {gain['orders']}: {gain['matrix']} {gain['unit']}")
    for path in paths:
        output.say(str(path))
    return 0


def _memory(options: argparse.Namespace, loop: ClosedLoop, period: float) -> Memory:
    from fracctl.sampled import Window, memory_for

    if not period > 0.0:
        raise ArgumentError("period", period, "must be positive")
    if options.samples is not None:
        return Window(options.samples)
    try:
        return memory_for(loop, options.memory, period, options.tolerance, options.feed)
    except UnsupportedError as error:
        raise ConfigurationError(f"{error}; or set the memory by --memory window --samples M") from error
