"""Means of what texture nodes show, against what a dense grid of look-ups sees."""

import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.pictures.texels import (
    EXACT_SIDE,
    StoredImage,
    extended,
    linear_to_srgb,
    srgb_to_linear,
)


def curve(encoded):
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def bytes_of(height, width):
    return np.random.default_rng(height).integers(0, 256, (height, width, 4)).astype(np.float32) / 255


def looked_up(pixels, extension, cubic, n, decode):
    """What is shown at n × n places in each texel, as Cycles interpolates, and its mean within each texel."""
    for axis in (0, 1):
        size = pixels.shape[axis]
        at = (np.arange(size * n) + 0.5) / n - 0.5
        first, t = np.floor(at).astype(int), at % 1
        if cubic:
            weights = [(1 - t) ** 3 / 6, t**3 / 2 - t**2 + 2 / 3, (1 + 3 * t + 3 * t**2 - 3 * t**3) / 6, t**3 / 6]
        else:
            weights = [1 - t, t]
        total = 0
        for k, weight in enumerate(weights, -1 if cubic else 0):
            texel, inside = extended(first + k, size, extension)
            total = total + pixels.take(texel, axis) * (weight * inside).reshape((-1, *[1] * (2 - axis)))
        pixels = total
    shown = decode(pixels)
    height, width = shown.shape[0] // n, shown.shape[1] // n
    return shown.reshape(height, n, width, n, 4).mean(axis=(1, 3))


def blocks(pixels, height, width):
    return pixels.reshape(height, pixels.shape[0] // height, width, pixels.shape[1] // width, 4).mean(axis=(1, 3))


def encoded(pixels):
    return np.concatenate([curve(pixels[..., :3]), pixels[..., 3:]], axis=2)


def test_gradient_from_black_to_white_has_the_mean_of_the_curve():
    pixels = np.ones((1, 2, 4), np.float32)
    pixels[0, 0, :3] = 0
    for interpolation, mean in (("Linear", 0.3103), ("Closest", 0.5)):
        shown = StoredImage(pixels, True, False).shown(interpolation, "REPEAT")
        np.testing.assert_allclose(shown.mean(axis=(0, 1)), [mean, mean, mean, 1], atol=1e-4)
    assert StoredImage(pixels, False, False).shown("Linear", "REPEAT")[..., 0].mean() == pytest.approx(0.5)


@pytest.mark.parametrize("interpolation", ["Linear", "Cubic", "Smart"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("size", [(3, 4), (150, 140)])
def test_mean_within_each_texel(interpolation, extension, size):
    pixels = bytes_of(*size)
    expected = looked_up(pixels, extension, interpolation != "Linear", 24 if size[0] < 9 else 8, encoded)
    shown = StoredImage(pixels, True, False).shown(interpolation, extension)
    np.testing.assert_allclose(blocks(shown, *size), expected, atol=2e-3)


def test_mean_of_large_pictures():
    pixels = bytes_of(EXACT_SIDE + 40, EXACT_SIDE + 30)
    expected = looked_up(pixels, "REPEAT", False, 8, encoded)
    shown = StoredImage(pixels, True, False).shown("Linear", "REPEAT")
    np.testing.assert_allclose(shown.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=2e-3)
    assert np.abs(shown - expected).max() < 0.1


def test_alpha_is_divided_out_between_texels():
    def decode(pixels):
        color, alpha = pixels[..., :3], pixels[..., 3:]
        return np.concatenate([curve(color / np.where(alpha > 0, alpha, 1)), alpha], axis=2)

    pixels = bytes_of(4, 3)
    pixels[1, 1, 3] = 0
    pixels[..., :3] *= pixels[..., 3:]
    expected = looked_up(pixels, "EXTEND", False, 24, decode)
    shown = StoredImage(pixels, True, True).shown("Linear", "EXTEND")
    np.testing.assert_allclose(blocks(shown, 4, 3), expected, atol=2e-3)


def test_closest_keeps_texels():
    pixels = bytes_of(5, 7)
    np.testing.assert_allclose(StoredImage(pixels, True, False).shown("Closest", "REPEAT"), encoded(pixels), atol=1e-5)


def test_curve_and_its_inverse():
    values = np.linspace(0, 2, 999, dtype=np.float32)
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(values)), values, atol=1e-5)
    np.testing.assert_allclose(srgb_to_linear(values[:400]), curve(values[:400]), atol=2e-5)
