//! The way of an order, step by step.

use super::unix_s;
use scenecast_messages::scenecast_msgs::OrderStatus;

/// An order by the name of its slot and its version.
pub(super) type OrderKey = (String, u32);

/// A status of an order.
#[derive(Debug, Clone)]
pub(super) struct OrderStep {
    pub(super) at_s: f64,
    pub(super) given_s: f64,
    pub(super) status: u8,
    pub(super) reason: String,
    /// Whether only the vehicle's own record has it.
    pub(super) is_own: bool,
}

impl OrderStep {
    pub(super) fn of(message: &OrderStatus) -> Self {
        Self {
            at_s: unix_s(&message.header.stamp),
            given_s: unix_s(&message.given),
            status: message.status,
            reason: message.reason.clone(),
            is_own: false,
        }
    }

    pub(super) fn is_end(&self) -> bool {
        matches!(self.status, OrderStatus::APPLIED | OrderStatus::REFUSED | OrderStatus::WITHDRAWN)
    }
}
