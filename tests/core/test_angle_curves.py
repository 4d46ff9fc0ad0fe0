"""Weights of closures that depend on the angle by which they are seen."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf import diffuse_albedo
from photon_bake.addon.scene import AngleCurves, Lobe, Materials, angle_cosines
from photon_bake.tests.core.bsdf_points import N, albedo_of, closures, direction, numbers, points_of, sample_bsdf

COSINES = angle_cosines()
RISING = COSINES**2


def mixed(kind=Lobe.DIFFUSE, first=1.0, second=1.0, n=N, **values):
    """Points of a diffuse closure by a curve, and of another by what it leaves."""
    both = closures(
        {"kind": Lobe.DIFFUSE, "weight": first}, {"kind": kind, "weight": second, "f0": 1, "f90": 1, **values}
    )
    curves = AngleCurves(np.int32([0, 1]), np.float32([RISING, 1 - RISING]))
    return points_of(Materials.of(1, closures=replace(both, by_angle=curves)), n)


@pytest.mark.parametrize("cos", [0.05, 0.33, 0.8, 1.0])
def test_a_mix_by_the_angle_loses_nothing(cos):
    np.testing.assert_allclose(albedo_of(mixed(), cos), 1, rtol=1e-3)
    np.testing.assert_allclose(albedo_of(mixed(Lobe.GLOSSY, roughness=0.0), cos), 1, rtol=5e-3)


@pytest.mark.parametrize("cos", [0.1, 0.5, 0.97])
def test_albedo_follows_the_curve(cos):
    """To within what straight lines between its points make of it."""
    found = diffuse_albedo(mixed(first=0.8, second=0.2, n=1), np.float32([cos]))[0]
    np.testing.assert_allclose(found, 0.8 * cos**2 + 0.2 * (1 - cos**2), atol=1e-3)


def test_photons_are_weighed_by_where_they_go():
    """Of light that comes at any angle ∫ 2 c · c² dc = ½ is reflected by the curve's closure, most of it upwards."""
    sample = sample_bsdf(mixed(second=0.0), direction(0.3), numbers(), from_light=True)
    weight, cos = sample.weight[:, 0], sample.wi[:, 2]
    assert weight.mean() == pytest.approx(0.5, rel=0.01)
    assert (weight * cos).mean() / weight.mean() == pytest.approx(0.8, rel=0.01)


def test_materials_with_curves_are_not_matte():
    materials = Materials.of(1, closures=replace(closures({"kind": Lobe.DIFFUSE}), by_angle=AngleCurves(*ONE_CURVE)))
    assert materials.directional.all() and not materials.matte.any() and not materials.narrow.any()


ONE_CURVE = np.int32([0]), np.float32([RISING])
