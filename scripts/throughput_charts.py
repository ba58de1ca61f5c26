"""Draws the charts of scripts/compare_throughput's page, each as one SVG that stands in the page by itself."""

import html
import io
import math
import re

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as pyplot  # noqa: E402
import matplotlib.ticker as ticker  # noqa: E402
import numpy  # noqa: E402

CASTOR, EMBREE = "#1f6fb2", "#e08a1e"
KINDS = ["#2a7f8e", "#8b6bb1", "#c05a6b", "#5a9e4b"]
EARLIER = ["#8fb3d3", "#b9c4cf", "#a99fc9", "#cfc3a5"]
WIDTH = 10.5  # inches

matplotlib.rcParams.update(
    {
        "svg.fonttype": "none",
        "svg.hashsalt": "castor",
        "font.family": "sans-serif",
        "font.size": 10,
        "text.color": "#333",
        "axes.labelcolor": "#555",
        "xtick.color": "#555",
        "ytick.color": "#555",
        "axes.edgecolor": "#bbb",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "axes.titlesize": 11,
        "axes.titleweight": "bold",
        "grid.color": "#e6e6e6",
        "legend.frameon": False,
    }
)
chart_count = 0


def svg(figure, caption):
    """The figure's SVG, with names of its own, and what it shows."""
    global chart_count
    chart_count += 1
    text = io.StringIO()
    figure.savefig(text, format="svg", bbox_inches="tight", pad_inches=0.15, metadata={"Date": None})
    pyplot.close(figure)
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.S)
    own = f"c{chart_count}-"
    drawing = re.sub(r'\bid="', f'id="{own}', drawing)
    drawing = re.sub(r"url\(#", f"url(#{own}", drawing)
    drawing = re.sub(r'href="#', f'href="#{own}', drawing)
    drawing = drawing.replace("<svg", f'<svg role="img" aria-label="{html.escape(caption)}"', 1)
    return f"<figure>{drawing}<figcaption>{html.escape(caption)}</figcaption></figure>"


def bars(axes, groups, series, errors=None):
    """Grouped bars. `series`: name -> (colour, one value a group, None for none); `errors`: name -> (below, above)
    for each group."""
    width = 0.8 / len(series)
    at = numpy.arange(len(groups))
    for k, (name, (color, values)) in enumerate(series.items()):
        drawn = axes.bar(
            at + (k - (len(series) - 1) / 2) * width,
            [value or 0.0 for value in values],
            0.92 * width,
            label=name,
            color=color,
        )
        if errors:
            axes.errorbar(
                [bar.get_x() + bar.get_width() / 2 for bar in drawn],
                [value or 0.0 for value in values],
                yerr=errors[name],
                fmt="none",
                ecolor="#333",
                elinewidth=1,
                capsize=2,
            )
    axes.set_xticks(at, groups)
    axes.tick_params(axis="x", length=0)
    if sum(len(group) + 3 for group in groups) * 0.085 > axes.get_position().width * axes.figure.get_figwidth():
        pyplot.setp(axes.get_xticklabels(), rotation=25, ha="right", rotation_mode="anchor")
    axes.grid(axis="y")


def legend_above(figure, axes):
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, ncols=min(len(labels), 5), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.08)


def ratios_chart(scenes, kinds, ratios):
    """`ratios`: (scene, kind) -> (ratio, least, largest)."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 3.2), layout="constrained")
    series, errors = {}, {}
    for kind, color in zip(kinds, KINDS):
        of = [ratios.get((scene, kind)) for scene in scenes]
        series[kind] = (color, [r and r[0] for r in of])
        errors[kind] = [[r[0] - r[1] if r else 0.0 for r in of], [r[2] - r[0] if r else 0.0 for r in of]]
    bars(axes, scenes, series, errors)
    axes.axhline(1.0, color="#333", linewidth=1)
    axes.set_ylabel("Castor / Embree")
    legend_above(figure, axes)
    return svg(
        figure,
        "Castor's rate over the best of Embree's; above 1 Castor is faster. Bars are medians of the rounds, lines span"
        " the single rounds.",
    )


def rates_chart(scenes, kinds, series):
    """`series`: name -> (scene, kind) -> Mray/s. Castor first, Embree second, then earlier files."""
    columns = min(2, len(kinds))
    rows = -(-len(kinds) // columns)
    figure, grid = pyplot.subplots(rows, columns, figsize=(WIDTH, 2.7 * rows), layout="constrained", squeeze=False)
    colors = [CASTOR, EMBREE] + EARLIER
    for axes, kind in zip(grid.flat, kinds):
        bars(
            axes,
            scenes,
            {
                name: (colors[k % len(colors)], [of.get((scene, kind)) for scene in scenes])
                for k, (name, of) in enumerate(series.items())
            },
        )
        axes.set_title(f"{kind} rays", loc="left")
        axes.set_ylabel("Mray/s")
    for axes in list(grid.flat)[len(kinds) :]:
        axes.set_visible(False)
    legend_above(figure, grid[0][0])
    return svg(
        figure, "Millions of rays a second: medians of all runs. Embree: the best of its calls of 1, 8 and 16 rays."
    )


def roofline_chart(points, roofs):
    """`points`: (kind of rays, flops a byte, Gflop/s)."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 3.6), layout="constrained")
    bandwidth, arithmetic = roofs["bytes_per_second"] * 1e-9, roofs["flops_per_second"] * 1e-9
    ridge = arithmetic / bandwidth
    left, right = min([ridge] + [p[1] for p in points]) / 4, max([ridge] + [p[1] for p in points]) * 4
    axes.plot([left, ridge, right], [left * bandwidth, arithmetic, arithmetic], color="#333", linewidth=1.5)
    middle = math.sqrt(left * ridge)
    axes.annotate(
        f"{bandwidth:.1f} GB/s",
        (middle, middle * bandwidth),
        xytext=(-8, 5),
        textcoords="offset points",
        ha="right",
        fontsize=9,
    )
    axes.annotate(
        f"{arithmetic:.0f} Gflop/s",
        (right, arithmetic),
        xytext=(-4, 5),
        textcoords="offset points",
        ha="right",
        fontsize=9,
    )
    for kind, color in zip(dict.fromkeys(p[0] for p in points), KINDS):
        of = [p for p in points if p[0] == kind]
        axes.scatter([p[1] for p in of], [p[2] for p in of], s=34, color=color, label=kind, zorder=3)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(top=arithmetic * 2.2)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(ticker.NullFormatter())
    axes.set_xlabel("operations a byte")
    axes.set_ylabel("Gflop/s")
    axes.grid(which="major")
    legend_above(figure, axes)
    return svg(
        figure,
        "The device's roofs, and the counted work of each pair of scene and rays below them. Points above the slope"
        " read from caches.",
    )


def kernels_chart(names, rates):
    figure, axes = pyplot.subplots(figsize=(WIDTH, 0.6 + 0.33 * len(names)), layout="constrained")
    drawn = axes.barh(names, rates, 0.7, color=CASTOR)
    axes.bar_label(drawn, [f"{rate:,.1f}" for rate in rates], padding=4, fontsize=9, color="#555")
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(right=max(rates) * 1.1)
    axes.set_xlabel("millions a second")
    axes.grid(axis="x")
    return svg(figure, "Single functions by themselves: medians.")


def curve_chart(curve):
    """A curve has a title, the axis' label, whether it is logarithmic, and lines: rays, program, x,
    mrays_per_second."""
    kinds = list(dict.fromkeys(line["rays"] for line in curve["lines"]))
    figure, grid = pyplot.subplots(1, len(kinds), figsize=(WIDTH, 3.0), layout="constrained", squeeze=False)
    for axes, kind in zip(grid.flat, kinds):
        of_kind = [line for line in curve["lines"] if line["rays"] == kind]
        for line in of_kind:
            axes.plot(
                line["x"],
                line["mrays_per_second"],
                marker="o",
                markersize=4,
                color=CASTOR if line["program"] == "Castor" else EMBREE,
                label=line["program"],
            )
        if curve["logarithmic"]:
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:,.0f}"))
            axes.xaxis.set_minor_formatter(ticker.NullFormatter())
        else:
            axes.set_xticks(sorted({x for line in of_kind for x in line["x"]}))
        axes.set_ylim(bottom=0)
        axes.set_title(f"{kind} rays", loc="left")
        axes.set_xlabel(curve["label"])
        axes.set_ylabel("Mray/s")
        axes.grid()
    legend_above(figure, grid[0][0])
    return svg(figure, curve["title"])


def scaling_chart(figures):
    """`figures`: what scripts/run_stanford --json wrote, by triangles. Guides go through the last point of a line."""
    figure, (times, rendering, memory) = pyplot.subplots(1, 3, figsize=(WIDTH, 3.4), layout="constrained")
    counts = numpy.array([f["triangles"] for f in figures], dtype=float)

    def line(axes, values, label, color, guide, growth):
        values = numpy.array(values, dtype=float)
        axes.plot(counts, values, marker="o", markersize=4, color=color, label=label)
        axes.plot(
            counts,
            values[-1] * growth(counts) / growth(counts[-1]),
            color=color,
            linewidth=1,
            linestyle=":",
            label=guide,
        )

    def linear(n):
        return n

    def sorting(n):
        return n * numpy.log(n)

    seconds = {phase: [f["seconds"][phase] for f in figures] for phase in ("load", "build", "render")}
    line(times, seconds["load"], "load", KINDS[0], "as n", linear)
    line(times, seconds["build"], "build", CASTOR, "as n log n", sorting)
    times.set_title("reading and building", loc="left")
    line(rendering, seconds["render"], "render", CASTOR, "as log n", numpy.log)
    rendering.set_title("rendering", loc="left")
    line(memory, [f["peak_resident_bytes"] / 2**20 for f in figures], "peak", CASTOR, "as n", linear)
    memory.set_title("memory", loc="left")
    for axes, unit in ((times, "s"), (rendering, "s"), (memory, "MiB")):
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(ticker.LogLocator(base=10, numticks=12))
            axis.set_major_formatter(ticker.FuncFormatter(power_of_ten))
            axis.set_minor_locator(ticker.NullLocator())
        low, high = axes.get_ylim()
        axes.set_ylim(
            10 ** math.floor(math.log10(low)), 10 ** math.ceil(math.log10(high))
        )  # so that two powers are named at least
        axes.set_xlabel("triangles")
        axes.set_ylabel(unit)
        axes.grid()
        axes.legend(fontsize=9)
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.08)
    return svg(
        figure,
        "Time and memory by the number of triangles, on logarithmic axes. Dotted: growth as n, n log n or log n through"
        " the last point.",
    )


def ranks_chart(document):
    """`document`: what castor_rank_curve wrote."""
    figure, (efficiency, busy) = pyplot.subplots(1, 2, figsize=(WIDTH, 3.4), layout="constrained")
    runs = document["runs"]
    for trouble, color in zip(dict.fromkeys(run["trouble"] for run in runs), [CASTOR, KINDS[0], EMBREE]):
        counts = sorted({run["ranks"] for run in runs if run["trouble"] == trouble})
        for axes, figure_of in ((efficiency, "efficiency"), (busy, "busy_share")):
            of = [
                [100 * run[figure_of] for run in runs if run["trouble"] == trouble and run["ranks"] == count]
                for count in counts
            ]
            axes.plot(counts, [numpy.mean(v) for v in of], marker="o", markersize=4, color=color, label=trouble)
            axes.vlines(counts, [min(v) for v in of], [max(v) for v in of], color=color, linewidth=1)
    efficiency.set_title("efficiency: ideal time / time", loc="left")
    efficiency.set_ylim(min(80, 100 * min(run["efficiency"] for run in runs) - 2), 102)
    busy.set_title("how busy rank 0 is", loc="left")
    busy.set_ylim(0, max(25, 110 * max(run["busy_share"] for run in runs)))
    for axes in (efficiency, busy):
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(ticker.FuncFormatter(power_of_ten))
        axes.xaxis.set_minor_formatter(ticker.NullFormatter())
        axes.set_xlabel("ranks")
        axes.set_ylabel("%")
        axes.grid()
    legend_above(figure, efficiency)
    return svg(
        figure,
        "The real schedule and protocol on a simulated clock. Points are means of several seeds, lines span them. A"
        " piece takes up to a tenth more or less than its rank's speed says, so few ranks may exceed 100 %.",
    )


def power_of_ten(value, _):
    """1e-05, 0.001, 0.1, 10, 1k, 10k, 1M, 1G."""
    for unit, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if value >= unit:
            return f"{value / unit:g}{letter}"
    return f"{value:g}"
