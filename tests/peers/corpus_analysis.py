"""Analyses of protocols by Opentrons' own software, in the form of its protocol engine.

Below API level 2.14 `opentrons analyze` runs a protocol on an older core, whose analysis lacks heights, air gaps and the steps of
modules. Here every protocol runs on the engine, whatever its level; nothing in the installed packages is changed. What the engine
does not do for old levels is patched while this runs:

- `ProtocolCore.load_module` refuses a `configuration`, which below level 2.14 a protocol may give: it is left out.
- `max_speeds` is no part of an analysis; the engine has none, so a protocol may set what nobody reads.
- `InstrumentContext.speed`, speeds of plungers, is as little part of it: read and set, it changes nothing.
- `MagneticModuleContext.calibrate` does nothing.
- The lid of a thermocycler is open at first, as the older core has it; the engine has it closed until a protocol opens it.
- `hw_pipette` says whether a pipette has a tip, and how much is in it; the engine has no hardware to ask while it analyses.
- `Well.geometry` gives the sizes of a well, which it has under other names.
- `engage(height=...)` counts from the magnets' home, in steps of the model; the engine counts from the labware's bottom in mm.

`form="plain"` leaves all of that out: an analysis as `opentrons analyze` makes it, but for the one line that its `load_module`
needs on Python 3.11 (`patch_modules`).
"""

import asyncio
import dataclasses
import importlib
import json
import os
import pathlib
import signal
import sys
import time
import traceback

VALUES = """


def get_values(*names):
    import json
    values = json.loads({!r})
    return [values[name] for name in names]
"""


def defaults(folder):
    """The values that the site offers for a protocol: the default of a field, or its first choice."""
    fields = folder / "fields.json"
    if not fields.exists():
        return {}
    values = {}
    for field in json.loads(fields.read_text()):
        options = field.get("options") or [{}]
        values[field["name"]] = field.get("default", options[0].get("value"))
    return values


def is_labware(path):
    try:
        return "loadName" in json.loads(path.read_text()).get("parameters", {})
    except (ValueError, AttributeError):
        return False


def files_of(folder, work):
    """The protocol of a folder with the values that the site puts in, and its own labware."""
    source = sorted(folder.glob("*.py"))[0]
    text = source.read_text(encoding="utf-8")
    if "get_values" in text and "def get_values" not in text:
        text += VALUES.format(json.dumps(defaults(folder)))
    protocol = work / "protocol.py"
    protocol.write_text(text, encoding="utf-8")
    return [protocol] + [path for path in sorted(folder.glob("**/*.json")) if is_labware(path)]


def patch_modules():
    """What 8.8.2 needs on Python 3.11 to load a module below API level 2.14: there a model in a text is written with its class."""
    geometry = importlib.import_module("opentrons.protocol_api.core.legacy.module_geometry")
    load = geometry.load_definition
    geometry.load_definition = lambda model: load(getattr(model, "value", model))


def engine_form():
    """Every protocol on the engine from here on."""
    from opentrons.hardware_control.modules import magdeck
    from opentrons.protocols.api_support.types import APIVersion
    from opentrons.protocols.api_support.util import AxisMaxSpeeds

    # Some packages give what they hold the names of their modules.
    api = "opentrons.protocol_api."
    instrument_context, module_contexts, context = (
        importlib.import_module(api + name) for name in ("instrument_context", "module_contexts", "create_protocol_context")
    )
    oldest = APIVersion(2, 0)
    context.ENGINE_CORE_API_VERSION = oldest
    importlib.import_module("opentrons.protocol_runner.protocol_runner").LEGACY_PYTHON_API_VERSION_CUTOFF = oldest
    core = importlib.import_module(api + "core.engine.protocol").ProtocolCore
    load_module = core.load_module
    core.load_module = lambda self, model, deck_slot, configuration: load_module(self, model, deck_slot, None)
    core.get_max_speeds = lambda self: self.__dict__.setdefault("_unread_speeds", AxisMaxSpeeds("OT-2 Standard"))

    magnets = importlib.import_module(api + "core.engine.module_core").MagneticModuleCore
    engage = magnets.engage

    def engage_from_home(self, height_from_base=None, height_from_home=None):
        if height_from_home is not None:
            model = self.get_model().value
            # The first generation counts half millimetres.
            unit = 2 if model == "magneticModuleV1" else 1
            height_from_base = (height_from_home - magdeck.OFFSET_TO_LABWARE_BOTTOM[model]) / unit
        engage(self, height_from_base=height_from_base)

    magnets.engage = engage_from_home
    module_contexts.MagneticModuleContext.calibrate = lambda self: None

    thermocyclers = importlib.import_module("opentrons.protocol_engine.state.module_substates.thermocycler_module_substate")
    from_live_data = thermocyclers.ThermocyclerModuleSubState.from_live_data.__func__

    def opened(cls, module_id, data):
        at_first = from_live_data(cls, module_id, data)
        return at_first if data is not None else dataclasses.replace(at_first, is_lid_open=True)

    thermocyclers.ThermocyclerModuleSubState.from_live_data = classmethod(opened)

    def hardware_state(self):
        pipettes, own = self._engine_client.state.pipettes, self._pipette_id
        tip = pipettes.get_attached_tip(own)
        volume = 0.0 if tip is None else pipettes.get_aspirated_volume(own)
        return {
            "name": self.get_pipette_name(),
            "channels": pipettes.get_channels(own),
            "min_volume": pipettes.get_minimum_volume(own),
            "max_volume": pipettes.get_maximum_volume(own),
            "has_tip": tip is not None,
            "current_volume": volume or 0.0,
        }

    importlib.import_module(api + "core.engine.instrument").InstrumentCore.get_hardware_state = hardware_state

    class Geometry:
        """Sizes of a well by the names that they had."""

        def __init__(self, well):
            self._depth, self._diameter, self.max_volume = well.depth, well.diameter, well.max_volume
            self._length, self._width = well.length, well.width
            self.depth, self.diameter, self.length, self.width = well.depth, well.diameter, well.length, well.width

    importlib.import_module("opentrons.protocol_api.labware").Well.geometry = property(Geometry)

    class Speeds:
        aspirate = dispense = blow_out = 0.0

    speeds = property(lambda self: self.__dict__.setdefault("_unread_speed", Speeds()))
    instrument_context.InstrumentContext.speed = speeds


async def analysed(files):
    """The analysis of a protocol, as the command line writes it."""
    from opentrons.protocol_reader import ProtocolReader

    # The package gives its command the name of its module.
    analyze = importlib.import_module("opentrons.cli.analyze")

    source = await ProtocolReader().read_saved(files=files, directory=None)
    result = await analyze._do_analyze(source, {}, {})
    summary = result.state_summary
    plain = lambda items: [json.loads(item.model_dump_json(exclude_none=True)) for item in items]
    return {
        "robotType": source.robot_type,
        "metadata": source.metadata,
        "commands": plain(result.commands),
        "labware": plain(summary.labware),
        "pipettes": plain(summary.pipettes),
        "modules": plain(summary.modules),
        "liquids": plain(summary.liquids),
        "errors": plain(summary.errors),
        "level": str(getattr(source.config, "api_version", "")),
    }


def analyse(files, out, form, limit):
    """Analyses in a process of its own, in at most so many seconds, and writes the file; "ok", or why there is none."""
    import opentrons.cli.analyze  # noqa: F401  (so that children have it)
    import opentrons.protocol_api  # noqa: F401

    log = out.with_suffix(".log")
    child = os.fork()
    if child == 0:
        status = 1
        try:
            handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(handle, 1)
            os.dup2(handle, 2)
            os.setsid()
            os.chdir(out.parent)
            patch_modules()
            if form == "engine":
                engine_form()
            analysis = asyncio.run(analysed(files))
            part = out.with_suffix(".part")
            part.write_text(json.dumps(analysis))
            part.rename(out)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    start = time.monotonic()
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() - start > limit:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return f"took more than {limit} s"
        time.sleep(0.05)
    if not out.exists():
        said = log.read_text(errors="replace").strip().splitlines() or ["it ended without a word"]
        return said[-1]
    errors = json.loads(out.read_text())["errors"]
    return "ok" if not errors else f"{errors[0]['errorType']}: {detail(errors[0])}"


def detail(error):
    """The innermost cause."""
    while error.get("wrappedErrors"):
        error = error["wrappedErrors"][0]
    return f"{error['errorType']}: {error['detail']}".splitlines()[0]
