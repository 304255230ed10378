"""Faults of a protocol's own, by the volumes that its analysis moves and the wells of its labware's definitions, without any
finding of the checker's: a well that is filled beyond what it holds, whatever it held at first; a well from which more is taken
than it can ever have held."""

from corpus_compare import Reader, flows

#: What rounding may leave, uL.
DUST = 1e-6


def faults(analysis):
    """Kinds of faults with the well of each: ("overflow", well), ("underflow", well)."""
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
    return sorted(found)
