"""The depth-slope sweep: plan, take, measure, conclude."""
