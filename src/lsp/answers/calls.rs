//! Who calls a skill or a command, and what it calls.

use std::sync::Arc;

use lsp_types::{
    CallHierarchyIncomingCall, CallHierarchyIncomingCallsParams, CallHierarchyItem, CallHierarchyOutgoingCall,
    CallHierarchyOutgoingCallsParams, CallHierarchyPrepareParams, Range,
};
use matterix_editor::Index;
use matterix_editor::calls::Calls;
use matterix_editor::index::DefId;
use serde_json::json;

use super::complete::key;
use super::names::symbol_kind;
use super::places::{Named, around, locate, open};
use crate::lsp::server::Server;

/// What stands under a position, if it calls or is called.
pub fn prepare(server: &mut Server, params: CallHierarchyPrepareParams) -> Option<Vec<CallHierarchyItem>> {
    let at = params.text_document_position_params;
    let named = Named::of(server, &at.text_document.uri)?;
    let def = named.index.caller_at(named.file, named.offset(at.position))?;
    Some(vec![item(server, &named.index, def)?])
}

/// Who calls it.
pub fn incoming(
    server: &mut Server,
    params: CallHierarchyIncomingCallsParams,
) -> Option<Vec<CallHierarchyIncomingCall>> {
    let key = params.item.data.as_ref().and_then(key)?;
    let mut out: Vec<CallHierarchyIncomingCall> = Vec::new();
    for index in around(server, &key, &params.item.name) {
        let Some(def) = index.find(&key) else { continue };
        for calls in index.incoming(def) {
            let Some(from) = item(server, &index, calls.def) else { continue };
            let ranges = ranges(server, &index, &calls);
            match out.iter_mut().find(|o| o.from.data == from.data) {
                Some(known) => known
                    .from_ranges
                    .extend(ranges.into_iter().filter(|r| !known.from_ranges.contains(r)).collect::<Vec<_>>()),
                None => out.push(CallHierarchyIncomingCall { from, from_ranges: ranges }),
            }
        }
    }
    Some(out)
}

/// What it calls.
pub fn outgoing(
    server: &mut Server,
    params: CallHierarchyOutgoingCallsParams,
) -> Option<Vec<CallHierarchyOutgoingCall>> {
    let key = params.item.data.as_ref().and_then(key)?;
    let (index, def): (Arc<Index>, DefId) = open(server).into_iter().find_map(|i| Some((i.clone(), i.find(&key)?)))?;
    let to = |calls: Calls| {
        let from_ranges = ranges(server, &index, &calls);
        Some(CallHierarchyOutgoingCall { to: item(server, &index, calls.def)?, from_ranges })
    };
    Some(index.outgoing(def).into_iter().filter_map(to).collect())
}

fn ranges(server: &Server, index: &Index, calls: &Calls) -> Vec<Range> {
    calls.places.iter().filter_map(|s| locate(server, index, *s)).map(|l| l.range).collect()
}

fn item(server: &Server, index: &Index, def: DefId) -> Option<CallHierarchyItem> {
    let d = index.def(def);
    let whole = locate(server, index, d.whole)?;
    let name = locate(server, index, d.span)?;
    let key = index.key(def);
    Some(CallHierarchyItem {
        name: d.name.clone(),
        kind: symbol_kind(d.kind),
        tags: None,
        detail: d.owner.map(|o| index.def(o).name.clone()),
        uri: whole.uri,
        range: whole.range,
        selection_range: name.range,
        data: Some(json!([key.file, key.start, key.end])),
    })
}
