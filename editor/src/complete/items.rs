//! What can be written outside blocks of steps: items, and the lines of labs, assets and capabilities.

use matterix_lang::semantic_index::Sort;

use super::context::{Context, unnamed};
use super::values::{Place, Wanted};
use super::{Completion, Offer, Offers};
use crate::index::{DefId, Kind};

/// Items with places to fill.
const ITEMS: &[(&str, &str)] = &[
    ("use", "use $0"),
    ("species", "species ${1:name} { formula: \"${2:H2O}\", density: ${3:1 g/mL}, heat_capacity: ${4:75 J/(mol*K)} }"),
    ("solution", "solution ${1:name} { ${2:NaCl}: ${3:1 g}, water: ${4:99 g} }"),
    ("equilibrium", "equilibrium ${1:name}: ${2:HA} <-> ${3:H+ + A-} { pka: ${4:4.76} }"),
    ("interaction", "interaction ${1:name}: ${2:Na+ + Cl-} { b0: ${3:0.0765}, b1: ${4:0.2664}, c0: ${5:0.0013} }"),
    ("reaction", "reaction ${1:name}: ${2:A} -> ${3:B} {\n    rate: ${4:0.01 1/s}, order: { ${2:A}: 1 }\n}"),
    ("reactive_group", "reactive_group ${1:name} { title: \"$2\", members: { ${3:species}: any }, source: \"$4\" }"),
    ("material", "material ${1:name} { source: \"$0\" }"),
    ("incompatible", "incompatible ${1:a} with ${2:b} { consequence: [${3:heat}], source: \"$4\" }"),
    ("allow", "allow ${1:caution} \"${2:why}\""),
    ("allow incompatible", "allow incompatible ${1:a} with ${2:b} \"${3:why}\""),
    ("capability", "capability ${1:Name}: ${2:Body} {\n    $0\n}"),
    ("asset", "asset ${1:Name}: ${2:Body} { mass: ${3:1 kg}$0 }"),
    ("process", "process ${1:name}(${2:a}: ${3:Body}) while ${4:condition} {\n    $0\n}"),
    ("event", "event ${1:name}(${2:a}: ${3:Body}) when ${4:condition} { $0 }"),
    ("hazard", "hazard ${1:name}(${2:a}: ${3:Body}) when ${4:condition} \"${5:how to avoid it}\""),
    ("caution", "caution ${1:name}(${2:a}: ${3:Body}) when ${4:condition} \"${5:how to avoid it}\""),
    ("relation", "relation ${1:name}(${2:a}: ${3:Body}, ${4:b}: ${3:Body}) = $0"),
    ("fn", "fn ${1:name}(${2:x}: ${3:Ratio}) = $0"),
    ("const", "const ${1:name} = $0"),
    ("table", "table ${1:plan} from csv \"${2:plan.csv}\" {\n    well: Place, ${3:volume: Volume as uL}\n}"),
    ("lab", "lab ${1:bench} {\n    ambient: ${2:22 degC}\n    $0\n}"),
    ("framing", "framing ${1:name} { carries: ${2:text}, frame: \"$0{data}\\r\" }"),
    ("driver", "driver ${1:Name} for ${2:Asset} over ${3:serial}(${4:baud: 9600}) {\n    $0\n}"),
    ("skill", "skill ${1:verb}(${2:item}: ${3:Body}) ${4:to}(${5:target}: ${6:Surface}) {\n    $0\n}"),
    ("workflow", "workflow ${1:name} in ${2:bench} {\n    $0\n}"),
    ("test", "test ${1:name} {\n    run ${2:workflow}\n    expect $0\n}"),
    (
        "study",
        "study ${1:name} of ${2:workflow} {\n    vary ${3:parameter} in ${4:range}\n    runs ${5:100}\n    report ${6:value} = $0\n}",
    ),
    (
        "fit",
        "fit ${1:name} of ${2:workflow} {\n    data \"${3:data.csv}\"\n    estimate ${4:parameter} in ${5:range}\n    match ${6:value} with \"${7:column}\" noise $0\n}",
    ),
    ("dimension", "dimension ${1:Name} = $0"),
    ("unit", "unit ${1:name}: ${2:Volume} = $0"),
];

/// Members of a capability.
const MEMBERS: &[(&str, &str)] = &[
    ("param", "param ${1:name}: ${2:Type}"),
    ("state", "state ${1:name}: ${2:Type} = $0"),
    ("derived", "derived ${1:name}: ${2:Type} = $0"),
    ("reading", "reading ${1:name}: ${2:Type} = $0"),
    ("flow", "flow ${1:name}: ${2:Type}"),
    ("extensive", "extensive ${1:name}: ${2:Type} = $0"),
    ("part", "part ${1:name}: ${2:Type}"),
    ("view", "view[${1:s}: Species]: ${2:Type} = $0"),
    ("command", "command ${1:verb} to(${2:x}: ${3:Type})\n    effect $0"),
    ("process", "process ${1:name} while ${2:condition} {\n    $0\n}"),
    ("event", "event ${1:name} when ${2:condition} { $0 }"),
    ("keeps", "keeps ${1:condition} else ${2:failure} \"${3:help}\""),
    ("ends", "ends ${1:condition} else ${2:failure} \"${3:help}\""),
    ("frame", "frame ${1:name}"),
];

/// Lines of an asset beside its fields.
const LINES: &[(&str, &str)] = &[
    ("frame", "frame ${1:name} at ${2:(0, 0, 0) mm}"),
    ("solid", "solid ${1:box(10 mm, 10 mm, 10 mm)} at ${2:(0, 0, 0) mm}"),
    ("joint", "joint ${1:name} turns ${2:(0, 0, 1)} at ${3:(0, 0, 0) mm} by $0"),
];

/// Fields of geometry that every asset may have.
const GEOMETRY: &[&str] = &["shape", "room", "inside", "mesh", "collision", "inertia"];

/// Clauses of a skill or command.
const CLAUSES: &[&str] = &[
    "needs", "presumes", "warns", "while", "fails", "effect", "takes", "until", "option", "says", "moves", "grips",
    "frees", "leads",
];

/// Lines of a study or a fit.
const MANY: &[(&str, &str)] = &[
    ("vary", "vary ${1:parameter} in ${2:range}"),
    ("runs", "runs ${1:100}"),
    ("report", "report ${1:name} = $0"),
    ("data", "data \"${1:file.csv}\""),
    ("estimate", "estimate ${1:parameter} in ${2:range}"),
    ("match", "match ${1:value} with \"${2:column}\" noise $0"),
];

/// Fields by the word of their item.
const FIELDS: &[(&str, &[&str])] = &[
    ("species", &["formula", "smiles", "reactive_groups", "same_as", "dissolves", "by"]),
    ("reaction", &["rate", "order", "valid", "enthalpy", "template", "requires", "reverse", "reverse_order"]),
    ("interaction", &["b0", "b1", "b2", "c0", "reach", "theta", "lambda", "psi", "zeta", "source"]),
    (
        "equilibrium",
        &["constant", "log_constant", "pka", "ksp", "pksp", "analytic", "at", "enthalpy", "heat", "valid", "source"],
    ),
    ("reactive_group", &["title", "smarts", "unless", "members", "above", "source"]),
    ("material", &["title", "friction", "source"]),
    ("framing", &["carries", "frame", "request", "reply", "length", "check", "silence"]),
    ("incompatible", &["consequence", "above", "phase", "source"]),
];

/// Words that begin a block of steps.
const BLOCKS: &[&str] = &[
    "workflow", "skill", "extern", "test", "step", "sequence", "parallel", "try", "else", "if", "repeat", "for",
    "within", "keep", "claim", "start", "on", "finally", "wait", "hold", "}",
];

impl Place<'_> {
    /// Outside all braces.
    pub(crate) fn top(&self, context: &Context<'_>, out: &mut Offers) {
        let Some(first) = context.before.first() else {
            ITEMS.iter().for_each(|(word, text)| self.keyword(word, text, 10, out));
            return;
        };
        let last = context.last().unwrap_or_default();
        let tokens = &context.before;
        let in_brackets = context.open.last().is_some_and(|o| o.bracket == '(');
        match first.text {
            "workflow" | "test" if last == "in" => self.globals(&[Kind::Lab], 5, out),
            "study" | "fit" if last == "of" => self.globals(&[Kind::Workflow], 5, out),
            "driver" if last == "for" => self.globals(&[Kind::Asset, Kind::Capability], 5, out),
            "driver" if last == "over" => {
                ["serial", "tcp", "http"].iter().for_each(|w| self.keyword(w, &format!("{w}($0)"), 5, out));
                self.globals(&[Kind::Driver], 10, out);
            }
            "asset" | "capability" if matches!(last, ":" | ",") => {
                self.globals(&[Kind::Capability, Kind::Asset], 5, out)
            }
            "reaction" | "equilibrium" | "interaction" | "solution" | "incompatible" | "allow"
                if matches!(last, ":" | "+" | "->" | "<->" | "of" | "with" | "incompatible") =>
            {
                self.globals(&[Kind::Species, Kind::Group, Kind::Material], 5, out);
            }
            "skill" | "extern" if !in_brackets && tokens.iter().any(|t| t.text == "(") => {
                self.clause(context, out);
            }
            _ if in_brackets && last == ":" => self.types(out),
            _ if last == ":" => self.types(out),
            _ if tokens.len() > 1 => self.value_offers(&self.wanted(context), out),
            _ => {}
        }
        if in_brackets && last == ":" && out.all.is_empty() {
            self.types(out);
        }
    }

    /// Inside braces.
    pub(crate) fn inside(&self, context: &Context<'_>, out: &mut Offers) {
        let Some(block) = context.block() else { return };
        let head = block.head.first().map_or("", |t| t.text);
        if head == "use" {
            let path = block.head[1..].iter().map(|t| t.text).collect::<String>();
            return self.module_items(path.trim_end_matches(':'), out);
        }
        let item = context.item();
        let depth = context.open.iter().filter(|o| o.bracket == '{').count();
        let begins = context.before.is_empty() && context.open.last().is_some_and(|o| o.bracket == '{');
        let last = context.last().unwrap_or_default();
        // Types of parameters, in a signature or a declaration.
        let in_signature = context.open.last().is_some_and(|o| {
            o.bracket == '('
                && matches!(context.before.len(), 2..)
                && o.head.first().is_some_and(|t| t.text == "command")
        });
        if last == ":" && (in_signature || (item == "capability" && depth == 1 && context.open.len() == 1)) {
            return self.types(out);
        }
        match (item, head) {
            ("lab", "lab") => return self.lab_line(context, begins, out),
            ("capability", "capability") => {
                if begins {
                    MEMBERS.iter().for_each(|(w, t)| self.keyword(w, t, 10, out));
                    CLAUSES.iter().for_each(|w| self.keyword(w, &format!("{w} "), 20, out));
                } else if context.before.first().is_some_and(|t| t.text == "command") {
                    self.clause(context, out);
                } else {
                    self.value_offers(&self.wanted(context), out);
                }
                return;
            }
            ("study" | "fit", "study" | "fit") if begins => {
                return MANY.iter().for_each(|(w, t)| self.keyword(w, t, 10, out));
            }
            ("process" | "event", _) | (_, "process" | "event") => {
                return if begins { self.law(out) } else { self.value_offers(&self.wanted(context), out) };
            }
            _ => {}
        }
        if let Some((_, fields)) = FIELDS.iter().find(|(word, _)| *word == item)
            && depth == 1
            && begins
        {
            fields.iter().for_each(|f| self.keyword(f, &format!("{f}: "), 10, out));
            if item == "species" {
                self.properties(out);
            }
            return;
        }
        if matches!(
            item,
            "species" | "solution" | "reaction" | "equilibrium" | "interaction" | "reactive_group" | "incompatible"
        ) && begins
        {
            return self.globals(&[Kind::Species, Kind::Solution], 10, out);
        }
        let named = unnamed(&block.head).len() < block.head.len();
        let steps = BLOCKS.contains(&head) && !(head == "start" && self.is_call(&block.head));
        if steps && !named {
            return if begins { self.step(out) } else { self.in_step(context, out) };
        }
        if begins
            && context.is_holding()
            && let Some(thing) = block.head.first()
        {
            return self.places_of(thing.text, out);
        }
        if begins {
            let fields = self.fields(context);
            for field in &fields {
                let d = self.index.def(*field);
                let detail = self.index.sort_words(&d.sort);
                let (label, text) = (d.name.clone(), format!("{}: ", d.name));
                out.all.push(Completion { label, text, kind: Offer::Def(d.kind), detail, def: Some(*field), rank: 5 });
            }
            if item == "asset" && depth == 1 {
                LINES.iter().for_each(|(w, t)| self.keyword(w, t, 12, out));
                GEOMETRY.iter().for_each(|w| self.keyword(w, &format!("{w}: "), 13, out));
            }
            return;
        }
        let wanted = self.wanted(context);
        if matches!(wanted.sort, Some(Sort::Thing(..))) && last == ":" {
            self.assets(wanted.sort.as_ref(), 6, out);
        }
        self.value_offers(&wanted, out);
    }

    /// What the library and files state of species.
    fn properties(&self, out: &mut Offers) {
        for def in self.index.properties() {
            let d = self.index.def(def);
            let (label, text) = (d.name.clone(), format!("{}: ", d.name));
            let detail = self.index.sort_words(&d.sort);
            out.all.push(Completion { label, text, kind: Offer::Def(d.kind), detail, def: Some(def), rank: 10 });
        }
    }

    fn is_call(&self, head: &[super::context::Token<'_>]) -> bool {
        head.iter().position(|t| t.text == "=").is_some_and(|at| self.call(&head[at + 1..]).is_some())
    }

    fn lab_line(&self, context: &Context<'_>, begins: bool, out: &mut Offers) {
        if begins {
            self.keyword("ambient", "ambient: ${1:22 degC}", 10, out);
            self.keyword("include", "include ${1:lab} as ${2:name} at ${3:(0, 0, 0) m}", 12, out);
            self.keyword("between", "between ${1:a} and ${2:b} { $0 }", 12, out);
            self.keyword("thing", "${1:name} = ${2:Asset} at ${3:(0, 0, 0) m}", 11, out);
            return;
        }
        let tokens = &context.before;
        let last = context.last().unwrap_or_default();
        match last {
            "=" => self.assets(None, 5, out),
            "include" => self.globals(&[Kind::Lab], 5, out),
            "on" | "in" | "between" | "and" => {
                self.locals(&|sort, _| matches!(sort, Sort::Thing(..) | Sort::Lab(_)), 5, out);
            }
            "at" | "with" | "holding" | "+" | ":" => self.value_offers(&self.wanted(context), out),
            _ if tokens.get(1).is_some_and(|t| t.text == "=") && !context.is_holding() => {
                ["on", "at", "in", "with", "holding"].iter().for_each(|w| self.keyword(w, &format!("{w} "), 5, out));
                if tokens.len() == 3 {
                    self.keyword("{ }", "{ $0 }", 6, out);
                }
            }
            _ => {
                if context.is_holding() && !context.is_start() {
                    self.keyword("at", "at ", 6, out);
                }
                self.value_offers(&self.wanted(context), out);
            }
        }
    }

    /// Asset types that are what is expected.
    fn assets(&self, wanted: Option<&Sort>, rank: u8, out: &mut Offers) {
        let Some(module) = self.index.module_of(self.file) else { return };
        for (name, def) in self.index.visible(module) {
            let kind = self.index.decl_of(def).filter(|_| self.index.def(def).kind == Kind::Asset);
            let fits = |k| wanted.is_none_or(|w| self.index.suits(&Sort::Thing(vec![k], None), w));
            if kind.is_some_and(fits) {
                out.all.push(self.offer(name, def, rank));
            }
        }
    }

    /// Clauses, or values in one of them.
    fn clause(&self, context: &Context<'_>, out: &mut Offers) {
        let last = context.last().unwrap_or_default();
        if last == ":" {
            return self.types(out);
        }
        if matches!(last, ")" | "}") || context.before.last().is_some_and(|t| t.is_number()) {
            CLAUSES.iter().for_each(|w| self.keyword(w, &format!("{w} "), 10, out));
        }
        let wanted = self.wanted(context);
        self.value_offers(&Wanted { sort: wanted.sort, words: wanted.words }, out);
    }

    /// Types: dimensions, capabilities, assets and those of the language.
    fn types(&self, out: &mut Offers) {
        for word in ["Bool", "Text", "Int", "Species", "Reaction", "Material", "Frame", "Range", "List", "Color", "Any"]
        {
            self.keyword(word, word, 12, out);
        }
        let dimensions: Vec<(DefId, String)> =
            self.index.defs().filter(|(_, d)| d.kind == Kind::Dimension).map(|(id, d)| (id, d.name.clone())).collect();
        for (id, name) in dimensions {
            out.all.push(self.offer(&name, id, 10));
        }
        self.globals(&[Kind::Capability], 11, out);
        self.globals(&[Kind::Asset], 14, out);
    }

    /// Modules after `use`.
    pub(crate) fn imports(&self, context: &Context<'_>, out: &mut Offers) {
        if context.before.len() == 1 {
            self.modules("", out);
        }
    }

    /// What stands after `std::` or `std::heating::`.
    pub(crate) fn after_scope(&self, context: &Context<'_>, out: &mut Offers) {
        let path: Vec<&str> = context.before.iter().map(|t| t.text).skip_while(|t| *t == "use").collect();
        let path = path[..path.len().saturating_sub(1)].concat();
        self.module_items(&path, out);
        self.modules(&format!("{path}::"), out);
    }

    fn module_items(&self, module: &str, out: &mut Offers) {
        let all: Vec<DefId> = self.index.declared_in(module);
        for def in all {
            let name = self.index.def(def).name.clone();
            let mut offer = self.offer(&name, def, 5);
            offer.text = name;
            out.all.push(offer);
        }
    }

    fn modules(&self, begin: &str, out: &mut Offers) {
        for module in self.index.module_names() {
            let Some(rest) = module.strip_prefix(begin).filter(|r| !r.is_empty()) else { continue };
            let first = rest.split("::").next().unwrap_or(rest);
            if !out.all.iter().any(|c| c.label == first) {
                let detail = "module".to_string();
                let label = first.to_string();
                out.all.push(Completion {
                    text: label.clone(),
                    label,
                    kind: Offer::Module,
                    detail,
                    def: None,
                    rank: 6,
                });
            }
        }
    }
}
