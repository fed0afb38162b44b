//! The fit of Fig. 3: a genetic search over five parameters with the haze searched inside the objective.

use super::genetic::{Genetic, Settings};
use super::objective::{Objective, Value};
use crate::error::{Error, Result};
use crate::job::Job;

/// Evaluate a population, in parallel; individuals have five parameters.
pub fn evaluate(objective: &Objective, population: &[Vec<f64>], job: &Job) -> Result<Vec<Value>> {
    job.map(population.len(), |i| {
        let gene = population[i].as_slice().try_into().map_err(|_| Error::Shape {
            name: "population",
            expected: "(n, 5)".into(),
            got: format!("(n, {})", population[i].len()),
        })?;
        Ok(objective.evaluate(gene))
    })
}

/// Run the search to its end.
pub fn search(objective: &Objective, settings: Settings, job: &Job) -> Result<Genetic> {
    job.expect(settings.generations as u64);
    let mut search = Genetic::new(settings)?;
    while search.stopped().is_none() {
        let values = evaluate(objective, &search.ask(), job)?;
        let values: Vec<f64> = values.iter().map(|v| v.objective).collect();
        search.tell(&values)?;
        job.advance(1)?;
    }
    Ok(search)
}
