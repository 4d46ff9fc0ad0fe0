"""The table of cases: measured, printed and written to docs/cases.md."""

from dataclasses import dataclass
from pathlib import Path

import bpy

from .means import BOUND, CHANNELS, Comparison
from .ours import our_bake
from .references import lacking, load
from .registry import CASES, GROUPS, Case

PATH = Path(__file__).resolve().parents[3] / "docs" / "cases.md"

INTRODUCTION = """# Cases

One feature each, in a small room with a dozen or more probes, baked by Photon Bake and by Cycles: the mean of
E_indirect / π over the probes. Cycles bakes *Diffuse*, Indirect alone, with 32 bounces of every kind, nothing clamped,
adaptive sampling off and caustics on. A case passes where red, green, blue and their mean (grey) each differ from
Cycles' by less than {bound:.0%} and two standard errors of both. *Difference* is in grey; *Largest* is in the channel
that comes closest to failing, or fails most, and *Tolerance* is that channel's.

The scenes stand in [tests/host/cases](../tests/host/cases/__init__.py), Cycles' values in
[tests/references](../tests/references/cases.json); `make test` compares. `tests/references/make.py` remakes the values,
and with `--table` this page, which was measured with Blender {version}: {passed} of {count} cases pass.

Cycles' values are from Blender 5.2. Cycles 4.5 was measured to agree within 1 % and the noise in every case below that
runs there, but IES and Voronoi Textures of lamps, low suns and what comes to bodies through themselves, which have
values of 4.5 beside them; cases with features of Blender 5 are skipped in 4.5.
"""

HEAD = """
| Case | Cycles | Photon Bake | Difference | Largest | Tolerance | Passes |
|---|---|---|---|---|---|---|
"""

DIFFERS = """
## What differs

These are baked otherwise than Cycles renders them. *Difference* is of a case that has little else, in the channel that
is off most.

| Feature | What is baked | Difference |
|---|---|---|
"""

NOT_SUPPORTED = """
## Not supported

Baking these warns by name. *Difference* is what leaving them out does to the light of a case that has little else.

| Feature | Warning in the case | Difference |
|---|---|---|
"""


@dataclass(frozen=True)
class Row:
    """A case as measured; without a comparison where the bake failed."""

    case: Case
    comparison: Comparison | None
    warnings: list[str]
    failure: str = ""

    @property
    def warns(self) -> bool:
        """Whether a warning names what is not supported."""
        return any(self.case.unsupported in warning for warning in self.warnings)

    @property
    def passes(self) -> bool:
        if self.case.unsupported:
            return self.warns
        if self.comparison is None:
            return False
        return self.comparison.is_clear if self.case.differs else self.comparison.passes

    def __str__(self) -> str:
        if self.case.unsupported:
            return f"{self.case.title}: not supported, {'warns' if self.warns else 'and no warning names it'}"
        return f"{self.case.title}: {self.comparison or self.failure}"

    @property
    def heading(self) -> str:
        """The text above the table that the case is in."""
        if self.case.unsupported:
            return NOT_SUPPORTED
        return DIFFERS if self.case.differs else f"\n## {self.case.group}\n{HEAD}"

    @property
    def markdown(self) -> str:
        """A line of the table that the case is in."""
        compared, case = self.comparison, self.case
        if case.unsupported or case.differs:
            said = case.differs or next((one for one in self.warnings if case.unsupported in one), "no warning yet")
            off = compared.difference if compared else (0.0,)
            difference = f"{max(off, key=abs) if case.differs else off[-1]:+.0%}" if compared else self.failure
            return f"| {case.title} | {said} | {difference} |\n"
        if compared is None:
            return f"| {self.case.title} | | {self.failure} | | | | no |\n"
        at = compared.worst
        cells = [
            self.case.title,
            str(compared.truth),
            str(compared.ours),
            f"{compared.difference[-1]:+.1%}",
            f"{compared.difference[at]:+.1%} {CHANNELS[at]}",
            f"{compared.tolerance[at]:.1%}",
            ("yes" if compared.passes else "no") if compared.is_clear else "too noisy to tell",
        ]
        return f"| {' | '.join(cells)} |\n"


def measure_row(case: Case) -> Row:
    """Bake a case and compare it with its reference, which there has to be."""
    references = load()
    if reason := lacking(case, references):
        raise LookupError(reason)
    case.set_scene()
    ours, warnings = our_bake(case)
    return Row(case, Comparison(references[case.reference].value, ours), warnings)


def write_table() -> None:
    """Measure all cases, print them, and write docs/cases.md."""
    rows = []
    for case in CASES.values():
        if case.runs_here:
            rows.append(_try_row(case))
            print(rows[-1], flush=True)
    PATH.write_text(page(rows), encoding="utf-8")


def write_rows(cases: list[Case]) -> None:
    """Measure some cases, print them, and put their rows into docs/cases.md, below the others of their group if new.

    What the page says of all cases is left for `write_table`.
    """
    lines = PATH.read_text(encoding="utf-8").splitlines(keepends=True)
    for row in map(_try_row, cases):
        print(row, flush=True)
        known = [number for number, other in enumerate(lines) if other.startswith(f"| {row.case.title} |")]
        if known:
            lines[known[0]] = row.markdown
        else:
            lines.insert(_end_of_table(lines, row.heading), row.markdown)
    PATH.write_text("".join(lines), encoding="utf-8")


def _end_of_table(lines: list[str], heading: str) -> int:
    """Where the table below a heading, the second line of a text, ends."""
    at = lines.index(heading.split("\n")[1] + "\n") + 1
    ends = (number for number in range(at, len(lines)) if lines[number].startswith("## "))
    end = next(ends, len(lines))
    return max(number for number in range(at, end) if lines[number].startswith("|")) + 1


def _try_row(case: Case) -> Row:
    """A row, also where the bake fails: the table has all cases."""
    try:
        return measure_row(case)
    except Exception as error:
        return Row(case, None, [], f"{type(error).__name__}: {error}")


def page(rows: list[Row]) -> str:
    """docs/cases.md."""
    compared = [row for row in rows if not row.case.unsupported and not row.case.differs]
    passed, count = sum(row.passes for row in compared), len(compared)
    text = INTRODUCTION.format(bound=BOUND, version=bpy.app.version_string, passed=passed, count=count)
    for heading in (*(f"\n## {group}\n{HEAD}" for group in GROUPS), DIFFERS, NOT_SUPPORTED):
        text += heading + "".join(row.markdown for row in rows if row.heading == heading)
    return text
