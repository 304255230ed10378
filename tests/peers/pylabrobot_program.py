"""Programs for PyLabRobot, written by `matterixc emit`, run by PyLabRobot and compared with the plan.

    python3 -m venv venv && venv/bin/pip install pylabrobot==0.2.1
    venv/bin/python tests/peers/pylabrobot_program.py target/debug/matterixc examples/opentrons/*.mtx

Each program runs on PyLabRobot's chatterbox, whose calls are noted: what they move into and out of each well must equal what the plan
moves, to 1e-9 uL, and tips must be taken as often. PyLabRobot itself refuses a tip that is not there, a second tip on a channel and labware in a
place that is taken. Workflows for which PyLabRobot has no calls must be refused by `emit`, with exit status 1 and nothing written. The exit
status is 1 if anything is wrong.
"""

import asyncio
import collections
import contextlib
import importlib.util
import io
import json
import pathlib
import subprocess
import sys
import tempfile

from pylabrobot.liquid_handling.backends import LiquidHandlerChatterboxBackend

from planned import planned

TOLERANCE = 1e-9


def place(resource):
    """A well as the plan names it: its labware and its own name."""
    labware = resource.parent.name if resource.parent else resource.name
    return f"{labware}[{resource.name.removeprefix(labware + '_')}]"


def played(path):
    """Net volume of each well, uL, and how often tips were taken, by the calls that PyLabRobot makes."""
    net, tips = collections.Counter(), 0
    spec = importlib.util.spec_from_file_location("program", path)
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)

    class Noted(LiquidHandlerChatterboxBackend):
        async def pick_up_tips(self, ops, use_channels, **more):
            nonlocal tips
            tips += 1

        async def drop_tips(self, ops, use_channels, **more):
            pass

        async def aspirate(self, ops, use_channels, **more):
            for op in ops:
                net[place(op.resource)] -= op.volume

        async def dispense(self, ops, use_channels, **more):
            for op in ops:
                net[place(op.resource)] += op.volume

    program.LiquidHandlerChatterboxBackend = Noted
    sys.argv = [str(path)]
    with contextlib.redirect_stdout(io.StringIO()):
        asyncio.run(program.main())
    return net, tips


def main(matterixc, files):
    wrong = 0
    for file in map(pathlib.Path, files):
        with tempfile.TemporaryDirectory() as folder:
            out, plan = pathlib.Path(folder) / "program.py", pathlib.Path(folder) / "plan.jsonl"
            emitted = subprocess.run([matterixc, "emit", file, "--target", "pylabrobot", "-o", out], capture_output=True, text=True)
            if emitted.returncode:
                refused = emitted.returncode == 1 and not out.exists() and "PyLabRobot has no call for" in emitted.stderr + emitted.stdout
                wrong += not refused
                first = (emitted.stderr + emitted.stdout).strip().splitlines()[0]
                print(f"{file.stem:28} {'refused' if refused else 'WRONG':8} {first}")
                continue
            subprocess.run([matterixc, "emit", file, "--target", "commands-json", "-o", plan], check=True, capture_output=True)
            expected, tips = planned(plan.read_text().splitlines())
            try:
                net, taken = played(out)
            except Exception as error:
                wrong += 1
                print(f"{file.stem:28} WRONG    {type(error).__name__}: {error}")
                continue
            wells = [well for well in expected.keys() | net.keys() if not well.startswith(("ot2.trash", "trash"))]
            worst = max((abs(expected[well] - net[well]) for well in wells), default=0)
            same = worst <= TOLERANCE and taken == tips
            wrong += not same
            print(f"{file.stem:28} {'ok' if same else 'WRONG':8} {len(wells)} wells, {taken} tips (planned {tips}), largest difference {worst:.3g} uL")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]))
