"""What ROS 2 reads: recordings in MCAP with its message types, and its topics live.

ros_messages    captures and poses as the fields of ROS 2 messages; the definitions of their types
run_messages    the messages of an epoch by topic
mcap_recording  the file, written with the package ``mcap-ros2-support``, imported only there
live_run        a scenario that plays, or follows the frames that others publish
rclpy_node      topics by an installed ROS 2, imported only there
dds_node        topics without ROS by ``cyclonedds``, imported only there and in dds_types
dds_types       the types of the messages for it

May import the simulator and ``output``. A new topic is a definition and a function in ros_messages,
its type in dds_types, and its place in run_messages.
"""
