# SPDX-License-Identifier: BSD-3-Clause
"""The services and actions of a node by their names, with numpy arrays. Needs ROS 1.

    client = contact_flow.ros.Client("/contact_flow")
    answer = client.simulate(duration=1.4, state={"names": ["body_pitch"], "positions": [0.1]})
    answer.event_times                              # float64[]: an array
    client.b_derivative().derivative.pieces[0]      # RowMajorMatrix: an array [rows × cols]
    swept = client.sweep(draws={"+body_pitch": contact_flow.Normal(0, 0.01)}, runs=10000, progress=print)
    swept.result.mean                               # float64[]: an array
"""
from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Callable, Dict, List, Optional

import numpy as np

from .draws import parts_of


class Refused(ValueError):
    """The node did not compute: the message names field and value."""


def to_python(value: Any) -> Any:
    """A message with arrays: RowMajorMatrix as [rows×cols], numbers as [k], NameList as a list."""
    kind = getattr(value, "_type", "")
    if kind == "contact_flow/RowMajorMatrix":
        return np.array(value.data, dtype=float).reshape((value.rows, value.cols))
    if kind == "contact_flow/NameList":
        return list(value.names)
    if hasattr(value, "__slots__") and hasattr(value, "_slot_types"):
        found = SimpleNamespace()
        for name, slot in zip(value.__slots__, value._slot_types):
            field = getattr(value, name)
            is_numbers = slot.endswith("[]") and slot.startswith(("float", "int", "uint"))
            if is_numbers and not isinstance(field, bytes):
                setattr(found, name, np.array(field, dtype=float if slot.startswith("float") else int))
            elif is_numbers:
                setattr(found, name, np.frombuffer(field, dtype=np.uint8))
            else:
                setattr(found, name, to_python(field))
        return found
    if isinstance(value, (list, tuple)):
        return [to_python(one) for one in value]
    return value


def fill(message: Any, fields: Dict[str, Any], path: str = "") -> Any:
    """Puts values into a message: dicts into messages, arrays into matrices and lists of numbers.
    ValueError for a field that there is none of."""
    for name, value in fields.items():
        if name not in message.__slots__:
            raise ValueError("%s has no field '%s'; it has %s"
                             % (path or message._type, name, ", ".join(message.__slots__)))
        slot = message._slot_types[message.__slots__.index(name)]
        setattr(message, name, _value(getattr(message, name), slot, value, (path + "." if path else "") + name))
    return message


def _value(field: Any, slot: str, value: Any, path: str) -> Any:
    if slot == "contact_flow/RowMajorMatrix" and not isinstance(value, dict):
        matrix = np.atleast_2d(np.asarray(value, dtype=float))
        field.rows, field.cols = matrix.shape
        field.data = matrix.ravel().tolist()
        return field
    if slot == "contact_flow/NameList" and not isinstance(value, dict):
        field.names = list(value)
        return field
    if hasattr(field, "__slots__") and isinstance(value, dict):
        return fill(field, value, path)
    if slot.endswith("[]") and "/" in slot:
        import roslib.message
        kind = roslib.message.get_message_class(slot[:-2])
        return [_value(kind(), slot[:-2], one, "%s[%d]" % (path, k)) for k, one in enumerate(value)]
    if slot.endswith("[]"):
        return np.asarray(value).tolist()
    return value


def draw_messages(draws: Any) -> List[Dict[str, Any]]:
    """What a sweep draws as fields of EnsembleDraw: from contact_flow.Uniform and the like by name, or as it is.

    >>> draw_messages({"stiffness": [25, 30]})
    [{'kind': 'grid', 'names': ['stiffness'], 'levels': [25.0, 30.0]}]
    """
    if isinstance(draws, (list, tuple)) and all(isinstance(one, dict) and "kind" in one for one in draws):
        return list(draws)
    return [dict(part, levels=part["levels"][0]) if part["kind"] == "grid" else part for part in parts_of(draws)]


class Client:
    """The services and actions below `node`, each a method that takes the fields of its request by name and
    answers with the fields of its response. Raises Refused where `success` is false, ValueError for a field that
    there is none of, and rospy's exceptions where the node does not answer.

    An action also takes `progress`, which is called with each feedback. Ctrl-C, and what `progress` raises, cancel
    its goal."""

    def __init__(self, node: str = "/contact_flow", timeout: float = 10.0) -> None:
        import rosgraph
        import rosservice
        import rospy
        self.node = node
        rospy.wait_for_service(node + "/describe_model", timeout)
        self._services: List[str] = [name[len(node) + 1:] for name in rosservice.get_service_list()
                                     if name.startswith(node + "/")]
        goal = "/goal"
        self._actions: Dict[str, str] = {
            topic[len(node) + 1:-len(goal)]: kind[:-len("ActionGoal")]
            for topic, kind in rosgraph.Master("/contact_flow_client").getTopicTypes()
            if topic.startswith(node + "/") and topic.endswith(goal) and kind.endswith("ActionGoal")}

    def __dir__(self) -> List[str]:
        names = set(self._services) | set(self._actions)
        return sorted(set(super().__dir__()) | {name for name in names if "/" not in name})

    def __repr__(self) -> str:
        names = sorted(set(self._services) | set(self._actions))
        return "Client(%r): %s" % (self.node, ", ".join(name for name in names if "/" not in name))

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if not name.startswith("_") and name in self._actions:
            return lambda **fields: self.pursue(name, **fields)
        if name.startswith("_") or name not in self._services:
            raise AttributeError("the node %s has no service '%s'" % (self.node, name))
        return lambda **fields: self.call(name, **fields)

    def call(self, service: str, **fields: Any) -> Any:
        """The same for any service below the node, as "simulator/step"."""
        import rosservice
        import rospy
        kind = rosservice.get_service_class_by_name(self.node + "/" + service)
        request = fill(kind._request_class(), fields)
        answer = to_python(rospy.ServiceProxy(self.node + "/" + service, kind)(request))
        if getattr(answer, "success", True) is False:
            raise Refused(answer.message)
        return answer

    def pursue(self, action: str, progress: Optional[Callable[[Any], None]] = None, timeout: float = 10.0,
               **fields: Any) -> Any:
        """The goal of any action below the node, to its end."""
        import actionlib
        import roslib.message
        import rospy
        kind = roslib.message.get_message_class(self._actions[action] + "Action")
        if action == "sweep" and "draws" in fields:
            fields["draws"] = draw_messages(fields["draws"])
        goal = kind().action_goal.goal
        fill(goal.request, fields)
        client = actionlib.SimpleActionClient(self.node + "/" + action, kind)
        if not client.wait_for_server(rospy.Duration(timeout)):
            raise rospy.ROSException("no action server %s/%s" % (self.node, action))
        told: List[Any] = []
        client.send_goal(goal, feedback_cb=told.append)
        try:
            # A result that comes before send_goal has returned is known to its handle alone.
            while not client.wait_for_result(rospy.Duration(0.1)) and \
                    client.gh.get_comm_state() != actionlib.CommState.DONE:
                tell(told, progress)
            tell(told, progress)
        except BaseException:
            client.cancel_goal()
            raise
        answer = client.get_result()
        if answer is None:
            raise rospy.ROSException("the goal of %s/%s was lost" % (self.node, action))
        if not answer.success:
            raise Refused(answer.message)
        return to_python(answer)


def tell(told: List[Any], progress: Optional[Callable[[Any], None]]) -> None:
    """What was told since, to whom it is for, on this thread."""
    while told:
        feedback = told.pop(0)
        if progress is not None:
            progress(to_python(feedback))
