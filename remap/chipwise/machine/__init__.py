"""Driving a whole LinuxCNC from outside and reading what it did."""
