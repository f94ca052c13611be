//! Bodies of one color as layers are added: which ones a layer continues, unites, begins and ends.

use lamp_stack::sets::{root, unite};

use super::contact::{Joint, Labelled};

const NONE: u32 = u32::MAX;

/// The bodies that the last layer is part of.
#[derive(Debug)]
pub(super) struct Live<B> {
    is_white: bool,
    bodies: Vec<B>,
    /// The body of each component of the last layer that has the color.
    of_component: Vec<u32>,
}

/// The effect of a layer on the bodies.
pub(super) struct Next<B> {
    /// The bodies that the layer continues, grouped as it unites them, with the components that
    /// continue them. A group without a body begins one.
    pub(super) groups: Vec<Group<B>>,
    /// The bodies that the layer does not continue.
    pub(super) ended: Vec<B>,
}

pub(super) struct Group<B> {
    pub(super) bodies: Vec<B>,
    pub(super) components: Vec<u32>,
}

impl<B> Live<B> {
    pub(super) fn new(is_white: bool) -> Self {
        Self { is_white, bodies: Vec::new(), of_component: Vec::new() }
    }

    /// Adds a layer, given what it has in common with the last one. The groups are in the order
    /// of their first components; [`put`](Self::put) takes the bodies that they become.
    pub(super) fn add(&mut self, layer: &Labelled, joints: &[Joint]) -> Next<B> {
        let bodies = std::mem::take(&mut self.bodies);
        let below = std::mem::take(&mut self.of_component);
        let mut parents: Vec<u32> = (0..bodies.len() as u32).collect();
        let mut body_of = vec![NONE; layer.components.all.len()];
        let mut is_continued = vec![false; bodies.len()];
        for joint in joints.iter().filter(|joint| layer.is_white(joint.component) == self.is_white)
        {
            let body = below[joint.below as usize];
            is_continued[body as usize] = true;
            match &mut body_of[joint.component as usize] {
                first if *first == NONE => *first = body,
                first => *first = unite(&mut parents, *first, body),
            }
        }
        let mut groups: Vec<Group<B>> = Vec::new();
        let mut group_of = vec![NONE; bodies.len()];
        self.of_component = vec![NONE; body_of.len()];
        for (component, body) in (0..).zip(body_of) {
            if layer.is_white(component) != self.is_white {
                continue;
            }
            // Each component that is on no body begins a group of its own.
            let mut begun = NONE;
            let group = match body {
                NONE => &mut begun,
                body => &mut group_of[root(&mut parents, body) as usize],
            };
            if *group == NONE {
                *group = groups.len() as u32;
                groups.push(Group { bodies: Vec::new(), components: Vec::new() });
            }
            self.of_component[component as usize] = *group;
            groups[*group as usize].components.push(component);
        }
        let mut ended = Vec::new();
        for (body, number) in bodies.into_iter().zip(0..) {
            if is_continued[number as usize] {
                let group = group_of[root(&mut parents, number) as usize];
                groups[group as usize].bodies.push(body);
            } else {
                ended.push(body);
            }
        }
        Next { groups, ended }
    }

    /// Adds the body that the next group has become.
    pub(super) fn put(&mut self, body: B) {
        self.bodies.push(body);
    }

    /// Returns the body of each component of the last layer; `None` for the other color.
    pub(super) fn of_components(&self) -> impl Iterator<Item = Option<&B>> {
        // The other color has `NONE`, which is beyond any list.
        self.of_component.iter().map(|&body| self.bodies.get(body as usize))
    }

    /// Returns the body of a component of the last layer.
    pub(super) fn body_mut(&mut self, component: u32) -> Option<&mut B> {
        let body = self.of_component[component as usize];
        self.bodies.get_mut(body as usize)
    }

    /// Returns the bodies that the last layer is part of.
    pub(super) fn finish(self) -> Vec<B> {
        self.bodies
    }
}
