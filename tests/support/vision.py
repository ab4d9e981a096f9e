"""How far apart colours look: CIEDE2000, also for people with a colour vision deficiency."""

import numpy as np
import numpy.typing as npt

# Full strength, linear light: Machado, Oliveira and Fernandes (2009).
DEFICIENCIES = {
    "none": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def lab(words: npt.ArrayLike, deficiency: str = "none") -> np.ndarray:
    """CIELAB (..., 3) of colours 0xRRGGBB (...) as somebody sees them."""
    shifts = np.array([16, 8, 0])
    share = (np.asarray(words, np.int64)[..., None] >> shifts & 255) / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    linear = np.clip(linear @ np.array(DEFICIENCIES[deficiency]).T, 0, 1)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    ratio = linear @ to_xyz.T / [0.9505, 1.0, 1.089]
    root = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def ciede2000(one: npt.ArrayLike, other: npt.ArrayLike) -> np.ndarray:
    """The difference of colours in CIELAB (..., 3); formulas of Sharma, Wu and Dalal (2005)."""
    (l1, a1, b1), (l2, a2, b2) = (
        np.moveaxis(np.asarray(lab, float), -1, 0) for lab in (one, other)
    )
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * np.sqrt(mean**7 / (mean**7 + 25.0**7))
    c1, c2 = np.hypot(stretch * a1, b1), np.hypot(stretch * a2, b2)
    h1 = np.degrees(np.arctan2(b1, stretch * a1)) % 360
    h2 = np.degrees(np.arctan2(b2, stretch * a2)) % 360
    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + 180) % 360 - 180)
    hue = np.where(grey, h1 + h2, (h1 + turn / 2) % 360)
    light, chroma = (l1 + l2) / 2 - 50, (c1 + c2) / 2

    def cosine(times: int, shift: float) -> np.ndarray:
        return np.cos(np.radians(times * hue + shift))

    t = 1 - 0.17 * cosine(1, -30) + 0.24 * cosine(2, 0) + 0.32 * cosine(3, 6) - 0.2 * cosine(4, -63)
    of_light = (l2 - l1) / (1 + 0.015 * light**2 / np.sqrt(20 + light**2))
    of_chroma = (c2 - c1) / (1 + 0.045 * chroma)
    of_hue = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * chroma * t)
    turned = np.sin(np.radians(60 * np.exp(-(((hue - 275) / 25) ** 2))))
    blue = -2 * turned * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    return np.sqrt(of_light**2 + of_chroma**2 + of_hue**2 + blue * of_chroma * of_hue)


def apart(one: npt.ArrayLike, other: npt.ArrayLike) -> np.ndarray:
    """The least difference of colours 0xRRGGBB for anybody: the four columns of DEFICIENCIES."""
    return np.min([ciede2000(lab(one, each), lab(other, each)) for each in DEFICIENCIES], axis=0)
