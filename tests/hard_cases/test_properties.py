"""What must hold for any scene, tried on random ones: bodies that touch, nest, cross, are mirrored, flat, broken, tiny,
huge or far away, with any surfaces and lights. `make test` tries 200 of them, `make fuzz` thousands.

What the fuzzer found is fixed, and kept as a case of its own in test_catalogue or beside the code that was wrong.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from radiosity_baker.core import bake as baking
from radiosity_baker.core import effects
from radiosity_baker.core.check import check_scene
from radiosity_baker.core.cost import Machine
from radiosity_baker.core.direct import emitters
from radiosity_baker.core.direct.emitters import emitting_panels
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.effects import goes_on
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import make_patches, split_objects, triangle_geometry, unit_space
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import ALBEDO_LIMIT, AreaLamp, PointLamp, Scene, SceneObject, SpotLamp, SunLamp, Surface
from radiosity_baker.core.settings import LAYERS, VIEWS, Settings
from radiosity_baker.core.shapes import box, quad, sphere, triangles
from radiosity_baker.core.sky import Sky
from radiosity_baker.core.solver import solve
from radiosity_baker.core.transport import estimate_exchange, fill_with_light
from radiosity_baker.core.visibility import Visibility

#: How many times as many scenes `make fuzz` tries.
FUZZ_FACTOR = 25
#: Relative spacing of single precision.
SINGLE = 2.0**-23


# ---- Random scenes -------------------------------------------------------------------------------------------------

#: On a coarse grid bodies touch, coincide and nest often.
grid = st.integers(-4, 4).map(lambda k: k / 4)
sizes = st.sampled_from([0.25, 0.5, 1.0, 1.5])
points = st.tuples(grid, grid, grid)
shares = st.sampled_from([0.0, 0.2, 0.5, 0.9, 0.999, 1.0])
shine = st.sampled_from([0.0, 0.0, 0.0, 1.0, 1e6])
glow = st.just((0.0, 0.0, 0.0)) | st.just((0.0, 0.0, 0.0)) | st.tuples(shine, shine, shine)
power = st.sampled_from([0.0, 1.0, 100.0])
#: What rays go on from, one kind at a time or two together; most surfaces have nothing of it.
optics = st.just({}) | st.dictionaries(
    st.sampled_from(["transmission", "mirror", "glass", "transparent"]), st.tuples(shares, shares, shares), max_size=2
)


@st.composite
def bodies(draw, name):
    kind = draw(st.sampled_from(["box", "quad", "ball", "tetrahedron", "soup", "needle", "broken"]))
    surface = draw(st.integers(0, 2))
    size = draw(st.tuples(sizes, sizes, sizes))
    low = np.array(draw(points))
    match kind:
        case "box":
            body = box(name, (0, 0, 0), size, surface, inward=draw(st.booleans()))
        case "quad":
            body = quad(name, (0, 0, 0), (size[0], 0, 0), (0, size[1], 0), surface)
        case "ball":
            body = sphere(name, size[0] / 2, 1, surface, smooth=draw(st.booleans()))
        case "tetrahedron":
            faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
            body = triangles(name, [(0, 0, 0), (size[0], 0, 0), (0, size[1], 0), (0, 0, size[2])], faces, surface)
        case "soup":
            count = draw(st.integers(1, 5))
            corners = np.array(draw(st.lists(points, min_size=3 * count, max_size=3 * count)), float)
            body = triangles(name, corners, np.arange(3 * count).reshape(-1, 3), surface)
        case "needle":
            thin = draw(st.sampled_from([1e-3, 1e-6]))
            body = triangles(name, [(0, 0, 0), (1, 0, 0), (1, thin, 0), (0, 1, 0)], [[0, 1, 2], [0, 2, 3]], surface)
        case "broken":
            faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [2, 1, 0], [0, 1, 2]]
            body = triangles(name, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (9, 9, 9)], faces, surface)
    linear = np.diag([draw(st.sampled_from([1.0, 1.0, -1.0])), 1.0, 1.0])
    if draw(st.booleans()):
        linear = turn(draw(st.integers(1, 7)) * 0.4) @ linear
    return replace(body, vertices=body.vertices @ linear.T + low, corner_normals=turned_normals(body, linear))


def turned_normals(body: SceneObject, linear: np.ndarray) -> np.ndarray | None:
    return None if body.corner_normals is None else (body.corner_normals @ linear.T).astype(np.float32)


def turn(angle: float) -> np.ndarray:
    """About an axis that is no axis of the coordinates."""
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@st.composite
def lamps(draw, name):
    color = draw(st.tuples(power, power, power))
    position = draw(points)
    axes = tuple(map(tuple, turn(draw(st.integers(0, 15)) * 0.4)))
    radius = draw(st.sampled_from([0.0, 0.0, 1e-3, 0.3]))
    down = tuple(-np.array(axes[2]))
    match draw(st.sampled_from(["point", "sun", "spot", "area"])):
        case "point":
            return PointLamp(name, position, color, radius, draw(st.booleans()))
        case "sun":
            return SunLamp(name, down, color, draw(st.sampled_from([0.0, 0.01, 1.0])))
        case "spot":
            cone = draw(st.sampled_from([0.01, 0.8, np.pi]))
            return SpotLamp(name, position, color, axes, cone, draw(st.sampled_from([0.0, 0.5, 1.0])), radius)
        case "area":
            half = [tuple(draw(sizes) * np.array(axis)) for axis in axes[:2]]
            shape = draw(st.sampled_from(["rectangle", "ellipse"]))
            spread = draw(st.sampled_from([np.pi, 1.0]))
            return AreaLamp(name, position, half[0], half[1], down, color, shape, spread)


@st.composite
def surfaces_of(draw, name):
    more = draw(optics)
    opacity = draw(st.sampled_from([0.0, 0.5, 0.5, 1.0])) if "transparent" in more else 1.0
    rough = draw(st.sampled_from([0.0, 0.3])) if "mirror" in more else 0.0
    ior = draw(st.sampled_from([1.0, 1.5])) if "glass" in more else 1.0
    albedo = draw(st.tuples(shares, shares, shares))
    return Surface(name, albedo, draw(glow), opacity=opacity, roughness=rough, ior=ior, **more)


@st.composite
def scenes(draw, fewest_lamps=0):
    objects = tuple(draw(bodies(f"body {k}")) for k in range(draw(st.integers(1, 4))))
    surfaces = tuple(draw(surfaces_of(f"surface {k}")) for k in range(3))
    lights = tuple(draw(lamps(f"lamp {k}")) for k in range(draw(st.integers(fewest_lamps, 3))))
    if draw(st.booleans()):  # around all the rest, closed
        objects = (*objects, box("room", (-9, -9, -9), (9, 9, 9), 0, inward=draw(st.booleans())))
    sky = draw(st.sampled_from([(0.0, 0.0, 0.0), (1.0, 2.0, 3.0)]))
    scene = Scene(objects, surfaces, lights, sky)
    assume(any(triangle_geometry(o.vertices[o.triangles])[1].sum() > 1e-9 for o in objects))  # the rest is refused
    scale = draw(st.sampled_from([1.0, 1.0, 1e-4, 1e-3, 1e3, 1e5]))
    away = draw(st.sampled_from([0.0, 0.0, 1e3, 1e5])) * scale
    return moved(scene, scale * np.eye(3), away * np.array([1.0, -0.7, 0.4]))


def moved(scene: Scene, linear: np.ndarray, offset: np.ndarray) -> Scene:
    """The scene under a turn, a mirror and a uniform scale, with lamps of the same radiance: it looks the same."""
    scale = abs(np.linalg.det(linear)) ** (1 / 3)

    def way(vector):
        return tuple(linear @ np.array(vector))

    def there(point):
        return tuple(linear @ np.array(point) + offset)

    def lamp_there(lamp):
        match lamp:
            case SunLamp():
                return replace(lamp, direction=tuple(np.array(way(lamp.direction)) / scale))
            case AreaLamp():
                normal = tuple(np.array(way(lamp.normal)) / scale)
                half_u, half_v = way(lamp.half_u), way(lamp.half_v)
                return replace(lamp, center=there(lamp.center), half_u=half_u, half_v=half_v, normal=normal)
        intensity = tuple(np.array(lamp.intensity) * scale**2)
        changes = {"position": there(lamp.position), "radius": lamp.radius * scale, "intensity": intensity}
        if isinstance(lamp, SpotLamp):
            changes["axes"] = tuple(tuple(np.array(way(axis)) / scale) for axis in lamp.axes)
        return replace(lamp, **changes)

    mirrored = np.linalg.det(linear) < 0

    def object_there(o):
        vertices = o.vertices @ linear.T + offset
        normals = turned_normals(o, linear / scale)
        order = [0, 2, 1] if mirrored else [0, 1, 2]
        return replace(
            o,
            vertices=vertices,
            triangles=o.triangles[:, order],
            corner_normals=None if normals is None else np.ascontiguousarray(normals[:, order]),
        )

    objects = tuple(map(object_there, scene.objects))
    return replace(scene, objects=objects, lamps=tuple(map(lamp_there, scene.lamps)))


# ---- What is asked of them -----------------------------------------------------------------------------------------

QUICK = Settings(triangles=30, error=None, threads=1, layers=tuple(LAYERS))


@pytest.fixture(scope="module", autouse=True)
def _quick():
    """No bake here wants to know how long it will take, and of more than eight triangles that shine none is a lamp of
    its own: what is asked of a hundred takes a hundred times as long, and tries nothing new."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (effects, emitters):
            patch.setattr(module, "MOST_PANELS", 8)
        patch.setattr(baking, "calibrate", lambda _, threads: Machine(1e-7, 1e-8, 1.0, threads))
        yield


def quick_bake(scene, **asked):
    """A bake of few patches, triangles and rays, solved to rounding."""
    effort = replace(
        choose_effort(scene, QUICK),
        patches=30, triangles=30, growth=0.3, transport_rays=16, gather_rays=8, shadow_rays=2, boundary_passes=2,
        tolerance=1e-9,
    )  # fmt: skip
    return baking.bake(scene, replace(QUICK, **asked), effort=effort)


def layers_of(result) -> dict[str, np.ndarray]:
    return {name: np.concatenate([o.layers[name].reshape(-1, 3) for o in result.objects]) for name in LAYERS}


def tries(count: int):
    """So many scenes in `make test`, always the same; many times as many, and new ones, with the profile `fuzz`."""
    fuzz = settings.default is settings.get_profile("fuzz")
    asked = settings(
        max_examples=count * (FUZZ_FACTOR if fuzz else 1),
        derandomize=not fuzz,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        database=None,
        phases=(Phase.generate, Phase.shrink) if fuzz else (Phase.generate,),
    )

    def decorate(test):
        test = asked(test)
        test.scenes = asked.max_examples
        return test

    return decorate


@pytest.fixture(autouse=True)
def _told(request, record_property):
    record_property("injected", f"{request.function.scenes} scenes")


class Stages:
    """The stages up to the exchange of light, once for all light that is sent through it."""

    def __init__(self, scene: Scene, estimator: str = "hemisphere") -> None:
        self.scene = check_scene(scene)
        self.space = unit_space(self.scene)
        self.patches = make_patches(self.scene, self.space, split_objects(self.scene, 40))
        assume(self.patches.coverage is None or self.patches.coverage.any())  # or nothing is exchanged
        self.visibility = Visibility(self.patches.corners, self.patches.optics)
        estimator = "hemisphere" if goes_on(scene) else estimator
        self.effort = replace(
            choose_effort(scene, QUICK), estimator=estimator, transport_rays=32, tolerance=1e-9, threshold=0.0
        )
        self.sky = Sky.of(scene.sky).in_colour(self.patches.coloured)
        self.workers = Workers(1, Progress())
        self.exchange = estimate_exchange(self.patches, self.visibility, self.effort, self.workers, 0, "fuzz", self.sky)

    def solved(self, lamps, panels=(), sky=None):
        """The solution for some lamps, emitting panels and the sky alone."""
        lights = [*(place(lamp, self.space) for lamp in lamps), *panels]
        light = DirectLight(lights, self.visibility, 0)
        return fill_with_light(
            replace(self.exchange, glints=None), light, sky, replace(self.effort, emitters_by_rays=False), self.workers,
            seed=0, purpose="fuzz",
        )  # fmt: skip

    def __enter__(self):
        self.workers.__enter__()
        return self

    def __exit__(self, *_):
        self.workers.__exit__()


@tries(120)
@given(scenes(), st.sampled_from(["hemisphere", "hemisphere", "analytic"]))
def test_light_is_neither_made_nor_lost(scene, estimator):
    """Reciprocity A_i F_ij = A_j F_ji to single precision; row sums, escape and loss at most 1 and, where a side sees
    anything, 1 together; irradiance finite, and no less than what arrives first; the ledger closes to 1e-6 of what is
    emitted. Catches exchange in one direction only, rows that sum to more than one, light into solids or out of closed
    ones, a solution that is none. Seen to fail: plain rows without the balance, a solve that stops at a thousandth."""
    with Stages(scene, estimator) as stages:
        sides, exchange = stages.exchange.sides, stages.exchange
        area = sides.area
        for rows, lost in zip(exchange.rows, exchange.lost.T, strict=True):
            dense = np.zeros((len(area), len(area)))
            np.add.at(dense, (rows.owners(), rows.columns), rows.weights)
            assert np.abs(dense - dense.T).max() <= SINGLE * dense.max(initial=0)
            assert (dense >= 0).all()
            openings = exchange.opening.share.reshape(len(area), -1)
            for escape in openings.T[: 1 if len(exchange.rows) == 1 else 3]:
                sums = dense.sum(axis=1) / area + escape + lost
                assert len(exchange.rows) > 1 or np.abs(sums - 1).max() <= 1e-5
        panels = emitting_panels(stages.scene, stages.space)
        transport = stages.solved(stages.scene.lamps, panels, stages.sky)
        light = transport.solution.irradiance
        assert np.isfinite(light).all()
        dark = (transport.incoming < 0).any(axis=0)  # by noise
        assert (light >= transport.incoming * (1 - 1e-6))[:, ~dark].all()
        ledger = transport.energy()
        allowed = 1e-6 * max(map(abs, ledger.values()))
        if stages.patches.transmission is not None:  # Its solver leaves as much all over, relative to the brightest.
            square_metres = area.sum() * stages.space.metres**2
            allowed += transport.solution.bound * light.max(axis=0).mean() * square_metres
        assert abs(ledger["residual"]) <= allowed, ledger


def without_size(lamp):
    """The lamp as one that needs no random numbers, so that those of others are the same without it."""
    match lamp:
        case SunLamp():
            return replace(lamp, angle=0.0)
        case AreaLamp():
            return PointLamp(lamp.name, lamp.center, lamp.radiance)
    return replace(lamp, radius=0.0)


@tries(30)
@given(scenes(), st.sampled_from(["hemisphere", "analytic"]))
def test_the_light_of_all_lamps_is_the_sum_of_the_light_of_each(scene, estimator):
    """On every side, to the tolerance of as many solutions, with the same rays and one seed; and whiter surfaces are
    nowhere darker. Catches a solution that depends on anything but the sources, linearly. Seen to fail: a clip of
    negative light in between."""
    with Stages(scene, estimator) as stages:
        lamps = [without_size(lamp) for lamp in stages.scene.lamps]
        alone = [stages.solved([lamp]) for lamp in lamps] + [stages.solved([], sky=stages.sky)]
        whole = stages.solved(lamps, sky=stages.sky).solution.irradiance
        off = np.abs(whole - sum(part.solution.irradiance for part in alone)).max()
        # A lamp a ten-millionth as bright as another is not asked at all.
        assert off <= (1e-9 * (len(alone) + 1) + 1e-7 * len(alone) / (1 - ALBEDO_LIMIT)) * whole.max()
        if stages.patches.transmission is None and len(stages.exchange.rows) == 1:
            darker = stages.patches
            albedo = darker.albedo
            half = solve(
                stages.exchange.rows[0], stages.exchange.sides.area,
                0.9 * stages.exchange.sides.albedo.astype(float), alone[0].incoming, 1e-9,
            )  # fmt: skip
            assert (half.irradiance <= alone[0].solution.irradiance + 2e-9 * whole.max()).all(), albedo


@tries(15)
@given(scenes(), st.booleans())
def test_what_is_baked_can_be_shown(scene, tessellate):
    """All layers are finite and not negative, and the same bytes with 1 and 2 threads, whatever the order of objects
    and lamps. Seen to fail: limits of the fit below zero, conjugate gradients that go on where nothing is left."""
    first = quick_bake(scene, tessellate=tessellate)
    one = layers_of(first)
    for name, values in one.items():
        assert np.isfinite(values).all(), name
        assert values.min(initial=0) >= 0, name
    if not any(max(surface.transmission) > 0 for surface in scene.surfaces):
        ledger = first.report.energy
        assert abs(ledger["residual"]) <= 1e-6 * max(map(abs, ledger.values())), ledger
    turned = replace(scene, objects=scene.objects[::-1], lamps=scene.lamps[::-1])
    two = layers_of(quick_bake(turned, threads=2, tessellate=tessellate))
    assert all(values.tobytes() == two[name].tobytes() for name, values in one.items())


def brighter(scene: Scene, factor: float) -> Scene:
    """Everything that shines, factor times as bright."""

    def more(color):
        return tuple(factor * channel for channel in color)

    def lamp_more(lamp):
        name = {SunLamp: "irradiance", AreaLamp: "radiance"}.get(type(lamp), "intensity")
        return replace(lamp, **{name: more(getattr(lamp, name))})

    surfaces = tuple(replace(s, emission=more(s.emission)) for s in scene.surfaces)
    return replace(scene, lamps=tuple(map(lamp_more, scene.lamps)), surfaces=surfaces, sky=more(scene.sky))


@tries(10)
@given(scenes(), st.sampled_from([2.0**-10, 4.0, 2.0**20]))
def test_twice_the_light_is_twice_as_bright(scene, factor):
    """Exactly, since every decision of a bake is relative and a power of two rounds nothing. Seen to fail: conjugate
    gradients that go on where nothing is left."""
    dim, bright = layers_of(quick_bake(scene)), layers_of(quick_bake(brighter(scene, factor)))
    for name, values in dim.items():
        scaled = values if name in VIEWS else values * np.float32(factor)
        assert scaled.tobytes() == bright[name].tobytes(), name


#: As many bakes, with seeds of their own, judge what one states by chance.
SEEDS = range(1, 9)


def mean_and_error(scene, **asked) -> tuple[float, float]:
    """Mean radiance over the surface, and the error that the bake states of it, both W/(m^2 sr)."""
    result = quick_bake(scene, **asked)
    area = np.concatenate([triangle_geometry(o.vertices[o.triangles])[1] for o in result.objects])
    light = np.concatenate([o.layers["combined"].astype(float).mean(axis=(1, 2)) for o in result.objects])
    mean = float(area @ light / area.sum())
    return mean, result.report.estimated_error["total"] * mean


def over_seeds(scene) -> tuple[float, float]:
    """Mean radiance, and root mean square of the error stated, of bakes with other seeds."""
    means, errors = np.transpose([mean_and_error(scene, seed=seed) for seed in SEEDS])
    return float(means.mean()), float(np.sqrt(np.mean(errors**2)))


def split(scene: Scene) -> Scene:
    """Every triangle in two, from its first corner to the middle of the side across."""

    def halves(o):
        a, b, c = o.triangles.T
        middle = len(o.vertices) + np.arange(len(a), dtype=np.int32)
        vertices = np.concatenate([o.vertices, (o.vertices[b] + o.vertices[c]) / 2])
        faces = np.concatenate([np.stack([a, b, middle], axis=1), np.stack([a, middle, c], axis=1)])
        return SceneObject(o.name, vertices, faces, np.tile(o.surface, 2))

    return replace(scene, objects=tuple(map(halves, scene.objects)))


CHANGES = {
    "turned": lambda scene: moved(scene, turn(0.7), np.zeros(3)),
    "mirrored": lambda scene: moved(scene, np.diag([-1.0, 1.0, 1.0]), np.zeros(3)),
    "moved": lambda scene: moved(scene, np.eye(3), 10 * np.ptp(scene.objects[0].vertices)),
    "larger": lambda scene: moved(scene, 3.0 * np.eye(3), np.zeros(3)),
    "split": split,
}


def dull(scene: Scene) -> Scene:
    """The scene with surfaces that reflect half at most."""
    surfaces = tuple(replace(s, albedo=tuple(min(c, 0.5) for c in s.albedo)) for s in scene.surfaces)
    return replace(scene, surfaces=surfaces)


@tries(10)
@given(scenes(fewest_lamps=2))
def test_the_bake_of_all_lamps_is_the_sum_of_the_bakes_of_each(scene):
    """The whole way, on the meshes as they are: the mean light within twice what the bakes state as their errors. Not
    exactly, as between patches: lamps with size share one stream of random numbers, and patches, smoothing and the
    limits that keep every vertex within its samples are those of all the light there is. Seen to fail: all lamps
    but the first left out."""
    scene = dull(scene)
    black = tuple(replace(s, emission=(0.0, 0.0, 0.0)) for s in scene.surfaces)
    alone = [replace(scene, lamps=(lamp,), surfaces=black, sky=(0.0, 0.0, 0.0)) for lamp in scene.lamps]
    whole, off = mean_and_error(scene, tessellate=False)
    parts = [mean_and_error(part, tessellate=False) for part in (*alone, replace(scene, lamps=()))]
    total = sum(mean for mean, _ in parts)
    assert abs(whole - total) <= 2 * (off + sum(error for _, error in parts)) + 1e-6 * whole


@tries(15)
@given(scenes(), st.sampled_from(sorted(CHANGES)))
def test_nothing_depends_on_where_or_how_the_scene_is_given(scene, change):
    """The mean light is the same, within twice what both bakes state as their errors: statements from so few samples.
    Catches axes that are special, lost mirror images, and sizes in metres that decide something.

    Surfaces reflect half at most. What all patches of a room share, such as how much of it a few rays say is black,
    counts 1 / (1 - p) times, and only two solutions tell how far it is off: by chance they may agree. What is stated is
    right as a mean square, not each time: a difference of two halves over a handful of triangles has hardly more than
    one degree of freedom, and is four times too small once in six (Student's t). So where one bake states too little,
    eight others of each scene decide: as sure of the mean square as of 8 degrees of freedom at least, with noise in the
    mean of means a third as large, while what is special, lost or decided by metres is off each time."""
    flat = tuple(replace(o, corner_normals=None) for o in scene.objects)
    given = dull(replace(scene, objects=flat))
    changed = CHANGES[change](given)
    for judge in (mean_and_error, over_seeds):
        (one, one_off), (two, two_off) = judge(given), judge(changed)
        if abs(one - two) <= 2 * (one_off + two_off) + 1e-3 * max(one, two):
            return
    raise AssertionError(f"{change}: {one} (stated {one_off}) and {two} (stated {two_off}) in the mean of many bakes")


@tries(10)
@given(scenes(), st.booleans())
def test_a_closed_room_sees_no_sky(scene, inward):
    """Catches cracks and leaks: rays that start behind their wall, seams that are not tight, and lost hits."""
    corners = np.concatenate([o.vertices[o.triangles].reshape(-1, 3) for o in scene.objects])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.1 * (high - low).max() + 1e-9
    opaque = tuple(Surface(s.name, s.albedo) for s in scene.surfaces)
    walls = box("walls", tuple(low - margin), tuple(high + margin), 0, inward=inward, receives=False)
    closed = Scene((*scene.objects, walls), opaque, (), (1e6, 1e6, 1e6))
    assert layers_of(quick_bake(closed))["combined"].max() == 0
