# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check on programs with a part that cannot be judged: the rest is, and the line is said."""

import pytest

from support.check_runs import SLOT, STOCK, chipwise_check, mill_with_tools
from support.setup_runs import chipwise_setup


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def checked(tmp_path, machine, text, *options):
    """-> (stdout, the program's JSON)."""
    _status, out, _err, report = chipwise_check(tmp_path, {"part.ngc": text}, *options, machine=machine)
    program = report["programs"][0]
    assert program["error"] is None, out
    return out, program


def test_inverse_time_counts_at_the_feed_that_follows(tmp_path, machine):
    """60 mm and 30 mm at F4 and F8 (1/min) are 240 mm/min each, as in G94."""
    timed = SLOT.replace("G1 X110 F400", "G93 G1 X50 F4\nX80 F8\nG94 G1 X110 F400")
    plain = SLOT.replace("G1 X110 F400", "G1 X50 F240\nX80 F240\nG1 X110 F400")
    out, program = checked(tmp_path, machine, timed)
    _, other = checked(tmp_path, machine, plain)
    assert "line 7: G93 (inverse time)" in out or "line 8: G93 (inverse time)" in out, out
    assert program["tools"][0]["feed_s"] == pytest.approx(other["tools"][0]["feed_s"], rel=1e-6)
    assert program["tools"][0]["volume_mm3"] == pytest.approx(other["tools"][0]["volume_mm3"], rel=1e-9)


def test_a_feed_per_revolution_counts_at_the_speed(tmp_path, machine):
    """0.05 mm at S8000, then at S4000, an arc too."""
    turned = SLOT.replace("G1 X110 F400", "G95 G1 X50 F0.05\nS4000 X80\nG2 X90 I5\nG94 G1 X110 F400")
    plain = SLOT.replace("G1 X110 F400", "G1 X50 F400\nX80 F200\nG2 X90 I5\nG1 X110 F400")
    out, program = checked(tmp_path, machine, turned)
    _, other = checked(tmp_path, machine, plain)
    assert "line 7: G95 (feed per revolution): it is judged at the feeds that follow from S" in out, out
    assert program["tools"][0]["feed_s"] == pytest.approx(
        other["tools"][0]["feed_s"], rel=0.01
    )  # a change of speed stops the machine
    assert program["tools"][0]["volume_mm3"] == pytest.approx(other["tools"][0]["volume_mm3"], rel=1e-6)


def test_a_program_without_an_end_is_judged(tmp_path, machine):
    out, program = checked(tmp_path, machine, SLOT.replace("M2\n", ""))
    _, whole = checked(tmp_path, machine, SLOT)
    assert (
        "it has no M2, M30 or second %" in out
        and program["tools"][0]["volume_mm3"] == whole["tools"][0]["volume_mm3"] > 0
    )


def test_it_is_judged_up_to_a_rotary_axis(tmp_path, machine):
    path = machine
    path.write_text(
        path.read_text()
        .replace("COORDINATES = X Y Z", "COORDINATES = X Y Z A")
        .replace("COORDINATES = XYZ", "COORDINATES = XYZA")
    )
    _, whole = checked(tmp_path, path, SLOT)
    out, program = checked(tmp_path, path, SLOT.replace("M2\n", "G0 A90\nG0 X50\nG1 Z-15\nM2\n"))
    assert "line 9: a rotary axis moves: it is judged up to here" in out
    assert program["tools"][0]["volume_mm3"] == whole["tools"][0]["volume_mm3"] and not program["findings"][1:]


def test_a_zero_that_is_probed_carries_the_stock(tmp_path, machine):
    """The usual plate: the zero of Z lies where the probe ends, and the stock of --stock, or the assumed one, below it.
    `setup` does not put one there."""
    probed = SLOT.replace(STOCK, "").replace("G0 X-10", "G0 X-10 Y30 Z5\nG38.2 Z-25 F50\nG92 Z3\nG0 Z10\nG0 X-10")
    plain = SLOT.replace(STOCK, "")
    stock = ("--stock", "0", "0", "-20", "100", "60", "0")
    _, whole = checked(tmp_path, machine, plain, *stock)
    out, program = checked(tmp_path, machine, probed, *stock)
    assert "the program probes (G38)" in out and program["tools"][0]["volume_mm3"] == pytest.approx(
        whole["tools"][0]["volume_mm3"], rel=1e-3
    )
    assert program["tools"][0]["depth_mm"] == pytest.approx(4.0, abs=0.01)
    alone, assumed = (checked(tmp_path, machine, text)[1] for text in (plain, probed))
    assert assumed["stock"] == alone["stock"] and assumed["tools"][0]["volume_mm3"] == pytest.approx(
        alone["tools"][0]["volume_mm3"], rel=1e-3
    )
    early = probed.replace("G0 X-10 Y30 Z5\n", "", 1)  # the probe is the first move
    for text, options in ((probed, stock), (probed, ()), (early, ())):
        status, out, _err, report = chipwise_setup(tmp_path, text, "--yes", *options, machine=machine)
        assert (
            status == 2 and report["error"].startswith("the program probes its zero (G38)") and report["error_line"] > 2
        ), out
    status, out, _err, report = chipwise_setup(
        tmp_path, probed.replace("G0 Z10\n", "G0 Z10\n" + STOCK), machine=machine
    )
    assert status == 0 and report["stock"]["source"] == "program", out
