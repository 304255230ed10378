//! Molecular formulas: `C2H5OH`, `CuSO4.5H2O`, `[Fe(CN)6]^3-`, `[2H]2O`.

use std::collections::BTreeMap;
use std::fmt;

use super::elements::Element;
use super::rational::Rational;
use super::species_name::{Phase, split_charge};

/// Atoms and charge of one formula unit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Formula {
    /// Atoms of each element; none is zero.
    pub elements: BTreeMap<Element, Rational>,
    /// In elementary charges.
    pub charge: i32,
}

/// What is wrong in the text of a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormulaError {
    /// What.
    pub kind: FormulaErrorKind,
    /// First byte, in the text given.
    pub offset: usize,
    /// Length in bytes; zero at the end of the text.
    pub len: usize,
}

/// The kinds of mistakes in a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FormulaErrorKind {
    /// No atoms.
    Empty,
    /// A symbol that no element has.
    UnknownElement(String),
    /// A character that has no place here.
    UnexpectedCharacter(char),
    /// A bracket that is not closed.
    Unclosed(char),
    /// A bracket that was not opened, or a different one.
    Unopened(char),
    /// A count of zero, or one beyond a million.
    BadCount,
    /// More than 64 brackets inside each other.
    TooDeep,
}

/// The element whose molar mass is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoMolarMass(pub Element);

/// The electron, which has no atoms.
const ELECTRON_NAME: &str = "e-";

/// Relative mass of the electron (CODATA 2018).
const ELECTRON: f64 = 5.48579909065e-4;
const MAX_DEPTH: usize = 64;
const MAX_COUNT: i64 = 1_000_000;

impl Formula {
    /// Reads a formula with an optional charge.
    pub fn parse(text: &str) -> Result<Formula, FormulaError> {
        if text == ELECTRON_NAME {
            return Ok(Formula { charge: -1, ..Formula::default() });
        }
        let (body, charge) = split_charge(text);
        let mut formula = Parser { text: body, at: 0 }.formula()?;
        formula.charge = charge;
        Ok(formula)
    }

    /// Reads a formula with an optional charge and phase: `KNO3(s)`.
    pub fn parse_with_phase(text: &str) -> Result<(Formula, Option<Phase>), FormulaError> {
        let (body, phase) = Phase::split(text);
        Ok((Formula::parse(body)?, phase))
    }

    /// Molar mass [kg/mol]: the atoms' less the electrons that the charge stands for, so that mass balances where
    /// atoms and charge do. The molar mass constant is taken as 1 g/mol (it is within 1e-9).
    pub fn molar_mass(&self) -> Result<f64, NoMolarMass> {
        let mut total = -f64::from(self.charge) * ELECTRON * 1e-3;
        for (element, count) in &self.elements {
            total += element.molar_mass().ok_or(NoMolarMass(*element))? * count.to_f64();
        }
        Ok(total)
    }

    /// Whether it is the electron of half-cells.
    pub fn is_electron(&self) -> bool {
        self.elements.is_empty() && self.charge == -1
    }

    /// Atoms of an element; zero where there are none.
    pub fn count(&self, element: Element) -> Rational {
        self.elements.get(&element).copied().unwrap_or(Rational::ZERO)
    }

    /// Adds atoms; `None` on overflow.
    pub fn add(&mut self, element: Element, count: Rational) -> Option<()> {
        let sum = self.count(element).checked_add(count)?;
        if sum.is_zero() {
            self.elements.remove(&element);
        } else {
            self.elements.insert(element, sum);
        }
        Some(())
    }

    fn add_all(&mut self, other: &Formula, times: Rational) -> Option<()> {
        other.elements.iter().try_for_each(|(element, count)| self.add(*element, count.checked_mul(times)?))
    }
}

impl fmt::Display for Formula {
    /// Hill order (carbon, hydrogen, then by symbol; by symbol alone without carbon) and the charge: `C2H6O`, `O4S^2-`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let organic = self.elements.keys().any(|e| e.number() == Element::C.number());
        let rank = |element: &Element| match element.number() {
            6 if organic => 0,
            1 if organic => 1,
            _ => 2,
        };
        let mut order: Vec<(&Element, &Rational)> = self.elements.iter().collect();
        order.sort_by_key(|(e, _)| (rank(e), e.symbol(), e.mass_number()));
        for (element, count) in &order {
            write!(f, "{element}")?;
            if **count != Rational::ONE {
                write!(f, "{}", count.to_f64())?;
            }
        }
        let sign = if self.charge < 0 { '-' } else { '+' };
        let lone_group = order.len() == 1 && *order[0].1 != Rational::ONE;
        match self.charge.unsigned_abs() {
            0 => Ok(()),
            1 if lone_group => write!(f, "^{sign}"),
            1 => write!(f, "{sign}"),
            n => write!(f, "^{n}{sign}"),
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

/// An open bracket: the character that closes it, where it stands, and the atoms read before it.
struct Open {
    opener: char,
    offset: usize,
    outer: Formula,
}

impl Parser<'_> {
    /// Units joined by dots, each with a leading number.
    fn formula(&mut self) -> Result<Formula, FormulaError> {
        let mut total = Formula::default();
        loop {
            let start = self.at;
            let times = self.number(true)?.unwrap_or(Rational::ONE);
            let unit = self.unit()?;
            if unit.elements.is_empty() {
                return Err(match self.peek() {
                    Some(c) => self.error(FormulaErrorKind::UnexpectedCharacter(c), self.at, c.len_utf8()),
                    None => self.error(FormulaErrorKind::Empty, self.at, 0),
                });
            }
            total.add_all(&unit, times).ok_or_else(|| self.bad_count(start))?;
            match self.peek() {
                None => return Ok(total),
                Some(dot) if is_dot(dot) => self.at += dot.len_utf8(),
                Some(c) => return Err(self.error(FormulaErrorKind::UnexpectedCharacter(c), self.at, c.len_utf8())),
            }
        }
    }

    /// Elements and groups up to a dot or the end.
    fn unit(&mut self) -> Result<Formula, FormulaError> {
        let mut current = Formula::default();
        let mut open: Vec<Open> = Vec::new();
        while let Some(c) = self.peek() {
            let start = self.at;
            match c {
                '(' | '[' | '{' => {
                    if open.len() == MAX_DEPTH {
                        return Err(self.error(FormulaErrorKind::TooDeep, start, 1));
                    }
                    self.at += 1;
                    open.push(Open { opener: c, offset: start, outer: std::mem::take(&mut current) });
                    if c == '[' && self.peek().is_some_and(|c| c.is_ascii_digit()) {
                        self.isotope(&mut current)?;
                    }
                }
                ')' | ']' | '}' => {
                    let Some(Open { mut outer, .. }) = open.pop_if(|o| closer(o.opener) == c) else {
                        return Err(self.error(FormulaErrorKind::Unopened(c), start, 1));
                    };
                    self.at += 1;
                    if current.elements.is_empty() {
                        return Err(self.error(FormulaErrorKind::Empty, start, 1));
                    }
                    let times = self.subscript()?;
                    outer.add_all(&current, times).ok_or_else(|| self.bad_count(start))?;
                    current = outer;
                }
                c if c.is_ascii_alphabetic() => {
                    let element = self.element()?;
                    let count = self.subscript()?;
                    current.add(element, count).ok_or_else(|| self.bad_count(start))?;
                }
                _ => break,
            }
        }
        match open.pop() {
            Some(o) => Err(self.error(FormulaErrorKind::Unclosed(o.opener), o.offset, 1)),
            None => Ok(current),
        }
    }

    /// The mass number and element at the start of `[2H]`.
    fn isotope(&mut self, into: &mut Formula) -> Result<(), FormulaError> {
        let start = self.at;
        let digits = self.digits();
        let mass_number = digits.parse::<u16>().ok().filter(|n| (1..=400).contains(n));
        let mass_number = mass_number.ok_or_else(|| self.bad_count(start))?;
        let element = self.element()?.with_mass_number(mass_number);
        let count = self.subscript()?;
        into.add(element, count).ok_or_else(|| self.bad_count(start))
    }

    /// The longest symbol that an element has.
    fn element(&mut self) -> Result<Element, FormulaError> {
        let rest = &self.text[self.at..];
        let lower = rest.chars().skip(1).take_while(char::is_ascii_lowercase).count();
        for len in (1..=(1 + lower).min(2)).rev() {
            if let Some(element) = rest.get(..len).and_then(Element::from_symbol) {
                self.at += len;
                return Ok(element);
            }
        }
        let len = match rest.chars().next() {
            Some(c) if c.is_ascii_uppercase() => 1 + lower.min(1),
            Some(c) => c.len_utf8(),
            None => 0,
        };
        Err(self.error(FormulaErrorKind::UnknownElement(rest[..len].to_string()), self.at, len))
    }

    fn subscript(&mut self) -> Result<Rational, FormulaError> {
        Ok(self.number(false)?.unwrap_or(Rational::ONE))
    }

    /// A count. Decimals follow a leading unit number (`0.5H2O`); in a subscript only after a zero (`Fe0.95O`), since
    /// `CuSO4.5H2O` is a hydrate.
    fn number(&mut self, leading: bool) -> Result<Option<Rational>, FormulaError> {
        let start = self.at;
        let whole = self.digits();
        if whole.is_empty() {
            return Ok(None);
        }
        let mut value: Option<i64> = whole.parse().ok();
        let mut scale = 1i64;
        let mut after = self.text[self.at..].chars();
        let decimal = after.next() == Some('.') && after.next().is_some_and(|c| c.is_ascii_digit());
        if decimal && (leading || whole == "0") {
            self.at += 1;
            let decimals = self.digits();
            scale = 10i64.checked_pow(decimals.len().min(99) as u32).unwrap_or(0);
            value = format!("{whole}{decimals}").parse().ok();
        }
        let count = value.and_then(|v| Rational::new(v.into(), scale.into()));
        match count {
            Some(c) if c.signum() > 0 && c <= Rational::whole(MAX_COUNT) => Ok(Some(c)),
            _ => Err(self.bad_count(start)),
        }
    }

    fn digits(&mut self) -> String {
        let rest = &self.text[self.at..];
        let len = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        self.at += len;
        rest[..len].to_string()
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn bad_count(&self, start: usize) -> FormulaError {
        self.error(FormulaErrorKind::BadCount, start, self.at - start)
    }

    fn error(&self, kind: FormulaErrorKind, offset: usize, len: usize) -> FormulaError {
        FormulaError { kind, offset, len }
    }
}

fn is_dot(c: char) -> bool {
    matches!(c, '.' | '·' | '•' | '⋅')
}

fn closer(opener: char) -> char {
    match opener {
        '(' => ')',
        '[' => ']',
        _ => '}',
    }
}

#[cfg(test)]
#[path = "formula_tests.rs"]
mod tests;
