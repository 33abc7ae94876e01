"""Random arms with limits beside IPOPT from ten starts: a line of JSON for each task, then the table of all lines.

python benchmarks/arms_table.py LINES.jsonl LINKS FIRST LAST     solves the tasks of these seeds with so many links
python benchmarks/arms_table.py LINES.jsonl                      prints the table
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from peer_arms import KEPT, ipopt, sampled

import peakmin as pm
from tests.random_arms import limited

SECONDS, STARTS = 60.0, 10  # that IPOPT has, with all of its starts


def row(links, seed):
    task = limited(seed, links)
    began = time.perf_counter()
    plan = pm.solve(task, pm.Settings(time_limit=SECONDS / 10))
    own = time.perf_counter() - began
    missed = sampled(task, plan.joints)[0] if plan.keeps else np.nan
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
        "peer": peer,
        "peer_seconds": seconds,
    }


def table(rows):
    lines = [
        "links tasks IPOPT found | of these found, within 1 % | found besides | gap 50 % 90 % | s 50 % 90 % | IPOPT s"
    ]
    for links in sorted({one["links"] for one in rows}):
        of = [one for one in rows if one["links"] == links]
        found = [one for one in of if np.isfinite(one["peer"])]
        keeps = [one for one in of if one["status"] in ("solved", "feasible")]
        both = [one for one in found if one in keeps]
        near = [one for one in both if one["peak"] <= 1.01 * one["peer"]]
        gap, own, peer = (
            np.array([one[k] for one in x]) for k, x in (("gap", keeps), ("seconds", of), ("peer_seconds", of))
        )
        lines.append(
            f"{links:5} {len(of):5} {len(found):11} | {len(both):14} {len(near):11} | {len(keeps) - len(both):13} | "
            f"{np.median(gap):8.3f} {np.quantile(gap, 0.9):.3f} | {np.median(own):5.1f} {np.quantile(own, 0.9):4.1f} | "
            f"{np.median(peer):6.1f}"
        )
        lines.append(
            f"      largest torque of its limit {max(one['torque'] for one in keeps):.6f}, "
            f"largest excess at 10,000 instants {max(one['missed'] for one in keeps):.1e} (IPOPT's may be {KEPT:g})"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    file = Path(sys.argv[1])
    if len(sys.argv) > 2:
        links, first, last = map(int, sys.argv[2:5])
        for seed in range(first, last):
            with file.open("a") as out:
                out.write(json.dumps(row(links, seed)) + "\n")
    print(table([json.loads(line) for line in file.read_text().splitlines()]))
