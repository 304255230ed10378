//! Messages whose fields are known only in a run: all of them hold messages.

use prost::DecodeError;
use prost::bytes::{Buf, BufMut};
use prost::encoding::{DecodeContext, WireType, bytes, skip_field};

/// Fields in the order in which they came.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Raw {
    /// Number and bytes.
    pub fields: Vec<(u32, Vec<u8>)>,
}

impl Raw {
    /// All fields of a number.
    pub fn all(&self, number: u32) -> impl Iterator<Item = &[u8]> {
        self.fields.iter().filter(move |(n, _)| *n == number).map(|(_, bytes)| bytes.as_slice())
    }
}

impl prost::Message for Raw {
    fn encode_raw(&self, buffer: &mut impl BufMut) {
        for (number, value) in &self.fields {
            bytes::encode(*number, value, buffer);
        }
    }

    fn merge_field(
        &mut self,
        number: u32,
        wire: WireType,
        buffer: &mut impl Buf,
        context: DecodeContext,
    ) -> Result<(), DecodeError> {
        if wire != WireType::LengthDelimited {
            return skip_field(wire, number, buffer, context);
        }
        let mut value = Vec::new();
        bytes::merge(wire, &mut value, buffer, context)?;
        self.fields.push((number, value));
        Ok(())
    }

    fn encoded_len(&self) -> usize {
        self.fields.iter().map(|(number, value)| bytes::encoded_len(*number, value)).sum()
    }

    fn clear(&mut self) {
        self.fields.clear();
    }
}
