"""Makes the HTML page of scripts/compare_throughput from its document: one file, with tables, and with charts as SVG in
it."""

import html
import math
import pathlib
import platform
import statistics

import matplotlib
import numpy

from throughput_charts import (
    curve_chart,
    kernels_chart,
    ranks_chart,
    rates_chart,
    ratios_chart,
    roofline_chart,
    scaling_chart,
)

STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; max-width: 1120px; margin: 0 auto;
padding: 2rem 1.5rem 4rem; color: #222; background: #fff; }
h1 { font-size: 1.9rem; margin: 0; letter-spacing: -0.01em; }
h2 { font-size: 1.35rem; margin: 3rem 0 0.6rem; padding-top: 1rem; border-top: 2px solid #1f6fb2; }
h3 { font-size: 1.05rem; margin: 2rem 0 0.4rem; }
p { max-width: 80ch; } .quiet { color: #666; }
.tiles { display: flex; flex-wrap: wrap; gap: 0.8rem; margin: 1.4rem 0; }
.tile { flex: 1 1 11rem; padding: 0.8rem 1rem; border: 1px solid #dde3e9; border-radius: 8px; background: #f7f9fb; }
.tile strong { display: block; font-size: 1.6rem; font-weight: 600; font-variant-numeric: tabular-nums; }
.tile span { color: #555; font-size: 0.85rem; }
.scroll { overflow-x: auto; margin: 0.8rem 0; }
table { border-collapse: collapse; font-size: 0.82rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.3em 0.55em; border-bottom: 1px solid #e3e7eb; text-align: right; white-space: nowrap; }
th { color: #555; font-weight: 600; border-bottom: 2px solid #cfd6dd; vertical-align: bottom; }
th:first-child, td:first-child, .text { text-align: left; }
tbody tr:hover { background: #f3f7fb; }
.wrap { white-space: normal; }
.slower { color: #b3261e; } .faster { color: #1b6e2c; }
figure { margin: 1.4rem 0; } figcaption { color: #666; font-size: 0.86rem; max-width: 90ch; }
svg { display: block; max-width: 100%; height: auto; }
@media print { .scroll { overflow: visible; } figure, .tile { break-inside: avoid; } }
"""


def escape(value):
    return html.escape(str(value))


def table(head, rows):
    """Cells are text, or (text, class)."""

    def cell(value, tag):
        text, kind = value if isinstance(value, tuple) else (value, "")
        return f'<{tag} class="{kind}">{escape(text)}</{tag}>' if kind else f"<{tag}>{escape(text)}</{tag}>"

    def line(values, tag, kind=""):
        return f"<tr{kind}>" + "".join(cell(value, tag) for value in values) + "</tr>"

    return (
        '<div class="scroll"><table><thead>'
        + line(head, "th")
        + "</thead><tbody>"
        + "\n".join(line(row, "td") for row in rows)
        + "</tbody></table></div>"
    )


def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(value) for value in values))


def colored(ratio, text):
    return text, "slower" if ratio < 1 else "faster"


def short_names(scenes):
    """Scene -> its file's name, or the whole path where two have the same name."""
    scenes = set(scenes)
    names = [pathlib.Path(scene).name for scene in scenes]
    return {
        scene: pathlib.Path(scene).name if names.count(pathlib.Path(scene).name) == 1 else scene for scene in scenes
    }


def embree_rate(measured):
    return max(measured["embree"]["mrays_per_second"].values())


class Earlier:
    """A file of castor bench --json, or of --json, as a further column."""

    def __init__(self, name, document):
        self.name = name
        self.document = document
        self.rates = {}  # (scene, rays, device) -> (Mray/s, strategy): that of "auto", else the fastest
        for measured in document["results"]:
            key = measured["scene"], measured["rays"], measured["device"]
            found = measured["mrays_per_second"]["median"], measured["strategy"]
            old = self.rates.get(key)
            if old is None or (old[1] != "auto" and (found[1] == "auto" or found[0] > old[0])):
                self.rates[key] = found

    def rate(self, measured):
        """None: not measured then."""
        return self.rates.get((measured["scene"], measured["rays"], measured["device"]), (None, ""))[0]

    def cell(self, measured):
        then, strategy = self.rates.get((measured["scene"], measured["rays"], measured["device"]), (None, ""))
        if not then:
            return "–"
        now = measured["mrays_per_second"]["median"] / then
        return colored(now, f"{then:.2f}{'' if strategy == 'auto' else ' ' + strategy} (×{now:.2f})")


def rates_table(results, names, earlier):
    rows = []
    for m in results:
        embree = m["embree"]
        least, largest = embree["ratio_spread"]
        rows.append(
            [
                names[m["scene"]],
                (m["rays"], "text"),
                f"{m['ray_count']:,}",
                f"{100 * m['hits'] / m['ray_count']:.0f} %",
                (m["strategy_used"], "text"),
                f"{m['mrays_per_second']['median']:.2f}",
                *(f"{embree['mrays_per_second'][width]:.2f}" for width in ("1", "8", "16")),
                colored(embree["ratio"], f"{embree['ratio']:.2f} ({least:.2f}–{largest:.2f})"),
                *(e.cell(m) for e in earlier),
                f"{embree['differing']}",
                f"{embree['far_apart']}",
            ]
        )
    return table(
        [
            "scene",
            ("rays", "text"),
            "count",
            "hit",
            ("strategy", "text"),
            "Castor",
            "Embree 1",
            "Embree 8",
            "Embree 16",
            "ratio (rounds)",
            *((f"{e.name} (now)", "wrap") for e in earlier),
            "differ",
            "far",
        ],
        rows,
    )


def work_section(results, names, roofs):
    rows = [
        [
            names[m["scene"]],
            (m["rays"], "text"),
            (m["strategy_used"], "text"),
            f"{m['nodes_per_ray']:.2f}",
            f"{m['tests_per_ray']:.2f}",
            f"{m['bytes_per_ray']:,.0f}",
            f"{m['flops_per_ray']:,.0f}",
            f"{100 * m['share_of_roofs']['memory']:.1f} %",
            f"{100 * m['share_of_roofs']['flops']:.1f} %",
        ]
        for m in results
    ]
    points = [
        (m["rays"], m["flops_per_ray"] / m["bytes_per_ray"], m["mrays_per_second"]["best"] * m["flops_per_ray"] * 1e-3)
        for m in results
    ]
    return (
        "<h3>What a ray takes</h3><p>Counted by an instrumented build of the same kernels, outside the timing; what a"
        " bundle of rays does together counts once. The device's own roofs, measured:"
        f" {roofs['bytes_per_second'] * 1e-9:.1f} GB/s and {roofs['flops_per_second'] * 1e-9:.1f} Gflop/s. Shares are"
        " those of the best rate; bytes are counted wherever they come from, so caches may carry the memory's share"
        " beyond 100 %.</p>"
        + table(
            [
                "scene",
                ("rays", "text"),
                ("strategy", "text"),
                "nodes",
                "tests",
                "bytes",
                "flops",
                "of memory",
                "of fma rate",
            ],
            rows,
        )
        + roofline_chart(points, roofs)
    )


def build_section(results, names):
    seconds = {}  # scene -> (of Castor, of Embree)
    for m in results:
        seconds.setdefault(names[m["scene"]], ([], []))
        seconds[names[m["scene"]]][0].extend(m["build_seconds_of_runs"])
        seconds[names[m["scene"]]][1].extend(m["embree"]["build_seconds"])
    return "<h3>Building the tree</h3>" + table(
        ["scene", "Castor, s", "Embree (medium), s"],
        [[scene, f"{statistics.median(a):.4f}", f"{statistics.median(b):.4f}"] for scene, (a, b) in seconds.items()],
    )


def kernels_section(measured):
    rows = [
        [
            m["kernel"],
            f"{m['count']:,}",
            (m["unit"], "text"),
            f"{m['checked']:,}",
            f"{m['millions_per_second']['median']:,.1f}",
            f"{m['millions_per_second']['best']:,.1f}",
        ]
        for m in measured
    ]
    return (
        "<h3>Single functions</h3><p>Each by itself, its answers held against a reference in double precision"
        " before.</p>"
        + table(["function", "count", ("of", "text"), "checked", "median, M/s", "best, M/s"], rows)
        + kernels_chart([m["kernel"] for m in measured], [m["millions_per_second"]["median"] for m in measured])
    )


PACKAGES = {"trimesh": "trimesh", "open3d": "Open3D"}


def why_differing(query, beside):
    """What is known of answers that differ, in words."""
    if query == "any":
        counted = [(beside["only_castor"], "only Castor hits"), (beside["only_package"], "only the other hits")]
    elif query == "count":
        counted = [
            (beside["package_more"], "more than Castor"),
            (beside["package_fewer"], "fewer"),
            (beside["parity"], "odd for even or even for odd"),
        ]
    else:
        why = beside["why"]
        counted = [
            (why["same_distance"], "another face in the same place"),
            (why["at_origin"], "a face at the ray's origin"),
            (why["at_edge"], "a ray along an edge of its face"),
            (why["other"], "for other reasons"),
            (beside["missed"], "of all are misses"),
            (beside["only_package"], "of all are misses of Castor"),
        ]
    return ", ".join(f"{count:,} {text}" for count, text in counted if count) or "–"


def packages_section(results, names, versions):
    """Castor's Python package beside others."""
    rows = []
    for m in results:
        for result in m.get("packages", []):
            for name, beside in result["packages"].items():
                least, largest = beside["ratio_spread"]
                rows.append(
                    [
                        names[m["scene"]],
                        (m["rays"], "text"),
                        (result["query"], "text"),
                        (PACKAGES[name], "text"),
                        f"{result['castor_mrays_per_second']:.2f}",
                        f"{beside['mrays_per_second']:.2f}",
                        colored(beside["ratio"], f"{beside['ratio']:.2f} ({least:.2f}–{largest:.2f})"),
                        f"{beside['differing']:,}",
                        (why_differing(result["query"], beside), "text wrap"),
                    ]
                )
    if not rows:
        return ""
    head = [
        "scene",
        *((word, "text") for word in ("rays", "query", "package")),
        "Castor",
        "package",
        "ratio (rounds)",
        "differ",
        ("because", "text"),
    ]
    asked = "; ".join(f"{PACKAGES[name]} {version}" for name, version in versions.items())
    return (
        f"<h3>From Python</h3><p>Castor's Python package beside {escape(asked)}, in one process and in turns, with"
        " arrays as each takes them: Mray/s of calls, with making all that they return. None of them but Castor knows"
        " the range of a ray, so rays go on for ever here. trimesh's have one thread and double precision around"
        " Embree's single one.</p>" + table(head, rows)
    )


def tile(value, text):
    return f'<div class="tile"><strong>{escape(value)}</strong><span>{escape(text)}</span></div>'


def device_section(device, document, earlier):
    """Tables and charts of one device beside Embree."""
    results = [m for m in document["results"] if m["device_index"] == device["index"]]
    if not results:
        return ""
    names = short_names(m["scene"] for m in document["results"])
    by_ratio = sorted(results, key=lambda m: m["embree"]["ratio"])
    kinds = list(dict.fromkeys(m["rays"] for m in results))
    scenes = list(dict.fromkeys(names[m["scene"]] for m in results))
    keys = [(names[m["scene"]], m["rays"]) for m in results]
    parts = [
        f"<h2>{escape(device['name'])}</h2>",
        '<div class="tiles">',
        tile(
            f"{geometric_mean([m['embree']['ratio'] for m in results]):.2f} ×",
            f"Castor / Embree, geometric mean over {len(results)} pairs of scene and rays",
        ),
        *(
            tile(
                f"{geometric_mean([m['embree']['ratio'] for m in results if m['rays'] == kind]):.2f} ×", f"{kind} rays"
            )
            for kind in kinds
        ),
        "</div>",
        (
            f"<p>Least {by_ratio[0]['embree']['ratio']:.2f} ({escape(names[by_ratio[0]['scene']])},"
            f" {escape(by_ratio[0]['rays'])}), largest {by_ratio[-1]['embree']['ratio']:.2f}"
            f" ({escape(names[by_ratio[-1]['scene']])}, {escape(by_ratio[-1]['rays'])}). Rates are in Mray/s.</p>"
        ),
        ratios_chart(
            scenes, kinds, {key: (m["embree"]["ratio"], *m["embree"]["ratio_spread"]) for key, m in zip(keys, results)}
        ),
        rates_table(results, names, earlier),
        rates_chart(
            scenes,
            kinds,
            {
                "Castor": {key: m["mrays_per_second"]["median"] for key, m in zip(keys, results)},
                "Embree, best": {key: embree_rate(m) for key, m in zip(keys, results)},
                **{f"{e.name}": {key: e.rate(m) for key, m in zip(keys, results)} for e in earlier},
            },
        ),
    ]
    roofs = [r for r in document["roofs"] if r["device_index"] == device["index"]]
    parts.append(work_section(results, names, roofs[0]))
    parts.append(build_section(results, names))
    parts.append(packages_section(results, names, document.get("package_versions", {})))
    kernels = [m for m in document["kernels"] if m["device_index"] == device["index"]]
    if kernels:
        parts.append(kernels_section(kernels))
    return "\n".join(parts)


def earlier_section(earlier, document):
    """Where the further columns are from, and what of them has no row above."""
    now = {(m["scene"], m["rays"], m["device"]) for m in document["results"]}
    parts = ["<h2>Earlier measurements</h2>"]
    rows, missing = [], []
    for e in earlier:
        machine = e.document.get("machine", {})
        rows.append(
            [
                e.name,
                (e.document.get("castor_version", "unknown"), "text"),
                (e.document.get("date", "unknown"), "text"),
                (f"{machine.get('cpu', 'unknown')}, {machine.get('cores', '?')} cores", "text"),
                (machine.get("os", "unknown"), "text"),
            ]
        )
        missing += [
            [e.name, (scene, "text"), (rays, "text"), (device, "text"), f"{rate:.2f} {strategy}"]
            for (scene, rays, device), (rate, strategy) in e.rates.items()
            if (scene, rays, device) not in now
        ]
    parts.append(table(["file", ("Castor", "text"), ("date", "text"), ("machine", "text"), ("system", "text")], rows))
    if missing:
        parts.append(
            "<p>Measured then, not now:</p>"
            + table(["file", ("scene", "text"), ("rays", "text"), ("device", "text"), "Mray/s"], missing)
        )
    return "\n".join(parts)


def scaling_section(figures):
    """`figures`: what scripts/run_stanford --json wrote."""
    figures = sorted(figures, key=lambda f: f["triangles"])
    rows = [
        [
            f"{f['triangles']:,}",
            *(f"{f['seconds'][phase]:.3f}" for phase in ("load", "flatten", "build", "setup", "render")),
            f"{f['elapsed_seconds']:.1f}",
            f"{f['cpu_seconds']:.1f}",
            f"{f['peak_resident_bytes'] / 2**20:,.0f}",
            f"{f['peak_resident_bytes'] / f['triangles']:,.0f}",
        ]
        for f in figures
    ]
    return (
        f"<h2>From a file to a picture</h2><p>One scan, a point light and shadows, on {escape(figures[0]['device'])}."
        " Times are wall time in seconds of one run each; memory is the largest resident size of the whole program, in"
        " MiB and in bytes a triangle.</p>"
        + table(
            [
                "triangles",
                "load",
                "flatten",
                "build",
                "set up",
                "render",
                "in all",
                "CPU time",
                "peak, MiB",
                "bytes each",
            ],
            rows,
        )
        + scaling_chart(figures)
    )


def ranks_section(document):
    """`document`: what castor_rank_curve wrote."""
    rows = []
    for trouble in dict.fromkeys(run["trouble"] for run in document["runs"]):
        of_trouble = [run for run in document["runs"] if run["trouble"] == trouble]
        for count in sorted({run["ranks"] for run in of_trouble}):
            runs = [run for run in of_trouble if run["ranks"] == count]
            rows.append(
                [
                    trouble,
                    f"{count:,}",
                    f"{100 * min(run['efficiency'] for run in runs):.1f} %",
                    f"{100 * statistics.fmean(run['efficiency'] for run in runs):.1f} %",
                    f"{100 * max(run['busy_share'] for run in runs):.1f} %",
                    f"{max(run['messages'] for run in runs):,}",
                    f"{max(run['dropped'] for run in runs)}",
                ]
            )
    return (
        f"<h2>Several computers, simulated</h2><p>A picture of {document['items']:,} blocks of 8×8 pixels, for which"
        f" all ranks together need {document['mean_seconds']:g} s. The ideal is that all work as long as they live; of"
        " the seeds, the worst and the mean efficiency are told, and the most of the other figures.</p>"
        + ranks_chart(document)
        + table(
            ["what happens", "ranks", "least efficiency", "mean", "rank 0 busy", "messages of rank 0", "dropped"], rows
        )
    )


def versions_section(document):
    machine = document["machine"]
    rows = [
        ("CPU", f"{machine['cpu']}, {machine['cores']} cores usable"),
        ("System", f"{machine['os']}, {machine['kernel']}"),
        ("Castor", document["castor_version"]),
    ]
    rows += [
        (
            f"Device {d['index']}",
            (
                f"{d['name']} ({d['type']}), driver {d['driver_version']}, {d['device_version']}, "
                f"platform {d['platform']} {d['platform_version']}"
            ),
        )
        for d in document["devices"]
    ]
    rows += [
        (
            "Embree",
            f"{document['embree_version']}, {document['threads']} threads, medium build quality, default scene flags",
        ),
        (
            "Report",
            f"Python {platform.python_version()}, NumPy {numpy.__version__}, Matplotlib {matplotlib.__version__}",
        ),
    ]
    return (
        '<h2>Machine and versions</h2><div class="scroll"><table><tbody>'
        + "".join(f'<tr><td>{escape(a)}</td><td class="text wrap">{escape(b)}</td></tr>' for a, b in rows)
        + "</tbody></table></div>"
    )


def page(document, earlier_documents):
    """The whole page, which is well-formed XML too. `earlier_documents`: (name, document)."""
    names = short_names(name for name, _ in earlier_documents)
    earlier = [Earlier(names[name], earlier_document) for name, earlier_document in earlier_documents]
    sections = [device_section(device, document, earlier) for device in document["devices"]]
    if document["curves"]:
        sections.append("<h2>Scaling</h2>" + "\n".join(map(curve_chart, document["curves"])))
    if document.get("scaling"):
        sections.append(scaling_section(document["scaling"]))
    if document.get("ranks"):
        sections.append(ranks_section(document["ranks"]))
    if earlier:
        sections.append(earlier_section(earlier, document))
    sections.append(versions_section(document))
    machine = document["machine"]
    return f"""<!DOCTYPE html>
<html lang="en" xmlns="http://www.w3.org/1999/xhtml"><head><meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<title>Castor beside Embree</title><style>{STYLE}</style></head>
<body><h1>Castor beside Embree</h1>
<p class="quiet">{escape(document['date'])} · {escape(machine['cpu'])}, {escape(machine['cores'])} cores ·
Castor {escape(document['castor_version'])} ·
Embree {escape(document['embree_version'])}</p>
<p>{document['rounds']} rounds of {document['repeat']} runs each, in turns. Rates are millions of rays a second of wall
time, the
query alone, with rays and answers where the query reads and writes them: medians of all runs. Ratios are those of the
medians of a round, of which the
median, the least and the largest are told. Embree's rate is the best of calls with 1, 8 and 16 rays,
with the coherence hint that fits the rays; denormals count as zero there. Castor's answers were
compared with brute force, bit for bit, before. “differ” counts the rays for
which the two name different primitives, which happens on shared edges; “far” counts those of them whose
distances differ by more than a thousandth.</p>
{chr(10).join(sections)}
</body></html>
"""
