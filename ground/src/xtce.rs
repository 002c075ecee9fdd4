//! `ground xtce`: the packet of Table A.3 as an XTCE 1.2 definition (OMG, formal/18-10-04), for ground stations that decode by one
//! (Yamcs, OpenMCT on it).
//!
//! In: the field table of [`emems::packet::field`] and the channels of [`packets::channel`]. Out: XML. The same version of the
//! program gives the same bytes.
//!
//! A value of the packet is text, four hexadecimal digits, and XTCE has no encoding for that. So `a1x_text` is a string parameter
//! of the container, and an algorithm in JavaScript, as Yamcs runs it, gives `a1x`: its raw value is counts, and the
//! calibrator of its type gives nominal SI. Of a value that was not read, or that a magnetometer marks as overflowed, there is
//! no `a1x`; a code that no part can give, which si.csv leaves out, has one. The packet has no checksum: the container is chosen
//! by its first byte.

use std::fmt::Write;

use emems::{
    packet::{self, PACKET_BYTES, field},
    sample::{NOT_READ, SENSOR_COUNT, SENSORS},
    sensor::hmc5883l::OVERFLOW,
};
use logs::table::SLOT_NAMES;
use packets::channel::{CHANNELS, Channel, Quantity};

/// Prints the packet as an XTCE 1.2 definition, for Yamcs and other ground stations
///
/// Values in counts and nominal SI, the error identifier as one flag a sensor, lift-off and micro-gravity.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  ground xtce > e-mems.xml")]
pub struct XtceArguments {}

/// Bits of a byte.
const BITS: usize = 8;

const QUANTITIES: [Quantity; 5] = [
    Quantity::SpecificForce,
    Quantity::Field,
    Quantity::Rate,
    Quantity::GyroTemperature,
    Quantity::Temperature,
];

fn type_name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::SpecificForce => "specific_force",
        Quantity::Field => "field",
        Quantity::Rate => "rate",
        Quantity::GyroTemperature => "gyro_temperature",
        Quantity::Temperature => "temperature",
    }
}

/// Offset of a channel's value in the packet \[bytes\].
fn offset(index: usize) -> usize {
    let Channel { quantity, .. } = CHANNELS[index];
    let group = match quantity {
        Quantity::SpecificForce => field::ACCELEROMETERS,
        Quantity::Field => field::MAGNETOMETERS,
        Quantity::Rate => field::GYROS,
        Quantity::GyroTemperature => field::GYRO_TEMPERATURES,
        Quantity::Temperature => field::TEMPERATURES,
    };
    let before = CHANNELS[..index].iter().filter(|channel| channel.quantity == quantity);
    group + field::VALUE_BYTES * before.count()
}

/// What the container holds: name, type and offset \[bytes\], in the packet's order; the first byte belongs to every frame.
fn entries() -> Vec<(String, &'static str, usize)> {
    let mut entries = vec![
        ("counter_text".into(), "digits", field::COUNTER),
        ("errors_text".into(), "digits", field::ERRORS.start),
    ];
    entries.extend((0..CHANNELS.len()).map(|k| (format!("{}_text", CHANNELS[k].name), "digits", offset(k))));
    entries.extend([
        ("lift_off".into(), "flag", field::LIFT_OFF),
        ("micro_g".into(), "flag", field::MICRO_G),
        ("end".into(), "mark", field::END),
    ]);
    entries
}

/// The definition.
pub fn definition() -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // Writing to a string cannot fail.
    let _ = write(&mut xml);
    xml
}

fn write(xml: &mut String) -> std::fmt::Result {
    writeln!(
        xml,
        "<SpaceSystem xmlns=\"http://www.omg.org/spec/XTCE/20180204\" name=\"e-MEMS\" shortDescription=\"Attitude sensor unit: the packet of Table A.3\">"
    )?;
    writeln!(
        xml,
        " <Header version=\"{}\" validationStatus=\"Released\"/>",
        env!("CARGO_PKG_VERSION")
    )?;
    writeln!(xml, " <TelemetryMetaData>")?;
    types(xml)?;
    parameters(xml)?;
    containers(xml)?;
    algorithms(xml)?;
    writeln!(xml, " </TelemetryMetaData>\n</SpaceSystem>")
}

fn types(xml: &mut String) -> std::fmt::Result {
    writeln!(xml, "  <ParameterTypeSet>")?;
    for (name, bytes, what) in [
        ("mark", 1, "First or last byte of a packet"),
        ("digits", field::VALUE_BYTES, "Four upper-case hexadecimal digits"),
    ] {
        writeln!(
            xml,
            "   <StringParameterType name=\"{name}\" shortDescription=\"{what}\"><StringDataEncoding encoding=\"US-ASCII\"><SizeInBits><Fixed><FixedValue>{}</FixedValue></Fixed></SizeInBits></StringDataEncoding></StringParameterType>",
            BITS * bytes
        )?;
    }
    for (name, bits, no, yes) in [
        ("flag", BITS, (b'0', "NO"), (b'1', "YES")),
        ("failed", 1, (0, "READ"), (1, "FAILED")),
    ] {
        writeln!(
            xml,
            "   <EnumeratedParameterType name=\"{name}\"><IntegerDataEncoding sizeInBits=\"{bits}\" encoding=\"unsigned\"/><EnumerationList><Enumeration value=\"{}\" label=\"{}\"/><Enumeration value=\"{}\" label=\"{}\"/></EnumerationList></EnumeratedParameterType>",
            no.0, no.1, yes.0, yes.1
        )?;
    }
    writeln!(
        xml,
        "   <IntegerParameterType name=\"count\" signed=\"false\" sizeInBits=\"16\"><IntegerDataEncoding sizeInBits=\"16\" encoding=\"unsigned\"/></IntegerParameterType>"
    )?;
    for quantity in QUANTITIES {
        let (lsb, zero) = quantity.scale();
        writeln!(
            xml,
            "   <FloatParameterType name=\"{}\" sizeInBits=\"64\" shortDescription=\"Nominal: scale of the data sheet, no calibration\"><UnitSet><Unit>{}</Unit></UnitSet><IntegerDataEncoding sizeInBits=\"16\" encoding=\"twosComplement\"><DefaultCalibrator><PolynomialCalibrator><Term coefficient=\"{zero}\" exponent=\"0\"/><Term coefficient=\"{lsb}\" exponent=\"1\"/></PolynomialCalibrator></DefaultCalibrator></IntegerDataEncoding></FloatParameterType>",
            type_name(quantity),
            quantity.unit()
        )?;
    }
    writeln!(xml, "  </ParameterTypeSet>")
}

fn parameters(xml: &mut String) -> std::fmt::Result {
    writeln!(
        xml,
        "  <ParameterSet>\n   <Parameter name=\"start\" parameterTypeRef=\"mark\"/>"
    )?;
    for (name, kind, _) in entries() {
        writeln!(xml, "   <Parameter name=\"{name}\" parameterTypeRef=\"{kind}\"/>")?;
    }
    let mut derived = |name: &str, kind: &str, what: &str| {
        writeln!(
            xml,
            "   <Parameter name=\"{name}\" parameterTypeRef=\"{kind}\" shortDescription=\"{what}\"><ParameterProperties dataSource=\"derived\"/></Parameter>"
        )
    };
    derived("counter", "count", "Number of the cycle, modulo 65,536")?;
    for (name, sensor) in SLOT_NAMES.iter().zip(SENSORS) {
        derived(&format!("{name}_failed"), "failed", &sensor.to_string())?;
    }
    for channel in CHANNELS {
        derived(
            channel.name,
            type_name(channel.quantity),
            &format!("Plate {}", channel.plate + 1),
        )?;
    }
    writeln!(xml, "  </ParameterSet>")
}

fn containers(xml: &mut String) -> std::fmt::Result {
    let entry = |name: &str, at: usize| {
        format!(
            "     <ParameterRefEntry parameterRef=\"{name}\"><LocationInContainerInBits referenceLocation=\"containerStart\"><FixedValue>{}</FixedValue></LocationInContainerInBits></ParameterRefEntry>\n",
            BITS * at
        )
    };
    let body: String = entries().iter().map(|(name, _, at)| entry(name, *at)).collect();
    writeln!(
        xml,
        "  <ContainerSet>\n   <SequenceContainer name=\"frame\" abstract=\"true\">\n    <EntryList>\n{}    </EntryList>\n   </SequenceContainer>\n   <SequenceContainer name=\"packet\" shortDescription=\"Table A.3, one a cycle\">\n    <BinaryEncoding><SizeInBits><FixedValue>{}</FixedValue></SizeInBits></BinaryEncoding>\n    <EntryList>\n{body}    </EntryList>\n    <BaseContainer containerRef=\"frame\"><RestrictionCriteria><Comparison parameterRef=\"start\" value=\"{}\"/></RestrictionCriteria></BaseContainer>\n   </SequenceContainer>\n  </ContainerSet>",
        entry("start", 0),
        BITS * PACKET_BYTES,
        char::from(packet::START)
    )
}

fn algorithms(xml: &mut String) -> std::fmt::Result {
    writeln!(xml, "  <AlgorithmSet>")?;
    let mut algorithm = |of: &str, text: &str, outputs: &[(String, String)]| {
        let outputs: String = outputs
            .iter()
            .map(|(name, parameter)| {
                format!("<OutputParameterRef outputName=\"{name}\" parameterRef=\"{parameter}\"/>")
            })
            .collect();
        writeln!(
            xml,
            "   <CustomAlgorithm name=\"{of}_of_text\"><AlgorithmText language=\"JavaScript\">{text}</AlgorithmText><InputSet><InputParameterInstanceRef inputName=\"text\" parameterRef=\"{of}_text\"/></InputSet><OutputSet>{outputs}</OutputSet><TriggerSet><OnParameterUpdateTrigger parameterRef=\"{of}_text\"/></TriggerSet></CustomAlgorithm>"
        )
    };
    let out = |parameter: &str| [("out".to_owned(), parameter.to_owned())];
    algorithm("counter", "out.value = parseInt(text.value, 16);", &out("counter"))?;
    let failed: [(String, String); SENSOR_COUNT] = SLOT_NAMES.map(|name| (name.to_owned(), format!("{name}_failed")));
    let bits: String = SLOT_NAMES
        .iter()
        .enumerate()
        .map(|(slot, name)| format!(" {name}.value = (n >> {slot}) % 2;"))
        .collect();
    algorithm("errors", &format!("var n = parseInt(text.value, 16);{bits}"), &failed)?;
    for channel in CHANNELS {
        let mut none = format!("text.value != \"{:04X}\"", NOT_READ.cast_unsigned());
        if channel.quantity == Quantity::Field {
            write!(none, " &amp;&amp; text.value != \"{:04X}\"", OVERFLOW.cast_unsigned())?;
        }
        let text =
            format!("if ({none}) {{ var n = parseInt(text.value, 16); out.value = n >= 32768 ? n - 65536 : n; }}");
        algorithm(channel.name, &text, &out(channel.name))?;
    }
    writeln!(xml, "  </AlgorithmSet>")
}

#[cfg(test)]
mod tests {
    use emems::{packet::encode, sample::Reading};
    use packets::channel::counts;

    use super::*;

    /// Every channel is where the packet has it: a packet with one value set has it at the offset told, and nowhere else.
    #[test]
    fn every_channel_is_where_the_packet_has_it() {
        for index in 0..CHANNELS.len() {
            let mut bytes = encode(&Reading::unread(7));
            let at = offset(index);
            bytes[at..at + field::VALUE_BYTES].copy_from_slice(b"0123");
            let values = counts(&packet::decode(&bytes).expect("a packet"));
            let set: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_some()).collect();
            assert_eq!(
                (set, values[index]),
                (vec![index], Some(0x123)),
                "{}",
                CHANNELS[index].name
            );
        }
    }

    #[test]
    fn the_entries_fill_the_packet_without_overlap() {
        let mut next = 1;
        for (name, kind, at) in entries() {
            assert_eq!(at, next, "{name}");
            next += if kind == "digits" { field::VALUE_BYTES } else { 1 };
        }
        assert_eq!(next, PACKET_BYTES);
    }

    #[test]
    fn every_parameter_that_is_named_is_there_once() {
        let xml = definition();
        for (name, ..) in entries() {
            assert_eq!(xml.matches(&format!("<Parameter name=\"{name}\"")).count(), 1, "{name}");
        }
        for part in xml.split("parameterRef=\"").skip(1) {
            let name = part.split('"').next().expect("a name");
            assert_eq!(xml.matches(&format!("<Parameter name=\"{name}\"")).count(), 1, "{name}");
        }
    }
}
