"""Remakes the references of the cases with Cycles, and the table in docs/cases.md.

    .venv/bin/python tests/references/make.py                  references that are missing or out of date
    .venv/bin/python tests/references/make.py --all            all of them
    .venv/bin/python tests/references/make.py --only NAME …    those of these cases, or of these groups
    .venv/bin/python tests/references/make.py --table          bakes all cases and writes docs/cases.md
    .venv/bin/python tests/references/make.py --table --only NAME …    bakes these, and puts their rows there
    .venv/bin/python tests/references/make.py --list           names of the cases

All references take about ten minutes on one core, and the table about four. References are written to cases.json one by
one: a run that is cut off loses nothing.
"""

import argparse
import time

from photon_bake.tests.host.cases import CASES, Case
from photon_bake.tests.host.cases.references import lacking, load, measure, save


def chosen(options: argparse.Namespace) -> list[Case]:
    """The cases that get a reference."""
    if options.only:
        return [case for case in CASES.values() if {case.name, case.group} & set(options.only)]
    return [case for case in CASES.values() if options.all or lacking(case, load())]


def make(case: Case) -> None:
    """Make a reference and add it to those that there are by then."""
    start = time.perf_counter()
    reference = measure(case)
    named = {name for one in CASES.values() for name in one.references}
    save({name: entry for name, entry in load().items() if name in named} | {case.reference: reference})
    mean = reference.value
    values = " ".join(f"{x:.4g}" for x in mean.value)
    print(f"{case.name:30s} {values:28s} ±{mean.relative_error:.2%} {time.perf_counter() - start:5.1f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    if options.table:
        from photon_bake.tests.host.cases.table import write_rows, write_table

        if options.only:
            write_rows([case for case in chosen(options) if case.runs_here])
        else:
            write_table()
    elif options.list:
        print(*(f"{case.group}: {case.name}: {case.title}" for case in CASES.values()), sep="\n")
    else:
        for case in chosen(options):
            if case.runs_here:
                make(case)


if __name__ == "__main__":
    main()
