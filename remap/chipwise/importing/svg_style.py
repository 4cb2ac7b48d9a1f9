# SPDX-License-Identifier: GPL-2.0-or-later
"""Style sheets of an SVG.  Called by svg_tree.py.

svgelements 1.7 looks a class, a tag or an id up by its bare name; it knows no `g rect`, no `!important` and no rule
behind an `@import`.  So what a sheet says is written into the elements, for the properties that tell whether something
is drawn.  Selectors: tags, classes, ids and attributes, joined by a blank or `>`; a rule of another selector (as
`:hover`) is left out.  Source: CSS 2.1, 5 and 6.4.
"""

import re

PROPERTIES = ("display", "visibility", "fill", "stroke", "clip-path", "mask", "transform")
MEDIA = ("all", "screen")
_HEAD, _BRACE = re.compile(r"\s*([^{};]*)([{;])"), re.compile(r"[{}]")
_COMPOUND = re.compile(r"(?:\*|[\w-]+)?(?:[.#][\w-]+|\[[^\]]*\])*")
_PART = re.compile(r"([.#]?)([\w-]+)|\[\s*([\w:-]+)\s*(?:=\s*[\"']?([^\"'\]]*)[\"']?\s*)?\]")


def applied(root):
    """Writes what the style sheets of a document say into the elements, and takes the sheets and classes out."""
    text = " ".join("".join(element.itertext()) for element in root.iter() if name_of(element) == "style")
    read = sorted(rules(re.sub(r"/\*.*?\*/", " ", text, flags=re.S)), key=lambda rule: rule[0])
    if read:
        _write(root, (), read)
    for element in root.iter():
        element.attrib.pop("class", None)


def name_of(element):
    """The name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def rules(text):
    """[(weight, [(joint, compound), ..], declarations)] of a sheet, the last compound first."""
    found, at = [], 0
    while (match := _HEAD.match(text, at)) is not None:
        head, at = match.group(1).strip(), match.end()
        if match.group(2) == ";":  # @import, @charset
            continue
        end = _closing(text, at)
        if head.startswith("@"):
            words = head.lower().split()
            found += rules(text[at:end]) if words[0] == "@media" and set(MEDIA) & set(words[1:]) else []
        else:
            declared = _declared(text[at:end])
            for selector in head.split(","):
                steps = _steps(selector)
                found += [(_weight(steps), steps, declared)] if steps and declared else []
        at = end + 1
    return found


def _closing(text, at):
    """Index of the brace that closes what was opened before `at`."""
    deep = 1
    for match in _BRACE.finditer(text, at):
        deep += 1 if match.group() == "{" else -1
        if not deep:
            return match.start()
    return len(text)


def _declared(text):
    """{property: (value, whether it is important)}"""
    found = {}
    for one in text.split(";"):
        key, _, value = one.partition(":")
        value, important = re.subn(r"\s*!\s*important\s*$", "", value.strip(), flags=re.I)
        if key.strip().lower() in PROPERTIES and value:
            found[key.strip().lower()] = (value, bool(important))
    return found


def _steps(selector):
    """[(joint to what is before it, parts of the compound)], the last first; none for what is not read."""
    words = re.sub(r"\s*>\s*", " > ", selector).split()
    found, joint = [], " "
    for word in words:
        if word == ">":
            joint = ">"
            continue
        if not _COMPOUND.fullmatch(word):
            return []
        found.append((joint, _PART.findall(word)))
        joint = " "
    return found[::-1]


def _weight(steps):
    """Specificity: ids, then classes and attributes, then tags."""
    parts = [part for _, compound in steps for part in compound]
    return (
        sum(part[0] == "#" for part in parts),
        sum(part[0] == "." or bool(part[2]) for part in parts),
        sum(not part[0] and bool(part[1]) for part in parts),
    )


def _fits(element, compound):
    """Whether an element is what a compound names."""
    return all(
        element.get(attribute) is not None and (not value or element.get(attribute) == value)
        if attribute
        else {
            "": name_of(element) == name,
            ".": name in (element.get("class") or "").split(),
            "#": element.get("id") == name,
        }[kind]
        for kind, name, attribute, value in compound
    )


def _chosen(chain, steps):
    """Whether the last of a chain of elements, from the root on, is what a selector names."""
    if not _fits(chain[-1], steps[0][1]):
        return False
    if len(steps) == 1:
        return True
    before = range(len(chain) - 1, max(0, len(chain) - 2) if steps[0][0] == ">" else 0, -1)
    return any(_chosen(chain[:k], steps[1:]) for k in before)


def _write(element, around, rules):
    """What rules, by rising weight, say of an element and of all in it, into their style attributes."""
    chain = (*around, element)
    found: dict = {}
    important: dict = {}
    for _, steps, declared in rules:
        if not _chosen(chain, steps):
            continue
        for key, (value, above) in declared.items():
            (important if above else found)[key] = value
    if found or important:
        own = element.get("style", "")
        element.set("style", ";".join((_text(found), own, _text(important))).strip(";"))
    for child in element:
        _write(child, chain, rules)


def _text(properties):
    return ";".join(f"{key}:{value}" for key, value in properties.items())
