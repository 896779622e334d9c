//! The whole system: rehearsed missions, real processes, the page in a browser, the documents.
//!
//! One binary, so that tests that wait for processes run beside tests that compute.

mod api;
mod arrows;
mod autopilot;
mod both_ends;
mod browser;
mod commands;
mod depth;
mod documents;
mod harbour;
mod hostile;
mod link_table;
mod live_camera;
mod map_tool;
mod messages;
mod missions;
mod modem_sim;
mod navigation;
mod page;
mod ports;
mod position;
mod record;
mod restart;
mod ros2;
mod ros2_labels;
mod scene;
mod viewers;
mod wire_tool;
