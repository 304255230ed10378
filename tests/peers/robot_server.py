"""Opentrons' own run engine behind its robot's HTTP interface, as far as `std::robot_server` speaks it.

usage: robot_server.py MATTERIXC FOLDER FILE.mtx... [--record RECORDING]

The robot's server is not on PyPI; its engine is (`opentrons` 8.8.2), and that judges here: each command is read by the engine's
own model, queued, and carried out on the engine's simulated OT-2. Only routes, statuses and envelopes are this file's. Every
protocol is deployed over HTTP, and must end well with the volumes that its emitted form moves in the engine's analysis. Then
commands that cannot be done must end in the right failure on the right line. With `--record` the exchange of the first file is
written down, without definitions of labware.
"""

import asyncio
import collections
import dataclasses
import http.server
import json
import logging
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import uuid

from opentrons.hardware_control import API
from opentrons.hardware_control.types import HardwareFeatureFlags
from opentrons.protocol_engine import Config, DeckType, ProtocolEngine, commands, error_recovery_policy
from opentrons.protocol_engine.create_protocol_engine import create_protocol_engine
from opentrons.protocol_engine.errors import ProtocolEngineError
from opentrons.protocol_reader import ProtocolReader
from opentrons.protocol_runner import RunOrchestrator
from opentrons_shared_data.labware import load_definition
from opentrons_shared_data.labware.labware_definition import labware_definition_type_adapter
from pydantic import TypeAdapter, ValidationError

SPEED = "200"
VERSION = "4"
CREATE = TypeAdapter(commands.CommandCreate)
BAD = []
# What the engine refuses here it is meant to refuse.
logging.disable(logging.CRITICAL)
LOOP = asyncio.new_event_loop()
threading.Thread(target=LOOP.run_forever, daemon=True).start()


def wait_for(coroutine):
    return asyncio.run_coroutine_threadsafe(coroutine, LOOP).result()


def verdict(what, good, said=""):
    print(f"{'ok ' if good else 'BAD'} {what}{': ' + said if said else ''}", flush=True)
    if not good:
        BAD.append(what)


@dataclasses.dataclass
class Run:
    """A run of the robot: the engine, and what the server steers it by."""

    engine: ProtocolEngine
    steered: RunOrchestrator
    source: object = None

    async def play(self):
        return await self.steered.run(deck_configuration=[], protocol_source=self.source)

    def summary(self):
        state = self.engine.state_view.get_summary()
        errors = [{"errorType": e.errorType, "detail": e.detail} for e in state.errors]
        return {"status": state.status.value, "errors": errors}

    def command(self, name):
        return shown(self.engine.state_view.commands.get(name))


async def begun(file):
    hardware = await API.build_hardware_simulator(feature_flags=HardwareFeatureFlags())
    await hardware.home()
    config = Config(
        robot_type="OT-2 Standard",
        deck_type=DeckType.OT2_STANDARD,
        use_virtual_pipettes=True,
        use_virtual_modules=True,
        use_simulated_deck_config=True,
    )
    made = await create_protocol_engine(hardware, config, error_recovery_policy.never_recover)
    source = await ProtocolReader().read_saved(files=[file], directory=None) if file else None
    config = source.config if source else None
    steered = RunOrchestrator.build_orchestrator(hardware_api=hardware, protocol_engine=made, protocol_config=config)
    return Run(made, steered, source)


class Robot:
    """One robot with its runs."""

    def __init__(self):
        self.runs: dict[str, Run] = {}
        self.protocols = {}
        self.commands = []
        self.exchanges = []
        self.switched_off = []
        self.spoil = None
        self.stop_at = None

    def ask(self, method, path, body):
        path, _, query = path.partition("?")
        parts = path.strip("/").split("/")
        if parts[0] == "protocols":
            return self.protocol(method, parts[1:], body)
        if method == "GET" and parts == ["modules"]:
            return 200, {"data": [m for run in self.runs.values() for m in attached(run)]}
        if method == "POST" and parts == ["commands"]:
            return self.stateless(body)
        if method == "POST" and parts == ["runs"]:
            run = str(uuid.uuid4())
            self.runs[run] = wait_for(begun(self.protocols.get(body["data"].get("protocolId"))))
            return 201, {"data": {"id": run, "status": "idle", "current": True}}
        if len(parts) < 2 or parts[0] != "runs" or parts[1] not in self.runs:
            return 404, {"errors": [{"id": "RunNotFound", "title": "Run Not Found", "detail": path}]}
        run = self.runs[parts[1]]
        match (method, parts[2:]):
            case ("POST", ["commands"]):
                return self.command(run, body, "waitUntilComplete=true" in query)
            case ("POST", ["labware_definitions"]):
                definition = labware_definition_type_adapter.validate_python(body["data"])
                return 201, {"data": {"definitionUri": str(run.steered.add_labware_definition(definition))}}
            case ("GET", ["commands", name]):
                return 200, {"data": run.command(name)}
            case ("POST", ["actions"]) if body["data"]["actionType"] == "play":
                run.steered_to_end = asyncio.run_coroutine_threadsafe(run.play(), LOOP)
                return 201, {"data": {"id": str(uuid.uuid4()), "actionType": "play"}}
            case ("GET", []):
                return 200, {"data": run.summary()}
            case ("POST", ["actions"]) if body["data"]["actionType"] == "stop":
                wait_for(run.steered.stop())
                return 201, {"data": {"id": str(uuid.uuid4()), "actionType": "stop"}}
        return 405, {"errors": [{"id": "NotAllowed", "detail": f"{method} {path}"}]}

    def stateless(self, body):
        """A command outside of runs: the engine's own model reads it, and it switches off what a run left on."""
        try:
            create = CREATE.validate_python(body["data"])
        except ValidationError as e:
            return 422, {"errors": [{"id": "InvalidRequest", "title": "Invalid Request", "detail": str(e)}]}
        known = {m["id"] for run in self.runs.values() for m in attached(run)}
        if create.params.moduleId not in known:
            return 201, {"data": {"id": "0", "status": "failed", "error": {"errorType": "ModuleNotLoadedError", "detail": "?"}}}
        self.switched_off.append((create.commandType, create.params.moduleId))
        return 201, {"data": {"id": str(uuid.uuid4()), "status": "succeeded"}}

    def protocol(self, method, parts, body):
        """A protocol in a form, and its analysis."""
        if method == "POST" and not parts:
            head, content = body.split(b"\r\n\r\n", 1)
            mark = head.split(b"\r\n", 1)[0]
            name = re.search(rb'name="files"; filename="([^"]+)"', head)[1].decode()
            content = content[: content.rindex(b"\r\n" + mark + b"--")]
            protocol = str(uuid.uuid4())
            file = pathlib.Path(tempfile.mkdtemp()) / name
            file.write_bytes(content)
            self.protocols[protocol] = file
            return 201, {"data": {"id": protocol, "analysisSummaries": [{"id": "1", "status": "pending"}]}}
        file = self.protocols[parts[0]]
        out = file.with_suffix(".analysis")
        arguments = ["-m", "opentrons.cli", "analyze", "--json-output", str(out), str(file)]
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
        analysis = json.loads(out.read_text())
        errors = [{k: e[k] for k in ("errorType", "detail")} for e in analysis["errors"]]
        return 200, {"data": {"id": "1", "status": "completed", "result": analysis["result"], "errors": errors}}

    def command(self, run, body, waits):
        if self.spoil:
            self.spoil(body["data"])
        if self.stop_at == body["data"]["commandType"]:
            wait_for(run.steered.stop())
        try:
            create = CREATE.validate_python(body["data"])
        except ValidationError as e:
            return 422, {"errors": [{"id": "InvalidRequest", "title": "Invalid Request", "detail": str(e)}]}
        try:
            command = wait_for(run.steered.add_command_and_wait_for_interval(create, waits, 60000))
        except ProtocolEngineError as e:
            return 409, {"errors": [{"id": "RunStopped", "title": "Run Stopped", "detail": str(e)}]}
        self.commands.append((run, command.id))
        return 201, {"data": run.command(command.id) if waits else shown(command)}


def attached(run):
    """The modules of a run as the robot's server shows them. Virtual modules have no temperature: they are at their set points at once."""
    view = run.engine.state_view.modules
    for m in view.get_all():
        known = view._state.substate_by_module_id[m.id]
        target = getattr(known, "plate_target_temperature", None) or getattr(known, "target_block_temperature", None)
        data = {"currentTemperature": 22.0 if target is None else target, "lidTemperature": 105.0}
        yield {"id": f"module-{m.serialNumber}", "serialNumber": m.serialNumber, "data": data}


def shown(command):
    data = json.loads(command.model_dump_json(exclude_none=True))
    (data.get("result") or {}).pop("definition", None)
    return data


def serve(robot):
    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_):
            pass

        def handle_any(self):
            length = int(self.headers.get("Content-Length", 0))
            body = self.rfile.read(length) if length else None
            if body and self.headers.get("Content-Type") == "application/json":
                body = json.loads(body)
            if self.headers.get("Opentrons-Version") != VERSION:
                detail = {"id": "InvalidRequest", "detail": "header.opentrons-version: field required"}
                status, answer = 422, {"errors": [detail]}
            else:
                status, answer = robot.ask(self.command, self.path, body)
            robot.exchanges.append({"method": self.command, "path": self.path, "body": body if isinstance(body, dict) else None, "status": status, "answer": answer})
            data = json.dumps(answer).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        do_GET = do_POST = do_PATCH = handle_any

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"127.0.0.1:{server.server_port}"


def volumes(commands):
    """What comes into each well, less what goes out, uL."""
    net, tip = collections.Counter(), collections.Counter()
    for c in commands:
        p, r = c["params"], c.get("result") or {}
        where = (p.get("labwareId"), p.get("wellName"))
        match c["commandType"]:
            case "aspirate":
                net[where] -= r["volume"]
                tip[p["pipetteId"]] += r["volume"]
            case "dispense":
                net[where] += r["volume"]
                tip[p["pipetteId"]] -= r["volume"]
            case "blowout":
                net[where] += tip.pop(p["pipetteId"], 0)
            case "dropTip" | "dropTipInPlace":
                tip.pop(p["pipetteId"], None)
    return net


def deploy(command, folder, name, text, address, files={}):
    place = pathlib.Path(folder) / name
    place.mkdir(parents=True)
    (place / "lab.mtx").write_text(text)
    for name, content in files.items():
        (place / name).write_text(content)
    (place / "lab.toml").write_text(f'[ot2]\nhttp = "{address}"\n')
    arguments = ["--bind", "lab.toml", "--mode", "real", "--yes", "--journal", "journal", "--speed", SPEED]
    return subprocess.run([command, "deploy", "lab.mtx", *arguments], cwd=place, capture_output=True, text=True, timeout=600)


def told(robot):
    return [run.command(i) for run, i in robot.commands]


def whole(command, folder, file, recording):
    """A protocol, over HTTP and as its emitted form is analysed."""
    robot = Robot()
    text = pathlib.Path(file).read_text()
    ended = deploy(command, folder, pathlib.Path(file).stem, text, serve(robot))
    done = told(robot)
    if recording:
        lines = (json.dumps(e, ensure_ascii=False) + "\n" for e in robot.exchanges)
        pathlib.Path(recording).write_text("".join(lines))
    emitted = os.path.join(folder, pathlib.Path(file).stem + ".json")
    subprocess.run([command, "emit", file, "--target", "opentrons-json", "-o", emitted], check=True)
    analysis = emitted + ".analysis"
    subprocess.run(
        [sys.executable, "-m", "opentrons.cli", "analyze", "--json-output", analysis, emitted], check=True, capture_output=True
    )
    expected = volumes(json.loads(pathlib.Path(analysis).read_text())["commands"])
    # Identifiers in a file are names with letters, digits and `_` only.
    plain = {re.sub(r"\W", "_", k[0] or ""): k[0] for k in volumes(done)}
    got = {(re.sub(r"\W", "_", k[0]), k[1]): v for k, v in volumes(done).items()}
    apart = max((abs(expected[k] - got.get(k, 0)) for k in {**expected, **got}), default=0)
    failed = [c for c in done if c["status"] != "succeeded"]
    moves = sum(c["commandType"] in ("aspirate", "dispense", "blowout") for c in done)
    good = ended.returncode == 0 and not failed and apart <= 1e-9 and moves > 0 and plain
    said = f"{len(done)} commands, {moves} move liquid, {len(got)} wells, largest difference {apart:g} uL"
    verdict(f"{pathlib.Path(file).stem} over HTTP", good, said if good else ended.stderr[-1500:])


def uploaded(command, folder, file):
    """A protocol that the robot runs by itself."""
    robot = Robot()
    bindings = os.path.join(folder, "robot.toml")
    pathlib.Path(bindings).write_text(f'[ot2]\nhttp = "{serve(robot)}"\n')
    for target in ("opentrons-json", "opentrons-python"):
        arguments = ["emit", file, "--target", target, "--play", bindings]
        ended = subprocess.run([command, *arguments], capture_output=True, text=True, timeout=300)
        runs = list(robot.runs.values())[-1:]
        done = [c for run in runs for c in run.engine.state_view.commands.get_all()]
        good = ended.returncode == 0 and [run.summary()["status"] for run in runs] == ["succeeded"]
        verdict(f"{target}, uploaded and played", good, f"{len(done)} commands" if good else ended.stderr[-1500:])



def own_labware(command, folder, file):
    """Labware that is not in Opentrons' own library is given to the robot, which then knows it."""
    definition = load_definition("corning_96_wellplate_360ul_flat", 2) | {"namespace": "house", "version": 7}
    definition["parameters"]["loadName"] = "flat_96"
    text = pathlib.Path(file).read_text().replace("plate = Corning96", "plate = Own")
    text = text.replace("lab deck {", 'asset Own from labware "plate.json"\n\nlab deck {')
    robot = Robot()
    ended = deploy(command, folder, "own", text, serve(robot), {"plate.json": json.dumps(definition)})
    loaded = [c["params"] for c in told(robot) if c["commandType"] == "loadLabware" and c["status"] == "succeeded"]
    good = ended.returncode == 0 and any(p["loadName"] == "flat_96" for p in loaded)
    verdict("labware of one's own", good, f"{len(robot.commands)} commands" if good else ended.stderr[-1500:])


def no_tip(data):
    """The tip is not picked up."""
    if data["commandType"] == "pickUpTip":
        data["commandType"], data["params"] = "comment", {"message": "the tip is left where it is"}


def spoiled(command, folder, file):
    """Commands that the engine refuses."""
    text = pathlib.Path(file).read_text()

    def too_much(data):
        if data["commandType"] == "aspirate":
            data["params"]["volume"] = 400

    def no_well(data):
        if data["commandType"] == "dispense":
            data["params"]["wellName"] = "Z9"

    def no_field(data):
        if data["commandType"] == "aspirate":
            del data["params"]["flowRate"]

    cases = [
        ("a volume that the tip does not hold", too_much, "tip_overflow", "aspirate"),
        ("a tip that is not there", no_tip, "no_tip", "aspirate"),
        ("a well that is not there", no_well, "refused", "dispense"),
        ("a command without a field", no_field, "refused", "aspirate"),
    ]
    for number, (what, spoil, failure, verb) in enumerate(cases):
        robot = Robot()
        robot.spoil = spoil
        ended = deploy(command, folder, f"spoiled{number}", text, serve(robot))
        line = next(i for i, l in enumerate(text.splitlines(), 1) if l.strip().startswith(verb))
        good = ended.returncode == 1 and failure in ended.stderr and f"lab.mtx:{line}" in ended.stderr
        verdict(what, good, f"{failure} on line {line}" if good else ended.stderr[-1500:])
    robot = Robot()
    robot.stop_at = "dispense"
    ended = deploy(command, folder, "stopped", text, serve(robot))
    good = ended.returncode == 1 and "run_stopped" in ended.stderr
    verdict("a run that was stopped at the robot", good, "run_stopped" if good else ended.stderr[-1500:])


def left_on(command, folder, file):
    """A run that fails while modules are on: each is switched off, by the identifier that the server gives to it."""
    text = pathlib.Path(file).read_text()
    for name, spoil, stop_at, failure in [("cut", no_tip, None, "no_tip"), ("halted", None, "aspirate", "run_stopped")]:
        robot = Robot()
        robot.spoil, robot.stop_at = spoil, stop_at
        ended = deploy(command, folder, f"left_on_{name}", text, serve(robot))
        off = collections.Counter(kind for kind, _ in robot.switched_off)
        wanted = ["heaterShaker/deactivateHeater", "heaterShaker/deactivateShaker", "temperatureModule/deactivate", "magneticModule/disengage",
                  "thermocycler/deactivateBlock", "thermocycler/deactivateLid"]
        good = ended.returncode == 1 and failure in ended.stderr and all(off[kind] >= 1 for kind in wanted)
        verdict(f"{failure} with modules on: all are switched off", good, f"{dict(off)}" if good else f"{dict(off)} {ended.stderr[-1500:]}")


def main():
    arguments = sys.argv[1:]
    recording = None
    if "--record" in arguments:
        at = arguments.index("--record")
        recording = arguments[at + 1]
        del arguments[at : at + 2]
    command, folder, *files = arguments
    command = os.path.abspath(command)
    for number, file in enumerate(files):
        whole(command, folder, file, recording if number == 0 else None)
    uploaded(command, folder, files[0])
    own_labware(command, folder, files[0])
    for file in files:
        if pathlib.Path(file).stem == "modules":
            left_on(command, folder, file)
    spoiled(command, folder, files[0])
    sys.exit(1 if BAD else 0)


main()
