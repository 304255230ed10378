//! Requests of Modbus as drivers write them: `read 2 holding registers at 100`, `write coil at 5: on`.
//!
//! After MODBUS Application Protocol Specification V1.1b3. An address is the one on the line, which begins with 0.

use std::fmt;

/// A request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// What is read or written.
    pub object: Object,
    /// How many; without it one, by the function for one where it is written.
    pub count: Option<u16>,
    /// The first.
    pub address: u16,
    /// What is written; nothing of what is read.
    pub values: Option<Values>,
}

/// What a device has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// A bit that can be written.
    Coil,
    /// A bit that can be read only.
    DiscreteInput,
    /// 16 bits that can be written.
    HoldingRegister,
    /// 16 bits that can be read only.
    InputRegister,
}

/// What stands in coils or registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Values {
    /// Of coils.
    Bits(Vec<bool>),
    /// Of registers, the higher byte of each first.
    Bytes(Vec<u8>),
}

const OBJECTS: [(Object, &str); 4] = [
    (Object::Coil, "coil"),
    (Object::DiscreteInput, "discrete input"),
    (Object::HoldingRegister, "holding register"),
    (Object::InputRegister, "input register"),
];

/// What stands before registers in hexadecimal digits.
pub const HEX: &str = "0x";

impl Object {
    /// Whether it is one bit.
    pub fn is_bit(self) -> bool {
        matches!(self, Object::Coil | Object::DiscreteInput)
    }

    /// Most of them in one request: to read, to write.
    pub fn most(self) -> (u16, u16) {
        if self.is_bit() { (2000, 1968) } else { (125, 123) }
    }

    fn name(self) -> &'static str {
        OBJECTS.iter().find(|(object, _)| *object == self).map_or("", |(_, name)| name)
    }
}

impl Values {
    /// How many coils or registers.
    pub fn count(&self) -> usize {
        match self {
            Values::Bits(bits) => bits.len(),
            Values::Bytes(bytes) => bytes.len() / 2,
        }
    }

    /// `on off on`, or `0x00010002`.
    pub fn parse(text: &str, object: Object) -> Result<Values, String> {
        if object.is_bit() {
            let bit = |word: &str| match word {
                "on" => Ok(true),
                "off" => Ok(false),
                other => Err(format!("`{other}` is neither `on` nor `off`")),
            };
            return Ok(Values::Bits(text.split_whitespace().map(bit).collect::<Result<_, _>>()?));
        }
        let digits = text.strip_prefix(HEX).filter(|d| d.len() % 4 == 0 && d.bytes().all(|b| b.is_ascii_hexdigit()));
        let digits = digits
            .ok_or_else(|| format!("`{text}` is not a value of registers: write four hexadecimal digits for each"))?;
        let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).map_err(|e| e.to_string());
        Ok(Values::Bytes((0..digits.len()).step_by(2).map(byte).collect::<Result<_, _>>()?))
    }
}

impl fmt::Display for Values {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Values::Bits(bits) => {
                let words: Vec<&str> = bits.iter().map(|b| if *b { "on" } else { "off" }).collect();
                f.write_str(&words.join(" "))
            }
            Values::Bytes(bytes) => {
                f.write_str(HEX)?;
                bytes.iter().try_for_each(|b| write!(f, "{b:02X}"))
            }
        }
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.values.is_some() { "write " } else { "read " })?;
        match self.count {
            Some(count) => write!(f, "{count} {}s", self.object.name())?,
            None => f.write_str(self.object.name())?,
        }
        write!(f, " at {}", self.address)?;
        match &self.values {
            Some(values) => write!(f, ": {values}"),
            None => Ok(()),
        }
    }
}

impl Request {
    /// A request as it is written; in words what is wrong with it.
    pub fn parse(text: &str) -> Result<Request, String> {
        let (what, values) = match text.split_once(": ") {
            Some((what, values)) => (what, Some(values)),
            None => (text, None),
        };
        let form = "write it as in `read 2 holding registers at 100` or `write coil at 5: on`";
        let (verb, rest) = what.split_once(' ').ok_or_else(|| format!("this is not a request of Modbus: {form}"))?;
        let (objects, address) = rest.split_once(" at ").ok_or_else(|| format!("the address is missing: {form}"))?;
        let address = address.parse::<u16>().map_err(|_| format!("`{address}` is not an address from 0 to 65535"))?;
        let (count, name) = match objects.split_once(' ') {
            Some((count, name)) if count.bytes().all(|b| b.is_ascii_digit()) => (Some(count), name),
            _ => (None, objects),
        };
        let named = |(_, known): &&(Object, &str)| match count {
            Some(_) => name.strip_suffix('s') == Some(*known),
            None => name == *known,
        };
        let object = OBJECTS.iter().find(named).map(|(object, _)| *object);
        let object = object.ok_or_else(|| {
            format!("`{objects}` is not an object of Modbus: use `coil`, `discrete input`, `holding register` or `input register`; with a number `2 coils`")
        })?;
        let count = count.map(|c| c.parse::<u16>().map_err(|_| format!("`{c}` is too many"))).transpose()?;
        let values = match (verb, values) {
            ("read", None) => None,
            ("read", Some(_)) => return Err("a read request takes no value".to_owned()),
            ("write", None) => return Err(format!("the values to write are missing: {form}")),
            ("write", Some(_)) if matches!(object, Object::DiscreteInput | Object::InputRegister) => {
                return Err(format!("an {} is read-only", object.name().replace("discrete ", "")));
            }
            ("write", Some(values)) => Some(Values::parse(values, object)?),
            (other, _) => return Err(format!("Modbus cannot `{other}`: {form}")),
        };
        let (reads, writes) = object.most();
        let most = if values.is_some() { writes } else { reads };
        let number = count.unwrap_or(1);
        if !(1..=most).contains(&number) || u32::from(address) + u32::from(number) > 65_536 {
            return Err(format!("one request can cover 1 to {most} {}s, not {number} at {address}", object.name()));
        }
        if let Some(values) = values.as_ref().filter(|v| v.count() != usize::from(number)) {
            return Err(format!("{} values are given for {number}: give one for each", values.count()));
        }
        Ok(Request { object, count, address, values })
    }

    /// The code of its function.
    pub fn function(&self) -> u8 {
        match (self.values.is_some(), self.object, self.count) {
            (false, Object::Coil, _) => 1,
            (false, Object::DiscreteInput, _) => 2,
            (false, Object::HoldingRegister, _) => 3,
            (false, Object::InputRegister, _) => 4,
            (true, object, None) => {
                if object.is_bit() {
                    5
                } else {
                    6
                }
            }
            (true, object, Some(_)) => {
                if object.is_bit() {
                    15
                } else {
                    16
                }
            }
        }
    }
}

/// The name of an exception.
pub fn exception(code: u8) -> &'static str {
    match code {
        1 => "illegal function",
        2 => "illegal data address",
        3 => "illegal data value",
        4 => "server device failure",
        5 => "acknowledge: the device is still working on it",
        6 => "server device busy",
        8 => "memory parity error",
        10 => "gateway path unavailable",
        11 => "gateway target device failed to respond",
        _ => "an exception without a name",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_as_they_are_written() {
        for (text, function) in [
            ("read coil at 0", 1),
            ("read 3 discrete inputs at 16", 2),
            ("read 2 holding registers at 100", 3),
            ("read input register at 65535", 4),
            ("write coil at 5: on", 5),
            ("write holding register at 1: 0x00EB", 6),
            ("write 3 coils at 5: on off on", 15),
            ("write 2 holding registers at 7: 0x41BC0000", 16),
        ] {
            let request = Request::parse(text).expect(text);
            assert_eq!((request.to_string().as_str(), request.function()), (text, function));
        }
    }

    #[test]
    fn what_is_no_request_is_refused() {
        for text in [
            "",
            "read",
            "read coil",
            "read coils at 1",
            "read 0 coils at 1",
            "read 126 holding registers at 0",
            "read register at 1",
            "read 2 coils at 65535",
            "read coil at 65536",
            "read coil at 1: on",
            "write coil at 1",
            "write coil at 1: 1",
            "write 2 coils at 1: on",
            "write input register at 1: 0x0001",
            "write holding register at 1: 0x001",
            "write holding register at 1: 0x00010002",
            "start coil at 1",
            "write holding register at 1: 5",
        ] {
            assert!(Request::parse(text).is_err(), "{text}");
        }
    }
}
