"""How harsh light is, against what chance says of a shadow's edge."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.contrast import contrast
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.scene import AreaLamp, Scene, SunLamp

#: Pairs that are looked at for one light, and how far apart they are in triangles that are half of all there is, by
#: which they are moved together, as if in one of 750 cells.
PAIRS, NEARER = 1024, np.sqrt(2 / 750)
#: Where shadows begin and end along x.
EDGES = np.linspace(-0.95, 0.95, 20)


def striped(build, *suns: float, slats: bool = True, scale: float = 1.0) -> tuple[Pilot, list]:
    """A floor, x and y from -1 to 1, under suns in the zenith, of which ten slats may hide half."""
    floor = build.quad("floor", (-scale, -scale, 0), (2 * scale, 0, 0), (0, 2 * scale, 0))
    above = [
        build.quad(f"slat {x}", (scale * x, -3 * scale, 1), (0.1 * scale, 0, 0), (0, 6 * scale, 0), receives=False)
        for x in EDGES[::2]
    ]
    lamps = tuple(SunLamp(f"sun {k}", (0, 0, -1), (sun,) * 3) for k, sun in enumerate(suns))
    pilot = Pilot(Scene((floor, *above) if slats else (floor,), (build.grey,), lamps))
    return pilot, [place(lamp, pilot.space) for lamp in lamps]


@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_a_shadow_edge_counts_as_often_as_it_parts_two_points(build, scale):
    """In one of the floor's triangles x has the density (1 + x) / 2. A point is moved NEARER times as far as another is
    away, so it crosses an edge at c with the chance of the density at c, times that and the mean of |x - c|; in the
    other triangle too, since the edges lie evenly. Light is 1 or 0, and 1/2 in the mean."""
    x = (np.arange(2000) + 0.5) / 1000 - 1
    chance = sum((1 + c) / 2 * NEARER * np.mean((1 + x) * np.abs(x - c)) for c in EDGES)
    seen = contrast(*striped(build, 1.0, scale=scale), 16, 0.0)
    doubt = 4 * np.sqrt(chance * (1 - chance) / PAIRS)
    assert seen.crossed == pytest.approx(chance, abs=doubt)
    # The mean is of twice as many points.
    assert (seen.light / 2) ** 2 == pytest.approx(chance / 2, abs=doubt / 2, rel=4 * 2 / np.sqrt(2 * PAIRS))


def test_it_is_relative_to_all_light(build):
    """Whatever the power, and half as much beside as much other light, or that of a sun which nothing hides."""
    one = contrast(*striped(build, 1.0), 16, 0.0)
    assert contrast(*striped(build, 7.0), 16, 0.0).light == pytest.approx(one.light)
    mean = 0.5
    beside = contrast(*striped(build, 1.0), 16, mean)
    assert beside.light == pytest.approx(one.light / 2, rel=0.1)
    assert beside.crossed == one.crossed


def test_even_light_and_darkness_have_none(build):
    assert contrast(*striped(build, 1.0, slats=False), 16, 0.0).light == pytest.approx(0.0, abs=1e-6)
    assert contrast(*striped(build), 16, 0.0).light == 0.0
    assert contrast(*striped(build, 1.0, slats=False), 16, 0.0).crossed == 0.0


def test_noise_is_no_contrast_whatever_its_colour(build):
    """Under a lamp with size, of which slats hide parts: as much light in one channel as in all of them."""
    seen = []
    for power in ((10.0,) * 3, (30.0, 0.0, 0.0)):
        pilot, _ = striped(build)
        lamp = AreaLamp("lamp", (0, 0, 2), (0.4, 0, 0), (0, 0.4, 0), (0, 0, -1), power)
        seen.append(contrast(pilot, [place(lamp, pilot.space)], 16, 0.0).light)
    assert seen[0] > 0.0
    assert seen[1] == pytest.approx(seen[0])
