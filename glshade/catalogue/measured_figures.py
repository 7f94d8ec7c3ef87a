"""Measured figures: plots of measured reflectance beside a fit, by matplotlib, as on the lecture's slides 36 to 39."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glshade.arrays import Array, Float64
from glshade.catalogue.baking import reflectance
from glshade.catalogue.figures import check
from glshade.catalogue.fitting import Fit
from glshade.catalogue.lobe import direction
from glshade.measured.samples import Samples
from glshade.measured.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# A figure shows at most PANELS angles of incidence, and the usual ones where the samples name none.
PANELS, USUAL = 4, (15.0, 30.0, 45.0, 60.0)
# Samples are shown whose light differs by less than this from a panel's, and whose viewer is as near to the plane [rad].
NEAR = np.radians(2.0)
# Curves are drawn up to this angle from the normal [degrees].
STEEPEST = 89.0
# The colours of the three channels.
COLOURS = ("#c0392b", "#2e8b57", "#2c5fb3")


def figure(title: str, samples: Samples, table: Table | None, fit: Fit) -> Figure:
    """Returns a figure with a panel for each angle of incidence: f over the viewer's angle in the plane of incidence.

    title: the name of the data.
    samples: the samples, which are drawn as points.
    table: the table that is drawn of them, as lines; None where there is none, because the surface has a grain.
    fit: a fitted material, as dashed lines.
    Errors: MissingLibrary where matplotlib is missing.
    """
    check()
    import matplotlib.style
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from glshade.catalogue.sheet import STYLE

    with matplotlib.style.context(["default", STYLE]):
        incidences = panel_angles(samples)
        result = Figure(figsize=(3.1 * len(incidences) + 0.4, 3.6), facecolor="white", layout="constrained")
        panels = result.subplots(1, len(incidences), sharey=True, squeeze=False)[0]
        for axes, incidence in zip(panels, incidences, strict=True):
            _panel(axes, incidence, samples, table, fit)
        panels[0].set_ylabel("f [1/sr]")
        handles = [
            Line2D([], [], color="#444444", linestyle="none", marker="o", markersize=3, label="measured"),
            *([Line2D([], [], color="#444444", label="table")] if table else []),
            Line2D([], [], color="#444444", linestyle="--", label=f"{fit.material.brdf}, fitted"),
        ]
        result.legend(handles=handles, loc="outside upper right", ncols=len(handles))
        result.suptitle(title.replace("$", r"\$"), x=0.01, ha="left", fontsize=11)
    return result


def panel_angles(samples: Samples) -> list[float]:
    """Returns the angles of incidence of the panels [degrees]: those from which most of the samples are lit."""
    if "phi_d" not in samples.axes:
        return list(USUAL)
    theta = np.degrees(np.arccos(np.clip(samples.l[:, 2], -1, 1)))
    angles, counts = np.unique(np.round(theta), return_counts=True)
    common = angles[counts >= 0.5 * counts.max()] if len(angles) <= 30 else np.array(USUAL)
    chosen = common[np.unique(np.linspace(0, len(common) - 1, PANELS).round().astype(int))]
    return [float(angle) for angle in chosen]


def _panel(axes: Axes, incidence: float, samples: Samples, table: Table | None, fit: Fit) -> None:
    theta_v = np.linspace(-STEEPEST, STEEPEST, 357)
    # The light comes from the left, so that its mirror direction is on the right.
    l, v = direction(np.radians(-incidence)), direction(np.radians(theta_v))
    l = np.broadcast_to(l, v.shape)
    at, seen = _in_plane(samples, np.radians(incidence))
    fitted, tabled = reflectance(fit.material, l, v), table.at(l, v) if table else None
    for channel, colour in enumerate(COLOURS):
        axes.plot(theta_v, fitted[:, channel], color=colour, linestyle="--", linewidth=1.1)
        if tabled is not None:
            axes.plot(theta_v, tabled[:, channel], color=colour, linewidth=1.2)
        if "phi_d" in samples.axes:
            axes.plot(np.degrees(at), seen[:, channel], color=colour, linestyle="none", marker="o", markersize=2.5)
    axes.axvline(-incidence, color="#999999", linewidth=0.8)
    axes.set_yscale("log")
    axes.set_ylim(*_range(samples, fitted, tabled))
    axes.set_xlim(-90, 90)
    axes.set_xticks([-90, -45, 0, 45, 90])
    axes.set_xlabel("viewer's angle [degrees]")
    axes.set_title(f"light from {incidence:g} degrees")


def _in_plane(samples: Samples, incidence: float) -> tuple[Float64, Float64]:
    """Returns the viewer's signed angles (M,) [rad] and f (M, 3) of the samples near the plane of incidence."""
    theta_l, theta_v = (np.arccos(np.clip(d[:, 2], -1, 1)) for d in (samples.l, samples.v))
    # The viewer's height above the plane of n and l, as the sine of an angle.
    across = np.cross(samples.l, samples.v)[:, 2] / np.maximum(np.sin(theta_l), 1e-9)
    near = (np.abs(theta_l - incidence) < NEAR) & (np.abs(across) < np.sin(NEAR))
    side = -np.sign(np.sum(samples.l[near, :2] * samples.v[near, :2], axis=1))
    return np.where(side == 0, 1.0, side) * theta_v[near], samples.f[near]


def _range(samples: Samples, *curves: Array | None) -> tuple[float, float]:
    """Returns the ends of the axis of f: those of nearly all of the samples and curves."""
    every = np.concatenate([samples.f.ravel(), *(curve.ravel() for curve in curves if curve is not None)])
    every = every[every > 1e-6]
    low, high = np.quantile(every, [0.02, 1.0]) if len(every) else (0.1, 1.0)
    return float(low) / 2, float(high) * 2
