//! Damped least squares within limits.
//!
//! Levenberg-Marquardt with the damping proportional to the squared error (Sugihara 2011), so that it is strong far from the
//! target and gone near it. A variable at a limit that would be pushed beyond is left out of the step.

use nalgebra::{Matrix6, Vector6};

use super::Request;
use super::goal::ARM;
use crate::chain::Chain;

/// Damping that remains at the target.
const LEAST_DAMPING: f64 = 1e-10;

/// Damping relative to the squared error.
const DAMPING: f64 = 0.1;

/// Variables that move less gladly than this still do so towards the target; the posture takes them back.
const LEAST_WEIGHT: f64 = 0.1;

/// The longest step of a variable; rad or m.
const LONGEST: f64 = 1.0;

/// Room to work.
#[derive(Clone, Debug)]
pub(crate) struct Descent {
    pub columns: Vec<Vector6<f64>>,
    free: Vec<bool>,
    step: Vec<f64>,
}

impl Descent {
    pub fn new(chain: &Chain) -> Self {
        let count = chain.variables().len();
        Self { columns: Vec::with_capacity(count), free: vec![true; count], step: vec![0.0; count] }
    }

    /// How far the tip is from the target at `q`; leaves in the columns what each variable does about it.
    pub fn look(&mut self, chain: &Chain, request: &Request, q: &[f64]) -> Vector6<f64> {
        let at = chain.jacobian(q, &mut self.columns);
        self.columns.iter_mut().for_each(|column| request.effect(column));
        request.residual(&at)
    }

    /// Moves `q` towards the target until the request is met, nothing is gained any more, or its steps are used up.
    /// Returns half the squared error.
    pub fn run(&mut self, chain: &Chain, request: &Request, q: &mut [f64]) -> f64 {
        let enough = 0.25 * request.linear.min(ARM * request.angular);
        let mut error = self.look(chain, request, q);
        let mut cost = 0.5 * error.norm_squared();
        // The error some steps ago, to tell a search that is stuck.
        let (mut mark, mut marked) = (cost, 0);
        for count in 0..request.steps {
            if error.norm() <= enough {
                break;
            }
            self.step(chain, request, &error, DAMPING * cost + LEAST_DAMPING, q);
            for (q, (step, variable)) in q.iter_mut().zip(self.step.iter().zip(chain.variables())) {
                *q = (*q + step).clamp(variable.limits.lower, variable.limits.upper);
            }
            error = self.look(chain, request, q);
            cost = 0.5 * error.norm_squared();
            if count - marked >= 6 {
                if cost > 0.7 * mark {
                    break;
                }
                (mark, marked) = (cost, count);
            }
        }
        cost
    }

    /// The damped step that lessens this error from `q`, whose columns were looked at.
    fn step(&mut self, chain: &Chain, request: &Request, error: &Vector6<f64>, damping: f64, q: &[f64]) {
        let variables = chain.variables();
        self.free.iter_mut().enumerate().for_each(|(i, free)| *free = request.weight(i) > 0.0);
        // Every round leaves out one variable at least, or is the last.
        for _ in 0..=variables.len() {
            let dual = self.dual(request, error, damping);
            let mut pushed = false;
            for (i, variable) in variables.iter().enumerate() {
                self.step[i] = 0.0;
                if !self.free[i] {
                    continue;
                }
                let step = lent(request, i) * self.columns[i].dot(&dual);
                let beyond =
                    (q[i] >= variable.limits.upper && step > 0.0) || (q[i] <= variable.limits.lower && step < 0.0);
                if beyond {
                    self.free[i] = false;
                    pushed = true;
                }
                self.step[i] = step;
            }
            if !pushed {
                break;
            }
        }
        let longest = self.step.iter().fold(0.0f64, |most, step| most.max(step.abs()));
        if longest > LONGEST {
            self.step.iter_mut().for_each(|step| *step *= LONGEST / longest);
        }
    }

    /// The solution y of (J W J' + damping) y = error over the free variables: the step is W J' y.
    fn dual(&self, request: &Request, error: &Vector6<f64>, damping: f64) -> Vector6<f64> {
        let mut gram = Matrix6::from_diagonal_element(damping);
        for (i, column) in self.columns.iter().enumerate() {
            if self.free[i] {
                gram.ger(lent(request, i), column, column, 1.0);
            }
        }
        gram.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(error))
    }
}

/// The share of a variable that may move in a step.
fn lent(request: &Request, variable: usize) -> f64 {
    request.weight(variable).max(LEAST_WEIGHT)
}
