"""Publishers and subscriptions of one topic that DDS will never match."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

# Policies that parameters `qos_overrides.TOPIC.publisher|subscription.POLICY` override.
OVERRIDES = QoSOverridingOptions(
    (
        QoSPolicyKind.HISTORY,
        QoSPolicyKind.DEPTH,
        QoSPolicyKind.RELIABILITY,
        QoSPolicyKind.DURABILITY,
    )
)


def type_name(cls: Any) -> str:
    """Return the full name of a message class, `package/msg/Name`."""
    package = cls.__module__.partition('.')[0]
    return f'{package}/msg/{cls.__name__}'


def refusal(asked: QoSProfile, offered: QoSProfile) -> str:
    """Return why DDS does not match a subscription and a publisher, empty where it does.

    rclpy's own comparison takes the endless deadlines that discovery tells of for finite ones.
    """
    if (
        asked.reliability == ReliabilityPolicy.RELIABLE
        and offered.reliability == ReliabilityPolicy.BEST_EFFORT
    ):
        return 'reliable is asked for, best effort offered'
    if (
        asked.durability == DurabilityPolicy.TRANSIENT_LOCAL
        and offered.durability == DurabilityPolicy.VOLATILE
    ):
        return 'transient local is asked for, volatile offered'
    return ''


def unheard(node: Any, subscription: Any) -> Iterator[tuple[str, str]]:
    """Yield the kind and text of each reason why a publisher cannot be heard."""
    wanted, topic = type_name(subscription.msg_type), subscription.topic_name
    for info in node.get_publishers_info_by_topic(topic):
        if info.topic_type != wanted:
            text = f'{name(info)} publishes {info.topic_type} on {topic}; {wanted} is expected'
            yield 'wrong message type', text
            continue
        reason = refusal(subscription.qos_profile, info.qos_profile)
        if reason:
            yield 'incompatible QoS', f'nothing is heard of {name(info)} on {topic}: {reason}'


def unreached(node: Any, publisher: Any) -> Iterator[tuple[str, str]]:
    """Yield the kind and text of each reason why a subscription gets nothing."""
    for info in node.get_subscriptions_info_by_topic(publisher.topic_name):
        reason = refusal(info.qos_profile, publisher.qos_profile)
        if reason:
            text = f'{name(info)} gets nothing of {publisher.topic_name}: {reason}'
            yield 'incompatible QoS', text


def name(info: Any) -> str:
    """Return the full name of the node at one end of a topic."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
