"""Makes the HTML page of scripts/compare_throughput: one file, with tables, and with charts as SVG in it."""

import html
import io
import platform
import re

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as pyplot  # noqa: E402
import numpy  # noqa: E402

CASTOR, EMBREE, THIRD, FOURTH = "#1f6fb2", "#e08a1e", "#5a9e4b", "#8b6bb1"
STYLE = """
body { font-family: sans-serif; max-width: 72em; margin: 2em auto; padding: 0 1em; color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1em 0; }
th, td { padding: 0.25em 0.7em; border-bottom: 1px solid #ddd; text-align: right; }
th:first-child, td:first-child, .text { text-align: left; }
.slower { color: #b3261e; } .faster { color: #1b6e2c; }
figure { margin: 1.5em 0; } figcaption { color: #555; } svg { max-width: 100%; height: auto; }
"""

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "castor", "font.family": "sans-serif", "font.size": 10,
                            "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True})
chart_count = 0


def escape(value):
    return html.escape(str(value))


def svg(figure, caption):
    """The figure's SVG to stand in a page, with names of its own."""
    global chart_count
    chart_count += 1
    text = io.StringIO()
    figure.savefig(text, format="svg", bbox_inches="tight", metadata={"Date": None})
    pyplot.close(figure)
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg"):]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.S)
    own = f"c{chart_count}-"
    drawing = re.sub(r'\bid="', f'id="{own}', drawing)
    drawing = re.sub(r"url\(#", f"url(#{own}", drawing)
    drawing = re.sub(r'href="#', f'href="#{own}', drawing)
    return f"<figure>{drawing}<figcaption>{escape(caption)}</figcaption></figure>"


def table(head, rows):
    """Cells are text, or (text, class)."""
    def cell(value, tag):
        text, kind = value if isinstance(value, tuple) else (value, "")
        return f'<{tag} class="{kind}">{escape(text)}</{tag}>' if kind else f"<{tag}>{escape(text)}</{tag}>"

    def line(values, tag):
        return "<tr>" + "".join(cell(value, tag) for value in values) + "</tr>"

    return ("<table><thead>" + line(head, "th") + "</thead><tbody>" + "\n".join(line(row, "td") for row in rows) + "</tbody></table>")


def ratio_cell(ratio, spread):
    return f"{ratio:.2f} ({spread[0]:.2f}–{spread[1]:.2f})", "slower" if ratio < 1 else "faster"


def grouped_bars(groups, series, label, errors=None, line=None):
    """`series`: name -> (colour, one value a group); `errors`: name -> (below, above) for each group."""
    figure, axes = pyplot.subplots(figsize=(max(6.0, 0.5 + 0.28 * len(groups) * (len(series) + 1)), 3.4))
    width = 0.8 / len(series)
    at = numpy.arange(len(groups))
    for k, (name, (color, values)) in enumerate(series.items()):
        axes.bar(at + (k - (len(series) - 1) / 2) * width, values, width, label=name, color=color,
                 yerr=errors[name] if errors else None, ecolor="#333", capsize=2)
    if line is not None:
        axes.axhline(line, color="#333", linewidth=1)
    axes.set_xticks(at, groups, rotation=30 if len(groups) > 3 else 0, ha="right" if len(groups) > 3 else "center")
    axes.set_ylabel(label)
    axes.grid(axis="y", color="#ddd")
    axes.legend(frameon=False, ncols=len(series), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure


def curve_chart(curve):
    """A curve has a title, the axis' label, whether it is logarithmic, and lines: (name, whose, xs, ys)."""
    figure, axes = pyplot.subplots(figsize=(6.5, 3.6))
    styles = ["-", "--", ":", "-."]
    kinds = []
    for kind, whose, xs, ys in curve["lines"]:
        if kind not in kinds:
            kinds.append(kind)
        axes.plot(xs, ys, marker="o", markersize=4, linestyle=styles[kinds.index(kind) % len(styles)],
                  color=CASTOR if whose == "Castor" else EMBREE, label=f"{whose}, {kind}")
    if curve["logarithmic"]:
        axes.set_xscale("log")
    else:
        axes.set_xticks(sorted({x for line in curve["lines"] for x in line[2]}))
    axes.set_ylim(bottom=0)
    axes.set_xlabel(curve["label"])
    axes.set_ylabel("Mray/s")
    axes.grid(color="#ddd")
    axes.legend(frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return svg(figure, curve["title"])


def duel_rows(cells):
    rows = []
    for cell in cells:
        d = cell["duel"]
        rates = d.embree_rates
        rows.append([cell["scene"], (cell["rays"], "text"), f"{d.ray_count:,}", (d.strategy, "text"), f"{d.castor_rate:.2f}",
                     *(f"{rates[width]:.2f}" for width in ("1", "8", "16")), ratio_cell(d.ratio, d.ratio_spread),
                     f"{d.differing}", f"{d.far_apart}"])
    return rows


def device_section(device, cells, mean):
    """Tables and charts of one device beside Embree."""
    parts = [f"<h2>{escape(device['name'])}</h2>",
             f"<p>Castor / Embree, geometric mean over {len(cells)} pairs of scene and rays: <strong>{mean:.2f}</strong>; "
             f"least {min(c['duel'].ratio for c in cells):.2f}, largest {max(c['duel'].ratio for c in cells):.2f}.</p>",
             table(["scene", ("rays", "text"), "count", ("strategy", "text"), "Castor", "Embree 1", "Embree 8", "Embree 16",
                    "ratio (rounds)", "differ", "far"], duel_rows(cells))]
    scenes = list(dict.fromkeys(c["scene"] for c in cells))
    kinds = list(dict.fromkeys(c["rays"] for c in cells))
    by_key = {(c["scene"], c["rays"]): c["duel"] for c in cells}
    colors = dict(zip(kinds, [CASTOR, EMBREE, THIRD, FOURTH]))

    def values(kind, of):
        return [of(by_key[scene, kind]) if (scene, kind) in by_key else 0.0 for scene in scenes]

    ratios = {kind: (colors[kind], values(kind, lambda d: d.ratio)) for kind in kinds}
    errors = {kind: [values(kind, lambda d: d.ratio - d.ratio_spread[0]), values(kind, lambda d: d.ratio_spread[1] - d.ratio)]
              for kind in kinds}
    parts.append(svg(grouped_bars(scenes, ratios, "Castor / Embree", errors, 1.0),
                     "Rates of Castor over the best of Embree's: medians of the rounds. Lines span the ratios of the single rounds."))
    names = [f"{c['scene']}, {c['rays']}" for c in cells]
    parts.append(svg(grouped_bars(names, {"Castor": (CASTOR, [c["duel"].castor_rate for c in cells]),
                                          "Embree, best": (EMBREE, [c["duel"].embree_rate for c in cells])}, "Mray/s"),
                     "Medians of all runs."))
    builds = {}
    for c in cells:
        builds.setdefault(c["scene"], ([], []))
        builds[c["scene"]][0].extend(c["duel"].castor_build_seconds)
        builds[c["scene"]][1].extend(c["duel"].embree_build_seconds)
    parts.append("<h3>Building the tree</h3>")
    parts.append(table(["scene", "Castor, s", "Embree (medium), s"],
                       [[scene, f"{numpy.median(a):.3f}", f"{numpy.median(b):.3f}"] for scene, (a, b) in builds.items()]))
    return "\n".join(parts)


def earlier_section(earlier, cells):
    """The files given on the command line beside today's medians."""
    now = {(c["measured"]["scene"], c["rays"], c["device"]): c["duel"].castor_rate for c in cells}
    parts = ["<h2>Earlier measurements</h2>"]
    for name, document in earlier:
        machine = document.get("machine", {})
        parts.append(f"<h3>{escape(name)}</h3><p>Castor {escape(document.get('castor_version', 'of unknown version'))} on "
                     f"{escape(machine.get('cpu', 'an unknown machine'))}, {escape(machine.get('cores', '?'))} cores, "
                     f"{escape(machine.get('os', ''))}</p>")
        rows = []
        for measured in document["results"]:
            then = measured["mrays_per_second"]["median"]
            today = now.get((measured["scene"], measured["rays"], measured["device"]))
            rows.append([measured["scene"], (measured["rays"], "text"), (measured["strategy"], "text"), (measured["device"], "text"),
                         f"{then:.2f}", f"{today:.2f}" if today else "–", f"{today / then:.2f}" if today and then > 0 else "–"])
        parts.append(table(["scene", ("rays", "text"), ("strategy", "text"), ("device", "text"), "then", "now", "now / then"], rows))
    return "\n".join(parts)


def versions_table(info):
    machine = info["machine"]
    rows = [("CPU", f"{machine['cpu']}, {machine['cores']} cores usable"), ("System", f"{machine['os']}, {machine['kernel']}"),
            ("Castor", info["castor_version"])]
    rows += [(f"Device {d['index']}", f"{d['name']} ({d['type']}), driver {d['driver_version']}, {d['device_version']}, "
              f"platform {d['platform']} {d['platform_version']}") for d in info["devices"]]
    rows += [("Embree", f"{info['embree_version']}, {info['threads']} threads, medium build quality, default scene flags"),
             ("Report", f"Python {platform.python_version()}, NumPy {numpy.__version__}, Matplotlib {matplotlib.__version__}")]
    return "<table><tbody>" + "".join(
        f'<tr><td>{escape(a)}</td><td class="text">{escape(b)}</td></tr>' for a, b in rows) + "</tbody></table>"


def page(info, sections):
    """The whole page, which is well-formed XML too."""
    return f"""<!DOCTYPE html>
<html lang="en" xmlns="http://www.w3.org/1999/xhtml"><head><meta charset="utf-8"/><title>Castor beside Embree</title><style>{STYLE}</style></head>
<body><h1>Castor beside Embree</h1>
<p>{escape(info['date'])}. {info['rounds']} rounds of {info['repeat']} runs each, in turns. Rates are millions of rays a second of wall time, the
query alone, with rays and answers where the query reads and writes them: medians of all runs. Ratios are those of the medians of a round, of which the
median, the least and the largest are told. Embree's rate is the best of calls with 1, 8 and 16 rays,
with the coherence hint that fits the rays; denormals count as zero there. Castor's answers were compared with brute force, bit for bit, before. “differ” counts the rays for
which the two name different primitives, which happens on shared edges; “far” counts those of them whose distances differ by more than a thousandth.</p>
{versions_table(info)}
{chr(10).join(sections)}
</body></html>
"""
