# SPDX-License-Identifier: GPL-2.0-or-later
"""Job files: confirmed by a person only, of one program only, whole or not there; and hostile ones."""

import os
import pty
import select
import subprocess
import tomllib
from dataclasses import replace

import pytest

from chipwise.clamps.clamp import Clamp
from chipwise.errors import CycleError
from chipwise.setup import job as jobs
from chipwise.setup import job_process
from support.check_runs import CHIPWISE, chipwise_check, mill_with_tools
from support.setup_runs import chipwise_setup
from support.scenes import SCENE

SLOT = "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"
JOB = jobs.Job(
    "part.ngc",
    "0" * 64,
    (0.0, 0.0, -20.0),
    (100.0, 60.0, 0.0),
    "option",
    "6061",
    {1: jobs.JobTool(6.0, 9600.0, 2.0), 4: jobs.JobTool(3.0, None, 1.0)},
)

STOCK = ("0", "0", "-20", "100", "60", "0")


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def confirmed(tmp_path, machine, *options, text=SLOT, name="part.ngc"):
    """-> (exit status, all it said, JSON) of setup --yes."""
    status, out, err, report = chipwise_setup(tmp_path, text, "--yes", *options, machine=machine, name=name)
    return status, out + err, report


def test_a_job_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "part.job.toml"
    jobs.write(str(path), JOB)
    assert jobs.read(str(path)) == JOB == jobs.as_written(JOB) and [p.name for p in tmp_path.iterdir()] == [
        "part.job.toml"
    ]
    free = jobs.Job(
        *(getattr(JOB, key) for key in ("program", "digest", "low", "high", "source", "material", "tools")), True
    )
    assert jobs.as_written(free) == free and not JOB.air
    clamps = {
        "jaw": Clamp(0, 0.0, (40.0, -12.0, -20.0), (60.5, -2.0, 8.0), "clamp jaw of the set-up of part.ngc"),
        "post": Clamp(1, 0.0, (75.0, 70.0, -20.0), (85.0, 80.0, 8.0), "clamp post of the set-up of part.ngc"),
    }
    held = replace(JOB, set_up=2, clamps=clamps)
    assert (
        jobs.as_written(held) == held != JOB
        and "clamps = 2" in jobs.text_of(held)
        and "cylinder = [80, 75, -20, 8, 10]" in jobs.text_of(held)
    )
    odd = jobs.Job(
        'a "b" \\ \u00e9 \U0001f600 c.ngc',
        *(getattr(JOB, key) for key in ("digest", "low", "high", "source", "material", "tools")),
    )
    assert jobs.as_written(odd) == odd
    assert (
        jobs.path_of("/a/b.c/part.v2.ngc") == "/a/b.c/part.v2.job.toml"
        and jobs.path_of("/a/part.nc", "/jobs") == "/jobs/part.job.toml"
    )


def test_yes_confirms_and_nothing_else_does(tmp_path, machine):
    job, text = tmp_path / "part.job.toml", SLOT.replace("F400", "F400\nG1 Y32\nG1 X-10")  # the way back is a light cut
    status, out, _err, report = chipwise_setup(tmp_path, text, machine=machine)
    assert (
        status == 0
        and not report["confirmed"]
        and report["job"] is None
        and "--yes confirms" in out
        and not job.exists()
    )
    before = (tmp_path / "part.ngc").read_bytes()
    status, said, report = confirmed(tmp_path, machine, "--material", "6061", text=text)
    assert status == 0 and report["confirmed"] and report["job"] == str(job) and f"confirmed: {job}" in said
    found = tomllib.loads(job.read_text())
    assert (
        (tmp_path / "part.ngc").read_bytes() == before
        and found["material"] == "6061"
        and found["program"] == "part.ngc"
    )
    assert found["stock"]["min"] == report["stock"]["min"] and found["stock"]["source"] == "assumed"
    assert (
        found["tool"]["1"]["target"] * 1000 == pytest.approx(report["tools"][0]["target_mm3_min"], rel=1e-4)
        and found["tool"]["1"]["ceiling"] == 2
    )
    _status, out, _err, report = chipwise_setup(tmp_path, text, "--material", "6061", machine=machine)
    assert report["confirmed"] and "confirmed before" in out


def test_clamps_of_a_set_up(tmp_path, machine):
    """check and setup judge by them and name them; they stay where none are named."""
    (machine.parent / "clamps.toml").write_text("[set_up.2.clamp.vice]\nbox = [300, 300, -20, 310, 310, 8]\n")
    _status, said, report = confirmed(
        tmp_path, machine, "--clamps", "2", "--clamp-box", "jaw", "40", "33.5", "-20", "60", "50", "8"
    )
    names = "the clamps of its set-up count: clamp vice of set-up 2, clamp jaw of the set-up of part.ngc"
    assert (
        report["confirmed"]
        and report["clamps"] == {"set_up": 2, "own": {"jaw": {"min": [40, 33.5, -20], "max": [60, 50, 8]}}}
        and names in said
    )
    found = tomllib.loads((tmp_path / "part.job.toml").read_text())
    assert (
        found["clamps"] == 2
        and found["clamp"] == {"jaw": {"box": [40, 33.5, -20, 60, 50, 8]}}
        and report["findings"] > 0
    )
    _status, said, _err, checked = chipwise_check(tmp_path, {"part.ngc": SLOT}, "--stock", *STOCK, machine=machine)
    (near,) = (finding for finding in checked["programs"][0]["findings"] if finding["rule"] == "clamp")
    assert (
        "clamp jaw of the set-up of part.ngc" in near["text"]
        and near["line"] == near["last_line"] == 6
        and names in said
    )
    _status, said, report = confirmed(tmp_path, machine, text=None)
    assert report["clamps"]["set_up"] == 2 and "confirmed before" in said
    _status, said, report = confirmed(tmp_path, machine, "--clamps", "0", text=None)
    assert (
        report["clamps"] == {"set_up": 0, "own": {}}
        and "clamp" not in (tmp_path / "part.job.toml").read_text()
        and "the clamps of its" not in said
    )


@pytest.mark.parametrize(
    "options, wanted",
    [
        (("--clamps", "1000"), "--clamps 1000 is not from 0 to 999"),
        (("--clamps", "7"), "there is no set-up P7 of clamps"),
        (("--clamp-cylinder", "post", "1", "2", "3", "4", "x"), "clamp post: 1 2 3 4 x are not numbers"),
        (("--clamp-box", "a b", "1", "2", "3", "4", "5", "6"), "other characters than letters"),
        (("--clamp-box", "jaw", "1", "2", "3", "0", "5", "6"), "it has no extent in X"),
        (
            ("--clamp-box", "a", "1", "2", "3", "4", "5", "6", "--clamp-cylinder", "a", "1", "2", "3", "4", "5"),
            "the clamp a is named twice",
        ),
    ],
)
def test_clamps_that_cannot_be(tmp_path, machine, options, wanted):
    status, said, _report = confirmed(tmp_path, machine, *options)
    assert status == 2 and wanted in said and not (tmp_path / "part.job.toml").exists()


def test_clamps_of_the_job_on_the_machine(tmp_path, machine):
    """Those of a set-up of M256 are where they are, its own where the first move is."""
    part = tmp_path / "part.ngc"
    part.write_text(SLOT)
    (machine.parent / "clamps.toml").write_text("[set_up.2.clamp.vice]\nbox = [1, 2, 3, 4, 5, 6]\n")
    own = {"jaw": Clamp(1, 0.0, (10.0, 20.0, -5.0), (16.0, 26.0, 5.0), "clamp jaw of the set-up of part.ngc")}
    wanted = replace(JOB, digest=jobs.digest_of(str(part)), set_up=2, clamps=own)
    jobs.write(str(tmp_path / "part.job.toml"), wanted)
    turned = {**SCENE, "offset": [100.0, 50.0, 7.0], "turn": 90.0}
    order = {"ini": str(machine), "program": str(part), "job": str(part.with_name("part.job.toml")), "scene": turned}
    vice, jaw = job_process.answer(order, str(tmp_path))["clamps"]
    assert vice == [0, 0.0, (1, 2, 3), (4, 5, 6), "clamp vice of set-up 2"]
    assert (
        jaw[0] == 1
        and jaw[1] == pytest.approx(90.0)
        and jaw[2] == pytest.approx((100 - 26, 50 + 10, 2))
        and jaw[3] == pytest.approx((100 - 20, 50 + 16, 12))
    )
    jobs.write(str(tmp_path / "part.job.toml"), replace(wanted, set_up=3))
    with pytest.raises(CycleError, match="there is no set-up P3 of clamps; there are 2"):
        job_process.answer(order, str(tmp_path))


def test_a_changed_program_asks_again(tmp_path, machine):
    job = tmp_path / "part.job.toml"
    confirmed(tmp_path, machine)
    old = job.read_bytes()
    _status, out, _err, report = chipwise_setup(tmp_path, SLOT.replace("F400", "F450"), machine=machine)
    assert (
        not report["confirmed"]
        and "the program was changed since it was set up in part.job.toml" in out
        and job.read_bytes() == old
    )
    _status, _said, report = confirmed(tmp_path, machine, text=SLOT.replace("F400", "F450"))
    assert (
        report["confirmed"] and jobs.read(str(job)).digest == report["sha256"] != tomllib.loads(old.decode())["sha256"]
    )
    _status, out, _err, report = chipwise_setup(
        tmp_path, None, "--stock", "0", "0", "-20", "100", "60", "0", machine=machine
    )
    assert not report["confirmed"] and "has another set-up of this program" in out


def test_the_folder_of_jobs(tmp_path, machine):
    folder = machine.parent / "jobs"
    folder.mkdir()
    machine.write_text(machine.read_text().replace("\n[CHIPWISE]\n", "\n[CHIPWISE]\nJOBS = jobs\n"))
    status, _said, report = confirmed(tmp_path, machine)
    assert status == 0, _said
    assert report["job"] == str(folder / "part.job.toml") and not (tmp_path / "part.job.toml").exists()
    folder.joinpath("part.job.toml").unlink()
    folder.rmdir()
    status, said, report = confirmed(tmp_path, machine)
    assert (
        status == 2
        and not report["confirmed"]
        and "part.job.toml cannot be written: No such file or directory; use a folder" in said
    )


def test_another_programs_job_stays(tmp_path, machine):
    """part.ngc and part.nc have one job file."""
    confirmed(tmp_path, machine)
    old = (tmp_path / "part.job.toml").read_bytes()
    status, said, report = confirmed(tmp_path, machine, name="part.nc")
    assert (
        status == 2
        and not report["confirmed"]
        and "part.job.toml is the set-up of part.ngc; remove that file, or rename" in said
    )
    assert (tmp_path / "part.job.toml").read_bytes() == old


def answered(tmp_path, machine, answer):
    """What is on the terminal of a set-up that is answered."""
    (tmp_path / "part.ngc").write_text(SLOT)
    ours, its = pty.openpty()
    with subprocess.Popen(
        [CHIPWISE, "setup", str(tmp_path / "part.ngc"), "--ini", str(machine)],
        stdin=its,
        stdout=its,
        stderr=its,
        start_new_session=True,
    ) as process:
        os.close(its)
        said = b""
        while b"[y/N]" not in said:
            assert select.select([ours], [], [], 120)[0], said
            said += os.read(ours, 4096)
        os.write(ours, answer)
        assert process.wait(300) == 0
    os.close(ours)
    return (tmp_path / "part.job.toml").exists()


def test_a_person_at_a_terminal_is_asked(tmp_path, machine):
    assert (
        not answered(tmp_path, machine, b"\n")
        and not answered(tmp_path, machine, b"no\n")
        and not answered(tmp_path, machine, b"\x04")
    )
    assert answered(tmp_path, machine, b"y\n")


# ---- hostile ---------------------------------------------------------------------------------------------------------


GOOD = jobs.text_of(JOB)
BAD = {
    "binary": b"\x00\xff\xfe",
    "words": b"this is my grocery list\n",
    "empty": b"",
    "huge": b"# " + b"x" * (jobs.MAX_BYTES + 1),
    "nested": b"a = " + b"[" * 100_000,
    "nested tables": ("format = 1\n[" + ".".join(["a"] * 50_000) + "]\n").encode(),
    "long number": b"format = " + b"9" * 6000,
    "other format": GOOD.replace("format = 1", "format = 2").encode(),
    "true": GOOD.replace("format = 1", "format = true").encode(),
    "air of a number": GOOD.replace("format = 1", "format = 1\nair = 1").encode(),
    "no program": GOOD.replace('program = "part.ngc"\n', "").encode(),
    "program is a number": GOOD.replace('"part.ngc"', "7").encode(),
    "line break": GOOD.replace('"part.ngc"', '"part\\n.ngc"').encode(),
    "digest": GOOD.replace("0" * 64, "zz").encode(),
    "stock": GOOD.replace("[0, 0, -20]", "[0, 0]").encode(),
    "stock nan": GOOD.replace("[0, 0, -20]", "[0, nan, -20]").encode(),
    "stock inf": GOOD.replace("[0, 0, -20]", "[0, 0, -inf]").encode(),
    "stock bool": GOOD.replace("[0, 0, -20]", "[0, 0, true]").encode(),
    "stock far": GOOD.replace("[0, 0, -20]", "[0, 0, -1e300]").encode(),
    "stock empty": GOOD.replace("[0, 0, -20]", "[0, 0, 0]").encode(),
    "source": GOOD.replace('"option"', '"guess"').encode(),
    "clamps": GOOD.replace("format = 1", "format = 1\nclamps = 1000").encode(),
    "clamps true": GOOD.replace("format = 1", "format = 1\nclamps = true").encode(),
    "clamp": (GOOD + "[clamp.jaw]\nbox = [0, 0, 0, 1, 1]\n").encode(),
    "clamp name": (GOOD + '[clamp."a b"]\nbox = [0, 0, 0, 1, 1, 1]\n').encode(),
    "clamp nan": (GOOD + "[clamp.jaw]\nbox = [0, 0, 0, 1, 1, nan]\n").encode(),
    "clamp number": GOOD.replace("format = 1", "format = 1\nclamp = 7").encode(),
    "many clamps": (GOOD + "".join(f"[clamp.c{n}]\nbox = [0, 0, 0, 1, 1, 1]\n" for n in range(101))).encode(),
    "target": GOOD.replace("target = 9.6", "target = 1e9").encode(),
    "target nan": GOOD.replace("target = 9.6", "target = nan").encode(),
    "target below": GOOD.replace("target = 9.6", "target = -1").encode(),
    "ceiling": GOOD.replace("ceiling = 2", "ceiling = 50").encode(),
    "ceiling below": GOOD.replace("ceiling = 2", "ceiling = 0.5").encode(),
    "half": GOOD.replace("ceiling = 2      # times F\n", "").encode(),
    "tool text": GOOD.replace("[tool.4]", "[tool.four]").encode(),
    "tool zeros": GOOD.replace("[tool.4]", "[tool.04]").encode(),
    "tool long": GOOD.replace("[tool.4]", "[tool." + "4" * 5000 + "]").encode(),
    "no tools": GOOD.partition("[tool.1]")[0].encode(),
    "many tools": (GOOD + "".join(f"[tool.{n}]\ndiameter = 1\n" for n in range(100, 400))).encode(),
    "extra": (GOOD + "[other]\na = 1\n").encode(),
    "tools are a list": (GOOD.partition("[tool.1]")[0] + "[[tool]]\ndiameter = 1\n").encode(),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_no_job(tmp_path, name):
    path = tmp_path / "part.job.toml"
    path.write_bytes(BAD[name])
    with pytest.raises(CycleError) as error:
        jobs.read(str(path))
    text = str(error.value)
    assert "part.job.toml" in text and "set the program up again" in text and "\n" not in text and len(text) < 250
    with pytest.raises(CycleError):
        jobs.write(str(path), JOB)
    assert path.read_bytes() == BAD[name] and [p.name for p in tmp_path.iterdir()] == ["part.job.toml"]
    found, why = jobs.state_of(str(path), "part.ngc", "0" * 64)
    assert found is None and "part.job.toml" in why


def test_the_good_one_is_good(tmp_path):
    path = tmp_path / "part.job.toml"
    path.write_text(GOOD)
    assert jobs.read(str(path)) == JOB
    assert jobs.state_of(str(path), "/somewhere/part.ngc", "0" * 64) == (JOB, "")
    assert (
        jobs.state_of(str(path), "part.ngc", "1" * 64)[0] is None
        and jobs.state_of(str(path), "part.nc", "0" * 64)[0] is None
    )


def test_links_folders_and_pipes(tmp_path, machine):
    """Nothing is written through a link, and nothing waits for a pipe."""
    job, elsewhere = tmp_path / "part.job.toml", tmp_path / "precious"
    elsewhere.write_text("precious")
    for make in (
        lambda: job.symlink_to(elsewhere),
        lambda: job.symlink_to(tmp_path / "nowhere"),
        lambda: os.mkfifo(job),
        job.mkdir,
    ):
        make()
        status, said, report = confirmed(tmp_path, machine)
        assert status == 2 and not report["confirmed"] and report["error"] and "part.job.toml" in said, said
        assert elsewhere.read_text() == "precious" and not (tmp_path / "nowhere").exists()
        os.rmdir(job) if job.is_dir() and not job.is_symlink() else job.unlink()


def test_a_folder_that_cannot_be_written(tmp_path, monkeypatch):
    """As root every folder can be written: the system's answer is made."""

    def refused(*_arguments, **_words):
        raise PermissionError(13, "Permission denied", str(tmp_path))

    monkeypatch.setattr("chipwise.host.files.tempfile.mkstemp", refused)
    with pytest.raises(
        CycleError,
        match="part.job.toml cannot be written: Permission denied; use a folder that you may write, or set "
        ".CHIPWISE.JOBS",
    ):
        jobs.write(str(tmp_path / "part.job.toml"), JOB)


def test_a_write_that_is_cut_off_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "part.job.toml"
    jobs.write(str(path), JOB)
    old = path.read_bytes()

    def full(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("chipwise.host.files.os.fsync", full)
    with pytest.raises(CycleError, match="No space left"):
        jobs.write(str(path), JOB)
    assert path.read_bytes() == old and [p.name for p in tmp_path.iterdir()] == ["part.job.toml"]


def test_odd_material_and_options(tmp_path, machine):
    for options in (("--material", "a\nb"), ("--material", "x" * 300), ("--stock", "0", "0", "0", "1", "1", "0")):
        status, said, report = confirmed(tmp_path, machine, *options)
        assert status == 2 and report is None and said.count("\n") <= 1, said
    (tmp_path / "part.job.toml").unlink(missing_ok=True)
    (tmp_path / "own.toml").write_text("['Al \"6061\" \\ é']\nkc11 = 800\nmc = 0.25\n")
    machine.write_text(
        machine.read_text().replace("\n[CHIPWISE]\n", f"\n[CHIPWISE]\nMATERIALS = {tmp_path}/own.toml\n", 1)
    )
    status, said, report = confirmed(tmp_path, machine, "--material", 'Al "6061" \\ é')
    assert status == 0 and jobs.read(report["job"]).material == 'Al "6061" \\ é'


@pytest.mark.parametrize("name, like", [("6016", "use 6061"), ("oak", "use a name of docs/user/materials.md")])
def test_a_material_that_is_in_no_table(tmp_path, machine, name, like):
    status, said, report = confirmed(tmp_path, machine, "--material", name)
    assert status == 2 and report is None and f"the material {name} is not known; {like}" in said, said
    assert not (tmp_path / "part.job.toml").exists()


def test_the_material_is_in_force_in_setup_and_check(tmp_path, machine):
    """Comment, then set-up, then INI; in check only while the file of the set-up is that of this program."""
    tools = machine.with_name("tools.toml")
    tools.write_text(tools.read_text().replace("[tool.1]", "[tool.1]\nflutes = 2\n", 1))
    machine.write_text(
        machine.read_text().replace("\n[CHIPWISE]\n", "\n[CHIPWISE]\nSPINDLE_POWER = 900\nMATERIAL = 6061\n", 1)
    )

    def power(status, said, report):
        assert status == 0, said
        return report["tools"][0]["power_w"]

    def checked(text=SLOT):
        _status, _out, _err, report = chipwise_check(tmp_path, {"part.ngc": text}, "--stock", *STOCK, machine=machine)
        return report["programs"][0]["tools"][0]["peak_power_w"], report["programs"][0]["notes"]

    ini = power(*confirmed(tmp_path, machine, "--stock", *STOCK))
    assert checked()[0] == pytest.approx(ini, rel=1e-6)
    steel = power(*confirmed(tmp_path, machine, "--stock", *STOCK, "--material", "C45"))
    assert steel == pytest.approx(ini * 1500 / 800 * (400 / 60 / (2 * 8000 / 60)) ** (0.25 - 0.22), rel=0.02)
    assert checked()[0] == pytest.approx(steel, rel=1e-6)
    commented = "(MATERIAL,NAME=6061)\n" + SLOT
    assert power(
        *confirmed(tmp_path, machine, "--stock", *STOCK, "--material", "C45", text=commented)
    ) == pytest.approx(ini, rel=1e-6)
    value, notes = checked(commented)
    assert value == pytest.approx(ini, rel=1e-6) and any(
        "the comment of the program names 6061" in text for _line, text in notes
    )
    assert checked(SLOT.replace("F400", "F401"))[0] == pytest.approx(ini, rel=0.01)  # another program now
