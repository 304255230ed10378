//! Pieces of JSON schemas.

use serde_json::{Map, Value, json};

/// A number; the description says its unit.
pub(super) fn number(description: &str) -> Value {
    json!({ "type": "number", "description": description })
}

/// A whole number from 0 on.
pub(super) fn count(description: &str) -> Value {
    json!({ "type": "integer", "minimum": 0, "description": description })
}

/// A text.
pub(super) fn text(description: &str) -> Value {
    json!({ "type": "string", "description": description })
}

/// A truth value.
pub(super) fn truth(description: &str) -> Value {
    json!({ "type": "boolean", "description": description })
}

/// A list of equal items.
pub(super) fn list(items: Value) -> Value {
    json!({ "type": "array", "items": items })
}

/// A number or nothing.
pub(super) fn optional(mut schema: Value) -> Value {
    let kind = schema["type"].take();
    schema["type"] = json!([kind, "null"]);
    schema
}

/// An object whose fields are all present.
pub(super) fn object<K: Into<String>>(title: &str, fields: impl IntoIterator<Item = (K, Value)>) -> Value {
    let properties: Map<String, Value> = fields.into_iter().map(|(k, v)| (k.into(), v)).collect();
    let required: Vec<&String> = properties.keys().collect();
    json!({ "title": title, "type": "object", "required": required, "properties": properties })
}

/// An object that has some of its fields in each message, those that have something to say.
pub(super) fn open<K: Into<String>>(title: &str, fields: impl IntoIterator<Item = (K, Value)>) -> Value {
    let properties: Map<String, Value> = fields.into_iter().map(|(k, v)| (k.into(), v)).collect();
    json!({ "title": title, "type": "object", "properties": properties })
}
