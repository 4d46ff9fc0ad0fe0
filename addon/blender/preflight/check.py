"""The check: all rules, and what they leave."""

from dataclasses import dataclass
from time import perf_counter

from ...core.findings import Finding, counted
from ...pipeline.estimates import Work
from . import light_rules, object_rules, setting_rules
from .asked import Asked
from .found import Found
from .work import work_of


@dataclass(frozen=True)
class Preflight:
    """What is told of a bake before it.

    Attributes
    ----------
    n_lit : int
        Objects that get light.
    findings : tuple of Finding
        What keeps the bake from beginning comes first, then what keeps objects from light of their own.
    work : Work
    seconds : float
        That the check took.
    """

    n_lit: int
    n_unlit: int
    findings: tuple[Finding, ...]
    work: Work
    seconds: float

    @property
    def blocked(self) -> bool:
        """Whether a bake would refuse to begin."""
        return any(finding.blocks for finding in self.findings)

    @property
    def line(self) -> str:
        """How many objects get light and how many do not; empty where light goes to no objects."""
        if not self.n_lit and not self.n_unlit:
            return ""
        lit = f"{counted(self.n_lit, 'object')} will get light"
        return f"{lit}, {self.n_unlit:,} will not" if self.n_unlit else lit


def check(asked: Asked) -> Preflight:
    """Find out what will become of a bake."""
    started = perf_counter()
    found: list[Found] = []
    for rules in (setting_rules.RULES, object_rules.RULES, light_rules.RULES):
        for rule in rules:
            found += rule(asked)
    found.sort(key=lambda one: (not one.finding.blocks, not one.unlit))
    unlit = {obj for one in found for obj in one.unlit}
    on_objects = bool(asked.targets & {"vertex", "lightmap"})
    n_lit = len([obj for obj in asked.meshes if obj not in unlit]) if on_objects else 0
    if asked.copies and on_objects:
        n_lit += len([obj for obj in asked.chosen if object_rules.is_copied(obj)])
    findings = tuple(one.finding for one in found)
    return Preflight(n_lit, len(unlit), findings, work_of(asked), perf_counter() - started)
