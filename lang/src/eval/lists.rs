//! Functions of lists: an element by a number known only when running, the ways from one list to another.

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Span, codes};

use super::{Decided, Value};
use crate::eval::lab::Elaborator;

impl Elaborator<'_> {
    /// The n-th of a list of instances, counted from 1; `nothing` beyond its ends.
    pub fn nth(&mut self, items: &[Value], n: NodeId, at: Span) -> Value {
        let instances: Option<Vec<InstanceId>> = items
            .iter()
            .map(|i| match i {
                Value::Instance(id) => Some(*id),
                _ => None,
            })
            .collect();
        let number = match self.before_run(n) {
            Decided::Now(number) => Some(number),
            Decided::Later if self.prototype => self.known(n),
            Decided::Later => return Value::Error,
            Decided::ByRun => None,
        };
        if let Some(number) = number.filter(|number| *number >= 1.0 && number.fract() == 0.0)
            && let Some(item) = items.get(number as usize - 1)
        {
            return item.clone();
        }
        let Some(instances) = instances else {
            return self.expected("a list of instances", &Value::List(items.to_vec()), at);
        };
        let mut found = self.graph.number(-1.0);
        for (index, id) in instances.iter().enumerate().rev() {
            let (number, value) = (self.graph.number(index as f64 + 1.0), self.graph.number(f64::from(id.0)));
            let here = self.graph.binary(BinaryOp::Eq, n, number);
            found = self.graph.select(here, value, found);
        }
        self.picks.insert(found, instances);
        Value::InstanceNode(found)
    }

    /// The ways of a distribution: one goes to each, each to its counterpart, or all to one.
    pub fn paired(&mut self, from: &[Value], to: &[Value], at: Span) -> Value {
        let pair = |(a, b): (&Value, &Value)| Value::Tuple(vec![a.clone(), b.clone()]);
        match (from, to) {
            ([one], many) => Value::List(many.iter().map(|b| pair((one, b))).collect()),
            (many, [one]) => Value::List(many.iter().map(|a| pair((a, one))).collect()),
            (a, b) if a.len() == b.len() => Value::List(a.iter().zip(b).map(pair).collect()),
            (a, b) => {
                let at = self.calls.first().copied().unwrap_or(at);
                self.report(
                    Diagnostic::error(
                        codes::WRONG_ARGUMENTS,
                        at,
                        format!("{} sources cannot go to {} targets one by one", a.len(), b.len()),
                        "the counts differ",
                    )
                    .help("one goes to many, many to as many, or many to one"),
                );
                Value::Error
            }
        }
    }

    /// A list in groups of a whole number of elements; the last may have fewer.
    pub fn grouped(&mut self, items: &[Value], n: NodeId, at: Span) -> Value {
        match self.count_before_run(n, "the size of a group", at) {
            Ok(Some(size)) => Value::List(items.chunks(size).map(|group| Value::List(group.to_vec())).collect()),
            Ok(None) => Value::List(vec![Value::List(items.to_vec())]),
            Err(()) => Value::Error,
        }
    }

    /// A list with each of its elements a whole number of times.
    pub fn spread(&mut self, items: &[Value], n: NodeId, at: Span) -> Value {
        match self.count_before_run(n, "the number of times", at) {
            Ok(times) => {
                let each = |item: &Value| std::iter::repeat_n(item.clone(), times.unwrap_or(1)).collect::<Vec<_>>();
                Value::List(items.iter().flat_map(each).collect())
            }
            Err(()) => Value::Error,
        }
    }

    /// The first of each group of a whole number of elements.
    pub fn firsts(&mut self, items: &[Value], n: NodeId, at: Span) -> Value {
        match self.count_before_run(n, "the size of a group", at) {
            Ok(size) => Value::List(items.iter().step_by(size.unwrap_or(1)).cloned().collect()),
            Err(()) => Value::Error,
        }
    }

    /// A whole number from 1 that is known before the run; none in a prototype where it is known only later. What it is not is reported.
    fn count_before_run(&mut self, n: NodeId, what: &str, at: Span) -> Result<Option<usize>, ()> {
        match self.number_before_run(n, what, at) {
            Decided::Now(size) if size >= 1.0 && size.fract() == 0.0 => Ok(Some(size as usize)),
            Decided::Now(_) => {
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    at,
                    format!("{what} must be a whole number from 1"),
                    "not such a number",
                ));
                Err(())
            }
            Decided::Later if self.prototype => Ok(None),
            Decided::Later | Decided::ByRun => Err(()),
        }
    }

    /// How far right, back and up one part of a thing is from another, m; infinitely far for parts of different things,
    /// which can be moved.
    pub fn displacement(&mut self, from: InstanceId, to: InstanceId) -> Value {
        let (a, b) = (&self.instances[from.0 as usize], &self.instances[to.0 as usize]);
        let together = a.owner.is_some() && a.owner == b.owner;
        let (a, b) = (a.pose.position, b.pose.position);
        let length = self.tables.units.named("Length");
        let far = |axis: usize| if together { b[axis] - a[axis] } else { f64::INFINITY };
        Value::Tuple((0..3).map(|axis| self.number(far(axis), length.clone(), false)).collect())
    }

    /// How far right, back and up one frame of a thing is from another, in the axes of the thing, m; infinitely far for frames of different
    /// things, and for those of parts that move apart.
    pub fn between_frames(&mut self, (a, from): (InstanceId, &str), (b, to): (InstanceId, &str)) -> Value {
        let frames = self.geometry(a).frames;
        let place = |name: &str| frames.iter().find(|f| f.name == name && !f.stand);
        let known = place(from).zip(place(to)).filter(|(from, to)| a == b && from.link == to.link);
        let (from, to) = known.map(|(from, to)| (from.pose.position, to.pose.position)).unzip();
        let length = self.tables.units.named("Length");
        let far = |axis: usize| from.zip(to).map_or(f64::INFINITY, |(from, to)| to[axis] - from[axis]);
        Value::Tuple((0..3).map(|axis| self.number(far(axis), length.clone(), false)).collect())
    }

    /// An element of a list in words, where it has a name.
    pub fn spoken(&self, value: &Value) -> Option<String> {
        match value {
            Value::Instance(id) => Some(self.instances[id.0 as usize].name.clone()),
            Value::List(items) => match items.as_slice() {
                [] => None,
                [one] => self.spoken(one),
                [first, .., last] => Some(format!("{} .. {}", self.spoken(first)?, self.spoken(last)?)),
            },
            Value::Place(place) => Some(place.text.clone()),
            Value::Row(table, row) => self.row_name(*table, *row),
            Value::Tuple(items) if !items.is_empty() => {
                let names: Option<Vec<String>> = items.iter().map(|i| self.spoken(i)).collect();
                names.map(|names| format!("({})", names.join(", ")))
            }
            _ => None,
        }
    }
}
