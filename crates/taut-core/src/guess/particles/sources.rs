//! Which sources are homologous: those whose particles have met, directly or through others.

/// Sources in classes (union-find with path halving: Tarjan, "Efficiency of a good but not linear
/// set union algorithm", Journal of the ACM 22, 1975).
#[derive(Clone, Debug)]
pub(super) struct SourceClasses {
    parents: Vec<u32>,
    classes: usize,
}

impl SourceClasses {
    /// Classes of one source each.
    pub fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
            classes: count,
        }
    }

    /// The number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// The class of each source, named after the first source in it.
    pub fn class_of_each(&self) -> Vec<u32> {
        let mut classes = self.parents.clone();
        for i in 0..classes.len() {
            // Parents come before their children.
            classes[i] = classes[classes[i] as usize];
        }
        classes
    }

    /// The first source of the class of a source.
    fn first(&mut self, mut source: u32) -> u32 {
        while self.parents[source as usize] != source {
            let above = self.parents[self.parents[source as usize] as usize];
            self.parents[source as usize] = above;
            source = above;
        }
        source
    }

    /// Makes the classes of two sources one; returns whether they were two.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.first(a), self.first(b));
        let (first, second) = (a.min(b), a.max(b));
        self.parents[second as usize] = first;
        self.classes -= usize::from(first != second);
        first != second
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_named_after_their_first_source() {
        let mut sources = SourceClasses::new(6);
        for (a, b, new) in [(5, 3, true), (3, 1, true), (5, 1, false), (2, 4, true)] {
            assert_eq!(sources.join(a, b), new);
        }
        assert_eq!(sources.class_of_each(), [0, 1, 2, 1, 2, 1]);
        assert_eq!(sources.classes(), 3);
    }
}
