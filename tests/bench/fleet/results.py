"""The rows of all parts, as one table."""

import pyarrow
import pyarrow.parquet

TEXTS = ("session", "method", "setting", "oracle")
ORIGIN = ("version", "program", "program_hash", "folder", "session_hash", "shard", "host", "cpu", "device", "error")


def rows_of(finished):
    """One row for each row of a part, and one with `error` for a part that failed."""
    rows = []
    for part, result in finished:
        machine = result.get("machine", {})
        origin = {name: part.get(name, machine.get(name)) for name in ORIGIN}
        if "error" in result:
            rows.append({**origin, "error": result["error"]})
        for row in result.get("rows", ()):
            numbers = {name: float(cell) if cell else None for name, cell in row.items() if name not in TEXTS}
            rows.append({**origin, **{name: row[name] for name in TEXTS}, **numbers})
    return sorted(
        rows, key=lambda row: tuple(str(row.get(name)) for name in ("folder", "method", "setting", "version"))
    )


def write_parquet(rows, path):
    texts = [*ORIGIN, *TEXTS]
    numbers = list(dict.fromkeys(name for row in rows for name in row if name not in texts))
    schema = pyarrow.schema(
        [(name, pyarrow.string()) for name in texts] + [(name, pyarrow.float64()) for name in numbers]
    )
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, schema=schema), path)
