"""Run every benchmark and print one table: seconds are this machine's, ratios are what counts."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
# what the ratio is taken against; else the group's first row
FIRST = {"sweep": "linprog loop (peer)", "proof": "CasADi + IPOPT, local (peer)"}


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "results.json"
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-o",
            "python_files=bench_*.py",
            "--benchmark-json",
            str(results),
        ]
        run = subprocess.run([*command, "--benchmark-quiet", str(HERE)], check=False)
        if run.returncode:
            return run.returncode
        rows = json.loads(results.read_text())["benchmarks"]
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault(row["extra_info"]["group"], []).append(row)
    for group, members in groups.items():
        base = next((m for m in members if m["extra_info"]["name"] == FIRST.get(group)), members[0])
        print(f"\n{group:34} {'median [s]':>11} {'of first':>9}  {'value':>12}  notes")
        for row in members:
            info, time = row["extra_info"], row["stats"]["median"]
            notes = ", ".join(f"{k} {v:.3g}" for k, v in info.items() if k not in ("group", "name", "value"))
            ratio = time / base["stats"]["median"]
            print(f"  {info['name']:32} {time:11.4f} {ratio:9.4f}  {info['value']:12.6f}  {notes}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
