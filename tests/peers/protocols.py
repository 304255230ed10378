"""Protocols written by `matterixc emit`, analysed by Opentrons' own software and compared with the plan.

    python3 -m venv venv && venv/bin/pip install opentrons==8.8.2
    venv/bin/python tests/peers/protocols.py target/debug/matterixc examples/opentrons/*.mtx

For each workflow both forms are written; the JSON must be valid by the schemas of protocols and commands, 8 and 8;
`opentrons.cli analyze --check` must find nothing wrong; and what the analysis moved
into and out of each well must equal what the plan moves, to 1e-9 uL. The plan's volumes come from `--target commands-json`,
which knows nothing of Opentrons. The exit status is 1 if anything is wrong.
"""

import collections
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile

import jsonschema

from corpus_compare import channels_of
from planned import planned

TOLERANCE = 1e-9
TARGETS = {"opentrons-json": ".json", "opentrons-python": ".py"}


def analysed(path, out):
    command = [sys.executable, "-m", "opentrons.cli", "analyze", "--check", f"--json-output={out}", str(path)]
    ended = subprocess.run(command, capture_output=True, text=True)
    analysis = json.loads(out.read_text()) if out.exists() else {"result": "none", "errors": [ended.stderr[-500:]]}
    good = ended.returncode == 0 and analysis["result"] == "ok" and not analysis["errors"]
    return good, analysis


def validate(path):
    """Raises where a protocol in JSON does not have the form of the published schemas."""
    data = pathlib.Path(importlib.util.find_spec("opentrons_shared_data").origin).parent / "data"
    schema = {kind: json.loads((data / kind / "schemas/8.json").read_text()) for kind in ("protocol", "command")}
    protocol = json.loads(path.read_text())
    jsonschema.validate(protocol, schema["protocol"])
    for command in protocol["commands"]:
        jsonschema.validate(command, schema["command"])


def moved(analysis):
    """Net volume of each well, uL, by the wells that the channels of the pipette reach, and how often a tip was taken."""
    labware, pipettes, net, tips = {}, {}, collections.Counter(), 0
    held = collections.Counter()
    for command in analysis["commands"]:
        assert command["status"] == "succeeded", command
        kind, params, result = command["commandType"], command["params"], command.get("result") or {}
        if kind == "loadLabware":
            definition = result["definition"]
            labware[result["labwareId"]] = (params.get("displayName"), definition["ordering"])
        if kind == "loadPipette":
            pipettes[result["pipetteId"]] = channels_of(params["pipetteName"])
        if kind == "pickUpTip":
            tips += 1
        if kind not in ("aspirate", "dispense", "blowout"):
            if kind in ("dropTip", "dropTipInPlace"):
                held[params["pipetteId"]] = 0
            continue
        pipette = params["pipetteId"]
        name, ordering = labware[params["labwareId"]]
        column = next(c for c in ordering if params["wellName"] in c)
        count = pipettes[pipette]
        volume = result.get("volume", 0) if kind != "blowout" else held[pipette]
        sign = -1 if kind == "aspirate" else 1
        held[pipette] -= sign * volume
        if count == 96:
            # All columns of a plate, eight channels to each of twelve troughs, or all to one.
            wells = [well for column in ordering for well in column]
            reached = [well for well in wells for _ in range(96 // len(wells))]
        else:
            reached = [params["wellName"]] * count if len(column) == 1 else column[column.index(params["wellName"]):][:count]
        for well in reached:
            net[f"{name}[{well}]"] += sign * volume
    return net, tips


def main(matterixc, files):
    wrong = 0
    for file in map(pathlib.Path, files):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)

            def emit(target, suffix):
                out = folder / f"protocol{suffix}"
                subprocess.run([matterixc, "emit", file, "--target", target, "-o", out], check=True)
                return out

            lines = emit("commands-json", ".jsonl").read_text().splitlines()
            plan, tips = planned(lines)
            for target, suffix in TARGETS.items():
                protocol = emit(target, suffix)
                if suffix == ".json":
                    validate(protocol)
                good, analysis = analysed(protocol, folder / f"analysis{suffix}.json")
                net, taken = moved(analysis) if good else (collections.Counter(), 0)
                # Only what is moved: a well that got and gave nothing is left out.
                places = {w for c in (plan, net) for w, v in c.items() if abs(v) > TOLERANCE}
                worst = max((abs(plan[w] - net[w]) for w in places), default=0.0)
                good = good and worst <= TOLERANCE and tips == taken and bool(places)
                wrong += not good
                commands = len(analysis.get("commands", []))
                print(f"{'ok   ' if good else 'WRONG'} {file.stem} {target}: {analysis['result']}, {commands} commands, "
                      f"{len(places)} wells, {taken} of {tips} tips, worst difference {worst:.1e} uL")
                for error in analysis["errors"]:
                    print("     ", error if isinstance(error, str) else error["detail"])
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
