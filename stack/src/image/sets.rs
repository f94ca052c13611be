//! Disjoint sets in a flat list (union-find): each member points to a lower member of its set; the
//! lowest, its root, points to itself. A list `0, 1, 2, ...` is as many sets of one member.
//!
//! ```
//! use lamp_stack::sets::{root, unite};
//!
//! let mut parents = vec![0, 1, 2, 3];
//! assert_eq!((unite(&mut parents, 3, 1), unite(&mut parents, 2, 3)), (1, 1));
//! assert_eq!([0, 1, 2, 3].map(|member| root(&mut parents, member)), [0, 1, 1, 1]);
//! ```

/// Returns the root of a member's set, and shortens the way there.
#[inline]
pub fn root(parents: &mut [u32], mut member: u32) -> u32 {
    while parents[member as usize] != member {
        // Path halving (Tarjan and van Leeuwen 1984): one pass, and no recursion.
        let next = parents[parents[member as usize] as usize];
        parents[member as usize] = next;
        member = next;
    }
    member
}

/// Joins the sets of two members, and returns the root: the lower of both roots.
#[inline]
pub fn unite(parents: &mut [u32], a: u32, b: u32) -> u32 {
    let [a, b] = [root(parents, a), root(parents, b)];
    // The lower root wins, whatever the sets' sizes: callers number sets by their first members.
    parents[a.max(b) as usize] = a.min(b);
    a.min(b)
}
