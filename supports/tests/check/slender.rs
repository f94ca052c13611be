//! Pins and holes of known length and width, slots on both sides of the cure width, and layers that do not
//! bond.

use std::sync::Arc;

use lamp_fixtures::drawn_mask as drawn;
use lamp_stack::{Layer, Mask, PageInfo, Pitch};
use lamp_supports::{
    AspectRule, BondRule, CheckError, CheckOptions, Findings, LayerCure, LayerLight, LeastWidth,
    SlenderFeature, WeakBond, WidthRule, check,
};

/// The width of a pixel at 1500 dpi, in micrometers.
const PIXEL_UM: f64 = 25_400.0 / 1500.0;

fn found(layers: Vec<(f64, Mask)>, options: &CheckOptions) -> Findings {
    let pitch = Pitch::of_dpi(1500.0);
    let layer = |(index, (um, mask)): (u32, (f64, Mask))| {
        let info = PageInfo { index, thickness_um: Some(um), ..PageInfo::default() };
        Ok::<_, CheckError>(Layer { info, pitch, image: mask.into() })
    };
    check((0..).zip(layers).map(layer), Ok, options).unwrap()
}

/// Checks layers by a rule of aspect ratio.
fn slender(layers: Vec<Mask>, thickness_um: f64, most: f64) -> Vec<SlenderFeature> {
    let (name, source) = ("slender".to_owned(), "the test".to_owned());
    let aspects = vec![AspectRule { name, most, widest: None, source }];
    let options = CheckOptions { aspects, ..CheckOptions::default() };
    let layers = layers.into_iter().map(|mask| (thickness_um, mask)).collect();
    found(layers, &options).slender.list
}

/// A round pin of any color that leans has its length along its axis over its diameter.
#[test]
fn a_pin_that_leans_has_its_length_over_its_width() {
    for (radius, degrees, count) in
        [(10.0, 0.0, 40), (10.0, 30.0, 40), (20.3, 45.0, 60), (8.0, 60.0, 50_u32)]
    {
        for is_white in [true, false] {
            let (thickness, lean) = (50.0_f64, f64::to_radians(degrees));
            let step = thickness / PIXEL_UM * lean.tan();
            let side = (step * f64::from(count)).ceil() as u32 + 120;
            // A section across its axis is round; a layer's is an ellipse.
            let pin = |layer: u32| {
                drawn([side, 100], |[x, y]| {
                    let x = (x - 50.0 - step * f64::from(layer)) * lean.cos();
                    (x.hypot(y - 50.0) < radius) == is_white
                })
            };
            let length = f64::from(count) * thickness / PIXEL_UM / lean.cos();
            let ratio = length / (2.0 * radius);
            for (most, is_found) in [(0.88 * ratio, true), (1.08 * ratio, false)] {
                let found = slender((0..count).map(pin).collect(), thickness, most);
                assert_eq!(found.len(), usize::from(is_found), "{radius} {degrees}: {found:?}");
                for pin in found {
                    assert_eq!((pin.is_white, pin.layers), (is_white, [0, count - 1]));
                    assert!((pin.length / length - 1.0).abs() < 0.03, "{length}: {pin:?}");
                    assert!((pin.width - 2.0 * radius).abs() < 1.5, "{radius}: {pin:?}");
                }
            }
        }
    }
}

/// A pin begins on its block, however wide or compact the block is, and ends where it meets another.
#[test]
fn a_pin_on_a_block_has_its_own_length() {
    for block in [30.0, 45.0, 90.0] {
        let layers = (0..60).map(|layer| {
            drawn([200; 2], |[x, y]| {
                let is_block = layer < 10 && (x - 100.0).abs().max((y - 100.0).abs()) < block;
                let is_plate =
                    layer >= 50 && (y - 100.0).abs() < 20.0 && (20.0..180.0).contains(&x);
                let is_pin = (x - 100.0).hypot(y - 100.0) < 10.0;
                is_block || is_plate || is_pin
            })
        });
        let layers: Vec<Mask> = layers.collect();
        // 40 layers of 100 um, 20 pixels wide.
        let ratio = 40.0 * 100.0 / PIXEL_UM / 20.0;
        let found = slender(layers.clone(), 100.0, 0.95 * ratio);
        let [pin] = &found[..] else { panic!("{block}: {found:?}") };
        assert_eq!(pin.layers, [10, 49], "{block}");
        assert!((pin.length / pin.width / ratio - 1.0).abs() < 0.06, "{block}: {pin:?}");
        assert_eq!(slender(layers, 100.0, 1.06 * ratio), [], "{block}");
    }
}

/// A cone is not slender for its tip, and a pin is, for all its collars.
#[test]
fn stretches_count_by_their_widest_layer() {
    let round = |radius: f64| drawn([240; 2], |[x, y]| (x - 120.0).hypot(y - 120.0) < radius);
    let cone: Vec<Mask> = (0..100).map(|layer| round(100.0 - f64::from(layer))).collect();
    assert_eq!(slender(cone, 34.0, 1.2), []);
    let collars = |layer: u32| if layer % 50 < 5 { 40.0 } else { 10.0 };
    let pin: Vec<Mask> = (0..120).map(|layer| round(collars(layer))).collect();
    let found = slender(pin, 2.0 * PIXEL_UM, 4.0);
    let [pin] = &found[..] else { panic!("{found:?}") };
    assert_eq!((pin.layers, pin.widest_layer), ([5, 49], 5));
    assert!((pin.length / pin.width - 4.5).abs() < 0.3, "{pin:?}");
}

/// A pin at the edge of a wide block has its height as its length: the way to it does not count.
#[test]
fn a_pin_off_the_middle_of_a_block_begins_on_it() {
    let block = drawn([240; 2], |[x, y]| (x - 120.0).hypot(y - 120.0) < 100.0);
    let pin = drawn([240; 2], |[x, y]| (x - 190.0).hypot(y - 150.0) < 10.0);
    let layers = [vec![block; 40], vec![pin; 40]].concat();
    let found = slender(layers, 2.0 * PIXEL_UM, 3.0);
    let [pin] = &found[..] else { panic!("{found:?}") };
    assert_eq!((pin.layers, pin.length), ([40, 79], 80.0));
}

/// A wall is no pin, and black that is open to the border is no hole.
#[test]
fn walls_and_open_black_are_no_pins() {
    let wall = drawn([200; 2], |[x, y]| (x - 100.0).abs() < 10.0 && (y - 100.0).abs() < 31.0);
    assert_eq!(slender(vec![wall; 100], 100.0, 2.0), []);
    let notch = drawn([200; 2], |[x, y]| (x - 100.0).abs() > 10.0 || y > 20.0);
    let is_white = |pin: &SlenderFeature| pin.is_white;
    assert!(slender(vec![notch; 100], 100.0, 2.0).iter().all(is_white));
}

/// A light by a closed form: the same depth in all layers, and a width.
#[derive(Debug)]
struct Light {
    depth_um: f64,
    width_um: f64,
}

impl LayerLight for Light {
    fn cure(&self, layer: &PageInfo) -> LayerCure {
        // One layer gets half of the light.
        let share = if layer.index == 7 { 0.5 } else { 1.0 };
        LayerCure {
            needs_others: self.depth_um == 0.0,
            depth_um: Some(share * self.depth_um),
            width_um: Some(share * self.width_um),
            broadening_um: None,
        }
    }
}

/// Slots close below twice the cure width, and stay open above it.
#[test]
fn slots_narrower_than_twice_the_cure_width_close() {
    // Edges grow by 10 pixels, so gaps of up to 20 close.
    let rule = WidthRule {
        name: "closes".to_owned(),
        source: "the test".to_owned(),
        is_of_white: false,
        least: LeastWidth::CureWidths(2.0),
    };
    let light = Light { depth_um: 100.0, width_um: 10.0 * PIXEL_UM };
    let with_light = CheckOptions {
        widths: vec![rule],
        light: Some(Arc::new(light)),
        ..CheckOptions::default()
    };
    for (gap, closes) in [(10.0, true), (17.0, true), (21.0, false), (30.0, false)] {
        let mask = drawn([300; 2], |[x, y]| {
            let is_part = (x - 150.0).abs().max((y - 150.0).abs()) < 120.0;
            let is_gap = (x - 150.0).abs() < gap / 2.0 && (y - 150.0).abs() < 80.0;
            is_part && !is_gap
        });
        let layers = vec![(100.0, mask); 7];
        let list = found(layers.clone(), &with_light).narrow.list;
        assert_eq!(list.len(), usize::from(closes), "{gap}: {list:?}");
        assert!(list.iter().all(|slot| (slot.limit - 20.0).abs() < 1e-6 && !slot.is_white));
        let dark = CheckOptions { light: None, ..with_light.clone() };
        assert_eq!(found(layers, &dark).narrow.list, []);
    }
}

/// A layer that cures less deep than it is thick is found, and one without white is not.
#[test]
fn a_layer_with_too_little_light_does_not_bond() {
    let white = drawn([60; 2], |[x, y]| (x - 30.0).abs().max((y - 30.0).abs()) < 20.0);
    let black = drawn([60; 2], |_| false);
    let bond =
        |layers, name: &str| BondRule { name: name.to_owned(), layers, source: "it".to_owned() };
    let light = Light { depth_um: 150.0, width_um: 0.0 };
    let options = CheckOptions {
        bonds: vec![bond(1.0, "bonds"), bond(1.6, "bonds well")],
        light: Some(Arc::new(light)),
        ..CheckOptions::default()
    };
    let mut layers = vec![(100.0, white); 12];
    // Thin layers cure deep for their thickness.
    layers[3].0 = 90.0;
    let weak = found(layers.clone(), &options).weak_bonds;
    let one = WeakBond { rule: 0, layers: [7; 2], count: 1, worst_layer: 7 };
    let all = WeakBond { rule: 1, layers: [0, 11], count: 11, worst_layer: 7 };
    assert_eq!(weak, [one, all]);
    layers[7].1 = black;
    let weak = found(layers.clone(), &options).weak_bonds;
    assert_eq!(weak, [WeakBond { rule: 1, layers: [0, 11], count: 10, worst_layer: 0 }]);
    // Layers that alone cure nothing are meant to cure together.
    let none = Light { depth_um: 0.0, width_um: 0.0 };
    let options = CheckOptions { light: Some(Arc::new(none)), ..options };
    assert_eq!(found(layers, &options).weak_bonds, []);
}
