"""Light in the 8-bit channels of RGBA images: RGBM and RGBD, whose alpha channel is a scale for the other three.

All is linear; none of it is gamma corrected.
"""

import numpy as np

from ...core.sampling.streams import stream


def to_rgbm(image: np.ndarray, value_range: float = 8.0, dither: bool = False) -> np.ndarray:
    """Light (h, w, 3) as RGBM, (h, w, 4) uint8: light = rgb · m · range, with channels from 0 to 1.

    A channel is off by at most (largest channel + range/255)/510, with dithering by twice that. What is above the
    range becomes the range.

    Parameters
    ----------
    value_range : float
        The largest light that the image can hold.
    dither : bool
        Round up or down by chance, so that slow gradients show no bands.
    """
    light = np.clip(image, 0, value_range) / value_range
    m = np.ceil(light.max(axis=2, keepdims=True) * 255 - 1e-4).clip(1, 255)
    return np.concatenate([_rounded(light * (255 * 255 / m), dither), m], axis=2).astype(np.uint8)


def from_rgbm(pixels: np.ndarray, value_range: float = 8.0) -> np.ndarray:
    """Light (h, w, 3) float32 of RGBM pixels."""
    channels = pixels.astype(np.float32) / 255
    return channels[..., :3] * channels[..., 3:] * np.float32(value_range)


def to_rgbd(image: np.ndarray, value_range: float = 8.0, dither: bool = False) -> np.ndarray:
    """Light (h, w, 3) as RGBD, (h, w, 4) uint8: light = rgb · range / (255 d), with channels from 0 to 1.

    A channel is off by at most max(2 · largest channel, range/255)/510, with dithering by twice that. What is above
    the range becomes the range.
    """
    light = np.clip(image, 0, value_range) / value_range
    d = np.floor(1 / np.maximum(light.max(axis=2, keepdims=True), 1e-6) + 1e-4).clip(1, 255)
    return np.concatenate([_rounded(light * d * 255, dither), d], axis=2).astype(np.uint8)


def from_rgbd(pixels: np.ndarray, value_range: float = 8.0) -> np.ndarray:
    """Light (h, w, 3) float32 of RGBD pixels."""
    divisor = np.maximum(pixels[..., 3:].astype(np.float32), 1)
    return pixels[..., :3].astype(np.float32) / 255 * (np.float32(value_range) / divisor)


def _rounded(channels: np.ndarray, dither: bool) -> np.ndarray:
    """Channels from 0 to 255 as whole numbers."""
    if dither:
        channels = channels + stream(0, 0).random((*channels.shape[:2], 1)) - 0.5
    return np.rint(channels).clip(0, 255)
