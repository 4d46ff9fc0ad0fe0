"""The picture of all lightmaps."""

import numpy as np
from photon_bake.addon.output.lightmap import contact_sheet
from photon_bake.addon.output.lightmap.contact_sheet import CELL, GAP


def test_images_stand_side_by_side_the_right_way_up():
    bright = np.ones((64, 128, 3), np.float32)
    half = np.zeros((32, 32, 3), np.float32)
    half[:16] = 0.5  # the lower half, as row 0 is at v = 0
    sheet = contact_sheet([bright, half, bright])
    assert sheet.dtype == np.uint8 and sheet.shape[1] == 2 * CELL + 3 * GAP
    assert (sheet[GAP : GAP + 128, GAP : GAP + CELL] == 255).all()
    second = sheet[GAP : GAP + CELL, 2 * GAP + CELL : -GAP]
    assert not second[: CELL // 2].any() and (second[CELL // 2 :] == 188).all()  # sRGB of 0.5


def test_large_images_are_averaged():
    checks = np.indices((1000, 500)).sum(axis=0)[..., None].repeat(3, 2) % 2
    sheet = contact_sheet([checks.astype(np.float32)])
    assert max(sheet.shape[:2]) <= CELL + 2 * GAP
    assert np.abs(sheet[GAP:-GAP, GAP:-GAP].astype(int) - 188).max() <= 2


def test_black_images_and_none():
    assert not contact_sheet([np.zeros((8, 8, 3), np.float32)])[GAP:-GAP, GAP:-GAP].any()
    assert contact_sheet([]).size >= 0
