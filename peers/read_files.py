"""Reads what `ground` writes for other programs with readers of others, and compares it with si.csv.

In: a folder of `cargo fly` or `ground decode`, and the XTCE definition of `ground xtce`. Out: a line a file; ends with 1 where
one differs. MCAP is read by the package mcap. The definition is validated against the XTCE 1.2 schema that
space-packet-parser brings, and the flight's packets are decoded with it: the strings by space-packet-parser, the algorithms in
JavaScript by dukpy, the polynomials as the definition has them.
Packages: `python3 -m venv peers/.venv && peers/.venv/bin/pip install -r peers/requirements.txt`.
"""

import csv
import json
import pathlib
import sys

import dukpy
import space_packet_parser
import xmlschema
from lxml import etree
from mcap.reader import make_reader
from space_packet_parser.xtce.definitions import XtcePacketDefinition

NS = {"x": "http://www.omg.org/spec/XTCE/20180204"}
PACKET_BYTES = 156
# Of a cell's last digit.
HALF = 0.501
SENSORS = [f"{kind}{plate}" for kind in "amgt" for plate in range(1, 5)]


def table(folder, name="si.csv"):
    with open(folder / name, newline="") as file:
        return list(csv.DictReader(file))


def differs(rows, values):
    """The first channel and row that are not as in si.csv."""
    for k, (row, found) in enumerate(zip(rows, values, strict=True)):
        for name, cell in row.items():
            if name == "t_s":
                continue
            if (cell == "") != (name not in found):
                return f"row {k}, {name}: {cell!r} and {found.get(name)}"
            if cell and abs(float(cell) - found[name]) > HALF * 10.0 ** -len(cell.partition(".")[2]):
                return f"row {k}, {name}: {cell} and {found[name]}"
    return None


def messages(folder, rows):
    found, topics, norm = [], {}, 0.0
    with open(folder / "flight.mcap", "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            value = json.loads(message.data)
            missing = set(value) - set(json.loads(schema.data)["properties"])
            if missing:
                return f"{channel.topic} has {missing}, which its schema does not"
            topics[channel.topic] = topics.get(channel.topic, 0) + 1
            if channel.topic == "/si":
                found.append((message.log_time, value))
            if channel.topic == "/attitude":
                norm = max(norm, abs(sum(part**2 for part in value["rotation"].values()) - 1.0))
    found.sort(key=lambda one: one[0])
    late = [k for k, ((at, _), row) in enumerate(zip(found, rows)) if abs(at * 1e-9 - float(row["t_s"])) > 1e-3]
    print("flight.mcap:", ", ".join(f"{topic} {count}" for topic, count in sorted(topics.items())))
    if late:
        return f"row {late[0]} has another time"
    if norm > 1e-5:
        return f"an attitude's norm is off by {norm}"
    return differs(rows, [value for _, value in found])


def algorithms(root):
    """One script of all algorithms: texts in, outputs by parameter out."""
    script = ["var all = {};"]
    for one in root.iterfind(".//x:CustomAlgorithm", NS):
        given = one.find(".//x:InputParameterInstanceRef", NS)
        outputs = one.findall(".//x:OutputParameterRef", NS)
        script.append("(function() {")
        script.append(f"var {given.get('inputName')} = {{ value: dukpy[{given.get('parameterRef')!r}] }};")
        script += [f"var {out.get('outputName')} = {{}};" for out in outputs]
        script.append(one.find("x:AlgorithmText", NS).text)
        script += [
            f"if ({out.get('outputName')}.value !== undefined) all[{out.get('parameterRef')!r}] = {out.get('outputName')}.value;"
            for out in outputs
        ]
        script.append("})();")
    return "\n".join([*script, "all;"])


def packets(folder, definition_file, rows):
    schema = pathlib.Path(space_packet_parser.__file__).parent / "xtce/schemas/SpaceSystem.xsd"
    xmlschema.XMLSchema(schema).validate(definition_file)
    root = etree.parse(definition_file).getroot()
    definition = XtcePacketDefinition.from_xtce(definition_file, root_container_name="frame")
    script = algorithms(root)
    scale = {}
    for kind in root.iterfind(".//x:FloatParameterType", NS):
        terms = kind.iterfind(".//x:Term", NS)
        scale[kind.get("name")] = {int(term.get("exponent")): float(term.get("coefficient")) for term in terms}
    kinds = {one.get("name"): one.get("parameterTypeRef") for one in root.iterfind(".//x:Parameter", NS)}
    stream = (folder / "packets.txt").read_bytes()
    values, flags, at = [], [], 0
    while (at := stream.find(b"@", at)) >= 0 and at + PACKET_BYTES <= len(stream):
        read = definition.parse_bytes(stream[at : at + PACKET_BYTES])
        raw = dukpy.evaljs(script, **{name: str(value) for name, value in read.items()})
        values.append(
            {
                name: sum(term * raw[name] ** exponent for exponent, term in scale[kind].items())
                for name, kind in kinds.items()
                if kind in scale and name in raw
            }
        )
        errors = sum(raw[f"{sensor}_failed"] << k for k, sensor in enumerate(SENSORS))
        flags.append((raw["counter"], f"{errors:04X}", str(read["lift_off"]), str(read["micro_g"])))
        at += PACKET_BYTES
    print(f"{definition_file}: valid XTCE 1.2; {len(values)} packets decoded")
    said = {"0": "NO", "1": "YES"}
    counts = [
        (int(row["counter"]), row["errors"], said[row["lift_off"]], said[row["micro_g"]])
        for row in table(folder, "counts.csv")
    ]
    if flags != counts:
        return "counter, error identifier or flags are not as in counts.csv"
    return differs(rows, values)


def main():
    folder, definition_file = pathlib.Path(sys.argv[1]), sys.argv[2]
    rows = table(folder)
    wrong = [why for why in (messages(folder, rows), packets(folder, definition_file, rows)) if why]
    print("\n".join(wrong) if wrong else f"both as si.csv has it, {len(rows)} rows")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
