"""chipwise: stock-aware feed and machining cycles for LinuxCNC."""
