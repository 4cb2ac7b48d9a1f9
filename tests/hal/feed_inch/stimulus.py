"""The cases of feed_law, in inch."""
from halrig import HERE, load_module

LENGTHS = ("programmed-vel", "requested-vel", "acceleration", "distance-first", "distance-last")


def stimulus():
    rows = load_module(HERE / "feed_law/stimulus.py").stimulus()
    for name in LENGTHS:
        rows.columns[name] = [value / 25.4 for value in rows.columns[name]]
    return rows
