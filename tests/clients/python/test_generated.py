# SPDX-License-Identifier: Apache-2.0
"""Tests the output of protocol/generator for tendon.proto."""

import re
import shutil
import sys

import pytest
from conftest import ROOT

pytest.importorskip("tomllib", reason="the generator needs Python 3.11")
sys.path.insert(0, str(ROOT / "protocol" / "generator"))
import files  # noqa: E402
import model  # noqa: E402
import page  # noqa: E402

pytestmark = pytest.mark.skipif(shutil.which("protoc") is None, reason="no protoc: apt-get install protobuf-compiler")


@pytest.fixture(scope="module")
def wire():
    return model.load()


def test_the_committed_files_are_what_tendon_proto_says(wire):
    stale = [path for path, text in files.made(wire).items() if (ROOT / path).read_text(encoding="utf-8") != text]
    assert not stale, "run protocol/generate"


def test_a_message_or_enum_without_a_table_on_the_page_is_an_error(wire):
    text = (ROOT / page.PATH).read_text(encoding="utf-8")
    assert page.rewritten(text, wire) == text
    marker = "<!-- generated from tendon.proto: {} -->\n"
    for name in ("Echo", "Mode"):
        assert marker.format(name) in text
        with pytest.raises(ValueError, match=f"0 tables of {name}"):
            page.rewritten(text.replace(marker.format(name), ""), wire)
    with pytest.raises(ValueError, match="2 tables of Echo"):
        page.rewritten(f"{text}{marker.format('Echo')}<!-- end -->\n", wire)
    with pytest.raises(ValueError, match="Ecko, which is not in tendon.proto"):
        page.rewritten(f"{text}{marker.format('Ecko')}<!-- end -->\n", wire)


def test_the_bounds_of_a_table_are_those_of_the_fields(wire):
    text = page.rewritten((ROOT / page.PATH).read_text(encoding="utf-8"), wire)

    def row(message, field):
        table = text.partition(f"tendon.proto: {message} -->")[2].partition("<!-- end -->")[0]
        (found,) = [line for line in table.splitlines() if f"| `{field}` |" in line]
        return found

    for message, field, bounds in (
        ("DeviceState", "position_m", "± 10¹² m each"),
        ("DeviceState", "permitted_force_n", "0 … 10¹² N or +infinity"),
        ("DeviceState", "orientation", "norm 1 ± 0.001"),
        ("DeviceState", "mode", "1 … 6"),
        ("ForceCommand", "valid_for_us", "1 … 10 000 000 µs"),
        ("Contact", "normal", "length 1 ± 0.001"),
        ("LocalModel", "stiffness_npm", "1, 3 or 9 entries, ± 10¹² N/m"),
        ("ForceTable", "step_m", "> 0, ≤ 10¹² m"),
        ("PortState", "position_scale", "0.01 … 100 or 0"),
        ("PeerReport", "link", "present"),
        ("DeviceReport", "lateness_us_log2", "≤ 24 entries, sum of `lateness_us_log2` ≤ `steps`"),
        ("SetOutput", "rgb", "0 … 0xFFFFFF"),
        ("Hello", "features", "≤ 16 entries, each ≤ 32 bytes"),
        ("Datagram", "tx_time_ns", "± 2⁶⁰ ns"),
    ):
        assert row(message, field).endswith(f"| {bounds} |"), field


def test_a_bound_is_read_from_the_front_of_a_comment():
    read = model.split_comment
    assert read("[0, 7]: of the force") == (model.Bound(model.Range("0", "7")), "of the force")
    assert read("(0, 1e12]") == (model.Bound(model.Range("0", "1e12", beyond=True)), "")
    assert read("[1, …]: 1, 2, 3") == (model.Bound(model.Range("1", None)), "1, 2, 3")
    assert read("[0.01, 100] or 0") == (model.Bound(model.Range("0.01", "100", zero=True)), "")
    assert read("[0, 1e12] or +infinity: far") == (model.Bound(model.Range("0", "1e12", infinity=True)), "far")
    assert read("[0, 64] bytes: for logs") == (model.Bound(bytes=model.Range("0", "64")), "for logs")
    assert read("[1, 8] entries") == (model.Bound(entries=(1, 8)), "")
    names = model.Bound(bytes=model.Range("0", "32"), entries=(0, 16))
    assert read("[0, 16] entries of [0, 32] bytes: offered") == (names, "offered")
    matrix = model.Bound(model.Range("-1e12", "1e12"), entries=frozenset({1, 3, 9}))
    assert read("[-1e12, 1e12], {1, 3, 9} entries") == (matrix, "")
    assert read("bits 1, 2, 4") == (model.Bound(), "bits 1, 2, 4")


@pytest.mark.parametrize("wrong", ["[0, 7", "[0 7]", "[0, 7] byte", "{1, 3}", "[0, 7] and more"])
def test_a_bound_that_cannot_be_read_is_an_error(wrong):
    with pytest.raises(ValueError, match="no bound"):
        model.split_comment(wrong)


def test_a_new_field_needs_no_other_file(tmp_path):
    proto = tmp_path / "tendon.proto"
    text = model.PROTO.read_text(encoding="utf-8")
    for message, field in (
        ("DeviceState", "double grip_energy_j = 99;  // [-1e3, 1e3]: of the gripper"),
        ("ForceCommand", "Vec3 bias_n = 99;  // absent if there is none"),
        ("SetShare", "uint32 ramp_ms = 99;  // [0, 5000]"),
        ("LinkReport", "repeated string hints = 99;  // [0, 4] entries of [0, 24] bytes"),
    ):
        front = f"message {message} {{\n"
        assert front in text
        text = text.replace(front, f"{front}  {field}\n")
    proto.write_text(text, encoding="utf-8")
    made = files.made(model.load(proto))
    values, codec = (made[f"clients/python/tendon/{name}"] for name in ("generated.py", "codec/generated.py"))
    assert "    grip_energy: float = 0.0  # J, of the gripper\n" in values
    assert "    bias: Vec3 | None = None  # N, None if there is none\n" in values
    assert "    ramp_ms: int = 0\n" in values
    assert "    hints: Sequence[str] = ()\n" in values
    assert "    if not -1e3 <= grip_energy_j <= 1e3:\n" in codec
    assert "    if ramp_ms > 5000:\n" in codec
    assert '    hints = read_texts("hints", m.hints, 0, 4, 24)\n' in codec
    table = made["protocol/WIRE.md"]
    assert "| 99 | `grip_energy_j` | double | of the gripper | ± 10³ J |\n" in table
    assert "| 99 | `bias_n` | `Vec3` | absent if there is none | ± 10¹² N each |\n" in table
    assert "| 99 | `ramp_ms` | uint32 | | 0 … 5000 ms |\n" in table
    assert "| 99 | `hints` | repeated string | | ≤ 4 entries, each ≤ 24 bytes |\n" in table
    values, codec = (made[f"clients/typescript/src/gen/{name}.ts"] for name in ("messages", "codec"))
    assert "  readonly gripEnergy?: number | undefined;\n" in values
    assert "  readonly hints?: readonly string[] | undefined;\n" in values
    assert '  if (!isWithin(m.gripEnergyJ, -1e3, 1e3)) return "grip_energy_j";\n' in codec
    assert "  ...(m.biasN && { bias: readVec3(m.biasN) }),\n" in codec
    assert "    hints: clipAll(value.hints ?? [], 4, 24),\n" in codec
    frames, requests = (made[f"clients/csharp/package/Runtime/Wire/Generated/{name}.cs"] for name in ("Frames", "Requests"))
    assert "    /// <summary>J, of the gripper</summary>\n    public double GripEnergy;\n" in frames
    assert "    public Vec3? Bias;\n" in frames
    assert '      if (!(GripEnergy >= -1e3 && GripEnergy <= 1e3)) return "grip_energy_j";\n' in frames
    assert "      if (Bias.HasValue) w.PresentVec3(794, Bias.Value);\n" in frames
    assert "      w.Texts(794, Hints, 4, 24);\n" in frames
    assert '      if (RampMs > 5000) return "ramp_ms";\n' in requests
    if shutil.which("clang-format") is not None:
        frames, requests = (made[f"protocol/wire/generated/{name}_fields.h"] for name in ("frame", "request"))
        values = re.sub(r" +///<", "  ///<", made["protocol/wire/generated/messages.h"])
        assert "  double grip_energy = 0;  ///< J, ± 10³: of the gripper\n" in values
        assert "  std::optional<Vec3> bias{};  ///< N, empty if there is none\n" in values
        assert "  Duration ramp{};" in values
        assert "  std::vector<std::string> hints{};" in values
        assert "state.grip_energy == 0;\n" in values
        assert '  way.number(field<99>, "grip_energy_j", state.grip_energy, Within{-1e3, 1e3});\n' in frames
        assert '  way.maybe(field<99>, "bias_n", command.bias);\n' in frames
        assert '  way.texts(field<99>, "hints", report.hints, Entries{0, 4}, 24);\n' in frames
        assert '  way.period(field<99>, "ramp_ms", share.ramp,\n' in requests
