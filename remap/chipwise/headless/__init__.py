# SPDX-License-Identifier: GPL-2.0-or-later
"""A whole LinuxCNC without a screen: one program, driven from outside, and what it did.

runner.py      starts LinuxCNC in a sandbox and returns the summary of the run
display.py     the display program that LinuxCNC starts (bin/chipwise-headless)
session.py     the steps of a run: switch on, home, open, run
sampling.py    the servo-period log through HAL's sampler
log.py         that log: rates, volumes, figures
"""
