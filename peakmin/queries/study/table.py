"""A study's answer: a table with one row for each problem."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ... import files
from ...errors import SpecError
from ...plan.plan import KEEPS
from ...types import Array, Json

KINDS = (".csv", ".parquet")
SHOWN = 60  # rows in a notebook
NUMBERS = ("peak", "lower_bound", "gap", "peak_force", "clearance", "seconds")
WORDS = ("spec", "status", "scope", "solver", "reason", "error")


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """One row for each problem, in the order asked for.

    rows: `spec` (hash), the varied fields by path, `status` (a plan's, or "failed" where an exception
        ended it), `peak` and `lower_bound` [m/s^2], `gap`, `scope`, `peak_force` [N], `obstacle_times` [s],
        `clearance` [m], `solver`, `compilations`, `seconds`, `reason` (why it is infeasible or unknown), `error` (why
        it failed); None where not known.
    varied: the paths of the fields that differ between rows.
    """

    rows: tuple[Json, ...]  # a varied field holds anything
    varied: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of a row's values, in order."""
        return tuple(self.rows[0])

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> Array:
        """A column of numbers, shape (rows,), NaN where not known.

        Raises:
            KeyError: when there is no such column.
            ValueError: when it does not hold numbers.
        """
        return np.array([np.nan if row[column] is None else row[column] for row in self.rows], dtype=float)

    def document(self) -> dict[str, object]:
        """The study as plain JSON data."""
        return {"version": 1, "varied": list(self.varied), "rows": list(self.rows)}

    def to_json(self, *, indent: int | None = None) -> str:
        """The study as one JSON document."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    def to_csv(self) -> str:
        """Text: a head and the rows; lists and objects as JSON, nothing where a value is not known."""
        return files.csv_text(self.columns, ([_cell(value) for value in row.values()] for row in self.rows))

    def to_parquet(self) -> bytes:
        """The table in Parquet's format, obstacle times as lists; needs pyarrow."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        types = dict.fromkeys(NUMBERS, pa.float64()) | dict.fromkeys(WORDS, pa.string())
        types |= {"obstacle_times": pa.list_(pa.float64()), "compilations": pa.int64()}
        columns = {}
        for name in self.columns:
            values = [row[name] for row in self.rows]
            columns[name] = pa.array(values, types[name]) if name in types else pa.array(_of_one_type(values))
        buffer = pa.BufferOutputStream()
        pq.write_table(pa.table(columns), buffer)
        return bytes(buffer.getvalue())

    def write(self, store: str | Path | None) -> None:
        """The table as a .csv or .parquet file, whole or not at all; nothing for None. Raises `SpecError`."""
        refuse(store)
        if store is not None:
            files.write(store, self.to_csv() if Path(store).suffix == ".csv" else self.to_parquet())

    @property
    def answered(self) -> bool:
        """Whether for every problem there is a motion that keeps all that was asked, or a proof that there is none."""
        return {*KEEPS, "infeasible"}.issuperset(self._statuses)

    def __repr__(self) -> str:
        counts = {status: sum(row["status"] == status for row in self.rows) for status in self._statuses}
        return f"Study({len(self)} rows: {', '.join(f'{count} {status}' for status, count in counts.items())})"

    @property
    def _statuses(self) -> list[str]:
        return list(dict.fromkeys(row["status"] for row in self.rows))

    def _repr_html_(self) -> str:
        def line(tag: str, cells: Iterable[object]) -> str:
            return "<tr>" + "".join(f"<{tag}>{html.escape(_cell(cell))}</{tag}>" for cell in cells) + "</tr>"

        body = "".join(line("td", row.values()) for row in self.rows[:SHOWN])
        more = f"<p>{len(self) - SHOWN} more rows</p>" if len(self) > SHOWN else ""
        return f"<p>{html.escape(repr(self))}</p><table>{line('th', self.columns)}{body}</table>{more}"


def refuse(store: str | Path | None) -> None:
    """Refuse a table's name that cannot be written. Raises `SpecError`."""
    if store is None:
        return
    suffix = Path(store).suffix
    if suffix not in KINDS:
        raise SpecError(f"store: was {str(store)!r}, must end in {' or '.join(KINDS)}")
    if suffix == ".parquet" and find_spec("pyarrow") is None:
        raise SpecError(f"store: was {str(store)!r}, must be a .csv without pyarrow (extra `parquet`)")


def _cell(value: object) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value)


def _of_one_type(values: list[object]) -> list[object]:
    """Values as they are where they are all numbers or all words, else each as its JSON text."""
    there = [value for value in values if value is not None]
    for one in (bool, int, float, str):
        if all(type(value) is one for value in there):
            return values
    if all(type(value) in (int, float) for value in there):
        return [float(value) if isinstance(value, int | float) else None for value in values]
    return [None if value is None else json.dumps(value) for value in values]
