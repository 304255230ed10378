//! Types of parameters, members and results.

use std::sync::Arc;

use matterix_ir::{Diagnostic, codes};

use super::Tables;
use crate::ast;
use crate::names::DeclId;
use crate::near;
use crate::units::Dimension;

/// A resolved type.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    /// Unknown (reported already) or left open.
    Any,
    /// A quantity; `point` for a scale such as temperature.
    Quantity {
        /// The dimension of a difference.
        dimension: Dimension,
        /// A point on a scale.
        point: bool,
        /// May be `unlimited`.
        optional: bool,
    },
    /// A whole number.
    Int,
    /// A truth value.
    Bool,
    /// A text.
    Text,
    /// The name of a place of a grid: `A1`.
    Place,
    /// One of these words.
    Enum(Arc<[String]>),
    /// A species.
    Species,
    /// A reaction.
    Reaction,
    /// What a vessel is made of.
    Material {
        /// May be `nothing`.
        optional: bool,
    },
    /// A named point of an instance.
    Frame,
    /// `Range<T>`.
    Range(Arc<Type>),
    /// `List<T>`.
    List(Arc<Type>),
    /// Three plain numbers 0..1: red, green, blue.
    Color,
    /// An instance that has all of these capabilities (or is of this asset type).
    Instance {
        /// All of them.
        kinds: Arc<[DeclId]>,
        /// May be `nothing`.
        optional: bool,
    },
}

impl Type {
    /// A plain number.
    pub fn ratio() -> Type {
        Type::Quantity { dimension: Dimension::one(), point: false, optional: false }
    }
}

/// Names of types that are not dimensions, capabilities or assets.
const BUILT_IN: &[&str] =
    &["Bool", "Text", "Place", "Int", "Species", "Reaction", "Material", "Frame", "Range", "List", "Color", "Any"];

impl Tables<'_> {
    /// Resolves a type as written in a module, where no `where` can be looked at.
    pub fn resolve_type(&self, ty: &ast::Type, module: usize, diagnostics: &mut Vec<Diagnostic>) -> Type {
        if let Some(condition) = &ty.condition {
            diagnostics.push(
                Diagnostic::error(
                    codes::MISPLACED,
                    condition.span,
                    "`where` is only for parameters of a workflow, skill or command",
                    "not checked here",
                )
                .help("a process takes `while`, an event `when`; limit a value of an instance with `at_least`"),
            );
        }
        self.resolve_parameter_type(ty, module, diagnostics)
    }

    /// Resolves the type of a parameter; its `where` is the business of whoever binds it.
    pub fn resolve_parameter_type(&self, ty: &ast::Type, module: usize, diagnostics: &mut Vec<Diagnostic>) -> Type {
        if !ty.words.is_empty() {
            return enumeration(&ty.words, diagnostics);
        }
        if ty.paths.len() == 1 && ty.paths[0].segments.len() == 1 {
            let name = &ty.paths[0].segments[0];
            let argument = |d: &mut Vec<Diagnostic>| {
                Arc::new(ty.argument.as_ref().map_or(Type::Any, |a| self.resolve_type(a, module, d)))
            };
            match name.text.as_str() {
                "Bool" => return Type::Bool,
                "Text" => return Type::Text,
                "Place" => return Type::Place,
                "Int" => return Type::Int,
                "Species" => return Type::Species,
                "Reaction" => return Type::Reaction,
                "Material" => return Type::Material { optional: ty.optional },
                "Frame" => return Type::Frame,
                "Color" => return Type::Color,
                "Any" => return Type::Any,
                "Range" => return Type::Range(argument(diagnostics)),
                "List" => return Type::List(argument(diagnostics)),
                _ => {}
            }
            if let Some(def) = self.units.dimension(&name.text) {
                let dimension = def.dimension.clone();
                return Type::Quantity { dimension, point: def.point, optional: ty.optional };
            }
        }
        let mut kinds = Vec::new();
        for path in &ty.paths {
            let Some(name) = path.segments.last() else { return Type::Any };
            match self.names.lookup(module, &name.text).filter(|id| self.kinds.contains_key(id)) {
                Some(id) => kinds.push(id),
                None => {
                    diagnostics.push(self.unknown_type(name, module));
                    return Type::Any;
                }
            }
        }
        Type::Instance { kinds: kinds.into(), optional: ty.optional }
    }

    fn unknown_type(&self, name: &ast::Name, module: usize) -> Diagnostic {
        let mut d =
            near::unknown(name, format!("unknown type `{}`", name.text), "not a dimension, capability or asset");
        let kinds = self.names.visible(module).filter(|(_, id)| self.kinds.contains_key(id)).map(|(n, _)| n);
        let names: Vec<&str> = kinds.chain(self.units.dimension_names()).chain(BUILT_IN.iter().copied()).collect();
        let near = near::nearest(&name.text, names);
        d = near::proposed(d, &near, name.span);
        d
    }

    /// A type in words, for "expected ...".
    pub fn type_name(&self, ty: &Type) -> String {
        match ty {
            Type::Any => "anything".into(),
            Type::Quantity { dimension, point, .. } => self.units.describe(dimension, *point),
            Type::Int => "a whole number".into(),
            Type::Bool => "a truth value".into(),
            Type::Text => "a text".into(),
            Type::Place => "a place such as `A1`".into(),
            Type::Enum(words) => format!("one of {}", list(words)),
            Type::Species => "a species".into(),
            Type::Reaction => "a reaction".into(),
            Type::Material { .. } => "a material".into(),
            Type::Frame => "a frame".into(),
            Type::Color => "a colour".into(),
            Type::Range(inner) => format!("a range of {}", self.type_name(inner)),
            Type::List(inner) => format!("a list of {}", self.type_name(inner)),
            Type::Instance { kinds, .. } => {
                kinds.iter().map(|k| self.kind_name(*k).to_owned()).collect::<Vec<_>>().join(" & ")
            }
        }
    }
}

/// `open | closed` as a type; a word given twice is reported.
fn enumeration(words: &[ast::Name], diagnostics: &mut Vec<Diagnostic>) -> Type {
    for (i, word) in words.iter().enumerate() {
        if let Some(first) = words[..i].iter().find(|w| w.text == word.text) {
            let headline = format!("`{}` is given twice", word.text);
            let d = Diagnostic::error(codes::DUPLICATE_NAME, word.span, headline, "given again here");
            diagnostics.push(d.because(first.span, "first given here"));
        }
    }
    Type::Enum(words.iter().map(|w| w.text.clone()).collect())
}

/// "not supported yet" at a span.
pub fn unsupported(span: matterix_ir::Span, what: &str) -> Diagnostic {
    Diagnostic::error(codes::UNSUPPORTED, span, format!("{what} are not supported yet"), "not supported yet")
        .help("this version can read and format this part of the language, but not check or run it")
}

/// Words for a message: `a`, `b`, `c`.
pub fn list(words: &[String]) -> String {
    words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ")
}
