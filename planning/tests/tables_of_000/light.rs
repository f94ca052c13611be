//! The light of mirrors: 000's rays counted one by one, and exact light from its integral.

use lamp_planning::column::{GlassLight, Setup, Tracing};

use super::zhao::{LIT, PITCH_UM, RAYS, setup, zhao};

/// Light of a mirror on all column voxels.
fn light_of(light: &GlassLight, mirror: usize) -> Vec<f64> {
    let count = light.setup().mirrors.iter().product();
    let on: Vec<_> = (0..count).map(|other| f64::from(u8::from(other == mirror))).collect();
    light.doses(&on)
}

/// Equations 3.11 and 3.12, ray by ray: the light of 9 x 9 points in 15 x 15 directions.
fn counted(setup: &Setup, mirror: usize, cone_um: f64, rays: [usize; 2]) -> Vec<f64> {
    let [points, directions] = rays;
    let place = |axis: usize, mirror: usize, point: usize, direction: usize| {
        let middle = (mirror as f64 - (setup.mirrors[axis] as f64 - 1.0) / 2.0) * setup.pitch_um;
        let point = ((point as f64 + 0.5) / points as f64 - 0.5) * setup.lit_um;
        let direction = cone_um * (2.0 * direction as f64 / (directions - 1) as f64 - 1.0);
        let voxel = (middle + point + direction) / setup.voxel_um + setup.voxels[axis] as f64 / 2.0;
        (0.0..setup.voxels[axis] as f64).contains(&voxel).then_some(voxel as usize)
    };
    let all = (points * directions).pow(2) as f64;
    let ray = setup.irradiance * (setup.pitch_um / setup.voxel_um).powi(2) / all;
    let mut light = vec![0.0; setup.voxels.iter().product()];
    for ray_number in 0..(points * directions).pow(2) {
        let [along, down] =
            [ray_number % (points * directions), ray_number / (points * directions)];
        let x = place(0, mirror % setup.mirrors[0], along % points, along / points);
        let y = place(1, mirror / setup.mirrors[0], down % points, down / points);
        if let Some((x, y)) = x.zip(y) {
            light[y * setup.voxels[0] + x] += ray;
        }
    }
    light
}

fn assert_near(found: &[f64], wanted: &[f64], tolerance: f64) {
    for (voxel, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        assert!((found - wanted).abs() <= tolerance, "voxel {voxel}: {found} for {wanted}");
    }
}

#[test]
fn rays_are_those_that_are_counted_one_by_one() {
    for (mirrors, voxels, pitch, cone) in [(5, 13, PITCH_UM, 12.0), (7, 8, 11.85, 5.0)] {
        let setup = setup(mirrors, voxels, pitch, cone, RAYS);
        let light = GlassLight::new(setup.clone());
        for mirror in [0, mirrors / 2, mirrors * mirrors / 2, mirrors * mirrors - 2] {
            let counted = counted(&setup, mirror, cone, [9, 15]);
            assert_near(&light_of(&light, mirror), &counted, 1e-12);
        }
    }
}

#[test]
fn a_mirror_near_the_middle_has_these_rays() {
    // Computed separately from this code: rays along an axis on the voxels from 147.
    let light = GlassLight::new(zhao(151, 300, RAYS));
    let rays = [4.0, 21.0, 42.0, 43.0, 21.0, 4.0];
    let found = light_of(&light, 75 * 151 + 75);
    for (row, of_row) in rays.iter().enumerate() {
        for (column, of_column) in rays.iter().enumerate() {
            let wanted = of_row * of_column * 8.0275e-11 / 1e-6;
            let voxel = (147 + row) * 300 + 147 + column;
            assert!((found[voxel] / wanted - 1.0).abs() < 1e-9, "{} for {wanted}", found[voxel]);
        }
    }
    assert_eq!(light.reaching(), [21..130, 21..130]);
}

#[test]
fn exact_light_is_the_limit_of_many_rays() {
    let (exact, cone) = (zhao(3, 13, Tracing::Exact), 12.0);
    let many = Tracing::Rays { points: 3000, directions: 3001 };
    let [exact, many] = [exact, zhao(3, 13, many)].map(GlassLight::new);
    for mirror in 0..9 {
        assert_near(&light_of(&exact, mirror), &light_of(&many, mirror), 2e-4);
    }
    // And the integral, by hand: a box of `lit` and one of the cone, convolved.
    let [lit, cone] = [LIT * PITCH_UM, 2.0 * cone];
    let square = |t: f64| t.max(0.0).powi(2) / 2.0;
    let below = |um: f64| {
        let [half, less] = [(lit + cone) / 2.0, (lit - cone) / 2.0];
        let parts = square(um + half) + square(um - half) - square(um + less) - square(um - less);
        parts / (lit * cone)
    };
    let light = light_of(&exact, 4);
    let white = exact.setup().irradiance * (PITCH_UM / 10.0).powi(2);
    let share = |voxel: usize| {
        let edge = |voxel: usize| below((voxel as f64 - 6.5) * 10.0);
        edge(voxel + 1) - edge(voxel)
    };
    let wanted: Vec<_> = (0..169).map(|v| white * share(v % 13) * share(v / 13)).collect();
    assert_near(&light, &wanted, 1e-12);
}

#[test]
fn all_light_of_a_mirror_arrives() {
    for tracing in [RAYS, Tracing::Exact] {
        let light = GlassLight::new(setup(9, 40, 11.85, 12.0, tracing));
        let white = light.setup().irradiance * (11.85_f64 / 10.0).powi(2);
        for mirror in 0..81 {
            let all: f64 = light_of(&light, mirror).iter().sum();
            assert!((all / white - 1.0).abs() < 1e-12, "mirror {mirror}: {all} for {white}");
        }
    }
}

#[test]
fn a_white_field_is_as_uneven_as_000_says() {
    // 5.2.2: 0.305e-3 of 7.721e-3 mW/cm2, on the part of 350 x 350 voxels.
    let light = GlassLight::new(zhao(151, 350, RAYS));
    let field = light.doses(&vec![1.0; 151 * 151]);
    let mean = field.iter().sum::<f64>() / field.len() as f64;
    let spread = super::zhao::rms(field.iter().map(|light| light - mean));
    let percent = 100.0 * spread / mean;
    assert!((percent / 3.95 - 1.0).abs() < 0.25, "{percent} %");
    assert!((mean - 0.1882).abs() < 1e-4, "{mean}");
}

#[test]
fn edge_voxels_are_dark_until_there_are_six_more_mirrors() {
    // 4.3.1.2: 161 mirrors on 200 pixels, then 167.
    let dark = |mirrors: usize| {
        let light = GlassLight::new(setup(mirrors, 200, 11.85, 5.0, RAYS));
        let field = light.doses(&vec![1.0; mirrors * mirrors]);
        let middle = &field[100 * 200..][..200];
        let [from_left, from_right] = [
            middle.iter().take_while(|light| **light == 0.0).count(),
            middle.iter().rev().take_while(|light| **light == 0.0).count(),
        ];
        [from_left, from_right]
    };
    assert_eq!(dark(161), [4, 4]);
    assert_eq!(dark(167), [0, 0]);
}
