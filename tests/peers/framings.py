"""Framings and Modbus as texts declare them, against programs of other authors.

usage: framings.py MATTERIXC FOLDER

Deployments of `examples/devices` run on a simulator of lewis and on a server of pymodbus, which know nothing of this project; and
drivers from PyPI (huber, nesp-lib) and pymodbus's client run unchanged on its emulators. Each line printed is a figure or a verdict; the exit
status is 1 where one is bad.
"""

import asyncio
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time

COMMAND, FOLDER = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
EXAMPLES = pathlib.Path(__file__).parent.parent.parent / "examples" / "devices"
SPEED = 10
BAD = []


def verdict(what, good, said=""):
    print(f"{'ok ' if good else 'BAD'} {what}{': ' + said if said else ''}", flush=True)
    if not good:
        BAD.append(what)


def free():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def listens(port, within=20):
    for _ in range(within * 10):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return True
        time.sleep(0.1)
    return False


def deploy(name, device, bindings, speed=1, text=None):
    folder = os.path.join(FOLDER, f"{name}-{device}-{len(os.listdir(FOLDER))}")
    os.makedirs(folder)
    lab = pathlib.Path(folder, "lab.mtx")
    lab.write_text(text or (EXAMPLES / f"{name}.mtx").read_text())
    pathlib.Path(folder, "lab.toml").write_text(f"[{device}]\n{bindings}\n")
    arguments = ["--bind", "lab.toml", "--mode", "real", "--yes", "--journal", "journal", "--speed", str(speed)]
    ended = subprocess.run(
        [COMMAND, "deploy", "lab.mtx", *arguments], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    return ended, (ended.stderr.strip().splitlines() or ["nothing was said"])[-1]


class Emulated:
    def __init__(self, name, device, *arguments, speed=SPEED):
        file = str(EXAMPLES / f"{name}.mtx")
        where = arguments if "--pty" in arguments else [*arguments, "--tcp", "0"]
        args = [COMMAND, "emulate", device, "--file", file, "--speed", str(speed), *where]
        self.process = subprocess.Popen(args, stdout=subprocess.PIPE, text=True)
        self.place = self.process.stdout.readline().strip()

    def __enter__(self):
        return self.place

    def __exit__(self, *_):
        self.process.kill()


def julabo():
    """lewis heats its bath by some 0.2 degC a second, from 24 degC on."""
    port = free()
    line = f"julabo-version-1: {{bind_address: 127.0.0.1, port: {port}}}"
    lewis = shutil.which("lewis") or os.path.join(os.path.dirname(sys.executable), "lewis")
    simulator = subprocess.Popen([lewis, "julabo", "-p", line], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        verdict("lewis listens", listens(port))
        ended, said = deploy("julabo", "bath", f'address = "127.0.0.1:{port}"')
        verdict("heats the bath of lewis to 26 degC", ended.returncode == 0, said)
        with socket.create_connection(("127.0.0.1", port)) as line:
            line.sendall(b"IN_SP_00\rIN_MODE_05\r")
            time.sleep(0.5)
            answer = line.recv(100).decode().split()
        verdict("what is left there", answer == ["30.0", "0"], f"set point and circulation {answer}")
    finally:
        simulator.kill()


class Registers:
    """A server of pymodbus with the registers of the controller, and a block that is warm where it is switched on."""

    def __init__(self, order):
        self.port, self.order, self.ready = free(), order, threading.Event()
        threading.Thread(target=lambda: asyncio.run(self.serve()), daemon=True).start()
        self.ready.wait(20)

    async def serve(self):
        from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
        from pymodbus.framer import FramerType
        from pymodbus.server import ModbusTcpServer

        self.block = ModbusSequentialDataBlock(0, [0] * 3000)
        context = ModbusServerContext(devices={1: ModbusDeviceContext(hr=self.block)}, single=False)
        framer = FramerType.SOCKET if self.order == "big" else FramerType.RTU
        server = ModbusTcpServer(context, framer=framer, address=("127.0.0.1", self.port))
        self.put(360, 22.0)
        asyncio.get_running_loop().create_task(self.warm())
        self.ready.set()
        await server.serve_forever()

    def words(self, at, count):
        # A block of pymodbus begins with the register 0 at its address 1.
        return self.block.getValues(at + 1, count)

    def put(self, at, value):
        high, low = struct.unpack(">HH", struct.pack(">f", value))
        self.block.setValues(at + 1, [high, low] if self.order == "big" else [low, high])

    def get(self, at):
        words = self.words(at, 2)
        return struct.unpack(">f", struct.pack(">HH", *(words if self.order == "big" else words[::-1])))[0]

    async def warm(self):
        is_on = False
        while True:
            await asyncio.sleep(0.1)
            is_on = self.words(1880, 1) == [10]
            if is_on:
                self.put(360, min(self.get(360) + 0.5, self.get(2160)))


def modbus():
    for driver, order in (("EzZoneTcp", "big"), ("EzZoneRtu", "swapped")):
        server = Registers(order)
        verdict(f"pymodbus listens for {driver}", listens(server.port))
        ended, said = deploy("watlow", "block", f'address = "127.0.0.1:{server.port}"\ndriver = "{driver}"')
        verdict(f"{driver} heats on pymodbus", ended.returncode == 0, said)
        left = (server.get(2160), server.words(1880, 1), server.words(2490, 1))
        verdict("what is left there", left == (40.0, [62], [15]), f"set point, mode and unit {left}")
        text = (EXAMPLES / "watlow.mtx").read_text().replace("at 360", "at 60000")
        ended, said = deploy("watlow", "block", f'address = "127.0.0.1:{server.port}"\ndriver = "{driver}"', text=text)
        refused = "exception 2: illegal data address" in ended.stderr
        verdict("a register that is not there", ended.returncode == 1 and refused, "refused by name")


def drivers():
    with Emulated("huber", "bath", "--driver", "HuberPb") as place:
        from huber import Bath

        async def bath():
            Bath.port = int(place.rsplit(":", 1)[1])
            async with Bath("127.0.0.1", comm_timeout=2) as it:
                before = await it.get()
                await it.set_setpoint(42.25)
                await it.start()
                await asyncio.sleep(1.5)
                return before, await it.get_setpoint(), await it.get_bath_temperature(), await it._get("on")

        before, target, after, on = asyncio.run(bath())
        good = target == 42.25 and after > before["temperature"]["bath"] and on
        verdict("huber on an emulator", good, f"{before['temperature']['bath']} to {after} degC, set point {target} degC")

    for driver, order in (("EzZoneTcp", "big"), ("EzZoneRtu", "little")):
        with Emulated("watlow", "block", "--driver", driver) as place:
            from pymodbus.client import ModbusTcpClient
            from pymodbus.framer import FramerType

            framer = FramerType.SOCKET if order == "big" else FramerType.RTU
            master = ModbusTcpClient("127.0.0.1", port=int(place.rsplit(":", 1)[1]), framer=framer)
            kind = master.DATATYPE.FLOAT32

            def read(at):
                return master.convert_from_registers(master.read_holding_registers(at, count=2, device_id=1).registers, kind, order)

            before = read(360)
            master.write_registers(2160, master.convert_to_registers(55.5, kind, order), device_id=1)
            master.write_register(1880, 10, device_id=1)
            time.sleep(1.5)
            after, target = read(360), read(2160)
            mode, odd = master.read_holding_registers(1880, device_id=1).registers, master.read_coils(7, device_id=1)
            good = target == 55.5 and after > before and mode == [10] and odd.exception_code == 2
            verdict(f"pymodbus drives {driver}", good, f"{before:.1f} to {after:.1f} degC, set point {target} degC")
            master.close()

    with Emulated("new_era", "pump", "--pty", speed=1) as path:
        from nesp_lib import Port, Pump, PumpingDirection

        pump = Pump(Port(path, 19200), safe_mode_timeout_s=60)
        pump.syringe_diameter_mm = 10.5
        pump.pumping_direction = PumpingDirection.INFUSE
        pump.pumping_volume_ml, pump.pumping_rate_ml_per_min = 0.05, 3.0
        begun = time.monotonic()
        pump.run()
        took, given = time.monotonic() - begun, pump.volume_infused_ml
        good = pump.syringe_diameter_mm == 10.5 and abs(given - 0.05) < 0.001 and 0.8 < took < 2
        verdict("nesp-lib on an emulator in safe mode", good, f"{given} mL in {took:.1f} s, model {pump.model_number}")


for part in (julabo, modbus, drivers):
    part()
sys.exit(1 if BAD else 0)
