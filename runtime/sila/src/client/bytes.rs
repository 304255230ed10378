//! Long bytes, sent before the call that needs them and fetched after the one that answered with them.

use http::uri::PathAndQuery;
use tonic::Request;

use super::Client;
use crate::binary::{Come, Create, LONGEST, Name, Part, Size, WHOLE, Wanted, failure};
use crate::call::Failure;
use crate::raw::Raw;
use crate::value::Value;

const CREATE: &str = "/sila2.org.silastandard.BinaryUpload/CreateBinary";
const PUT: &str = "/sila2.org.silastandard.BinaryUpload/UploadChunk";
const INFO: &str = "/sila2.org.silastandard.BinaryDownload/GetBinaryInfo";
const GET: &str = "/sila2.org.silastandard.BinaryDownload/GetChunk";
const DELETE: &str = "/sila2.org.silastandard.BinaryDownload/DeleteBinary";

impl Client {
    /// The value with its long bytes at the server; `parameter` is the full identifier of what it is given for.
    pub(super) fn sent(&mut self, value: &Value, parameter: &str) -> Result<Value, Failure> {
        Ok(match value {
            Value::Bytes(bytes) if bytes.len() > WHOLE => Value::Kept(self.upload(bytes, parameter)?),
            Value::List(all) => Value::List(all.iter().map(|v| self.sent(v, parameter)).collect::<Result<_, _>>()?),
            Value::Structure(parts) => {
                let part = |(name, v): &(String, Value)| Ok((name.clone(), self.sent(v, parameter)?));
                Value::Structure(parts.iter().map(part).collect::<Result<_, Failure>>()?)
            }
            other => other.clone(),
        })
    }

    /// The value with the bytes that the server keeps of it.
    pub(super) fn fetched(&mut self, value: Value) -> Result<Value, Failure> {
        Ok(match value {
            Value::Kept(uuid) => Value::Bytes(self.download(&uuid)?),
            Value::List(all) => Value::List(all.into_iter().map(|v| self.fetched(v)).collect::<Result<_, _>>()?),
            Value::Structure(parts) => {
                let part = |(name, v)| Ok((name, self.fetched(v)?));
                Value::Structure(parts.into_iter().map(part).collect::<Result<_, Failure>>()?)
            }
            other => other,
        })
    }

    fn upload(&mut self, bytes: &[u8], parameter: &str) -> Result<String, Failure> {
        let parts = bytes.len().div_ceil(WHOLE);
        let size = bytes.len() as u64;
        let count = u32::try_from(parts).ok().filter(|_| size <= LONGEST);
        let count = count.ok_or_else(|| Failure::Garbled(format!("{size} bytes are too many to send")))?;
        let create = Create { size, parts: count, parameter: parameter.to_owned() };
        let mut request = Request::new(create);
        // The parameter's command is what the call is for.
        let command = parameter.rsplit_once("/Parameter/").map_or(parameter, |(command, _)| command);
        self.beside.iter().for_each(|b| _ = b.add(command, request.metadata_mut()));
        let created: Name = self.asked(PathAndQuery::from_static(CREATE), request, failure)?;
        let uuid = created.uuid;
        let part = |(index, bytes): (u32, &[u8])| Part { uuid: uuid.clone(), index, bytes: bytes.to_vec() };
        let all: Vec<Part> = (0..).zip(bytes.chunks(WHOLE)).map(part).collect();
        let heard: Vec<Name> = self.exchanged(PUT, all)?;
        match heard.len() == parts {
            true => Ok(uuid),
            false => Err(Failure::Garbled(format!("it accepted {} of {parts} parts of the bytes", heard.len()))),
        }
    }

    fn download(&mut self, uuid: &str) -> Result<Vec<u8>, Failure> {
        let name = || Name { uuid: uuid.to_owned() };
        let info: Size = self.asked(PathAndQuery::from_static(INFO), Request::new(name()), failure)?;
        if info.size > LONGEST {
            return Err(Failure::Garbled(format!("it replied with {} bytes, more than the limit", info.size)));
        }
        let offsets = (0..info.size).step_by(WHOLE);
        let wanted = |offset: u64| {
            let length = (info.size - offset).min(WHOLE as u64) as u32;
            Wanted { uuid: uuid.to_owned(), offset, length }
        };
        let all: Vec<Wanted> = offsets.map(wanted).collect();
        let mut come: Vec<Come> = self.exchanged(GET, all)?;
        come.sort_by_key(|part| part.offset);
        let mut bytes = Vec::new();
        for part in come {
            if part.offset != bytes.len() as u64 {
                return Err(Failure::Garbled("parts of its reply are missing".to_owned()));
            }
            bytes.extend(part.bytes);
        }
        if bytes.len() as u64 != info.size {
            let (size, len) = (info.size, bytes.len());
            return Err(Failure::Garbled(format!("only {len} of the {size} bytes of its reply arrived")));
        }
        // It lets go of them by itself too.
        let _ = self.asked::<Name, Raw>(PathAndQuery::from_static(DELETE), Request::new(name()), failure);
        Ok(bytes)
    }
}
