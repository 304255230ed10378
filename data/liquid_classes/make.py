"""Writes stdlib/liquid_classes.mtx from the liquid classes of opentrons-shared-data.

    pip download --no-deps opentrons-shared-data==8.8.2
    python3 data/liquid_classes/make.py opentrons_shared_data-8.8.2-py2.py3-none-any.whl           # writes the file
    python3 data/liquid_classes/make.py opentrons_shared_data-8.8.2-py2.py3-none-any.whl --check   # compares it with the package

Needs nothing but Python 3.11. The newest version of each class is taken, and of that what holds for one stroke (`singleDispense`); tips with
filters are as those without.
"""
import json
import re
import sys
import zipfile
from pathlib import Path

OUT = Path(__file__).parent.parent.parent / "stdlib" / "liquid_classes.mtx"
CLASS = re.compile(r"opentrons_shared_data/data/liquid-class/definitions/1/(\w+)/(\d+)\.json")
TIP = re.compile(r"opentrons/opentrons_flex_96_tiprack_(\d+)ul/1")
#: The run engine's names of pipettes.
MODELS = {
    "flex_1channel_50": "p50_single_flex",
    "flex_8channel_50": "p50_multi_flex",
    "flex_1channel_1000": "p1000_single_flex",
    "flex_8channel_1000": "p1000_multi_flex",
    "flex_96channel_200": "p200_96",
    "flex_96channel_1000": "p1000_96",
}
#: What classes are called here, and what they are for.
NAMES = {
    "water": ("Aqueous", "Water and dilute solutions in water."),
    "ethanol_80": ("Volatile", "Ethanol of 80 % and liquids as thin and volatile."),
    "glycerol_50": ("Viscous", "Glycerol of 50 % and liquids as thick."),
}
HEAD = """mtx 1
//! The liquid classes of Opentrons for the pipettes of the Flex: how each moves water, what is volatile and what is thick.
//!
//! From package opentrons-shared-data 8.8.2 (Apache-2.0: see assets/labware/NOTICE), written by data/liquid_classes/make.py. They hold for one stroke;
//! how several targets share one stroke is not among them, nor are the modes of pipettes for small volumes."""


def number(value):
    return repr(round(float(value), 9)).removesuffix(".0")


def points(pairs, unit):
    """Points of a list; one alone is a constant."""
    pairs = [(number(x), number(y)) for x, y in pairs]
    if len(pairs) == 1:
        pairs.append(("1000", pairs[0][1])) if pairs[0][0] != "1000" else pairs.insert(0, ("0", pairs[0][1]))
    return "[" + ", ".join(f"({x} uL, {y} {unit})" for x, y in pairs) + "]"


def seconds(delay):
    return delay["params"]["duration"] if delay["enable"] else 0


def height(position):
    assert position["positionReference"] == "well-bottom" and position["offset"]["x"] == position["offset"]["y"] == 0, position
    return position["offset"]["z"]


def rule(model, tip, of):
    """One rule as lines of its fields."""
    take, give = of["aspirate"], of["singleDispense"]
    for part in (take, give):
        assert not part["mix"]["enable"] and not part["retract"]["touchTip"]["enable"], (model, tip)
    assert not take["preWet"] and give["correctionByVolume"] == take["correctionByVolume"], (model, tip)
    assert seconds(take["submerge"]["delay"]) == 0 == seconds(give["submerge"]["delay"]), (model, tip)
    assert seconds(take["retract"]["delay"]) == seconds(give["retract"]["delay"]), (model, tip)
    out = {
        "model": f'"{model}"',
        "tip": f"{tip} uL",
        "rates_in": points(take["flowRateByVolume"], "uL/s"),
        "rates_out": points(give["flowRateByVolume"], "uL/s"),
    }
    if any(float(fix) for _, fix in take["correctionByVolume"]):
        out["fixes"] = points(take["correctionByVolume"], "uL")
    if any(float(gap) for _, gap in take["retract"]["airGapByVolume"]):
        out["gaps"] = points(take["retract"]["airGapByVolume"], "uL")
    out["wait_in"] = f"{number(seconds(take['delay']))} s"
    out["wait_above"] = f"{number(seconds(take['retract']['delay']))} s"
    out["wait_out"] = f"{number(seconds(give['delay']))} s"
    out["speed_in"] = f"{number(take['submerge']['speed'])} mm/s"
    out["speed_out"] = f"{number(take['retract']['speed'])} mm/s"
    out["push_outs"] = points(give["pushOutByVolume"], "uL")
    blowout = give["retract"]["blowout"]
    if blowout["enable"]:
        assert blowout["params"]["location"] == "destination", (model, tip)
        out["blow"] = f"{number(blowout['params']['flowRate'])} uL/s"
    out["take_at"] = f"{number(height(take['aspiratePosition']))} mm"
    out["give_at"] = f"{number(height(give['dispensePosition']))} mm"
    return {key: value for key, value in out.items() if value not in ("0 s", "2 mm")}


def classes(wheel):
    """The newest version of each class by its name."""
    newest = {}
    with zipfile.ZipFile(wheel) as package:
        for path in package.namelist():
            if named := CLASS.fullmatch(path):
                name, version = named[1], int(named[2])
                if version > newest.get(name, (0, None))[0]:
                    newest[name] = (version, json.loads(package.read(path)))
    return {name: definition for name, (_, definition) in newest.items()}


def written(wheel):
    out = [HEAD]
    known = classes(wheel)
    assert set(known) == set(NAMES), sorted(known)
    for key, (name, meaning) in NAMES.items():
        out.append(f"\n/// {meaning}\nasset {name}: LiquidClass {{")
        rules = [
            rule(MODELS[by["pipetteModel"]], int(tip[1]), of)
            for by in known[key]["byPipette"]
            for of in by["byTipType"]
            if (tip := TIP.fullmatch(of["tiprack"]))
        ]
        for index, fields in enumerate(rules, 1):
            out.append(f"    rules[{index}] = Rule {{")
            out.extend(f"        {key}: {value}" for key, value in fields.items())
            out.append("    }")
        out.append("}")
    return "\n".join(out) + "\n"


def main():
    wheel, *flags = sys.argv[1:]
    text = written(wheel)
    if "--check" not in flags:
        OUT.write_text(text)
    elif OUT.read_text() != text:
        sys.exit(f"{OUT.name} is not what the package gives")


main()
