"""An environment with ROS 2's rclpy, for the tests."""
