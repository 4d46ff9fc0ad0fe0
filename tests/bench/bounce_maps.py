"""Measures how many photons are left after each bounce, as Figure 10 of McGuire and Luebke does."""

from figures import load, table
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.photons import bounce_map, trace_photons
from photon_bake.addon.photons.tracing import shares
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer

N_PHOTONS, N_BOUNCES = 200_000, 4
HEAD = ["Scene", "Emitted", "Meet a surface", *(f"After {n}" for n in range(1, N_BOUNCES + 1))]


def attrition_table(built, paths):
    """Photons that meet a first surface, and those that meet a diffuse one after each bounce, of all emitted.

    `built` are scenes by name, `paths` files.
    """
    rows = [attrition(name, scene, region_of(scene.vertices)) for name, scene in built.items()]
    for name, path in paths.items():
        scene, everything, _ = load(path)
        rows.append(attrition(name, scene, region_of(everything.position)))
    return table("Photons left after each bounce, emitted through bounce maps", HEAD, rows)


def attrition(name, scene, region):
    """A row."""
    tracer, sources = TransparencyTracer(scene, EmbreeTracer(scene)), light_sources(scene, region)
    counts = zip(sources, shares(sources, N_PHOTONS), strict=True)
    maps = [bounce_map(tracer, source, count) for source, count in counts]
    n_emitted = sum(len(made.rays.flux) for made in maps)
    photons = trace_photons(scene, tracer, sources, N_PHOTONS, N_BOUNCES + 1, Workers(), in_pictures=True)
    left = [sum(made.hits.hit.sum() for made in maps), *((photons.bounce == n).sum() for n in range(1, N_BOUNCES + 1))]
    return [name, f"{n_emitted:,}", *(f"{n / n_emitted:.1%}" for n in left)]
