//! The fullest model of each domain has a specification that makes sense.

#[test]
fn every_domain_has_a_sound_specification() {
    for domain in missing_physics_domains::all() {
        assert_eq!(domain.spec().check(), Ok(()), "{}", domain.id());
    }
}
