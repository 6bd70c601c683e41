"""report.html: two versions session by session, or one version; one file that needs no network."""

import html
import math

import plotly.graph_objects as go

MOST_ROWS = 200  # of a table; results.parquet has all
STYLE = """body{font:14px sans-serif;margin:2em;max-width:1100px}table{border-collapse:collapse;margin:.5em 0}
td,th{border:1px solid #ddd;padding:2px 8px;text-align:right}td:nth-child(-n+2),th:nth-child(-n+2){text-align:left}
.note{color:#666}"""


def setting_of(row):
    return f"{row['method']} {row['setting']}"


def ratio(before, after):
    """None where it says nothing: missing, or no error before."""
    return after / before if before and after is not None else None


def pairs_of(rows):
    """Rows of both versions of the same session and setting, with their ratios."""
    by_key = {}
    for row in rows:
        if row["error"] is None:
            by_key.setdefault((row["folder"], row["method"], row["setting"]), {})[row["version"]] = row
    pairs = []
    for versions in by_key.values():
        if len(versions) < 2:
            continue
        before, after = versions["before"], versions["after"]
        same = (before["host"], before["cpu"]) == (after["host"], after["cpu"])
        pairs.append(
            {
                "folder": before["folder"],
                "setting": setting_of(before),
                "before": before,
                "after": after,
                "error_ratio": ratio(before["relight_error"], after["relight_error"]),
                "cpu_ratio": ratio(before["cpu_ms"], after["cpu_ms"]) if same else None,
            }
        )
    return pairs


def table(names, lines):
    def cell(value):
        if value is None:
            return ""
        return f"{value:.4g}" if isinstance(value, float) else html.escape(str(value))

    head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{cell(value)}</td>" for value in line) + "</tr>\n" for line in lines[:MOST_ROWS]
    )
    cut = (
        f"<p class=note>The first {MOST_ROWS} of {len(lines)}; results.parquet has all.</p>"
        if len(lines) > MOST_ROWS
        else ""
    )
    return f"<table><tr>{head}</tr>\n{body}</table>{cut}"


def compared(pairs, key):
    """Worst regressions first."""
    known = sorted((pair for pair in pairs if pair[key] is not None), key=lambda pair: -pair[key])
    return table(
        ["session", "setting", "relight_error before", "after", "ratio", "CPU ms before", "after", "ratio"],
        [
            [
                pair["folder"],
                pair["setting"],
                pair["before"]["relight_error"],
                pair["after"]["relight_error"],
                pair["error_ratio"],
                pair["before"]["cpu_ms"],
                pair["after"]["cpu_ms"],
                pair["cpu_ratio"],
            ]
            for pair in known
        ],
    )


def means(rows):
    """By version and setting: mean error, mean CPU ms, number of sessions."""
    groups = {}
    for row in rows:
        if row["error"] is None and row["relight_error"] is not None and row["cpu_ms"] is not None:
            groups.setdefault((row["version"], setting_of(row)), []).append((row["relight_error"], row["cpu_ms"]))
    return {
        key: (*(math.fsum(column) / len(values) for column in zip(*values)), len(values))
        for key, values in groups.items()
    }


def error_against_cost(rows):
    """Means over the sessions; a line joins the two versions of a setting."""
    points = means(rows)
    figure = go.Figure()
    for setting in dict.fromkeys(setting for _, setting in points):
        ends = [points[version, setting] for version in ("before", "after") if (version, setting) in points]
        if len(ends) == 2:
            figure.add_scatter(
                x=[end[1] for end in ends],
                y=[end[0] for end in ends],
                mode="lines",
                showlegend=False,
                line={"color": "#bbb"},
                hoverinfo="skip",
            )
    for version, colour in (("before", "#0072b2"), ("after", "#d55e00")):
        chosen = {setting: point for (of, setting), point in points.items() if of == version}
        if chosen:
            figure.add_scatter(
                x=[p[1] for p in chosen.values()],
                y=[p[0] for p in chosen.values()],
                name=version,
                mode="markers+text",
                text=list(chosen),
                textposition="top center",
                textfont={"size": 10},
                marker={"color": colour, "size": 9},
                customdata=[p[2] for p in chosen.values()],
                hovertemplate="%{text}: error %{y:.4f}, %{x:.1f} ms, %{customdata} sessions",
            )
    figure.update_layout(template="plotly_white", height=560, title="Error against cost, mean over the sessions")
    figure.update_xaxes(type="log", title="CPU ms of a frame, objects turning")
    figure.update_yaxes(title="relight_error", rangemode="tozero")
    return figure


def ratios(pairs):
    """A point for each session and setting."""
    known = [pair for pair in pairs if pair["error_ratio"] is not None and pair["cpu_ratio"] is not None]
    figure = go.Figure()
    for setting in dict.fromkeys(pair["setting"] for pair in known):
        chosen = [pair for pair in known if pair["setting"] == setting]
        figure.add_scattergl(
            x=[pair["cpu_ratio"] for pair in chosen],
            y=[pair["error_ratio"] for pair in chosen],
            mode="markers",
            name=setting,
            text=[html.escape(pair["folder"]) for pair in chosen],
            hovertemplate="%{text}<br>error × %{y:.3f}, CPU × %{x:.3f}",
        )
    figure.add_hline(y=1, line_color="#bbb")
    figure.add_vline(x=1, line_color="#bbb")
    figure.update_layout(template="plotly_white", height=560, title="After over before, by session and setting")
    figure.update_xaxes(type="log", title="CPU ms, ratio")
    figure.update_yaxes(type="log", title="relight_error, ratio")
    return figure


def write(rows, path):
    pairs = pairs_of(rows)
    failed = [row for row in rows if row["error"] is not None]
    programs = dict.fromkeys((row["version"], row["program"], row["program_hash"]) for row in rows)
    machines = {(row["host"], row["cpu"], row["device"]) for row in rows if row["host"]}
    parts = [
        "<h1>lumigraft bench</h1>",
        table(["version", "program", "SHA-256"], list(programs)),
        f"<p>{len({row['folder'] for row in rows})} sessions, {len(rows) - len(failed)} rows, {len(failed)} failed "
        "parts.</p>",
        table(["host", "processor", "device"], sorted(machines)),
        error_against_cost(rows).to_html(full_html=False, include_plotlyjs=True),
    ]
    if pairs:
        elsewhere = sum(pair["cpu_ratio"] is None for pair in pairs)
        parts += [
            ratios(pairs).to_html(full_html=False, include_plotlyjs=False),
            "<h2>Error, worst regressions first</h2>",
            compared(pairs, "error_ratio"),
            "<h2>CPU time, worst regressions first</h2>",
            compared(pairs, "cpu_ratio"),
            (
                f"<p class=note>{elsewhere} of {len(pairs)} pairs have no ratio of costs: their versions ran on "
                "different machines.</p>"
                if elsewhere
                else ""
            ),
        ]
    else:
        known = sorted((row for row in rows if row["error"] is None), key=lambda row: -(row["relight_error"] or 0))
        parts += [
            "<h2>Largest errors first</h2>",
            table(
                ["session", "setting", "relight_error", "object_error", "CPU ms"],
                [
                    [row["folder"], setting_of(row), row["relight_error"], row["object_error"], row["cpu_ms"]]
                    for row in known
                ],
            ),
        ]
    if failed:
        parts += [
            "<h2>Failed</h2>",
            table(
                ["session", "part", "version", "error"],
                [[row["folder"], row["shard"], row["version"], row["error"]] for row in failed],
            ),
        ]
    with open(path, "w", encoding="utf-8") as f:
        f.write(
            f"<!doctype html><html lang=en><meta charset=utf-8><title>lumigraft bench</title><style>{STYLE}</style>"
            + "\n".join(parts)
            + "</html>\n"
        )
