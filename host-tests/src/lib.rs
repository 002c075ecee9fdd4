//! Behaviours of the unit, under std and in virtual time: what the tests share.
