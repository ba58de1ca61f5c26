"""Makes the HTML page of scripts/compare_renders from its document: one file, with tables, a chart as SVG, and the
pictures in it."""

import base64
import io
import platform

import matplotlib
import matplotlib.image
import matplotlib.pyplot as pyplot
import numpy

from render_runs import BLOCKS, MOST_DIFFERENCE
from throughput_charts import CASTOR, EARLIER, EMBREE, KINDS, WIDTH, bars, legend_above, svg
from throughput_report import STYLE, colored, escape, short_names, table

COLORS = [CASTOR, EMBREE, *KINDS, *EARLIER]
THUMBNAIL = 224  # pixels

PICTURES_STYLE = """
.pictures { display: flex; flex-wrap: wrap; gap: 0.6rem; }
.pictures figure { margin: 0; } .pictures img { display: block; width: 10.4rem; }
"""


def ratio(seconds, of_castor):
    """Above 1 Castor is faster."""
    value = seconds / of_castor
    return colored(value, f"{value:.2f}")


def thumbnail(picture):
    """The linear picture as a PNG: smaller by whole pixels' means, with the curve of a screen."""
    factor = max(1, picture.shape[0] // THUMBNAIL)
    size = picture.shape[0] // factor
    small = picture[: size * factor, : size * factor].reshape(size, factor, size, factor, 3).mean(axis=(1, 3))
    file = io.BytesIO()
    matplotlib.image.imsave(file, numpy.clip(small, 0, 1) ** (1 / 2.2), format="png", metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode()


def times_table(document):
    of_castor = {(r["scene"], r["samples"]): r for r in document["results"] if r["renderer"] == "Castor"}
    rows, names = [], short_names(r["scene"] for r in document["results"])
    for r in document["results"]:
        castor = of_castor[r["scene"], r["samples"]]["medians"]
        head = [names[r["scene"]], f"{r['triangles']:,}", f"{r['samples']}", (r["renderer"], "text")]
        if r["failure"]:
            rows.append([*head, "–", "", "–", "", "–", "–", (r["failure"], "text wrap")])
            continue
        m = r["medians"]
        own = r["renderer"] == "Castor"
        rows.append(
            [
                *head,
                f"{m['render']:.3f}",
                "" if own else ratio(m["render"], castor["render"]),
                f"{m['all']:.3f}",
                "" if own else ratio(m["all"], castor["all"]),
                f"{m['load']:.3f}",
                f"{m['first']:.3f}",
                "" if own else f"{100 * r['difference']['beyond_noise']:.2f} %",
            ]
        )
    head = ["scene", "triangles", "samples", ("renderer", "text"), "render, s", "× Castor", "all, s", "× Castor"]
    return table([*head, "load, s", "first call, s", "differs"], rows)


def differences_table(document):
    names = short_names(r["scene"] for r in document["results"])
    rows = [
        [
            names[r["scene"]],
            f"{r['samples']}",
            (r["renderer"], "text"),
            f"{r['difference']['mean_ratio']:.4f}",
            *(f"{100 * r['difference'][name]:.2f} %" for name in ("pixels", "blocks", "beyond_noise")),
            ("yes" if r["agrees"] else "NO", "" if r["agrees"] else "slower"),
        ]
        for r in document["results"]
        if r["difference"]
    ]
    if not rows:
        return "<p>No other renderer made a picture.</p>"
    return table(
        ["scene", "samples", ("renderer", "text"), "mean / Castor", "pixels", "blocks", "beyond noise", "agrees"], rows
    )


def seconds_chart(document):
    """Seconds of rendering and of everything, by scene; one row for each number of samples."""
    samples = list(dict.fromkeys(r["samples"] for r in document["results"]))
    scenes = list(dict.fromkeys(r["scene"] for r in document["results"]))
    short = short_names(scenes)
    names = list(dict.fromkeys(r["renderer"] for r in document["results"]))
    medians = {(r["renderer"], r["scene"], r["samples"]): r["medians"] for r in document["results"]}
    figure, grid = pyplot.subplots(
        len(samples), 2, figsize=(WIDTH, 2.9 * len(samples)), layout="constrained", squeeze=False
    )
    for row, count in zip(grid, samples):
        for axes, phase in zip(row, ("render", "all")):
            series = {
                name: (color, [(medians.get((name, scene, count)) or {}).get(phase) for scene in scenes])
                for name, color in zip(names, COLORS)
            }
            bars(axes, [short[scene] for scene in scenes], series)
            axes.set_title(f"{phase}, {count} sample{'s' if count > 1 else ''} a pixel", loc="left")
            axes.set_ylabel("seconds")
    legend_above(figure, grid[0][0])
    return svg(
        figure,
        "Seconds of rendering with the scene loaded, and of the whole process. Medians of the rounds; lower is faster.",
    )


def pictures_section(pictures):
    """`pictures`: (scene, renderer) -> linear picture."""
    parts, names = [], short_names(scene for scene, _ in pictures)
    for scene in dict.fromkeys(scene for scene, _ in pictures):
        figures = "".join(
            f'<figure><img alt="{escape(name)}" src="data:image/png;base64,{thumbnail(picture)}"/>'
            f"<figcaption>{escape(name)}</figcaption></figure>"
            for (of, name), picture in pictures.items()
            if of == scene
        )
        parts.append(f'<h3>{escape(names[scene])}</h3><div class="pictures">{figures}</div>')
    return "\n".join(parts)


def renderers_table(document):
    rows = [
        [
            r["name"],
            (f"not found: {r['missing']}" if r["missing"] else r["version"] or "failed", "text wrap"),
            (r["note"], "text wrap"),
        ]
        for r in document["renderers"]
    ]
    return table(["renderer", ("version", "text"), ("its rays", "text")], rows)


def page(document, pictures):
    """The whole page, which is well-formed XML too."""
    machine = document["machine"]
    return f"""<!DOCTYPE html>
<html lang="en" xmlns="http://www.w3.org/1999/xhtml"><head><meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<title>Castor beside other renderers</title><style>{STYLE}{PICTURES_STYLE}</style></head>
<body><h1>Castor beside other renderers</h1>
<p class="quiet">{escape(document['date'])} · {escape(machine['cpu'])}, {escape(document['threads'])} threads ·
{escape(document['castor_version'])} on {escape(document['device'])}</p>
<p>Pictures of {document['size']} × {document['size']} pixels of grey, diffuse triangles under two point lights, with
shadows and without bounces. {document['rounds']} rounds in turns, each renderer in a process of its own; medians.</p>
<ul><li><b>render</b>: rendering with everything loaded, built and compiled. With the Python packages it is a second
call, with another seed. Castor's kernels are compiled by a run before; what it waits until they are read from a
cache is not counted here.</li>
<li><b>all</b>: the whole process, from its start to its end, with one picture; the second call is left out.</li>
<li><b>first call</b>: the call that makes this one picture. Cycles and LuxCore build their tree in it, and Mitsuba's
LLVM variant compiles in it, in the first round.</li>
<li><b>× Castor</b>: seconds over Castor's; above 1 Castor is faster.</li></ul>
{seconds_chart(document)}
{times_table(document)}
<h2>Renderers</h2>
{renderers_table(document)}
<h2>Do the pictures agree?</h2>
<p>Lights are given to each renderer in its own unit, derived from its documents and sources, and nothing is fitted.
Differences are absolute, in shares of the mean of Castor's picture: of pixels, with noise and silhouettes; of the means
of {BLOCKS} × {BLOCKS} blocks; and of these less twice their standard error, of which at most
{100 * MOST_DIFFERENCE:g} % are taken as agreement.</p>
{differences_table(document)}
{pictures_section(pictures)}
<h2>Machine</h2>
<p>{escape(machine['cpu'])}, {escape(machine['cores'])} cores usable; {escape(machine['os'])}; Python
{escape(platform.python_version())}, NumPy {escape(numpy.__version__)}, Matplotlib {escape(matplotlib.__version__)}.</p>
</body></html>
"""
