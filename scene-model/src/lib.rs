//! Camera image to label map.
