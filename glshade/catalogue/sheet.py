"""Sheet: draws the panels of one or several materials on a matplotlib figure, with one method for each kind of panel."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from glshade.brdfs import Brdf
from glshade.catalogue import lobe, pictures
from glshade.catalogue.pictures import DECADES, Kind, matplotlib_colour

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[np.float64]
Scale = Literal["auto", "linear", "log"]

# The palette of Okabe and Ito 2008, whose colours people with any kind of colour vision can tell apart. Its yellow is left out,
# because it is too pale on white.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
# The dash patterns of lines. When all colours of the palette are used up, they repeat with the next dash pattern.
STROKES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
# The colours of the lines that show the three channels [linear Rec. 709]. All have a luminance of about 0.12, so that each is
# dark enough on white. The lines differ in their dash patterns too.
CHANNELS = (("red", (0.56, 0.0, 0.0)), ("green", (0.0, 0.17, 0.0)), ("blue", (0.03, 0.06, 0.85)))
INK, FAINT = "#30343b", "#d5d8dd"
STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlecolor": INK,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.edgecolor": "#8a9099",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.dpi": 150,
    "savefig.dpi": 150,
}
# The scale "auto" is logarithmic if the highest curve is more than this many times as high as the lowest. On a linear scale the
# lowest curve would then lie within the innermost fifth of the half disc.
HIDDEN = 5
# This text is added to the label of a lobe that grows without bound towards the horizon.
CUT = "; cut off there"
# The margins around the axes of a curve, a half disc and a picture, for ticks, labels and titles: left, right, bottom, top
# [inches].
CURVE, DISC = (0.62, 0.18, 0.6, 0.4), (0.15, 0.15, 0.4, 0.35)
PICTURE, NAMED_PICTURE = (0.1, 0.1, 0.4, 0.4), (0.1, 0.1, 0.35, 0.5)
# The largest number of panels in a row.
ACROSS = 4
# The side of rendered pictures [pixels]. It is a little more than the side of a panel.
SIDE = 420
# kind -> the title of its panels
NAMES: dict[Kind, str] = {
    "polar": "Light leaving in the plane of incidence",
    "lobe": "Lobe",
    "sphere": "Lit sphere",
    "furnace": "White furnace",
    "albedo": "Directional albedo",
    "fresnel": "Fresnel reflectance",
}


@dataclass(frozen=True)
class Panel:
    """A panel of a sheet.

    The margins are fixed: matplotlib's own layouts differ in the last bits from run to run, and the bytes of an SVG file would
    differ too.

    draw: a function that draws the panel into matplotlib's axes.
    width, height: the size of the panel [inches].
    margins: left, right, bottom, top, between the axes and the edges of the panel [inches].
    """

    draw: Callable[[Any], None]
    width: float
    height: float
    margins: tuple[float, float, float, float]


@dataclass
class Sheet:
    """The materials of a figure and how they are plotted.

    materials: label -> material without textures.
    angles: the angles of incidence of the slices [rad].
    incidence: the angle of incidence of the solid lobes [rad].
    azimuth: the angle between the plane of incidence and the tangent [rad].
    quantity: the quantity that slices and lobes show.
    scale: the scale of slices and lobes.
    renderer: the Renderer that draws spheres and lobes; None if the figure has neither.
    """

    materials: Mapping[str, Brdf]
    angles: tuple[float, ...]
    incidence: float
    azimuth: float
    quantity: lobe.Quantity
    scale: Scale
    renderer: Renderer | None
    # (label, angle) -> (angles, luminance), as `slice` returns them.
    _slices: dict[tuple[str, float], tuple[Array, Array]] = field(default_factory=dict)

    @property
    def single(self) -> bool:
        """Whether the sheet shows a single material. If so, its panels tell angles and channels apart by colour."""
        return len(self.materials) == 1

    @property
    def unit(self) -> str:
        """The quantity and its unit, as the label of an axis."""
        return r"$f\,\cos\theta_l$  [1/sr]" if self.quantity == "f cos" else "$f$  [1/sr]"

    def colour(self, label: str) -> str:
        """Returns the colour of a material's lines."""
        return PALETTE[list(self.materials).index(label) % len(PALETTE)]

    def stroke(self, label: str) -> Any:
        """Returns the dash pattern of a material's lines."""
        return STROKES[list(self.materials).index(label) // len(PALETTE) % len(STROKES)]

    def figure(self, kinds: Sequence[Kind]) -> Figure:
        """Returns the figure, with the panels of these kinds under the name of the material or a legend."""
        with matplotlib.style.context(["default", STYLE]):
            rows = self._rows(kinds)
            width = max(max(sum(panel.width for panel in row) for row in rows), 4.2)
            heights = [max(panel.height for panel in row) for row in rows]
            across = max(1, int(width / 2.4))
            # The height of the name or the legend above all panels [inches].
            head = 0.4 if self.single else 0.2 + 0.22 * math.ceil(len(self.materials) / across)
            height = sum(heights) + head
            result = Figure(figsize=(width, height), facecolor="white")
            middle = (0.5, 1 - 0.5 * head / height)
            if self.single:
                result.text(*middle, _escaped(next(iter(self.materials))), ha="center", va="center", fontsize=12, color=INK)
            else:
                handles = [
                    Line2D([], [], color=self.colour(label), linestyle=self.stroke(label), label=_escaped(label))
                    for label in self.materials
                ]
                ncols = min(across, len(handles))
                result.legend(handles=handles, loc="center", bbox_to_anchor=middle, ncols=ncols, fontsize=9)
            y = height - head
            for row, row_height in zip(rows, heights, strict=True):
                y -= row_height
                # Rows are centred.
                x = (width - sum(panel.width for panel in row)) / 2
                for panel in row:
                    left, right, bottom, top = panel.margins
                    w, h = panel.width - left - right, row_height - bottom - top
                    panel.draw(result.add_axes(((x + left) / width, (y + bottom) / height, w / width, h / height)))
                    x += panel.width
            return result

    def _rows(self, kinds: Sequence[Kind]) -> list[list[Panel]]:
        """Returns the panels of these kinds in rows, from top to bottom."""
        panels: dict[Kind, list[Panel]] = {kind: getattr(self, f"_{kind}_panels")() for kind in dict.fromkeys(kinds)}
        if self.single:
            # The panels of a single material fit into two rows.
            groups = [("polar", "lobe"), ("sphere", "furnace", "albedo", "fresnel")]
            rows = [[panel for kind in group for panel in panels.get(kind, ())] for group in groups]  # type: ignore[call-overload]
        else:
            curves = [*panels.pop("albedo", ()), *panels.pop("fresnel", ())]
            rows = [*(row for kind_panels in panels.values() for row in _wrapped(kind_panels)), curves]
        rows = [row for row in rows if row]
        if not rows:
            # Only Fresnel curves were asked for, and no material has any.
            rows = [[Panel(_no_fresnel, 4.2, 2.0, CURVE)]]
        return rows

    # --- slices ---------------------------------------------------------------------------------------------------------

    def slice(self, label: str, angle: float) -> tuple[Array, Array]:
        """Returns (angles (N,) [rad], luminance (N,)) of a material's slice for light at `angle`. Slices are cached."""
        if (label, angle) not in self._slices:
            angles, values = lobe.polar_slice(self.materials[label], angle, self.azimuth, self.quantity)
            self._slices[label, angle] = angles, values @ lobe.LUMINANCE
        return self._slices[label, angle]

    def _peak(self, label: str, angle: float) -> float:
        """Returns the largest luminance of a slice that the scale has to hold."""
        return lobe.drawn_height(*self.slice(label, angle), lobe.unbounded(self.materials[label], angle, self.azimuth))

    def _polar_panels(self) -> list[Panel]:
        peaks = {(label, angle): self._peak(label, angle) for label in self.materials for angle in self.angles}
        positive = [peak for peak in peaks.values() if peak > 0]
        hides = bool(positive) and max(positive) > HIDDEN * min(positive)
        log = self.scale == "log" or (self.scale == "auto" and hides)
        if self.single:
            return [Panel(partial(self._polar, self.angles, log, max(positive, default=1.0)), 6.4, 3.8, DISC)]
        return [
            Panel(
                partial(
                    self._polar,
                    (angle,),
                    log,
                    max(positive if log else [peaks[label, angle] for label in self.materials], default=1.0),
                ),
                3.9,
                2.5,
                DISC,
            )
            for angle in self.angles
        ]

    def _polar(self, incidences: Sequence[float], log: bool, most: float, axes: Any) -> None:
        """Draws slices on a half disc. Matplotlib's own polar axes are not used: they would leave room for a whole disc.

        incidences: the angles of incidence [rad].
        log: True for a logarithmic scale.
        most: the largest value that the disc has to hold.
        """
        most = most or 1.0
        if log:
            rim = 1.2 * most
            top = math.floor(math.log10(rim))
            places = [(1 + (power - math.log10(rim)) / DECADES, power) for power in range(top, top - DECADES, -1)]
            # Each circle has a label on both sides. On the smallest circles the two would overlap, so these have no labels.
            ticks = [(radius, f"$10^{{{power}}}$") for radius, power in places if radius > 0.08]
        else:
            rim = 1.04 * most
            steps: list[float] = np.asarray(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0, most)).tolist()
            ticks = [(step / rim, f"{step:.10g}") for step in steps if 0 < step <= rim]
        _half_disc(axes, ticks)
        for place, incidence in enumerate(incidences):
            ray = PALETTE[place % len(PALETTE)] if self.single else INK
            x, y = -math.sin(incidence), math.cos(incidence)
            arrow = {"arrowstyle": "-|>", "color": ray, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", xy=(0.84 * x, 0.84 * y), xytext=(x, y), arrowprops=arrow)
            axes.plot([0, 0.86 * x], [0, 0.86 * y], color=ray, linewidth=0.8, linestyle=(0, (4, 3)))
            for label in self.materials:
                angles, value = self.slice(label, incidence)
                radius = pictures.radii(value, "log" if log else "linear", rim)
                colour = ray if self.single else self.colour(label)
                stroke = STROKES[place // len(PALETTE) % len(STROKES)] if self.single else self.stroke(label)
                axes.plot(
                    radius * np.sin(angles), radius * np.cos(angles), color=colour, linestyle=stroke, label=_degrees(incidence)
                )
        axes.set_title(NAMES["polar"] if self.single else f"Light at {_degrees(incidences[0])}")
        scale = f", log over {DECADES} decades" if log else ""
        unbounded = any(lobe.unbounded(material, i, self.azimuth) for material in self.materials.values() for i in incidences)
        scale += CUT if unbounded else ""
        axes.set_xlabel(f"luminance of {self.unit}{scale}", labelpad=2)
        if self.single:
            axes.legend(title="light at", loc="upper right", bbox_to_anchor=(1.02, 1.0), title_fontsize=8)

    # --- pictures -------------------------------------------------------------------------------------------------------

    def _lobe_panels(self) -> list[Panel]:
        return [
            Panel(partial(self._lobe, label), 4.6, 3.8, PICTURE)
            if self.single
            else Panel(partial(self._lobe, label), 3.0, 2.75, NAMED_PICTURE)
            for label in self.materials
        ]

    def _lobe(self, label: str, axes: Any) -> None:
        scale: pictures.Scale = "log" if self.scale == "log" else "linear"
        colour = tuple(float(c) for c in _linear(self.colour(label)))
        scene, most = pictures.solid(
            self.materials[label],
            self.incidence,
            self.azimuth,
            self.quantity,
            scale,
            2 * SIDE,
            colour,  # type: ignore[arg-type]
        )
        assert self.renderer is not None
        self._picture(axes, self.renderer.render(scene).pixels)
        for name, (x, y) in pictures.tips(self.incidence).items():
            offset = (0, 4) if name == "n" else (-5, 4)
            axes.annotate(
                f"${name}$",
                (x, y),
                xycoords="axes fraction",
                xytext=offset,
                textcoords="offset points",
                ha="center",
                color=INK,
                fontsize=10,
            )
        decades = f", log over {DECADES} decades" if scale == "log" else ""
        decades += CUT if lobe.unbounded(self.materials[label], self.incidence, self.azimuth) else ""
        self._name(axes, "lobe", label, f"light at {_degrees(self.incidence)}; radius 1 is {most:.3g} /sr{decades}")

    def _sphere_panels(self) -> list[Panel]:
        return [
            Panel(partial(self._sphere, label), 2.7, 3.1, PICTURE if self.single else NAMED_PICTURE) for label in self.materials
        ]

    def _sphere(self, label: str, axes: Any) -> None:
        assert self.renderer is not None
        self._picture(axes, self.renderer.render(pictures.sphere(self.materials[label], SIDE)).pixels)
        self._name(axes, "sphere", label, "one directional light, upper left")

    def _furnace_panels(self) -> list[Panel]:
        return [
            Panel(partial(self._furnace, label), 2.7, 3.1, PICTURE if self.single else NAMED_PICTURE)
            for label in self.materials
        ]

    def _furnace(self, label: str, axes: Any) -> None:
        image, (least, most) = pictures.furnace(self.materials[label], SIDE)
        self._picture(axes, image.encoded().pixels)
        self._name(axes, "furnace", label, f"grey: albedo 1; here {least:.3f} to {most:.3f}")

    def _picture(self, axes: Any, pixels: NDArray[Any]) -> None:
        axes.imshow(pixels, interpolation="antialiased")
        _bare(axes)

    def _name(self, axes: Any, kind: Kind, label: str, note: str) -> None:
        if self.single:
            axes.set_title(NAMES[kind])
        else:
            axes.set_title(f"{NAMES[kind]}\n{_escaped(label)}", color=self.colour(label), fontsize=9)
        axes.set_xlabel(note, fontsize=8)

    # --- curves ---------------------------------------------------------------------------------------------------------

    def _albedo_panels(self) -> list[Panel]:
        return [Panel(self._albedo, 3.7 if self.single else 5.2, 3.1, CURVE)]

    def _albedo(self, axes: Any) -> None:
        highest = 1.0
        for label, material in self.materials.items():
            angles, albedos = lobe.albedo_curve(material, self.azimuth)
            self._curve(axes, label, angles, albedos, self.stroke(label))
            highest = max(highest, float(albedos.max()))
        axes.axhline(1.0, color=INK, linewidth=0.8, linestyle=(0, (2, 2)))
        axes.annotate("all that arrives", (0, 1), xytext=(2, 2), textcoords="offset points", fontsize=7, color=INK)
        self._angle_axis(axes, r"viewer's angle $\theta_v$  [degrees]")
        # The axis ends at 3, because a diverging curve would flatten all others.
        axes.set_ylim(0, min(1.08 * highest, 3.0) if highest > 1.04 else 1.08)
        axes.set_ylabel("directional albedo  [1]" + ("" if self.single else ", luminance"))
        axes.set_title(NAMES["albedo"])
        if axes.get_legend_handles_labels()[1]:
            axes.legend(loc="best")

    def _fresnel_panels(self) -> list[Panel]:
        curves = {label: lobe.fresnel_curves(material) for label, material in self.materials.items()}
        if not any(curves.values()):
            return []
        return [Panel(partial(self._fresnel, curves), 3.7 if self.single else 5.2, 3.1, CURVE)]

    def _fresnel(self, curves: Mapping[str, tuple[lobe.FresnelCurve, ...]], axes: Any) -> None:
        kinds = set()
        for label, own in curves.items():
            for curve in own:
                kinds.add(curve.kind)
                self._curve(
                    axes, label, curve.angles, curve.reflectance, "-" if curve.kind == "exact" else STROKES[2], curve.kind
                )
        self._angle_axis(axes, r"angle between light and facet $\theta_d$  [degrees]")
        axes.set_ylim(0, 1.04)
        axes.set_ylabel("reflectance  [1]" + ("" if self.single else ", luminance"))
        axes.set_title(NAMES["fresnel"])
        strokes = {"exact": "-", "schlick": STROKES[2]}
        words = {"exact": "exact", "schlick": "Schlick"}
        handles = [Line2D([], [], color=INK, linestyle=strokes[kind], label=words[kind]) for kind in sorted(kinds)]
        axes.legend(handles=handles, loc="best")

    def _curve(self, axes: Any, label: str, angles: Array, values: Array, stroke: Any, kind: str = "") -> None:
        """Draws a curve over angles in degrees.

        If the sheet shows a single material and it is coloured, the curve is one line for each channel. Otherwise it is one
        line that shows the luminance.

        angles: (N,) [rad].
        values: (N, 3).
        stroke: the dash pattern.
        kind: the formula of a Fresnel curve; such curves have no legend of channels.
        """
        degrees = np.degrees(angles)
        if self.single and np.ptp(values, axis=1).max() > 1e-4:
            for index, (name, colour) in enumerate(CHANNELS):
                line = STROKES[(0, 1, 3)[index]] if not kind else stroke
                axes.plot(
                    degrees,
                    values[:, index],
                    color=matplotlib_colour(np.array(colour)),
                    linestyle=line,
                    label=None if kind else name,
                )
        else:
            axes.plot(degrees, values @ lobe.LUMINANCE, color=self.colour(label), linestyle=stroke)

    def _angle_axis(self, axes: Any, label: str) -> None:
        axes.set_xlim(0, 90)
        axes.set_xticks(range(0, 91, 15))
        axes.set_xlabel(label)


def _half_disc(axes: Any, ticks: Sequence[tuple[float, str]]) -> None:
    """Draws the grid of a half disc of radius 1. ticks: (radius, label) of each circle."""
    _bare(axes)
    axes.set_aspect("equal")
    axes.set_xlim(-1.14, 1.14)
    axes.set_ylim(-0.1, 1.12)
    arc = np.linspace(-np.pi / 2, np.pi / 2, 181)
    for radius, text in ticks:
        axes.plot(radius * np.sin(arc), radius * np.cos(arc), color=FAINT, linewidth=0.6, zorder=0.5)
        for side in (-1, 1):
            axes.annotate(
                text, (side * radius, 0), xytext=(0, -3), textcoords="offset points", ha="center", va="top", fontsize=7.5
            )
    for angle in np.radians(np.arange(-90, 91, 30)):
        x, y = math.sin(angle), math.cos(angle)
        axes.plot([0, x], [0, y], color=FAINT, linewidth=0.6, zorder=0.5)
        axes.annotate(
            _degrees(abs(angle)),
            (1.03 * x, 1.03 * y),
            ha=("right", "center", "left")[round(np.sign(round(x, 6))) + 1],
            va="bottom" if y > 0.1 else "center",
            fontsize=8,
        )
    axes.plot(np.sin(arc), np.cos(arc), color="#8a9099", linewidth=0.8, zorder=0.6)
    axes.plot([-1, 1], [0, 0], color="#8a9099", linewidth=0.8, zorder=0.6)


def _bare(axes: Any) -> None:
    """Hides the ticks, grid and frame of the axes; titles and labels stay."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _no_fresnel(axes: Any) -> None:
    """Draws a note in place of a panel without curves."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, "no Fresnel term among the parameters", ha="center", va="center", transform=axes.transAxes)


def _wrapped(panels: list[Panel]) -> list[list[Panel]]:
    """Returns the panels in rows of about the same length, each of ACROSS panels at most."""
    count = math.ceil(len(panels) / ACROSS)
    across = math.ceil(len(panels) / count) if count else 1
    return [panels[start : start + across] for start in range(0, len(panels), across)]


def _escaped(label: str) -> str:
    """Returns a label that matplotlib does not take for a formula between dollar signs."""
    return label.replace("$", r"\$")


def _degrees(angle: float) -> str:
    """Returns an angle [rad] as text in degrees."""
    return f"{round(float(np.degrees(angle)), 2):g}°"


def _linear(colour: str) -> Array:
    """Returns a colour of matplotlib as linear Rec. 709 (3,)."""
    from matplotlib.colors import to_rgb

    from glshade.image.srgb import srgb_to_linear

    return srgb_to_linear(np.array(to_rgb(colour))).astype(np.float64)
