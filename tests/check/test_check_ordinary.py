# SPDX-License-Identifier: GPL-2.0-or-later
"""Some of the sixty programs of bench/bench_any_program.py: each is answered, and what is found in them is true by an
oracle written apart."""

import pytest

from support import ordinary_oracle, ordinary_programs
from support.check_runs import chipwise_check

pytestmark = pytest.mark.xdist_group("check_ordinary")  # the programs are judged once

MOST_RATE = 12.0  # of tool 1 in configs/tools.toml, cm3/min


def some():
    """{name: (bytes, clothes)} of one program of each work, each in other clothes."""
    found = {}
    for name, made in ordinary_programs.programs(1).items():
        if (
            not any(made[1] == other[1] for other in found.values())
            and "engrave" not in name
            and not name.startswith(("estlcam", "openbuilds", "jscut"))
        ):
            found[name] = made
    return found


@pytest.fixture(scope="module", name="judged")
def judge(tmp_path_factory):
    texts = some()
    assert {clothes for _data, clothes in texts.values()} == set(ordinary_programs.CLOTHES)
    _status, out, _err, report = chipwise_check(
        tmp_path_factory.mktemp("ordinary"), {name: data for name, (data, _clothes) in texts.items()}
    )
    return texts, out, {program["program"].rpartition("/")[2]: program for program in report["programs"]}


def test_each_is_answered(judged):
    texts, out, found = judged
    assert len(found) == len(texts)
    for name, program in found.items():
        assert program["error"] is None and program["tools"][0]["volume_mm3"] > 100 and program["extents_mm"], (
            name,
            out,
        )
        lacks = [one["tool"] for one in program["findings"] if one["rule"] == "machine"]
        assert lacks == ([ordinary_programs.STRANGE] if texts[name][1] == "strange" else []), (name, out)


def test_findings_are_true_and_volumes_right(judged):
    texts, _out, found = judged
    for name, program in found.items():
        tool = program["tools"][0]
        truth = ordinary_oracle.truth(
            texts[name][0].decode(), program["stock"]["min"], program["stock"]["max"], tool["diameter_mm"]
        )
        assert tool["volume_mm3"] == pytest.approx(truth.volume, rel=0.02, abs=3.0), name
        assert not [one for one in program["findings"] if one["rule"] in ("rapid", "flute", "holder", "clearance")], (
            name
        )
        rates = [one for one in program["findings"] if one["rule"] == "rate"]
        for one in rates:
            assert (
                max(truth.rate.get(line, 0.0) for line in range(one["line"], one["last_line"] + 1)) > 0.97 * MOST_RATE
            ), (name, one)
        if tool["tool"] == 1:
            named = {line for one in rates for line in range(one["line"], one["last_line"] + 1)}
            assert not [line for line, rate in truth.inner.items() if rate > 1.3 * MOST_RATE and line not in named], (
                name
            )


def test_the_oracle_sees_a_traverse_and_a_rate():
    """A slot of 4 mm at F1200 is 28.8 cm3/min; a traverse through what is left."""
    text = "G21 G90\nG0 X-10 Y10 Z5\nG0 Z-4\nG1 X60 F1200\nG0 X80\nG0 Z5\nG0 Y30\nG0 Z-3\nM2\n"
    truth = ordinary_oracle.truth(text, (0, 0, -10), (100, 40, 0), 6.0)
    assert (
        truth.inner[4] == pytest.approx(28.8, rel=0.02)
        and truth.depth[4] == pytest.approx(4.0)
        and truth.rapid[5] == pytest.approx(4.0)
    )
    assert truth.beside >= {8} and truth.rapid[8] == pytest.approx(3.0, rel=0.01)
