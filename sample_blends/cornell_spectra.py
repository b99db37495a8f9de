"""The measured spectra of the Cornell box, and the linear RGB colours that follow from them.

Source: Cornell University Program of Computer Graphics, "Cornell Box Data". The reflectances were measured from 400 to
700 nm in steps of 4 nm; the lamp's spectrum is given at four wavelengths, in relative units that serve as radiance.
"""

from __future__ import annotations

import numpy as np

WAVELENGTHS = np.arange(400, 701, 4)

WHITE = (
    0.343, 0.445, 0.551, 0.624, 0.665, 0.687, 0.708, 0.723, 0.715, 0.710, 0.745, 0.758, 0.739, 0.767, 0.777, 0.765,
    0.751, 0.745, 0.748, 0.729, 0.745, 0.757, 0.753, 0.750, 0.746, 0.747, 0.735, 0.732, 0.739, 0.734, 0.725, 0.721,
    0.733, 0.725, 0.732, 0.743, 0.744, 0.748, 0.728, 0.716, 0.733, 0.726, 0.713, 0.740, 0.754, 0.764, 0.752, 0.736,
    0.734, 0.741, 0.740, 0.732, 0.745, 0.755, 0.751, 0.744, 0.731, 0.733, 0.744, 0.731, 0.712, 0.708, 0.729, 0.730,
    0.727, 0.707, 0.703, 0.729, 0.750, 0.760, 0.751, 0.739, 0.724, 0.730, 0.740, 0.737,
)  # fmt: skip

GREEN = (
    0.092, 0.096, 0.098, 0.097, 0.098, 0.095, 0.095, 0.097, 0.095, 0.094, 0.097, 0.098, 0.096, 0.101, 0.103, 0.104,
    0.107, 0.109, 0.112, 0.115, 0.125, 0.140, 0.160, 0.187, 0.229, 0.285, 0.343, 0.390, 0.435, 0.464, 0.472, 0.476,
    0.481, 0.462, 0.447, 0.441, 0.426, 0.406, 0.373, 0.347, 0.337, 0.314, 0.285, 0.277, 0.266, 0.250, 0.230, 0.207,
    0.186, 0.171, 0.160, 0.148, 0.141, 0.136, 0.130, 0.126, 0.123, 0.121, 0.122, 0.119, 0.114, 0.115, 0.117, 0.117,
    0.118, 0.120, 0.122, 0.128, 0.132, 0.139, 0.144, 0.146, 0.150, 0.152, 0.157, 0.159,
)  # fmt: skip

RED = (
    0.040, 0.046, 0.048, 0.053, 0.049, 0.050, 0.053, 0.055, 0.057, 0.056, 0.059, 0.057, 0.061, 0.061, 0.060, 0.062,
    0.062, 0.062, 0.061, 0.062, 0.060, 0.059, 0.057, 0.058, 0.058, 0.058, 0.056, 0.055, 0.056, 0.059, 0.057, 0.055,
    0.059, 0.059, 0.058, 0.059, 0.061, 0.061, 0.063, 0.063, 0.067, 0.068, 0.072, 0.080, 0.090, 0.099, 0.124, 0.154,
    0.192, 0.255, 0.287, 0.349, 0.402, 0.443, 0.487, 0.513, 0.558, 0.584, 0.620, 0.606, 0.609, 0.651, 0.612, 0.610,
    0.650, 0.638, 0.627, 0.620, 0.630, 0.628, 0.642, 0.639, 0.657, 0.639, 0.635, 0.642,
)  # fmt: skip

LAMP = tuple(np.interp(WAVELENGTHS, (400, 500, 600, 700), (0.0, 8.0, 15.6, 18.4)))

#: CIE XYZ to linear RGB with the primaries of Rec. 709 and white D65 (IEC 61966-2-1).
XYZ_TO_RGB = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]],
)


def linear_rgb(spectrum: tuple[float, ...]) -> tuple[float, float, float]:
    """A spectrum (76 values at WAVELENGTHS) averaged with each channel's matching function.

    The average is normalised by the matching function's own integral, so that a spectrum of ones, the perfect white,
    becomes (1, 1, 1): an equal-energy light is this colour space's white.
    """
    weights = XYZ_TO_RGB @ _cie_1931(WAVELENGTHS.astype(float))
    red, green, blue = weights @ np.asarray(spectrum) / weights.sum(axis=1)
    return float(red), float(green), float(blue)


def _cie_1931(nanometres: np.ndarray) -> np.ndarray:
    """The 2-degree observer's x, y, z (3, n), as fitted by Wyman, Sloan and Shirley (JCGT 2013, listing 1)."""

    def lobe(height: float, peak: float, left: float, right: float) -> np.ndarray:
        width = np.where(nanometres < peak, left, right)
        return height * np.exp(-0.5 * ((nanometres - peak) / width) ** 2)

    return np.array(
        [
            lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )
