//! A small problem, and the referee's cost of its best light.

use lamp_planning::solver::{Operator, Problem, Role, Search, Shape, Solution, Terms, solve};
use lamp_planning::{Blur, LayerLight, Real};
use microlp::{ComparisonOp, OptimizationDirection};

/// A block of voxels with the role of each.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) sigma: f64,
    /// From the light.
    pub(crate) layers: Vec<LayerLight>,
    /// Layer by layer from the light, row by row, without padding.
    pub(crate) roles: Vec<Role>,
    pub(crate) margin: f64,
    pub(crate) short_price: f64,
    pub(crate) least_light: f64,
}

impl Case {
    fn shape(&self) -> Shape {
        Shape::holding(self.layers.len(), self.rows, self.columns)
    }

    /// Returns the places of voxels in padded images.
    pub(crate) fn padded(&self) -> impl Iterator<Item = usize> + use<> {
        let (width, columns) = (self.shape().width, self.columns);
        (0..self.roles.len()).map(move |voxel| voxel / columns * width + voxel % columns)
    }

    pub(crate) fn problem<T: Real>(&self) -> Problem<T> {
        let shape = self.shape();
        let mut roles = vec![Role::NONE; shape.voxels()];
        for (at, &role) in self.padded().zip(&self.roles) {
            roles[at] = role;
        }
        Problem {
            operator: Operator::new(shape, Blur::new(self.sigma), self.layers.clone()),
            roles,
            incoming: vec![T::default(); shape.voxels()],
            terms: Terms {
                least: T::of(1.0 + self.margin),
                short_price: T::of(self.short_price),
                most: T::of(1.0 - self.margin),
                least_light: T::of(self.least_light),
            },
        }
    }

    /// Solves the problem to a gap, as a share of the cost of white light.
    pub(crate) fn solve<T: Real>(&self, gap: f64) -> (Solution<T>, f64) {
        let problem = self.problem::<T>();
        let white = problem.brightest();
        let mut doses = vec![T::default(); white.len()];
        problem.operator.doses(&white, &mut doses);
        let unplanned = problem.cost(&doses);
        let prices = vec![T::default(); white.len()];
        let until = Search { gap: gap * unplanned, iterations: 50_000 };
        (solve(&problem, white, prices, until), unplanned)
    }

    /// Returns the dose of a voxel from light 1 of a pixel.
    fn dose(&self, voxel: usize, pixel: usize) -> f64 {
        let place = |n: usize| {
            let plane = self.rows * self.columns;
            (n / plane, (n % plane / self.columns) as f64, (n % self.columns) as f64)
        };
        let ((k, y, x), (n, m, l)) = (place(voxel), place(pixel));
        if n > k {
            return 0.0;
        }
        let passed: f64 = self.layers[n + 1..=k].iter().map(|layer| layer.passed).product();
        let squared = (x - l).powi(2) + (y - m).powi(2);
        passed * self.layers[n].own * (-squared / (2.0 * self.sigma.powi(2))).exp()
    }

    /// Returns the doses of all voxels from the light of all pixels.
    pub(crate) fn doses(&self, light: &[f64]) -> Vec<f64> {
        let of_voxel = |voxel| {
            light.iter().enumerate().map(|(pixel, light)| light * self.dose(voxel, pixel)).sum()
        };
        (0..light.len()).map(of_voxel).collect()
    }

    /// Returns the cost of doses.
    pub(crate) fn cost(&self, doses: &[f64]) -> f64 {
        let cost = |(role, dose): (&Role, f64)| {
            let short = (1.0 + self.margin - dose).max(0.0) * self.short_price;
            let over = (dose - 1.0 + self.margin).max(0.0);
            let paid = [(Role::CURED, short), (Role::UNCURED, over), (Role::DARK, dose)];
            paid.iter().filter(|(flag, _)| role.has(*flag)).map(|(_, cost)| cost).sum::<f64>()
        };
        self.roles.iter().zip(doses.iter().copied()).map(cost).sum()
    }

    /// Returns the least cost, by the simplex method.
    pub(crate) fn optimum(&self) -> f64 {
        let mut program = microlp::Problem::new(OptimizationDirection::Minimize);
        let voxels = 0..self.roles.len();
        let is = |voxel: usize, flag| self.roles[voxel].has(flag);
        let pixels: Vec<_> = voxels
            .clone()
            .filter(|&pixel| is(pixel, Role::LIT))
            .map(|pixel| {
                let low = match self.roles[pixel] {
                    role if role.has(Role::WHITE) => 1.0,
                    role if role.has(Role::NEVER_DIM) => self.least_light,
                    _ => 0.0,
                };
                let dark = voxels.clone().filter(|&voxel| is(voxel, Role::DARK));
                let price = dark.map(|voxel| self.dose(voxel, pixel)).sum();
                (pixel, program.add_var(price, (low, 1.0)))
            })
            .collect();
        for voxel in voxels {
            let bounds = [
                (Role::CURED, self.short_price, 1.0, ComparisonOp::Ge, 1.0 + self.margin),
                (Role::UNCURED, 1.0, -1.0, ComparisonOp::Le, 1.0 - self.margin),
            ];
            for (_, price, sign, order, aim) in bounds.into_iter().filter(|b| is(voxel, b.0)) {
                let wrong = program.add_var(price, (0.0, f64::INFINITY));
                let terms = pixels.iter().map(|&(pixel, light)| (light, self.dose(voxel, pixel)));
                program.add_constraint(terms.chain([(wrong, sign)]), order, aim);
            }
        }
        let solution = program.solve().expect("every light is feasible");
        solution.into_solution().expect("nothing limits the time").objective()
    }
}
