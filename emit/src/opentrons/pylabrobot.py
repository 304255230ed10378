"""A workflow as a program for PyLabRobot 0.2.

    pip install pylabrobot
    python FILE                # PyLabRobot prints what it would do
    python FILE ADDRESS        # the OT-2 at this address does it (pip install "pylabrobot[opentrons]")
"""

import asyncio
import sys

from pylabrobot.liquid_handling import LiquidHandler
from pylabrobot.liquid_handling.backends import LiquidHandlerChatterboxBackend, OpentronsOT2Backend
from pylabrobot.resources import Coordinate, CrossSectionType, Plate, Tip, TipRack, TipSpot, Well
from pylabrobot.resources.opentrons import OTDeck

# Air that follows the last of the liquid, uL: PyLabRobot asks for a volume. On an OT-2 it blows out none.
BLOW_OUT = 5

# How high channels travel, mm.
TRAVEL = 120


def places(size, wells, make):
    """Places of labware by name; x, y and z are the middle of a bottom, from the front left corner."""
    out = {}
    for name, x, y, z, across, depth, volume in wells:
        wide, long = across[0], across[-1]
        out[name] = make(name, wide, long, depth, volume, across)
        out[name].location = Coordinate(x - wide / 2, y - long / 2, z)
    return out


def make_plate(name, size, wells):
    """Anything with places for liquids."""

    def well(place, wide, long, depth, volume, across):
        round_ = CrossSectionType.CIRCLE if len(across) == 1 else CrossSectionType.RECTANGLE
        return Well(
            place,
            size_x=wide,
            size_y=long,
            size_z=depth,
            max_volume=volume,
            material_z_thickness=0,
            cross_section_type=round_,
        )

    return Plate(name, *size, ordered_items=places(size, wells, well))


def make_tip_rack(name, size, length, overlap, has_filter, wells):
    """A rack of tips, full."""

    def spot(place, wide, long, depth, volume, across):
        def tip(name):
            return Tip(has_filter=has_filter, total_tip_length=length, maximal_volume=volume, fitting_depth=overlap, name=name)

        return TipSpot(place, size_x=wide, size_y=long, make_tip=tip)

    rack = TipRack(name, *size, ordered_items=places(size, wells, spot))
    rack.fill()
    return rack


def at(labware, *names):
    """These places of labware."""
    return [labware.get_item(name) for name in names]


async def aspirate(lh, wells, channels, volume, height, x=0, y=0, rate=None):
    """Each channel takes up a volume, uL, at a height above the bottom, mm, at a rate, uL/s."""
    await lh.aspirate(wells, **stroke(wells, channels, volume, height, x, y, rate))


async def dispense(lh, wells, channels, volume, height, x=0, y=0, rate=None, blow_out=None):
    """Each channel gives off a volume; `blow_out` is air that follows, uL."""
    n = len(channels)
    await lh.dispense(wells, **stroke(wells, channels, volume, height, x, y, rate), blow_out_air_volume=[blow_out] * n)


def stroke(wells, channels, volume, height, x, y, rate):
    n = len(channels)
    height = wells[0].get_size_z() if height is None else height
    return {
        "vols": [float(volume)] * n,
        "use_channels": channels,
        "flow_rates": [rate] * n,
        "liquid_height": [height] * n,
        "offsets": [Coordinate(x, y, 0)] * n,
    }


async def move(lh, channel, place, height, x=0, y=0):
    """A channel goes to a height above the bottom of a place; without one to its rim."""
    await move_to(lh, channel, bottom(lh, place) + Coordinate(x, y, place.get_size_z() if height is None else height))


def bottom(lh, place):
    """The lowest point of the inside of a place, in its middle."""
    return place.get_location_wrt(lh.deck, "c", "c", "b" if isinstance(place, TipSpot) else "cavity_bottom")


async def move_to(lh, channel, there, straight=False):
    """A channel goes to a place of the deck."""
    if isinstance(lh.backend, LiquidHandlerChatterboxBackend):
        return print(f"Moving channel {channel} to {there}.")
    if not straight:
        await lh.prepare_for_manual_channel_operation(channel)
        await lh.move_channel_z(channel, TRAVEL)
    await lh.move_channel_x(channel, there.x)
    await lh.move_channel_y(channel, there.y)
    await lh.move_channel_z(channel, there.z)


async def touch(lh, channel, place, height, radius=1):
    """A channel touches the wall of a place on four sides."""
    middle = bottom(lh, place) + Coordinate(0, 0, height)
    wide, long = radius * place.get_size_x() / 2, radius * place.get_size_y() / 2
    await move_to(lh, channel, middle)
    for x, y in ((wide, 0), (-wide, 0), (0, long), (0, -long), (0, 0)):
        await move_to(lh, channel, middle + Coordinate(x, y, 0), straight=True)


async def home(lh):
    """The robot goes home, if it is one."""
    if isinstance(lh.backend, OpentronsOT2Backend):
        await lh.backend.home()
    else:
        print("Going home.")


async def wait(lh, seconds):
    """Time passes, if there is a robot."""
    print(f"Waiting for {seconds} s.")
    if not isinstance(lh.backend, LiquidHandlerChatterboxBackend):
        await asyncio.sleep(seconds)


def ask(text):
    """Waits for a person, if one is there."""
    print(text)
    if sys.stdin.isatty():
        input("Press Enter to go on. ")


async def main():
    """Runs the workflow on the robot whose address is given, or prints what it would do."""
    backend = OpentronsOT2Backend(host=sys.argv[1]) if sys.argv[1:] else LiquidHandlerChatterboxBackend(CHANNELS)
    deck = OTDeck()
    lh = LiquidHandler(backend=backend, deck=deck)
    await lh.setup()
    try:
        print(WORKFLOW)
        await run(lh, deck)
    finally:
        await lh.stop()
