"""Image files: what is read back is what was written, within the format's bounds, and a failure leaves the old file."""

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.gather.normal_gradient import slope_of_light
from photon_bake.addon.output.exr import write_exr
from photon_bake.addon.output.lightmap import (
    KINDS,
    decode_directional,
    directional_light,
    encode_directional,
    image_path,
    light_for_normals,
    write_lightmap,
)
from photon_bake.addon.output.lightmap.shared_scale import from_rgbd, from_rgbm, to_rgbd, to_rgbm
from photon_bake.addon.output.png import write_png
from photon_bake.addon.output.radiance_hdr import write_radiance_hdr

RANDOM = np.random.default_rng(0)


def light(height=40, width=50, spread=8.0):
    """Light over many orders of magnitude, with black and flat parts."""
    image = np.exp2(RANDOM.uniform(-spread, 3, (height, width, 1)) + RANDOM.uniform(-2, 0, (height, width, 3)))
    image[:5], image[5:9, :30] = 0, 1.25
    return image.astype(np.float32)


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}, dict(file.header())


def read_png(path):
    """Pixels of a PNG whose lines all are written by differences from the line above."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, body, text = 8, b"", {}
    while at < len(data):
        (size,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        content = data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(kind + content)
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", content[:10])
        elif kind == b"tEXt":
            key, value = content.decode("latin-1").split("\0")
            text[key] = value
        elif kind == b"IDAT":
            body += content
        at += 12 + size
    assert depth == 8
    lines = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, -1)
    assert (lines[:, 0] == 2).all()
    pixels = np.cumsum(lines[:, 1:], axis=0, dtype=np.uint8)
    return pixels.reshape(height, width, {0: 1, 2: 3, 6: 4}[colour]), text


def read_hdr(path):
    """Light of a Radiance picture, by the format's description."""
    data = path.read_bytes()
    header, _, rest = data.partition(b"\n\n")
    assert header.startswith(b"#?RADIANCE") and b"32-bit_rle_rgbe" in header
    size, _, body = rest.partition(b"\n")
    _, height, _, width = size.split()
    height, width, at = int(height), int(width), 0
    pixels = np.zeros((height, width, 4), np.uint8)
    if not 8 <= width < 1 << 15:
        pixels = np.frombuffer(body, np.uint8).reshape(height, width, 4)
    else:
        for row in range(height):
            assert body[at : at + 2] == b"\x02\x02" and body[at + 2] * 256 + body[at + 3] == width
            at += 4
            for channel in range(4):
                line = b""
                while len(line) < width:
                    code = body[at]
                    run = code > 128
                    line += body[at + 1 : at + 2] * (code - 128) if run else body[at + 1 : at + 1 + code]
                    at += 2 if run else 1 + code
                pixels[row, :, channel] = np.frombuffer(line, np.uint8)
        assert at == len(body)
    scale = np.where(pixels[..., 3:] > 0, np.ldexp(1.0, pixels[..., 3:].astype(int) - 136), 0)
    return pixels[..., :3] * scale


@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize("compression", ["none", "zip", "piz"])
def test_exr(tmp_path, half, compression):
    image, number = light(), np.arange(2000, dtype=np.uint32).reshape(40, 50)
    channels = {"Indirect.R": image[::-1, :, 0], "Indirect.G": image[..., 1], "Number": number}
    write_exr(tmp_path / "a.exr", channels, {"comment": "of a test", "seed": 3}, half, compression)
    read, header = read_exr(tmp_path / "a.exr")
    assert read.keys() == channels.keys() and header["comment"] == "of a test" and header["seed"] == 3
    expected = image.astype(np.float16) if half else image
    assert np.array_equal(read["Indirect.R"], expected[::-1, :, 0])
    assert np.array_equal(read["Indirect.G"], expected[..., 1]) and np.array_equal(read["Number"], number)


def test_what_half_cannot_hold_is_its_largest(tmp_path):
    write_exr(tmp_path / "a.exr", {"R": np.full((4, 4), 1e6, np.float32)})
    assert (read_exr(tmp_path / "a.exr")[0]["R"] == 65504).all()


@pytest.mark.parametrize("size", [(3, 7), (5, 8), (40, 50), (2, 300)])
def test_radiance_hdr(tmp_path, size):
    image = light(*size, spread=20)
    write_radiance_hdr(tmp_path / "a.hdr", image)
    error = np.abs(read_hdr(tmp_path / "a.hdr") - image)
    assert (error <= image.max(axis=2, keepdims=True) / 256 + 1e-38).all()
    assert (error[image.max(axis=2) == 0] == 0).all()


def test_radiance_runs_are_short(tmp_path):
    write_radiance_hdr(tmp_path / "a.hdr", np.ones((100, 1000, 3), np.float32))
    assert (tmp_path / "a.hdr").stat().st_size < 100 * 70


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_png(tmp_path, channels):
    pixels = RANDOM.integers(0, 256, (17, 23, channels), np.uint8)
    write_png(tmp_path / "a.png", pixels, {"Range": "8"})
    read, text = read_png(tmp_path / "a.png")
    assert np.array_equal(read, pixels) and text == {"Range": "8"}


@pytest.mark.parametrize("value_range", [1.0, 8.0, 50.0])
@pytest.mark.parametrize("dither", [False, True])
def test_rgbm_and_rgbd_are_off_by_no_more_than_they_say(value_range, dither):
    image = np.minimum(light(), value_range)
    largest = image.max(axis=2, keepdims=True)
    steps = 2 if dither else 1
    error = np.abs(from_rgbm(to_rgbm(image, value_range, dither), value_range) - image)
    assert (error <= 1.01 * steps * (largest + value_range / 255) / 510).all()
    error = np.abs(from_rgbd(to_rgbd(image, value_range, dither), value_range) - image)
    assert (error <= 1.01 * steps * np.maximum(2 * largest, value_range / 255) / 510).all()


def test_above_the_range_is_the_range():
    bright = np.full((2, 2, 3), 100, np.float32)
    assert from_rgbm(to_rgbm(bright)) == pytest.approx(8) and from_rgbd(to_rgbd(bright)) == pytest.approx(8)


def test_dithering_keeps_the_mean():
    image = np.full((100, 100, 3), 0.0123, np.float32)
    plain, dithered = (from_rgbm(to_rgbm(image, 8.0, dither)).mean() for dither in (False, True))
    assert abs(dithered - 0.0123) < abs(plain - 0.0123) / 5


def light_of_cones(degrees, width):
    """L0 and L1, E/π (n, 3) and normals (n, 3): each colour comes from one side, at degrees (n,) from the normals."""
    random = np.random.default_rng(4)
    normals, aside = (random.normal(size=(len(degrees), 3)) for _ in range(2))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    aside -= np.sum(aside * normals, axis=1, keepdims=True) * normals
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    light, slope = np.zeros((len(degrees), 3)), np.zeros((len(degrees), 3, 3))
    for colour in range(3):
        angle = np.radians(np.minimum(degrees + width * colour, 89))[:, None]
        way = np.cos(angle) * normals + np.sin(angle) * aside
        light[:, colour] = np.cos(angle)[:, 0]
        slope[:, :, colour] = slope_of_light(way, normals)
    return directional_light(light / np.pi, slope / np.pi, normals), light / np.pi, normals


def test_directional_images_give_back_what_they_were_made_of():
    (constant, linear), light, normals = light_of_cones(np.linspace(0, 89, 60), 10)
    images = encode_directional(constant.reshape(6, 10, 3), linear.reshape(6, 10, 3, 3))
    assert tuple(images) == KINDS
    assert all(images[kind].min() >= 0 and images[kind].max() <= 1 for kind in KINDS[1:])
    back = decode_directional(images)
    assert back[0].reshape(60, 3) == pytest.approx(constant) and back[1].reshape(60, 3, 3) == pytest.approx(
        linear, abs=1e-6
    )
    assert light_for_normals(*back, normals.reshape(6, 10, 3)).reshape(60, 3) == pytest.approx(light, abs=1e-5)


def test_light_of_normals_is_that_of_bands_0_and_1_as_far_as_images_hold_it():
    """Light from straight above is (1 + 2 n·n')/3, light from everywhere above (1 + n·n')/2."""
    up, turned = np.array([[0, 0, 1.0]]), np.array([[0.6, 0, 0.8]])
    for slope, wanted in ((1.0, (1 + 2 * 0.8) / 3), (0.5, (1 + 0.8) / 2)):
        both = directional_light(np.ones((1, 3)), slope * up[..., None] * np.ones(3), up)
        assert light_for_normals(*both, turned) == pytest.approx(wanted)
        assert light_for_normals(*both, up) == pytest.approx(1)


def test_darkness_has_no_direction():
    dark = directional_light(np.zeros((2, 1, 3)), np.zeros((2, 1, 3, 3)), np.eye(3)[:2, None])
    assert not dark[0].any() and not dark[1].any()
    assert all((encode_directional(*dark)[kind] == 0.5).all() for kind in KINDS[1:])


@pytest.mark.parametrize("file_format", ["exr_half", "exr_float", "hdr", "rgbm", "rgbd"])
def test_row_0_is_the_lowest_of_the_file(tmp_path, file_format):
    image = np.zeros((12, 16, 3), np.float32)
    image[0] = 1
    path = image_path(tmp_path, "A: scene", "Atlas/1", "indirect", file_format)
    assert path.parent == tmp_path and path.stem == "A_ scene_Atlas_1_indirect"
    write_lightmap(path, image, file_format)
    if path.suffix == ".exr":
        red = read_exr(path)[0]["R"]
    elif path.suffix == ".hdr":
        red = read_hdr(path)[..., 0]
    else:
        decode = from_rgbm if file_format == "rgbm" else from_rgbd
        pixels, text = read_png(path)
        assert text == {"Encoding": file_format.upper(), "Range": "8"}
        red = decode(pixels)[..., 0]
    assert red[-1] == pytest.approx(1, rel=0.01) and not red[:-1].any()


def test_a_wrong_pattern_is_said(tmp_path):
    with pytest.raises(BakeError, match="may hold"):
        image_path(tmp_path, "a", "b", "c", "hdr", pattern="{scene}_{frame}")


def writers():
    image = light(200, 200)
    return {
        "a.exr": lambda path: write_exr(path, {"R": image[..., 0]}),
        "a.hdr": lambda path: write_radiance_hdr(path, image),
        "a.png": lambda path: write_png(path, RANDOM.integers(0, 256, (300, 300, 4), np.uint8)),
    }


@pytest.mark.parametrize("name", writers())
def test_a_missing_folder_is_one_sentence(tmp_path, name):
    with pytest.raises(BakeError, match=r"cannot be written \(No such file or directory\); choose another place\.$"):
        writers()[name](tmp_path / "nowhere" / name)


FULL_DISK = """
import resource
import sys
from pathlib import Path
from photon_bake.addon.core.errors import BakeError
from photon_bake.tests.core.test_image_files import writers
path = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (10000, 10000))
try:
    writers()[path.name](path)
except BakeError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on the size of files")
@pytest.mark.parametrize("name", writers())
def test_a_full_disk_leaves_the_old_image(tmp_path, name):
    path: Path = tmp_path / name
    path.write_bytes(b"old")
    run = subprocess.run([sys.executable, "-c", FULL_DISK, str(path)], capture_output=True, text=True, check=False)
    assert "cannot be written" in run.stdout and run.stdout.count("\n") == 1, run.stderr
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]
