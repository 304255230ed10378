//! What freedom a target leaves is used to come near a posture, or to stay near the start: of the configurations about a
//! solution the one with the least sum of squares of (q - wish), each divided by how gladly the variable moves.

use nalgebra::{Matrix6, Vector6};

use super::Request;
use super::descent::Descent;
use crate::chain::Chain;

/// Steps towards the posture before it is left at that.
const STEPS: usize = 25;

/// Moves `q`, which meets the request, within its null space towards a wish, as long as it comes nearer and still meets the
/// request.
pub(crate) fn settle(descent: &mut Descent, chain: &Chain, request: &Request, wish: &[f64], q: &mut Vec<f64>) {
    let far = |q: &[f64]| request.distance(q, wish);
    let mut nearest = far(q);
    let mut share = 0.5;
    for _ in 0..STEPS {
        descent.look(chain, request, q);
        let mut next = q.clone();
        for (i, (step, variable)) in
            projected(descent, chain, request, wish, q).into_iter().zip(chain.variables()).enumerate()
        {
            next[i] = (q[i] + share * step).clamp(variable.limits.lower, variable.limits.upper);
        }
        descent.run(chain, request, &mut next);
        let distance = far(&next);
        if distance < nearest && request.is_met(&chain.tip(&next)) {
            let gained = nearest - distance;
            (nearest, *q) = (distance, next);
            if gained < 1e-6 * (1.0 + nearest) {
                break;
            }
        } else {
            share *= 0.5;
            if share < 0.05 {
                break;
            }
        }
    }
}

/// The way to the wish without what would move the tip. Variables that would leave their limits stand still.
fn projected(descent: &Descent, chain: &Chain, request: &Request, wish: &[f64], q: &[f64]) -> Vec<f64> {
    let variables = chain.variables();
    let mut weights: Vec<f64> = (0..variables.len()).map(|i| request.weight(i)).collect();
    loop {
        let mut gram = Matrix6::from_diagonal_element(1e-9);
        let mut moved = Vector6::zeros();
        for (i, column) in descent.columns.iter().enumerate() {
            if weights[i] > 0.0 {
                gram.ger(weights[i], column, column, 1.0);
                moved += column * (wish[i] - q[i]);
            }
        }
        let dual = gram.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&moved));
        let step = |(i, column): (usize, &Vector6<f64>)| match weights[i] > 0.0 {
            true => wish[i] - q[i] - weights[i] * column.dot(&dual),
            false => 0.0,
        };
        let steps: Vec<f64> = descent.columns.iter().enumerate().map(step).collect();
        let beyond = |(i, step): (usize, &f64)| {
            let limits = &variables[i].limits;
            weights[i] > 0.0 && ((*step > 0.0 && q[i] >= limits.upper) || (*step < 0.0 && q[i] <= limits.lower))
        };
        match steps.iter().enumerate().position(|(i, step)| beyond((i, step))) {
            // Each round stops one variable more.
            Some(stopped) => weights[stopped] = 0.0,
            None => return steps,
        }
    }
}
