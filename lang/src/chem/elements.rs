//! The periodic table and molar masses of the elements and of the common labelled isotopes.

use std::fmt;

/// An element, of natural composition or one isotope of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Element {
    number: u8,
    mass_number: u16,
}

impl Element {
    /// Hydrogen.
    pub const H: Element = Element { number: 1, mass_number: 0 };
    /// Carbon.
    pub const C: Element = Element { number: 6, mass_number: 0 };
    /// Oxygen.
    pub const O: Element = Element { number: 8, mass_number: 0 };

    /// By its symbol; `D` is deuterium. `T` is left out, which would turn `THF` into a formula: write `[3H]`.
    pub fn from_symbol(symbol: &str) -> Option<Element> {
        match symbol {
            "D" => Some(Element::H.with_mass_number(2)),
            _ => {
                let index = TABLE.iter().position(|(s, _)| *s == symbol)?;
                Some(Element { number: index as u8 + 1, mass_number: 0 })
            }
        }
    }

    /// By its atomic number, 1 to 118.
    pub fn from_number(number: u8) -> Option<Element> {
        (1..=TABLE.len()).contains(&usize::from(number)).then_some(Element { number, mass_number: 0 })
    }

    /// One isotope of the element; 0 is the natural composition.
    pub fn with_mass_number(self, mass_number: u16) -> Element {
        Element { mass_number, ..self }
    }

    /// The atomic number.
    pub fn number(self) -> u8 {
        self.number
    }

    /// The mass number of an isotope; absent for the natural composition.
    pub fn mass_number(self) -> Option<u16> {
        (self.mass_number != 0).then_some(self.mass_number)
    }

    /// The symbol without the mass number.
    pub fn symbol(self) -> &'static str {
        TABLE[usize::from(self.number) - 1].0
    }

    /// Whether its monatomic ions carry one charge only: hydrogen and the halogens.
    pub(crate) fn forms_single_charges(self) -> bool {
        matches!(self.number, 1 | 9 | 17 | 35 | 53 | 85)
    }

    /// Molar mass [kg/mol]; absent for elements without stable nuclides and for isotopes not tabulated here.
    pub fn molar_mass(self) -> Option<f64> {
        let grams = match self.mass_number {
            0 => TABLE[usize::from(self.number) - 1].1?,
            a => ISOTOPES.iter().find(|(z, n, _)| (*z, *n) == (self.number, a))?.2,
        };
        Some(grams * 1e-3)
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.mass_number {
            0 => f.write_str(self.symbol()),
            a => write!(f, "[{a}{}]", self.symbol()),
        }
    }
}

/// Symbols by atomic number with the standard atomic weight, or the conventional one where the standard is an interval.
/// Source: CIAAW 2021, Prohaska et al., Pure Appl. Chem. 94 (2022) 573.
#[rustfmt::skip]
const TABLE: [(&str, Option<f64>); 118] = [
    ("H", Some(1.008)), ("He", Some(4.002602)), ("Li", Some(6.94)), ("Be", Some(9.0121831)), ("B", Some(10.81)),
    ("C", Some(12.011)), ("N", Some(14.007)), ("O", Some(15.999)), ("F", Some(18.998403162)), ("Ne", Some(20.1797)),
    ("Na", Some(22.98976928)), ("Mg", Some(24.305)), ("Al", Some(26.9815384)), ("Si", Some(28.085)),
    ("P", Some(30.973761998)), ("S", Some(32.06)), ("Cl", Some(35.45)), ("Ar", Some(39.95)), ("K", Some(39.0983)),
    ("Ca", Some(40.078)), ("Sc", Some(44.955907)), ("Ti", Some(47.867)), ("V", Some(50.9415)), ("Cr", Some(51.9961)),
    ("Mn", Some(54.938043)), ("Fe", Some(55.845)), ("Co", Some(58.933194)), ("Ni", Some(58.6934)), ("Cu", Some(63.546)),
    ("Zn", Some(65.38)), ("Ga", Some(69.723)), ("Ge", Some(72.630)), ("As", Some(74.921595)), ("Se", Some(78.971)),
    ("Br", Some(79.904)), ("Kr", Some(83.798)), ("Rb", Some(85.4678)), ("Sr", Some(87.62)), ("Y", Some(88.905838)),
    ("Zr", Some(91.224)), ("Nb", Some(92.90637)), ("Mo", Some(95.95)), ("Tc", None), ("Ru", Some(101.07)),
    ("Rh", Some(102.90549)), ("Pd", Some(106.42)), ("Ag", Some(107.8682)), ("Cd", Some(112.414)), ("In", Some(114.818)),
    ("Sn", Some(118.710)), ("Sb", Some(121.760)), ("Te", Some(127.60)), ("I", Some(126.90447)), ("Xe", Some(131.293)),
    ("Cs", Some(132.90545196)), ("Ba", Some(137.327)), ("La", Some(138.90547)), ("Ce", Some(140.116)),
    ("Pr", Some(140.90766)), ("Nd", Some(144.242)), ("Pm", None), ("Sm", Some(150.36)), ("Eu", Some(151.964)),
    ("Gd", Some(157.25)), ("Tb", Some(158.925354)), ("Dy", Some(162.500)), ("Ho", Some(164.930329)),
    ("Er", Some(167.259)), ("Tm", Some(168.934219)), ("Yb", Some(173.045)), ("Lu", Some(174.9668)),
    ("Hf", Some(178.486)), ("Ta", Some(180.94788)), ("W", Some(183.84)), ("Re", Some(186.207)), ("Os", Some(190.23)),
    ("Ir", Some(192.217)), ("Pt", Some(195.084)), ("Au", Some(196.966570)), ("Hg", Some(200.592)), ("Tl", Some(204.38)),
    ("Pb", Some(207.2)), ("Bi", Some(208.98040)), ("Po", None), ("At", None), ("Rn", None), ("Fr", None), ("Ra", None),
    ("Ac", None), ("Th", Some(232.0377)), ("Pa", Some(231.03588)), ("U", Some(238.02891)), ("Np", None), ("Pu", None),
    ("Am", None), ("Cm", None), ("Bk", None), ("Cf", None), ("Es", None), ("Fm", None), ("Md", None), ("No", None),
    ("Lr", None), ("Rf", None), ("Db", None), ("Sg", None), ("Bh", None), ("Hs", None), ("Mt", None), ("Ds", None),
    ("Rg", None), ("Cn", None), ("Nh", None), ("Fl", None), ("Mc", None), ("Lv", None), ("Ts", None), ("Og", None),
];

/// Atomic number, mass number and relative mass of isotopes used as labels.
/// Source: AME2020, Wang et al., Chinese Phys. C 45 (2021) 030003.
#[rustfmt::skip]
const ISOTOPES: [(u8, u16, f64); 26] = [
    (1, 1, 1.00782503190), (1, 2, 2.01410177784), (1, 3, 3.01604928132),
    (3, 6, 6.0151228874), (3, 7, 7.016003434), (5, 10, 10.012936862), (5, 11, 11.009305166),
    (6, 12, 12.0), (6, 13, 13.00335483534), (6, 14, 14.00324198862),
    (7, 14, 14.00307400425), (7, 15, 15.00010889827),
    (8, 16, 15.99491461926), (8, 17, 16.99913175595), (8, 18, 17.99915961214),
    (9, 18, 18.000937324), (9, 19, 18.99840316207),
    (15, 31, 30.97376199768), (15, 32, 31.973907643),
    (16, 32, 31.97207117354), (16, 34, 33.967867011),
    (17, 35, 34.968852694), (17, 37, 36.965902573),
    (35, 79, 78.918337574), (35, 81, 80.916288197), (53, 127, 126.904471821),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_complete_and_ordered() {
        for number in 1..=118u8 {
            let element = Element::from_number(number).expect("in the table");
            assert_eq!(Element::from_symbol(element.symbol()), Some(element));
            assert_eq!(chematic::core::Element::from_symbol(element.symbol()).map(|e| e.atomic_number()), Some(number));
        }
        assert_eq!(Element::from_number(0), None);
        assert_eq!(Element::from_number(119), None);
    }

    #[test]
    fn only_elements_without_stable_nuclides_lack_a_mass() {
        let without: Vec<u8> =
            (1..=118).filter(|n| Element::from_number(*n).and_then(Element::molar_mass).is_none()).collect();
        let expected: Vec<u8> = [43, 61].into_iter().chain(84..=89).chain(93..=118).collect();
        assert_eq!(without, expected);
    }

    #[test]
    fn masses_lie_near_the_mass_number() {
        for (number, mass_number, mass) in ISOTOPES {
            assert!(number > 0 && (mass - f64::from(mass_number)).abs() < 0.1);
        }
        assert_eq!(Element::from_symbol("D"), Some(Element::H.with_mass_number(2)));
        assert_eq!(Element::C.with_mass_number(11).molar_mass(), None);
    }
}
