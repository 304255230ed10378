"""Faults of a protocol's own, by its own analysis and the definitions of its labware, without any finding of the checker's.

overflow, underflow  A well is filled beyond what it holds, whatever it held at first; more is taken from a well than it can ever have
                     held.
tip-used             Tips are picked up from places from which all were taken before, and none was put back. Where a pause speaks of
                     tips, every rack is full again.
beside               A channel with a tip is over no well where its pipette works or goes."""

import re

from corpus_compare import Reader, flows

#: What rounding may leave, uL.
DUST = 1e-6
#: How far apart channels are, mm.
PITCH = 9.0
CHANNELS = 8
#: Commands that go to a well.
AT_WELLS = {"aspirate", "dispense", "blowout", "touchTip", "moveToWell"}


def faults(analysis):
    """Kinds of faults with the well of each: ("overflow", well), ("underflow", well), ("tip-used", well)."""
    capacity = {}
    reader = Reader()
    for command in analysis["commands"]:
        if command["commandType"] in ("loadLabware", "loadModule"):
            reader.load(command["commandType"], command["params"], command.get("result") or {})
    for labware in reader.labware.values():
        for well, of in labware["wells"].items():
            capacity[labware["where"], well] = of["totalLiquidVolume"]
    net, least, found = {}, {}, set()
    for well, change in flows(analysis):
        net[well] = net.get(well, 0.0) + change
        # It held at least what left it, at its lowest.
        least[well] = min(least.get(well, 0.0), net[well])
        if well in capacity:
            # Full to the least that it must have begun with, it now holds this.
            if net[well] - least[well] > capacity[well] + DUST:
                found.add(("overflow", f"{well[1]} of {well[0]}"))
            if -least[well] > capacity[well] + DUST:
                found.add(("underflow", f"{well[1]} of {well[0]}"))
    found |= {("tip-used", place) for place in channels(analysis)[0]}
    return sorted(found)


def channels(analysis):
    """Places from which tips are taken twice, and the numbers of commands in which a channel with a tip is over no well."""
    reader, absent, tips = Reader(), set(), {}
    twice, beside = set(), set()
    for number, command in enumerate(analysis["commands"], 1):
        kind, params = command["commandType"], command["params"]
        if kind in ("loadLabware", "loadPipette", "loadModule"):
            reader.load(kind, params, command.get("result") or {})
        elif kind in ("waitForResume", "pause") and re.search(r"\btip", params.get("message") or "", re.IGNORECASE):
            absent.clear()
        elif kind == "setTipState":
            absent = {place for place in absent if place[0] != params["labwareId"]}
        if "pipetteId" not in params or params.get("labwareId") not in reader.labware:
            continue
        labware, well = reader.labware[params["labwareId"]], params["wellName"]
        parameters = labware["definition"]["parameters"]
        many = CHANNELS if "multi" in reader.pipettes[params["pipetteId"]][1] else 1
        under = over(labware["wells"], well, many)
        places = [(params["labwareId"], name) for name in under if name]
        if kind == "pickUpTip":
            if places and all(place in absent for place in places):
                twice.add(f"{well} of {labware['where']}")
            tips[params["pipetteId"]] = [name is not None and (params["labwareId"], name) not in absent for name in under]
            absent.update(places)
        elif kind == "dropTip":
            absent.difference_update(places)
        elif kind in AT_WELLS and "centerMultichannelOnWells" not in parameters.get("quirks", []):
            carry = tips.get(params["pipetteId"], [True] * many)
            if any(has and name is None for has, name in zip(carry, under)):
                beside.add(number)
    return twice, beside


def over(wells, well, many):
    """The well over which each channel is where the first one is over the middle of this well."""
    first = wells[well]

    def opens(of, y):
        right, back = abs(of["x"] - first["x"]), abs(of["y"] - y)
        if "diameter" in of:
            return (right * right + back * back) ** 0.5 <= of["diameter"] / 2
        return right <= of["xDimension"] / 2 and back <= of["yDimension"] / 2

    rows = [first["y"] - PITCH * channel for channel in range(many)]
    return [next((name for name, of in wells.items() if opens(of, y)), None) for y in rows]
