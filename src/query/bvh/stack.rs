//! What a traversal has still to visit. The memory is not cleared first: that alone would take a tenth of a ray's time.

use std::mem::MaybeUninit;

/// Entries of a traversal's stack; the builder makes no tree that needs more.
pub const STACK: usize = 256;

/// What is still to visit, with the distance at which the ray enters it.
pub struct Stack<T, const N: usize> {
    entries: [MaybeUninit<(T, f32)>; N],
    /// The entries before this one have been written.
    waiting: usize,
}

impl<T: Copy, const N: usize> Stack<T, N> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], waiting: 0 }
    }

    /// How many entries there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.waiting
    }

    #[inline(always)]
    pub fn push(&mut self, child: T, enters: f32) {
        self.entries[self.waiting] = MaybeUninit::new((child, enters));
        self.waiting += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<(T, f32)> {
        self.waiting = self.waiting.checked_sub(1)?;
        Some(self.entry(self.waiting))
    }

    /// Adds an entry where it belongs among those from `from` on, of which the farthest lies lowest.
    #[inline(always)]
    pub fn insert(&mut self, from: usize, child: T, enters: f32) {
        self.push(child, enters);
        let mut i = self.waiting - 1;
        while i > from && self.entry(i - 1).1 < enters {
            self.entries[i] = self.entries[i - 1];
            i -= 1;
        }
        self.entries[i] = MaybeUninit::new((child, enters));
    }

    #[inline(always)]
    fn entry(&self, i: usize) -> (T, f32) {
        debug_assert!(i <= self.waiting);
        // SAFETY: called for places below `waiting` and for the one that `pop` has just taken off: `push` has written all
        // of them, since `waiting` grows there alone.
        unsafe { self.entries[i].assume_init() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_back_in_the_order_they_were_put() {
        let mut stack = Stack::<u32, 8>::new();
        assert_eq!(stack.pop(), None);
        stack.push(1, 9.0);
        stack.push(2, 0.5);
        let from = stack.len();
        for (child, enters) in [(3, 2.0), (4, 1.0), (5, 3.0), (6, 2.0)] {
            stack.insert(from, child, enters);
        }
        let children: Vec<u32> = std::iter::from_fn(|| stack.pop()).map(|(child, _)| child).collect();
        assert_eq!(children, [4, 6, 3, 5, 2, 1]);
        assert_eq!((stack.pop(), stack.len()), (None, 0));
    }

    #[test]
    #[should_panic(expected = "index out of bounds")]
    fn a_full_stack_takes_no_more() {
        let mut stack = Stack::<u32, 2>::new();
        for i in 0..3 {
            stack.push(i, 0.0);
        }
    }
}
