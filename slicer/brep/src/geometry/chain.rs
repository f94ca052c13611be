//! Joins pieces of curves into composite curves.

use super::curve::Curve;
use crate::vector::{Vec3, distance, scale};

/// Pieces of curves; each starts where the previous piece ends. Piece k has the parameters k to k +
/// 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CurveChain {
    links: Vec<Link>,
}

/// A piece of a curve, from one parameter to another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) curve: Curve,
    pub(crate) range: [f64; 2],
}

/// The greatest gap between pieces, in millimeters: programs round points by less.
const JOINED_MM: f64 = 1e-3;

/// Turns over pieces that meet the previous piece only that way. Returns the pieces if they close.
/// Some programs confuse the senses of pieces.
pub(crate) fn closed(mut links: Vec<Link>) -> Option<Vec<Link>> {
    let end = |link: &Link, k: usize| link.curve.place(link.range[k]);
    let meet = |a: Vec3, b: Vec3| distance(a, b) <= JOINED_MM;
    // Only the second piece shows at which end the first one must stop.
    if let [first, second, ..] = &mut links[..] {
        let touches = |p: Vec3| meet(p, end(second, 0)) || meet(p, end(second, 1));
        if !touches(end(first, 1)) {
            first.range.reverse();
        }
    }
    for k in 1..links.len() {
        if !meet(end(&links[k - 1], 1), end(&links[k], 0)) {
            links[k].range.reverse();
        }
    }
    let next = links.iter().cycle().skip(1);
    let is_closed = links.iter().zip(next).all(|(a, b)| meet(end(a, 1), end(b, 0)));
    (!links.is_empty() && is_closed).then_some(links)
}

impl CurveChain {
    /// Returns a chain, or `None` if a piece does not start where the previous piece ends.
    pub(crate) fn new(links: Vec<Link>) -> Option<Self> {
        let ends = |link: &Link| link.range.map(|t| link.curve.place(t));
        let meet = |pair: &[Link]| distance(ends(&pair[0])[1], ends(&pair[1])[0]) <= JOINED_MM;
        (!links.is_empty() && links.windows(2).all(meet)).then_some(Self { links })
    }

    pub(crate) fn domain(&self) -> [f64; 2] {
        [0.0, self.links.len() as f64]
    }

    pub(crate) fn at(&self, t: f64) -> [Vec3; 2] {
        let k = (t.max(0.0).floor() as usize).min(self.links.len() - 1);
        let Link { curve, range: [from, to] } = &self.links[k];
        let inner = from + (to - from) * (t - k as f64);
        // The slope comes from the curve itself, so it also holds past a seam.
        [curve.place(inner), scale(curve.at(inner)[1], to - from)]
    }

    /// Returns the same chain in the other direction.
    pub(crate) fn reversed(mut self) -> Self {
        self.links.reverse();
        self.links.iter_mut().for_each(|link| link.range.reverse());
        self
    }

    /// Returns the parameters at which pieces end or are not smooth.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut breaks = vec![0.0];
        for (k, Link { curve, range: [from, to] }) in (0u32..).zip(&self.links) {
            let part = |t: f64| (t - from) / (to - from);
            let inner = curve.breaks().unwrap_or_default().into_iter().map(part);
            let mut inner: Vec<f64> =
                inner.filter(|part| (1e-9..1.0 - 1e-9).contains(part)).collect();
            inner.sort_by(f64::total_cmp);
            breaks.extend(inner.into_iter().chain([1.0]).map(|part| f64::from(k) + part));
        }
        breaks
    }

    /// Returns the parameter of the point nearest to `p`.
    pub(crate) fn project(&self, p: Vec3) -> f64 {
        let on_link = |(k, link): (u32, &Link)| {
            let Link { curve, range: [from, to] } = link;
            let mut t = curve.project(p);
            if let Some(period) = curve.period() {
                let low = from.min(*to);
                t = low + (t - low).rem_euclid(period);
            }
            let part = (t - from) / (to - from);
            // A foot outside the piece's range is on another part of its curve: the ends are
            // nearest.
            let parts = [part, 0.0, 1.0].into_iter().filter(|part| (0.0..=1.0).contains(part));
            let all = parts.map(|part| {
                let t = f64::from(k) + part;
                (distance(curve.place(from + (to - from) * part), p), t)
            });
            all.collect::<Vec<_>>()
        };
        let all = (0u32..).zip(&self.links).flat_map(on_link);
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, t)| t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::Axes;
    use std::f64::consts::PI;

    /// Returns half a circle of radius 2 from right to left, and the line back.
    fn half() -> Vec<Link> {
        let circle = Curve::Ellipse { axes: Axes::WORLD, radii: [2.0; 2] };
        let line = Curve::Line { point: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        vec![Link { curve: circle, range: [0.0, PI] }, Link { curve: line, range: [-2.0, 2.0] }]
    }

    #[test]
    fn a_chain_goes_through_its_pieces() {
        let chain = CurveChain::new(half()).unwrap();
        for (t, place) in [(0.0, [2.0, 0.0, 0.0]), (0.5, [0.0, 2.0, 0.0]), (1.25, [-1.0, 0.0, 0.0])]
        {
            assert!(distance(chain.at(t)[0], place) < 1e-14);
            assert!((chain.project(place) - t).abs() < 1e-14);
            assert!(distance(chain.clone().reversed().at(2.0 - t)[0], place) < 1e-14);
        }
        assert_eq!(chain.at(1.5)[1], [4.0, 0.0, 0.0]);
        // Beyond the ends, the nearest point is an end.
        assert_eq!(chain.project([-3.0, -1.0, 0.0]), 1.0);
        let curve = Curve::Chain(chain);
        assert_eq!(curve.period(), Some(2.0));
        // Past the seam.
        let line = curve.polyline([1.5, 2.5], 1e-3);
        assert!(distance(line[0], [0.0; 3]) < 1e-14);
        assert!(line.iter().any(|p| distance(*p, [2.0, 0.0, 0.0]) < 1e-14));
        assert!(distance(line[line.len() - 1], [0.0, 2.0, 0.0]) < 1e-14);
    }

    #[test]
    fn pieces_of_a_closed_chain_are_turned_over_where_they_meet_so() {
        let right = half();
        for turned in [vec![0], vec![1], vec![0, 1]] {
            let mut links = right.clone();
            turned.iter().for_each(|&k: &usize| links[k].range.reverse());
            let links = closed(links).unwrap();
            assert!(CurveChain::new(links).is_some(), "{turned:?}");
        }
        assert_eq!(closed(right[..1].to_vec()), None);
        assert_eq!(closed(Vec::new()), None);
    }

    #[test]
    fn pieces_that_do_not_meet_are_no_chain() {
        let mut links = half();
        links[1].range = [-1.9, 2.0];
        assert_eq!(CurveChain::new(links), None);
        assert_eq!(CurveChain::new(Vec::new()), None);
    }
}
