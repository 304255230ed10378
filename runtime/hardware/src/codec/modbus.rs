//! Requests and answers of Modbus as bytes, without what stands around them (the PDU).
//!
//! After MODBUS Application Protocol Specification V1.1b3: functions 1 to 6, 15 and 16.

use matterix_ir::modbus::{Object, Request, Values, exception};

use super::{Garbled, Reply, shown};

/// Set in the function of an answer that is an exception.
const EXCEPTION: u8 = 0x80;
/// What stands before the number of an exception.
const NAME: &str = "exception ";
const ON: [u8; 2] = [0xff, 0];
const OFF: [u8; 2] = [0, 0];

/// What an answer is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asked {
    function: u8,
    /// None where the function is not known.
    request: Option<Request>,
}

impl Asked {
    /// A request of a function that is not known.
    pub(super) fn unknown(function: u8) -> Self {
        Asked { function, request: None }
    }
}

/// The bytes of a request.
pub(super) fn request(text: &str) -> Result<Vec<u8>, String> {
    let request = Request::parse(text)?;
    let function = request.function();
    let mut pdu = vec![function];
    pdu.extend(request.address.to_be_bytes());
    match &request.values {
        None => pdu.extend(request.count.unwrap_or(1).to_be_bytes()),
        Some(values) if request.count.is_none() => pdu.extend(alone(values)),
        Some(values) => {
            let bytes = packed(values);
            pdu.extend(request.count.unwrap_or(1).to_be_bytes());
            pdu.push(u8::try_from(bytes.len()).map_err(|_| "too much for one request")?);
            pdu.extend(bytes);
        }
    }
    Ok(pdu)
}

/// The device's end: a request as drivers write it.
pub(super) fn requested(pdu: &[u8]) -> Result<(String, Asked), Garbled> {
    let none = || Garbled::new(format!("`{}` is not a request of Modbus", shown(pdu)));
    let (&[function, a, b, c, d], rest) = pdu.split_first_chunk::<5>().ok_or_else(none)?;
    let (address, number) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
    let (object, count, values) = match (function, rest) {
        (1 | 15, _) | (5, []) => (Object::Coil, number, function),
        (2, []) => (Object::DiscreteInput, number, function),
        (3 | 16, _) | (6, []) => (Object::HoldingRegister, number, function),
        (4, []) => (Object::InputRegister, number, function),
        _ => return Err(none()),
    };
    let request = match (values, rest) {
        (1..=4, []) => Request { object, count: (count != 1).then_some(count), address, values: None },
        (5, _) => {
            let bit = [(ON, true), (OFF, false)].into_iter().find(|(code, _)| *code == [c, d]).ok_or_else(none)?.1;
            Request { object, count: None, address, values: Some(Values::Bits(vec![bit])) }
        }
        (6, _) => Request { object, count: None, address, values: Some(Values::Bytes(vec![c, d])) },
        (15, [size, bytes @ ..])
            if usize::from(*size) == bytes.len() && bytes.len() == usize::from(count).div_ceil(8) =>
        {
            Request { object, count: Some(count), address, values: Some(Values::Bits(bits(bytes, count))) }
        }
        (16, [size, bytes @ ..]) if usize::from(*size) == bytes.len() && bytes.len() == usize::from(count) * 2 => {
            Request { object, count: Some(count), address, values: Some(Values::Bytes(bytes.to_vec())) }
        }
        _ => return Err(none()),
    };
    let text = request.to_string();
    // What could not have been written is none either.
    let request = Request::parse(&text).map_err(Garbled::new)?;
    Ok((text, Asked { function, request: Some(request) }))
}

/// What an answer says: `on off`, `0x00EB`, `ok`, `exception 2`.
pub(super) fn answered(asked: &Asked, pdu: &[u8]) -> Result<Reply, Garbled> {
    let none = || Garbled::new(format!("`{}` is not a reply to this", shown(pdu)));
    let (function, rest) = pdu.split_first().ok_or_else(none)?;
    if *function == asked.function | EXCEPTION {
        let [code] = rest else { return Err(none()) };
        return Ok(Reply { is_error: true, ..Reply::of(format!("{NAME}{code}")) });
    }
    let request = asked.request.as_ref().filter(|_| *function == asked.function).ok_or_else(none)?;
    let count = request.count.unwrap_or(1);
    if let Some(values) = &request.values {
        let mut wanted = request.address.to_be_bytes().to_vec();
        match request.count {
            None => wanted.extend(alone(values)),
            Some(count) => wanted.extend(count.to_be_bytes()),
        }
        return if rest == wanted { Ok(Reply::of("ok")) } else { Err(none()) };
    }
    let (size, bytes) = rest.split_first().ok_or_else(none)?;
    let wanted = if request.object.is_bit() { usize::from(count).div_ceil(8) } else { usize::from(count) * 2 };
    if bytes.len() != wanted || usize::from(*size) != wanted {
        return Err(none());
    }
    let values = if request.object.is_bit() { Values::Bits(bits(bytes, count)) } else { Values::Bytes(bytes.to_vec()) };
    Ok(Reply::of(values.to_string()))
}

/// The device's end: the bytes of an answer.
pub(super) fn answer(asked: &Asked, reply: &Reply) -> Result<Vec<u8>, String> {
    let code = reply.text.strip_prefix(NAME).and_then(|code| code.parse::<u8>().ok());
    let Some(request) = &asked.request else { return Ok(vec![asked.function | EXCEPTION, 1]) };
    if reply.is_error {
        return Ok(vec![asked.function | EXCEPTION, code.unwrap_or(4)]);
    }
    let mut pdu = vec![asked.function];
    if let Some(values) = &request.values {
        pdu.extend(request.address.to_be_bytes());
        match request.count {
            None => pdu.extend(alone(values)),
            Some(count) => pdu.extend(count.to_be_bytes()),
        }
        return Ok(pdu);
    }
    let values = Values::parse(&reply.text, request.object)?;
    // Who asks for other registers than there are is told so, as by a controller.
    if values.count() != usize::from(request.count.unwrap_or(1)) {
        return Ok(vec![asked.function | EXCEPTION, 2]);
    }
    let bytes = packed(&values);
    pdu.push(u8::try_from(bytes.len()).map_err(|_| "too much for one answer")?);
    pdu.extend(bytes);
    Ok(pdu)
}

/// Bytes of a request that begins like this; nothing while that is not known.
pub(super) fn size_of_request(begun: &[u8]) -> Result<Option<usize>, Garbled> {
    Ok(match begun {
        [] => None,
        [1..=6, ..] => Some(5),
        [15 | 16, _, _, _, _, size, ..] => Some(6 + usize::from(*size)),
        [15 | 16, ..] => None,
        [other, ..] => return Err(Garbled::new(format!("unknown function {other}"))),
    })
}

/// Bytes of an answer that begins like this; nothing while that is not known.
pub(super) fn size_of_answer(begun: &[u8]) -> Result<Option<usize>, Garbled> {
    Ok(match begun {
        [] => None,
        [function, ..] if function & EXCEPTION != 0 => Some(2),
        [1..=4, size, ..] => Some(2 + usize::from(*size)),
        [1..=4] => None,
        [5 | 6 | 15 | 16, ..] => Some(5),
        [other, ..] => return Err(Garbled::new(format!("unknown function {other}"))),
    })
}

/// An answer for messages: an exception with its name.
pub(super) fn shown_answer(text: &str) -> String {
    match text.strip_prefix(NAME).and_then(|code| code.parse::<u8>().ok()) {
        Some(code) => format!("{text}: {}", exception(code)),
        None => text.to_owned(),
    }
}

/// The one value of a request for one.
fn alone(values: &Values) -> Vec<u8> {
    match values {
        Values::Bits(bits) => if bits.first() == Some(&true) { ON } else { OFF }.to_vec(),
        Values::Bytes(bytes) => bytes.clone(),
    }
}

/// Bits lowest first, eight in a byte.
fn packed(values: &Values) -> Vec<u8> {
    match values {
        Values::Bits(bits) => {
            let byte = |eight: &[bool]| eight.iter().enumerate().fold(0, |byte, (i, bit)| byte | u8::from(*bit) << i);
            bits.chunks(8).map(byte).collect()
        }
        Values::Bytes(bytes) => bytes.clone(),
    }
}

fn bits(bytes: &[u8], count: u16) -> Vec<bool> {
    (0..usize::from(count)).map(|i| bytes.get(i / 8).is_some_and(|b| b >> (i % 8) & 1 == 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked_of(text: &str) -> Asked {
        requested(&request(text).expect(text)).expect(text).1
    }

    /// The examples of the specification, sections 6.1 to 6.12.
    #[test]
    fn bytes_are_those_of_the_specification() {
        let cases: [(&str, &[u8], &[u8], &str); 8] = [
            (
                "read 19 coils at 19",
                &[1, 0, 0x13, 0, 0x13],
                &[1, 3, 0xcd, 0x6b, 0x05],
                "on off on on off off on on on on off on off on on off on off on",
            ),
            (
                "read 22 discrete inputs at 196",
                &[2, 0, 0xc4, 0, 0x16],
                &[2, 3, 0xac, 0xdb, 0x35],
                "off off on on off on off on on on off on on off on on on off on off on on",
            ),
            ("read 3 holding registers at 107", &[3, 0, 0x6b, 0, 3], &[3, 6, 2, 0x2b, 0, 0, 0, 0x64], "0x022B00000064"),
            ("read input register at 8", &[4, 0, 8, 0, 1], &[4, 2, 0, 10], "0x000A"),
            ("write coil at 172: on", &[5, 0, 0xac, 0xff, 0], &[5, 0, 0xac, 0xff, 0], "ok"),
            ("write holding register at 1: 0x0003", &[6, 0, 1, 0, 3], &[6, 0, 1, 0, 3], "ok"),
            (
                "write 10 coils at 19: on off on on off off on on on off",
                &[15, 0, 0x13, 0, 10, 2, 0xcd, 1],
                &[15, 0, 0x13, 0, 10],
                "ok",
            ),
            ("write 2 holding registers at 1: 0x000A0102", &[16, 0, 1, 0, 2, 4, 0, 10, 1, 2], &[16, 0, 1, 0, 2], "ok"),
        ];
        for (text, sent, back, said) in cases {
            let pdu = request(text).expect(text);
            let (again, asked) = requested(&pdu).expect(text);
            assert_eq!(pdu, sent, "{text}");
            assert_eq!(size_of_request(&pdu), Ok(Some(sent.len())), "{text}");
            assert_eq!(size_of_answer(back), Ok(Some(back.len())), "{text}");
            assert_eq!(answered(&asked, back), Ok(Reply::of(said)), "{text}");
            assert_eq!(again, text);
            assert_eq!(answer(&asked, &Reply::of(said)).as_deref(), Ok(back), "{text}");
        }
    }

    #[test]
    fn an_exception_is_a_refusal_and_an_answer_to_something_else_is_none() {
        let asked = asked_of("read coil at 5");
        let reply = answered(&asked, &[0x81, 2]).expect("an answer");
        assert!(reply.is_error && shown_answer(&reply.text) == "exception 2: illegal data address");
        assert_eq!(answer(&asked, &reply).as_deref(), Ok(&[0x81, 2][..]));
        for other in [&[3, 2, 0, 1][..], &[1, 2, 0, 1], &[1, 1], &[1], &[], &[0x82, 2]] {
            assert!(answered(&asked, other).is_err(), "{other:?}");
        }
        let asked = asked_of("write coil at 5: on");
        assert!(answered(&asked, &[5, 0, 5, 0, 0]).is_err(), "another value came back");
    }
}
