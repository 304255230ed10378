"""Liquid classes as Opentrons' own software applies them, and as `deliver` does.

    python3.11 -m venv venv && venv/bin/pip install opentrons==8.8.2
    venv/bin/python tests/peers/liquid_classes.py target/release/matterixc

For each pipette of the Flex, each of its tips, each class and several volumes: `transfer_with_liquid_class` of the Python API at level 2.26, analysed, against
`deliver`, emitted as Python and analysed. Compared in their order are moves with their heights and speeds, strokes with their rates, waits and
blow-outs. Strokes are volumes with what the class corrects; the end of a stroke that empties the tip is the end of the piston in both.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

CLASSES = {"water": "Aqueous", "ethanol_80": "Volatile", "glycerol_50": "Viscous"}
#: By pipette: its asset, its name in the Python API, channels, and volumes by the size of tips, uL.
PIPETTES = {
    "FlexP50Single": ("flex_1channel_50", 1, {50: [5, 10, 30, 45]}),
    "FlexP50Multi": ("flex_8channel_50", 8, {50: [5, 10, 30, 45]}),
    "FlexP1000Single": ("flex_1channel_1000", 1, {50: [5, 20, 45], 200: [7, 50, 180], 1000: [10, 150, 800]}),
    "FlexP1000Multi": ("flex_8channel_1000", 8, {50: [5, 20, 45], 200: [7, 50, 180], 1000: [10, 150, 800]}),
    "FlexP1000x96": ("flex_96channel_1000", 96, {50: [5, 20, 40], 200: [7, 50, 150], 1000: [10, 100, 200]}),
    "FlexP200x96": ("flex_96channel_200", 96, {50: [5, 20, 40], 200: [7, 50, 150]}),
}
SLOTS = {50: "C1", 200: "C2", 1000: "C3"}


def plan(asset, channels, tips, folder):
    """The same as a plan and as a Python protocol."""
    name = PIPETTES[asset][0]
    racks = {size: f"tips{size}" for size in tips}
    whole = channels == 96
    lab = [f"    holder{size} = TipRackAdapter on flex.slot[{SLOTS[size]}]" for size in tips if whole]
    below = {size: f"holder{size}" if whole else f"flex.slot[{SLOTS[size]}]" for size in tips}
    lab += [f"    {rack} = FlexTips{size} on {below[size]}" for size, rack in racks.items()]
    lab += [f"    {key} = {word}" for key, word in CLASSES.items()]
    steps, python, column = [], [], 0
    for size, volumes in tips.items():
        steps.append(f"    pick up tip from tips{size} by flex.left")
        python.append(f"    p.pick_up_tip(tips{size}['A1'])")
        for key in CLASSES:
            column += 1
            for volume in volumes:
                target = "plate.wells" if whole else f"plate.column({column})" if channels > 1 else f"plate[A{column}]"
                steps.append(f"    deliver {volume} uL from bath[A1] to {target} by flex.left using {key} {{ carryover: true }}")
                wells = "plate.wells()" if whole else f"plate.columns()[{column - 1}]" if channels > 1 else f"[plate['A{column}']]"
                python.append(
                    f"    p.transfer_with_liquid_class(liquid_class=protocol.get_liquid_class('{key}'), volume={volume}, "
                    f"source=[bath['A1']], dest={wells}, new_tip='never', group_wells={channels > 1})"
                )
        steps.append("    drop tip by flex.left")
        python.append("    p.drop_tip(trash)")
    uses = ", ".join(["Flex", "FlexTrash", "TipRackAdapter", asset, *(f"FlexTips{size}" for size in tips)])
    text = (
        f"mtx 1\nuse std::flex::{{{uses}}}\nuse std::liquid_classes::{{Aqueous, Viscous, Volatile}}\n"
        "use std::opentrons::Reservoir1\nasset Deep from labware \"nest_96_wellplate_2ml_deep/2\"\n"
        f"lab deck {{\n    ambient: 22 degC\n    flex = Flex {{ left: {asset}, trash: trash }} at (0, 0, 0) m\n"
        "    trash = FlexTrash on flex.slot[A3]\n    bath = Reservoir1 on flex.slot[B2] holding { A1: 194 mL of water }\n"
        "    plate = Deep on flex.slot[D2]\n" + "\n".join(lab) + "\n}\nworkflow w in deck {\n"
        + "\n".join(steps) + "\n}\n"
    )
    on = ", adapter='opentrons_flex_96_tiprack_adapter'" if whole else ""
    loads = [f"    tips{size} = protocol.load_labware('opentrons_flex_96_tiprack_{size}ul', '{SLOTS[size]}'{on})" for size in tips]
    protocol = (
        "metadata = {'protocolName': 'w'}\nrequirements = {'robotType': 'Flex', 'apiLevel': '2.26'}\n\n\ndef run(protocol):\n"
        f"    p = protocol.load_instrument('{name}', 'left')\n    trash = protocol.load_trash_bin('A3')\n"
        "    bath = protocol.load_labware('nest_1_reservoir_195ml', 'B2', version=2)\n"
        "    plate = protocol.load_labware('nest_96_wellplate_2ml_deep', 'D2', version=2)\n"
        + "\n".join(loads + python) + "\n"
    )
    (folder / "plan.mtx").write_text(text)
    (folder / "theirs.py").write_text(protocol)


def analysed(file):
    out = file.with_suffix(".json")
    subprocess.run([sys.executable, "-m", "opentrons.cli", "analyze", f"--json-output={out}", file], capture_output=True)
    analysis = json.loads(out.read_text())
    if analysis["errors"]:
        sys.exit(f"{file.name}: {analysis['errors'][0]['detail']}")
    return analysis["commands"]


def deeds(commands):
    """What is done with the liquid: verbs, heights in the well, strokes, rates, speeds and waits."""
    out, depth, at, filled = [], {}, None, 0.0
    for command in commands:
        kind, params = command["commandType"], command["params"]
        if kind == "loadLabware":
            wells = command["result"]["definition"]["wells"]
            depth[command["result"]["labwareId"]] = {name: well["depth"] for name, well in wells.items()}
            continue
        if "wellLocation" in params and params["labwareId"] in depth:
            location = params["wellLocation"]
            z = location["offset"]["z"]
            height = z if location["origin"] == "bottom" else z + depth[params["labwareId"]][params["wellName"]]
            place = (params["wellName"], round(height, 6))
            if kind == "moveToWell" and place != at:
                out.append(("move", *place, params.get("speed") or 0))
            at = place
        match kind:
            case "pickUpTip" | "dropTipInPlace":
                out.append((kind,))
                at = None
            case "aspirate" | "aspirateInPlace" | "airGapInPlace":
                # What corrects the air behind the liquid moves air.
                air = kind == "airGapInPlace" or (at is not None and out[-1][0] == "wait" and filled > 0)
                stroke = params["volume"] + (0 if air else params.get("correctionVolume") or 0)
                filled += stroke
                out.append(("aspirate", round(stroke, 6), round(params["flowRate"], 6)))
            case "dispense" | "dispenseInPlace":
                left = filled - params["volume"]
                # The last stroke empties the tip.
                stroke = filled if left < 0.5 * params["volume"] else params["volume"]
                filled -= stroke
                out.append(("dispense", round(stroke, 6), round(params["flowRate"], 6), params.get("pushOut")))
            case "waitForDuration":
                out.append(("wait", round(params["seconds"], 6)))
            case "blowout" | "blowOutInPlace":
                out.append(("blow out", round(params["flowRate"], 6)))
    return out


def alike(a, b):
    return len(a) == len(b) and all(x == y if isinstance(x, (str, type(None))) else y is not None and math.isclose(x, y, rel_tol=1e-6, abs_tol=1e-6) for x, y in zip(a, b))


def main():
    binary = pathlib.Path(sys.argv[1]).resolve()
    compared = failed = 0
    for asset, (_, channels, tips) in PIPETTES.items():
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            plan(asset, channels, tips, folder)
            emit = [binary, "emit", "plan.mtx", "--target", "opentrons-python", "-o", "ours.py"]
            said = subprocess.run(emit, cwd=folder, capture_output=True, text=True)
            if said.returncode:
                sys.exit(said.stdout + said.stderr)
            theirs, ours = deeds(analysed(folder / "theirs.py")), deeds(analysed(folder / "ours.py"))
        compared += len(theirs)
        for index, (one, other) in enumerate(zip(theirs, ours)):
            if not alike(one, other):
                failed += 1
                print(f"{asset}: deed {index}: Opentrons {one}, deliver {other}; before it {theirs[max(0, index - 3):index]}")
                break
        else:
            if len(theirs) != len(ours):
                failed += 1
                print(f"{asset}: {len(theirs)} deeds of Opentrons, {len(ours)} of deliver")
            else:
                print(f"{asset}: {len(theirs)} deeds are the same")
    print(f"{compared} deeds compared, {failed} pipettes differ")
    sys.exit(failed > 0)


main()
