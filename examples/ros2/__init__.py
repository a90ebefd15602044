"""A closed loop over ROS 2's topics."""
