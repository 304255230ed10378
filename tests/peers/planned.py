"""What a plan does with liquids, by the steps of `emit --target commands-json`, which knows nothing of any robot."""

import collections
import json


def wells_of(argument):
    return argument if isinstance(argument, list) else [argument]


def place(wells, channel, count):
    """Where a channel works: as many neighbours share each place."""
    return wells[channel * len(wells) // count]


def planned(lines):
    """Net volume of each well, uL, and how often a tip was taken."""
    net, tips, channels = collections.Counter(), 0, {}
    held = collections.defaultdict(lambda: collections.Counter())
    for line in map(json.loads, lines):
        if line["kind"] != "operation":
            continue
        verb, device, arguments = line["verb"], line["device"], line["arguments"]
        if verb == "pick up tip":
            tips += 1
        if verb == "aspirate":
            volume, wells = arguments["volume"], wells_of(arguments["source"])
            assert volume["unit"] in ("uL", "mL"), volume
            amount = volume["value"] * (1000 if volume["unit"] == "mL" else 1)
            count = channels.setdefault(device, eight(lines, device))
            for channel in range(count):
                net[place(wells, channel, count)] -= amount
                held[device][channel] += amount
        if verb == "dispense":
            volume, wells = arguments["volume"], wells_of(arguments["target"])
            amount = volume["value"] * (1000 if volume["unit"] == "mL" else 1)
            count = channels[device]
            for channel in range(count):
                given = min(amount, held[device][channel]) if held[device][channel] - amount < 1e-6 else amount
                net[place(wells, channel, count)] += given
                held[device][channel] -= given
        if verb == "blow out":
            wells = wells_of(arguments["target"])
            for channel in range(channels[device]):
                net[place(wells, channel, channels[device])] += held[device].pop(channel, 0)
        if verb in ("drop tip", "return tip"):
            held[device].clear()
    return net, tips


def eight(lines, device):
    """Channels of a pipette: as many as the most places it ever went to at once."""
    most = 1
    for line in map(json.loads, lines):
        if line.get("device") == device:
            most = max([most] + [len(a) for a in line["arguments"].values() if isinstance(a, list)])
    return most
