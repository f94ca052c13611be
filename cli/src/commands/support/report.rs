//! Reports planned supports in lines for people.

use std::f64::consts::PI;

use lamp_machine::Recoating;
use lamp_pipeline::heights::significant;
use lamp_supports::{Findings, HeldPlace, IslandPlan, Rejection, Rod, Scale, Support, SupportPlan};

use super::hints::Hint;
use crate::terminal::progress::Progress;

/// The most islands that are printed, unless all are asked for.
const MOST_LINES: usize = 20;

/// The plans for the islands of a stack.
pub(super) struct SupportReport<'a> {
    pub(super) plan: &'a SupportPlan,
    /// Islands that are too many to be listed, and so are left.
    pub(super) unlisted: u64,
    pub(super) found: &'a Findings,
    pub(super) scale: Scale<'a>,
    pub(super) shear_pa: Option<f64>,
    pub(super) least_support: f64,
    /// Options that hold islands that are left, as tried.
    pub(super) hints: &'a [Hint],
}

impl<'a> SupportReport<'a> {
    pub(super) fn new(
        plan: &'a SupportPlan,
        found: &'a Findings,
        recoating: Option<&Recoating>,
        least_support: f64,
        hints: &'a [Hint],
    ) -> Self {
        let unlisted = found.islands.left_out;
        let shear_pa = recoating.map(Recoating::greatest_shear_pa);
        Self { plan, unlisted, found, scale: Scale::new(found), shear_pa, least_support, hints }
    }

    /// Prints what is done: first of all what that means.
    pub(super) fn tell(&self, progress: &Progress) {
        let sizes = |are_pillars: bool| {
            let supports = || self.supports().filter(move |it| it.is_pillar() == are_pillars);
            let length: f64 = supports().map(|support| support.length().mm()).sum();
            let volume: f64 = supports().map(Support::volume_mm3).sum();
            let sizes =
                format!("{} mm long and {} mm3 in all", significant(length), significant(volume));
            (supports().count(), sizes)
        };
        if let (count @ 1.., sizes) = sizes(false) {
            let stay = match count {
                1 => "1 support stays in the mold and becomes a feature of the casting".to_owned(),
                count => {
                    format!("{count} supports stay in the mold and become features of the casting")
                }
            };
            progress.say(&format!("{stay}, {sizes}, so look at each"));
        }
        if let (count @ 1.., sizes) = sizes(true) {
            let stand = if count == 1 { "pillar stands" } else { "pillars stand" };
            let braces = match self.plan.braces.rods.len() {
                0 => String::new(),
                1 => ", with 1 brace".to_owned(),
                braces => format!(", with {braces} braces"),
            };
            progress.say(&format!("{count} {stand} on the platform, {sizes}{braces}"));
        }
        if !self.plan.overhangs.is_empty() {
            let (all, bare) = (self.plan.overhangs.len(), self.bare().count());
            let places = if all == 1 { "place of an underside" } else { "places of undersides" };
            progress.say(&format!("{} of {all} {places} have supports", all - bare));
        } else if self.plan.islands.is_empty() {
            progress.say("there are no islands, and the layers stay as they are");
        }
        for (number, plan) in self.plan.islands.iter().enumerate() {
            let line = self.line(plan);
            if number < MOST_LINES {
                progress.say(&line);
            } else {
                progress.detail(&line);
            }
            let places = plan.places.iter().filter(|_| plan.places.len() > 1);
            places.for_each(|place| progress.detail(&place_line(place)));
        }
        let more = self.plan.islands.len().saturating_sub(MOST_LINES);
        if more > 0 && !progress.is_verbose() {
            progress.say(&format!("{more} more islands (--verbose or --report lists them)"));
        }
    }

    /// Returns a line for each reason that a person must look at the stack.
    pub(super) fn troubles(&self) -> Vec<String> {
        [
            self.text_of_stray_rows(),
            self.text_of_left(),
            self.text_of_weak(),
            self.text_of_alone(),
            self.text_of_bare(),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn text_of_stray_rows(&self) -> Option<String> {
        let stray = self.found.layers.iter().map(|layer| layer.stray_rows).filter(|rows| *rows > 0);
        let (rows, layers) = (stray.clone().map(u64::from).sum::<u64>(), stray.count());
        let rows = if rows == 1 { "1 stray row".to_owned() } else { format!("{rows} stray rows") };
        let layers = if layers == 1 { "1 layer".to_owned() } else { format!("{layers} layers") };
        (self.stray_rows() > 0).then(|| {
            format!("{rows} in {layers} may look like islands and get supports: correct them with fix first")
        })
    }

    pub(super) fn stray_rows(&self) -> u64 {
        self.found.layers.iter().map(|layer| u64::from(layer.stray_rows)).sum()
    }

    /// Returns the number of islands that rest on too little.
    pub(super) fn weak(&self) -> impl Iterator<Item = &IslandPlan> + Clone {
        self.plan.islands.iter().filter(|plan| plan.is_weak(self.least_support))
    }

    fn place_of(&self, plan: &IslandPlan) -> String {
        let island = &plan.island;
        let layer = self.scale.layer(island.layer);
        format!(", the first in {layer} at {}", self.scale.point(island.centroid))
    }

    /// Returns a line that sums up the islands that rest on too little, if some do.
    fn text_of_weak(&self) -> Option<String> {
        let mut weak = self.weak();
        let count = weak.clone().count();
        let first = self.place_of(weak.next()?);
        let rest = if count == 1 { "island rests" } else { "islands rest" };
        let percent = significant(100.0 * self.least_support);
        Some(format!(
            "{count} {rest} on less than {percent}% of the first layer{first}: allow more with \
             --max-length or --max-tilt, or give a larger --radius or a lower --least-support"
        ))
    }

    /// Returns a line about undersides without supports, if there are some.
    fn text_of_bare(&self) -> Option<String> {
        let count = self.bare().count();
        let [x, y, z] = self.bare().next()?.origin_mm;
        let places =
            if count == 1 { "place of an underside is" } else { "places of undersides are" };
        let causes = causes(&self.bare().cloned().collect::<Vec<_>>());
        Some(format!(
            "{count} {places} left without a support, the first at x {x:.2}, y {y:.2}, z {z:.2} mm{causes}"
        ))
    }

    /// Returns a line about slender pillars without braces, if there are some.
    fn text_of_alone(&self) -> Option<String> {
        let are = match self.plan.braces.alone {
            0 => return None,
            1 => "1 pillar is".to_owned(),
            count => format!("{count} pillars are"),
        };
        Some(format!(
            "{are} higher than 15 diameters and too far from others for braces: give a larger --pillar"
        ))
    }

    /// Returns a line that sums up the islands that are left, if some are.
    fn text_of_left(&self) -> Option<String> {
        let mut left = self.plan.islands.iter().filter(|plan| plan.is_left());
        let count = left.clone().count() as u64 + self.unlisted;
        let first = left.next().map(|plan| self.place_of(plan));
        let are = if count == 1 { "island is" } else { "islands are" };
        let first = first.unwrap_or_default();
        let helps = match self.hints {
            [] => "no option that was tried holds one".to_owned(),
            hints => {
                let hint = |hint: &Hint| match hint.islands as u64 {
                    islands if islands == count => format!("{} holds all", hint.options),
                    islands => format!("{} holds {islands} of them", hint.options),
                };
                hints.iter().map(hint).collect::<Vec<_>>().join(", ")
            }
        };
        (count > 0).then(|| {
            format!("{count} {are} left floating{first}: {helps}; or turn or change the part")
        })
    }

    pub(super) fn supports(&self) -> impl Iterator<Item = &Support> {
        self.plan.supports()
    }

    /// Returns the area of the part that rests on supports in mm²: of islands in their first layers,
    /// and below undersides.
    pub(super) fn contact_mm2(&self) -> Option<f64> {
        let rests = self.plan.islands.iter().map(|plan| plan.rests.pixels).sum();
        let supports = self.plan.overhangs.iter().filter_map(|place| place.supports.first());
        let area = |support: &Support| PI / 4.0 * support.rods[0].diameters[0].mm().powi(2);
        Some(self.scale.area(rests).area_mm2? + supports.map(area).sum::<f64>())
    }

    /// Returns the places of undersides without a support.
    pub(super) fn bare(&self) -> impl Iterator<Item = &HeldPlace> {
        self.plan.overhangs.iter().filter(|place| place.supports.is_empty())
    }

    pub(super) fn volume_mm3(&self) -> f64 {
        let braces: f64 = self.plan.braces.rods.iter().map(Rod::volume_mm3).sum();
        self.supports().map(Support::volume_mm3).sum::<f64>() + braces
    }

    /// Returns how hard the blade drags on what each support of an island holds, in millinewtons.
    pub(super) fn drag_mn(&self, plan: &IslandPlan) -> Option<f64> {
        let drag = self.scale.drag_mn(&plan.island, self.shear_pa)?;
        Some(drag / plan.supports().count().max(1) as f64)
    }

    fn line(&self, plan: &IslandPlan) -> String {
        let island = &plan.island;
        let (layer, at) = (self.scale.layer(island.layer), self.scale.point(island.centroid));
        let start = format!("island {} in {layer} at {at}: ", island.number);
        if let [place] = &plan.places[..] {
            return start + &held(place, self.drag_mn(plan)) + &rests(plan);
        }
        let (held, all) = (plan.supports().count(), plan.places.len());
        if held == 0 {
            return format!("{start}no way from any of {all} places{}", causes(&plan.places));
        }
        let lengths = || plan.supports().map(|support| support.length().mm());
        format!(
            "{start}held in {held} of {all} places, {:.2} to {:.2} mm away, {} mm3{}{}{}",
            lengths().fold(f64::INFINITY, f64::min),
            lengths().fold(0.0, f64::max),
            significant(plan.supports().map(Support::volume_mm3).sum()),
            drag_text(self.drag_mn(plan), ", each holds"),
            causes(&plan.places),
            rests(plan),
        )
    }
}

/// Returns how much of an island rests on its supports.
fn rests(plan: &IslandPlan) -> String {
    match (plan.supports().next(), plan.stands) {
        (None, _) => String::new(),
        (Some(_), true) => format!("; {}% of it rests on them", significant(plan.rests.percent())),
        (Some(_), false) => "; it floats even so".to_owned(),
    }
}

fn place_line(place: &HeldPlace) -> String {
    let [x, y, _] = place.origin_mm;
    format!("  at x {x:.2}, y {y:.2} mm: {}", held(place, None))
}

/// Returns how a place is held.
fn held(place: &HeldPlace, drag_mn: Option<f64>) -> String {
    let causes = causes(std::slice::from_ref(place));
    let Some(support) = place.supports.first() else { return format!("no way{causes}") };
    let [x, y, z] = support.contact_mm();
    format!(
        "held {:.2} mm away at x {x:.2}, y {y:.2}, z {z:.2} mm, tilt {:.0} degrees, {} mm3{}{causes}",
        support.length().mm(),
        support.tilt,
        significant(support.volume_mm3()),
        drag_text(drag_mn, ", holds"),
    )
}

fn drag_text(drag_mn: Option<f64>, holds: &str) -> String {
    drag_mn.map_or(String::new(), |mn| format!("{holds} {} mN", significant(mn)))
}

/// Returns why directions failed: `; rejected: 12 too far, 3 near a crease`.
fn causes(places: &[HeldPlace]) -> String {
    let words = |cause: Rejection| match cause {
        Rejection::Far => "too far",
        Rejection::Edge => "near a crease",
        Rejection::Curved => "on a curve",
        Rejection::Crossing => "beside another support",
        Rejection::Blocked => "through other solid",
        Rejection::Through => "out of the part again",
        Rejection::Unsteady => "not steady",
        Rejection::Avoided => "on a surface to avoid",
        Rejection::NoColumn => "without a free column",
    };
    let rejected = || places.iter().flat_map(|place| &place.rejected);
    let causes = Rejection::ALL.iter().filter_map(|&cause| {
        let counts = rejected().filter(|(other, _)| *other == cause).map(|(_, count)| count);
        let count: u32 = counts.sum();
        (count > 0).then(|| format!("{count} {}", words(cause)))
    });
    let causes: Vec<String> = causes.collect();
    if causes.is_empty() { String::new() } else { format!("; rejected: {}", causes.join(", ")) }
}
