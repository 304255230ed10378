"""Faults of a protocol's own, by its own analysis and the definitions of its labware, without any finding of the checker's.

overflow, underflow  A well is filled beyond what it holds, whatever it held at first; more is taken from a well than it can ever have
                     held.
tip-used             Tips are picked up from places from which all were taken before, and none was put back. Where a pause speaks of
                     tips, every rack is full again.
wrong-spot           Tips are put down where tips are. A rack into which tips are put before any is taken is empty at first.
wrong-tip            Tips are picked up that do not fit the pipette, by its definition.
beside               A channel with a tip is over no well where its pipette works or goes."""

import functools
import importlib.resources
import json
import re

from corpus_compare import Reader, channels_of, flows, robot_of

#: What rounding may leave, uL.
DUST = 1e-6
#: How far apart channels are, mm.
PITCH = 9.0
ROWS = 8
#: Commands that go to a well.
AT_WELLS = {"aspirate", "dispense", "blowout", "touchTip", "moveToWell"}


def faults(analysis):
    """Kinds of faults with the well of each, such as ("overflow", well)."""
    capacity = {}
    reader = Reader(robot_of(analysis))
    for command in analysis["commands"]:
        if command["commandType"] in ("loadLabware", "loadModule"):
            reader.load(command["commandType"], command["params"], command.get("result") or {})
    for labware in reader.labware.values():
        for well, of in labware["wells"].items():
            capacity[labware["where"], well] = of["totalLiquidVolume"]
    net, least, found = {}, {}, set()
    for command in analysis["commands"]:
        if command["commandType"] == "loadLiquid":
            where = reader.labware[command["params"]["labwareId"]]["where"]
            for well, volume in command["params"]["volumeByWell"].items():
                if isinstance(volume, (int, float)) and volume > capacity[where, well] + DUST:
                    found.add(("overflow", f"{well} of {where}"))
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
    return sorted(found | channels(analysis)[0])


def channels(analysis):
    """Faults about tips, and the numbers of commands in which a channel with a tip is over no well."""
    reader, absent, tips = Reader(robot_of(analysis)), set(), {}
    found, beside, parking = set(), set(), parked(analysis)
    for number, command in enumerate(analysis["commands"], 1):
        kind, params = command["commandType"], command["params"]
        if kind in ("loadLabware", "loadPipette", "loadModule"):
            result = command.get("result") or {}
            reader.load(kind, params, result)
            if result.get("labwareId") in parking:
                absent |= {(result["labwareId"], well) for well in result["definition"]["wells"]}
        elif kind in ("waitForResume", "pause") and re.search(r"\btip", params.get("message") or "", re.IGNORECASE):
            absent.clear()
        elif kind == "setTipState":
            absent = {place for place in absent if place[0] != params["labwareId"]}
        if "pipetteId" not in params or params.get("labwareId") not in reader.labware:
            continue
        labware, well = reader.labware[params["labwareId"]], params["wellName"]
        parameters = labware["definition"]["parameters"]
        many = channels_of(reader.pipettes[params["pipetteId"]][1])
        under = over(labware["wells"], well, many)
        places = [(params["labwareId"], name) for name in under if name]
        if kind == "pickUpTip":
            if places and all(place in absent for place in places):
                found.add(("tip-used", f"{well} of {labware['where']}"))
            name = reader.pipettes[params["pipetteId"]][1]
            if labware["wells"][well]["totalLiquidVolume"] not in tips_of(name):
                found.add(("wrong-tip", f"{well} of {labware['where']}"))
            tips[params["pipetteId"]] = [name is not None and (params["labwareId"], name) not in absent for name in under]
            absent.update(places)
        elif kind == "dropTip":
            if parameters["isTiprack"] and places and all(place not in absent for place in places):
                found.add(("wrong-spot", f"{well} of {labware['where']}"))
            absent.difference_update(places)
            carry = tips.pop(params["pipetteId"], [True] * many)
            if parameters["isTiprack"] and any(has and name is None for has, name in zip(carry, under)):
                beside.add(number)
        elif kind in AT_WELLS and "centerMultichannelOnWells" not in parameters.get("quirks", []):
            carry = tips.get(params["pipetteId"], [True] * many)
            if any(has and name is None for has, name in zip(carry, under)):
                beside.add(number)
    return found, beside


@functools.cache
def tips_of(pipette):
    """Volumes of the tips that a pipette takes, uL: `p300_single_gen2` has definitions of its second version."""
    model, kind, *generation = pipette.split("_")
    folder = {"multi": "eight_channel", "96": "ninety_six_channel"}.get(kind, "single_channel")
    version = "3_4" if generation == ["flex"] or kind == "96" else "2_0" if generation else "1_0"
    path = f"data/pipette/definitions/2/liquid/{folder}/{model}/default/{version}.json"
    known = importlib.resources.files("opentrons_shared_data").joinpath(path).read_text()
    return {float(tip[1:]) for tip in json.loads(known)["supportedTips"]}


def parked(analysis):
    """Racks into which tips are put before any is taken from there."""
    first = {}
    for command in analysis["commands"]:
        if command["commandType"] in ("pickUpTip", "dropTip"):
            first.setdefault(command["params"]["labwareId"], command["commandType"])
    return {rack for rack, kind in first.items() if kind == "dropTip"}


def over(wells, well, many):
    """The well over which each channel is where the first one is over the middle of this well."""
    first = wells[well]

    def opens(of, x, y):
        right, back = abs(of["x"] - x), abs(of["y"] - y)
        if "diameter" in of:
            return (right * right + back * back) ** 0.5 <= of["diameter"] / 2
        return right <= of["xDimension"] / 2 and back <= of["yDimension"] / 2

    places = [(first["x"] + PITCH * (channel // ROWS), first["y"] - PITCH * (channel % ROWS)) for channel in range(many)]
    return [next((name for name, of in wells.items() if opens(of, x, y)), None) for x, y in places]
