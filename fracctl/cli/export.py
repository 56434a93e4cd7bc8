"""`fracctl export`: the controller of a composed run as it would fly, for other programs."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.errors import ArgumentError, ConfigurationError, UnsupportedError, UsageError, suggestion

if TYPE_CHECKING:
    from fracctl.flight import Sampling
    from fracctl.loop import ClosedLoop

SUMMARY = "write a run's controller as a discrete state space (JSON, npz) and as C"

_DESCRIPTION = """\
Sample the law of a composed run and write controller.json, controller.npz and controller.c: a linear discrete state
space in SI units, m and m/s in, m/s^2 out. Derivatives and integrals of fractional order are kept by a memory of fixed
length, chosen so that their frequency response keeps a tolerance a decade to both sides of the loop's crossover. Of a
run of flights the controller is the one that flies, unless an option says otherwise."""

_EXAMPLES = """\
  fracctl export --to mine controller=pd_alpha controller.alpha_w=0.91 controller.k_p_w=0.85
  fracctl export --to mine --period-s 5 --delay 0.5 --memory oustaloup --tolerance 0.02 controller=pd_alpha
  fracctl export --to mine --memory window --samples 159 controller.alpha_w=0.91
  fracctl export --to mine --law pd_lag experiment=flight_ic1"""

_FLAGS = {
    "period": "--period-s",
    "period_s": "--period-s",
    "delay": "--delay",
    "memory_tolerance": "--tolerance",
    "memory_samples": "--samples",
    "samples": "--samples",
}
_FLIGHTS = "default: as flights of the run do, else"


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("export", "--to DIR [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides()
    parser.add_config_dir()
    parser.add_json("one JSON object: what was written, and where")
    parser.add_argument("--to", type=Path, metavar="DIR", required=True, help="directory to write to")
    parser.add_argument("--law", metavar="NAME", help="which one, of a run of flights with several")
    parser.add_argument("--period-s", type=float, metavar="S", help=f"sample period in s ({_FLIGHTS} 10)")
    parser.add_argument(
        "--delay", type=float, metavar="P", help=f"from measurement to control, in periods ({_FLIGHTS} 0)"
    )
    parser.add_argument(
        "--memory",
        choices=("exponentials", "oustaloup", "window"),
        help="sum of exponentials, Oustaloup's filter, or Grünwald and Letnikov's window of samples "
        f"({_FLIGHTS} exponentials)",
    )
    parser.add_argument(
        "--tolerance", type=float, metavar="T", help=f"relative, of the response, in (0, 1) ({_FLIGHTS} 0.01)"
    )
    parser.add_argument("--samples", type=int, metavar="M", help="length of the window, instead of a tolerance")
    parser.add_argument(
        "--feed",
        choices=("position", "velocity"),
        help=f"what derivatives are made of: measured positions or velocities ({_FLIGHTS} position)",
    )
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose
    from fracctl.sampled import export

    evaluation, _ = build_checked(compose(options.overrides, options.config_dir))
    loop = _loop(evaluation, options.law)
    loop.law_terms  # noqa: B018 - refuses what is no linear law
    try:
        sampling = _sampling(evaluation, options)
        exported = export(loop.plant, _sampled(sampling, loop))
    except ArgumentError as error:
        if error.name not in _FLAGS:
            raise
        cure = f"; {error.instead}" if error.instead else ""
        raise UsageError(f"{_FLAGS[error.name]} {error.allowed}, but is {error.value}{cure}") from error
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


def _loop(evaluation: Any, law: str | None) -> ClosedLoop:
    """Return the loop of a run's law, of several of the one with a name."""
    from fracctl.evaluation import LAW_NUMBER
    from fracctl.flight import FlightEvaluation

    names = list(evaluation.laws) if isinstance(evaluation, FlightEvaluation) else []
    if law is None and len(names) > 1:
        raise UsageError(f"the run has several laws; say which by --law: {', '.join(names)}")
    if law is not None and law not in names:
        allowed = (
            f"must be one of {', '.join(names)}{suggestion(law, names)}" if names else "goes with several laws that fly"
        )
        raise UsageError(f"--law {allowed}, but is {law}")
    loop: ClosedLoop = evaluation.loop({} if law is None else {LAW_NUMBER: float(names.index(law))})
    return loop


def _sampling(evaluation: Any, options: argparse.Namespace) -> Sampling:
    """Return how flights of the run are sampled, or laws of others, with what the options change."""
    from fracctl.flight import FlightEvaluation, Sampling

    flown = evaluation.sampling if isinstance(evaluation, FlightEvaluation) else Sampling(feed="position")
    given = {"period_s": options.period_s, "delay": options.delay, "memory": options.memory, "feed": options.feed}
    changed = {name: value for name, value in given.items() if value is not None}
    if options.tolerance is not None:
        changed |= {"memory_tolerance": options.tolerance, "memory_samples": None}
    if options.memory not in (None, "window") or options.samples is not None:
        changed["memory_samples"] = options.samples
    return replace(flown, **changed)


def _sampled(sampling: Sampling, loop: ClosedLoop) -> Any:
    try:
        return sampling.law(loop)
    except UnsupportedError as error:
        raise ConfigurationError(f"{error}; or set the memory by --memory window --samples M") from error
