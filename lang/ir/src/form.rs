//! Forms of numbers on a line: decimals of a width, bytes in an order, hexadecimal and binary-coded decimal digits.
//!
//! What goes over a line is held as a text of one character for each byte, U+0000 to U+00FF.

use serde::{Deserialize, Serialize};

use crate::quantity::{Unit, show_number};

/// How a number is written on a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// Its signs or bytes.
    pub encoding: Encoding,
    /// The number on the line is so many times the number that is meant.
    pub scale: f64,
}

/// The signs or bytes of a number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Encoding {
    /// As people write it.
    Decimal {
        /// Digits after the point; as many as needed where absent.
        digits: Option<u8>,
        /// Characters in all; as many as needed where absent.
        width: Option<u8>,
        /// Filled up with zeros, not with blanks.
        zeros: bool,
        /// A plus sign stands before what is not negative.
        plus: bool,
    },
    /// So many digits in all, as many of them after the point as there is room for, three at most.
    Significant(u8),
    /// Bytes of a whole number or of one after IEEE 754.
    Bytes {
        /// What they are.
        kind: Kind,
        /// 1, 2, 4 or 8.
        size: u8,
        /// Which comes first.
        order: Order,
        /// Each byte is two hexadecimal digits.
        hex: Hex,
    },
    /// Two decimal digits in each byte.
    Bcd {
        /// How many bytes.
        size: u8,
        /// Which comes first.
        order: Order,
        /// Each byte is two hexadecimal digits.
        hex: Hex,
    },
}

/// What bytes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// A whole number that is not negative.
    Unsigned,
    /// A whole number, two's complement.
    Signed,
    /// IEEE 754.
    Float,
}

/// The order of bytes; `swapped` exchanges the words of two bytes among each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Order {
    /// The highest first: 1 2 3 4.
    Big,
    /// The lowest first: 4 3 2 1.
    Little,
    /// 3 4 1 2.
    BigSwapped,
    /// 2 1 4 3.
    LittleSwapped,
}

/// Whether bytes are written as hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hex {
    /// They are sent as they are.
    No,
    /// `00FF`.
    Upper,
    /// `00ff`.
    Lower,
}

/// A number that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Read {
    /// The number that is meant.
    pub number: f64,
    /// Half of its last digit.
    pub half: f64,
    /// Bytes of the text that it takes, which are characters there.
    pub length: usize,
}

/// What conversions of units leave of a number that is nothing, in the unit that is sent.
const NOTHING: f64 = 1e-11;

/// By such a share of it a form may change a value.
const ROUNDED: f64 = 0.05;

/// So much may it change one that has a zero of convention, as 0 degC: in its unit.
const SHIFTED: f64 = 0.5;

/// Longest width of a decimal.
const WIDEST: u8 = 24;
/// The last whole number before which all are told apart.
const EXACT: f64 = 9_007_199_254_740_992.0;

impl Default for Form {
    fn default() -> Self {
        Form::decimal(None)
    }
}

impl Form {
    /// A decimal with so many digits after the point, or as many as needed.
    pub fn decimal(digits: Option<u8>) -> Form {
        Form { encoding: Encoding::Decimal { digits, width: None, zeros: false, plus: false }, scale: 1.0 }
    }

    /// A form as it is written in a text, without its colon: `05.1`, `+.2`, `4 digits`, `i16 big * 10`, `bcd 4`, `u8 hex`. In
    /// registers of two bytes the higher byte comes first without saying so.
    pub fn parse(text: &str, registers: bool) -> Result<Form, String> {
        let spaced = text.replace('*', " * ").replace('/', " / ");
        let mut words: Vec<&str> = spaced.split_whitespace().collect();
        let mut scale = 1.0;
        if let Some(at) = words.iter().position(|w| matches!(*w, "*" | "/")) {
            let factor = match &words[at + 1..] {
                [number] => number.parse::<f64>().ok().filter(|n| n.is_finite() && *n > 0.0),
                _ => None,
            };
            let factor = factor.ok_or("`*` or `/` needs one number above 0 after it")?;
            scale = if words[at] == "*" { factor } else { 1.0 / factor };
            words.truncate(at);
        }
        let encoding = match words.as_slice() {
            [] => Encoding::Decimal { digits: None, width: None, zeros: false, plus: false },
            [count, "digits"] => match count.parse::<u8>() {
                Ok(count @ 1..=15) => Encoding::Significant(count),
                _ => return Err("a number may have 1 to 15 digits".to_owned()),
            },
            ["bcd", digits, rest @ ..] => bcd(digits, rest)?,
            ["hex", ..] => return Err("`hex` needs the number of bytes before it".to_owned()),
            ["bcd"] => return Err("`bcd` needs the number of digits, as in `bcd 4`".to_owned()),
            [only] if only.starts_with(['+', '.']) || only.starts_with(|c: char| c.is_ascii_digit()) => decimal(only)?,
            [kind, rest @ ..] => bytes(kind, rest, registers)?,
        };
        Ok(Form { encoding, scale })
    }

    /// Characters that every number takes.
    pub fn width(&self) -> Option<usize> {
        match self.encoding {
            Encoding::Decimal { width, .. } => width.map(usize::from),
            Encoding::Significant(_) => None,
            Encoding::Bytes { size, hex, .. } | Encoding::Bcd { size, hex, .. } => {
                Some(usize::from(size) * if hex == Hex::No { 1 } else { 2 })
            }
        }
    }

    /// Whether what it writes may be any byte.
    pub fn is_raw(&self) -> bool {
        matches!(self.encoding, Encoding::Bytes { hex: Hex::No, .. } | Encoding::Bcd { hex: Hex::No, .. })
    }

    /// Whether it is a decimal of no width, as servers understand it.
    pub fn is_plain(&self) -> bool {
        matches!(self.encoding, Encoding::Decimal { width: None, plus: false, .. })
    }

    /// The same with hexadecimal digits in place of bytes.
    pub fn in_hex(mut self) -> Form {
        if let Encoding::Bytes { hex, .. } | Encoding::Bcd { hex, .. } = &mut self.encoding
            && *hex == Hex::No
        {
            *hex = Hex::Upper;
        }
        self
    }

    /// The largest whole number that it has room for.
    pub fn most(&self) -> f64 {
        match self.encoding {
            Encoding::Decimal { digits: None | Some(0), width: Some(width), .. } => 10f64.powi(width.into()) - 1.0,
            Encoding::Decimal { .. } => f64::INFINITY,
            Encoding::Significant(digits) => 10f64.powi(digits.into()) - 1.0,
            Encoding::Bytes { kind: Kind::Unsigned, size, .. } => 256f64.powi(size.into()) - 1.0,
            Encoding::Bytes { kind: Kind::Signed, size, .. } => 128.0 * 256f64.powi(i32::from(size) - 1) - 1.0,
            Encoding::Bytes { kind: Kind::Float, .. } => f64::INFINITY,
            Encoding::Bcd { size, .. } => 100f64.powi(size.into()) - 1.0,
        }
    }

    /// How far apart two numbers near this one are that it tells apart; 1 for a decimal with as many digits as needed.
    pub fn step(&self, near: f64) -> f64 {
        let line = match self.encoding {
            Encoding::Decimal { digits: Some(digits), .. } => 10f64.powi(-i32::from(digits)),
            Encoding::Significant(digits) => {
                10f64.powi(-i32::from(decimals((near * self.scale).abs(), digits).unwrap_or(0)))
            }
            Encoding::Bytes { kind: Kind::Float, size, .. } => epsilon(size) * (near * self.scale).abs(),
            Encoding::Decimal { digits: None, .. } | Encoding::Bytes { .. } | Encoding::Bcd { .. } => 1.0,
        };
        line / self.scale
    }

    /// A value, SI, in this form of a unit; in words why it has none, or is too far from itself there.
    pub fn put(&self, unit: &Unit, value: f64) -> Result<String, String> {
        let number = unit.of_si(value);
        let text = self.write(number)?;
        let Some(read) = self.read(&text) else { return Err("it cannot be read back".to_owned()) };
        let most = if unit.offset == 0.0 { (ROUNDED * number.abs()).max(NOTHING) } else { SHIFTED };
        if (read.number - number).abs() <= most * (1.0 + 1e-9) {
            return Ok(text);
        }
        let is = unit.show(unit.to_si(read.number));
        Err(format!("it would become {is}, because the format has too few digits"))
    }

    /// A number in this form; in words why it has none.
    pub fn write(&self, number: f64) -> Result<String, String> {
        if !number.is_finite() {
            return Err("it is not a number".to_owned());
        }
        let scaled = number * self.scale;
        match self.encoding {
            Encoding::Decimal { digits, width, zeros, plus } => {
                let text = match digits.or(width.map(|_| 0)) {
                    Some(digits) => fixed(scaled, digits),
                    None => plain(scaled),
                };
                let text = if plus && !text.starts_with('-') { format!("+{text}") } else { text };
                let Some(width) = width.map(usize::from) else { return Ok(text) };
                if text.len() > width {
                    return Err(format!("`{text}` has more than {width} characters"));
                }
                let (sign, rest) = text.split_at(usize::from(text.starts_with(['+', '-'])));
                Ok(if zeros { format!("{sign}{rest:0>0$}", width - sign.len()) } else { format!("{text:>width$}") })
            }
            Encoding::Significant(digits) => {
                let after = decimals(scaled.abs(), digits);
                let after = after.ok_or_else(|| format!("`{}` has more than {digits} digits", fixed(scaled, 0)))?;
                Ok(fixed(scaled, after))
            }
            Encoding::Bytes { kind: Kind::Float, size, order, hex } => {
                let bytes = if size == 8 {
                    scaled.to_be_bytes().to_vec()
                } else {
                    let narrow = scaled as f32;
                    if !narrow.is_finite() {
                        return Err(format!("{} is too large for 4 bytes", show_number(scaled)));
                    }
                    narrow.to_be_bytes().to_vec()
                };
                Ok(put(&ordered(bytes, order), hex))
            }
            Encoding::Bytes { kind, size, order, hex } => {
                let (low, high) = match kind {
                    Kind::Signed => (-self.most() - 1.0, self.most()),
                    Kind::Unsigned | Kind::Float => (0.0, self.most()),
                };
                let whole = within(scaled, low, high)?;
                let bytes = (whole as i64).to_be_bytes()[8 - usize::from(size)..].to_vec();
                Ok(put(&ordered(bytes, order), hex))
            }
            Encoding::Bcd { size, order, hex } => {
                let whole = within(scaled, 0.0, self.most())?;
                let digits = format!("{whole:0>0$}", usize::from(size) * 2).into_bytes();
                let bytes = digits.chunks(2).map(|pair| (pair[0] - b'0') << 4 | (pair[1] - b'0')).collect();
                Ok(put(&ordered(bytes, order), hex))
            }
        }
    }

    /// The number at the start of a text; nothing where it begins otherwise.
    pub fn read(&self, text: &str) -> Option<Read> {
        let (line, half, length) = match self.encoding {
            Encoding::Decimal { width: Some(width), .. } => {
                let part = text.get(..usize::from(width))?;
                let inner = part.trim_start();
                let length = number_length(inner);
                (length == inner.len()).then_some(())?;
                let (number, half) = parsed(inner)?;
                (number, half, part.len())
            }
            Encoding::Decimal { .. } | Encoding::Significant(_) => {
                let blanks = text.len() - text.trim_start().len();
                let length = number_length(&text[blanks..]);
                let (number, half) = parsed(&text[blanks..blanks + length])?;
                (number, half, blanks + length)
            }
            Encoding::Bytes { kind, size, order, hex } => {
                let (bytes, length) = take(text, size, hex)?;
                let bytes = ordered(bytes, order);
                let number = match (kind, size) {
                    (Kind::Float, 8) => f64::from_be_bytes(bytes.try_into().ok()?),
                    (Kind::Float, _) => f64::from(f32::from_be_bytes(bytes.try_into().ok()?)),
                    (Kind::Unsigned, _) => whole(&bytes) as f64,
                    (Kind::Signed, _) => {
                        let shift = 64 - 8 * u32::from(size);
                        ((whole(&bytes) << shift) as i64 >> shift) as f64
                    }
                };
                let half = if kind == Kind::Float { 0.5 * epsilon(size) * number.abs() } else { 0.5 };
                (number, half, length)
            }
            Encoding::Bcd { size, order, hex } => {
                let (bytes, length) = take(text, size, hex)?;
                let mut number = 0.0;
                for byte in ordered(bytes, order) {
                    let (high, low) = (byte >> 4, byte & 15);
                    (high < 10 && low < 10).then_some(())?;
                    number = number * 100.0 + f64::from(high * 10 + low);
                }
                (number, 0.5, length)
            }
        };
        let number = line / self.scale;
        number.is_finite().then_some(Read { number, half: half / self.scale, length })
    }
}

/// A number as devices understand it, with all of its digits but those that conversions of units leave behind, and without an
/// exponent.
pub fn plain(number: f64) -> String {
    let short: f64 = format!("{number:.11e}").parse().unwrap_or(number);
    fixed_sign(format!("{short}"))
}

/// A number with so many digits after the point; rounded to nothing it has no sign.
pub fn fixed(number: f64, digits: u8) -> String {
    fixed_sign(format!("{number:.*}", usize::from(digits)))
}

fn fixed_sign(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if !rest.bytes().any(|b| b.is_ascii_digit() && b != b'0') => rest.to_owned(),
        _ => text,
    }
}

/// How many bytes at the start are a number as people write it.
pub fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let digits = |from: usize| bytes[from.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(sign);
    let mut end = sign + whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction > 0 {
            end += 1 + fraction;
        }
    }
    let exponent = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
    if end > sign && matches!(bytes.get(end), Some(b'e' | b'E')) && digits(end + 1 + exponent) > 0 {
        end += 1 + exponent + digits(end + 1 + exponent);
    }
    end
}

/// A number as people write it, and half of its last digit.
fn parsed(text: &str) -> Option<(f64, f64)> {
    let number = text.parse().ok().filter(|n: &f64| n.is_finite())?;
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let after = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len()).min(300) as i32;
    let exponent: i32 = exponent.parse().ok()?;
    Some((number, 0.5 * 10f64.powi(exponent.saturating_sub(after))))
}

/// `+06.2`: a sign, whether zeros fill it up, characters in all, digits after the point.
fn decimal(text: &str) -> Result<Encoding, String> {
    let not_one = || format!("`{text}` is not a format of a number: write it as in `.1`, `06.2` or `+.3`");
    let rest = text.strip_prefix('+').unwrap_or(text);
    let (whole, digits) = rest.split_once('.').map_or((rest, None), |(whole, digits)| (whole, Some(digits)));
    let number = |t: &str| t.parse::<u8>().ok().filter(|_| t.bytes().all(|b| b.is_ascii_digit()));
    let digits = digits.map(|d| number(d).filter(|d| *d <= 15).ok_or_else(not_one)).transpose()?;
    let zeros = whole.len() > 1 && whole.starts_with('0');
    let width = if whole.is_empty() { None } else { Some(number(whole).ok_or_else(not_one)?) };
    if width.is_some_and(|w| !(1..=WIDEST).contains(&w)) {
        return Err(format!("a number may have 1 to {WIDEST} characters"));
    }
    let least = digits.map_or(1, |d| d + 1 + u8::from(d > 0)) + u8::from(text.starts_with('+'));
    if let Some(width) = width.filter(|w| *w < least) {
        return Err(format!("a number like this needs at least {least} characters, not {width}"));
    }
    Ok(Encoding::Decimal { digits, width, zeros, plus: text.starts_with('+') })
}

fn bcd(digits: &str, rest: &[&str]) -> Result<Encoding, String> {
    let count = digits.parse::<u8>().ok().filter(|d| (2..=14).contains(d) && d % 2 == 0);
    let count = count.ok_or("each byte holds two digits: write `bcd 2` to `bcd 14`, an even number")?;
    let (order, hex) = order(rest, true, 1)?;
    Ok(Encoding::Bcd { size: count / 2, order, hex })
}

fn bytes(kind: &str, rest: &[&str], registers: bool) -> Result<Encoding, String> {
    let (kind, size) = match kind {
        "u8" => (Kind::Unsigned, 1),
        "i8" => (Kind::Signed, 1),
        "u16" => (Kind::Unsigned, 2),
        "i16" => (Kind::Signed, 2),
        "u32" => (Kind::Unsigned, 4),
        "i32" => (Kind::Signed, 4),
        "f32" => (Kind::Float, 4),
        "f64" => (Kind::Float, 8),
        other => {
            return Err(format!(
                "`{other}` is not a format of a number: write it as in `.1`, `05.1`, `+.2`, `4 digits`, `u8`, `i16 big`, `u32 little`, `f32 swapped`, `u16 hex` or `bcd 4`"
            ));
        }
    };
    let (order, hex) = order(rest, registers && size == 2, size)?;
    Ok(Encoding::Bytes { kind, size, order, hex })
}

/// The words behind a number of bytes.
fn order(words: &[&str], known: bool, size: u8) -> Result<(Order, Hex), String> {
    let mut hex = Hex::No;
    let mut orders = Vec::new();
    for word in words {
        match *word {
            "hex" => hex = Hex::Upper,
            "lower" if hex == Hex::Upper => hex = Hex::Lower,
            "big" | "little" | "swapped" => orders.push(*word),
            other => return Err(format!("`{other}` does not describe bytes: use `big`, `little`, `swapped` or `hex`")),
        }
    }
    let order = match orders.as_slice() {
        [] if size > 1 && !known && hex == Hex::No => {
            return Err("the byte order is missing: `big` sends the highest byte first, `little` the lowest".to_owned());
        }
        [] | ["big"] => Order::Big,
        ["little"] => Order::Little,
        ["swapped"] | ["big", "swapped"] | ["swapped", "big"] if size >= 4 => Order::BigSwapped,
        ["little", "swapped"] | ["swapped", "little"] if size >= 4 => Order::LittleSwapped,
        other => return Err(format!("`{}` is not an order of {size} bytes", other.join(" "))),
    };
    Ok((order, hex))
}

/// Bytes from one order to the other, both ways.
fn ordered(mut bytes: Vec<u8>, order: Order) -> Vec<u8> {
    match order {
        Order::Big => {}
        Order::Little => bytes.reverse(),
        Order::BigSwapped => {
            bytes.reverse();
            bytes.chunks_mut(2).for_each(<[u8]>::reverse);
        }
        Order::LittleSwapped => bytes.chunks_mut(2).for_each(<[u8]>::reverse),
    }
    bytes
}

fn put(bytes: &[u8], hex: Hex) -> String {
    match hex {
        Hex::No => bytes.iter().map(|b| char::from(*b)).collect(),
        Hex::Upper => bytes.iter().map(|b| format!("{b:02X}")).collect(),
        Hex::Lower => bytes.iter().map(|b| format!("{b:02x}")).collect(),
    }
}

/// So many bytes at the start of a text, and how much of it they take.
fn take(text: &str, size: u8, hex: Hex) -> Option<(Vec<u8>, usize)> {
    let wanted = usize::from(size) * if hex == Hex::No { 1 } else { 2 };
    let mut chars = text.chars();
    let codes: Option<Vec<u8>> = chars.by_ref().take(wanted).map(|c| u8::try_from(u32::from(c)).ok()).collect();
    let codes = codes.filter(|c| c.len() == wanted)?;
    let length = text.len() - chars.as_str().len();
    if hex == Hex::No {
        return Some((codes, length));
    }
    let digit = |b: u8| char::from(b).to_digit(16).map(|d| d as u8);
    let bytes: Option<Vec<u8>> = codes.chunks(2).map(|pair| Some(digit(pair[0])? << 4 | digit(pair[1])?)).collect();
    Some((bytes?, length))
}

fn whole(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |n, b| n << 8 | u64::from(*b))
}

fn within(scaled: f64, low: f64, high: f64) -> Result<f64, String> {
    let whole = scaled.round();
    if (low..=high.min(EXACT)).contains(&whole) {
        return Ok(whole);
    }
    Err(format!("{} is outside {} to {}", show_number(scaled), show_number(low), show_number(high)))
}

/// Digits after the point of a number that has so many in all, three at most; none where it has more before the point.
fn decimals(size: f64, digits: u8) -> Option<u8> {
    (0..=digits.saturating_sub(1).min(3)).rev().find(|after| {
        let text = fixed(size, *after);
        text.bytes().filter(u8::is_ascii_digit).count() <= usize::from(digits)
    })
}

/// How much two neighbours among numbers of so many bytes differ, as a fraction.
fn epsilon(size: u8) -> f64 {
    if size == 8 { f64::EPSILON } else { f64::from(f32::EPSILON) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(text: &str) -> Form {
        Form::parse(text, false).expect(text)
    }

    fn bytes(text: &str) -> Vec<u8> {
        text.chars().map(|c| u32::from(c) as u8).collect()
    }

    #[test]
    fn numbers_are_written_as_manuals_show_them() {
        for (text, number, written) in [
            (".1", 23.45, "23.4"),
            ("05.1", 7.0, "007.0"),
            ("05", 42.0, "00042"),
            ("6.2", 3.5, "  3.50"),
            ("+06.2", 3.5, "+03.50"),
            ("06.2", -3.5, "-03.50"),
            ("05 * 10", 23.4, "00234"),
            ("4 digits", 0.5, "0.500"),
            ("4 digits", 12.345, "12.35"),
            ("4 digits", 999.96, "1000"),
            ("4 digits", 1234.0, "1234"),
            ("u16 hex", 255.0, "00FF"),
            ("i16 hex lower * 100", -1.5, "ff6a"),
            ("bcd 4 hex", 1234.0, "1234"),
        ] {
            assert_eq!(form(text).write(number).as_deref(), Ok(written), "{text}");
        }
        for (text, number, written) in [
            ("u8", 200.0, vec![200]),
            ("i16 big", -2.0, vec![0xff, 0xfe]),
            ("u16 little", 258.0, vec![2, 1]),
            ("f32 big", 1.0, vec![0x3f, 0x80, 0, 0]),
            ("f32 swapped", 1.0, vec![0, 0, 0x3f, 0x80]),
            ("f32 little swapped", 1.0, vec![0x80, 0x3f, 0, 0]),
            ("u32 little", 1.0, vec![1, 0, 0, 0]),
            ("bcd 4", 1234.0, vec![0x12, 0x34]),
            ("bcd 4 little", 1234.0, vec![0x34, 0x12]),
        ] {
            assert_eq!(bytes(&form(text).write(number).expect(text)), written, "{text}");
        }
    }

    #[test]
    fn a_number_that_does_not_fit_is_not_written() {
        for (text, number) in [
            ("05.1", 1234.5),
            ("03", -100.0),
            ("u8", 256.0),
            ("u8", -1.0),
            ("i16 big * 10", 4000.0),
            ("bcd 4", 10_000.0),
            ("4 digits", 99_999.0),
            ("f32 big", 1e60),
            (".1", f64::NAN),
        ] {
            assert!(form(text).write(number).is_err(), "{text} {number}");
        }
    }

    #[test]
    fn a_value_is_not_sent_as_another_one() {
        let (ml, degc) = (Unit::scaled("mL", 1e-6), Unit { symbol: "degC".to_owned(), factor: 1.0, offset: 273.15 });
        let put = |text: &str, unit: &Unit, number: f64| form(text).put(unit, unit.to_si(number));
        for (text, number) in [
            ("06.3", 0.0005),
            ("06.3", 1e-9),
            ("06.3", 0.0044),
            ("u8", 0.4),
            ("u16 hex * 10", 0.26),
            ("4 digits", 3e-4),
        ] {
            let why = put(text, &ml, number).expect_err(text);
            assert!(why.contains("it would become"), "{text} {number}: {why}");
        }
        for (text, number, sent) in [
            ("06.3", 0.0, "00.000"),
            ("06.3", 1e-15, "00.000"),
            ("06.3", 0.0206, "00.021"),
            ("06.3", 99.9994, "99.999"),
            ("u8 hex", 10.4, "0A"),
        ] {
            assert_eq!(put(text, &ml, number).as_deref(), Ok(sent), "{text} {number}");
        }
        for (text, number, sent) in [(".0", 0.4, "0"), (".0", -0.4, "0"), ("i16 hex * 10", 0.04, "0000")] {
            assert_eq!(put(text, &degc, number).as_deref(), Ok(sent), "{text} {number}");
        }
        assert!(put(".0 / 10", &degc, 43.0).is_err(), "tens of degrees say too little");
    }

    #[test]
    fn forms_that_say_too_little_are_refused() {
        for text in
            ["u16", "f32", "hex", "bcd", "bcd 3", "x", "u8 7", "04.9", "+1", "* 0", "* -1", "i16 swapped", "0", "99"]
        {
            assert!(Form::parse(text, false).is_err(), "{text}");
        }
        assert!(Form::parse("u16", true).is_ok() && Form::parse("f32", true).is_err());
    }

    #[test]
    fn what_is_written_is_read_back() {
        let all = [
            ".2",
            "07.2",
            "+08.3",
            "9.1",
            "5 digits",
            "u8",
            "i8",
            "u16 big",
            "i16 little",
            "i32 swapped",
            "u32 little swapped",
            "f32 little",
            "f64 big",
            "u16 hex",
            "i16 hex lower",
            "f32 hex",
            "bcd 6",
            "bcd 4 little",
            "i16 big * 100",
            "05 / 10",
        ];
        for text in all {
            let form = form(text);
            for number in [0.0, 1.0, 7.25, 99.0, -12.5, -100.0, 120.0, 1e4, 3e6] {
                let Ok(written) = form.write(number) else { continue };
                let read = form.read(&format!("{written}/rest")).expect(text);
                assert_eq!(read.length, written.len(), "{text} {number}");
                assert!((read.number - number).abs() <= read.half * 1.000_001, "{text} {number}: {read:?}");
                if let Some(width) = form.width() {
                    assert_eq!(written.chars().count(), width, "{text}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_is_not_read() {
        for (text, line) in [
            ("05.1", "12"),
            ("05.1", "1 2.3"),
            ("u16 hex", "00G0"),
            ("bcd 2", "\u{1a}"),
            ("f32 big", "\u{7f}\u{80}\0\0"),
            (".1", "x"),
        ] {
            assert!(form(text).read(line).is_none(), "{text} {line:?}");
        }
    }
}
