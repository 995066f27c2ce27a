"""Addresses that the log gives."""

from __future__ import annotations

import ipaddress
import socket

import pytest

from twbr_estimation.dashboard.addresses import reachable
from twbr_estimation.dashboard.server import ServerSettings


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "192.168.7.2", "robot.local"])
def test_a_host_that_was_named_is_kept(host: str) -> None:
    assert reachable(host) == [host]


@pytest.mark.parametrize(("host", "family"), [("0.0.0.0", "AF_INET"), ("::", "AF_INET6")])
def test_every_address_is_one_of_this_computer(host: str, family: str) -> None:
    found = reachable(host)
    assert found and host not in found
    for each in found:
        assert not ipaddress.ip_address(each).is_unspecified
        try:
            with socket.socket(getattr(socket, family)) as probe:
                probe.bind((each, 0))
        except OSError as error:
            if family == "AF_INET6" and error.errno in (97, 99) and each == "::1":
                pytest.skip("this computer has no IPv6")
            raise


def test_the_address_of_every_network_carries_the_token() -> None:
    for address in ServerSettings("0.0.0.0", 8081, "secret").addresses():
        assert address.endswith(":8081/?token=secret") and "0.0.0.0" not in address
    assert ServerSettings("::1", 8081).addresses() == ["http://[::1]:8081/"]
