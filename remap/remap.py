"""One short function per remapped code, named in the INI file's REMAP lines.

Each is called by the interpreter at read-ahead, with the words of its argspec: once in the preview, once in the task.
"""

from chipwise.glue import hole, session


def g12(self, **words):
    """G12: circular hole, cut clockwise."""
    return session.run_cycle(self, "G12", words, hole.request_of(ccw=False))


def g13(self, **words):
    """G13: circular hole, cut counter-clockwise."""
    return session.run_cycle(self, "G13", words, hole.request_of(ccw=True))
