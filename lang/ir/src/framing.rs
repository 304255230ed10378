//! Framings as texts declare them: what stands around a message on a line, and what proves it whole.

use serde::{Deserialize, Serialize};

use crate::form::Form;

/// What stands around a message on a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frames {
    /// `line`.
    pub name: String,
    /// What messages are.
    pub carries: Carries,
    /// What goes to a device.
    pub request: Vec<Part>,
    /// What comes from a device.
    pub reply: Vec<Part>,
    /// What the length counts.
    pub length: Option<Counted>,
    /// What proves a frame whole.
    pub check: Option<Check>,
    /// How long a line is quiet before something is sent, s.
    pub silence: f64,
}

/// What messages are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Carries {
    /// Printable characters of ASCII; blanks around them are of no account.
    Text,
    /// Any bytes.
    Bytes,
    /// Requests and answers of Modbus, which tell their own size.
    Modbus,
}

/// A part of a frame, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// These bytes.
    Fixed(Vec<u8>),
    /// The message.
    Data,
    /// The address of the device, as a text where it has no form.
    Address(Option<Form>),
    /// How long it is.
    Length(Form),
    /// What proves it whole.
    Check(Form),
    /// A number that an answer has from its request; the next request has the next one.
    Number(Form),
}

/// Where a stretch of a frame begins or ends: a part of each layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mark {
    /// The first byte of the frame.
    Start,
    /// The message.
    Data,
    /// The address.
    Address,
    /// The length.
    Length,
    /// The checksum.
    Check,
    /// The number.
    Number,
    /// The last byte of the frame.
    End,
}

/// A stretch of a frame, both ends with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stretch {
    /// Its first part.
    pub from: Mark,
    /// Its last part.
    pub to: Mark,
}

/// What a length counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counted {
    /// The bytes of this stretch,
    pub over: Stretch,
    /// and so many more.
    pub more: i32,
}

/// What proves a frame whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// How it is reckoned,
    pub sum: Checksum,
    /// over this stretch, itself left out.
    pub over: Stretch,
}

/// How a checksum is reckoned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Checksum {
    /// The sum of all bytes, modulo 2^bits.
    Sum(u8),
    /// Their exclusive or.
    Xor,
    /// The negative of their sum, modulo 256.
    Lrc,
    /// A cyclic redundancy check.
    Crc(Crc),
}

/// A cyclic redundancy check, by the parameters of Williams' model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crc {
    /// Bits: 8, 16 or 32.
    pub width: u8,
    /// Without its highest bit.
    pub polynomial: u32,
    /// What it begins with.
    pub initial: u32,
    /// Bytes are taken lowest bit first, and so is what comes out.
    pub reflected: bool,
    /// Exclusive or with what comes out.
    pub last: u32,
}

const fn crc(width: u8, polynomial: u32, initial: u32, reflected: bool, last: u32) -> Checksum {
    Checksum::Crc(Crc { width, polynomial, initial, reflected, last })
}

/// Checksums with names; those of cyclic checks after the catalogue of Greg Cook.
pub const CHECKSUMS: &[(&str, Checksum)] = &[
    ("sum8", Checksum::Sum(8)),
    ("sum16", Checksum::Sum(16)),
    ("xor8", Checksum::Xor),
    ("lrc8", Checksum::Lrc),
    ("crc8", crc(8, 0x07, 0, false, 0)),
    ("crc8_maxim", crc(8, 0x31, 0, true, 0)),
    ("crc16_arc", crc(16, 0x8005, 0, true, 0)),
    ("crc16_modbus", crc(16, 0x8005, 0xffff, true, 0)),
    ("crc16_xmodem", crc(16, 0x1021, 0, false, 0)),
    ("crc16_ccitt", crc(16, 0x1021, 0xffff, false, 0)),
    ("crc16_kermit", crc(16, 0x1021, 0, true, 0)),
    ("crc16_x25", crc(16, 0x1021, 0xffff, true, 0xffff)),
    ("crc32", crc(32, 0x04c1_1db7, 0xffff_ffff, true, 0xffff_ffff)),
];

impl Checksum {
    /// Its value.
    pub fn of(&self, bytes: &[u8]) -> u32 {
        let sum = || bytes.iter().fold(0_u32, |sum, b| sum.wrapping_add((*b).into()));
        match self {
            Checksum::Sum(bits) => sum() & low(*bits),
            Checksum::Xor => bytes.iter().fold(0, |sum, b| sum ^ b).into(),
            Checksum::Lrc => sum().wrapping_neg() & 0xff,
            Checksum::Crc(crc) => crc.of(bytes),
        }
    }

    /// How many bits it has.
    pub fn bits(&self) -> u8 {
        match self {
            Checksum::Sum(bits) | Checksum::Crc(Crc { width: bits, .. }) => *bits,
            Checksum::Xor | Checksum::Lrc => 8,
        }
    }
}

impl Crc {
    fn of(&self, bytes: &[u8]) -> u32 {
        let top = 1_u32 << (self.width - 1);
        let mut register = self.initial;
        for byte in bytes {
            let byte = if self.reflected { byte.reverse_bits() } else { *byte };
            register ^= u32::from(byte) << (self.width - 8);
            for _ in 0..8 {
                let carry = register & top != 0;
                register = (register << 1) ^ if carry { self.polynomial } else { 0 };
            }
        }
        register &= low(self.width);
        let out = if self.reflected { register.reverse_bits() >> (32 - self.width) } else { register };
        out ^ self.last
    }
}

fn low(bits: u8) -> u32 {
    if bits >= 32 { u32::MAX } else { (1 << bits) - 1 }
}

impl Part {
    /// Which mark it is; none of fixed bytes.
    pub fn mark(&self) -> Option<Mark> {
        Some(match self {
            Part::Fixed(_) => return None,
            Part::Data => Mark::Data,
            Part::Address(_) => Mark::Address,
            Part::Length(_) => Mark::Length,
            Part::Check(_) => Mark::Check,
            Part::Number(_) => Mark::Number,
        })
    }
}

impl Stretch {
    /// The parts of a layout that belong to it; nothing where it has not both ends, in this order.
    pub fn parts(&self, layout: &[Part]) -> Option<std::ops::RangeInclusive<usize>> {
        let at = |mark: Mark| match mark {
            Mark::Start => Some(0),
            Mark::End => layout.len().checked_sub(1),
            mark => layout.iter().position(|p| p.mark() == Some(mark)),
        };
        let (from, to) = (at(self.from)?, at(self.to)?);
        (from <= to).then_some(from..=to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check values of the catalogue, of the text 123456789.
    #[test]
    fn checksums_are_those_of_the_catalogue() {
        let known = [
            ("sum8", 0xdd),
            ("sum16", 0x1dd),
            ("xor8", 0x31),
            ("lrc8", 0x23),
            ("crc8", 0xf4),
            ("crc8_maxim", 0xa1),
            ("crc16_arc", 0xbb3d),
            ("crc16_modbus", 0x4b37),
            ("crc16_xmodem", 0x31c3),
            ("crc16_ccitt", 0x29b1),
            ("crc16_kermit", 0x2189),
            ("crc16_x25", 0x906e),
            ("crc32", 0xcbf4_3926),
        ];
        assert_eq!(known.len(), CHECKSUMS.len());
        for ((name, value), (of, sum)) in known.iter().zip(CHECKSUMS) {
            assert_eq!(name, of);
            assert_eq!(sum.of(b"123456789"), *value, "{name}");
        }
    }

    /// The packet that takes a pump of New Era out of its safe mode, as its manual prints it: 0x02 0x08 SAF0 0x55 0x43 0x03.
    #[test]
    fn a_checksum_is_that_of_a_manual() {
        let (_, sum) = CHECKSUMS.iter().find(|(name, _)| *name == "crc16_xmodem").expect("known");
        assert_eq!(sum.of(b"SAF0"), 0x5543);
    }

    #[test]
    fn a_stretch_has_both_its_ends() {
        let layout = [Part::Fixed(vec![2]), Part::Data, Part::Check(Form::default())];
        let over = |from, to| Stretch { from, to }.parts(&layout);
        assert_eq!(over(Mark::Start, Mark::Data), Some(0..=1));
        assert_eq!(over(Mark::Data, Mark::End), Some(1..=2));
        assert_eq!(over(Mark::Check, Mark::Data), None);
        assert_eq!(over(Mark::Address, Mark::Data), None);
    }
}
