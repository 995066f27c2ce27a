"""Check of a request to set parameters, before their values are checked."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from rclpy.parameter import Parameter

from ..errors import ConfigurationError

PROVENANCE = "provenance."
"""Prefix of the names that record the origin of a parameter file; they set nothing."""
ARRAYS = {
    Parameter.Type.BYTE_ARRAY,
    Parameter.Type.BOOL_ARRAY,
    Parameter.Type.INTEGER_ARRAY,
    Parameter.Type.DOUBLE_ARRAY,
    Parameter.Type.STRING_ARRAY,
}


def admitted(node: Any, parameters: list[Parameter]) -> list[Parameter]:
    """Return the parameters to set: known ones, arrays in the type that is declared.

    Args:
        node: Whose parameters they are.
        parameters: As requested.

    Raises:
        ConfigurationError: a name that the node does not have, or a value that is not set.
    """
    wanted = [each for each in parameters if not each.name.startswith(PROVENANCE)]
    for each in wanted:
        if not node.has_parameter(each.name):
            raise ConfigurationError(unknown(each.name, node))
        if each.type_ is Parameter.Type.NOT_SET:
            raise ConfigurationError(f"{each.name}: a parameter cannot be removed; set a value")
    return [_as_declared(node, each) for each in wanted]


def unknown(name: str, node: Any) -> str:
    """Return that the node has no parameter of this name, and which one may be meant."""
    names = node.list_parameters([], 0).names
    close = get_close_matches(name, names, 1) or get_close_matches(
        name.rpartition(".")[2], [each for each in names if "." not in each], 1
    )
    hint = f"; is {close[0]} meant?" if close else ""
    return f"parameter {name} does not exist in {node.get_name()}{hint}"


def _as_declared(node: Any, parameter: Parameter) -> Parameter:
    """Return a request whose empty array or whole numbers have the declared array type."""
    kind = Parameter.Type(node.describe_parameter(parameter.name).type)
    if kind is parameter.type_ or kind not in ARRAYS:
        return parameter
    if parameter.type_ in ARRAYS and not parameter.value:
        return Parameter(parameter.name, kind, [])
    whole = parameter.type_ is Parameter.Type.INTEGER_ARRAY
    if whole and kind is Parameter.Type.DOUBLE_ARRAY:
        return Parameter(parameter.name, kind, [float(each) for each in parameter.value])
    return parameter
