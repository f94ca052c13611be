//! Makes the shapes of apertures: circles, rectangles, obrounds, polygons and macros.

use std::collections::HashMap;
use std::f64::consts::{SQRT_2, TAU};
use std::rc::Rc;

use super::areas::{Area, Primitive, circle};
use crate::contours::curves::{check, chords_of_arc};
use crate::contours::error::ContourFault;
use crate::contours::rows::{IDENTITY, at, sin_cos};
use crate::prisms::Ring;

/// The deepest nesting of parentheses.
const MAX_DEPTH: usize = 64;

/// An aperture in the file's unit.
#[derive(Debug)]
pub(super) struct Aperture {
    template: Template,
    numbers: Vec<f64>,
    pub(super) unit_mm: f64,
}

#[derive(Debug)]
enum Template {
    Circle,
    Rectangle,
    Obround,
    Polygon,
    Macro(Rc<Macro>),
}

/// How an aperture draws lines.
pub(super) enum Pen {
    /// A circle of this diameter.
    Circle(f64),
    /// A convex polygon.
    Convex(Ring),
}

impl Aperture {
    /// Reads the name of a template and its numbers, as `R,1X0.5`.
    pub(super) fn new(
        text: &str,
        unit_mm: f64,
        macros: &HashMap<String, Rc<Macro>>,
    ) -> Result<Self, ContourFault> {
        let (name, numbers) = text.split_once(',').unwrap_or((text, ""));
        let numbers = numbers.split(['X', 'x']).map(str::trim).filter(|it| !it.is_empty());
        let numbers: Vec<f64> = numbers.map(decimal).collect::<Result<_, _>>()?;
        let name = name.trim();
        let (template, most) = match name {
            "C" => (Template::Circle, 1..=3),
            "R" => (Template::Rectangle, 2..=4),
            "O" => (Template::Obround, 2..=4),
            "P" => (Template::Polygon, 2..=5),
            _ => match macros.get(name) {
                Some(of) => (Template::Macro(of.clone()), 0..=usize::MAX),
                None => return Err(ContourFault::Missing(super::named("macro", name))),
            },
        };
        let is_length = |(k, number): (usize, &f64)| {
            *number >= 0.0
                || matches!((&template, k), (Template::Polygon, 2) | (Template::Macro(_), _))
        };
        if !most.contains(&numbers.len()) || !numbers.iter().enumerate().all(is_length) {
            return Err(ContourFault::Malformed("an aperture with its lengths"));
        }
        Ok(Self { template, numbers, unit_mm })
    }

    /// Returns the work of making its shape: the size of its macro.
    pub(super) fn work(&self) -> u64 {
        match &self.template {
            Template::Macro(of) => of.statements.iter().map(Statement::size).sum(),
            _ => 1,
        }
    }

    /// Returns its primitives, in its unit.
    pub(super) fn primitives(
        &self,
        tolerance: f64,
        steps_left: &mut u64,
    ) -> Result<Vec<Primitive>, ContourFault> {
        let outline = match &self.template {
            Template::Macro(of) => return of.primitives(&self.numbers, tolerance, steps_left),
            _ => self.outline(tolerance)?,
        };
        let mut primitives = Vec::new();
        primitives.extend(outline.map(|ring| Primitive::convex(true, ring)));
        let hole = match *self.hole() {
            [x] if x > 0.0 => Some(circle([0.0; 2], x / 2.0, tolerance)?),
            [x, y] if x > 0.0 && y > 0.0 => Some(rectangle([0.0; 2], [x, y])),
            _ => None,
        };
        primitives.extend(hole.map(|ring| Primitive::convex(false, ring)));
        Ok(primitives)
    }

    /// Returns the outline of a standard aperture. `None` if it has no area.
    fn outline(&self, tolerance: f64) -> Result<Option<Ring>, ContourFault> {
        let size = [self.numbers[0], self.numbers.get(1).copied().unwrap_or_default()];
        let [x, y] = size;
        Ok(match self.template {
            Template::Circle if x > 0.0 => Some(circle([0.0; 2], x / 2.0, tolerance)?),
            Template::Rectangle if x > 0.0 && y > 0.0 => Some(rectangle([0.0; 2], size)),
            Template::Obround if x > 0.0 && y > 0.0 => {
                let radius = x.min(y) / 2.0;
                let [right, up] = [x / 2.0 - radius, y / 2.0 - radius];
                // Its corners lie in quarters, each of which moves outward.
                let quarters = chords_of_arc(radius, TAU, tolerance)?.div_ceil(4);
                let corner = |k: usize| {
                    let (quarter, step) = (k / (quarters + 1), k % (quarters + 1));
                    let degrees = 90.0 * (quarter as f64 + step as f64 / quarters as f64);
                    let (sin, cos) = sin_cos(degrees);
                    let [by_x, by_y] =
                        [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]][quarter];
                    [by_x * right + radius * cos, by_y * up + radius * sin]
                };
                let mut ring: Ring = (0..4 * (quarters + 1)).map(corner).collect();
                ring.dedup();
                Some(ring)
            }
            Template::Polygon if x > 0.0 => {
                let degrees = self.numbers.get(2).copied().unwrap_or_default();
                Some(polygon([0.0; 2], x, y, degrees)?)
            }
            _ => None,
        })
    }

    /// Returns the lengths of its hole: none, a diameter, or two sides.
    fn hole(&self) -> &[f64] {
        let before = match self.template {
            Template::Circle => 1,
            Template::Rectangle | Template::Obround => 2,
            Template::Polygon => 3,
            Template::Macro(_) => self.numbers.len(),
        };
        self.numbers.get(before..).unwrap_or_default()
    }

    /// Returns how it draws lines, in its unit. `None` if it has a hole or is a macro.
    pub(super) fn pen(&self, tolerance: f64) -> Result<Option<Pen>, ContourFault> {
        let has_hole = self.hole().iter().any(|length| *length > 0.0);
        Ok(match self.template {
            Template::Macro(_) => None,
            _ if has_hole => None,
            Template::Circle => Some(Pen::Circle(self.numbers[0])),
            _ => Some(Pen::Convex(self.outline(tolerance)?.unwrap_or_default())),
        })
    }
}

fn decimal(text: &str) -> Result<f64, ContourFault> {
    let is_digits = text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
    let number = text.parse().ok().filter(|_| is_digits);
    number.ok_or(ContourFault::Malformed("a number"))
}

fn rectangle([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Ring {
    let [right, up] = [width / 2.0, height / 2.0];
    vec![[x - right, y - up], [x + right, y - up], [x + right, y + up], [x - right, y + up]]
}

/// Returns a regular polygon in a circle of a diameter, with its first corner on the right.
fn polygon(
    [x, y]: [f64; 2],
    diameter: f64,
    corners: f64,
    degrees: f64,
) -> Result<Ring, ContourFault> {
    if !(3.0..=12.0).contains(&corners) || corners.fract() != 0.0 {
        return Err(ContourFault::Malformed("a polygon of 3 to 12 corners"));
    }
    let corner = |k: u32| {
        let (sin, cos) = sin_cos(degrees + 360.0 * f64::from(k) / corners);
        [x + diameter / 2.0 * cos, y + diameter / 2.0 * sin]
    };
    Ok((0..corners as u32).map(corner).collect())
}

/// A part of an expression behind its operands.
#[derive(Debug)]
enum Token {
    Number(f64),
    Variable(u32),
    Negative,
    Operator(u8),
}

type Expression = Vec<Token>;

#[derive(Debug)]
enum Statement {
    Set(u32, Expression),
    Draw(Vec<Expression>),
}

impl Statement {
    fn size(&self) -> u64 {
        match self {
            Self::Set(_, expression) => expression.len() as u64,
            Self::Draw(numbers) => numbers.iter().map(|it| it.len() as u64).sum(),
        }
    }
}

/// A macro of apertures.
#[derive(Debug)]
pub(super) struct Macro {
    statements: Vec<Statement>,
}

impl Macro {
    pub(super) fn new<'a>(texts: impl Iterator<Item = &'a str>) -> Result<Self, ContourFault> {
        let mut statements = Vec::new();
        for text in texts {
            let text = text.trim();
            // Comments are a primitive.
            if text.is_empty() || text.starts_with('0') {
                continue;
            }
            let statement = match text.strip_prefix('$').and_then(|rest| rest.split_once('=')) {
                Some((name, expression)) => Statement::Set(variable(name)?, parsed(expression)?),
                None => Statement::Draw(text.split(',').map(parsed).collect::<Result<_, _>>()?),
            };
            statements.push(statement);
        }
        Ok(Self { statements })
    }

    fn primitives(
        &self,
        numbers: &[f64],
        tolerance: f64,
        steps_left: &mut u64,
    ) -> Result<Vec<Primitive>, ContourFault> {
        let mut variables: HashMap<u32, f64> = (1..).zip(numbers.iter().copied()).collect();
        let mut primitives = Vec::new();
        let mut corners = 0;
        for statement in &self.statements {
            match statement {
                Statement::Set(name, expression) => {
                    let number = value(expression, &variables)?;
                    variables.insert(*name, number);
                }
                Statement::Draw(numbers) => {
                    let numbers = numbers.iter().map(|it| value(it, &variables));
                    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
                    let drawn = primitive(&numbers, tolerance, steps_left)?;
                    corners += drawn.iter().flat_map(|it| &it.rings).map(Vec::len).sum::<usize>();
                    check(corners)?;
                    primitives.extend(drawn);
                }
            }
        }
        Ok(primitives)
    }
}

fn variable(name: &str) -> Result<u32, ContourFault> {
    name.trim().parse().map_err(|_| ContourFault::Malformed("a variable of a macro"))
}

/// Returns an expression with its operands before their operators.
fn parsed(text: &str) -> Result<Expression, ContourFault> {
    let text: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut parser = Parser { text: &text, tokens: Vec::new() };
    parser.sum(0)?;
    match parser.text {
        [] => Ok(parser.tokens),
        _ => Err(WRONG),
    }
}

const WRONG: ContourFault = ContourFault::Malformed("an expression of a macro");

struct Parser<'a> {
    text: &'a [u8],
    tokens: Expression,
}

impl Parser<'_> {
    fn sum(&mut self, depth: usize) -> Result<(), ContourFault> {
        self.product(depth)?;
        while let [operator @ (b'+' | b'-'), rest @ ..] = self.text {
            self.text = rest;
            self.product(depth)?;
            self.tokens.push(Token::Operator(*operator));
        }
        Ok(())
    }

    fn product(&mut self, depth: usize) -> Result<(), ContourFault> {
        self.factor(depth)?;
        while let [operator @ (b'x' | b'X' | b'/'), rest @ ..] = self.text {
            self.text = rest;
            self.factor(depth)?;
            self.tokens.push(Token::Operator(operator.to_ascii_lowercase()));
        }
        Ok(())
    }

    fn factor(&mut self, depth: usize) -> Result<(), ContourFault> {
        if depth > MAX_DEPTH {
            return Err(WRONG);
        }
        let digits = |text: &[u8], also: &[u8]| {
            text.iter().take_while(|byte| byte.is_ascii_digit() || also.contains(byte)).count()
        };
        let text_of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        match self.text {
            [b'+', rest @ ..] => {
                self.text = rest;
                self.factor(depth + 1)?;
            }
            [b'-', rest @ ..] => {
                self.text = rest;
                self.factor(depth + 1)?;
                self.tokens.push(Token::Negative);
            }
            [b'(', rest @ ..] => {
                self.text = rest;
                self.sum(depth + 1)?;
                self.text = self.text.strip_prefix(b")").ok_or(WRONG)?;
            }
            [b'$', rest @ ..] => {
                let (name, rest) = rest.split_at(digits(rest, b""));
                self.text = rest;
                self.tokens.push(Token::Variable(variable(&text_of(name))?));
            }
            text => {
                let (number, rest) = text.split_at(digits(text, b"."));
                self.text = rest;
                self.tokens.push(Token::Number(decimal(&text_of(number))?));
            }
        }
        Ok(())
    }
}

fn value(expression: &Expression, variables: &HashMap<u32, f64>) -> Result<f64, ContourFault> {
    let mut stack: Vec<f64> = Vec::new();
    for token in expression {
        let number = match token {
            Token::Number(number) => *number,
            // Variables without a value are zero.
            Token::Variable(name) => variables.get(name).copied().unwrap_or_default(),
            Token::Negative => -stack.pop().ok_or(WRONG)?,
            Token::Operator(operator) => {
                let (b, a) = (stack.pop().ok_or(WRONG)?, stack.pop().ok_or(WRONG)?);
                match operator {
                    b'+' => a + b,
                    b'-' => a - b,
                    b'x' => a * b,
                    _ => a / b,
                }
            }
        };
        stack.push(number);
    }
    let number = stack.pop().ok_or(WRONG)?;
    if number.is_finite() { Ok(number) } else { Err(ContourFault::NotFinite) }
}

/// Returns the primitives of a statement of a macro: its code, and its numbers.
fn primitive(
    numbers: &[f64],
    tolerance: f64,
    steps_left: &mut u64,
) -> Result<Vec<Primitive>, ContourFault> {
    const FEW: ContourFault = ContourFault::Malformed("a primitive of a macro with its numbers");
    let (&code, numbers) = numbers.split_first().ok_or(FEW)?;
    let exposure = || match numbers.first() {
        Some(0.0) => Ok(false),
        Some(1.0) => Ok(true),
        _ => Err(ContourFault::Malformed("an exposure of 0 or 1")),
    };
    let [of_circle, of_line, of_outline] = [code == 1.0, code == 2.0 || code == 20.0, code == 4.0];
    // Its rotation, if it has one, is the last number.
    let count = match code {
        _ if of_circle => 4,
        _ if of_line => 6,
        _ if of_outline => {
            let sides = numbers.get(1).copied().ok_or(FEW)?;
            if !(1.0..=numbers.len() as f64).contains(&sides) || sides.fract() != 0.0 {
                return Err(FEW);
            }
            2 + 2 * (sides as usize + 1)
        }
        5.0 | 7.0 | 21.0 | 22.0 => 5,
        6.0 => 8,
        _ => return Err(ContourFault::Command(format!("of the macro's primitive {code}"))),
    };
    let is_enough = numbers.len() == count + 1 || numbers.len() == count;
    if !is_enough {
        return Err(FEW);
    }
    let (sin, cos) = sin_cos(numbers.get(count).copied().unwrap_or_default());
    let turn = [[cos, -sin, 0.0], [sin, cos, 0.0]];
    let length = |k: usize| match numbers[k] {
        length if length >= 0.0 => Ok(length),
        _ => Err(ContourFault::Malformed("a length of zero or more")),
    };
    let point = |k: usize| [numbers[k], numbers[k + 1]];
    let mut primitives = match code {
        _ if of_circle => {
            let ring = match length(1)? {
                0.0 => Ring::new(),
                diameter => circle(point(2), diameter / 2.0, tolerance)?,
            };
            vec![Primitive::convex(exposure()?, ring)]
        }
        _ if of_line => {
            let (half, from, to) = (length(1)? / 2.0, point(2), point(4));
            let [x, y] = [0, 1].map(|axis| to[axis] - from[axis]);
            let long = x.hypot(y);
            let [x, y] = if long > 0.0 { [x / long * half, y / long * half] } else { [0.0; 2] };
            let beside = |[at_x, at_y]: [f64; 2], by: f64| [at_x - by * y, at_y + by * x];
            let ring = [beside(from, -1.0), beside(to, -1.0), beside(to, 1.0), beside(from, 1.0)];
            vec![Primitive::convex(exposure()?, ring.to_vec())]
        }
        21.0 => {
            let ring = rectangle(point(3), [length(1)?, length(2)?]);
            vec![Primitive::convex(exposure()?, ring)]
        }
        22.0 => {
            let size = [length(1)?, length(2)?];
            let [x, y] = point(3);
            let ring = rectangle([x + size[0] / 2.0, y + size[1] / 2.0], size);
            vec![Primitive::convex(exposure()?, ring)]
        }
        _ if of_outline => {
            let corners = numbers[2..count].as_chunks::<2>().0;
            if corners.first() != corners.last() {
                return Err(ContourFault::Open);
            }
            let rings = vec![corners[1..].to_vec()];
            vec![Primitive { is_dark: exposure()?, rings, is_convex: false }]
        }
        5.0 => {
            let ring = match length(4)? {
                0.0 => Ring::new(),
                diameter => polygon(point(2), diameter, numbers[1], 0.0)?,
            };
            vec![Primitive::convex(exposure()?, ring)]
        }
        7.0 => {
            let (outer, inner, gap) = (length(2)?, length(3)?, length(4)?);
            if inner >= outer || gap >= outer / SQRT_2 {
                return Err(ContourFault::Malformed("a thermal whose ring is around its gaps"));
            }
            let mut painted =
                vec![Primitive::convex(true, circle(point(0), outer / 2.0, tolerance)?)];
            if inner > 0.0 {
                painted.push(Primitive::convex(false, circle(point(0), inner / 2.0, tolerance)?));
            }
            for size in [[2.0 * outer, gap], [gap, 2.0 * outer]] {
                painted.push(Primitive::convex(false, rectangle(point(0), size)));
            }
            // Its gaps clear no other primitive.
            let area = Area::of_primitives(&mut painted, &IDENTITY, steps_left)?;
            let rings = area.rings().map(<[_]>::to_vec).collect();
            vec![Primitive { is_dark: true, rings, is_convex: false }]
        }
        _ => {
            let center = point(0);
            let (outer, thickness, gap) = (length(2)?, length(3)?, length(4)?);
            let [cross, long] = [length(6)?, length(7)?];
            let mut rings =
                vec![rectangle(center, [long, cross]), rectangle(center, [cross, long])];
            let step = 2.0 * (thickness + gap);
            let most = if step > 0.0 && thickness > 0.0 { length(5)?.min(1e4) } else { 0.0 };
            for k in 0..most as u32 {
                let diameter = outer - f64::from(k) * step;
                if diameter <= 0.0 {
                    break;
                }
                rings.push(circle(center, diameter / 2.0, tolerance)?);
                check(rings.iter().map(Vec::len).sum())?;
                let inner = diameter - 2.0 * thickness;
                if inner > 0.0 {
                    rings.push(circle(center, inner / 2.0, tolerance)?.into_iter().rev().collect());
                }
            }
            vec![Primitive { is_dark: true, rings, is_convex: false }]
        }
    };
    for corner in primitives.iter_mut().flat_map(|it| &mut it.rings).flatten() {
        *corner = at(&turn, *corner);
    }
    Ok(primitives)
}
