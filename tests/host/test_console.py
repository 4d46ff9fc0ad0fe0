"""Progress on a terminal and in a log."""

from io import StringIO

from photon_bake.operators.command_line.console import ProgressLine


class Terminal(StringIO):
    def isatty(self):
        return True


def followed(stream):
    """A stage of a quarter and one of three quarters, two times, and then one that was not counted on."""
    line = ProgressLine(stream, {"Reading": 1.0, "Gathering": 3.0}, n_times=2)
    for _ in range(2):
        line("Reading", 0.0)
        line("Reading", 1.0)
        line("Gathering", 0.0)
        line("Gathering", 1.0)
        line.next_time()
    line("Saving", 0.0)
    line.clear()
    return stream.getvalue()


def test_a_log_has_a_line_a_stage_with_the_share_of_the_whole():
    stages = ["Reading (0%", "Gathering (12%", "Reading (50%", "Gathering (62%", "Saving (100%"]
    assert followed(StringIO()).splitlines() == [f"photon_bake: {stage}, 0.0 s)" for stage in stages]


def test_a_terminal_has_one_line_with_a_bar_that_is_wiped_at_the_end(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    written = followed(Terminal())
    assert "\n" not in written and written.endswith("\r\033[K")
    assert "\rphoton_bake: [###############.........]  62% Gathering, 0.0 s\033[K" in written
