//! Elements and their attributes as the format means them.

use roxmltree::Node;

use crate::problem::Problem;

/// Lengths beyond this are no robot's, in metres; squares of shorter ones are far from overflow.
const LONGEST: f64 = 1e6;

/// An element of the description.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a>(pub Node<'a, 'a>);

impl<'a> Element<'a> {
    pub fn name(&self) -> &'a str {
        self.0.tag_name().name()
    }

    /// The element and, where it has one, its name.
    fn title(&self) -> String {
        match self.0.attribute("name") {
            Some(name) => format!("`{}` `{name}`", self.name()),
            None => format!("`{}`", self.name()),
        }
    }

    /// A problem at this element.
    pub fn wrong(&self, message: impl Into<String>) -> Problem {
        Problem::new(self.0.document().text_pos_at(self.0.range().start).row, message)
    }

    /// The elements in it with this name.
    pub fn all<'n>(&self, name: &'n str) -> impl Iterator<Item = Element<'a>> + use<'a, 'n> {
        self.0.children().filter(move |n| n.has_tag_name(name)).map(Element)
    }

    /// The element in it with this name, if there is one; two are a problem.
    pub fn one(&self, name: &str) -> Result<Option<Element<'a>>, Problem> {
        let mut all = self.all(name);
        match (all.next(), all.next()) {
            (first, None) => Ok(first),
            (_, Some(second)) => Err(second.wrong(format!("{} has two `{name}` elements", self.title()))),
        }
    }

    /// The element in it with this name.
    pub fn needed(&self, name: &str) -> Result<Element<'a>, Problem> {
        self.one(name)?.ok_or_else(|| self.wrong(format!("{} has no `{name}` element", self.title())))
    }

    /// An attribute as it is written.
    pub fn given(&self, attribute: &str) -> Option<&'a str> {
        self.0.attribute(attribute)
    }

    /// An attribute that is not empty.
    pub fn text(&self, attribute: &str) -> Result<&'a str, Problem> {
        match self.given(attribute).map(str::trim) {
            Some(text) if !text.is_empty() => Ok(text),
            Some(_) => Err(self.wrong(format!("`{attribute}` of {} is empty", self.title()))),
            None => Err(self.wrong(format!("{} has no `{attribute}`", self.title()))),
        }
    }

    /// An attribute of so many finite numbers, if given.
    pub fn optional_numbers<const N: usize>(&self, attribute: &str) -> Result<Option<[f64; N]>, Problem> {
        let Some(text) = self.given(attribute) else { return Ok(None) };
        let mut numbers = [0.0; N];
        let mut count = 0;
        for word in text.split_ascii_whitespace() {
            let number = word.parse::<f64>().ok().filter(|n| n.is_finite());
            let number = number.ok_or_else(|| {
                self.wrong(format!("`{word}` in `{attribute}` of {} is not a finite number", self.title()))
            })?;
            if let Some(slot) = numbers.get_mut(count) {
                *slot = number;
            }
            count += 1;
        }
        if count == N {
            return Ok(Some(numbers));
        }
        let numbers = if N == 1 { "number" } else { "numbers" };
        Err(self.wrong(format!("`{attribute}` of {} has {count} of {N} {numbers}", self.title())))
    }

    /// An attribute of so many finite numbers.
    pub fn numbers<const N: usize>(&self, attribute: &str) -> Result<[f64; N], Problem> {
        self.optional_numbers(attribute)?.ok_or_else(|| self.wrong(format!("{} has no `{attribute}`", self.title())))
    }

    /// A finite number, if given.
    pub fn optional(&self, attribute: &str) -> Result<Option<f64>, Problem> {
        Ok(self.optional_numbers::<1>(attribute)?.map(|[number]| number))
    }

    /// A finite number.
    pub fn number(&self, attribute: &str) -> Result<f64, Problem> {
        self.numbers::<1>(attribute).map(|[number]| number)
    }

    /// A finite number that is not below zero.
    pub fn not_negative(&self, attribute: &str) -> Result<f64, Problem> {
        let number = self.number(attribute)?;
        if number >= 0.0 {
            return Ok(number);
        }
        Err(self.wrong(format!("`{attribute}` of {} is {number}, below 0", self.title())))
    }

    /// So many coordinates, if given; metres.
    pub fn coordinates(&self, attribute: &str) -> Result<Option<[f64; 3]>, Problem> {
        let Some(numbers) = self.optional_numbers(attribute)? else { return Ok(None) };
        self.not_beyond(attribute, &numbers)?;
        Ok(Some(numbers))
    }

    fn not_beyond(&self, attribute: &str, numbers: &[f64]) -> Result<(), Problem> {
        match numbers.iter().find(|n| n.abs() > LONGEST) {
            None => Ok(()),
            Some(far) => Err(self.wrong(format!("{far:e} in `{attribute}` of {} is more than 1000 km", self.title()))),
        }
    }

    /// So many lengths above zero, in metres.
    pub fn sizes<const N: usize>(&self, attribute: &str) -> Result<[f64; N], Problem> {
        let sizes = self.numbers(attribute)?;
        self.not_beyond(attribute, &sizes)?;
        match sizes.iter().find(|&&size| size <= 0.0) {
            None => Ok(sizes),
            Some(size) => Err(self.wrong(format!("`{attribute}` of {} is {size}, but must be above 0", self.title()))),
        }
    }

    /// Fails at a word in it that is none of these but nearly so. Others are extensions and passed over.
    pub fn expect_words(&self, elements: &[&str], attributes: &[&str]) -> Result<(), Problem> {
        for child in self.0.children().filter(Node::is_element) {
            if let Some(meant) = meant(child.tag_name().name(), elements) {
                let name = child.tag_name().name();
                return Err(
                    Element(child).wrong(format!("`{name}` is not an element of URDF; did you mean `{meant}`?"))
                );
            }
        }
        for attribute in self.0.attributes() {
            if let Some(meant) = meant(attribute.name(), attributes) {
                let name = attribute.name();
                let title = self.title();
                return Err(self.wrong(format!("`{name}` is not an attribute of {title}; did you mean `{meant}`?")));
            }
        }
        Ok(())
    }
}

/// The word that is nearly this one.
fn meant<'w>(word: &str, words: &[&'w str]) -> Option<&'w str> {
    if words.contains(&word) || word.len() > 32 {
        return None;
    }
    let far = |w: &&str| strsim::osa_distance(&word.to_ascii_lowercase(), w);
    words.iter().copied().find(|w| w.len() > 2 && far(w) <= usize::from(w.len() > 5) + 1)
}
