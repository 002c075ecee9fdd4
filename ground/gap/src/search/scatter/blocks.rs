//! Channels that an effect on the scatter may be in together, by what shares its parameters.

use twin::{
    effect::{Effect, Scope, Texture},
    predict::Kind,
};

use crate::null::problem::Problem;

/// Whether a residual that scatters as described as far as [`super::screen`] sees may hold it.
pub fn is_hidden(effect: &dyn Effect) -> bool {
    effect.page().texture == Texture::Line
}

/// Blocks of the effect's own scope.
pub fn own(problem: &Problem, effect: &dyn Effect) -> Vec<Vec<usize>> {
    let unit = problem.twin.unit();
    let concerned = concerned(problem, effect);
    match effect.page().scope {
        Scope::Channel => concerned.iter().map(|index| vec![*index]).collect(),
        Scope::Plate => {
            let of_group = |group: &&str| {
                let is_in = |index: &usize| unit.channels[*index].group == *group;
                concerned.iter().copied().filter(is_in).collect()
            };
            unit.groups().iter().map(of_group).collect()
        }
        Scope::Unit => vec![concerned],
    }
}

/// All channels of a kind, for an effect of channels that all of a kind may have alike: noise that is a little louder in twelve
/// of them is not worth its price in any.
pub fn kinds(problem: &Problem, effect: &dyn Effect) -> Vec<Vec<usize>> {
    let page = effect.page();
    if page.scope != Scope::Channel || !page.common {
        return Vec::new();
    }
    let concerned = concerned(problem, effect);
    let of_kind = |kind: &Kind| -> Vec<usize> {
        let is_in = |index: &usize| problem.twin.unit().channels[*index].sensor == *kind;
        concerned.iter().copied().filter(is_in).collect()
    };
    let kinds = page.sensors.iter().map(of_kind);
    kinds.filter(|own| own.len() > 1).collect()
}

fn concerned(problem: &Problem, effect: &dyn Effect) -> Vec<usize> {
    let (unit, page) = (problem.twin.unit(), effect.page());
    (0..unit.channels.len())
        .filter(|index| page.sensors.contains(&unit.channels[*index].sensor))
        .filter(|index| !(problem.is_limited(*index) && page.texture.is_shapeless()))
        .collect()
}
