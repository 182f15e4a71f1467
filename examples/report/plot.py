#!/usr/bin/env python3
"""Draws error over time from a report.json of nook-report, for papers: SVG, PDF or PNG.

    plot.py report.json --cell bowl --cell boxes --out error-over-time.svg --out error-over-time.png

Each mark is a kernel with one setting; marks of a kernel are joined. Both axes are logarithmic. The
staircase is the Pareto front: nothing in the plot is both faster and closer to the reference than
its marks, which carry names. Below the standard error of the reference no difference means
anything. Needs matplotlib 3.6; the same report gives the same bytes.
"""

import argparse
import errno
import io
import json
import math
import os
import sys

FAMILIES = {
    "depth": "Depth alone",
    "surface": "Depth and normals",
    "outline": "Outlines",
    "traced": "Rays",
    "information": "Viewpoint channel",
}
# As on the page: colour and shape by method; inner mark and dashes by variant of it. The colours of
# Okabe & Ito 2008, some darker for thin lines on white: told apart with any colour vision.
METHODS = {
    "chebyshev": ("#d55e00", "o"),
    "alchemy": ("#0072b2", "s"),
    "scalable": ("#3da0dc", "^"),
    "horizon": ("#009e73", "D"),
    "bitmask": ("#b85c92", "v"),
    "outline": ("#a89700", "h"),
    "traced": ("#1d2126", "*"),
    "information": ("#d08a00", "P"),
}
OTHERS = ("#5c636b", "o")
SIZES = {"o": 5.0, "s": 4.8, "^": 5.4, "D": 4.4, "v": 5.4, "h": 5.4, "*": 7.0, "P": 5.6}
INNER = [None, (".", 0.55), ("_", 0.6), ("|", 0.6), ("+", 0.6)]
DASHES = ["-", (0, (5, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2))]
INK, SOFT, SHADE = "#1d2126", "#5c636b", "#e4e4de"
RING = {
    "marker": "o",
    "markersize": 9.5,
    "markerfacecolor": "none",
    "markeredgecolor": INK,
    "markeredgewidth": 0.9,
}
ROW, HEADING_GAP = 0.155, 0.07  # of the legend, inches

# name: label of the axis, the number that is drawn, whether it is of the reference's own scale
MEASURES = {
    "rmse": ("RMSE", lambda error: error["rmse"], True),
    "mae": ("mean absolute error", lambda error: error["mae"], False),
    "p99": ("99th percentile of the error", lambda error: error["p99"], False),
    "max": ("largest error", lambda error: error["max"], False),
    "fitted_rmse": ("RMSE after the best monotone fit", lambda error: error["fitted_rmse"], True),
    "rank": ("1 − rank correlation", lambda error: 1 - error["rank_correlation"], False),
    "ssim": ("1 − SSIM", lambda error: 1 - error["ssim"], False),
}
ENDINGS = (".svg", ".pdf", ".png")
FORMAT = 3  # of report.json


class Failure(Exception):
    """A run that cannot go on; one line."""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {' '.join(message.split())}\n")


# --- the report -----------------------------------------------------------------------------------


class Node:
    """A value of the report that knows where it stands, so that a wrong one can be named."""

    def __init__(self, value, path):
        self.value, self.path = value, path

    def fail(self, what):
        raise Failure(f"{self.path} {what}")

    def __getitem__(self, key):
        if not isinstance(self.value, dict):
            self.fail("is not an object")
        if key not in self.value:
            self.fail(f'has no "{key}"')
        return Node(self.value[key], f"{self.path}.{key}")

    def items(self):
        if not isinstance(self.value, list):
            self.fail("is not a list")
        return [Node(value, f"{self.path}[{i}]") for i, value in enumerate(self.value)]

    def text(self):
        if not isinstance(self.value, str) or not self.value.isprintable():
            self.fail("is not printable text")
        return self.value

    def flag(self):
        if not isinstance(self.value, bool):
            self.fail("is not true or false")
        return self.value

    def number(self):
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail("is not a number")
        if not abs(value) <= sys.float_info.max:  # also false for NaN, and right for any integer
            self.fail("is not finite")
        return float(value)

    def number_or_none(self):
        return None if self.value is None else self.number()


class Point:
    def __init__(self, result, comparable, time, error):
        self.id = result["id"].text()
        self.kernel = result["kernel"].text()
        self.comparable = comparable
        self.time, self.error = time, error
        self.candidate = not result["slow"].flag()  # a reference form is on no front
        self.front = False


class Panel:
    """What is drawn of one cell."""

    def __init__(self, cell, kernels, options):
        radius = cell["radius"].number_or_none()
        radius_text = "unlimited radius" if radius is None else f"radius {radius:.3g}"
        size = f"{cell['width'].number():.0f} × {cell['height'].number():.0f}"
        self.id, self.title = cell["id"].text(), cell["scene"].text()
        self.subtitle = f"{radius_text}, {size} pixels"
        self.floor = None
        for reference in cell["references"].items():
            if reference["meaning"].text() == options.meaning:
                self.floor = reference["standard_error"].number()
        if self.floor is None:
            meanings = [item["meaning"].text() for item in cell["references"].items()]
            cell.fail(f"has no reference of {options.meaning}; there are: {', '.join(meanings)}")
        _, measure, own_scale = MEASURES[options.measure]
        if not own_scale:
            self.floor = None

        self.points, counts = [], set()
        for result in cell["results"].items():
            times = {}
            for timing in result["timings"].items():
                times[int(timing["threads"].number())] = timing["median"]
            counts.update(times)
            if result["meaning"].text() != options.meaning or options.threads not in times:
                continue
            if result["row_step"].number() != 1:
                continue  # its time is that of a part of the picture
            if result["kernel"].text() not in kernels:
                result["kernel"].fail(f'names no kernel of the report: "{result["kernel"].text()}"')
            time = times[options.threads].number()
            if time <= 0:
                times[options.threads].fail("is not above 0")
            error = result["error"]
            names = ("rmse", "mae", "p99", "max", "fitted_rmse", "rank_correlation", "ssim")
            value = measure({name: error[name].number() for name in names})
            if value < -1e-12:
                error.fail(f"makes the {MEASURES[options.measure][0]} {value:g}, which is below 0")
            comparable = kernels[result["kernel"].text()]["comparable"]
            # What is left of 1 − 1 after rounding is no error.
            self.points.append(Point(result, comparable, time, value if value > 1e-12 else 0.0))
        if not self.points:
            there = ", ".join(map(str, sorted(counts))) or "none"
            cell.fail(
                f"has no result of {options.meaning} with {options.threads} threads; "
                f"numbers of threads there are: {there}"
            )
        self.mark_front()

    def mark_front(self):
        """No other is as fast and as close, and better in one of the two."""
        best = math.inf
        candidates = sorted(
            (point for point in self.points if point.candidate),
            key=lambda point: (point.time, point.error),
        )
        for i, point in enumerate(candidates):
            equal = i > 0 and (point.time, point.error) == (
                candidates[i - 1].time,
                candidates[i - 1].error,
            )
            point.front = candidates[i - 1].front if equal else point.error < best
            best = min(best, point.error)

    def front(self):
        chosen = [point for point in self.points if point.front]
        return sorted(chosen, key=lambda point: (point.time, point.error, point.id))


def read_report(name):
    try:
        with open(name, encoding="utf-8") as file:
            report = Node(json.load(file), os.path.basename(name))
    except OSError as error:
        raise Failure(f"cannot read {name}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise Failure(f"{name} is not JSON: {error}") from None
    if report["format"].value != FORMAT:
        there = json.dumps(report["format"].value)
        report["format"].fail(f"is {there[:40]}; this reads format {FORMAT}")
    return report


def chosen_panels(report, options):
    kernels = {}
    for kernel in report["kernels"].items():
        family = kernel["family"].text()
        if family not in FAMILIES:
            kernel["family"].fail(f'is "{family}"; known: {", ".join(FAMILIES)}')
        kernels[kernel["name"].text()] = {
            "family": family,
            "comparable": kernel["comparable"].flag(),
        }
    seen = {}
    for name, kernel in kernels.items():
        method = "outline" if kernel["family"] == "outline" else name.split("-")[0]
        variant = seen[method] = seen.get(method, -1) + 1
        kernel["colour"], kernel["marker"] = METHODS.get(method, OTHERS)
        kernel["inner"] = INNER[variant % len(INNER)]
        kernel["dashes"] = DASHES[variant % len(DASHES)]
    cells = {cell["id"].text(): cell for cell in report["cells"].items()}
    panels = []
    for name in options.cell:
        if name not in cells:
            there = ", ".join(cells) or "none"
            raise Failure(f'{report.path} has no cell "{name}"; there are: {there}')
        panels.append(Panel(cells[name], kernels, options))
    return kernels, panels


# --- the figure -----------------------------------------------------------------------------------


def plain(value):
    """A number of a logarithmic axis: 0.01, 1, 200, 10k."""
    if value >= 1e4:
        return f"{value / 1000:g}k"
    return f"{value:.10f}".rstrip("0").rstrip(".")


def limits(values, least_decades):
    """The range of some positive numbers with room around it."""
    low, high = math.log10(min(values)), math.log10(max(values))
    room = max((least_decades - (high - low)) / 2, 0.06 * (high - low), 0.08)
    return 10 ** max(low - room, -300), 10 ** min(high + room, 300)


def set_scale(axis, low, high, bare=0.0):
    """Labels numbers above the share `bare` of the axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    decades = math.log10(high / low)
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2.5 else (1,), numticks=30))
    axis.set_minor_locator(LogLocator(subs=range(1, 10), numticks=30))
    first = low * (high / low) ** bare
    axis.set_major_formatter(FuncFormatter(lambda x, _: plain(x) if x >= first else ""))
    axis.set_minor_formatter(NullFormatter())


class Labels:
    """Names beside points, each where it covers least. Everything in pixels of the figure."""

    GAPS = (7, 12, 19, 28, 40, 55, 72, 90)  # points, from the mark to the nearest edge of its name

    def __init__(self, figure, axes, size):
        self.axes, self.size = axes, size
        self.renderer = figure.canvas.get_renderer()
        self.scale = figure.dpi / 72
        self.inside = axes.get_window_extent(self.renderer)
        self.taken = []  # boxes: x0, y0, x1, y1
        self.points = []
        self.lines = []  # points along the curves

    def avoid_point(self, x, y):
        self.points.append(tuple(self.axes.transData.transform((x, y))))

    def avoid_line(self, xs, ys, weight):
        pixels = [tuple(self.axes.transData.transform(point)) for point in zip(xs, ys)]
        for (x0, y0), (x1, y1) in zip(pixels, pixels[1:]):
            steps = max(int(math.hypot(x1 - x0, y1 - y0) / (3 * self.scale)), 1)
            for i in range(steps + 1):
                share = i / steps
                self.lines.append((x0 + (x1 - x0) * share, y0 + (y1 - y0) * share, weight))

    def cost(self, box, gap, direction):
        x0, y0, x1, y1 = box
        pad = 2 * self.scale
        inside = self.inside
        cost = 0.6 * gap + direction
        outside = (
            max(inside.x0 + pad - x0, 0)
            + max(x1 - inside.x1 + pad, 0)
            + max(inside.y0 + pad - y0, 0)
            + max(y1 - inside.y1 + pad, 0)
        )
        cost += 1000 * outside
        for a0, b0, a1, b1 in self.taken:
            wide = min(x1, a1) - max(x0, a0) + pad
            high = min(y1, b1) - max(y0, b0) + pad
            if wide > 0 and high > 0:
                cost += 500 + wide * high
        reach = 4.5 * self.scale
        for x, y in self.points:
            if x0 - reach < x < x1 + reach and y0 - reach < y < y1 + reach:
                cost += 80
        for x, y, weight in self.lines:
            if x0 - pad < x < x1 + pad and y0 - pad / 2 < y < y1 + pad / 2:
                cost += weight
        return cost

    def place(self, x, y, text, colour, group):
        from matplotlib.patheffects import withStroke

        probe = self.axes.text(0, 0, text, fontsize=self.size, transform=None)
        extent = probe.get_window_extent(self.renderer)
        probe.remove()
        wide, high = extent.width, extent.height
        at_x, at_y = self.axes.transData.transform((x, y))
        best = None
        # Below left first: there is nothing on that side of a front.
        for gap in self.GAPS:
            for turn, direction in enumerate((225, 180, 270, 202, 248, 45, 0, 90, 315, 135)):
                angle = math.radians(direction)
                dx, dy = math.cos(angle), math.sin(angle)
                centre_x = at_x + dx * (gap * self.scale + wide / 2 * abs(dx))
                centre_y = at_y + dy * (gap * self.scale + high / 2 * abs(dy))
                # Beside the point, not through it.
                if abs(dx) > 0.5:
                    centre_x = at_x + math.copysign(abs(dx) * gap * self.scale + wide / 2, dx)
                box = (
                    centre_x - wide / 2,
                    centre_y - high / 2,
                    centre_x + wide / 2,
                    centre_y + high / 2,
                )
                cost = self.cost(box, gap, 0.8 * turn)
                if best is None or cost < best[0]:
                    best = (cost, box, gap)
        _, box, gap = best
        self.taken.append(box)
        inverse = self.axes.transData.inverted()
        if gap > self.GAPS[1]:
            edge_x = min(max(at_x, box[0]), box[2])
            edge_y = min(max(at_y, box[1]), box[3])
            end = inverse.transform((edge_x, edge_y))
            line = [x, end[0]], [y, end[1]]
            self.axes.plot(*line, color="#9aa0a6", linewidth=0.5, zorder=2.5, clip_on=False)
            self.avoid_line(*line, 8.0)
        centre = inverse.transform(((box[0] + box[2]) / 2, (box[1] + box[3]) / 2))
        name = self.axes.text(
            *centre, text, fontsize=self.size, color=colour, ha="center", va="center_baseline",
            zorder=6,
        )
        name.set_gid(group)
        # Readable across a line, where there is no other room.
        name.set_path_effects([withStroke(linewidth=1.6, foreground="white", alpha=0.85)])


def mark_styles(kernel, scale=1.0):
    """What to pass to plot for the marks of a kernel: the mark, and the one inside it."""
    colour, size = kernel["colour"], SIZES[kernel["marker"]] * scale
    inside = "white" if kernel["comparable"] else colour
    styles = [
        {
            "marker": kernel["marker"],
            "markersize": size,
            "markerfacecolor": colour if kernel["comparable"] else "white",
            "markeredgecolor": colour,
            "markeredgewidth": 0.9,
        }
    ]
    if kernel["inner"]:
        shape, share = kernel["inner"]
        styles.append(
            {
                "marker": shape,
                "markersize": size * share,
                "markerfacecolor": inside,
                "markeredgecolor": inside,
                "markeredgewidth": 0.8,
            }
        )
    return styles


def draw_panel(figure, axes, panel, kernels, bottom, name_size):
    """The marks of a cell. `bottom` is where an error of 0 is drawn; a size of 0 names nothing."""
    height = {point.id: point.error or bottom for point in panel.points}
    drawn = []
    for name, kernel in kernels.items():
        # Joined in the order of the settings, which is that of the report.
        points = [point for point in panel.points if point.kernel == name]
        if not points:
            continue
        xs, ys = [point.time for point in points], [height[point.id] for point in points]
        axes.plot(
            xs, ys, color=kernel["colour"], linestyle=kernel["dashes"], linewidth=0.8, alpha=0.55,
            zorder=2, clip_on=False,
        )
        for style in mark_styles(kernel):
            axes.plot(xs, ys, linestyle="none", zorder=4, clip_on=False, **style)
        drawn.append((xs, ys))
    front = panel.front()
    xs, ys = [point.time for point in front], [height[point.id] for point in front]
    axes.plot(
        xs, ys, drawstyle="steps-post", color=INK, linewidth=1.1, alpha=0.75, zorder=1.9
    )
    axes.plot(xs, ys, linestyle="none", zorder=5, clip_on=False, **RING)
    if not name_size:
        return
    labels = Labels(figure, axes, name_size)
    for point in panel.points:
        labels.avoid_point(point.time, height[point.id])
    for line in drawn:
        labels.avoid_line(*line, 1.0)
    steps_x = [x for x in xs for _ in range(2)][1:]
    steps_y = [y for y in ys for _ in range(2)][:-1]
    labels.avoid_line(steps_x, steps_y, 2.0)
    # From the ends inwards: there is more room.
    for point in sorted(front, key=lambda point: abs(front.index(point) - (len(front) - 1) / 2)):
        colour = kernels[point.kernel]["colour"]
        # Named in the SVG too, for whoever moves it by hand.
        labels.place(point.time, height[point.id], point.id, colour, f"{panel.id}.{point.id}")


def legend_rows(kernels, panels):
    """Headings, as text alone, and pairs of what is drawn (styles of lines) and its name."""
    shown = {point.kernel for panel in panels for point in panel.points}
    rows = []
    for family, title in FAMILIES.items():
        members = [name for name in kernels if name in shown and kernels[name]["family"] == family]
        if members:
            rows.append(title)
        for name in members:
            kernel = kernels[name]
            line = {"color": kernel["colour"], "linestyle": kernel["dashes"], "linewidth": 0.8}
            rows.append(([line], mark_styles(kernel), name))
    rows.append("Marks")
    steps = {"color": INK, "linewidth": 1.1, "alpha": 0.75}
    rows.append(([steps], [RING], "Pareto front"))
    if any(not kernels[name]["comparable"] for name in shown):
        hollow = {"marker": "o", "markersize": 5, "markerfacecolor": "white",
                  "markeredgecolor": SOFT, "markeredgewidth": 0.9}
        rows.append(([], [hollow], "estimates something else"))
    if any(panel.floor for panel in panels):
        band = {"color": SHADE, "linewidth": 7, "solid_capstyle": "butt"}
        rows.append(([band], [], "reference's standard error"))
    return rows


def draw_legend(figure, rows, left, top):
    """From that corner downwards; in inches."""
    from matplotlib.lines import Line2D

    width, height = figure.get_size_inches()
    y = top
    for row in rows:
        if isinstance(row, str):
            y -= HEADING_GAP if y < top else 0
            figure.text(left / width, y / height, row, fontsize=7, fontweight="bold", va="center")
        else:
            lines, marks, name = row
            for xs, styles in (((0, 0.14, 0.28), lines), ((0.14,), marks)):
                for style in styles:
                    figure.add_artist(
                        Line2D([(left + x) / width for x in xs], [y / height] * len(xs), **style)
                    )
            figure.text((left + 0.36) / width, y / height, name, fontsize=7, va="center")
        y -= ROW


def draw(kernels, panels, options):
    import warnings

    import matplotlib

    warnings.simplefilter("ignore")  # of letters that the font lacks
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    # Nobody's own settings: a report looks the same everywhere.
    matplotlib.rcdefaults()
    plt.rcParams.update(
        {
            "font.family": "DejaVu Sans",
            "font.size": 8,
            "text.parse_math": False,  # a $ in a name is a $
            "svg.hashsalt": "nook",
            "svg.fonttype": "path",
            "pdf.fonttype": 42,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.edgecolor": SOFT,
            "axes.linewidth": 0.7,
            "xtick.color": "#3a4046",
            "ytick.color": "#3a4046",
            "text.color": INK,
            "axes.labelcolor": INK,
        }
    )
    columns = 2 if len(panels) in (2, 4) else min(len(panels), 3)
    rows = -(-len(panels) // columns)
    # Inches. Every plot of a row after the first shares its labels.
    wide, high, name_size = {1: (4.5, 3.3, 7), 2: (3.5, 2.9, 6), 3: (3.2, 2.8, 5.5)}[columns]
    left, bottom, top, across, down = 0.74, 0.48, 0.42, 0.25, 0.55
    legend = legend_rows(kernels, panels)
    legend_width = 1.88
    legend_height = ROW * len(legend) + HEADING_GAP * sum(isinstance(row, str) for row in legend)
    high = max(high, (legend_height - down * (rows - 1)) / rows)
    width = left + columns * wide + (columns - 1) * across + 0.2 + legend_width
    height = bottom + rows * high + (rows - 1) * down + top
    figure, grid = plt.subplots(
        rows, columns, figsize=(width, height), squeeze=False, dpi=200,
        gridspec_kw={
            "left": left / width,
            "right": 1 - (0.2 + legend_width) / width,
            "bottom": bottom / height,
            "top": 1 - top / height,
            "wspace": across / wide,
            "hspace": down / high,
        },
    )
    flat = [axes for row in grid for axes in row]
    for axes in flat[len(panels) :]:
        axes.set_axis_off()

    # One range for all, so that cells can be compared.
    times = [point.time for panel in panels for point in panel.points]
    errors = [point.error for panel in panels for point in panel.points if point.error > 0]
    errors += [panel.floor for panel in panels if panel.floor]
    zeros = any(point.error == 0 for panel in panels for point in panel.points)
    x_low, x_high = limits(times, 1.0)
    y_low, y_high = limits(errors or [0.01, 1.0], 1.0)
    if zeros:
        y_low /= 10 ** (0.12 * math.log10(y_high / y_low))
    threads = "1 thread" if options.threads == 1 else f"{options.threads} threads"
    for i, (axes, panel) in enumerate(zip(flat, panels)):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(x_low, x_high)
        axes.set_ylim(y_low, y_high)
        set_scale(axes.xaxis, x_low, x_high)
        # Room for the 0 at the lower end.
        set_scale(axes.yaxis, y_low, y_high, 0.04 if zeros else 0.0)
        axes.grid(which="major", color="#e9e9e4", linewidth=0.6)
        axes.set_axisbelow(True)
        axes.tick_params(which="both", width=0.6)
        axes.tick_params(which="minor", length=2)
        axes.set_title(panel.title, loc="left", fontsize=9.5, fontweight="bold", pad=8)
        axes.set_title(panel.subtitle, loc="right", fontsize=7.5, color=SOFT, pad=8)
        if i + columns >= len(panels):
            axes.set_xlabel(f"time per frame with {threads} (ms)")
        if i % columns == 0:
            axes.set_ylabel(MEASURES[options.measure][0])
        if panel.floor:
            axes.axhspan(y_low, panel.floor, color=SHADE, linewidth=0, zorder=0.5)
        if i % columns:
            axes.tick_params(axis="y", labelleft=False)
        elif zeros:
            axes.annotate(
                "0", (0, 0), xycoords="axes fraction", xytext=(-5, 0), textcoords="offset points",
                ha="right", va="center", fontweight="bold",
            )
    figure.canvas.draw()
    name_size = name_size if options.names else 0
    for axes, panel in zip(flat, panels):
        draw_panel(figure, axes, panel, kernels, y_low, name_size)

    draw_legend(figure, legend, width - legend_width, height - top - 0.06)
    return figure


def encoded(figure, ending):
    """The bytes of a file, without a date."""
    metadata = {
        ".svg": {"Date": None, "Creator": None},
        ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
        ".png": {"Software": None},
    }[ending]
    buffer = io.BytesIO()
    figure.savefig(buffer, format=ending[1:], facecolor="white", metadata=metadata)
    return buffer.getvalue()


def write_all(files):
    """All of them or none; each is whole before it takes its name."""
    beside = []
    name = ""
    try:
        for name, content in files:
            if os.path.isdir(name):
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            other = f"{name}.{os.getpid()}.part"
            beside.append((other, name))
            with open(other, "xb") as file:
                file.write(content)
        for other, name in beside:
            os.replace(other, name)
    except OSError as error:
        raise Failure(f"cannot write {name}: {error.strerror}") from None
    finally:
        for other, _ in beside:
            if os.path.exists(other):
                os.remove(other)


def ending_of(name):
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        raise argparse.ArgumentTypeError(f"{name} ends in none of {', '.join(ENDINGS)}")
    return name


def thread_count(text):
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return int(text)


def main():
    parser = Parser(description="Draws error over time from the report.json of nook-report.")
    parser.add_argument("report", help="report.json")
    parser.add_argument("--cell", action="append", required=True, metavar="ID",
                        help="a scene at a radius, by its id in the report; again for more")
    parser.add_argument("--threads", type=thread_count, default=1, metavar="N",
                        help="which of the times (default: 1)")
    parser.add_argument("--measure", choices=MEASURES, default="rmse",
                        help="which of the errors (default: rmse)")
    parser.add_argument("--meaning", default="visibility", metavar="NAME",
                        help="results compared with that reference (default: visibility)")
    parser.add_argument("--no-names", dest="names", action="store_false",
                        help="no names at the marks of the front")
    parser.add_argument("--out", action="append", required=True, type=ending_of, metavar="FILE",
                        help="ends in .svg, .pdf or .png; again for more")
    options = parser.parse_args()
    try:
        kernels, panels = chosen_panels(read_report(options.report), options)
        try:
            figure = draw(kernels, panels, options)
        except ImportError as error:
            raise Failure(f"needs matplotlib: {error}") from None
        write_all(
            [(name, encoded(figure, os.path.splitext(name)[1].lower())) for name in options.out]
        )
    except Failure as failure:
        parser.error(str(failure))


if __name__ == "__main__":
    main()
