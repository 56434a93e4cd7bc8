"""Population-based algorithms by name, all of them pymoo's, behind ask and tell.

Source: J. Blank, K. Deb, pymoo: multi-objective optimization in Python, IEEE Access 8 (2020) 89497. pymoo is imported
where a search begins, never before.

`fracctl.comparison.populations` has its own differential evolution and CMA-ES, for hundreds of searches in step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fracctl.arrays import Array, Booleans, Floats

DIFFERENTIAL_EVOLUTION, CMA_ES, NSGA2 = "differential_evolution", "cma_es", "nsga2"
ALGORITHMS = (DIFFERENTIAL_EVOLUTION, CMA_ES, NSGA2)

_CROSSOVER, _WEIGHT = 0.9, 0.7
"""Of differential evolution; of five pairs tried in plane the one that ended in no local optimum."""
_STEP = 0.25
"""First standard deviation of CMA-ES, of the width of the box."""


class Optimiser:
    """Minimises k values over a box, a generation at a time.

    Of two points the better one is what the algorithm says; none of them knows constraints, so a point that breaks
    one gets values that are worse than those of any point that does not. CMA-ES that has converged begins again
    from a population of its own.

    Args:
        algorithm: one of `ALGORITHMS`.
        population: the first generation, (p, n); later ones have p points too.
        lower: of the box, (n,).
        upper: of the box, (n,).
        n_values: k; more than 1 for NSGA-II only.
        seed: of everything random from the second generation on.
    """

    def __init__(
        self, algorithm: str, population: Floats, lower: Floats, upper: Floats, n_values: int, seed: int
    ) -> None:
        from pymoo.core.problem import Problem

        self._algorithm, self._population = algorithm, population
        self._problem = Problem(n_var=len(lower), n_obj=n_values, xl=lower, xu=upper)
        self._random = np.random.default_rng(seed)
        self._running = self._begin(population)

    def ask(self) -> Floats:
        """Return the points of the next generation, (p, n)."""
        if not self._running.has_next():
            size = self._population.shape
            self._running = self._begin(self._random.uniform(self._problem.xl, self._problem.xu, size))
        self._asked = self._running.ask()
        points: Floats = self._asked.get("X")
        return points

    def tell(self, values: Floats) -> None:
        """Hand back the values (p, k) of the points that were asked last."""
        self._asked.set("F", values)
        self._running.tell(infills=self._asked)

    def _begin(self, population: Floats) -> Any:
        from pymoo.core.termination import NoTermination

        running = self._make(population)
        seed = int(self._random.integers(2**31))
        running.setup(self._problem, seed=seed, termination=NoTermination())
        if self._algorithm == CMA_ES:
            running.opts |= {"seed": np.nan, "randn": _normals(np.random.default_rng(seed))}
        return running

    def _make(self, population: Floats) -> Any:
        size = len(population)
        if self._algorithm == CMA_ES:
            from pymoo.algorithms.soo.nonconvex.cmaes import SimpleCMAES

            return SimpleCMAES(sigma=_STEP, opts={"popsize": size, "verbose": -9}, initial=population)
        if self._algorithm == NSGA2:
            from pymoo.algorithms.moo import nsga2

            return nsga2.NSGA2(pop_size=size, sampling=population)
        from pymoo.algorithms.soo.nonconvex.de import DE

        return DE(pop_size=size, sampling=population, variant="DE/best/1/bin", CR=_CROSSOVER, F=_WEIGHT)


def non_dominated(values: Floats) -> Booleans:
    """Return which rows of (n, k) no other row is at least as good as in every value, the first of equal ones."""
    from moocore import is_nondominated

    found: Booleans = is_nondominated(values)
    return found


def _normals(random: np.random.Generator) -> Any:
    """What CMA-ES draws normal numbers from instead of the global generator, which others use."""

    def draw(*shape: int) -> Array:
        return random.standard_normal(shape)

    return draw
