# SPDX-License-Identifier: GPL-2.0-or-later
"""The limits of edges and spindle for the pins: the material of the loaded program, and what the spindle gives at its
speed.

Called by worker.py.  The material is that of the program's MATERIAL comment, else of the set-up in force, else of
[CHIPWISE]MATERIAL
(tool_data/materials.py); the power that of
[CHIPWISE]SPINDLE_POWER, times SPINDLE_EFFICIENCY.  What is not known limits nothing, and is said once for each program.
"""

from chipwise.tool_data.chip_loads import default_chip
from chipwise.errors import CycleError, unnamed
from chipwise.tool_data.materials import material_of
from chipwise.settings import edge_power

NO_MATERIAL = (
    "the power is not limited: no material is known; add (MATERIAL,NAME=6061) to the program, or set [CHIPWISE]MATERIAL"
)
DEFAULT = (
    "tool {tool} has no chip_load, so its chips are at most {chip:.3f} mm in {material} under M251; add chip_load to "
    "its tool geometry, or set "
    "[CHIPWISE]DEFAULT_CHIP = no"
)

UNBENT = "the bending of tool {tool} is not limited: its {what} is not known; add it to its tool geometry"
UNFORCED = (
    "the bending of tool {tool} is not limited: no material is known; add (MATERIAL,NAME=6061) to the program, "
    "or set [CHIPWISE]MATERIAL"
)


class Limits:
    """The pins specific-force, force-exponent and max-power."""

    def __init__(self, component, settings, saying):
        """saying: Saying of what lacks."""
        self.component, self.settings, self.saying = component, settings, saying
        self.text, self.job = "", ""  # of the program; the material of its set-up, a name
        self.material, self.told = None, set()  # told: (tool, mm, material) of default chips, words of bending
        self.problem, self.lacks = (
            "",
            False,
        )  # to be said: what is wrong with a name; there is none, and a limit needs one

    def program(self, text):
        """Another program, as bytes: its material."""
        self.text = text.decode("utf-8", "replace") if b"MATERIAL" in text.upper() else ""
        self.told = set()
        self._find("")
        if not (self.problem or self.lacks):
            self.saying.forget()

    def set_up(self, name, is_read):
        """At each look, the material of the set-up in force, '' for none; is_read: whether nothing more is to come, so
        that what lacks can be said."""
        if name != self.job:
            self._find(name)
        if not is_read:
            return
        if self.lacks:
            self.saying.tell(NO_MATERIAL)
        if self.problem:
            self.saying.tell(self.problem)
        self.problem, self.lacks = "", False

    def _find(self, job):
        found, problem, self.job = None, "", job
        try:
            found = material_of(self.text, self.settings["MATERIAL"], self.settings.path("MATERIALS"), job)
        except CycleError as error:
            problem = unnamed(error)
        self.material, self.problem = found, problem
        self.lacks = (
            not found and not problem and bool(self.settings["SPINDLE_POWER"] or self.settings["SPINDLE_TORQUE"])
        )
        self.component["specific-force"] = found.kc11 if found else 0.0
        self.component["force-exponent"] = found.mc if found else 0.0

    def default_chip(self, number, shape, units):
        """The largest chip (mm) of a tool without chip_load, said once; 0: none.  shape: Tool in machine units, `units`
        a mm."""
        material = self.material
        chip = (
            default_chip(shape.diameter / units, shape.cutting.flutes, material)
            if self.settings["DEFAULT_CHIP"]
            else 0.0
        )
        if chip and material and (number, chip, material.name) not in self.told:
            self.told.add((number, chip, material.name))
            self.saying.tell(DEFAULT.format(tool=number, chip=chip, material=material.name))
        return chip

    def note_bending(self, number, shape):
        """Say once for each tool of a program what its `deflection` lacks."""
        what = (
            UNBENT.format(tool=number, what=shape.shank.unbent)
            if shape.shank.unbent
            else UNFORCED.format(tool=number)
            if shape.shank.max_force and not self.material
            else ""
        )
        if what and what not in self.told:
            self.told.add(what)
            self.saying.tell(what)

    def speed(self, revolutions):
        """The commanded speed of the spindle, 1/min."""
        self.component["max-power"] = edge_power(self.settings, abs(revolutions))
