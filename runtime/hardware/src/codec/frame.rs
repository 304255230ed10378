//! Frames as a text declares them, from both ends of a line.
//!
//! Bytes are taken the same in whatever pieces they come: what is decided depends on what stands before it only.

use std::ops::Range;

use matterix_ir::form::{Form, Read};
use matterix_ir::framing::{Carries, Frames, Part};

use super::{Garbled, LONGEST, Reply, Request, modbus, shown};

/// One end of a line with frames of a declared form.
#[derive(Clone, Debug)]
pub struct Frame {
    frames: Frames,
    /// The device's, as it stands in requests and in replies.
    addresses: [Vec<u8>; 2],
    /// The number of the last request that was put together.
    number: u64,
    /// The number of the last request that was sent.
    awaited: Option<u64>,
    /// What was asked last, which says what an answer of Modbus is about.
    asked: Option<modbus::Asked>,
    /// The device's end: the number of the request that is answered next.
    heard: u64,
}

/// Which way a frame goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Request,
    Reply,
}

/// The first frame of what has come in.
enum Taken {
    /// More must come.
    More,
    /// So many bytes are none.
    Bad(usize, Garbled),
    /// So many bytes are one.
    Whole(usize, Whole),
}

/// What a whole frame says.
struct Whole {
    data: Vec<u8>,
    address: Option<Vec<u8>>,
    number: Option<u64>,
}

/// Bytes, and where they stand in a frame.
type Placed = (Range<usize>, Vec<u8>);

impl Frame {
    /// A line with a device at this address; in words why it can have none.
    pub(super) fn new(frames: Frames, address: Option<&str>) -> Result<Self, String> {
        let addresses = [written(&frames, &frames.request, address)?, written(&frames, &frames.reply, address)?];
        if addresses.iter().all(Option::is_none) && address.is_some() {
            return Err(format!("the framing `{}` has no address", frames.name));
        }
        let addresses = addresses.map(Option::unwrap_or_default);
        Ok(Frame { frames, addresses, number: 0, awaited: None, asked: None, heard: 0 })
    }

    /// How long the line is quiet before something is sent, s.
    pub(super) fn silence(&self) -> f64 {
        self.frames.silence
    }

    /// Whether every request is answered.
    pub(super) fn acknowledges(&self) -> bool {
        self.frames.carries == Carries::Modbus
    }

    /// Whether each answer says by its number which request it answers.
    pub(super) fn is_numbered(&self) -> bool {
        let has_number = |layout: &[Part]| layout.iter().any(|part| matches!(part, Part::Number(_)));
        has_number(&self.frames.request) && has_number(&self.frames.reply)
    }

    /// Whether messages are any bytes.
    pub(super) fn is_exact(&self) -> bool {
        self.frames.carries != Carries::Text
    }

    pub(super) fn request(&mut self, text: &str) -> Result<Vec<u8>, String> {
        let data = match self.frames.carries {
            Carries::Modbus => modbus::request(text)?,
            _ => bytes(text)
                .ok_or_else(|| format!("`{}` contains characters that are not bytes", text.escape_debug()))?,
        };
        self.number += 1;
        self.put(Way::Request, &data, self.number)
    }

    /// This request goes out: what comes answers it.
    pub(super) fn sent(&mut self, frame: &[u8]) {
        let Some(Ok(Whole { data, number, .. })) = self.take(Way::Request, &mut frame.to_vec()) else { return };
        self.awaited = number;
        if self.frames.carries == Carries::Modbus {
            self.asked = modbus::requested(&data).ok().map(|(_, asked)| asked);
        }
    }

    pub(super) fn reply(&mut self, reply: &Reply) -> Result<Vec<u8>, String> {
        let data = match (self.frames.carries, &self.asked) {
            (Carries::Modbus, Some(asked)) => modbus::answer(asked, reply)?,
            _ => bytes(&reply.text).ok_or("a reply contains characters that are not bytes")?,
        };
        self.put(Way::Reply, &data, self.heard)
    }

    pub(super) fn take_reply(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Reply, Garbled>> {
        loop {
            let Whole { data, address, number } = match self.take(Way::Reply, buffer)? {
                Ok(whole) => whole,
                Err(garbled) => return Some(Err(garbled)),
            };
            // What another device says, or what answers an earlier question, is no answer to this one.
            let is_other = address.is_some_and(|a| a != self.addresses[Way::Reply as usize]);
            let is_late = number.is_some_and(|n| self.awaited.is_some_and(|awaited| awaited != n));
            if is_other || is_late {
                continue;
            }
            return Some(match (self.frames.carries, &self.asked) {
                (Carries::Modbus, Some(asked)) => modbus::answered(asked, &data),
                (Carries::Modbus, None) => continue,
                _ => text(&data, self.frames.carries).map(Reply::of),
            });
        }
    }

    pub(super) fn take_request(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Request, Garbled>> {
        let Whole { data, address, number } = match self.take(Way::Request, buffer)? {
            Ok(whole) => whole,
            Err(garbled) => return Some(Err(garbled)),
        };
        if address.is_some_and(|a| a != self.addresses[Way::Request as usize]) {
            return Some(Ok(Request::Other));
        }
        self.heard = number.unwrap_or_default();
        let words = match self.frames.carries {
            Carries::Modbus => match modbus::requested(&data) {
                Ok((text, asked)) => {
                    self.asked = Some(asked);
                    Ok(text)
                }
                Err(why) => {
                    self.asked = data.first().map(|function| modbus::Asked::unknown(*function));
                    Err(why)
                }
            },
            carries => text(&data, carries),
        };
        Some(words.map(|text| Request::Says(vec![text])))
    }

    fn layout(&self, way: Way) -> &[Part] {
        match way {
            Way::Request => &self.frames.request,
            Way::Reply => &self.frames.reply,
        }
    }

    fn width(&self, way: Way, part: &Part) -> usize {
        match part {
            Part::Fixed(bytes) => bytes.len(),
            Part::Data => 0,
            Part::Address(_) => self.addresses[way as usize].len(),
            Part::Length(form) | Part::Check(form) | Part::Number(form) => form.width().unwrap_or_default(),
        }
    }

    /// Where each part stands in a frame with a message of this size.
    fn places(&self, way: Way, layout: &[Part], size: usize) -> Vec<Range<usize>> {
        let mut at = 0;
        let mut place = |part: &Part| {
            let width = if *part == Part::Data { size } else { self.width(way, part) };
            at += width;
            at - width..at
        };
        layout.iter().map(&mut place).collect()
    }

    /// A message as a frame.
    fn put(&self, way: Way, data: &[u8], number: u64) -> Result<Vec<u8>, String> {
        let layout = self.layout(way);
        let places = self.places(way, layout, data.len());
        let long = || format!("a message of {} bytes does not fit into a frame", data.len());
        let mut out = Vec::new();
        for part in layout {
            match part {
                Part::Fixed(fixed) => out.extend_from_slice(fixed),
                Part::Data => out.extend_from_slice(data),
                Part::Address(_) => out.extend_from_slice(&self.addresses[way as usize]),
                Part::Length(form) => {
                    let counted = self.counted(layout, &places).ok_or_else(long)?;
                    let written = form.write(counted as f64).map_err(|_| long())?;
                    out.extend(bytes(&written).ok_or_else(long)?);
                }
                Part::Check(form) => out.resize(out.len() + form.width().unwrap_or_default(), 0),
                Part::Number(form) => {
                    let written = form.write(wrapped(number, Some(form)) as f64)?;
                    out.extend(bytes(&written).ok_or("a number needs some bytes")?);
                }
            }
        }
        if out.len() > LONGEST {
            return Err(long());
        }
        if let Some((place, check)) = self.check(layout, &places, &out)? {
            out[place].copy_from_slice(&check);
        }
        Ok(out)
    }

    /// What the length says where parts stand like this.
    fn counted(&self, layout: &[Part], places: &[Range<usize>]) -> Option<i64> {
        let counted = self.frames.length?;
        let parts = counted.over.parts(layout)?;
        let bytes = places[*parts.end()].end - places[*parts.start()].start;
        Some(i64::try_from(bytes).ok()? + i64::from(counted.more))
    }

    /// The checksum of a frame as it must be, and where; none where a frame has none.
    fn check(&self, layout: &[Part], places: &[Range<usize>], frame: &[u8]) -> Result<Option<Placed>, String> {
        let at = layout.iter().position(|p| matches!(p, Part::Check(_)));
        let (Some(at), Some(check)) = (at, &self.frames.check) else { return Ok(None) };
        let Part::Check(form) = &layout[at] else { return Ok(None) };
        let parts = check.over.parts(layout).ok_or("the checksum covers no bytes")?;
        let over: Vec<u8> =
            parts.filter(|part| *part != at).flat_map(|part| frame[places[part].clone()].iter().copied()).collect();
        let written = form.write(check.sum.of(&over).into())?;
        let bytes = bytes(&written).ok_or("a checksum needs some bytes")?;
        Ok(Some((places[at].clone(), bytes)))
    }

    /// The first frame that goes this way, which is taken away; empty texts are passed over.
    fn take(&self, way: Way, buffer: &mut Vec<u8>) -> Option<Result<Whole, Garbled>> {
        let layout = self.layout(way);
        let is_bare =
            layout.iter().all(|p| matches!(p, Part::Fixed(_) | Part::Data)) && layout.first() == Some(&Part::Data);
        loop {
            if let Some(Part::Fixed(start)) = layout.first() {
                let at = buffer.iter().position(|b| Some(b) == start.first());
                let noise = at.unwrap_or(buffer.len());
                buffer.drain(..noise);
            }
            let most = buffer.len().min(LONGEST);
            match self.first(way, &buffer[..most]) {
                Taken::More if most < LONGEST => return None,
                Taken::More => {
                    buffer.drain(..most);
                    return Some(Err(Garbled::new(format!("{LONGEST} bytes without an end of a frame"))));
                }
                Taken::Bad(length, garbled) => {
                    buffer.drain(..length.clamp(1, buffer.len()));
                    return Some(Err(garbled));
                }
                Taken::Whole(length, whole) => {
                    buffer.drain(..length);
                    if is_bare && self.frames.carries == Carries::Text && whole.data.trim_ascii().is_empty() {
                        continue;
                    }
                    return Some(Ok(whole));
                }
            }
        }
    }

    fn first(&self, way: Way, buffer: &[u8]) -> Taken {
        let layout = self.layout(way);
        let head = layout.iter().position(|p| *p == Part::Data).unwrap_or_default();
        let begins: usize = layout[..head].iter().map(|p| self.width(way, p)).sum();
        // A frame that has not begun as one does is none, however much is still to come.
        let known = self.places(way, &layout[..head], 0);
        for (part, place) in layout[..head].iter().zip(&known) {
            if let Part::Fixed(fixed) = part
                && let Some(is) = buffer.get(place.start..place.end.min(buffer.len()))
                && !fixed.starts_with(is)
            {
                return Taken::Bad(1, Garbled::new(format!("`{}` does not start a frame", shown(&buffer[..1]))));
            }
        }
        if buffer.len() < begins {
            return Taken::More;
        }
        if let Some(last) = self.end_of_line(layout) {
            let Some(end) = buffer[begins..].iter().position(|b| *b == last) else { return Taken::More };
            let length = begins + end + 1;
            let data = buffer[begins..length].to_vec();
            return Taken::Whole(length, Whole { data, address: None, number: None });
        }
        let size = match self.size(way, &buffer[..begins], &buffer[begins..], &known) {
            Ok(Some(size)) => size,
            Ok(None) => return Taken::More,
            Err(why) => return Taken::Bad(1, why),
        };
        let places = self.places(way, layout, size);
        let length = places.last().map_or(0, |p| p.end);
        if length > LONGEST {
            return Taken::Bad(1, Garbled::new(format!("a frame of {length} bytes")));
        }
        let Some(frame) = buffer.get(..length) else { return Taken::More };
        match self.judged(layout, &places, frame) {
            Ok(whole) => Taken::Whole(length, whole),
            Err(why) => Taken::Bad(length, why),
        }
    }

    /// The last byte of a line end that a text alone has around it: what comes before it are blanks around the text.
    fn end_of_line(&self, layout: &[Part]) -> Option<u8> {
        match (self.frames.carries, layout) {
            (Carries::Text, [Part::Data, Part::Fixed(mark)]) if mark.iter().all(|b| b" \t\r\n".contains(b)) => {
                mark.last().copied()
            }
            _ => None,
        }
    }

    /// How long the message of a frame is that begins with `head`; nothing while that is not known.
    fn size(&self, way: Way, head: &[u8], rest: &[u8], places: &[Range<usize>]) -> Result<Option<usize>, Garbled> {
        let layout = self.layout(way);
        let length = layout.iter().zip(places).find_map(|(part, place)| match part {
            Part::Length(form) => Some((form, place)),
            _ => None,
        });
        if let Some((form, place)) = length {
            let is = read(form, &head[place.clone()]);
            let is = is.ok_or_else(|| Garbled::new(format!("`{}` is not a length", shown(&head[place.clone()]))))?;
            let without = self.counted(layout, &self.places(way, layout, 0)).unwrap_or_default();
            let size = is as i64 - without;
            return match usize::try_from(size) {
                Ok(size) if size <= LONGEST => Ok(Some(size)),
                _ => Err(Garbled::new(format!("a frame cannot have the length {is}"))),
            };
        }
        let at = layout.iter().position(|p| *p == Part::Data).unwrap_or_default();
        if self.frames.carries == Carries::Modbus {
            let size = match way {
                Way::Request => modbus::size_of_request(rest),
                Way::Reply => modbus::size_of_answer(rest),
            };
            return size;
        }
        let (before, mark) = match &layout[at + 1..] {
            [Part::Fixed(mark), ..] => (0, mark),
            [check, Part::Fixed(mark), ..] => (self.width(way, check), mark),
            _ => return Err(Garbled::new("the end of a message is undefined")),
        };
        let Some(end) = rest.windows(mark.len()).position(|w| w == mark) else { return Ok(None) };
        let size = end.checked_sub(before);
        size.map(Some).ok_or_else(|| Garbled::new("a frame ends before its checksum"))
    }

    /// What a whole frame says, if it is one.
    fn judged(&self, layout: &[Part], places: &[Range<usize>], frame: &[u8]) -> Result<Whole, Garbled> {
        let (mut data, mut address, mut number) = (Vec::new(), None, None);
        for (part, place) in layout.iter().zip(places) {
            let is = &frame[place.clone()];
            match part {
                Part::Fixed(fixed) if fixed != is => {
                    let why = format!("`{}` of `{}` is not `{}`", shown(is), shown(frame), shown(fixed));
                    return Err(Garbled::new(why));
                }
                Part::Fixed(_) | Part::Length(_) | Part::Check(_) => {}
                Part::Data => data = is.to_vec(),
                Part::Address(_) => address = Some(is.to_vec()),
                Part::Number(form) => {
                    let read =
                        read(form, is).ok_or_else(|| Garbled::new(format!("`{}` is not a number", shown(is))))?;
                    number = Some(read as u64);
                }
            }
        }
        if let Ok(Some((place, check))) = self.check(layout, places, frame)
            && !self.is_same(layout, &check, &frame[place.clone()])
        {
            let (is, right) = (shown(&frame[place]), shown(&check));
            return Err(Garbled::new(format!("the checksum of `{}` is `{is}`, not `{right}`", shown(frame))));
        }
        Ok(Whole { data, address, number })
    }

    /// Whether these are the same checksum: hexadecimal digits may be of either case.
    fn is_same(&self, layout: &[Part], right: &[u8], is: &[u8]) -> bool {
        let form = layout.iter().find_map(|p| match p {
            Part::Check(form) => Some(form),
            _ => None,
        });
        form.is_some_and(|form| read(form, is).is_some() && read(form, is) == read(form, right))
    }
}

/// An address as it stands in frames of this layout; none where they have none.
fn written(frames: &Frames, layout: &[Part], address: Option<&str>) -> Result<Option<Vec<u8>>, String> {
    let form = layout.iter().find_map(|p| match p {
        Part::Address(form) => Some(form.as_ref()),
        _ => None,
    });
    let (form, text) = match (form, address) {
        (None, _) => return Ok(None),
        (Some(_), None) => return Err(format!("the framing `{}` has an address", frames.name)),
        (Some(form), Some(text)) => (form, text),
    };
    let written = match form {
        None => text.to_owned(),
        Some(form) => {
            let number = text.parse::<f64>().map_err(|_| format!("`{text}` is not a number"))?;
            form.write(number).map_err(|why| format!("`{text}` is not an address here: {why}"))?
        }
    };
    bytes(&written)
        .filter(|a| (1..=LONGEST).contains(&a.len()))
        .map(Some)
        .ok_or_else(|| "an address needs some bytes".to_owned())
}

/// A number as often as its form comes round again.
fn wrapped(number: u64, form: Option<&Form>) -> u64 {
    match form.map(Form::most) {
        Some(most) if most < 9e15 => number % (most as u64 + 1),
        _ => number,
    }
}

fn read(form: &Form, bytes: &[u8]) -> Option<f64> {
    let text: String = bytes.iter().map(|b| char::from(*b)).collect();
    let Read { number, length, .. } = form.read(&text)?;
    (length == text.len() && number >= 0.0).then_some(number)
}

/// The bytes that a text of characters up to U+00FF stands for.
pub(super) fn bytes(text: &str) -> Option<Vec<u8>> {
    text.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect()
}

/// A message as a text: printable, without the blanks around it, or a character for each byte.
fn text(data: &[u8], carries: Carries) -> Result<String, Garbled> {
    if carries != Carries::Text {
        return Ok(data.iter().map(|b| char::from(*b)).collect());
    }
    let data = data.trim_ascii();
    let good = data.iter().all(|b| (0x20..0x7f).contains(b) || *b == b'\t');
    let text = std::str::from_utf8(data).ok().filter(|_| good);
    text.map(str::to_owned).ok_or_else(|| Garbled::new(format!("`{}` is not text", shown(data))))
}
