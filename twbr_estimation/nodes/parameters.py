"""ROS parameters of a node: declared from specs, checked as a whole, applied at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, NoReturn, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..errors import ConfigurationError, TwbrError
from ..parameters.bounds import within
from .declarations import Declaration, Settings, declarations_of, settings_from

Built = TypeVar("Built")


def descriptor_of(declaration: Declaration) -> ParameterDescriptor:
    """Return the ROS descriptor: description, limits, choices, read-only flag."""
    descriptor = ParameterDescriptor(
        description=declaration.description, read_only=declaration.read_only
    )
    bounds, default = declaration.bounds, declaration.default
    if declaration.choices:
        descriptor.additional_constraints = f"one of: {', '.join(declaration.choices)}"
    elif bounds is not None and isinstance(default, int):
        descriptor.integer_range = [
            IntegerRange(from_value=int(bounds.minimum), to_value=int(bounds.maximum), step=0)
        ]
    elif bounds is not None and isinstance(default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(bounds.minimum), to_value=float(bounds.maximum))
        ]
    elif bounds is not None:  # an array: ROS has no range for its elements
        descriptor.additional_constraints = f"each {bounds.minimum:g} to {bounds.maximum:g}"
    return descriptor


class NodeParameters(Generic[Built]):
    """Keeps a node's parameters and the object built from them in step.

    A request, of one parameter or of many, is turned into a candidate by `build`, which gets the
    values of that request alone: what they do not concern is neither checked nor built again. If
    it raises, the request is refused with the error's text and nothing changes. If it passes,
    `apply` receives the new object once, after ROS has stored the values.
    """

    def __init__(
        self,
        node: Node,
        declarations: Iterable[Declaration],
        start: Built,
        build: Callable[[Built, Mapping[str, Any]], Built],
        apply: Callable[[Built], None] | None = None,
    ) -> None:
        """Declare the parameters and build from their first values; `apply` is not called.

        Args:
            node: The node that gets the parameters.
            declarations: What to declare.
            start: Holds the defaults.
            build: build(former, values): what the node needs, made of what it has so far and of
                the values given, by full name; arrays are tuples. Must change nothing.
            apply: Takes over a changed object.

        Raises:
            ConfigurationError: an initial value of the wrong type or outside its limits.
        """
        self._declared = {each.name: each for each in declarations}
        values = declare_all(node, list(self._declared.values()))
        self._build = build
        self._apply = apply
        self._checked: tuple[Mapping[str, Any], Built] | None = None
        self.current: Built = build(start, values)
        """Result of `build` for the values now in force."""
        if not all(each.read_only for each in self._declared.values()):
            node.add_on_set_parameters_callback(self._on_set)
            node.add_post_set_parameters_callback(self._on_changed)

    def _own(self, changes: list[Parameter]) -> dict[str, Any]:
        """Return the values of those that are declared here.

        Raises:
            ConfigurationError: an array of another length than declared.
        """
        given = {each.name: _plain(each.value) for each in changes if each.name in self._declared}
        for name, value in given.items():
            require_length(self._declared[name], value)
        return given

    def _on_set(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            if given := self._own(changes):
                self._checked = given, self._build(self.current, given)
        except TwbrError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_changed(self, changes: list[Parameter]) -> None:
        given = self._own(changes)
        if not given:
            return
        checked, self._checked = self._checked, None
        if checked is not None and checked[0] == given:
            self.current = checked[1]  # built when the request was checked
        else:
            self.current = self._build(self.current, given)
        if self._apply is not None:
            self._apply(self.current)


def require_length(declaration: Declaration, value: Any) -> None:
    """Check how many numbers an array holds.

    Raises:
        ConfigurationError: another number than the parameter has.
    """
    length = declaration.length
    if length is not None and len(value) != length:
        raise ConfigurationError(
            f"{declaration.name}: {len(value)} numbers, {list(value)}, where {length} are needed"
        )


def declare(node: Node, declaration: Declaration) -> Any:
    """Declare one parameter and return its first value; errors as `declare_all`."""
    return declare_all(node, [declaration])[declaration.name]


def declare_all(node: Node, declarations: Sequence[Declaration]) -> dict[str, Any]:
    """Declare parameters in one step, and return their first values by name.

    `Node.declare_parameters` would take each in a step of its own, with an event for each, which
    for many takes longer than the filters' import.

    Raises:
        ConfigurationError: a first value of the wrong type or outside the limits.
    """
    first, descriptors = [], {}
    for each in declarations:
        kind, descriptor = _type_of(each), descriptor_of(each)
        descriptor.type = kind.value
        descriptors[each.name] = descriptor
        first.append(_given(node, each, kind) or Parameter(each.name, kind, _listed(each.default)))
    if not node._set_parameters_atomically_common(first, descriptors, True).successful:
        for each, parameter in zip(declarations, first, strict=True):
            result = node._set_parameters_atomically_common([parameter], descriptors, True)
            if not result.successful:
                _refuse(each, parameter, result.reason)
    found = {each.name: _plain(node.get_parameter(each.name).value) for each in declarations}
    for each in declarations:
        require_length(each, found[each.name])
    return found


def _given(node: Node, declaration: Declaration, kind: Parameter.Type) -> Parameter | None:
    """Return the initial value that a user gives; None without one.

    An array gets the type that is declared: `[0, 0]` for doubles, and an empty one.

    Raises:
        ConfigurationError: an empty list for what is no list.
    """
    given: Parameter | None = node._parameter_overrides.get(declaration.name)
    array = isinstance(declaration.default, tuple)
    if given is not None and given.type_ is Parameter.Type.NOT_SET:  # as rcl reads []
        if not array:
            raise ConfigurationError(_of_the_wrong_type(declaration, []))
        return Parameter(given.name, kind, [])
    if given is None or not array:
        return given
    if (given.type_, kind) == (Parameter.Type.INTEGER_ARRAY, Parameter.Type.DOUBLE_ARRAY):
        return Parameter(given.name, kind, [float(each) for each in given.value])
    return given


def _listed(value: Any) -> Any:
    """Return a tuple as the list that rclpy takes, everything else as it is."""
    return list(value) if isinstance(value, tuple) else value


def _type_of(declaration: Declaration) -> Parameter.Type:
    if declaration.default == ():  # which does not show the type of its elements
        strings = Parameter.Type.STRING_ARRAY, Parameter.Type.DOUBLE_ARRAY
        return strings[0] if declaration.strings else strings[1]
    return Parameter.Type.from_parameter_value(_listed(declaration.default))


_NEEDED = {
    Parameter.Type.BOOL: "true or false",
    Parameter.Type.INTEGER: "a whole number",
    Parameter.Type.DOUBLE: "a number with a decimal point, as in 1.0",
    Parameter.Type.STRING: "a text; quote what YAML takes for something else, as in '\"1\"'",
    Parameter.Type.INTEGER_ARRAY: "a list of whole numbers, as in [1, 2]",
    Parameter.Type.DOUBLE_ARRAY: "a list of numbers, as in [0.0, 0.5]",
}


def _refuse(declaration: Declaration, first: Parameter, reason: str) -> NoReturn:
    if first.type_ is not _type_of(declaration):
        raise ConfigurationError(_of_the_wrong_type(declaration, first.value))
    if declaration.bounds is not None and isinstance(first.value, (int, float)):
        within(first.name, first.value, declaration.bounds)
    raise ConfigurationError(f"{first.name}: {first.value!r}: {reason}")


def _of_the_wrong_type(declaration: Declaration, given: Any) -> str:
    kind = _type_of(declaration)
    if kind is Parameter.Type.STRING_ARRAY:
        word = given if isinstance(given, str) else "name"
        needed = f"a list of texts, as in ['{word}']"
    else:
        needed = _NEEDED[kind]
        if kind is Parameter.Type.INTEGER:
            needed = f"a whole number, as in {_whole_number(given)}"
    return f"{declaration.name}: {given!r} is of the wrong type; needed is {needed}"


def _whole_number(value: Any) -> int:
    """Return the whole number that is meant, or any."""
    try:
        return int(value, 0) if isinstance(value, str) else int(value)
    except (TypeError, ValueError, OverflowError):
        return 1


def _plain(value: Any) -> Any:
    """Return arrays as tuples, everything else as it is."""
    return value if isinstance(value, (bool, int, float, str, type(None))) else tuple(value)


def declare_settings(node: Node, defaults: Settings, prefix: str = "") -> Settings:
    """Declare the fields of a settings dataclass as read-only parameters; return their values.

    Args:
        node: The node that gets the parameters.
        defaults: Instance that holds the defaults.
        prefix: Put before each name, such as `"mounting."`.

    Raises:
        ConfigurationError: a value that is refused.
    """
    declared = declarations_of(defaults, prefix, read_only=True)
    return NodeParameters(node, declared, defaults, partial(settings_from, prefix=prefix)).current
