"""Light that arrives straight from lamps and emitting surfaces, with soft shadows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..sampling import GOLDEN, stream
from ..scene import Bool, Float32, Float64
from ..visibility import OFFSET, Visibility, offset_along
from .crowd import Crowd
from .emitter_tree import EmitterTree
from .lamps import Light, Ways

#: A light this far under the brightest one at a point, relatively, is not worth a shadow ray there.
_NEGLIGIBLE = 1e-7
#: Places on the rim of a disc, and at the corners of a rectangle or a triangle.
_RIM = np.array([[0.98, 0.98, 0.98, 0.98], [0.0, 0.25, 0.5, 0.75]], dtype=np.float32)
_CORNERS = np.array([[0.01, 0.99, 0.99, 0.01], [0.01, 0.01, 0.99, 0.99]], dtype=np.float32)
#: Where a lamp shines unevenly, so many places on it tell each half of the rays what it would bring with nothing in the
#: way. None of them takes a ray.
_PLACES = 16
#: Of more lights than this, each half of the rays asks at most so many at a point. Noise falls much faster with this
#: number than time grows, up to about here: then rays cost more than the closed forms of all lights.
MOST_ASKED = 24
#: The shadows of more lights than this are each too faint to be worth a contour.
MOST_CONTOURED = 16


@dataclass(frozen=True, eq=False)
class Illumination:
    """irradiance (n, 3) W/m^2 and its variance (n, 3), or more channels where some lights are told apart; signature
    (n,) int64: equal numbers see the same lights whole, and -1 sees some light in part; reached (n,): some way to a
    light was free, which is surer than an irradiance that may be there by chance; rays cast, by purpose."""

    irradiance: Float64
    variance: Float64
    signature: np.ndarray
    reached: Bool
    rays: Counter[str]

    @property
    def grey(self) -> Float64:
        """(n,) mean over red, green and blue."""
        return np.asarray(self.irradiance.sum(axis=1) / 3.0)

    def only(self, chosen: NDArray[np.int64]) -> Illumination:
        """At some of the points; of rays all are counted."""
        return Illumination(
            self.irradiance[chosen],
            self.variance[chosen],
            self.signature[chosen],
            self.reached[chosen],
            self.rays,
        )

    def beside(self, other: Illumination) -> Illumination:
        """Both, told apart by their channels."""
        partly = (self.signature < 0) | (other.signature < 0)
        return Illumination(
            np.concatenate([self.irradiance, other.irradiance], axis=1),
            np.concatenate([self.variance, other.variance], axis=1),
            np.where(partly, -1, self.signature + other.signature),
            self.reached | other.reached,
            self.rays + other.rays,
        )


@dataclass(frozen=True, eq=False)
class _Receivers:
    """Points where light is asked for: along (3, 3, n), points, normals and shading normals, components first; origins
    (n, 3) of rays."""

    along: Float32
    origins: Float32

    @classmethod
    def of(cls, points: Float64, normals: Float64, shading: Float64) -> _Receivers:
        along = np.stack([points.T, normals.T, shading.T]).astype(np.float32)
        return cls(along, offset_along(points, normals))

    def only(self, chosen: NDArray[np.int64]) -> _Receivers:
        return _Receivers(self.along[:, :, chosen], self.origins[chosen])

    def ways(self, towards: Float32, sample: NDArray[np.int64], point: NDArray[np.int64]) -> tuple[Float32, Float32]:
        """Origins and ways (k, 3) of shadow rays along some samples of what lies (3, r, n) towards the light.

        Rays start a hair off the surface, and must not end as much beyond their targets: a lamp that is a surface would
        be in its own way.
        """
        ways = towards[:, sample, point] - np.float32(OFFSET) * self.along[1][:, point]
        # A lamp whose size is a number of numpy's would make them double, from numpy 2 on.
        return self.origins[point], np.ascontiguousarray(ways.T, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class _Look:
    """What ways (r, n) to a light bring: weights, were it even; what it sends along them (k, r, n), of which so much
    arrived (k', r, n) and passed occluders and veils, in one for all channels or in each; free of occluders; clear of
    veils too; rays cast, by purpose."""

    weights: Float32
    sent: Float32
    arrived: Float32
    passed: Bool | Float32
    free: Bool
    clear: Bool
    rays: Counter[str]


@dataclass(frozen=True, eq=False)
class _Answer:
    """How much of a light receivers (n,) see: seen (h, n, 1), or (h, n, 3) in each channel, by each half of the ways;
    which see it whole, and which in part, and which it has reached; rays cast, by purpose."""

    seen: Float64
    whole: Bool
    partly: Bool
    reached: Bool
    rays: Counter[str]


Source = Light | EmitterTree


class DirectLight:
    """All sources that are sampled as lights, and the occluders between. asked: how many of more than MOST_ASKED lights
    each half of the rays asks at a point."""

    def __init__(self, sources: Sequence[Source], visibility: Visibility, seed: int, asked: int = MOST_ASKED) -> None:
        self.lights = lights = [source for source in sources if not isinstance(source, EmitterTree)]
        self._trees = [source for source in sources if isinstance(source, EmitterTree)]
        self._crowd = Crowd(lights) if len(lights) > MOST_ASKED else None
        self._asked, self._seed = asked, seed
        self.visibility = visibility
        # A random bit pattern for each light: the sum over the lights seen names their set.
        self._names = stream(seed, "light names").integers(1, 2**40, size=len(lights))

    def only(self, sources: Sequence[Source]) -> DirectLight:
        """What these of the sources bring."""
        return DirectLight(sources, self.visibility, self._seed, self._asked)

    def at(
        self, points: Float64, normals: Float64, shading: Float64, rays: int, rng: np.random.Generator
    ) -> Illumination:
        """At points (n, 3) with geometric and shading normals (n, 3), `rays` shadow rays to each sized light."""
        tally = _Tally(_Receivers.of(points, normals, shading))
        if self._crowd is not None:
            self._ask_some(self._crowd, tally, points, shading, rays, rng)
        else:
            for light, name in zip(self.lights, self._names, strict=True):
                share = light.share(points, shading)
                brightest = tally.irradiance.max(axis=1, initial=0.0)
                lit = np.flatnonzero(share * light.color.max() > _NEGLIGIBLE * brightest)
                if len(lit):
                    answer = self._ask(light, tally.receivers.only(lit), share[lit], rays, rng)
                    tally.add(lit, answer, light.color, name)
        for tree in self._trees:
            self._shoot(tally, tree, rays, rng)
        return tally.illumination()

    def shadows(
        self, points: Float64, normals: Float64, asked: NDArray[np.int64] | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
        """Lights of which some is hidden from each point (n, 3) by something else than the surface itself, with normals
        (n, 3), and lights that are hidden as a whole: two numbers (n,), a bit for each light; and the rays it took.
        What shines through veils is not hidden. asked (n,): bits of the lights to ask there, None for all."""
        receivers = _Receivers.of(points, normals, normals)
        some, whole = np.zeros((2, len(points)), dtype=np.int64)
        rays = 0
        for number, light in enumerate(self.lights):
            ask = np.arange(len(points)) if asked is None else np.flatnonzero(asked >> number & 1)
            if not light.casts_shadow or not len(ask):
                continue
            own = receivers.only(ask)
            ways, gain = _at_rim(light, own.along[0])
            lit = (ways.solid if gain is None else ways.solid * gain.reshape(-1, *ways.solid.shape).max(axis=0)) > 0
            lit &= (ways.towards * own.along[1][:, None]).sum(axis=0) > 0
            hidden = np.zeros(lit.shape, dtype=bool)
            hidden[lit] = ~self.visibility.unblocked_along(*own.ways(ways.towards, *np.nonzero(lit)))
            some[ask] |= hidden.any(axis=0).astype(np.int64) << number
            whole[ask] |= (lit.any(axis=0) & (hidden | ~lit).all(axis=0)).astype(np.int64) << number
            rays += int(lit.sum())
        return some, whole, rays

    def _ask(self, light: Light, receivers: _Receivers, share: Float64, rays: int, rng: np.random.Generator) -> _Answer:
        """What a light of the share (n,) brings to all receivers, or one light to each."""
        # Two independent halves of the ways: how much they differ is how far their mean can be trusted.
        halves, per_half = (2, max(1, rays // 2)) if light.sized else (1, 1)
        look = self._look(light, receivers, _lattices(halves, per_half, len(share), rng))
        arrived = _means(look.arrived, halves)
        expected, weights = (np.broadcast_to(v, arrived.shape) for v in (share, _means(look.weights, halves)))
        uneven = _unevenly_lit(light, receivers)
        if len(uneven):
            expected, weights = expected.copy(), weights.copy()
            places = _lattices(halves, _PLACES, len(uneven), rng)
            sent = _share_sent(light.only(uneven), receivers.only(uneven), places, halves)
            expected[:, :, uneven] = share[uneven] * sent
            weights[:, :, uneven] = _means(look.sent, halves)[:, :, uneven]
        # (halves, n, 1), or one for each channel.
        seen = np.stack([_seen(*channel) for channel in zip(expected, weights, arrived, strict=True)], axis=2)
        whole = look.clear.all(axis=0)
        reached = (look.arrived > 0).any(axis=(0, 1))
        return _Answer(seen, whole, look.free.any(axis=0) & ~whole, reached, look.rays)

    def _ask_some(
        self, crowd: Crowd, tally: _Tally, points: Float64, shading: Float64, rays: int, rng: np.random.Generator
    ) -> None:
        """Add what all lights bring: the brightest at a point one by one, the others by some of them.

        Each half of the rays draws lights of its own, one ray to each. As with a single light, what the drawn ones
        would bring with nothing in the way is corrected by what all would bring.
        """
        sure, drawn, rest = crowd.choose(points, shading, self._asked, rng)
        count = len(points)
        for light, some in crowd.alike(sure):
            answer = self._ask(light, tally.receivers.only(some.point), some.share, rays, rng)
            brought = answer.seen * some.color
            tally.irradiance += _summed(brought.mean(axis=0), some.point, count)
            if len(brought) == 2:
                tally.variance += _summed((brought[0] - brought[1]) ** 2 / 4.0, some.point, count)
            # Which lights are sure changes from point to point; where shadows begin, those that are hidden do.
            hidden = ~answer.whole & ~answer.partly
            np.add.at(tally.signature, some.point[hidden], self._names[some.light[hidden]])
            tally.partly[some.point[answer.partly]] = True
            tally.reached[some.point[answer.reached]] = True
            tally.rays += answer.rays
        arrived, expected = np.zeros((2, 2 * count, 3))
        free, clear, asked = np.zeros((3, count))
        for light, some in crowd.alike(drawn):
            look = self._look(light, tally.receivers.only(some.point), _lattices(1, 1, len(some.point), rng))
            # A way without size brings exactly the share, however its length was rounded.
            whole = look.weights.mean(axis=0) if light.sized else some.share
            part = look.arrived.mean(axis=1) if light.sized else whole * look.passed[:, 0]
            tally.reached[some.point[(part > 0).any(axis=0)]] = True
            place = some.half * count + some.point
            expected += _summed(whole[:, None] * some.color, place, 2 * count)
            arrived += _summed(part.T * some.color, place, 2 * count)
            free += np.bincount(some.point, look.free[0], count)
            clear += np.bincount(some.point, look.clear[0], count)
            asked += np.bincount(some.point, minlength=count)
            tally.rays += look.rays
        seen = _seen_in_all(rest, expected.reshape(2, count, 3), arrived.reshape(2, count, 3))
        tally.irradiance += seen.mean(axis=0)
        tally.variance += (seen[0] - seen[1]) ** 2 / 4.0
        tally.partly |= (free > 0) & (clear < asked)

    def _shoot(self, tally: _Tally, tree: EmitterTree, rays: int, rng: np.random.Generator) -> None:
        """Add what some of many emitting triangles bring, with twice the rays of one light."""
        points, normals, shading = tally.receivers.along
        count = points.shape[1]
        unit = _lattices(2, rays, count, rng)
        choice = (np.arange(rays, dtype=np.float32)[:, None] + rng.random((2, rays, count), dtype=np.float32)) / rays
        choice = np.minimum(choice, np.float32(1 - 1e-7)).reshape(1, 2 * rays, count)
        shots = tree.shoot(points, shading, np.concatenate([choice, unit]))
        bright = (shots.brings.max(axis=0) > 0) & ((shots.towards * normals[:, None]).sum(axis=0) > 0)
        sample, point = np.nonzero(bright)
        passed = np.zeros((3, *bright.shape), dtype=np.float32)
        free, tint, cast = self._trace(tally.receivers, shots.towards, sample, point)
        passed[:, sample, point] = free if tint is None else tint
        arrived = shots.brings * passed
        tally.reached |= (arrived > 0).any(axis=(0, 1))
        seen = _means(arrived, 2).transpose(1, 2, 0).astype(np.float64)
        tally.irradiance += seen.mean(axis=0)
        tally.variance += (seen[0] - seen[1]) ** 2 / 4.0
        tally.partly |= (passed > 0).any(axis=(0, 1)) & (bright & (passed < 1)).any(axis=(0, 1))
        tally.rays += cast

    def _look(self, light: Light, receivers: _Receivers, unit: Float32) -> _Look:
        """Look along the ways to a light. Those that bring nothing count as free, for no ray is cast along them."""
        towards, weights, sent = _without_occluders(light, receivers, unit)
        free = sent.max(axis=0) == 0
        # What lies below the surface itself is blocked by it, whatever the shading normal says.
        normals = receivers.along[1]
        above = (towards * normals[:, None]).sum(axis=0) > 0
        if not light.casts_shadow:
            free |= above
        sample, point = np.nonzero(above & ~free)
        unblocked, tint, rays = self._trace(receivers, towards, sample, point)
        free[sample, point] = unblocked
        if tint is None:
            return _Look(weights, sent, sent * free, free[None], free, free, rays)
        passed = np.tile(free, (len(tint), 1, 1)).astype(np.float32)
        passed[:, sample, point] = tint
        return _Look(weights, sent, sent * passed, passed, free, (passed == 1).all(axis=0), rays)

    def _trace(
        self, receivers: _Receivers, towards: Float32, sample: NDArray[np.int64], point: NDArray[np.int64]
    ) -> tuple[Bool, Float32 | None, Counter[str]]:
        """Which (k,) of the ways (3, r, n) of some samples from some points are free; what (1, k) or (3, k) of the
        light passes, or None where that is all; and the rays it took."""
        origins, ways = receivers.ways(towards, sample, point)
        rays = Counter(shadow=len(sample))
        if not self.visibility.veiled:
            return self.visibility.unblocked_along(origins, ways), None, rays
        veiled = self.visibility.veiled_along(origins, ways)
        rays += Counter({"onward": veiled.onward, "cut off": veiled.cut})
        red, green, blue = tint = np.ascontiguousarray(veiled.tint.T)
        # Most ways meet no veil, and most veils are grey: three channels are for those that are not.
        if (red == green).all() and (green == blue).all():
            free = red > 0
            return free, None if (red == free).all() else tint[:1], rays
        return tint.max(axis=0) > 0, tint, rays


class _Tally:
    """Illumination while it is added up."""

    def __init__(self, receivers: _Receivers) -> None:
        count = len(receivers.origins)
        self.receivers = receivers
        self.irradiance, self.variance = np.zeros((2, count, 3))
        self.signature = np.zeros(count, dtype=np.int64)
        self.partly, self.reached = np.zeros((2, count), dtype=bool)
        self.rays: Counter[str] = Counter()

    def add(self, lit: NDArray[np.int64], answer: _Answer, color: Float64, name: int) -> None:
        """Add what a light of this colour (3,) brings to the receivers lit (m,)."""
        self.irradiance[lit] += answer.seen.mean(axis=0) * color
        if len(answer.seen) == 2:
            self.variance[lit] += ((answer.seen[0] - answer.seen[1]) * color) ** 2 / 4.0
        self.signature[lit] += np.where(answer.whole, name, 0)
        self.partly[lit] |= answer.partly
        self.reached[lit] |= answer.reached
        self.rays += answer.rays

    def illumination(self) -> Illumination:
        signature = np.where(self.partly, -1, self.signature)
        return Illumination(self.irradiance, self.variance, signature, self.reached, self.rays)


def _without_occluders(light: Light, receivers: _Receivers, unit: Float32) -> tuple[Float32, Float32, Float32]:
    """Ways (3, r, n) to places of a light; what each would bring of an even one (r, n), and what it does of this one
    (k, r, n), in one for all channels or in each."""
    points, _, shading = receivers.along
    ways = light.aim(points, unit)
    weights = np.maximum((ways.towards * shading[:, None]).sum(axis=0), 0) * ways.inverse * ways.solid
    gains = light.gain(points, ways)
    return ways.towards, weights, (weights if gains is None else weights * gains).reshape(-1, *weights.shape)


def _unevenly_lit(light: Light, receivers: _Receivers) -> NDArray[np.int64]:
    """Receivers (m,) to which the outer places of a light send unlike shares of what an even one would: where a cone
    ends, or behind a window that the sky shines through."""
    if light.even:
        return np.zeros(0, dtype=np.int64)
    ways, gain = _at_rim(light, receivers.along[0])
    return np.flatnonzero((np.ptp(cast(Float32, gain).reshape(-1, *ways.inverse.shape), axis=1) > 0).any(axis=0))


def _at_rim(light: Light, points: Float32) -> tuple[Ways, Float32 | None]:
    """Ways from points (3, n) to the outer places of a light, or to the one it has; and its gain along them."""
    rim = (_RIM if light.round else _CORNERS)[:, : None if light.sized else 1, None]
    ways = light.aim(points, np.repeat(rim, points.shape[1], axis=2))
    return ways, light.gain(points, ways)


def _share_sent(light: Light, receivers: _Receivers, unit: Float32, halves: int) -> Float32:
    """How much of what an even light would send a light does, (k, h, n), by what each half of some places sends."""
    _, weights, sent = _without_occluders(light, receivers, unit)
    even, own = _means(weights, halves), _means(sent, halves)
    return np.divide(own, even, out=np.zeros_like(own), where=even > 0)


def _means(values: Float32, halves: int) -> Float32:
    """Means (k, halves, n) over each half of the ways (k, r, n), or (r, n) where k is one."""
    ways, points = values.shape[-2:]
    return values.reshape(-1, halves, ways // halves, points).mean(axis=2)


def _seen(expected: Float64, weights: Float32, arrived: Float32) -> Float64:
    """How much of a light is seen, (h, n), by each half of the ways: mean weights (h, n), of which so much arrived.

    expected (h, n) is what the weights are on average, and the difference corrects what arrived, as far as the light is
    free: exactly that where nothing is in the way, and exactly nothing where everything is. How far it is free the
    other half tells (control variates; A. Owen, Monte Carlo theory, methods and examples, chapter 8.9), so the answer
    is right on average, which the ratio of the two sums is not. A single way has no other half.
    """
    free = np.divide(arrived, weights, out=np.ones_like(weights), where=weights > 0)
    if len(free) == 1:
        return expected * free
    other = free[::-1].astype(np.float64)
    return other * expected + (arrived - other * weights)


def _seen_in_all(every: Float64, expected: Float64, arrived: Float64) -> Float64:
    """The same (h, n, 3) for lights that were drawn by each half: every (n, 3) is what all of them would bring, and so
    what is expected (h, n, 3) on average, of which so much arrived. Each channel by itself, for one light may be
    free and another, of another colour, not; all together tell of one that a half drew no light of."""
    whole = expected.sum(axis=2, keepdims=True)
    free = np.divide(arrived.sum(axis=2, keepdims=True), whole, out=np.ones_like(whole), where=whole > 0)
    free = np.divide(arrived, expected, out=np.broadcast_to(free, arrived.shape).copy(), where=expected > 0)
    other = free[::-1]
    return np.asarray(other * every + (arrived - other * expected))


def _summed(values: Float64, place: NDArray[np.int64], count: int) -> Float64:
    """Sums (count, 3) of the values (k, 3) at each place (k,)."""
    return np.stack([np.bincount(place, channel, count) for channel in values.T], axis=1)


def _lattices(halves: int, count: int, points: int, rng: np.random.Generator) -> Float32:
    """(2, halves * count, points): even sets of the unit square, each shifted by itself."""
    lattice = np.stack([(np.arange(count) + 0.5) / count, np.arange(count) * GOLDEN]).astype(np.float32)
    unit = lattice[:, None, :, None] + rng.random((2, halves, 1, points), dtype=np.float32)
    return (unit - np.floor(unit)).reshape(2, halves * count, points)
