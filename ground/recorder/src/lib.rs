//! The flight log on the ground: dumped, decoded, recovered.
