"""Each phase: five rows of the inputs named; what is not named keeps its value."""
from halrig import Stimulus

NAMES = ("rapid-contact", "flute-excess", "disobeyed", "rapid-distance", "depth", "motion-type", "coord-mode",
         "program-line", "release", "inhibit-in", "hold-in")
PHASES = {      # phase: (inputs, stop, reason)
    "idle": (dict(), 0, 0),
    "moving": ({"motion-type": 1, "coord-mode": 1, "program-line": 7}, 0, 0),
    "contact": ({"rapid-contact": 1, "rapid-distance": 12.5, "depth": 3.0}, 1, 1),
    "contact gone, standing": ({"rapid-contact": 0, "rapid-distance": 0.0, "program-line": 8}, 1, 1),
    "flute while stopped": ({"flute-excess": 1}, 1, 1),
    "aborted": ({"motion-type": 0, "flute-excess": 0}, 0, 0),
    "feed": ({"motion-type": 2, "program-line": 9}, 0, 0),
    "flute": ({"flute-excess": 1, "depth": 4.5}, 1, 2),
    "deeper": ({"depth": 4.75}, 1, 2),
    "less deep": ({"depth": 4.25}, 1, 2),
    "released": ({"release": 1}, 0, 0),
    "release kept down": ({}, 0, 0),
    "excess over": ({"flute-excess": 0, "release": 0}, 0, 0),
    "excess again": ({"flute-excess": 1}, 1, 2),
    "to manual": ({"coord-mode": 0}, 0, 0),
    "contact while jogging": ({"rapid-contact": 1}, 0, 0),
    "back": ({"rapid-contact": 0, "flute-excess": 0, "coord-mode": 1}, 0, 0),
    "disobeyed, not guarded": ({"disobeyed": 1}, 0, 0),
    "others inhibit": ({"inhibit-in": 1}, 0, 0),
    "others hold": ({"inhibit-in": 0, "hold-in": 1}, 0, 0),
    "others hold and so does the guard": ({"rapid-contact": 1}, 1, 1),
}
ROWS = 5


def stimulus():
    rows = Stimulus({name: [] for name in NAMES})
    for name, (inputs, _stop, _reason) in PHASES.items():
        rows.phase(name)
        for _ in range(ROWS):
            rows.add(inputs)
    return rows
