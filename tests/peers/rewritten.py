"""Public protocols written anew by hand, compared with what they were.

    python3.11 -m venv venv && venv/bin/pip install opentrons==8.8.2
    git clone https://github.com/Opentrons/Protocols
    venv/bin/python tests/peers/rewritten.py --binary target/release/matterixc --protocols Protocols/protocols --work work

Each file of `examples/opentrons/protocols` rewrites the public protocol whose folder has its name. Each goes through these stages:

lines     The file has fewer lines than its Python, without blank ones and comments, and its head comment gives both figures.
check     `check --strict` and `fmt --check` find nothing, `run` completes.
analyse   Opentrons' software runs the original with the values that its site offers, and what `emit --target opentrons-python`
          writes (corpus_analysis.py), both on its protocol engine.
compare   What came into each well less what left it, to 1e-6 uL; how many tips were taken; what modules do, in order: set points,
          lids, magnets, shaking. Not compared are lids that are opened while open, and the like, and what only one of them switches
          off at the end: `check --strict` wants it off. A difference that the head comment explains is listed, but no failure:
          "Differs in tips: WHY", "Differs in volumes (A1 on 2, A1 on 9): WHY", with the places of the wells.

The analysis of an original is kept in the folder `--work`. What is aspirated at or above the rim of a well is air. Wells are named by where their
labware stands, not by its definition. The exit status is 1 if anything is wrong.
"""

import argparse
import copy
import json
import pathlib
import re
import subprocess
import sys

from corpus_analysis import analyse, files_of
from corpus_compare import Reader, volumes

TOLERANCE = 1e-6
#: What a file says of its length.
FIGURES = re.compile(r"Lines: (\d+) of Python, (\d+) here\.")


def lines_of(text, comment):
    """How many lines are neither blank nor comments."""
    return sum(1 for line in map(str.strip, text.splitlines()) if line and not line.startswith(comment))


def head_of(text):
    """The comment at the head of a file, as one text."""
    return " ".join(line[3:].strip() for line in text.splitlines() if line.startswith("//!"))


def excused(head):
    """What a head comment explains: the number of tips, and wells by their places."""
    found = set()
    for names in re.findall(r"Differs in ([^:]*):", head):
        if names == "tips":
            found.add("tips")
        elif places := re.fullmatch(r"volumes \((.*)\)", names):
            found |= set(places[1].split(", "))
    return found


def with_air(analysis):
    """The analysis with aspirations at the rim just above it, where they count as air."""
    out = copy.deepcopy(analysis)
    for command in out["commands"]:
        where = command["params"].get("wellLocation") or {}
        offset = where.get("offset") or {}
        if command["commandType"] == "aspirate" and where.get("origin", "top") == "top" and 0 <= offset.get("z", 0) < 0.001:
            where["offset"] = {"x": 0, "y": 0, **offset, "z": 0.001}
    return out


def net(analysis):
    """The net volume of each well, by the place of its labware."""
    out = {}
    for (where, well), change in volumes(with_air(analysis)).items():
        if where == "bin":
            continue
        key = (where.split(" on ", 1)[1], well)
        out[key] = out.get(key, 0.0) + change
    return out


def tips(analysis):
    """How many tips were picked up: a pipette with eight channels takes eight at once."""
    names, count = {}, 0
    for command in analysis["commands"]:
        if command["commandType"] == "loadPipette":
            names[command["result"]["pipetteId"]] = command["params"]["pipetteName"]
        if command["commandType"] == "pickUpTip":
            count += 8 if "multi" in names[command["params"]["pipetteId"]] else 1
    return count


def modules(analysis):
    """What modules do, in order, but for what is so already, and what is switched off at the end."""
    reader, deeds, is_open = Reader("OT-2 Standard"), [], {}
    for command in analysis["commands"]:
        reader.take(command)
    for deed in reader.out:
        if "/" not in deed[0]:
            continue
        opened = re.search("/(open|close)(Lid|LabwareLatch)$", deed[0])
        if opened:
            thing, to_open = (deed[1], opened[2]), opened[1] == "open"
            # The lid of a thermocycler is open at first; the latch of a heater-shaker may be either.
            if is_open.get(thing, True if opened[2] == "Lid" else None) == to_open:
                continue
            is_open[thing] = to_open
        deeds.append(deed)
    while deeds and re.search("deactivate|disengage", deeds[-1][0]):
        deeds.pop()
    return deeds


def differences(one, two):
    """What two analyses do not do alike: what must be explained, and a text."""
    found = []
    a, b = net(one), net(two)
    for key in sorted(a.keys() | b.keys()):
        before, after = a.get(key, 0.0), b.get(key, 0.0)
        if abs(before - after) > TOLERANCE:
            found.append((f"{key[1]} on {key[0]}", f"{before:g} uL became {after:g} uL"))
    if tips(one) != tips(two):
        found.append(("tips", f"{tips(one)} became {tips(two)}"))
    before, after = modules(one), modules(two)
    if before != after:
        at = next((i for i, (x, y) in enumerate(zip(before, after)) if x != y), min(len(before), len(after)))
        found.append(("modules", f"step {at + 1} of {len(before)} and {len(after)}: {before[at : at + 1]} became {after[at : at + 1]}"))
    return found


def ended(command):
    """What a program says if its exit status is not 0."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    return "" if done.returncode == 0 else (done.stdout + done.stderr).strip() or "it ended without a word"


def looked_at(path, given):
    """What is wrong with a file, and what is different but explained."""
    text, name = path.read_text(), path.stem
    folder = given.protocols / name
    head = head_of(text)
    python = lines_of(sorted(folder.glob("*.py"))[0].read_text(), "#")
    here = lines_of(text, "//")
    wrong, figures = [], FIGURES.search(head)
    if figures is None or (int(figures[1]), int(figures[2])) != (python, here):
        wrong.append(f"lines: it has {here} and its Python {python}, but its head says otherwise")
    if here >= python:
        wrong.append(f"lines: {here}, not fewer than {python}")
    work = given.work / name
    work.mkdir(parents=True, exist_ok=True)
    emitted = work / "emitted.py"
    for command in (["check", "--strict", path], ["fmt", "--check", path], ["run", path], ["emit", path, "--target", "opentrons-python", "-o", emitted]):
        said = ended([given.binary, *command])
        if said:
            return wrong + [f"{command[0]}: {said}"], [], python, here
    before, after = work / "engine.json", work / "emitted.json"
    said = "ok" if before.exists() else analyse(files_of(folder, work), before, "engine", given.limit)
    after.unlink(missing_ok=True)
    said = said if said != "ok" else analyse([emitted], after, "engine", given.limit)
    if said != "ok":
        return wrong + [f"analyse: {said}"], [], python, here
    found = differences(json.loads(before.read_text()), json.loads(after.read_text()))
    fine = excused(head)
    told = lambda what, text: f"{what}: {text}"
    explained = [told(*one) for one in found if one[0] in fine]
    wrong += [told(*one) for one in found if one[0] not in fine]
    wrong += [f"{what}: the head explains a difference that is not there" for what in sorted(fine - {what for what, _ in found})]
    return wrong, explained, python, here


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--files", type=pathlib.Path, default=root / "examples/opentrons/protocols")
    parser.add_argument("--protocols", type=pathlib.Path, required=True)
    parser.add_argument("--binary", type=pathlib.Path, default="target/release/matterixc")
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--limit", type=int, default=300, help="seconds for each analysis (300)")
    parser.add_argument("names", nargs="*", help="these protocols only")
    given = parser.parse_args()
    given.protocols, given.work, given.binary = given.protocols.resolve(), given.work.resolve(), given.binary.resolve()
    bad = 0
    for path in sorted(given.files.resolve().glob("*.mtx")):
        if given.names and path.stem not in given.names:
            continue
        wrong, explained, python, here = looked_at(path, given)
        print(f"{path.stem}: {'wrong' if wrong else 'same' if not explained else 'differs as it says'}, {python} lines became {here}", flush=True)
        for mark, many in (("  wrong: ", wrong), ("  ", explained)):
            for line in many[:5]:
                print(mark + line)
            if len(many) > 5:
                print(f"  and {len(many) - 5} more")
        bad += bool(wrong)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
