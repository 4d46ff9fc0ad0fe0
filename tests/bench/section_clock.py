"""What a call's time goes to, by the hook that Python has for profilers."""

import sys
from collections import Counter
from time import thread_time

REST = "Rest"


def section_shares(function, sections):
    """Share of the processor time of ``function()`` in each section, and in the rest; only this thread's.

    Time counts for the innermost function that is listed: what it calls is its own, unless that is listed too.

    Parameters
    ----------
    function : callable
    sections : dict of str to list of functions
    """
    section_of = {one.__code__: name for name, functions in sections.items() for one in functions}
    spent, stack, last = Counter(), [REST], thread_time()

    def look(frame, event, _):
        nonlocal last
        section = section_of.get(frame.f_code)
        if section is None or event not in ("call", "return"):
            return
        now = thread_time()
        spent[stack[-1]] += now - last
        last = now
        if event == "call":
            stack.append(section)
        else:
            stack.pop()

    sys.setprofile(look)
    try:
        function()
    finally:
        sys.setprofile(None)
    spent[REST] += thread_time() - last
    return {name: spent[name] / spent.total() for name in (*sections, REST)}
