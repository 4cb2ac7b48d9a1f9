"""What reader_runner.py writes and judge.py reads: one record of WIDTH doubles is kind, line and its values.

mm, mm/min, machine coordinates of the tool's tip:
    RAPID, FEED, ARC    x y z feed first      ARC: a chord of one, first: 1 on the first chord
    TOOL                number, diameter (mm; 0: none)
    STOCK               shape (-1: of a file that only the machine has), turn, low x y z, high x y z      of M250, M254
    VOLUME              mode, target, lower (mm3/min), ceiling (mm/min; 0: none)      of M251, M252
    DWELL               seconds
    FRAME               turn (rad), offset of the coordinate system x y z, G92 offset x y z (before the turn)
"""

RAPID, FEED, ARC, TOOL, STOCK, VOLUME, DWELL, FRAME = range(8)
WIDTH = 10
