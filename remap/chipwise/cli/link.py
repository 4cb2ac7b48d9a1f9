# SPDX-License-Identifier: GPL-2.0-or-later
"""Carry a master's packets to a slave in another LinuxCNC, by UDP.

Called by hal/tracer_link_master.hal (`chipwise link send`) and hal/tracer_link_slave.hal (`chipwise link receive`), a
HAL component of its own. A packet that is lost, doubled, late or damaged costs the slave time, never position. Both
need the same key,
[TRACER_LINK]KEY_FILE or KEY of the INI file; without one they use the loopback only. Datagrams are authentic, not
secret.
"""

import ipaddress
import signal
import socket

from chipwise.errors import CycleError, unnamed
from chipwise.link import key, packets, reception, transport

NAME = "link"
HELP = "carry a master's packets to a slave in another LinuxCNC (called by tracer_link_*.hal)"
COMPONENT = "chipwise-link"
SAMPLER_KEY, STREAMER_KEY = (
    0x48534130,
    0x48535430,
)  # of LinuxCNC's sampler and streamer, channel 0 (streamer.h of LinuxCNC)
PINS = {"send": ("sent", "failed"), "receive": ("passed", "ignored", "dropped", "refused")}


def add_arguments(parser):
    parser.add_argument("direction", choices=sorted(PINS), help="beside the master: send; beside the slave: receive")
    parser.add_argument("address", metavar="HOST:PORT", help="send: of the slave; receive: the address to listen on")
    parser.add_argument("--channel", type=int, default=0, metavar="N", help="of sampler or streamer (default: 0)")
    parser.add_argument(
        "--ini", metavar="INI", help="with [TRACER_LINK]KEY_FILE or KEY, and MASTER (default: INI_FILE_NAME)"
    )
    parser.add_argument(
        "--most-counts",
        type=int,
        default=reception.MOST_COUNTS,
        metavar="N",
        help=f"receive: of an axis in a period; more is refused (default: {reception.MOST_COUNTS})",
    )
    parser.add_argument(
        "--waiting", type=int, default=20, metavar="PERIODS", help="receive: packets that wait at most (default: 20)"
    )


def address_of(text):
    """HOST:PORT -> (host, port)."""
    from chipwise.options.machine import UsageError

    host, _colon, port = text.rpartition(":")
    if not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise UsageError(f"link: {text} is not HOST:PORT with a port from 1 to 65535")
    try:
        found = socket.getaddrinfo(host, int(port), socket.AF_INET, socket.SOCK_DGRAM)
    except OSError as error:
        raise UsageError(f"link: host {host}: {error.strerror or error}") from error
    return found[0][4]


def secret_of(options, address):
    """(key, the master's host or None); without a key the address has to be the loopback."""
    from chipwise.options.machine import UsageError

    try:
        found, master = key.key_of(options.ini), key.master_of(options.ini)
    except CycleError as error:
        raise UsageError(f"link: {unnamed(error)}") from error
    if not found and not ipaddress.ip_address(address[0]).is_loopback:
        raise UsageError(
            f"link: {options.address} is not the loopback and there is no key; set [TRACER_LINK]KEY_FILE on both "
            f"machines"
        )
    return found, address_of(f"{master}:1")[0] if master else None


def attach(component, options):
    """The stream of the sampler or streamer."""
    import hal

    from chipwise.options.machine import CommandError

    name, key = ("sampler", SAMPLER_KEY) if options.direction == "send" else ("streamer", STREAMER_KEY)
    try:
        return hal.stream(component, key + options.channel, packets.TYPES)
    except OSError as error:
        raise CommandError(
            f"link: {name} {options.channel}: {error.strerror or error}; load it before with cfg={packets.TYPES}"
        ) from error


def leave(_number, _frame):
    raise SystemExit(0)


def run(options):
    """Runs until LinuxCNC ends it."""
    from chipwise.options.machine import CommandError, UsageError

    address = address_of(options.address)
    secret, master = secret_of(options, address)
    codec = packets.Codec(secret)
    if not 1 <= options.most_counts <= 2**31:
        raise UsageError(f"link: --most-counts {options.most_counts} is not from 1 to {2**31}")
    if not 1 <= options.waiting <= 10000:
        raise UsageError(f"link: --waiting {options.waiting} is not from 1 to 10000")
    if not 0 <= options.channel <= 7:
        raise UsageError(f"link: --channel {options.channel} is not from 0 to 7")
    import hal

    signal.signal(signal.SIGTERM, leave)
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    if options.direction == "receive":
        try:
            channel.bind(address)
        except OSError as error:
            raise CommandError(f"link: {options.address}: {error.strerror}; is another one listening there?") from error
    try:
        component = hal.component(COMPONENT)
    except hal.error as error:
        raise CommandError(f"link: {COMPONENT}: {error}; is it already running?") from error
    for name in PINS[options.direction]:
        component.newpin(name, hal.HAL_U32, hal.HAL_OUT)
    try:
        stream = attach(component, options)
        component.ready()

        def count(*numbers):
            for name, number in zip(PINS[options.direction], numbers):
                component[name] = number % 2**32

        if options.direction == "send":
            transport.send(stream, address, count, codec)
        else:
            transport.receive(
                stream, channel, options.waiting, count, reception.Reception(codec, master, options.most_counts)
            )
    finally:
        component.exit()
        channel.close()
