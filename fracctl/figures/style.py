"""The look of the figures, and files that are byte for byte the same on every repeat."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

FULL_WIDTH_IN = 6.9
"""Width of a figure over both columns of a journal's page, inches."""

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#5A5A5A"
"""Colours that stay apart for colour-blind readers (Okabe and Ito 2008), and a grey."""

_STRIP_IN = 0.22
"""Height of the strip below a figure that holds a remark."""

CYCLE = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of further curves, in this order."""

STAR: Mapping[str, Any] = {"marker": "*", "linestyle": "none", "markeredgecolor": "white", "markeredgewidth": 0.6}
"""A star with a white rim, to be seen on any ground."""

COLOUR_MAP = "cividis"
"""Even in lightness, and the same for all colour visions (Nuñez, Anderton, Renslow 2018)."""

STYLE: dict[RcKeyType, Any] = {
    "font.family": "serif",
    "font.serif": ["STIXGeneral"],
    "mathtext.fontset": "stix",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.grid": False,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "patch.linewidth": 0.6,
    "hatch.linewidth": 0.4,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "figure.facecolor": "white",
    "figure.dpi": 300.0,
    "savefig.facecolor": "white",
    "pdf.fonttype": 42,
    "pdf.compression": 6,
    "svg.hashsalt": "fracctl",
    "path.simplify": True,
    "path.simplify_threshold": 0.1,
}
"""Everything that decides how a figure looks, over Matplotlib's own defaults; a user's settings play no part."""

FILES = ("pdf", "png")
"""Kinds of the files that a run keeps."""
_MOST_POINTS = 3000
"""What has more markers or vertices than this is an image within an SVG, which would grow by a hundred bytes each."""
_IMAGE_DPI = 200
_METADATA: Mapping[str, dict[str, None]] = {
    "pdf": {"CreationDate": None, "ModDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None, "Format": None, "Type": None},
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the project's style, whatever the user's Matplotlib settings are; restore them afterwards."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def render(figure: Figure, kinds: Sequence[str] = FILES, remark: str = "") -> dict[str, bytes]:
    """Return the figure as files of these kinds, without dates or versions in them; a remark stands below it."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    width, height = figure.get_size_inches()
    figure.text(0.1 / width, -0.7 * _STRIP_IN / height, remark, color=ORANGE)
    with_strip = Bbox([[0.0, -_STRIP_IN], [width, height]])
    files = {}
    if "svg" in kinds:
        _rasterise(figure)
    for kind in kinds:
        buffer = io.BytesIO()
        dpi = _IMAGE_DPI if kind == "svg" else "figure"
        box = with_strip if remark else None
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=_METADATA[kind], bbox_inches=box)
        files[kind] = buffer.getvalue()
    return files


def _rasterise(figure: Figure) -> None:
    for line in figure.findobj(Line2D):
        marked = line.get_marker() not in ("None", "", " ", None)
        if marked and np.size(line.get_xdata()) > _MOST_POINTS:
            line.set_rasterized(True)
    for collection in figure.findobj(Collection):
        vertices = sum(np.shape(path.vertices)[0] for path in collection.get_paths())
        if max(vertices, np.shape(collection.get_offsets())[0]) > _MOST_POINTS:
            collection.set_rasterized(True)
