"""The report of a plan: all of it in one page, which a browser shows without a network."""

import html
import json
import re
import shutil
import subprocess

import pytest

import peakmin as pm
from peakmin.cli import main
from peakmin.view.report import page
from tests.view.test_pictures import arm_plan, limited, unmoved

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
MANEUVER = pm.Maneuver(
    start=pm.State(position=(0, 0)),
    goal=pm.State(position=(1, 0)),
    duration=1,
    obstacles=[pm.Wall(tip=(0.5, 0.5), contact="touch")],
)


def text_of(text, key):
    return html.unescape(re.search(rf'id="{key}"[^>]*>(.*?)<', text, re.S)[1])


def entries(text):
    """The table of the spec: values by path."""
    table = re.search(r'<table id="spec">(.*?)</table>', text, re.S)[1]
    rows = re.findall(r"<tr><th>(.*?)</th><td[^>]*>(.*?)</td></tr>", table)
    return {path: json.loads(html.unescape(value)) for path, value in rows}


def spec_of(text):
    """The spec that its table's rows make."""
    whole = {}
    for path, value in entries(text).items():
        *way, last = re.findall(r"[^.\[\]]+", path)
        here = whole
        for key in way:
            here = here.setdefault(key, {})
        here[last] = value
    whole["maneuver"]["obstacles"] = list(whole["maneuver"].get("obstacles", {}).values())
    return pm.Spec(**whole)


def test_the_page_says_what_the_plan_says():
    plan = pm.solve(MANEUVER)
    shown = page(plan, title="<a wall> & more")
    assert text_of(shown, "status") == "solved"
    assert float(text_of(shown, "peak")) == pytest.approx(plan.peak, rel=1e-8)
    assert float(text_of(shown, "lower_bound")) == pytest.approx(plan.lower_bound, rel=1e-8)
    assert spec_of(shown).maneuver == MANEUVER
    assert entries(shown)["maneuver.obstacles[0].tip"] == [0.5, 0.5]
    assert "verified" in shown
    assert "<a wall>" not in shown
    assert shown.count("<img") == 1
    assert not re.search(r'(src|href)="(?!data:)|url\(|@import|<script', shown)


def table_of(text, key):
    """The rows of a table by their first cell."""
    table = re.search(rf'<table id="{key}".*?>(.*?)</table>', text, re.S)[1]
    rows = re.findall(r"<tr><th>([^<]+)</th>(.*?)</tr>", table)
    return {name: re.findall(r"<td[^>]*>(.*?)</td>", cells) for name, cells in rows}


def test_the_page_has_what_joints_and_base_do_beside_their_limits():
    plan = limited(arm_plan())
    shown, found, may, (first, second) = page(plan), plan.extremes, plan.allowed, plan.maneuver.arm.links
    assert first.max_torque is None
    angles = [f"{low:.4g} to {high:.4g}" for low, high in zip(found.low, found.high, strict=True)]
    most = [[f"{getattr(found, name)[k]:.4g}" for name in ("speed", "acceleration", "torque")] for k in (0, 1)]
    default = [f"({may.acceleration[0]:.4g})", f"({may.torque[0]:.4g})"]
    given = [f"{getattr(second, name):.4g}" for name in ("max_speed", "max_acceleration", "max_torque")]
    cells = [[angles[0], "none"], [angles[1], "-3 to 0.5"]]
    cells[0] += [one for pair in zip(most[0], ["90", *default], strict=True) for one in pair]
    cells[1] += [one for pair in zip(most[1], given, strict=True) for one in pair]
    assert table_of(shown, "joints") == {"joint 1": cells[0], "joint 2": cells[1]}
    base = {"base force [N]": [f"{plan.peak_force:.4g}", "none"]}
    base["base moment [N m]"] = [f"{plan.peak_moment:.4g}", f"{plan.maneuver.max_moment:.4g}"]
    assert table_of(shown, "base") == base
    assert 'id="joints"' not in page(unmoved(plan))
    assert 'id="joints"' not in page(pm.solve(MANEUVER))


def test_the_page_says_why_not():
    plan = pm.solve(MANEUVER.model_copy(update={"max_peak": 5.0}))
    shown = page(plan)
    assert text_of(shown, "status") == "infeasible"
    assert "raise max_peak to" in text_of(shown, "explanation")


def test_the_page_says_what_is_wrong():
    plan = pm.solve(MANEUVER)
    object.__setattr__(plan, "lower_bound", 2 * plan.lower_bound)
    assert "not as stated: lower_bound" in html.unescape(page(plan))


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine: the page is not opened in a browser")
def test_a_browser_shows_the_page(tmp_path):
    spec, file, shot = tmp_path / "spec.json", tmp_path / "report.html", tmp_path / "report.png"
    spec.write_text(pm.Spec(maneuver=MANEUVER).to_json())
    with pytest.raises(SystemExit) as left:
        main(["solve", str(spec), "--report", str(file)])
    assert left.value.code == 0
    offline = ["--headless=new", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND"]
    run = [CHROMIUM, *offline, f"--user-data-dir={tmp_path / 'profile'}"]
    shown = subprocess.run([*run, "--dump-dom", file.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    assert float(text_of(shown.stdout, "peak")) == pytest.approx(pm.solve(MANEUVER).peak, rel=1e-8)
    size = "--window-size=1000,1800"
    subprocess.run([*run, size, f"--screenshot={shot}", file.as_uri()], capture_output=True, timeout=120, check=True)
    from matplotlib.image import imread

    pixels = imread(shot)
    assert pixels.shape[:2] == (1800, 1000)
    assert 0.01 < (pixels[..., :3].min(axis=-1) < 0.9).mean() < 0.9  # something is on it, and not all of it
