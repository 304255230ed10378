"""SiLA 2 in both directions against the standard's reference implementation for Python.

usage: sila.py MATTERIXC FOLDER

`sila2` (PyPI, MIT) drives a lab that is served, and serves a plate that a workflow drives. The features that are served are held
against the schema of the standard, which comes with it. Each line printed is a figure or a verdict; the exit status is 1 where one
is bad.
"""

import logging
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

import grpc
import lxml.etree
import sila2
from sila2.client import SilaClient
from sila2.framework import (
    CommandExecutionNotAccepted,
    CommandExecutionNotFinished,
    DefinedExecutionError,
    Feature,
    UndefinedExecutionError,
    ValidationError,
)
from sila2.server import FeatureImplementationBase, SilaServer

COMMAND, FOLDER = os.path.abspath(sys.argv[1]), sys.argv[2]
INPUTS = pathlib.Path(__file__).parent.parent / "deploy"
FEATURE = (INPUTS / "hotplate.sila.xml").read_text()
SPEED = 10
BAD = []

LAB = """mtx 1
use std::heating::IkaRetControl
use std::pumps::TubePump
use std::glassware::Beaker250mL
/// A bench by the window.
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
}
capability Turner {
    param limit: Frequency
    state turns: Ratio = 0
    command turn for_a_while with(speed: Frequency)
        needs speed <= limit else too_fast "turn more slowly"
        needs turns < 3 else worn_out "take a rest"
        fails jammed
        effect turns = turns + 1
        takes 3 s in 1 s .. 10 s
    command rest
        effect turns = 0
}
/// Warms a plate and lets it be.
skill warm_up(plate: Heater) to(t: Temperature)
    fails cold
    takes 2 s in 0 s .. 1 min
{
    heat plate to t
    wait 2 s
    stop heating plate
}
/// Weighs what stands on a balance.
skill weigh(scale: Balance) -> Mass {
    let seen <- read scale
    return seen
}
skill count(n: Int) -> Int
    needs n in 1 .. 7
{
    return 2 * n
}
"""

# A device of the library behind the same server.
OWN = """mtx 1
use std::heating::IkaRctBasic
driver RctSila for IkaRctBasic over sila(feature: "org.example/heating/HotPlate/v1", timeout: 2 s) {
    heat to(t) sends "SetTarget(Target: {t as degC}, Mode: fast, Quiet: false)"
    stop heating sends "Stop"
    reading temperature asks "CurrentTemperature" expects "{degC}"
    reply "SensorFailed" fails sensor_failed
    safe sends "Stop"
}
lab bench { ambient: 22 degC, plate = IkaRctBasic at (0, 0, 0) m }
workflow warm in bench {
    heat plate to 60 degC
    wait until plate.temperature >= 50 degC timeout 1 h
} finally { stop heating plate }
"""


def verdict(what, good, said=""):
    print(f"{'ok ' if good else 'BAD'} {what}{': ' + str(said) if said != '' else ''}", flush=True)
    if not good:
        BAD.append(what)


def raised(call, kind):
    """What a call raises, if it is of this kind."""
    try:
        call()
    except kind as error:
        return error
    except Exception as error:  # noqa: BLE001
        print("    another error:", type(error).__name__, error)
    return None


# ---- a lab, served


def start(folder, text, *more):
    os.makedirs(folder, exist_ok=True)
    (pathlib.Path(folder) / "lab.mtx").write_text(text)
    process = subprocess.Popen(
        [COMMAND, "serve", "lab.mtx", "--tcp", "0", "--speed", str(SPEED), *(more or ["--insecure", "--no-discovery"])],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=open(os.path.join(folder, "said"), "w"),
        text=True,
    )
    address = process.stdout.readline().strip()
    if not address:
        raise SystemExit(f"nothing is served: {open(os.path.join(folder, 'said')).read()}")
    host, port = address.rsplit(":", 1)
    return process, host, int(port)


def schema():
    return lxml.etree.XMLSchema(lxml.etree.parse(os.path.join(os.path.dirname(sila2.__file__), "resources", "xsd", "FeatureDefinition.xsd")))


def served():
    text = LAB.replace("    beaker =", "    turner = Turning at (1, 0, 0) m\n    beaker =").replace(
        "skill count", "asset Turning: Turner { limit: 5 Hz }\nskill count"
    )
    process, host, port = start(os.path.join(FOLDER, "served"), text)
    try:
        client = SilaClient(host, port, insecure=True)
        service = client.SiLAService
        names = service.ImplementedFeatures.get()
        verdict("the official client connects", service.ServerName.get() == "bench", f"{len(names)} features")
        xsd, valid = schema(), 0
        for name in names:
            definition = service.GetFeatureDefinition(name).FeatureDefinition
            valid += xsd.validate(lxml.etree.fromstring(definition.encode()))
        verdict("features keep to the standard's schema", valid == len(names), f"{valid} of {len(names)}")
        service.SetServerName("renamed")
        verdict("the server is renamed", service.ServerName.get() == "renamed")
        missing = raised(lambda: service.GetFeatureDefinition("org.example/none/None/v1"), DefinedExecutionError)
        verdict("a feature that is not there", missing is not None and missing.identifier == "UnimplementedFeature")

        plate = client.PlateHeater
        before = client.PlateWarm.Temperature.get()
        plate.Heat(T=60.0)
        verdict("a command sets what it sets", plate.Active.get() is True and abs(plate.Target.get() - 60.0) < 1e-9)
        time.sleep(1.5)
        after = client.PlateWarm.Temperature.get()
        verdict("the twin heats", after > before + 1, f"{before:.2f} to {after:.2f} degC")
        outside = raised(lambda: plate.Heat(T=500.0), ValidationError)
        verdict("a set point outside of its range is refused by the client", outside is not None, f"{outside!r:.120}")
        said = call(host, port, names, "PlateHeater", "Heat", b"\x0a\x09\x09" + struct.pack("<d", 500.0))
        verdict("and by the server", "T" in said and "above 340" in said, said)
        described(service, names)

        turner = client.TurnerTurner
        began = time.monotonic()
        turning = turner.TurnForAWhile(Speed=2.0)
        early = raised(turning.get_responses, CommandExecutionNotFinished)
        busy = raised(lambda: turner.TurnForAWhile(Speed=2.0), CommandExecutionNotAccepted)
        verdict("it cannot be asked for its end too early", early is not None)
        verdict("a device that is in use takes no other command", busy is not None, busy)
        news = []
        while not turning.done:
            news.append((turning.status, turning.progress))
            time.sleep(0.02)
        took = time.monotonic() - began
        turning.get_responses()
        moved = sorted({p for _, p in news if p is not None})
        verdict("an observable command", 0.2 < took < 3 and len(moved) > 1, f"{took:.2f} s, progress {moved}")
        verdict("its effect", turner.Turns.get() == 1.0, turner.Turns.get())
        for _ in range(2):
            ended(turner.TurnForAWhile(Speed=5.0))
        error = raised(lambda: ended(turner.TurnForAWhile(Speed=5.0)), DefinedExecutionError)
        good = error is not None and error.identifier == "WornOut"
        verdict("a need that does not hold is a defined error", good, f"{error!r:.160}")
        turner.Rest()
        warming = client.BenchSkills.WarmUp(Plate="plate", T=45.0)
        held = raised(lambda: plate.Heat(T=30.0), CommandExecutionNotAccepted)
        while not warming.done:
            time.sleep(0.02)
        warming.get_responses()
        weighed = ended(client.BenchSkills.Weigh(Scale="plate")).Result
        counted = ended(client.BenchSkills.Count(N=6)).Result
        verdict("results of skills arrive", 150 < weighed < 250 and counted == 12, f"{weighed} g, {counted}")
        verdict("a skill of the file", held is not None and plate.Target.get() == 45.0 and plate.Active.get() is False, held)
        wrong = raised(lambda: client.BenchSkills.WarmUp(Plate="beaker", T=45.0), ValidationError)
        verdict("a thing that does not fit", wrong is not None, f"{wrong!r:.120}")
        turning = turner.TurnForAWhile(Speed=1.0)
        client.CancelController.CancelCommand(str(turning.execution_uuid))
        until = time.monotonic() + 10
        while not turning.done and time.monotonic() < until:
            time.sleep(0.02)
        error = raised(turning.get_responses, UndefinedExecutionError)
        good = error is not None and "cancelled" in error.message
        verdict("a command is cancelled", good, f"{error!r:.120}")
        unknown = raised(lambda: client.CancelController.CancelCommand(str(turning.execution_uuid)), DefinedExecutionError)
        verdict("one that has ended is not", unknown is not None and unknown.identifier == "InvalidCommandExecutionUUID")
        warming = client.BenchSkills.WarmUp(Plate="plate", T=46.0)
        client.CancelController.CancelAll()
        verdict("and all are", raised(lambda: ended(warming), UndefinedExecutionError) is not None)
        verdict("metadata on a subscription is refused", *beside(host, port, names))
        turns = turner.Turns.get()
        seen = turner.Turns.subscribe()
        first = next(iter(seen))
        turner.TurnForAWhile(Speed=1.0)
        second = next(iter(seen))
        seen.cancel()
        verdict("a property that is subscribed to", (first, second) == (turns, turns + 1), (first, second))
        rubbish(host, port, names)
        verdict("it still answers after rubbish", service.ServerName.get() == "renamed")
        first = service.ServerUUID.get()
        client.close()
        process.send_signal(signal.SIGTERM)
        verdict("it ends when it is told to", process.wait(10) == 0)
    finally:
        process.kill()
    process, host, port = start(os.path.join(FOLDER, "served"), text)
    try:
        client = SilaClient(host, port, insecure=True)
        second = client.SiLAService.ServerUUID.get()
        client.close()
        verdict("its UUID stays", first == second, first)
    finally:
        process.kill()


def call(host, port, names, feature, command, message):
    """The error of a call, decoded as far as it can be read."""
    import base64

    originator, category, identifier, version = next(n for n in names if f"/{feature}/" in n).split("/")
    path = f"/sila2.{originator}.{category}.{identifier.lower()}.{version}.{identifier}/{command}"
    channel = grpc.insecure_channel(f"{host}:{port}")
    try:
        channel.unary_unary(path)(message, timeout=5)
        return "it was done"
    except grpc.RpcError as error:
        return base64.b64decode(error.details()).decode(errors="replace")
    finally:
        channel.close()


def described(service, names):
    """Whether features say what declarations of the lab say: ranges, units, texts."""
    text = "".join(service.GetFeatureDefinition(n).FeatureDefinition for n in names if "bench" in n)
    wanted = [
        "<MaximalInclusive>340</MaximalInclusive>",
        "<MinimalInclusive>0</MinimalInclusive>",
        "<MaximalInclusive>5</MaximalInclusive>",
        "<MinimalInclusive>1</MinimalInclusive>",
        "<Label>degC</Label>",
        "Warms a plate and lets it be.",
        "Set it to `t` and switch its heating on.",
        "The failure `worn_out`. To fix it: take a rest.",
        "The IKA RET control-visc",
    ]
    lacking = [w for w in wanted if w not in text]
    verdict("features have ranges, units and texts", not lacking, lacking or "")
    verdict("the server says what it is", service.ServerDescription.get() == "The lab `bench`. A bench by the window.")


def ended(command):
    """What an observable command answers, once it has ended."""
    until = time.monotonic() + 10
    while not command.done and time.monotonic() < until:
        time.sleep(0.02)
    return command.get_responses()


def beside(host, port, names):
    """Whether a subscription with metadata is refused, and how."""
    parts = next(n for n in names if n.endswith("PlateHeater/v1")).split("/")
    path = f"/sila2.{parts[0]}.{parts[1]}.{parts[2].lower()}.{parts[3]}.{parts[2]}/Subscribe_Target"
    channel = grpc.insecure_channel(f"{host}:{port}")
    try:
        told = channel.unary_stream(path)(b"", timeout=5, metadata=[("sila-org.example-test-lock-v1-metadata-key-bin", b"x")])
        return False, next(iter(told))
    except grpc.RpcError as error:
        return error.code().name == "ABORTED", error.code().name
    finally:
        channel.close()


def rubbish(host, port, names):
    for content in (b"GET / HTTP/1.1\r\n\r\n", b"\x00" * 4096, b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\xff" * 2000):
        with socket.create_connection((host, port)) as stream:
            stream.sendall(content)
    channel = grpc.insecure_channel(f"{host}:{port}")
    ends = set()
    for path in ["/x", "/x/y", "/sila2.org.silastandard.core.silaservice.v1.SiLAService/Get_ServerName"]:
        for message in (b"", b"\xff\xff\xff\xff", b"\x0a\x7f\x00", os.urandom(64)):
            try:
                channel.unary_unary(path)(message, timeout=5)
                ends.add("answered")
            except grpc.RpcError as error:
                ends.add(error.code().name)
    heat = next(n for n in names if n.endswith("PlateHeater/v1")).split("/")
    path = f"/sila2.{heat[0]}.{heat[1]}.{heat[2].lower()}.{heat[3]}.{heat[2]}/Heat"
    for message in (b"", b"\x0a\x09\x09" + struct.pack("<d", float("nan")), b"\x0a\x05hello", b"\x0a\x02\xff\xff"):
        try:
            channel.unary_unary(path)(message, timeout=5)
            ends.add("obeyed")
        except grpc.RpcError as error:
            ends.add(error.code().name)
    channel.close()
    verdict("rubbish is refused", {"UNIMPLEMENTED", "ABORTED"} <= ends and "obeyed" not in ends, sorted(ends))


# ---- a plate of the official server, driven by a workflow


class Plate(FeatureImplementationBase):
    def __init__(self, server, trouble=None):
        super().__init__(server)
        from queue import Queue

        self._CurrentTemperature_producer_queue = Queue()
        self.HoldTemperature_default_lifetime_of_execution = None
        self.heard, self.trouble, self.temperature = [], trouble, 25.0
        self._CurrentTemperature_producer_queue.put(self.temperature)

    def SetTarget(self, Target, Mode, Quiet, *, metadata):
        self.heard.append(("SetTarget", Target, Mode, Quiet))
        if self.trouble == "fails":
            raise failed(self)
        if self.trouble == "silent":
            time.sleep(30)
        if self.trouble == "late":
            time.sleep(4)
        self.temperature = Target
        self._CurrentTemperature_producer_queue.put(self.temperature)

    def HoldTemperature(self, Time, *, metadata, instance):
        self.heard.append(("HoldTemperature", Time))
        instance.begin_execution()
        for i in range(10):
            instance.send_intermediate_response(i * 0.1)
            instance.progress = i / 10
            time.sleep(Time * 60 / 10)
            if self.trouble == "fails while it lasts":
                raise failed(self)
            if self.trouble == "cut" and i == 3:
                self.cut()
                time.sleep(60)
        return self.temperature - 0.5

    def CurrentTemperature_on_subscription(self, *, metadata):
        return None

    def Stop(self, *, metadata):
        self.heard.append(("Stop",))

    def Program(self, Steps, *, metadata):
        self.heard.append(("Program", Steps))

    def get_SerialNumber(self, *, metadata):
        return "A-17"

    def get_Power(self, *, metadata):
        return 2.5


def failed(plate):
    """The error that the feature defines."""
    node = plate.parent_server.features["HotPlate"].defined_execution_errors["SensorFailed"]
    return DefinedExecutionError(node, "the probe is broken")


class Relay:
    """A connection that can be cut."""

    def __init__(self, to):
        self.to, self.open, self.listener = to, [], socket.create_server(("127.0.0.1", 0))
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                here, _ = self.listener.accept()
            except OSError:
                return
            there = socket.create_connection(self.to)
            self.open += [here, there]
            for a, b in ((here, there), (there, here)):
                threading.Thread(target=self.pump, args=(a, b), daemon=True).start()

    def pump(self, a, b):
        try:
            while data := a.recv(4096):
                b.sendall(data)
        except OSError:
            pass

    def cut(self):
        for stream in self.open:
            try:
                stream.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass


def free():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def plate(trouble=None, feature=FEATURE):
    server = SilaServer("plate", "Plate", "a plate", "1.0", "https://example.org")
    implementation = Plate(server, trouble)
    server.set_feature_implementation(Feature(feature), implementation)
    port = free()
    server.start_insecure("127.0.0.1", port, enable_discovery=False)
    relay = Relay(("127.0.0.1", port))
    implementation.cut = relay.cut
    return server, implementation, f"127.0.0.1:{relay.listener.getsockname()[1]}"


def deploy(name, address, text=None, mode="real"):
    folder = pathlib.Path(FOLDER) / name
    folder.mkdir()
    shutil.copy(INPUTS / "hotplate.sila.xml", folder)
    (folder / "lab.mtx").write_text(text or (INPUTS / "hotplate.mtx").read_text())
    (folder / "lab.toml").write_text(f'[plate]\nsila = "{address}"\n')
    arguments = [COMMAND, "deploy", "lab.mtx", "--bind", "lab.toml", "--mode", mode]
    arguments += [] if mode == "dry" else ["--journal", "journal"]
    return subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=120)


def last(ended):
    lines = ended.stderr.strip().splitlines()
    return lines[-1] if lines else ""


def driven():
    server, one, address = plate()
    dry = deploy("dry", address, mode="dry")
    verdict("a dry run says what would be called", "SetTarget(Target: 60, Mode: fast, Quiet: true)" in dry.stdout and not one.heard, last(dry))
    ended = deploy("whole", address)
    heard = [h[:2] for h in one.heard]
    verdict("a workflow drives the official server", ended.returncode == 0, last(ended))
    wanted = [("SetTarget", 60.0), ("HoldTemperature", 0.02), ("Stop",)]
    verdict("what it heard", heard == wanted and one.heard[0][2:] == ("fast", True), one.heard)
    if ended.returncode:
        print(ended.stdout, ended.stderr)
    server.stop()
    server, one, address = plate()
    ended = deploy("own driver", address, OWN)
    verdict("a driver of one's own", ended.returncode == 0 and one.heard == [("SetTarget", 60.0, "fast", False), ("Stop",)], last(ended))
    server.stop()

    handled = (INPUTS / "hotplate.mtx").read_text().replace("} finally", '} on sensor_failed {\n    note "handled"\n} finally')
    cases = [
        ("fails", None, "sensor_failed", "lab.mtx:"),
        ("fails while it lasts", None, "sensor_failed", "lab.mtx:"),
        ("fails", handled, "handled", ""),
        ("cut", None, "error[device-lost]", "lab.mtx:"),
    ]
    for number, (trouble, text, wanted, place) in enumerate(cases):
        server, one, address = plate(trouble)
        ended = deploy(f"trouble {number}", address, text)
        good = wanted in ended.stderr and place in ended.stderr and ended.returncode == (0 if text else 1)
        safe = one.heard[-1:] == [("Stop",)] or trouble == "cut"
        verdict(f"the server {trouble}{', handled' if text else ''}", good and safe, last(ended))
        if not (good and safe):
            print(ended.stderr, one.heard)
        server.stop()

    server, one, address = plate("silent")
    ended = deploy("silent", address, OWN)
    verdict("a server that does not answer", ended.returncode == 1 and "error[device-lost]" in ended.stderr and "lab.mtx:" in ended.stderr, last(ended))
    verdict("is told to stop all the same", ("Stop",) in one.heard, one.heard)
    server.stop()

    server, one, address = plate("late")
    ended = deploy("late", address, OWN.replace('    safe sends "Stop"\n', ""))
    verdict("a server that answers late", ended.returncode == 1 and "error[device-lost]" in ended.stderr, last(ended))
    verdict("is told what stands in `finally`", one.heard[-1:] == [("Stop",)], one.heard)
    server.stop()

    server, one, address = plate("fails while it lasts")
    text = (INPUTS / "hotplate.mtx").read_text().replace("\n} finally {\n    stop plate\n}", "\n}")
    text = text.replace('"hotplate.sila.xml"\n', '"hotplate.sila.xml" {\n    param safe_call: Text\n}\n')
    text = text.replace("asset Plate: HotPlate {\n", 'asset Plate: HotPlate {\n    safe_call: "Stop"\n')
    ended = deploy("safe", address, text)
    verdict("an imported asset says what is safe", ended.returncode == 1 and one.heard[-1:] == [("Stop",)], f"{last(ended)} {one.heard}")
    server.stop()

    server = SilaServer("plate", "Plate", "a plate", "1.0", "https://example.org")
    server.set_feature_implementation(Feature(FEATURE), Plate(server))
    port = free()
    try:
        made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=SiLA2", "-keyout", "key", "-out", "chain"]
        subprocess.run(made, cwd=FOLDER, check=True, capture_output=True)
        key, chain = [(pathlib.Path(FOLDER) / name).read_bytes() for name in ("key", "chain")]
        server.start("127.0.0.1", port, key, chain, enable_discovery=False)
    except Exception as why:  # noqa: BLE001
        print(f"skipped: an encrypted server: {why}")
    else:
        ended = deploy("encrypted", f"127.0.0.1:{port}", OWN)
        verdict("an encrypted server is named as such", ended.returncode != 0 and "encrypted" in ended.stderr, " ".join(ended.stderr.split())[-160:])
        server.stop()

    server, one, address = plate(feature=FEATURE)
    other = (INPUTS / "hotplate.mtx").read_text()
    folder = pathlib.Path(FOLDER) / "other feature"
    folder.mkdir()
    (folder / "hotplate.sila.xml").write_text(FEATURE.replace("org.example", "org.another"))
    (folder / "lab.mtx").write_text(other)
    (folder / "lab.toml").write_text(f'[plate]\nsila = "{address}"\n')
    arguments = [COMMAND, "deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal"]
    ended = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=60)
    said = " ".join(ended.stderr.split())
    good = ended.returncode == 1 and "does not offer `org.another/heating/HotPlate/v1`" in said and not one.heard
    verdict("a server with other features", good, "" if good else said[-600:])
    server.stop()


def served_on_devices():
    """Client, served lab, official server: what is called goes through."""
    server, one, address = plate()
    folder = os.path.join(FOLDER, "on devices")
    os.makedirs(folder)
    (pathlib.Path(folder) / "lab.toml").write_text(f'[plate]\nsila = "{address}"\n')
    process, host, port = start(folder, OWN, "--insecure", "--bind", "lab.toml", "--journal", "journal")
    try:
        client = SilaClient(host, port, insecure=True)
        client.PlateHeater.Heat(T=70.0)
        verdict("a served lab on devices", one.heard == [("SetTarget", 70.0, "fast", False)], one.heard)
        # The server publishes its property a moment after the command.
        until = time.monotonic() + 5
        while (told := client.PlateWarm.Temperature.get()) != 70.0 and time.monotonic() < until:
            time.sleep(0.05)
        verdict("tells what they tell", told == 70.0, told)
        verdict("offers what they can do only", not hasattr(client, "PlateStirrer") or not hasattr(client.PlateStirrer, "Stir"))
        one.trouble = "fails"
        error = raised(lambda: client.PlateHeater.Heat(T=60.0), DefinedExecutionError)
        verdict("a refusal goes through", error is not None and error.identifier == "SensorFailed", f"{error!r:.120}")
        one.trouble = None
        client.close()
        process.send_signal(signal.SIGTERM)
        verdict("it leaves them safe", process.wait(15) == 0 and one.heard[-1] == ("Stop",), one.heard)
        journal = (pathlib.Path(folder) / "journal").read_text()
        verdict("and keeps a journal", "SetTarget" in journal and '"event":"end"' in journal)
    finally:
        process.kill()
    process, host, port = start(folder, OWN, "--insecure", "--bind", "lab.toml", "--journal", "journal2")
    try:
        client = SilaClient(host, port, insecure=True)
        one.cut()
        error = raised(lambda: client.PlateHeater.Heat(T=50.0), UndefinedExecutionError)
        verdict("a device that is lost ends it", error is not None and process.wait(20) == 1, f"{error!r:.120}")
        said = open(os.path.join(folder, "said")).read()
        verdict("with a fault, and safe", "error[device-lost]" in said and one.heard[-1] == ("Stop",), one.heard)
    finally:
        process.kill()
        server.stop()


BLOCK = """mtx 1
capability Block from sila "block.sila.xml"
asset Peltier: Block {
    control_temperature_takes: 5 s
    control_temperature_timeout: 1 min
    supposed_final_temperature: 40
    supposed_current_temperature: 40 degC
    supposed_control_temperature_current_temperature: 40
    supposed_previous_ramp_rate: 1
    supposed_target_temperature: 40 degC
    supposed_ramp_rate: 10
}
lab bench { ambient: 22 degC, block = Peltier at (0, 0, 0) m }
workflow warm in bench {
    set ramp rate block { ramp_rate: 10 K/s }
    control temperature block { target_temperature: 313.15 K }
    expect block.final_temperature in 39 .. 41
    expect block.current_temperature in 39 degC .. 41 degC
    expect block.target_temperature == 40 degC
    expect block.ramp_rate == 10
} finally { switch off block }
"""


def another_author():
    """A server by somebody else, and a client."""
    try:
        from labmcp_sila2.simulator import TEMPERATURE_CONTROLLER_FDL, SimulatedSilaServer
    except ImportError as why:
        print(f"skipped: labmcp-sila2: {why}")
        return
    server = SimulatedSilaServer().start()
    folder = pathlib.Path(FOLDER) / "block"
    folder.mkdir()
    (folder / "block.sila.xml").write_text(TEMPERATURE_CONTROLLER_FDL)
    (folder / "lab.mtx").write_text(BLOCK)
    (folder / "lab.toml").write_text(f'[block]\nsila = "127.0.0.1:{server.port}"\n')
    arguments = [COMMAND, "deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal"]
    ended = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=120)
    verdict("a workflow on labmcp-sila2", ended.returncode == 0, last(ended))
    if ended.returncode:
        print(ended.stderr)
    server.stop()
    process, host, port = start(os.path.join(FOLDER, "bridge"), OWN)
    bridge = [os.path.join(os.path.dirname(sys.executable), "labmcp-sila2"), "-a", f"{host}:{port}"]
    seen = subprocess.run([*bridge, "--option", "insecure=true", "--check"], capture_output=True, text=True, timeout=60)
    verdict("labmcp-sila2 on a served lab", seen.returncode == 0 and "bench" in seen.stdout, " ".join(seen.stdout.split())[:120])
    process.kill()


def main():
    import sila_secure

    logging.disable(logging.CRITICAL)
    served()
    driven()
    served_on_devices()
    another_author()
    sila_secure.main(sys.modules[__name__])
    sys.exit(1 if BAD else 0)


if __name__ == "__main__":
    main()
