"""The calibration sweep: plan, take, measure, conclude."""
