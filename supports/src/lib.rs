//! Finds what would be swept away, trapped or bent as a stack is built.
//!
//! [`check`] finds islands (white that rests on nothing), weak joints, overhangs, pockets and
//! bodies off balance, on runs and in one pass.
//!
//! ```
//! use lamp_stack::{Pitch, Layer, Mask, PageInfo};
//! use lamp_supports::{CheckError, CheckOptions, Disagreements, IslandEnd, check};
//!
//! // A post, and a block beside it that begins in layer 1 and joins the post in layer 2.
//! let layer = |transitions: &[u32]| {
//!     let rows = vec![0, 0, transitions.len() as u32, 2 * transitions.len() as u32, 3 * transitions.len() as u32];
//!     let mask = Mask::new(16, rows, transitions.repeat(3)).unwrap();
//!     Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(254.0), image: mask.into() }
//! };
//! let layers = [layer(&[1, 5]), layer(&[1, 5, 9, 12]), layer(&[1, 12])];
//! let layers = layers.into_iter().map(Ok::<_, CheckError>);
//! let found = check(layers, Ok, &CheckOptions::default())?;
//! let [island] = &found.islands.list[..] else { panic!() };
//! assert_eq!((island.layer, island.area, island.centroid), (1, 9, [10.5, 2.5]));
//! assert_eq!(island.end, IslandEnd::JoinsPart { layer: 2 });
//! # Ok::<(), CheckError>(())
//! ```

mod check;
mod features;
mod orient;
mod record;
mod support;

pub use check::{
    AspectRule, BondRule, CheckError, CheckOptions, DesignRules, Disagreements, Findings, HeldAt,
    Island, IslandEnd, IslandMinimum, LayerCure, LayerFacts, LayerLight, LeastWidth,
    LeastWidthRule, Listed, LoneMinimum, NarrowFeature, OffBalance, Overhang, Pocket, PocketEffect,
    PocketKind, Region, RuleError, SlenderFeature, WeakBond, WeakJoint, WidthRule, check,
    check_build, component_at, components_beyond, inner_components,
};
pub use features::{Feature, Severity, features};
pub use orient::{Pose, PoseFacts, PoseLimits, measure, pareto, poses};
pub use record::{
    AcceptedFindings, AreaRecord, BondRecord, BorderRecord, BoxRecord, CopyRecord,
    DoubtfulIslandRecord, EmptyPlace, EmptyRecord, FindingGroup, FindingRecord, FoundPixels,
    IslandRecord, Joined, JointRecord, LayerPlace, LayerSpan, MinimumRecord, NarrowRecord,
    OffBalanceRecord, OverhangRecord, PartWord, PocketRecord, PointRecord, Scale, Shown,
    ShownMoment, SlenderRecord, StrayRowsRecord, records,
};
pub use support::{
    AvoidError, AvoidedBox, AvoidedSurface, Braces, HeldPlace, IslandPlan, PillarSizes, Rejection,
    Rod, Support, SupportError, SupportFoot, SupportOptions, SupportPlan, SupportShare, Surface,
    Vent, VentPlan, avoided_surfaces, flood_supports, padded, plan_braces, plan_supports,
    plan_vents, room_for,
};
