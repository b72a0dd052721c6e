//! Which field is meant by a name and a time: time steps are fields of one name with different times.

use super::output;
use anyhow::{Context, Result, anyhow, ensure};
use tetralod::mt::MtInfo;

/// The number of the field called `name`, at a time if there is one and else its first time step. Without a name it is the field that is shown
/// first, or if that has no such time, the first that has.
pub fn field_index(info: &MtInfo, name: Option<&str>, time: Option<f64>) -> Result<usize> {
    let first = name.map_or_else(|| Ok(info.first_field()), |name| beside(info, name, 0))?;
    let Some(time) = time else { return Ok(first) };
    let other = || (0..info.fields.len()).find_map(|field| step_at(info, field, time));
    let found = step_at(info, first, time).or_else(|| other().filter(|_| name.is_none()));
    found.ok_or_else(|| no_step(info, first, time))
}

/// The number of the field called `name` at the time of the field that is shown, or else its first time step.
pub fn beside(info: &MtInfo, name: &str, shown: usize) -> Result<usize> {
    info.step_of(name, shown).with_context(|| {
        let known: Vec<&str> = info.fields.iter().map(|field| field.name.as_str()).collect();
        format!("there is no field '{name}'; the MT has: {}", known.join(", "))
    })
}

/// The time step of a field at a time: that which is exactly there, or the one that six digits do not tell from it.
fn step_at(info: &MtInfo, field: usize, time: f64) -> Option<usize> {
    let rounded = output::number(time);
    let find = |is: &dyn Fn(f64) -> bool| {
        let mut steps = all_of(info, field).filter(|&step| info.fields[step].time.is_some_and(is));
        steps.next().filter(|_| steps.next().is_none())
    };
    find(&|own| own == time).or_else(|| find(&|own| output::number(own) == rounded))
}

/// All time steps of a field.
pub fn all_of(info: &MtInfo, field: usize) -> impl Iterator<Item = usize> {
    let name = &info.fields[field].name;
    (0..info.fields.len()).filter(move |&step| info.fields[step].name == *name)
}

/// The time steps of a field by their times.
pub fn in_order(info: &MtInfo, field: usize) -> Result<Vec<usize>> {
    let time = |step: usize| info.fields[step].time;
    let mut steps: Vec<usize> = all_of(info, field).filter(|&step| time(step).is_some()).collect();
    steps.sort_by(|&a, &b| time(a).unwrap_or_default().total_cmp(&time(b).unwrap_or_default()));
    ensure!(
        steps.len() > 1,
        "'{}' has no time steps to go over; name another --field",
        info.fields[field].name
    );
    Ok(steps)
}

/// So many times are listed from each end.
const LISTED_TIMES: usize = 8;

/// What is wrong with a time, and the times that there are.
pub fn no_step(info: &MtInfo, field: usize, time: f64) -> anyhow::Error {
    let (name, time) = (&info.fields[field].name, output::exact(time));
    let times = all_of(info, field).filter_map(|step| info.fields[step].time).map(output::exact);
    let mut times: Vec<String> = times.collect();
    if times.is_empty() {
        return anyhow!(
            "'{name}' has no time steps, so none at time {time}; name another --field, or no --time"
        );
    }
    if times.len() > 2 * LISTED_TIMES {
        let left = times.len() - 2 * LISTED_TIMES;
        times.splice(LISTED_TIMES..LISTED_TIMES + left, [format!("… ({left} more)")]);
    }
    anyhow!("'{name}' has no time step at {time}; its times are {}", times.join(", "))
}
