"""The slot of tracker_slot, in inch."""
from halrig import HERE, load_module


def stimulus():
    return load_module(HERE / "tracker_slot/stimulus.py").stimulus(scale=1 / 25.4)
