"""The table of cases against Cycles: docs/cases.md has what it measured, and tests/references what Cycles said."""

import pytest
from photon_bake.tests.host.cases import CASES
from photon_bake.tests.host.cases.references import lacking, load
from photon_bake.tests.host.cases.table import PATH, measure_row

LONG = 5
"""Effort above which a case takes over five seconds of CPU, and is left to `make test-long`."""


@pytest.fixture(scope="module")
def rows(request):
    """What was measured; printed when all is done."""
    measured = []
    yield measured
    terminal = request.config.pluginmanager.getplugin("terminalreporter")
    terminal.ensure_newline()
    for row in measured:
        terminal.write_line(f"  {'   ' if row.passes else 'NOT'} {row}")


def marks(case):
    """Cases that need much work to be told from noise are long: others have the same features in easier light."""
    return pytest.mark.long if case.effort > LONG else ()


@pytest.mark.parametrize("case", [pytest.param(case, marks=marks(case), id=case.name) for case in CASES.values()])
def test_case(case, rows):
    assert not lacking(case, load())
    if not case.runs_here:
        pytest.skip(f"from Blender {'.'.join(map(str, case.since))}")
    row = measure_row(case)
    rows.append(row)
    assert row.passes, str(row)


def test_there_are_no_other_references():
    assert set(load()) == {name for case in CASES.values() for name in case.references}


def test_page_has_all_cases():
    page = PATH.read_text(encoding="utf-8")
    assert [case.title for case in CASES.values() if f"| {case.title} |" not in page] == []


def test_titles_are_unique():
    assert len({case.title for case in CASES.values()}) == len(CASES)
