//! Values by index of which copies share what is the same in them: of a deck with hundreds of wells a step changes two.

use std::ops::{Index, IndexMut};
use std::rc::Rc;

/// Values in a page.
const SIZE: usize = 32;

/// A list of fixed length in pages.
#[derive(Clone, Debug)]
pub struct Pages<T> {
    pages: Vec<Rc<Vec<T>>>,
}

impl<T: Clone> Pages<T> {
    /// A value, if there are so many.
    pub fn get(&self, index: usize) -> Option<&T> {
        self.pages.get(index / SIZE)?.get(index % SIZE)
    }

    /// A value to be changed, if there are so many.
    pub fn get_mut(&mut self, index: usize) -> Option<&mut T> {
        Rc::make_mut(self.pages.get_mut(index / SIZE)?).get_mut(index % SIZE)
    }

    /// All values in order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.pages.iter().flat_map(|page| page.iter())
    }

    /// Changes the pages in which another list of the same length may differ.
    pub fn merge(&mut self, other: &Self, mut merge: impl FnMut(&mut T, &T)) {
        for (page, o) in self.pages.iter_mut().zip(&other.pages).filter(|(a, b)| !Rc::ptr_eq(a, b)) {
            Rc::make_mut(page).iter_mut().zip(o.iter()).for_each(|(value, o)| merge(value, o));
        }
    }
}

impl<T: Clone> FromIterator<T> for Pages<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        let mut values = values.into_iter();
        let page = || Some(values.by_ref().take(SIZE).collect::<Vec<T>>()).filter(|page| !page.is_empty());
        Pages { pages: std::iter::from_fn(page).map(Rc::new).collect() }
    }
}

impl<T: PartialEq> PartialEq for Pages<T> {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&Rc<Vec<T>>, &Rc<Vec<T>>)| Rc::ptr_eq(a, b) || a == b;
        self.pages.len() == other.pages.len() && self.pages.iter().zip(&other.pages).all(same)
    }
}

impl<T> Index<usize> for Pages<T> {
    type Output = T;

    fn index(&self, index: usize) -> &T {
        &self.pages[index / SIZE][index % SIZE]
    }
}

impl<T: Clone> IndexMut<usize> for Pages<T> {
    fn index_mut(&mut self, index: usize) -> &mut T {
        &mut Rc::make_mut(&mut self.pages[index / SIZE])[index % SIZE]
    }
}
