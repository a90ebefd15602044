"""What ROS 2 reads: recordings in MCAP with its message types.

ros_messages    captures and poses as the fields of ROS 2 messages; the definitions of their types
mcap_recording  the file, written with the package ``mcap-ros2-support``, imported only there

May import the simulator and ``output``. A new topic is a definition and a function in ros_messages,
and its ``write`` in mcap_recording.
"""
