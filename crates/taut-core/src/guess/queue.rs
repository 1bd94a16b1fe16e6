//! A queue of nodes by length, in buckets that are a few parts of an edge wide.
//!
//! The order within a bucket does not matter to a search that corrects its labels, and a push or
//! pop takes constant time (Dial, "Algorithm 360", Communications of the ACM 12, 1969; Meyer,
//! Sanders, "Delta-stepping", Journal of Algorithms 49, 2003).

/// Most buckets; lengths farther above the origin share the last one.
const MOST_BUCKETS: usize = 4096;

/// Nodes in buckets of equal width.
#[derive(Clone, Debug)]
pub(crate) struct Queue {
    per_length: f32,
    origin: f32,
    buckets: Vec<Vec<u32>>,
    current: usize,
    /// Number of nodes taken from the current bucket.
    taken: usize,
    /// Number of nodes left in all buckets.
    left: usize,
}

impl Queue {
    /// An empty queue with buckets of the given width.
    pub fn new(width: f32) -> Self {
        Self {
            per_length: width.recip(),
            origin: 0.0,
            buckets: Vec::new(),
            current: 0,
            taken: 0,
            left: 0,
        }
    }

    /// Makes the queue, which must be empty, ready for lengths from `origin` on.
    pub fn restart(&mut self, origin: f32) {
        if let Some(bucket) = self.buckets.get_mut(self.current) {
            bucket.clear();
        }
        (self.origin, self.current, self.taken) = (origin, 0, 0);
    }

    pub fn push(&mut self, length: f32, node: u32) {
        let bucket = ((length - self.origin) * self.per_length) as usize;
        let bucket = bucket.min(MOST_BUCKETS).max(self.current);
        if bucket >= self.buckets.len() {
            self.buckets.resize_with(bucket + 1, Vec::new);
        }
        self.buckets[bucket].push(node);
        self.left += 1;
    }

    /// Takes a node from the first bucket that has any.
    pub fn pop(&mut self) -> Option<u32> {
        while self.left > 0 {
            let bucket = &mut self.buckets[self.current];
            if let Some(node) = bucket.get(self.taken) {
                self.taken += 1;
                self.left -= 1;
                return Some(*node);
            }
            bucket.clear();
            (self.current, self.taken) = (self.current + 1, 0);
        }
        None
    }
}
