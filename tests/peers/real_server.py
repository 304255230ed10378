"""Workflows on the server of Opentrons' robot itself, from its source, with simulated hardware.

usage: real_server.py MATTERIXC FOLDER SOURCE PYTHON FILE.mtx... [--play FILE.mtx...]

The server is not on PyPI. SOURCE is a checkout of https://github.com/Opentrons/opentrons at the tag v8.1.0, of which `robot-server` and
`server-utils` are used; PYTHON is a Python 3.10 with opentrons==8.1.0, fastapi==0.99.1, uvicorn==0.27.0.post1, anyio==3.7.1,
python-multipart==0.0.6, pydantic==1.10.12, python-dotenv==1.0.1, sqlalchemy==1.4.51, wsproto==1.2.0, paho-mqtt==1.6.1 and aiohttp.

Each workflow is deployed on a robot with its pipettes, and the server is asked what it did: every command has succeeded, and moves
the volumes that the emitted form says. Then emitted protocols are uploaded and played, labware of one's own and what was measured
of a plate are given to it, a person stops a run, and another pipette hangs there. Files after `--play` are only uploaded and played, with
waits of 1 s and without questions, which the server would put to a person.
"""

import collections
import contextlib
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

COMMAND, FOLDER, SOURCE, PYTHON, *FILES = sys.argv[1:]
PLAYED = FILES[FILES.index("--play") + 1 :] if "--play" in FILES else []
FILES = FILES[: FILES.index("--play")] if "--play" in FILES else FILES
COMMAND, SOURCE = os.path.abspath(COMMAND), os.path.abspath(SOURCE)
SPEED = "20"
ADDRESS = ""
BAD = []


#: How the simulated hardware calls modules.
KINDS = {
    "heaterShakerModuleV1": "heatershaker",
    "temperatureModuleV2": "tempdeck",
    "magneticModuleV2": "magdeck",
    "thermocyclerModuleV2": "thermocycler",
}


def pipettes(text):
    """Those of a workflow, by mount."""
    global ADDRESS
    ADDRESS = "127.0.0.1:1"
    said = ran(place(f"dry{len(os.listdir(FOLDER))}", text), "deploy", "lab.mtx", "--bind", "lab.toml").stdout
    found = re.findall(r'pipetteName\\":\\"(\w+)\\",\\"mount\\":\\"(\w+)', said)
    return {mount: {"model": versioned(name), "id": mount} for name, mount in found}


def versioned(name):
    """A pipette with a version, as robots have them."""
    return name.replace("_gen2", "_v2.1") if name.endswith("_gen2") else f"{name}_v1.4"


@contextlib.contextmanager
def robot(attached, models=tuple(KINDS)):
    """A robot with these pipettes and modules."""
    global ADDRESS
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    modules = {}
    for model in models or ["temperatureModuleV2"]:
        of_kind = modules.setdefault(next(kind for known, kind in KINDS.items() if known[:-2] == model[:-2]), [])
        of_kind.append({"model": model, "serial_number": f"{model}{len(of_kind)}", "calls": []})
    simulated = pathlib.Path(FOLDER) / f"{port}.json"
    simulated.write_text(json.dumps({"machine": "OT-2 Standard", "attached_instruments": attached, "attached_modules": modules}))
    environment = os.environ | {
        "PYTHONPATH": f"{SOURCE}/robot-server:{SOURCE}/server-utils",
        "ENABLE_VIRTUAL_SMOOTHIE": "true",
        "OT_API_CONFIG_DIR": os.path.abspath(f"{FOLDER}/{port}"),
        "OT_ROBOT_SERVER_persistence_directory": "automatically_make_temporary",
        "OT_ROBOT_SERVER_simulator_configuration_file_path": os.path.abspath(simulated),
    }
    arguments = ["-m", "uvicorn", "robot_server.app:app", "--port", str(port), "--ws", "wsproto"]
    with open(f"{FOLDER}/{port}.log", "w") as log:
        process = subprocess.Popen([PYTHON, *arguments], env=environment, stdout=log, stderr=log)
    ADDRESS = f"127.0.0.1:{port}"
    try:
        until = time.monotonic() + 120
        while True:
            with contextlib.suppress(OSError, urllib.error.HTTPError):
                # The database is there after the modules, as a rule.
                ask("/runs")
                if ask("/modules"):
                    break
            if time.monotonic() > until:
                raise SystemExit(f"the server does not start: see {FOLDER}/{port}.log")
            time.sleep(0.5)
        yield
    finally:
        process.terminate()
        process.wait()


def verdict(what, good, said=""):
    print(f"{'ok ' if good else 'BAD'} {what}{': ' + said if said else ''}", flush=True)
    if not good:
        BAD.append(what)


def ask(path):
    request = urllib.request.Request(f"http://{ADDRESS}{path}", headers={"Opentrons-Version": "4"})
    with urllib.request.urlopen(request, timeout=60) as answer:
        return json.load(answer)["data"]


def place(name, text, **files):
    folder = pathlib.Path(FOLDER) / name
    folder.mkdir(parents=True)
    (folder / "lab.mtx").write_text(text)
    (folder / "lab.toml").write_text(f'[ot2]\nhttp = "{ADDRESS}"\n')
    for file, content in files.items():
        (folder / f"{file}.json").write_text(content)
    return folder


DEPLOY = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed", SPEED]


def ran(folder, *arguments):
    return subprocess.run([COMMAND, *arguments], cwd=folder, capture_output=True, text=True, timeout=1200)


def told(folder):
    """What the server says of the commands of the run that the journal names."""
    # The first line is the head of the journal.
    entries = map(json.loads, (folder / "journal").read_text().splitlines()[1:])
    run = next(e["text"] for e in entries if e["event"] == "kept" and e["word"] == "run")
    listed = ask(f"/runs/{run}/commands?cursor=0&pageLength=10000")
    # The list leaves out results.
    return [ask(f"/runs/{run}/commands/{c['id']}") for c in listed], ask(f"/runs/{run}")["status"]


def volumes(commands):
    """What comes into each well, less what goes out, uL."""
    net, tip = collections.Counter(), collections.Counter()
    for kind, p in commands:
        where = (re.sub(r"\W", "_", p.get("labwareId") or ""), p.get("wellName"))
        pipette = re.sub(r"\W", "_", p.get("pipetteId") or "")
        match kind:
            case "aspirate":
                net[where] -= p["volume"]
                tip[pipette] += p["volume"]
            case "dispense":
                net[where] += p["volume"]
                tip[pipette] -= p["volume"]
            case "blowout":
                net[where] += tip.pop(pipette, 0)
            case "dropTip" | "dropTipInPlace":
                tip.pop(pipette, None)
    return net


def whole(file):
    name = pathlib.Path(file).stem
    folder = place(name, pathlib.Path(file).read_text())
    ended = ran(folder, *DEPLOY, "--yes")
    done, _ = told(folder)
    emitted = json.loads(ran(folder, "emit", "lab.mtx", "--target", "opentrons-json").stdout)
    expected = volumes((c["commandType"], c["params"]) for c in emitted["commands"])
    got = volumes((c["commandType"], c["params"] | (c.get("result") or {})) for c in done)
    apart = max((abs(expected[k] - got[k]) for k in {**expected, **got}), default=0)
    good = ended.returncode == 0 and all(c["status"] == "succeeded" for c in done) and apart <= 1e-9
    moves = sum(c["commandType"] in ("aspirate", "dispense", "blowout") for c in done)
    said = f"{len(done)} commands, {moves} move liquid, {len(got)} wells, largest difference {apart:g} uL"
    verdict(f"{name} on the robot's server", good, said if good else ended.stderr[-1500:])


def played(text):
    folder = place("played", text)
    for target in ("opentrons-json", "opentrons-python"):
        ended = ran(folder, "emit", "lab.mtx", "--target", target, "--play", "lab.toml")
        status = ask("/runs")[-1]["status"]
        good = ended.returncode == 0 and status == "succeeded"
        verdict(f"{target}, uploaded and played", good, status if good else ended.stderr[-1500:])


def plays(file):
    """A protocol that the robot runs by itself, on a robot with its pipettes: each of its commands has succeeded."""
    source = pathlib.Path(file)
    text = re.sub(r"^( *)wait (?!until).*$", r"\1wait 1 s", source.read_text(), flags=re.M)
    text = re.sub(r'\bask "', 'note "', text)
    # This version knows no lights in JSON.
    text = re.sub(r"^ *(dim|light) .*\n", "", text, flags=re.M)
    global ADDRESS
    ADDRESS = "127.0.0.1:1"
    folder = place(f"plays_{source.stem}", text)
    for table in source.parent.glob(f"{source.stem}*.csv"):
        (folder / table.name).write_text(table.read_text())
    emitted = json.loads(ran(folder, "emit", "lab.mtx", "--target", "opentrons-json").stdout)["commands"]
    loaded = {c["params"]["mount"]: c["params"]["pipetteName"] for c in emitted if c["commandType"] == "loadPipette"}
    models = [c["params"]["model"] for c in emitted if c["commandType"] == "loadModule"]
    with robot({mount: {"model": versioned(name), "id": mount} for mount, name in loaded.items()}, models):
        (folder / "lab.toml").write_text(f'[ot2]\nhttp = "{ADDRESS}"\n')
        ended = ran(folder, "emit", "lab.mtx", "--target", "opentrons-json", "--play", "lab.toml")
        runs = ask("/runs")
        if not runs:
            verdict(f"{source.stem}, played by the robot", False, ended.stderr[-1500:])
            return
        run = runs[-1]
        listed = ask(f"/runs/{run['id']}/commands?cursor=0&pageLength=10000")
        kinds = sorted({c["commandType"].split("/")[0] for c in listed if "/" in c["commandType"]})
        good = ended.returncode == 0 and run["status"] == "succeeded" and all(c["status"] == "succeeded" for c in listed)
        said = f"{len(listed)} commands, {', '.join(kinds) or 'no modules'}"
        verdict(f"{source.stem}, played by the robot", good, said if good else f"{run['status']} {ended.stderr[-1500:]}")


def own_labware(text):
    load = "import json, opentrons_shared_data.labware as l; print(json.dumps(l.load_definition('corning_96_wellplate_360ul_flat', 2)))"
    definition = json.loads(subprocess.run([PYTHON, "-c", load], capture_output=True, text=True, check=True).stdout)
    definition |= {"namespace": "house", "version": 7}
    definition["parameters"]["loadName"] = "flat_96"
    text = text.replace("plate = Corning96", "plate = Own")
    text = text.replace("lab deck {", 'asset Own from labware "plate.json"\n\nlab deck {')
    folder = place("own", text, plate=json.dumps(definition))
    ended = ran(folder, *DEPLOY)
    done, _ = told(folder)
    loaded = [c["params"]["loadName"] for c in done if c["commandType"] == "loadLabware" and c["status"] == "succeeded"]
    verdict("labware of one's own", ended.returncode == 0 and "flat_96" in loaded, ended.stderr[-1500:] if ended.returncode else "")


def measured(text):
    def stands(name, offsets):
        folder = place(name, text)
        with open(folder / "lab.toml", "a") as bindings:
            bindings.write(offsets)
        ended = ran(folder, *DEPLOY, "--yes")
        done, _ = told(folder)
        where = [c["result"]["position"] for c in done if c["commandType"] == "dispense"]
        loaded = [c["result"].get("offsetId") for c in done if c["commandType"] == "loadLabware"]
        return ended, where, sum(offset is not None for offset in loaded)

    given = {"x": 0.3, "y": -0.4, "z": 0.2}
    fields = ", ".join(f'offset_{axis} = "{mm} mm"' for axis, mm in given.items())
    _, nominal, _ = stands("nominal", "")
    ended, moved, offsets = stands("measured", f"[plate]\ncalibration = {{ {fields} }}\n")
    apart = [abs(b[axis] - a[axis] - mm) for a, b in zip(nominal, moved) for axis, mm in given.items()]
    good = ended.returncode == 0 and offsets == 1 and len(moved) == len(nominal) > 0 and max(apart) <= 1e-9
    said = f"{len(moved)} of its wells are met {list(given.values())} mm from where they were"
    verdict("a plate that was measured to stand elsewhere", good, said if good else f"{apart} {ended.stderr[-1500:]}")


def stopped(text):
    folder = place("stopped", text.replace("    blow out", "    wait 5 min\n    blow out"))
    process = subprocess.Popen([COMMAND, *DEPLOY[:-1], "1"], cwd=folder, stderr=subprocess.PIPE, text=True)
    journal = folder / "journal"
    until = time.monotonic() + 60
    while time.monotonic() < until and not (journal.exists() and '"dispense' in journal.read_text()):
        time.sleep(0.2)
    begun = time.monotonic()
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=120)[1]
    took = time.monotonic() - begun
    _, status = told(folder)
    good = process.returncode == 1 and "stopped by a person" in said and status == "stopped"
    verdict("a run that a person stops", good, f"{status} after {took:.1f} s" if good else f"{status} {said[-1500:]}")


COOK = """mtx 1
use std::opentrons::{Corning96, HeaterShaker, MagneticModule, OT2, P300Single, Reservoir12, TemperatureModule, ThermocyclerGen2, TipRack300}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[5]
    shaker = HeaterShaker on ot2.slot[1]
    cold = TemperatureModule on ot2.slot[3]
    magnets = MagneticModule on ot2.slot[6]
    cycler = ThermocyclerGen2 on ot2.slot[7]
    plate = Corning96 on shaker
    stock = Reservoir12 on ot2.slot[9] holding { A1: 10 mL of water }
}
workflow cook in deck {
    close latch shaker
    heat cold to 10 degC
    engage magnets at 5 mm
    heat cycler to 60 degC
    heat lid cycler to 100 degC
    heat shaker to 60 degC
    shake shaker at 500 rpm
    wait 200 s
    stop shaking shaker
    transfer 50 uL from stock[A1] to plate[A1 .. H1] by ot2.left using tips { tips: once }
}
"""


def modules():
    """What the modules do, by the server: is each on?"""
    on = {}
    for m in ask("/modules"):
        data = m["data"]
        match m["moduleModel"]:
            case "heaterShakerModuleV1":
                on |= {"heater": data["temperatureStatus"] != "idle", "shaker": data["currentSpeed"] > 0}
            case "temperatureModuleV2":
                on["cold"] = data["status"] != "idle"
            case "magneticModuleV2":
                on["magnets"] = data["engaged"]
            case "thermocyclerModuleV2":
                on |= {"block": data["status"] != "idle", "lid": data.get("lidTargetTemperature") is not None}
    return on


def hot(name, stop):
    """A workflow that is stopped while every module is on; what it says, and how long it took."""
    folder = place(name, COOK)
    process = subprocess.Popen([COMMAND, *DEPLOY[:-1], "1"], cwd=folder, stderr=subprocess.PIPE, text=True)
    journal = folder / "journal"
    until = time.monotonic() + 60
    while time.monotonic() < until and not (journal.exists() and "setAndWaitForShakeSpeed" in journal.read_text()):
        time.sleep(0.2)
    time.sleep(2)
    before = modules()
    entries = map(json.loads, journal.read_text().splitlines()[1:])
    run = next(e["text"] for e in entries if e["event"] == "kept" and e["word"] == "run")
    begun = time.monotonic()
    stop(process, run)
    said = process.communicate(timeout=120)[1]
    took = time.monotonic() - begun
    after = modules()
    good = process.returncode == 1 and all(before.values()) and not any(after.values()) and "could not be made safe" not in said
    verdict(name, good, f"{len(before)} on before, none {took:.1f} s after" if good else f"{before} {after} {said[-1500:]}")


def at_the_robot(_, run):
    body = json.dumps({"data": {"actionType": "stop"}}).encode()
    headers = {"Opentrons-Version": "4", "Content-Type": "application/json"}
    request = urllib.request.Request(f"http://{ADDRESS}/runs/{run}/actions", method="POST", data=body, headers=headers)
    urllib.request.urlopen(request, timeout=60).close()


def another(text):
    folder = place("another", text)
    ended = ran(folder, *DEPLOY)
    flat = " ".join(ended.stderr.split())
    good = ended.returncode == 1 and "expected instrument" in flat and "lab.toml:2:8" in flat
    verdict("another pipette, in the server's words", good, "" if good else ended.stderr[-1500:])


os.makedirs(FOLDER)
for file in FILES:
    with robot(pipettes(pathlib.Path(file).read_text())):
        whole(file)
for file in PLAYED:
    plays(file)
FIRST = pathlib.Path(FILES[0]).read_text()
with robot(pipettes(FIRST)):
    played(FIRST)
    own_labware(FIRST)
    measured(FIRST)
    stopped(FIRST)
    hot("a stop leaves no module on", lambda process, _: process.send_signal(signal.SIGINT))
    hot("a stop at the robot leaves no module on", at_the_robot)
with robot({"left": {"model": "p1000_single_v2.1", "id": "left"}}):
    another(FIRST)
sys.exit(1 if BAD else 0)
