"""What an analysis of Opentrons' software does, in a form in which two can be compared.

`deeds` lists what is done: verb, by what, where, how much, how. Two analyses do the same where their lists are the same: in order,
volumes to 1e-9 uL (of a whole well 1e-12 of it, if that is more), heights to 1e-6 mm, flow rates and speeds to 1e-9 of what they are, temperatures and times to 1e-9.

Not compared, as nothing physical: what is loaded, in which order, and what wells are said to hold at first; identifiers and labels;
that the robot goes home before it does anything, which it does by itself; a move to where the pipette is, or to where the next step
goes by itself; the white space of messages; whether a message stands in a delay or before it; that a rack counts as full again right
behind a pause, at which a person refills it. Everything else that one analysis has and the other one has not is a difference: comments,
pauses, delays, lights, homing, moves, blow-outs, touched tips, air gaps.

To aspirate or dispense 0 uL is to move there. A profile of a thermocycler is its temperatures, each waited for and held; a temperature
that is held for a time is one that is waited for, and a wait.

Places are named by what stands where (slot, module or labware below, and definition); heights count from the bottom, whichever end
they are given from. Commands at the place of the tip are those of the place it moved to.
"""

import itertools
import math

#: Commands that only say what is there.
SETUP = {"loadLabware", "loadPipette", "loadModule", "loadLiquid", "loadLiquidClass"}
BIN = "bin"
#: The layout in which all nozzles take tips.
ALL = (("style", "ALL"),)


class Reader:
    """Reads the commands of an analysis one after the other."""

    def __init__(self, robot):
        self.labware, self.pipettes, self.modules = {}, {}, {}
        self.at = {}  # by mount: where the tip is
        self.aimed = {}  # by mount: the area it was moved over
        self.targets = {}  # by module: what it was set to
        self.holds = {}  # by module: for how long it holds that, once it is there
        self.lids = {}
        self.robot = robot
        self.layouts = {}  # by mount: which nozzles take tips
        self.out = []

    def say(self, verb, *what):
        self.out.append((verb, *what))

    def on(self, location):
        """Where something stands."""
        if isinstance(location, str):
            return location
        if "slotName" in location:
            return str(location["slotName"])
        if "addressableAreaName" in location:
            return location["addressableAreaName"]
        if "moduleId" in location:
            return self.modules[location["moduleId"]]
        return self.labware[location["labwareId"]]["where"]

    def load(self, kind, params, result):
        if kind == "loadLabware":
            definition = result["definition"]
            uri = f"{params['namespace']}/{params['loadName']}/{result['definition']['version']}"
            where = f"{uri} on {self.on(params['location'])}"
            self.labware[result["labwareId"]] = {"where": where, "wells": definition["wells"], "definition": definition}
            if "fixedTrash" in definition["parameters"].get("quirks", []):
                self.labware[result["labwareId"]]["where"] = BIN
        if kind == "loadPipette":
            self.pipettes[result["pipetteId"]] = (params["mount"], params["pipetteName"])
        if kind == "loadModule":
            slot = "7" if "thermocycler" in params["model"] else str(params["location"]["slotName"])
            self.modules[result["moduleId"]] = f"{params['model']} on {slot}"

    def bin(self, area):
        """What an area is called. Where no bin is loaded, that of a Flex stands in place A3."""
        if area == "fixedTrash":
            return BIN if self.robot.startswith("OT-2") else "movableTrashA3"
        return area

    def spot(self, params):
        """Labware, well, and where in it: from its axis and its bottom, mm."""
        labware = self.labware.get(params["labwareId"])
        if labware is None or labware["where"] == BIN:
            # Wherever in the bin: it takes everything.
            return (self.bin("fixedTrash"),)
        well = labware["wells"][params["wellName"]]
        location = params.get("wellLocation") or {}
        offset = {"x": 0, "y": 0, "z": 0, **(location.get("offset") or {})}
        origin = location.get("origin", "top")
        base = {"bottom": 0, "center": well["depth"] / 2}.get(origin, well["depth"])
        if origin not in ("top", "bottom", "center", "default"):
            base = origin
        height = base + offset["z"] if not isinstance(base, str) else (base, offset["z"])
        return labware["where"], params["wellName"], float(offset["x"]), float(offset["y"]), height

    def take(self, command):
        kind, params, result = command["commandType"], command["params"], command.get("result") or {}
        if kind in SETUP:
            return self.load(kind, params, result)
        mount = self.pipettes[params["pipetteId"]][0] if "pipetteId" in params else None
        volume = params.get("volume", result.get("volume"))
        flow = params.get("flowRate")
        if kind in ("aspirate", "dispense") and volume == 0:
            kind, params = "moveToWell", {key: params[key] for key in ("labwareId", "wellName", "wellLocation") if key in params}
        if kind in ("aspirateInPlace", "dispenseInPlace") and volume == 0:
            return None
        match kind:
            case "pickUpTip" | "dropTip":
                spot = self.spot(params)
                if len(spot) == 1:
                    self.say("drop tip", mount, spot)
                else:
                    # A tip is picked up and given back in one way only.
                    layout = self.layouts.get(mount, ALL) if kind == "pickUpTip" else ALL
                    self.say("pick up tip" if kind == "pickUpTip" else "return tip", mount, *spot[:2], layout)
                self.at.pop(mount, None)
            case "moveToAddressableAreaForDropTip" | "moveToAddressableArea":
                self.aimed[mount] = params["addressableAreaName"]
                self.at[mount] = (self.bin(params["addressableAreaName"]),)
                if kind == "moveToAddressableArea":
                    self.say("move", mount, self.at[mount], None, False, None)
            case "dropTipInPlace":
                self.say("drop tip", mount, self.at.get(mount))
                self.at.pop(mount, None)
            case "aspirate" | "dispense" | "blowout":
                self.at[mount] = self.spot(params)
                self.say(kind, mount, self.at[mount], volume, flow, params.get("pushOut"))
            case "aspirateInPlace" | "dispenseInPlace" | "blowOutInPlace" | "airGapInPlace":
                verb = {"aspirateInPlace": "aspirate", "airGapInPlace": "aspirate", "dispenseInPlace": "dispense"}.get(kind, "blowout")
                self.say(verb, mount, self.at.get(mount), volume, flow, params.get("pushOut"))
            case "touchTip":
                spot = self.spot(params)
                self.at[mount] = spot
                self.say("touch tip", mount, spot, params.get("radius", 1.0), params.get("speed", 60.0))
            case "moveToWell":
                spot = self.spot(params)
                move = ("move", mount, spot, params.get("speed"), bool(params.get("forceDirect")), params.get("minimumZHeight"))
                if self.at.get(mount) is None or not same(self.at[mount], spot):
                    self.out.append(move)
                self.at[mount] = spot
            case "moveToCoordinates":
                place = tuple(float(params["coordinates"][axis]) for axis in "xyz")
                self.at[mount] = place
                self.say("move", mount, place, params.get("speed"), bool(params.get("forceDirect")), params.get("minimumZHeight"))
            case "waitForDuration":
                self.comment(params.get("message"))
                self.say("wait", params["seconds"])
            case "waitForResume" | "pause":
                self.say("pause", " ".join((params.get("message") or "Go on?").split()))
            case "comment":
                self.comment(params["message"])
            case "home":
                axes = params.get("axes")
                self.say("home", tuple(sorted(axes)) if axes is not None else "all")
                self.at.clear()
            case "setRailLights":
                self.say("lights", params["on"])
            case "configureNozzleLayout":
                # Said where tips are taken.
                self.layouts[mount] = frozen(params["configurationParams"])
            case "reloadLabware":
                # Only what was measured of its place is looked up again.
                pass
            case "prepareToAspirate":
                # The plunger goes to its start; what the tip does next says so.
                pass
            case "setTipState":
                where = self.labware[params["labwareId"]]["where"]
                self.say("tips", where, tuple(sorted(params["wellNames"])), params["tipWellState"])
            case "moveLabware":
                where = self.labware[params["labwareId"]]
                before = where["where"]
                to = self.on(params["newLocation"])
                where["where"] = f"{before.split(' on ')[0]} on {to}"
                offsets = (params.get(key) or {} for key in ("pickUpOffset", "dropOffset"))
                shifts = (float(offset.get(axis, 0)) for offset in offsets for axis in "xyz")
                self.say("move labware", before, to, params["strategy"], *shifts)
            case "temperatureModule/setTargetTemperature" | "temperatureModule/waitForTemperature":
                # A wait without a temperature is for the one that was set.
                module = self.modules[params["moduleId"]]
                celsius = params.get("celsius")
                if kind.endswith("setTargetTemperature"):
                    self.targets[module] = celsius
                self.say(kind, module, self.targets.get(module) if celsius is None else celsius)
            case "thermocycler/setTargetBlockTemperature":
                module = self.modules[params["moduleId"]]
                self.holds[module] = params.get("holdTimeSeconds") or 0.0
                self.block(module, params["celsius"], params)
            case "thermocycler/waitForBlockTemperature":
                module = self.modules[params["moduleId"]]
                self.held(module, self.holds.pop(module, 0.0))
            case "thermocycler/openLid" | "thermocycler/closeLid":
                self.shut(self.modules[params["moduleId"]], kind, kind.split("/")[1][:-3])
            case "heaterShaker/openLabwareLatch" | "heaterShaker/closeLabwareLatch":
                self.shut(self.modules[params["moduleId"]], kind, kind.split("/")[1][: -len("LabwareLatch")])
            case "thermocycler/runProfile":
                module = self.modules[params["moduleId"]]
                for step in params["profile"]:
                    self.block(module, step["celsius"], params)
                    self.held(module, step["holdSeconds"])
            case _:
                rest = {key: value for key, value in params.items() if key not in ("pipetteId", "moduleId", "labwareId")}
                about = self.modules.get(params.get("moduleId"), mount)
                self.say(kind, about, *frozen(rest))

    def shut(self, module, kind, way):
        """A lid or a latch is opened or closed. It is open at first; to open it while it is open does nothing."""
        if self.lids.get(module, "open") != way:
            self.say(kind, module)
        self.lids[module] = way

    def block(self, module, celsius, params):
        """A set point of a thermocycler, with the volume that it allows for: its firmware has 25 uL where none is given."""
        self.say("thermocycler/setTargetBlockTemperature", module, celsius, params.get("blockMaxVolumeUl") or 25)

    def held(self, module, seconds):
        """Its temperature is waited for, and held."""
        self.say("thermocycler/waitForBlockTemperature", module)
        if seconds:
            self.say("wait", seconds)

    def comment(self, message):
        message = " ".join((message or "").split())
        if message:
            self.say("comment", message)


def frozen(value):
    """Parameters as a tuple."""
    if isinstance(value, dict):
        return tuple((key, frozen(value[key])) for key in sorted(value))
    if isinstance(value, list):
        return tuple(map(frozen, value))
    return value


def robot_of(analysis):
    return analysis.get("robotType") or "OT-2 Standard"


def deeds(analysis):
    """What an analysis does."""
    reader = Reader(robot_of(analysis))
    for command in analysis["commands"]:
        reader.take(command)
    out = list(itertools.dropwhile(lambda deed: deed[0] == "home", reader.out))
    # What follows at the same place goes there by itself.
    return [deed for deed, after in itertools.zip_longest(out, out[1:]) if not goes_there(deed, after)]


def goes_there(deed, after):
    """Whether a deed is a plain move to where the next one is done."""
    if deed[0] != "move" or deed[3:] != (None, False, None) or after is None:
        return False
    return after[0] in ("aspirate", "dispense", "blowout") and after[1] == deed[1] and same(after[2], deed[2])


def same(a, b):
    """Whether two deeds, or parts of them, are the same."""
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-9)
    if isinstance(a, tuple) and isinstance(b, tuple):
        if len(a) == len(b) == 5 and isinstance(a[0], str) and " on " in a[0]:
            # A place in a well.
            close = all(isinstance(x, float) and isinstance(y, float) and abs(x - y) < 1e-6 for x, y in zip(a[2:], b[2:]))
            return a[:2] == b[:2] and (close or a[2:] == b[2:])
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


def volumes(analysis):
    """What came into each well less what left it, uL."""
    net = {}
    for well, change in flows(analysis):
        net[well] = net.get(well, 0.0) + change
    return net


def flows(analysis):
    """What comes into and leaves wells, one after the other: well and volume, uL. What is aspirated above a rim is air, and the
    air that came in last comes out first."""
    reader, tips = Reader(robot_of(analysis)), {}
    for command in analysis["commands"]:
        seen = len(reader.out)
        reader.take(command)
        for deed in reader.out[seen:]:
            verb, mount = deed[0], deed[1] if len(deed) > 1 else None
            if verb in ("pick up tip", "return tip", "drop tip", "drop tip here"):
                tips.pop(mount, None)
            if verb not in ("aspirate", "dispense", "blowout"):
                continue
            # Portions in the tip, the last one at its end: volume, and whether it is liquid.
            tip, spot = tips.setdefault(mount, []), deed[2]
            labware = spot and len(spot) == 5 and next(l for l in reader.labware.values() if l["where"] == spot[0])
            if verb == "aspirate":
                is_liquid = bool(labware) and not (
                    isinstance(spot[4], float) and spot[4] > labware["wells"][spot[1]]["depth"] + 1e-6
                )
                tip.append([deed[3], is_liquid])
                change = -deed[3] if is_liquid else 0.0
            else:
                left, change = (math.inf if verb == "blowout" else deed[3]), 0.0
                while tip and left > 1e-9:
                    given = min(left, tip[-1][0])
                    change += given if tip[-1][1] else 0.0
                    left -= given
                    tip[-1][0] -= given
                    if tip[-1][0] <= 1e-9:
                        tip.pop()
            if not labware or not change:
                continue
            names = (name for m, name in reader.pipettes.values() if m == mount)
            channels = max(map(channels_of, names), default=1)
            for well in reached(labware, spot[1], channels):
                yield (labware["where"], well), change


def channels_of(pipette):
    """How many channels a pipette has, by its name."""
    return 96 if pipette.endswith("_96") else 8 if "multi" in pipette else 1


def reached(labware, well, channels):
    """The wells that channels 9 mm apart reach, one for each of them."""
    wells = labware["wells"]
    first = wells[well]
    if channels == 96:
        # Twelve columns, over one trough, over troughs, or over wells.
        rows = {round(w["x"], 1): name for name, w in wells.items()}
        if len(rows) == 1:
            return [well] * channels
        beside = (first["x"] + 9.0 * column for column in range(12))
        near = (min(wells, key=lambda name: abs(wells[name]["x"] - x) + abs(wells[name]["y"] - first["y"])) for x in beside)
        return [name for start in near for name in reached(labware, start, 8)]
    column = [name for name, w in wells.items() if abs(w["x"] - first["x"]) < 0.1]
    if channels == 1 or len(column) == 1:
        return [well] * channels
    out = []
    for channel in range(channels):
        y = first["y"] - 9.0 * channel
        out += [name for name in column if abs(wells[name]["y"] - y) < 0.5]
    return out


def difference(before, after):
    """The first thing that two analyses do not do alike, as what kind of difference and as a text; empty where there is none."""
    a, b = deeds(before), deeds(after)
    b = without_refills(a, b)
    for index, (one, two) in enumerate(itertools.zip_longest(a, b)):
        if one is not None and two is not None and same(one, two):
            continue
        text = f"{index + 1}: {one} became {two}"
        if one is not None and two is not None and one[0] == two[0]:
            where = [i for i, (x, y) in enumerate(zip(one, two)) if not same(x, y)] or [0]
            return f"{one[0]}: another {part(one[0], where[0], one, two)}", text
        if two is None or (one is not None and two in a[index + 1 : index + 4]):
            return f"{one[0]} lost", text
        return f"{two[0]} added", text
    one, two = volumes(before), volumes(after)
    for well in sorted(one.keys() | two.keys()):
        if not math.isclose(one.get(well, 0.0), two.get(well, 0.0), rel_tol=1e-12, abs_tol=1e-9):
            return "volume of a well", f"{well}: {one.get(well)} became {two.get(well)}"
    return "", ""


def without_refills(a, b):
    """The second list without the refilled racks right behind a pause that the first one does not say."""
    out, rest = [], iter(a)
    one, behind = next(rest, None), False
    for two in b:
        told = one is not None and same(one, two)
        if two[0] == "tips" and behind and not told:
            continue
        behind = two[0] == "pause" or (behind and two[0] == "tips")
        out.append(two)
        one = next(rest, None)
    return out


def part(verb, index, one, two):
    """What a part of a deed says."""
    if index == 2 and isinstance(one[2], tuple) and isinstance(two[2], tuple) and one[2][:2] == two[2][:2]:
        return "position in the well"
    names = {
        "aspirate": ["", "pipette", "place", "volume", "flow rate"],
        "move": ["", "pipette", "place", "speed", "way", "clearance"],
        "touch tip": ["", "pipette", "place", "radius", "speed"],
    }
    names["dispense"] = names["blowout"] = names["aspirate"]
    known = names.get(verb, [])
    return known[index] if index < len(known) else "value"
