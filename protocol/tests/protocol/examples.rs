//! The examples run to their end.

#[path = "../../examples/authentic_orders.rs"]
mod authentic_orders;
#[path = "../../examples/lossy_pair.rs"]
mod lossy_pair;
#[path = "../../examples/map_series.rs"]
mod map_series;
#[path = "../../examples/own_modem.rs"]
mod own_modem;
#[path = "../../examples/vectors.rs"]
pub(crate) mod vectors;

#[test]
fn orders_are_authentic() {
    authentic_orders::main();
}

#[test]
fn a_lossy_pair_has_one_map() {
    lossy_pair::main();
}

#[test]
fn a_series_of_maps_is_coded() {
    map_series::main();
}

#[test]
fn a_custom_modem_is_driven() {
    own_modem::main();
}

#[test]
fn test_vectors_read_as_they_state() {
    vectors::main();
}
