//! Label-map coding: a change of the map against a base both ends hold, small enough for the room in a frame.
