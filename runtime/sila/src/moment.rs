//! Days and times of day, with the place's distance from universal time: `2026-11-23+01:00`, `14:30:00.250Z`,
//! `2026-11-23T14:30:00-05:00`.

use chrono::{DateTime, Datelike, FixedOffset, NaiveDate, NaiveTime, Offset, Timelike};
use prost::Message;

/// Hours and minutes by which a place is ahead of universal time.
#[derive(Clone, Copy, PartialEq, Eq, Message)]
struct Zone {
    #[prost(int32, tag = "1")]
    hours: i32,
    #[prost(uint32, tag = "2")]
    minutes: u32,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct DateMessage {
    #[prost(uint32, tag = "1")]
    day: u32,
    #[prost(uint32, tag = "2")]
    month: u32,
    #[prost(uint32, tag = "3")]
    year: u32,
    #[prost(message, optional, tag = "4")]
    zone: Option<Zone>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct TimeMessage {
    #[prost(uint32, tag = "1")]
    second: u32,
    #[prost(uint32, tag = "2")]
    minute: u32,
    #[prost(uint32, tag = "3")]
    hour: u32,
    #[prost(message, optional, tag = "4")]
    zone: Option<Zone>,
    #[prost(uint32, tag = "5")]
    millisecond: u32,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct StampMessage {
    #[prost(uint32, tag = "1")]
    second: u32,
    #[prost(uint32, tag = "2")]
    minute: u32,
    #[prost(uint32, tag = "3")]
    hour: u32,
    #[prost(uint32, tag = "4")]
    day: u32,
    #[prost(uint32, tag = "5")]
    month: u32,
    #[prost(uint32, tag = "6")]
    year: u32,
    #[prost(message, optional, tag = "7")]
    zone: Option<Zone>,
    #[prost(uint32, tag = "8")]
    millisecond: u32,
}

/// A day, a time of day, or both; always with a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// A day.
    Date(NaiveDate, FixedOffset),
    /// A time of day.
    Time(NaiveTime, FixedOffset),
    /// Both.
    Stamp(DateTime<FixedOffset>),
}

/// Which of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    Date,
    Time,
    Stamp,
}

impl std::fmt::Display for Moment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Moment::Date(date, zone) => write!(f, "{date}{zone}"),
            Moment::Time(time, zone) => write!(f, "{}{zone}", time.format("%H:%M:%S%.f")),
            Moment::Stamp(stamp) => write!(f, "{}", stamp.format("%Y-%m-%dT%H:%M:%S%.f%:z")),
        }
    }
}

/// A moment as it is written; why it is none.
pub(crate) fn written(which: Which, text: &str) -> Result<Moment, String> {
    let form = match which {
        Which::Date => "not a date as in `2026-11-23+01:00`",
        Which::Time => "not a time of day as in `14:30:00+01:00`",
        Which::Stamp => "not a date with a time as in `2026-11-23T14:30:00+01:00`",
    };
    let read = || {
        let stamp = match which {
            // Both halves are read by the rules of the whole.
            Which::Date => {
                let (date, zone) = text.split_at_checked(10)?;
                format!("{date}T00:00:00{zone}")
            }
            Which::Time => format!("2000-01-01T{text}"),
            Which::Stamp => text.to_owned(),
        };
        let stamp = DateTime::parse_from_rfc3339(&stamp).ok()?;
        // The standard counts no finer, and knows no seconds that are put in, nor years before the first.
        let zone = stamp.offset().fix();
        let is_zone = offset(self::zone(zone)) == Some(zone);
        if stamp.nanosecond() % 1_000_000 != 0 || stamp.nanosecond() >= 1_000_000_000 || stamp.year() < 1 || !is_zone {
            return None;
        }
        Some(match which {
            Which::Date => Moment::Date(stamp.date_naive(), zone),
            Which::Time => Moment::Time(stamp.time(), zone),
            Which::Stamp => Moment::Stamp(stamp),
        })
    };
    read().ok_or_else(|| format!("`{text}` is {form}"))
}

/// A zone as a message. Behind universal time both numbers go back: -3:30 is three hours and 30 minutes behind.
fn zone(of: FixedOffset) -> Option<Zone> {
    let minutes = of.local_minus_utc() / 60;
    let hours = minutes.div_euclid(60);
    Some(Zone { hours, minutes: minutes.rem_euclid(60).unsigned_abs() })
}

fn offset(of: Option<Zone>) -> Option<FixedOffset> {
    let Zone { hours, minutes } = of?;
    let ahead = hours.checked_mul(60)?.checked_add(i32::try_from(minutes).ok()?)?;
    // The standard knows places up to 14 hours away.
    let is_zone = minutes < 60 && ahead.abs() <= 14 * 60;
    FixedOffset::east_opt(ahead.checked_mul(60)?).filter(|_| is_zone)
}

/// The moment as a message.
pub(crate) fn encoded(moment: &Moment) -> Vec<u8> {
    let time = match moment {
        Moment::Time(time, _) => *time,
        Moment::Stamp(stamp) => stamp.time(),
        Moment::Date(..) => NaiveTime::MIN,
    };
    let (second, minute, hour) = (time.second(), time.minute(), time.hour());
    match moment {
        Moment::Date(date, of) => {
            DateMessage { day: date.day(), month: date.month(), year: date.year().unsigned_abs(), zone: zone(*of) }
                .encode_to_vec()
        }
        Moment::Time(time, of) => {
            TimeMessage { second, minute, hour, zone: zone(*of), millisecond: time.nanosecond() / 1_000_000 }
                .encode_to_vec()
        }
        Moment::Stamp(stamp) => StampMessage {
            second,
            minute,
            hour,
            day: stamp.day(),
            month: stamp.month(),
            year: stamp.year().unsigned_abs(),
            zone: zone(*stamp.offset()),
            millisecond: stamp.nanosecond() / 1_000_000,
        }
        .encode_to_vec(),
    }
}

/// The moment of a message; why it is none.
pub(crate) fn decoded(which: Which, bytes: &[u8]) -> Result<Moment, String> {
    let none = || "it is not a date or time".to_owned();
    let day = |year: u32, month, day| NaiveDate::from_ymd_opt(i32::try_from(year).ok()?, month, day);
    match which {
        Which::Date => {
            let m = DateMessage::decode(bytes).map_err(|e| e.to_string())?;
            let date = day(m.year, m.month, m.day).zip(offset(m.zone)).ok_or_else(none)?;
            Ok(Moment::Date(date.0, date.1))
        }
        Which::Time => {
            let m = TimeMessage::decode(bytes).map_err(|e| e.to_string())?;
            let time = NaiveTime::from_hms_milli_opt(m.hour, m.minute, m.second, m.millisecond);
            let time = time.zip(offset(m.zone)).ok_or_else(none)?;
            Ok(Moment::Time(time.0, time.1))
        }
        Which::Stamp => {
            let m = StampMessage::decode(bytes).map_err(|e| e.to_string())?;
            let time = NaiveTime::from_hms_milli_opt(m.hour, m.minute, m.second, m.millisecond);
            let both = day(m.year, m.month, m.day).zip(time).zip(offset(m.zone));
            let local = both.and_then(|((date, time), zone)| date.and_time(time).and_local_timezone(zone).single());
            local.map(Moment::Stamp).ok_or_else(none)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Which, decoded, encoded, written};

    #[test]
    fn moments_go_over_the_wire_and_come_back_as_they_were_written() {
        for (which, text) in [
            (Which::Date, "2026-11-23+01:00"),
            (Which::Date, "0001-01-01+00:00"),
            (Which::Time, "14:30:00+05:45"),
            (Which::Time, "23:59:59.250-03:30"),
            (Which::Stamp, "2028-02-29T00:00:00+00:00"),
            (Which::Stamp, "2026-11-23T14:30:07.001-05:00"),
        ] {
            let moment = written(which, text).expect(text);
            assert_eq!(moment.to_string(), text);
            assert_eq!(decoded(which, &encoded(&moment)), Ok(moment), "{text}");
        }
        assert_eq!(written(Which::Time, "14:30:00Z").map(|m| m.to_string()), Ok("14:30:00+00:00".to_owned()));
    }

    #[test]
    fn a_zone_behind_universal_time_has_hours_below_its_minutes() {
        let moment = written(Which::Date, "2026-11-23-03:30").expect("it is one");
        // -4 h and 30 min: minutes count forwards.
        assert!(
            super::DateMessage::decode(encoded(&moment).as_slice())
                .is_ok_and(|m| { m.zone.is_some_and(|z| z.hours == -4 && z.minutes == 30) })
        );
    }

    use prost::Message;

    #[test]
    fn what_is_no_moment_is_refused() {
        for (which, text) in [
            (Which::Date, "2026-02-29+01:00"),
            (Which::Date, "2026-11-23"),
            (Which::Date, "23.11.2026"),
            (Which::Date, "é"),
            (Which::Time, "25:00:00Z"),
            (Which::Time, "14:30:00.0001Z"),
            (Which::Time, "23:59:60Z"),
            (Which::Stamp, "2026-11-23 14:30"),
            (Which::Stamp, ""),
        ] {
            assert!(written(which, text).is_err(), "{text}");
        }
        assert!(decoded(Which::Date, &[8, 31, 16, 2, 24, 234, 15]).is_err());
        assert!(decoded(Which::Time, b"\xff").is_err());
    }
}
