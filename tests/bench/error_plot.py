"""A picture of error over time, ours and the rivals'."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

OURS, RIVAL = "#d9480f", "#364fc7"
MARKS = {"draft": "v", "medium": "o", "high": "^"}


def error_plot(points, path):
    """Write a PNG of panels, one a scene: relative RMSE over seconds, both axes logarithmic.

    They are those of one number of receivers: 200,000 if it was measured.
    """
    numbers = {point.case.n_asked for point in points}
    n = 200_000 if 200_000 in numbers else max(numbers)
    points = [point for point in points if point.case.n_asked == n]
    names = list(dict.fromkeys(point.case.name for point in points))
    n_columns = min(3, len(names))
    n_rows = -(-len(names) // n_columns)
    size = (max(3.6 * n_columns, 6), 2.9 * n_rows + 0.5)
    figure, panels = plt.subplots(n_rows, n_columns, figsize=size, squeeze=False, layout="constrained")
    for panel in panels.flat[len(names) :]:
        panel.axis("off")
    for panel, name in zip(panels.flat, names, strict=False):
        _panel(panel, name, [point for point in points if point.case.name == name])
    handles = {label: handle for p in panels.flat for handle, label in zip(*p.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles), frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _panel(panel, name, points):
    rival = points[0].rival
    panel.loglog(
        rival.seconds(rival.samples), rival.errors, "s-", color=RIVAL, ms=4, label="Cycles, 16 to 4096 samples"
    )
    for point in points:
        mark = MARKS[point.quality]
        panel.loglog(point.seconds, point.rmse, mark, color=OURS, ms=8, label=f"Photon Bake, {point.quality}")
        seconds, _ = rival.to_reach(point.rmse)
        panel.plot([point.seconds, seconds], [point.rmse] * 2, ":", color="0.5", lw=1, zorder=0)
        middle = np.sqrt(point.seconds * seconds)
        text = (
            f"{seconds / point.seconds:.0f}×" if seconds >= 9.5 * point.seconds else f"{seconds / point.seconds:.1f}×"
        )
        panel.annotate(
            text, (middle, point.rmse), (0, 2), textcoords="offset points", ha="center", fontsize=8, color="0.3"
        )
    panel.set_title(name, fontsize=10)
    panel.set_xlabel("seconds", fontsize=9)
    panel.set_ylabel("relative RMSE", fontsize=9)
    panel.yaxis.set_major_formatter(FuncFormatter(lambda error, _: f"{100 * error:g}%"))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:,g}"))
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="major", color="0.9")
    panel.tick_params(labelsize=8)
