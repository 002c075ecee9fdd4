//! Results as pictures: panels as SVG, and one HTML page that opens without a network.
