//! Commands of Opentrons' run engine and their fields, as far as drivers may use them: command schema 8 of the package
//! opentrons-shared-data 8.8.2.

/// What a command is about; its identifier is put in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum About {
    /// The robot itself, which has no identifier.
    Robot,
    /// The pipette that gets the command.
    Pipette,
    /// The plate, rack or reservoir.
    Labware,
    /// The module.
    Module,
    /// The bin, or the chute.
    Bin,
    /// A well: its labware and its name.
    Well,
}

/// What a field of a message holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    /// A word.
    Text,
    /// A number.
    Number,
    /// A number that is left out where it is 0.
    Given,
    /// A number that is left out where it is less than 0.
    FromZero,
    /// The mount whose axis and plunger go home.
    Mount,
    /// The mount whose plunger goes home.
    Plunger,
    /// The one wavelength that a photometer is set up for, nm.
    Wavelength,
    /// The wavelength that it takes off, nm; left out where it is 0.
    Reference,
    /// `true` or `false`.
    Flag,
    /// A place of loaded labware, or those of all channels.
    Well,
    /// Where in a well: `top`, `bottom`, `center`.
    Origin,
    /// How far from that along an axis, mm.
    Offset,
    /// How far from the corner of the deck along an axis, mm.
    Coordinate,
    /// What a thing stands on: a place of the deck, or a module.
    Location,
    /// The corner of the head at which the channels begin that take tips: `H1`, or `all`.
    Corner,
    /// Labware by its name in the lab.
    Labware,
    /// How far from where the gripper usually grips or lets go, along an axis, mm: `pickUpOffset/x`.
    Shift,
    /// A bin or a chute for tips.
    Bin,
    /// How many channels a pipette has, in all or in each row.
    Channels,
    /// A labware definition by `NAMESPACE/NAME/VERSION`.
    Definition,
}

/// A command.
#[derive(Debug)]
pub(super) struct Form {
    /// Its `commandType`.
    pub(super) name: &'static str,
    /// What it is about.
    pub(super) about: About,
    /// What it must say.
    pub(super) needs: &'static [(&'static str, Holds)],
    /// What it may say.
    pub(super) takes: &'static [(&'static str, Holds)],
    /// Where in a well, if it may say that.
    spot: &'static [(&'static str, Holds)],
}

impl Form {
    /// What a field holds.
    pub(super) fn field(&self, name: &str) -> Option<Holds> {
        self.needs.iter().chain(self.takes).chain(self.spot).find(|(n, _)| *n == name).map(|(_, holds)| *holds)
    }
}

/// The messages that load a bin or a chute, for which JSON has no command.
pub(super) const TRASH_BIN: &str = "loadTrashBin";
pub(super) const WASTE_CHUTE: &str = "loadWasteChute";

/// Whether a message loads a bin or a chute.
pub(super) fn loads_bin(name: &str) -> bool {
    [TRASH_BIN, WASTE_CHUTE].contains(&name)
}

/// The message that says from which corner of a head tips are taken.
pub(super) const LAY_OUT: &str = "layOut";

/// The parameter of these that holds what the bin is called.
pub(super) const BIN_ID: &str = "binId";

/// The message that the gripper is to move labware.
pub(super) const BY_GRIPPER: &str = "moveLabwareByGripper";

/// Where a pipette does something in a well.
const SPOT: &[(&str, Holds)] =
    &[("origin", Holds::Origin), ("x", Holds::Offset), ("y", Holds::Offset), ("z", Holds::Offset)];

const fn form(
    name: &'static str,
    about: About,
    needs: &'static [(&'static str, Holds)],
    takes: &'static [(&'static str, Holds)],
) -> Form {
    Form { name, about, needs, takes, spot: &[] }
}

/// A command to a pipette that may say where in the well.
const fn at(
    name: &'static str,
    needs: &'static [(&'static str, Holds)],
    takes: &'static [(&'static str, Holds)],
) -> Form {
    Form { name, about: About::Pipette, needs, takes, spot: SPOT }
}

use Holds::{Definition, Flag, Location, Number, Text, Well};

/// All of them.
const FORMS: &[Form] = &[
    form(
        "loadPipette",
        About::Pipette,
        &[("pipetteName", Text), ("mount", Text)],
        &[("channels", Holds::Channels), ("rows", Holds::Channels)],
    ),
    form("loadLabware", About::Labware, &[("definition", Definition), ("location", Location)], &[]),
    form("moveLabware", About::Labware, &[("newLocation", Location), ("strategy", Text)], &[]),
    // What the gripper does, which the run engine calls `moveLabware` too.
    form(
        BY_GRIPPER,
        About::Robot,
        &[("labware", Holds::Labware), ("newLocation", Location)],
        &[
            ("pickUpOffset/x", Holds::Shift),
            ("pickUpOffset/y", Holds::Shift),
            ("pickUpOffset/z", Holds::Shift),
            ("dropOffset/x", Holds::Shift),
            ("dropOffset/y", Holds::Shift),
            ("dropOffset/z", Holds::Shift),
        ],
    ),
    form(TRASH_BIN, About::Bin, &[("location", Location)], &[]),
    form(WASTE_CHUTE, About::Bin, &[("location", Location)], &[]),
    form("loadModule", About::Module, &[("model", Text), ("location", Location)], &[]),
    form("loadLiquid", About::Well, &[("volume", Number)], &[]),
    // The layout of nozzles is said when it is known how many tips are taken.
    form(LAY_OUT, About::Pipette, &[("corner", Holds::Corner)], &[]),
    at("pickUpTip", &[("well", Well)], &[]),
    at("aspirate", &[("well", Well), ("volume", Number), ("flowRate", Number)], &[]),
    at("dispense", &[("well", Well), ("volume", Number), ("flowRate", Number)], &[("pushOut", Holds::FromZero)]),
    at("blowout", &[("well", Well), ("flowRate", Number)], &[]),
    at("touchTip", &[("well", Well)], &[("radius", Number), ("speed", Number)]),
    at(
        "moveToWell",
        &[("well", Well)],
        &[("forceDirect", Flag), ("speed", Holds::Given), ("minimumZHeight", Holds::Given)],
    ),
    form(
        "moveToCoordinates",
        About::Pipette,
        &[("x", Holds::Coordinate), ("y", Holds::Coordinate), ("z", Holds::Coordinate)],
        &[("forceDirect", Flag), ("speed", Holds::Given), ("minimumZHeight", Holds::Given)],
    ),
    form("aspirateInPlace", About::Pipette, &[("volume", Number), ("flowRate", Number)], &[]),
    form("dropTip", About::Pipette, &[("well", Well)], &[("alternateDropLocation", Flag)]),
    form(
        "moveToAddressableAreaForDropTip",
        About::Pipette,
        &[("bin", Holds::Bin), ("channels", Holds::Channels)],
        &[("alternateDropLocation", Flag)],
    ),
    form("dropTipInPlace", About::Pipette, &[], &[]),
    form("setTipState", About::Labware, &[], &[]),
    form("home", About::Robot, &[], &[("mount", Holds::Mount), ("plunger", Holds::Plunger)]),
    form("thermocycler/openLid", About::Module, &[], &[]),
    form("thermocycler/closeLid", About::Module, &[], &[]),
    form(
        "thermocycler/setTargetBlockTemperature",
        About::Module,
        &[("celsius", Number)],
        &[("blockMaxVolumeUl", Holds::Given)],
    ),
    form("thermocycler/waitForBlockTemperature", About::Module, &[], &[]),
    form("thermocycler/deactivateBlock", About::Module, &[], &[]),
    form("thermocycler/setTargetLidTemperature", About::Module, &[("celsius", Number)], &[]),
    form("thermocycler/waitForLidTemperature", About::Module, &[], &[]),
    form("thermocycler/deactivateLid", About::Module, &[], &[]),
    form("setRailLights", About::Robot, &[("on", Flag)], &[]),
    form("temperatureModule/setTargetTemperature", About::Module, &[("celsius", Number)], &[]),
    form("temperatureModule/waitForTemperature", About::Module, &[], &[]),
    form("temperatureModule/deactivate", About::Module, &[], &[]),
    form("magneticModule/engage", About::Module, &[("height", Number)], &[]),
    form("magneticModule/disengage", About::Module, &[], &[]),
    form("absorbanceReader/openLid", About::Module, &[], &[]),
    form("absorbanceReader/closeLid", About::Module, &[], &[]),
    form(
        "absorbanceReader/initialize",
        About::Module,
        &[("sampleWavelengths", Holds::Wavelength)],
        &[("referenceWavelength", Holds::Reference)],
    ),
    form("absorbanceReader/read", About::Module, &[], &[]),
    form("heaterShaker/setTargetTemperature", About::Module, &[("celsius", Number)], &[]),
    form("heaterShaker/waitForTemperature", About::Module, &[], &[]),
    form("heaterShaker/deactivateHeater", About::Module, &[], &[]),
    form("heaterShaker/setAndWaitForShakeSpeed", About::Module, &[("rpm", Number)], &[]),
    form("heaterShaker/deactivateShaker", About::Module, &[], &[]),
    form("heaterShaker/openLabwareLatch", About::Module, &[], &[]),
    form("heaterShaker/closeLabwareLatch", About::Module, &[], &[]),
];

/// The command with this name.
pub(super) fn find(name: &str) -> Option<&'static Form> {
    FORMS.iter().find(|f| f.name == name)
}
