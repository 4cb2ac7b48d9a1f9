# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check and a program that restores a probed blank (M254): its doubt is in what the check says."""

import pytest

from chipwise.blank import doubt
from support.check_runs import SLOT, STOCK, chipwise_check, mill_with_tools

FIGURES = {"probed": 0.9, "doubt_mm": 0.12, "most_doubt_mm": 0.41}
SAID = (
    "M254 restores the probed blank of slot 1, which only the machine has: it may be up to 0.41 mm higher than the "
    "part, 0.12 mm on the average, 10% of it was not probed"
)


@pytest.mark.parametrize("code, named", [("M254 P1", True), ("M254 P2", False), ("M254 P1 R180 H1", False)])
def test_the_doubt_of_a_restored_blank(tmp_path, code, named):
    mill = mill_with_tools(tmp_path)
    stock = mill.parent / "stock"
    stock.mkdir(exist_ok=True)
    for slot, content in ((1, b"a stock" * 9), (2, b"another" * 9)):
        (stock / f"slot{slot}.stock").write_bytes(content)
    doubt.write(str(stock / "slot1.stock"), FIGURES)
    (stock / "slot2.stock.doubt").write_text((stock / "slot1.stock.doubt").read_text())  # of another stock
    status, said, errors, _found = chipwise_check(
        tmp_path, {"part.ngc": SLOT.replace(STOCK, code + "\n")}, machine=mill
    )
    assert status == 2 and (SAID in said + errors) == named and "M254 restores" in said + errors, said + errors
