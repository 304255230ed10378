//! Drivers over the line of another driver: `driver PipetteCommands for Pipette over RobotServer`. Such a driver is there for
//! what is part of the other's device, or stands on that.

use matterix_ir::scene::InstanceId;
use matterix_ir::wire::Host;

use super::transport::Line;
use crate::ast::{Arg, ItemKind, Name, Wire};
use crate::lower::Planner;
use crate::names::DeclId;

/// The driver over whose line another one speaks.
#[derive(Clone, Copy)]
pub(super) struct Under<'a> {
    pub id: DeclId,
    pub wires: &'a [Wire],
}

impl<'a> Planner<'a, '_> {
    /// The driver that a name means, where it stands after `over`.
    pub(super) fn under(&self, transport: &Name, module: usize) -> Option<Under<'a>> {
        let id = self.lab.tables.names.lookup(module, &transport.text)?;
        match &self.lab.tables.names.decl(id).item.kind {
            ItemKind::Driver { wires, .. } => Some(Under { id, wires }),
            _ => None,
        }
    }

    /// The line of that driver, which has one of its own.
    pub(super) fn line_of(&mut self, under: Under<'a>, transport: &'a Name, args: &'a [Arg]) -> Option<Line> {
        let decl = self.lab.tables.names.decl(under.id);
        let ItemKind::Driver { name, transport: of, args: given, .. } = &decl.item.kind else { return None };
        if let Some(arg) = args.first() {
            let at = arg.name.as_ref().map_or(arg.value.span, |n| n.span);
            let help = format!("the line belongs to `{}`", name.text);
            self.wrong(
                at,
                "a driver over the line of another driver cannot have settings of the line",
                "not allowed here",
                &help,
            );
            return None;
        }
        if self.under(of, decl.module).is_some() {
            let headline = format!("`{}` has no line itself", name.text);
            self.wrong(
                transport.span,
                &headline,
                "it uses the line of another driver",
                &format!("write `over {}`", of.text),
            );
            return None;
        }
        self.transport(of, given, name.span, decl.module)
    }

    /// The device of that driver which an instance is part of or stands on; none where it is elsewhere.
    pub(super) fn host(&mut self, under: Under<'a>, instance: InstanceId) -> Option<Host> {
        let decl = self.lab.tables.names.decl(under.id);
        let ItemKind::Driver { name, device, .. } = &decl.item.kind else { return None };
        let kind = self.lab.kind_named(device, decl.module)?;
        let found = self.whole_of(instance).into_iter().skip(1).find(|i| self.lab.instance_is(*i, kind))?;
        Some(Host { instance: found, driver: name.text.clone() })
    }

    /// An instance, then what it is part of or was placed on, and so on.
    fn whole_of(&self, instance: InstanceId) -> Vec<InstanceId> {
        let next = |id: &InstanceId| {
            let i = &self.lab.instances[id.0 as usize];
            i.owner.or_else(|| i.placed.first().map(|(_, on)| *on))
        };
        // Nothing stands on itself; a text that says so ends here.
        std::iter::successors(Some(instance), next).take(self.lab.instances.len()).collect()
    }

    /// Whether a device over the line of another can reach a thing: it belongs to the other, and is no part of itself.
    pub(super) fn reaches(&self, host: InstanceId, device: InstanceId, thing: InstanceId) -> bool {
        let whole = self.whole_of(thing);
        whole.contains(&host) && !whole.contains(&device)
    }
}
