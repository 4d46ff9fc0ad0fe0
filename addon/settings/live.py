"""Every knob of live light, said once for the panel and the docs."""

from dataclasses import dataclass

from ..core.parameters import Zero, check_knobs, knob


@dataclass(frozen=True)
class LiveSettings:
    """How light is kept up to date while the scene is edited.

    Raises
    ------
    BakeError
        If a value is out of its range, naming the knob and the range.
    """

    n_vertices: int = knob(
        60_000, "Vertices that surfaces are cut to; those of a scene with more have fewer links each", 100, 10_000_000
    )
    spacing: float = knob(
        0.0,
        "Meters between vertices at which surfaces are cut no further",
        0.0,
        1e6,
        "m",
        Zero("Auto", "cuts them until there are as many vertices as may be", 0.2),
    )
    n_elements: int = knob(20_000, "Surface elements that reflect light", 100, 10_000_000)
    n_links: int = knob(1024, "Rays from each vertex whose ends are kept, at most", 8, 65_536)
    n_element_links: int = knob(64, "Rays from each side of an element whose ends are kept, at most", 8, 65_536)
    n_bounces: int = knob(5, "Surfaces that light is reflected by after the first", 0, 64)
    n_direct: int = knob(64, "Estimates of direct light at each vertex, at most", 1, 4096)
    n_photons: int = knob(250_000, "Photons that lamps send over mirrors and through glass", 1_000, 100_000_000)
    memory: int = knob(
        2000, "Megabytes that the rays of live light may take: of many vertices each gets fewer", 50, 10_000_000, "MB"
    )
    seed: int = knob(0, "The same seed gives the same light, whatever the number of threads", 0, 2**31 - 1)
    n_threads: int = knob(0, "Threads that work", 0, 1024, zero=Zero("Auto", "leaves one core to Blender", 1))

    def __post_init__(self) -> None:
        check_knobs(self, {})

    def of_each(self, most: int, n: int) -> int:
        """How many links or estimates each of n vertices has: `most`, or of more than `n_vertices` as many in all."""
        return most * self.n_vertices // max(n, self.n_vertices)
