//! The fullest model of each domain has a specification that makes sense.

#[test]
fn every_domain_has_a_sound_specification() {
    for domain in missing_physics_domains::all() {
        assert_eq!(domain.spec().check(), Ok(()), "{}", domain.id());
    }
}

#[test]
fn of_two_bounds_one_may_stay_open() {
    for domain in missing_physics_domains::all() {
        let spec = domain.spec();
        let name = |p: &usize| spec.parameters[*p].name.as_str();
        for mechanism in &spec.mechanisms {
            let bounds: Vec<usize> = mechanism
                .parameters
                .iter()
                .copied()
                .filter(|p| ["upper", "lower"].contains(&name(p)))
                .collect();
            if bounds.len() == 2 {
                assert_eq!(mechanism.may_be_open, bounds, "{} of {}", mechanism.id, domain.id());
            }
        }
    }
}
