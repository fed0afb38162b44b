//! The cloud fit of Fig. 3: optimisation of five rendering parameters, the haze searched inside the objective.
//!
//! Section 4.2 of inverse_clouds. A population is evaluated in parallel, an individual in one pass (objective.rs).
//! Parameters: intensity, asymmetry, extinction, albedo, ambient light.

use super::objective::{Objective, Value};
use super::search::Search;
use crate::error::{Error, Result};
use crate::job::Job;

/// Evaluate a population, in parallel; individuals have five parameters.
pub fn evaluate(objective: &Objective, population: &[Vec<f64>], job: &Job) -> Result<Vec<Value>> {
    job.map(population.len(), |i| {
        let x = population[i].as_slice().try_into().map_err(|_| Error::Shape {
            name: "population",
            expected: "(n, 5)".into(),
            got: format!("(n, {})", population[i].len()),
        })?;
        Ok(objective.evaluate(x))
    })
}

/// Run a search to its end; progress is counted in objective calls.
pub fn search(objective: &Objective, search: &mut dyn Search, job: &Job) -> Result<()> {
    job.expect(search.record().settings().calls() as u64);
    while search.record().stopped().is_none() {
        let values = evaluate(objective, &search.ask(), job)?;
        let values: Vec<f64> = values.iter().map(|v| v.objective).collect();
        search.tell(&values)?;
        job.advance(values.len() as u64)?;
    }
    Ok(())
}
