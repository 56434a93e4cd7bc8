"""The rooms of the package and what each may import: downwards only."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "fracctl"

BOTTOM_UP = (
    "errors",
    "lazy",
    "units",
    "arrays",
    "elements",
    "dispersions",
    "compiling",
    "fractional",
    "plants",
    "controllers",
    "loop",
    "characteristic",
    "panels",
    "polynomials",
    "features",
    "trajectory",
    "stepwise",
    "meshwise",
    "solvers",
    "stability",
    "design",
    "measures",
    "sampled",
    "evaluation",
    "delayed_evaluation",
    "memory_evaluation",
    "flight",
    "accuracy",
    "surveys",
    "comparison",
    "store",
    "config",
    "figures",
    "execution",
    "reproduction",
    "report",
    "cli",
)
"""Figures and the report read the store only; a run in `execution` draws figures at its end, a report of a paper's run
has the published numbers of `reproduction`."""

LONGEST_MODULE = 350
HYDRA_MODULE = "config/compose.py"

MODULES = sorted(PACKAGE.rglob("*.py"))
FRONT_DOORS = (PACKAGE / "__init__.py", PACKAGE / "__main__.py")
"""They see all rooms."""


def imported_names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything imported anywhere in a module, inside functions and by `import_module` too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: relative import"
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            yield from ((node.lineno, word.value) for word in node.args if isinstance(word, ast.Constant))


def room(dotted: str) -> str | None:
    """`fracctl.solvers.contour.solver` lies in `solvers`; the package itself and other packages lie in none."""
    parts = dotted.split(".")
    return parts[1] if parts[0] == "fracctl" and len(parts) > 1 and parts[1] in existing_rooms() else None


def existing_rooms() -> set[str]:
    folders = {path.parent.relative_to(PACKAGE).parts[0] for path in MODULES if path.parent != PACKAGE}
    return folders | {path.stem for path in PACKAGE.glob("*.py")} - {"__init__", "__main__"}


def upward_imports(source: str, own_room: str) -> list[str]:
    height = BOTTOM_UP.index(own_room)
    found = []
    for line, name in imported_names(ast.parse(source)):
        other = room(name)
        if other is not None and BOTTOM_UP.index(other) > height:
            found.append(f"line {line}: {own_room} imports {name}, which lies above it")
        if name == "fracctl" or (name.startswith("fracctl.") and other is None):
            found.append(f"line {line}: {own_room} imports from the package itself ({name}); name the module")
    return found


def dotted(path: Path) -> str:
    """``fracctl.store`` of ``fracctl/store/__init__.py``."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


def circle(sources: Mapping[str, str]) -> list[str]:
    """Modules that import each other in a circle, the first one again at its end; empty where there is none.

    Imports inside functions and those for types alone count: what they hide is a circle all the same.
    """
    graph = {}
    for module, source in sources.items():
        names = [name for _, name in imported_names(ast.parse(source))]
        targets = {name if name in sources else name.rpartition(".")[0] for name in names}
        graph[module] = (targets & {*sources}) - {module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_every_room_has_its_place() -> None:
    assert existing_rooms() <= set(BOTTOM_UP), "a new room needs a place in BOTTOM_UP and in DESIGN"


@pytest.mark.parametrize("path", sorted({*MODULES} - {*FRONT_DOORS}), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_downwards(path: Path) -> None:
    own_room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    assert upward_imports(path.read_text(encoding="utf-8"), own_room) == []


def test_no_modules_import_each_other() -> None:
    """Rooms have an order, so a circle lies inside one of them; the front doors have none to import them."""
    assert circle({dotted(path): path.read_text(encoding="utf-8") for path in MODULES}) == []
    benchmarks = sorted((PACKAGE.parent / "benchmarks").rglob("*.py"))
    assert circle({dotted(path): path.read_text(encoding="utf-8") for path in benchmarks}) == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_only_one_module_touches_hydra(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    lines = [line for line, name in imported_names(tree) if name.split(".")[0] == "hydra"]
    assert lines == [] or path == PACKAGE / HYDRA_MODULE


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_modules_stay_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST_MODULE


@pytest.mark.parametrize(
    "line",
    [
        "from fracctl.loop import ClosedLoop",
        "import fracctl.loop",
        "from fracctl import loop",
        "from fracctl import ClosedLoop",
        "import fracctl",
        "def f():\n    from fracctl.loop import ClosedLoop",
        "if TYPE_CHECKING:\n    from fracctl.loop import ClosedLoop",
    ],
)
def test_an_upward_import_is_seen(line: str) -> None:
    assert upward_imports(line, "fractional") != []


@pytest.mark.parametrize("line", ["from fracctl.arrays import Floats", "from fracctl import errors", "import numpy"])
def test_a_downward_import_is_allowed(line: str) -> None:
    assert upward_imports(line, "fractional") == []


@pytest.mark.parametrize(
    "back",
    [
        "from fracctl.store.files import write",
        "import fracctl.store.files",
        "from fracctl.store import files",
        "def f():\n    from fracctl.store.files import write",
        "if TYPE_CHECKING:\n    from fracctl.store.files import write",
        "files = importlib.import_module('fracctl.store.files')",
    ],
)
def test_a_circle_inside_a_room_is_seen(back: str) -> None:
    sources = {
        "fracctl.store": "from fracctl.store.files import write",
        "fracctl.store.files": "from fracctl.store.parts import Part\nfrom fracctl.errors import RunError",
        "fracctl.store.parts": "import numpy\nfrom fracctl.store.lock import held",
        "fracctl.store.lock": "",
    }
    assert circle(sources) == []
    found = circle(sources | {"fracctl.store.lock": back})
    assert set(found) == {"fracctl.store.files", "fracctl.store.parts", "fracctl.store.lock"}
    assert found[0] == found[-1]


def test_a_module_that_imports_its_own_room_is_a_circle() -> None:
    door = {"fracctl.store": "from fracctl.store.files import write"}
    assert circle(door | {"fracctl.store.files": "from fracctl.store import write"}) != []
