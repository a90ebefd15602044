"""Recordings for ROS 2."""
