"""`doctor` on this very machine: what ROS needs is found, and DDS carries its messages."""

from actuator_glue.api import doctor


def test_ros_messages_and_dds_are_found():
    for question in (doctor.ros, doctor.messages, doctor.dds):
        found = question()
        assert found.verdict != 'missing', found
    assert '100 of 100 messages' in found.text
