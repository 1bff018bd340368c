# SPDX-License-Identifier: Apache-2.0
"""Command line shared by all clients, and run(), which implements a program with one callback."""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import math
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import AsyncExitStack
from functools import partial

from . import aio
from .client import Client, Physics
from .config import MAX_RATE_HZ, MIN_RATE_HZ, Config, Stats
from .guest import RefusedForGood, log, parse_address, unix_path
from .keys import read_key
from .messages import Delays, DeviceReport, DeviceState, LinkReport, LinkStats, PeerReport, Role

Watch = Callable[[DeviceState, LinkStats], None]
"""Callback of an observer."""


def number(least: float = 0, most: float = math.inf) -> Callable[[str], float]:
    """Type for add_argument: 0, or a number from `least` to `most`."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if value == 0 or (math.isfinite(value) and least <= value <= most):
            return value
        expected = "0, or " if least > 0 else ""
        expected += f"{least:g} to {most:g}" if most < math.inf else f"a number of {least:g} or more"
        raise argparse.ArgumentTypeError(f'expected {expected}, got "{text}"')

    return parse


def at_least(least: float) -> Callable[[str], float]:
    """Type for add_argument: a finite number ≥ `least`."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isfinite(value) and value >= least:
            return value
        raise argparse.ArgumentTypeError(f'expected a number of {least:g} or more, got "{text}"')

    return parse


def _address(text: str) -> str:
    try:
        if unix_path(text) is None:
            parse_address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _key(program: str, text: str) -> bytes:
    try:
        return read_key(text)
    except (OSError, ValueError) as error:
        # argparse would use the exit status 2, which is for wrong usage
        raise SystemExit(f"{program}: {error}") from None


def parser(name: str, purpose: str | None, rate_hz: float = 0) -> argparse.ArgumentParser:
    """Returns a parser with --server, --key, --device, --channel, --take-lease, --rate-hz, --duration-s, --json and
    --help. Add the options of your program."""
    example = f"Example: {name} --server 127.0.0.1:47100 --duration-s 10"
    line = argparse.ArgumentParser(name, description=purpose, epilog=example)
    line.add_argument(
        "--server",
        type=_address,
        default="127.0.0.1:47100",
        metavar="HOST:PORT",
        help="Address of tendond: a host name or an IP address, or unix:PATH on this machine [%(default)s]",
    )
    line.add_argument(
        "--key",
        type=partial(_key, name),
        metavar="FILE",
        help="Key file from `tendond keygen`. Not required for a server on this machine without keys",
    )
    line.add_argument("--device", default="", metavar="NAME", help="Name of the device, for a server with several devices")
    line.add_argument("--channel", default="", metavar="NAME", help="Name of the channel of the device")
    line.add_argument("--take-lease", action="store_true", help="Request the channel until this client holds it")
    line.add_argument(
        "--rate-hz",
        type=number(MIN_RATE_HZ, MAX_RATE_HZ),
        default=rate_hz,
        metavar="HZ",
        help="Rate of the answers, Hz. 0: answer every state [%(default)s]",
    )
    line.add_argument(
        "--duration-s", type=number(0, 1e9), default=0.0, metavar="S", help="Stop after this time, s. 0: run until Ctrl-C"
    )
    line.add_argument("--json", action="store_true", help="Print JSON on stdout, one object per line")
    line.set_defaults(name=name)
    return line


def run(
    options: argparse.Namespace,
    *,
    physics: Physics | Mapping[str, Physics] | None = None,
    watch: Watch | None = None,
    on_silence: Callable[[int], object] | None = None,
) -> int:
    """Runs a controller (`physics`) or an observer (`watch`) until --duration-s, SIGINT or SIGTERM, then sends a Bye.
    Returns an exit code:

        0   a session was open at least once
        1   connecting failed, or the server refused permanently

    Prints one sentence to stderr for each change of the connection and a warning if forces were late. stdout
    contains only the output of the callback and, with --json, once per second the server's report on the received
    forces, {"report":{"number":1, …}}, or for an observer those on the loop of the device and its engines,
    {"device":{"number":1, …}} and {"peer":{"name":"wall", …}}, and the summary, {"summary":{"duration_s":…, …}}.
    Exceptions of the callback propagate after a Bye.

    One engine can be used for several devices of the server, for example if two hands hold the same object. In
    this case, `physics` maps each device name to a function. The functions are called sequentially and need no
    locks. Each device has its own session with these options, and the output of --json contains the device name.
    Returns 0 if every session was open at least once.
    """
    if (physics is None) == (watch is None):
        raise TypeError("run: expected physics or watch")
    logging.basicConfig(format=f"{options.name}: %(message)s", level=logging.INFO)
    if isinstance(physics, Mapping):
        if on_silence is not None:
            raise TypeError("run: on_silence can only be used with one device")
        return _run_several(options, physics)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    start = time.monotonic()
    try:
        config = _config(options, options.device, Role.CONTROLLER if physics else Role.OBSERVER)
        with Client(options.server, config) as client:
            try:
                reported: LinkReport | None = None
                told: dict[int | None, DeviceReport | PeerReport] = {}  # by channel; None: the device itself
                for hand in client.states(options.duration_s or None, on_silence):
                    if options.json and client.report is not reported:
                        reported = client.report
                        _print_report(reported)
                    if options.json:
                        _print_diagnoses(client.device_report, client.peer_reports, told)
                    if physics is not None:
                        client.answer(hand, physics(hand))
                    elif watch is not None:
                        watch(hand, client.stats.link)
            except KeyboardInterrupt:
                pass  # the regular way to stop
            stats = client.stats
    except (RefusedForGood, OSError, ValueError) as error:
        log.error(error)
        return 1
    _print_summary(stats, time.monotonic() - start, options.json)
    return 0 if stats.sessions > 0 else 1


def _config(options: argparse.Namespace, device: str, role: Role) -> Config:
    return Config(
        name=options.name,
        role=role,
        key=options.key,
        device=device,
        channel=options.channel,
        take_lease=options.take_lease,
        rate_hz=options.rate_hz,
        diagnostics=options.json and role is Role.OBSERVER,
    )


def _run_several(options: argparse.Namespace, physics: Mapping[str, Physics]) -> int:
    if not physics or "" in physics or options.device:
        log.error("this program selects its devices itself: expected no --device")
        return 1
    start = time.monotonic()
    try:
        stats = asyncio.run(_touch_several(options, physics))
    except (RefusedForGood, OSError, ValueError) as error:
        log.error(error)
        return 1
    for device, of_device in stats.items():
        _print_summary(of_device, time.monotonic() - start, options.json, device)
    return 0 if all(of_device.sessions > 0 for of_device in stats.values()) else 1


async def _touch_several(options: argparse.Namespace, physics: Mapping[str, Physics]) -> dict[str, Stats]:
    """Runs until --duration-s, SIGINT or SIGTERM, or until a callback raises an exception."""

    async def touch(device: str, client: aio.Client) -> None:
        reported: LinkReport | None = None
        async for hand in client.states(options.duration_s or None):
            if options.json and client.report is not reported:
                reported = client.report
                _print_report(reported, device)
            client.answer(hand, physics[device](hand))

    async with AsyncExitStack() as stack:
        clients: dict[str, aio.Client] = {}
        for device in physics:
            client = aio.Client(options.server, _config(options, device, Role.CONTROLLER))
            clients[device] = await stack.enter_async_context(client)
        tasks = [asyncio.create_task(touch(*item)) for item in clients.items()]
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, lambda: [task.cancel() for task in tasks])
        try:
            await asyncio.gather(*tasks)
        except asyncio.CancelledError:
            pass  # the regular way to stop
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
    return {device: client.stats for device, client in clients.items()}


def _print_report(report: LinkReport | None, device: str = "") -> None:
    if report is not None:  # None: a new session
        words = ({"device": device} if device else {}) | _in_words(report)
        print(json.dumps({"report": words}, separators=(",", ":")), flush=True)


def _print_diagnoses(
    device: DeviceReport | None, peers: dict[int, PeerReport], told: dict[int | None, DeviceReport | PeerReport]
) -> None:
    """Prints the reports that are not in `told`."""
    if device is not None and told.get(None) is not device:
        told[None] = device
        words: dict[str, object] = {
            "number": device.number,
            "span_ms": device.span_ns / 1e6,
            "steps": device.steps,
            "missed": device.missed,
            "overruns": device.overruns,
            "unseen": device.unseen,
            "lateness_us_log2": device.lateness,
            "safety": device.safety.name.lower(),
            "fault": device.fault,
            "degraded": device.degraded,
        }
        print(json.dumps({"device": words}, separators=(",", ":")), flush=True)
    for channel, peer in peers.items():
        if told.get(channel) is peer:
            continue
        told[channel] = peer
        words = {"channel": channel, "name": peer.name, "state_one_in": peer.state_one_in}
        words |= {"forces_refused": peer.forces_refused, "link": _in_words(peer.link)}
        print(json.dumps({"peer": words}, separators=(",", ":")), flush=True)


def _in_words(report: LinkReport) -> dict[str, object]:
    def delays(of: Delays | None) -> dict[str, float] | None:
        return None if of is None else {"median": of.median_ns / 1e6, "p99": of.p99_ns / 1e6}

    return {
        "number": report.number,
        "forces": report.forces,
        "late_server": report.late_server,
        "late_network": report.late_network,
        "late_engine": report.late_engine,
        "late_unknown": report.late_unknown,
        "refused": {
            "not_finite": report.refused_not_finite,
            "out_of_bounds": report.refused_out_of_bounds,
            "unknown_tick": report.refused_unknown_tick,
            "old_sequence": report.refused_old_sequence,
        },
        "worst_late_ms": report.worst_late_ns / 1e6,
        "longest_gap_ms": report.longest_gap_ns / 1e6,
        "round_trip_ms": delays(report.round_trip),
        "to_server_ms": delays(report.to_server),
        "to_client_ms": delays(report.to_client),
        "clock_error_ms": report.clock_error_ns / 1e6,
        "received": report.received,
        "lost": report.lost,
        "reordered": report.reordered,
        "duplicated": report.duplicated,
    }


def _print_summary(stats: Stats, duration_s: float, as_json: bool, device: str = "") -> None:
    link = stats.link
    round_trip_ms, variation_ms = link.smoothed_round_trip_ns / 1e6, link.round_trip_variation_ns / 1e6
    if as_json:
        summary: dict[str, object] = {"device": device} if device else {}
        summary |= {
            "duration_s": round(duration_s, 3),
            "sessions": stats.sessions,
            "states": stats.states,
            "states_skipped": stats.states_skipped,
            "forces": stats.forces,
            "forces_unusable": stats.forces_unusable,
            "lost_incoming": link.lost,
            "lost_outgoing": link.lost_outgoing,
            "round_trip_ms": round(round_trip_ms, 3),
            "round_trip_variation_ms": round(variation_ms, 3),
        }
        print(json.dumps({"summary": summary}, separators=(",", ":")), flush=True)
    elif stats.sessions == 0:
        log.error("%swas never connected", f"{device}: " if device else "")
    else:
        log.info(
            "%s%.1f s, %d states received (%d skipped), %d forces sent (%d more unusable), "
            "datagrams lost: %d incoming, %d outgoing, round trip %.2f ± %.2f ms",
            f"{device}: " if device else "",
            duration_s,
            stats.states,
            stats.states_skipped,
            stats.forces,
            stats.forces_unusable,
            link.lost,
            link.lost_outgoing,
            round_trip_ms,
            variation_ms,
        )
