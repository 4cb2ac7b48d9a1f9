# SPDX-License-Identifier: GPL-2.0-or-later
"""What a typed line of data must give, written apart from remap/chipwise/entry: from docs/user, letter by letter, with
fractions.

expected("G79", "100,-8,,5")    ("G79", (("Q", 100), ("Z", -8), ("R", 5)))
expected("G79", "100,x")        2: the place at which the error must be
typed(code, rng)                a random line, right, wrong or doubtful
"""

from fractions import Fraction

DIGITS = "0123456789"

# Code: its data in order.  ! required; > above 0; + 0 or more; i whole; i3-7 a whole number from 3 to 7; {..} one of
# these
SPEC = {
    "G12": "X Y I!> Z! R K> Q> J> E> F> H{0}",
    "G13": "X Y I!> Z! R K> Q> J> E> F> H{0}",
    "G22": "X! Z! I K",
    "G23": "",
    "G24": "D!> Z! R Li-360-360 P{0,1,2} I+ K+ E> F>",
    "G26": "Qi!> Pi> D> I+ F!> E> H{0,1}",
    "G27": "Qi!> Li!> Pi> D> I+ F!> E> H{0,1}",
    "G75": "Qi!+ X Y Z R H{0,1,2,3} Li> I J K Pi0-999",
    "G77": "Qi!+ P!{41,42} Z! R I+ Li1-200 D> J> K> E> F> H{0}",
    "G78": "Qi!+ P!{41,42} Z! R I+ J> K> E> F> H{0}",
    "G79": "Qi!+ Z! D> R P{0,1,2,3} Li I+ K+ J> E> F> H{0}",
    "M250": "P Q R I> J> K>",
    "M251": "Q> P{1,2,3} R> E> I> J>",
    "M252": "",
    "M253": "P!i0-9",
    "M254": "P!i0-9 R{180} H{1,2} I J K",
    "M255": "P!i1-999 Q!i1-99 H{0,1}",
    "M256": "P!i0-999",
}


def expected(code, text):
    """(code, ((letter, Fraction), ..)) of a line, or the number of the first place that is wrong."""
    while text.endswith("\n") or text.endswith("\r"):
        text = text[:-1]
    data, places = SPEC[code].split(), text.split(",")
    if not data and all(letter in " \t" for letter in text):
        return code, ()
    found, spaced = [], any(blank + "," in text or "," + blank in text for blank in " \t")
    for k in range(max(len(places), len(data))):
        typed_here = places[k] if k < len(places) else ""
        if k < len(places) and doubtful(places, k, spaced) or k >= len(data):
            return k + 1
        bare = typed_here.strip(" \t")
        if bare == "":
            if "!" in data[k]:
                return k + 1
            continue
        value = number(bare)
        if value is None or not fits(data[k], value):
            return k + 1
        found.append((data[k][0], value))
    return code, tuple(found)


def doubtful(places, k, spaced):
    """Whether a place has a semicolon, or the comma behind it may be that of a decimal number."""
    if ";" in places[k]:
        return True
    if k + 1 == len(places) or places[k][-1:] not in tuple(DIGITS) or places[k + 1][:1] not in tuple(DIGITS):
        return False
    before, after = places[k].strip(" \t"), places[k + 1].strip(" \t")
    if before[0] == "-" and all(letter == "0" for letter in before[1:]):
        return True
    return spaced or len(after) > 1 and after[0] == "0" and all(letter in DIGITS for letter in after)


def number(text):
    """Fraction of a number as LinuxCNC writes it, None for anything else."""
    sign, body = (-1 if text[0] == "-" else 1), text[1:] if text[0] in "+-" else text
    before, point, behind = body.partition(".")
    if not before + behind or any(letter not in DIGITS for letter in before + behind):
        return None
    while before.startswith("0"):
        before = before[1:]
    while behind.endswith("0"):
        behind = behind[:-1]
    if len(before) > 9 or len(behind) > 9:
        return None
    value = Fraction(0)
    for letter in before + behind:
        value = 10 * value + DIGITS.index(letter)
    return sign * value / 10 ** len(behind)


def fits(datum, value):
    """Whether a datum of SPEC may have a value."""
    rule = datum[1:].replace("!", "")
    if "{" in rule:
        return value in [Fraction(text) for text in rule.strip("{}").split(",")]
    if rule.startswith("i"):
        if value.denominator != 1:
            return False
        rule = rule[1:]
    if rule == ">":
        return value > 0
    if rule == "+":
        return value >= 0
    if rule:
        low, high = (-360, 360) if rule == "-360-360" else map(int, rule.split("-"))
        return low <= value <= high
    return True


def meaning(line):
    """A G-code line as (code, ((letter, Fraction), ..)); None if LinuxCNC would not read it so."""
    code, *words = line.split(" ")
    values = [(word[:1], number(word[1:]) if word[1:] else None) for word in words]
    return None if any(not letter.isupper() or value is None for letter, value in values) else (code, tuple(values))


# ---- random lines ----------------------------------------------------------------------------------------------

WRONG = (
    "x",
    "1e3",
    "nan",
    "inf",
    "--1",
    "1.2.3",
    ".",
    "-",
    "+.",
    "0x10",
    "1 5",
    "\u0663",
    "1_0",
    "#1",
    "[1+2]",
    "Q1",
    "1.5mm",
    "\x00",
    "12345678901",
    "0.0000000001",
    "1\n2",
    "'",
    "1/2",
)


def typed(code, rng):
    """A random line for a code."""
    data = SPEC[code].split()
    count = rng.choice((len(data), len(data), rng.randint(0, len(data)), len(data) + rng.randint(0, 2)))
    places = [one(data[k] if k < len(data) else "X", rng) for k in range(count)]
    comma = rng.choice((",", ",", ", ", " , ", ",\t"))
    text = comma.join(places)
    if rng.random() < 0.05 and text:
        at = rng.randrange(len(text))
        text = text[:at] + rng.choice((",", ";", " ", ".", "-", ", ", "0", ",0")) + text[at + rng.randint(0, 1) :]
    if rng.random() < 0.04:  # a decimal comma
        text = text.replace(".", ",", 1)
    if rng.random() < 0.01:
        text = text.replace("-", "-0,", 1)
    return text + rng.choice(("", "", "\n", "\r\n"))


def one(datum, rng):
    """The text of one place, mostly right."""
    chance = rng.random()
    if chance < 0.02:
        return rng.choice(WRONG)
    if chance < (0.03 if "!" in datum else 0.45):
        return ""
    if "{" in datum:
        value = int(rng.choice(datum[datum.index("{") + 1 : -1].split(",")))
    elif "i" in datum:
        value = rng.choice((1, 2, 5, 9, rng.randint(1, 9), rng.randint(1, 250)))
    else:
        value = round(
            rng.choice((1, 1, 1, -1 if ">" not in datum and "+" not in datum else 1))
            * rng.choice((rng.uniform(0, 1), rng.uniform(0, 100), rng.randint(0, 50), rng.uniform(0, 1e4))),
            rng.randint(0, 6),
        )
    if rng.random() < 0.03:
        value = rng.choice((0, -1, -value, 0.5, 1000, 43, -361, 201))
    return written(value, rng)


def written(value, rng):
    """A number as somebody may write it."""
    text = f"{value:.6f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
    style = rng.random()
    if style < 0.05 and not text.startswith("-"):
        text = "+" + text
    elif style < 0.1:
        text += "0" if "." in text else rng.choice((".", ".0", ".00"))
    elif style < 0.15 and text.startswith("0."):
        text = text[1:]
    elif style < 0.17 and not text.startswith("-"):
        text = "0" + text
    return text
