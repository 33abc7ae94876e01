"""Random arms with limits beside IPOPT from ten starts: a line of JSON for each task, then the table of all lines.

python benchmarks/arms_table.py LINES.jsonl LINKS FIRST LAST     solves the tasks of these seeds with so many links
python benchmarks/arms_table.py LINES.jsonl                      prints the table

benchmarks/random_arms.jsonl has the lines of the table in docs/arms.md.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from peer_arms import ipopt, sampled

import peakmin as pm
from tests.random_arms import limited

SECONDS, STARTS = 60.0, 10  # that IPOPT has, with all of its starts


def row(links, seed):
    task = limited(seed, links)
    began = time.perf_counter()
    plan = pm.solve(task, pm.Settings(time_limit=SECONDS / 10))
    own = time.perf_counter() - began
    missed = sampled(task, plan.joints)[0] if plan.keeps else None
    peer, seconds = ipopt(task, STARTS, SECONDS, seed)
    return {
        "links": links,
        "seed": seed,
        "blocks": len(task.obstacles),
        "status": plan.status,
        "peak": plan.peak,
        "gap": plan.gap,
        "missed": missed,
        "torque": max(float(x) / link.max_torque for x, link in zip(plan.extremes.torque, task.arm.links, strict=True))
        if plan.extremes
        else None,
        "seconds": own,
        "peer": peer if np.isfinite(peer) else None,
        "peer_seconds": seconds,
    }


HEAD = (
    "links | tasks | IPOPT finds | peakmin finds of these | at most 1 % above | peakmin finds | gap, 50 % | 90 % | "
    "seconds, 50 % | 90 % | IPOPT's, 50 % | largest torque, of its limit | largest excess"
)


def table(rows):
    """The lines of a table in Markdown: a row for each number of links."""
    lines = [f"| {HEAD} |", "|" + " --: |" * len(HEAD.split("|"))]
    for links in sorted({one["links"] for one in rows}):
        of = [one for one in rows if one["links"] == links]
        keeps = [one for one in of if one["status"] in ("solved", "feasible")]
        found = [one for one in of if one["peer"] is not None]
        both = [one for one in found if one in keeps]
        near = [one for one in both if one["peak"] <= 1.01 * one["peer"]]
        gap, own, peer = ([one[k] for one in x] for k, x in (("gap", keeps), ("seconds", of), ("peer_seconds", of)))
        cells = [
            *(f"{len(x)}" for x in (of, found, both, near, keeps)),
            *(f"{np.quantile(gap, q):.3f}" for q in (0.5, 0.9)),
            *(f"{np.quantile(own, q):.1f}" for q in (0.5, 0.9)),
            f"{np.median(peer):.0f}",
            f"{max(one['torque'] for one in keeps):.4f}",
            f"{max(one['missed'] for one in keeps):.0e}",
        ]
        lines.append(f"| {links} | " + " | ".join(cells) + " |")
    return lines


def rows_of(file):
    """The lines of a file; none where there is no file. Raises `ValueError` where a task stands in it twice."""
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    if len({(one["links"], one["seed"]) for one in rows}) < len(rows):
        raise ValueError(f"{file}: a task stands in it twice")
    return rows


if __name__ == "__main__":
    file = Path(sys.argv[1])
    if len(sys.argv) > 2:
        links, first, last = map(int, sys.argv[2:5])
        known = {(one["links"], one["seed"]) for one in rows_of(file)}
        for seed in (seed for seed in range(first, last) if (links, seed) not in known):
            with file.open("a") as out:
                out.write(json.dumps(row(links, seed)) + "\n")
    print("\n".join(table(rows_of(file))))
