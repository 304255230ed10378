"""Drivers and emulators against programs of other authors.

usage: devices.py MATTERIXC FOLDER

Deployments run on the simulators of labmcp-ika, labmcp-mettler-toledo and labmcp-cavro, which know nothing of this project; and
drivers from PyPI run unchanged on its emulators. Each line printed is a figure or a verdict; the exit status is 1 where one is bad.
"""

import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import types

COMMAND, FOLDER = sys.argv[1], sys.argv[2]
SPEED = 10
BAD = []

HEAT = """mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
}
workflow warm in bench {
    stir plate at 300 rpm
    heat plate to 50 degC
    wait until plate.temperature >= 30 degC timeout 1 h
    expect plate.temperature >= 29 degC
} finally { stop heating plate; stop stirring plate }
"""

WEIGH = """mtx 1
use std::balances::PrecisionBalance
lab bench { ambient: 22 degC, scale = PrecisionBalance at (0, 0, 0) m }
workflow weigh_it in bench {
    tare scale
    wait 1 s
    expect scale.net in -0.1 g .. 0.1 g
}
"""

DOSE = (pathlib.Path(__file__).parent.parent / "deploy" / "dose.mtx").read_text()


# What the plunger is told for it, round(volume * 3000 / 5 mL).
STROKES = ["A1274", "A674", "A0"]


def verdict(what, good, said=""):
    print(f"{'ok ' if good else 'BAD'} {what}{': ' + said if said else ''}", flush=True)
    if not good:
        BAD.append(what)


def serve(simulator, end, back):
    """A simulator at a port of this machine, and what went over its line."""
    listener = socket.create_server(("127.0.0.1", 0))
    heard = []

    def connection(stream):
        rest = b""
        while data := stream.recv(1024):
            rest += data
            while end in rest:
                line, rest = rest.split(end, 1)
                reply = simulator.handle(line.decode("latin1"))
                replies = [] if reply is None else [reply] if isinstance(reply, str) else reply
                heard.append((line.decode("latin1"), replies))
                stream.sendall(b"".join(r.encode("latin1") + back for r in replies))

    def accept():
        while True:
            threading.Thread(target=connection, args=(listener.accept()[0],), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    return f"127.0.0.1:{listener.getsockname()[1]}", heard


def bench(name, text, device, address, more=""):
    """A folder with a program and bindings of its one device."""
    folder = pathlib.Path(FOLDER, name)
    folder.mkdir(parents=True)
    (folder / "lab.mtx").write_text(text)
    (folder / "lab.toml").write_text(f'[{device}]\naddress = "{address}"\n{more}')
    return folder


def deployment(speed=SPEED):
    arguments = ["--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed", str(speed)]
    return [COMMAND, "deploy", "lab.mtx", *arguments]


def deploy(name, text, device, address, more=""):
    folder = bench(name, text, device, address, more)
    return subprocess.run(deployment(), cwd=folder, capture_output=True, text=True)


def emulator(*arguments):
    process = subprocess.Popen([COMMAND, "emulate", *arguments], stdout=subprocess.PIPE, text=True)
    return process, process.stdout.readline().strip()


def deployments():
    from labmcp_cavro.simulator import CavroSimulator
    from labmcp_ika.simulator import IKASimulator
    from labmcp_mettler_toledo.simulator import MTSICSSimulator

    plate = IKASimulator(time_scale=SPEED)
    address, heard = serve(plate, b"\r\n", b"\r\n")
    ended = deploy("heat", HEAT, "plate", address)
    armed = sum(line.startswith("OUT_WD1@") for line, _ in heard)
    verdict("heat and stir on labmcp-ika", ended.returncode == 0, ended.stderr.strip().splitlines()[-1])
    verdict("its watchdog", armed > 0 and plate.wd_mode is None and not plate.heating, f"armed {armed} times, off at the end")

    address, heard = serve(MTSICSSimulator(), b"\r\n", b"\r\n")
    ended = deploy("weigh", WEIGH, "scale", address)
    verdict("weigh and tare on labmcp-mettler-toledo", ended.returncode == 0, ended.stderr.strip().splitlines()[-1])
    address, heard = serve(MTSICSSimulator(load_g=500.0), b"\r\n", b"\r\n")
    ended = deploy("overload", WEIGH, "scale", address)
    verdict("an overload", ended.returncode == 1 and "overload" in ended.stderr, "refused")

    pump = CavroSimulator(standard_steps=3000, valve_ports=9, speed=SPEED)
    address, heard = serve(pump, b"\r", b"\x03\r\n")
    ended = deploy("dose", DOSE, "pump", address, 'driver = "CavroDt"\n')
    verdict("transfers on labmcp-cavro", ended.returncode == 0, ended.stderr.strip().splitlines()[-1])
    told = [int(m[1]) for line, replies in heard if line.endswith("?") for m in [re.match(r"/0.(\d+)", replies[0])]]
    wanted = [round(v * 3000 / 5) for v in (2.123, 1.123, 0)]
    verdict("the plunger", told == wanted, f"{told}, round(volume * 3000 / 5 mL) is {wanted}")


def stopped():
    """A person stops a run: what is left on, by the simulators' own account."""
    from labmcp_cavro.simulator import CavroSimulator
    from labmcp_ika.simulator import IKASimulator

    plate = IKASimulator(time_scale=SPEED)
    address, heard = serve(plate, b"\r\n", b"\r\n")
    forever = HEAT.replace(">= 30 degC", ">= 49.9 degC")
    said = interrupted("stop_heat", forever, "plate", address, lambda: any(l == "START_1" for l, _ in heard))
    good = said.returncode == 1 and not plate.heating and not plate.motor
    verdict("a stopped labmcp-ika", good, "neither heats nor stirs" if good else said.stderr[-1500:])

    pump = CavroSimulator(standard_steps=3000, valve_ports=9, speed=0.05)
    address, heard = serve(pump, b"\r", b"\x03\r\n")
    moves = lambda: any("A" in l and l.endswith("R") for l, _ in heard) and pump._busy()
    said = interrupted("stop_dose", DOSE, "pump", address, moves, 'driver = "CavroDt"\n')
    told = [l for l, _ in heard if l.startswith("/1T")]
    good = said.returncode == 1 and told and set(told) == {"/1T"} and not any(a["kind"] == "plunger" for a in pump.plan)
    verdict("a stopped labmcp-cavro", good, f"its plunger rests, {len(told)} times `T` without `R`" if good else f"{told} {said.stderr[-1500:]}")


def interrupted(name, text, device, address, when, more=""):
    """A deployment that is stopped as soon as something is so."""
    folder = bench(name, text, device, address, more)
    process = subprocess.Popen(deployment(1), cwd=folder, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 60
    while time.monotonic() < until and not when():
        time.sleep(0.02)
    process.send_signal(signal.SIGQUIT)
    said = process.communicate(timeout=60)[1]
    return subprocess.CompletedProcess([], process.returncode, "", said)


def lossy():
    """One reading in seven gets lost or garbled on the way: it is asked for again, commands are not."""
    from labmcp_ika.simulator import IKASimulator

    plate, count = IKASimulator(time_scale=SPEED), 0
    whole = plate.handle

    def handle(line):
        nonlocal count
        count += line.startswith("IN_")
        reply = whole(line)
        if line.startswith("IN_PV") and count % 7 == 0:
            return None if count % 2 else "2x?"
        return reply

    plate.handle = handle
    address, heard = serve(plate, b"\r\n", b"\r\n")
    ended = deploy("lossy", HEAT, "plate", address)
    again = (pathlib.Path(FOLDER) / "lossy" / "journal").read_text().count('"event":"again"')
    starts = [l for l, _ in heard if l.startswith("START")]
    good = ended.returncode == 0 and again > 0 and len(starts) == 2
    verdict("a line that loses readings", good, f"{again} of {count} were asked for again" if good else ended.stderr[-1500:])


def killed():
    """Deployments that are killed at many moments and gone on with: no stroke twice, nothing left on that is not named."""
    from labmcp_cavro.simulator import CavroSimulator
    from labmcp_ika.simulator import IKASimulator

    chance, kills = random.Random(19), int(os.environ.get("MATTERIX_KILLS", "100")) // 2
    outcomes, bad = {"went on": 0, "refused": 0, "over": 0}, []
    for n in range(kills):
        pump = CavroSimulator(standard_steps=3000, valve_ports=9, speed=SPEED)
        address, heard = serve(pump, b"\r", b"\x03\r\n")
        end = gone_on_with(f"kill_dose_{n}", DOSE, "pump", address, chance.uniform(0, 1.0), 'driver = "CavroDt"\n')
        outcomes[end.kind] += 1
        strokes = [m for line, _ in heard for m in re.findall(r"A\d+", line) if line.endswith("R")]
        rests = not any(a["kind"] == "plunger" for a in pump.plan)
        whole = strokes == STROKES if end.code == 0 else strokes == STROKES[: len(strokes)] and rests
        if not whole:
            bad.append(f"{n}: {strokes} {end.said[-800:]}")
    verdict(f"labmcp-cavro, killed at {kills} moments", not bad, "\n".join(bad) or f"no stroke twice; {outcomes}")

    outcomes, bad = {"went on": 0, "refused": 0, "over": 0}, []
    for n in range(kills):
        plate = IKASimulator(time_scale=SPEED)
        address, heard = serve(plate, b"\r\n", b"\r\n")
        end = gone_on_with(f"kill_heat_{n}", HEAT, "plate", address, chance.uniform(0, 4.5))
        outcomes[end.kind] += 1
        if plate.heating or plate.motor or (end.code != 0 and end.kind != "refused"):
            bad.append(f"{n}: {plate.heating} {plate.motor} {end.said[-800:]}")
    verdict(f"labmcp-ika, killed at {kills} moments", not bad, "\n".join(bad) or f"it neither heats nor stirs; {outcomes}")


def gone_on_with(name, text, device, address, after, more=""):
    """What became of a deployment that was killed so many s after its journal was begun, and gone on with."""
    folder, command = bench(name, text, device, address, more), deployment()
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while not (folder / "journal").exists() and process.poll() is None:
        time.sleep(0.002)
    time.sleep(after)
    process.kill()
    first = process.communicate()[1]
    if process.returncode == 0:
        return types.SimpleNamespace(kind="over", code=0, said=first)
    ended = subprocess.run([*command, "--resume"], cwd=folder, capture_output=True, text=True)
    is_refused = ended.returncode == 1 and "journal-mismatch" in ended.stderr
    return types.SimpleNamespace(kind="refused" if is_refused else "went on", code=ended.returncode, said=ended.stderr)


def drivers():
    from matterlab_hotplates import IKAHotplate
    from matterlab_pumps import TecanXCPump
    from mettler_toledo_device import MettlerToledoDevice

    process, address = emulator("IkaRetControl", "--tcp", "0", "--speed", str(SPEED))
    try:
        plate = IKAHotplate(com_port=f"socket://{address}", timeout=1.0)
        before = plate.temp
        plate.temp, plate.rpm = 60, 400
        after, speed = plate.temp, plate.rpm
        plate.stand_by()
        verdict("matterlab_hotplates on an emulator", after > before and speed == 400, f"{before} to {after} degC, {speed} rpm")
    finally:
        process.kill()

    process, path = emulator("PrecisionBalance", "--pty")
    try:
        balance = MettlerToledoDevice(port=path)
        weight = balance.get_weight_stable()
        verdict("mettler_toledo_device on an emulator", abs(weight[0]) < 0.1 and weight[1] == "g", f"{weight}")
    finally:
        process.kill()

    file = os.path.join(FOLDER, "pump.mtx")
    with open(file, "w") as out:
        out.write(DOSE)
    process, path = emulator("pump", "--file", file, "--driver", "CavroDt", "--pty", "--speed", str(SPEED))
    try:
        pump = TecanXCPump(com_port=path, address=0, syringe_volume=5e-3, num_valve_port=9, fine_pos=True)
        drawn = (pump.draw(2, valve_port=1), pump.volume, pump.port)[1:]
        pushed = (pump.dispense(1, valve_port=3), pump.volume, pump.port)[1:]
        good = drawn == (2.0, 1) and pushed == (1.0, 3)
        verdict("matterlab_pumps on an emulator", good, f"{drawn[0]} mL from port 1, then {pushed[0]} mL left at port 3")
    finally:
        process.kill()


deployments()
stopped()
lossy()
killed()
drivers()
sys.exit(1 if BAD else 0)
