import pytest

from peakmin import paper
from peakmin.view import style
from tests.solved import once, solved


@pytest.fixture(scope="module")
def computed():
    return once("paper", paper.compute)


def test_table_1_comes_out_to_all_four_decimals(computed):
    assert [f"{row.peak:.4f}" for row in computed.rows] == ["10.4224", "9.0234", "8.7964", "8.7671", "8.7451"]
    assert [f"{row.obstacle_time:.4f}" for row in computed.rows] == ["0.5235"] * 5
    assert computed.agrees
    assert [row.compilations for row in computed.rows] == [1] * 5


def test_the_minimum_on_the_same_grid(computed):
    assert [row.minimum for row in computed.rows] == pytest.approx([10.4210, 9.0169, 8.7913, 8.7609, 8.7444], abs=6e-5)


def test_squared_differences_fall_but_not_to_zero(computed):
    assert computed.differences.shape == (4, 2)
    assert (computed.differences[1:] < computed.differences[:-1]).all()
    assert (computed.differences[-1] > 50).all()


def test_a_digit_that_differs_is_reported(computed):
    wrong = paper.Row(1, 10.4225, 0.52353, 10.4224, 0.5235, 10.42, 1)
    changed = paper.Paper([wrong], computed.least, computed.differences, computed.disc, computed.two_link)
    assert not changed.agrees
    assert "DIFFERS" in paper.text(changed)
    assert "+0.0001" in paper.text(changed)


def test_figures_are_png_files(computed, tmp_path, monkeypatch):
    monkeypatch.setattr(paper, "solve", solved)
    monkeypatch.setattr(style, "DPI", 40)
    files = paper.figures(computed, tmp_path)
    assert {f.name.split("_")[1] for f in files} == {f"{k:02}" for k in range(1, 12)}
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in files)
