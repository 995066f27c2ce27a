"""Addresses at which other computers reach this one."""

from __future__ import annotations

import socket
import struct
from contextlib import suppress
from fcntl import ioctl
from ipaddress import IPv6Address
from pathlib import Path

EVERYWHERE = ("0.0.0.0", "::", "")
"""Hosts that stand for all addresses of this computer."""
_ADDRESS_OF_INTERFACE = 0x8915  # SIOCGIFADDR
_IPV6 = Path("/proc/net/if_inet6")
_GLOBAL = "00"
"""Scope of an IPv6 address that is neither of one link nor of this computer only."""


def reachable(host: str) -> list[str]:
    """Return what to write into a browser for a server that listens at `host`.

    Args:
        host: Name or address; one that stands for all addresses gives each of them, without
            those that only this computer has, where there are others.
    """
    if host not in EVERYWHERE:
        return [host]
    found = _ipv6_addresses() if host == "::" else _ipv4_addresses()
    return found or ["::1" if host == "::" else "127.0.0.1"]


def _ipv4_addresses() -> list[str]:
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # an interface without an address
                request = struct.pack("256s", name.encode()[:15])
                answer = ioctl(probe, _ADDRESS_OF_INTERFACE, request)
                found.append(socket.inet_ntoa(answer[20:24]))
    return [each for each in found if not each.startswith("127.")]


def _ipv6_addresses() -> list[str]:
    with suppress(OSError):
        rows = [line.split() for line in _IPV6.read_text().splitlines()]
        return [str(IPv6Address(bytes.fromhex(row[0]))) for row in rows if row[3] == _GLOBAL]
    return []
