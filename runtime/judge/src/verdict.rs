//! What came out.

use serde::Serialize;

/// All that was looked at, and what is wrong.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Verdict {
    /// By robot.
    pub looked: Vec<Looked>,
    /// In the order of time.
    pub wrong: Vec<Wrong>,
}

/// What was looked at of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Looked {
    /// Its name.
    pub robot: String,
    /// Configurations between which bodies were compared.
    pub configurations: usize,
    /// Time in which it moved, s.
    pub moving: f64,
    /// Way of its tip, m.
    pub way: f64,
    /// Greatest speed of a joint as a share of its limit.
    pub speed: f64,
    /// Greatest acceleration of a joint as a share of its limit, where one is known.
    pub acceleration: Option<f64>,
    /// Greatest jerk of a joint between two samples as a share of its limit, where one is known.
    pub jerk: Option<f64>,
    /// How far recorded links are from where the joints put them, m.
    pub astray: f64,
    /// How often it gripped something.
    pub grips: usize,
    /// How far its tip was at most from the frame that it gripped at, m.
    pub off: f64,
}

/// Something wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "wrong", rename_all = "snake_case")]
pub enum Wrong {
    /// Two bodies in one place.
    Meets {
        /// A link, or a thing that is carried.
        mine: String,
        /// The other body.
        other: String,
        /// How deep at most, m.
        depth: f64,
        /// Where that is, in the lab, m.
        at: [f64; 3],
        /// When that is, s.
        time: f64,
    },
    /// A joint beyond what it can do.
    Beyond {
        /// The joint.
        joint: String,
        /// `position`, `speed`, `acceleration` or `jerk`.
        what: &'static str,
        /// What it does; rad or m, and their changes in s.
        value: f64,
        /// What it can do.
        limit: f64,
        /// When, s.
        time: f64,
    },
    /// Positions that recorded speeds do not lead to.
    Jumps {
        /// The joint.
        joint: String,
        /// By how much, rad or m.
        by: f64,
        /// When, s.
        time: f64,
    },
    /// A link that is not where the joints put it.
    Astray {
        /// The link.
        link: String,
        /// How far it is away, m.
        by: f64,
        /// When, s.
        time: f64,
    },
    /// A thing gripped away from all of its frames.
    Off {
        /// The thing.
        item: String,
        /// How far the tip is from the nearest, m.
        by: f64,
        /// When, s.
        time: f64,
    },
    /// What is in a vessel in hand runs over its rim.
    Spills {
        /// The vessel.
        item: String,
        /// How much is above the rim at most, m3.
        volume: f64,
        /// How far the level is from straight across the vessel then, rad.
        tilt: f64,
        /// When, s.
        time: f64,
    },
    /// A thing is moved faster than the grip on it bears.
    Slips {
        /// The thing.
        item: String,
        /// The greatest acceleration, of gravity and of the motion, m/s2.
        pull: f64,
        /// What the grip bears, m/s2.
        borne: f64,
        /// When, s.
        time: f64,
    },
    /// A thing let go where nothing is below it.
    Dropped {
        /// The thing.
        item: String,
        /// When, s.
        time: f64,
    },
}

impl Wrong {
    /// When it is, or is worst; s since the run began.
    pub fn time(&self) -> f64 {
        match self {
            Wrong::Meets { time, .. }
            | Wrong::Beyond { time, .. }
            | Wrong::Jumps { time, .. }
            | Wrong::Astray { time, .. }
            | Wrong::Off { time, .. }
            | Wrong::Spills { time, .. }
            | Wrong::Slips { time, .. }
            | Wrong::Dropped { time, .. } => *time,
        }
    }

    /// In words.
    pub fn text(&self) -> String {
        let mm = |v: f64| format!("{:.1} mm", v * 1e3);
        match self {
            Wrong::Meets { mine, other, depth, at, .. } => {
                let [x, y, z] = at.map(|v| v * 1e3);
                format!("`{mine}` is {} inside `{other}` at ({x:.0}, {y:.0}, {z:.0}) mm", mm(*depth))
            }
            Wrong::Beyond { joint, what, value, limit, .. } => {
                format!("{what} of `{joint}` is {value:.4}, above its limit {limit:.4}")
            }
            Wrong::Jumps { joint, by, .. } => {
                format!("`{joint}` is {by:.4} away from the position that its speed gives")
            }
            Wrong::Astray { link, by, .. } => {
                format!("`{link}` is {} away from the position that the joints give", mm(*by))
            }
            Wrong::Off { item, by, .. } => format!("`{item}` is gripped {} away from its nearest frame", mm(*by)),
            Wrong::Spills { item, volume, tilt, .. } => {
                let (volume, tilt) = (volume * 1e6, tilt.to_degrees());
                format!("{volume:.1} mL spill over the rim of `{item}`, tilted {tilt:.0} deg against its contents")
            }
            Wrong::Slips { item, pull, borne, .. } => {
                format!(
                    "`{item}` is pulled with {pull:.1} m/s2 including gravity, but its grip holds only {borne:.1} m/s2"
                )
            }
            Wrong::Dropped { item, .. } => format!("`{item}` is released with nothing below it"),
        }
    }
}
