"""`make colours` on next to nothing: that it runs, and keeps the words around its table."""

from __future__ import annotations

from radiosity_baker.docs.colours.__main__ import BEGIN, END, document
from radiosity_baker.docs.colours.measure import Scale, measure

TINY = Scale(points=60, paths=4, triangles=300, error=0.1, passes=2, best_passes=2, samples=1, finer=2)


def test_a_scene_is_measured_and_its_row_renewed(tmp_path):
    """Seen to fail: the limits of a fit had come to be those of several sets of samples."""
    one = measure("white_room", TINY, tmp_path)
    assert one.finer_triangles > one.even_triangles > 0
    assert one.even.squared < 0.1
    text = document(f"before\n{BEGIN}| head |\n| --- |\n| white_room | old |\n{END}after\n", [one])
    assert text.startswith(f"before\n{BEGIN}| scene |")
    assert text.endswith(f"{END}after\n")
    assert text.count("white_room") == 1
    assert f"{one.triangles:,}" in text
