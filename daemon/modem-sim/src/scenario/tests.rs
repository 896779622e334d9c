use super::*;

fn read(text: &str) -> Result<Scenario, UserError> {
    Scenario::read(ScenarioSource { path: Path::new("x.toml"), text })
}

const PAIR: &str = "[[modem]]\nname = \"a\"\nkind = \"s2c\"\naddress = 1\n[[modem]]\nname = \"b\"\nkind = \"micromodem\"\naddress = 2\n";

#[test]
fn keys_that_are_not_given_have_defaults() {
    let scenario = read(PAIR).unwrap();
    assert_eq!(scenario.channel, ChannelConfig::default());
    let ModemMake::S2c(config) = &scenario.modems[0].make else { panic!("an S2C") };
    assert_eq!((config.address, config.baud), (1, Some(19_200)));
    assert_eq!(scenario.modems[1].port, EmulatedPort::Pty);
}

#[test]
fn every_error_names_the_file_line_key_and_allowed_values() {
    for (more, expected) in [
        ("sed = 1\n", "x.toml:9: there is no key modem.sed here; allowed are address, "),
        ("[chanel]\n", "x.toml:9: there is no key chanel here; allowed are channel, fault, "),
        (
            "[channel]\npreset = \"atlantis\"\n",
            "x.toml:10: channel.preset = \"atlantis\" is not allowed: it takes one of calm_lake",
        ),
        (
            "[channel]\ncorruption = 2\n",
            "x.toml:10: channel.corruption = 2 is not allowed: it takes a number from 0 to 1",
        ),
        (
            "[channel.loss]\nmodel = \"independent\"\n",
            "x.toml:9: channel.loss.probability is missing: it takes a number from 0 to 1",
        ),
        (
            "[channel.loss]\nmodel = \"independent\"\nprobability = 0.1\nbad_s = 3\n",
            "x.toml:12: there is no key channel.loss.bad_s here; allowed are model, probability",
        ),
        (
            "[channel.loss]\nmodel = \"trace\"\nfile = \"nowhere.csv\"\n",
            "x.toml:11: channel.loss.file = \"nowhere.csv\" is not allowed: it takes a file that can be read",
        ),
        (
            "[[fault]]\nat_s = 3\nmodem = \"c\"\nwhat = \"busy\"\n",
            "x.toml:11: fault.modem = \"c\" is not allowed: it takes one of a, b",
        ),
        (
            "[[fault]]\nat_s = 3\nmodem = \"a\"\nwhat = \"melt\"\n",
            "x.toml:12: fault.what = \"melt\" is not allowed: it takes one of busy, reboot",
        ),
        (
            "[[fault]]\nat_s = 3\nmodem = \"a\"\nwhat = \"reboot\"\nfor_s = 3\n",
            "x.toml:13: there is no key fault.for_s here",
        ),
        (
            "[[outage]]\nfrom_s = 5\nuntil_s = 5\n",
            "x.toml:11: outage.until_s = 5 is not allowed: it takes a time after from_s",
        ),
        ("[[modem]]\nname = \"a\"\nkind = \"s2c\"\naddress = 3\n", "modem.name = \"a\" is given twice"),
        (
            "[[modem]]\nname = \"c\"\nkind = \"s2c\"\naddress = 300\n",
            "x.toml:12: modem.address = 300 is not allowed: it takes a whole number from 1 to 254",
        ),
        (
            "[[modem]]\nname = \"c\"\nkind = \"s2c\"\n",
            "modem.address is missing: it takes a whole number from 1 to 254",
        ),
        ("[[modem]]\nname = \"../c\"\n", "x.toml:10: modem.name = \"../c\" is not allowed"),
        ("port = \"usb\"\n", "x.toml:9: modem.port = \"usb\" is not allowed: it takes \"pty\" or \"tcp:ADDRESS:PORT\""),
        ("track = [[0, 1, 2]]\n", "x.toml:9: modem.track = [[0, 1, 2]] is not allowed: it takes rows"),
        ("baud = 19200 19\n", "x.toml:9: "),
    ] {
        let error = read(&format!("{PAIR}{more}")).expect_err(more);
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(expected), "{error}\n{expected}");
    }
    assert!(read("").unwrap_err().to_string().contains("there is no [[modem]]"));
}

#[test]
fn the_channel_is_read_with_presets_links_and_outages() {
    let text = format!(
        "{PAIR}[channel]\npreset = \"under_ice\"\nduplication = 0.5\n[[link]]\nfrom = \"a\"\nto = \"b\"\nloss = {{ model = \"snr\", sea_state = 3 }}\n\
         [[outage]]\nfrom = \"b\"\nto = \"a\"\n[[stranger]]\nposition_m = [100, 0, 5]\n"
    );
    let scenario = read(&text).unwrap();
    assert_eq!((scenario.channel.sound_speed_m_s, scenario.channel.duplication), (1439.0, 0.5));
    assert!(matches!(scenario.links[..], [(NodeId(1), NodeId(2), LossModel::Snr(_))]));
    assert_eq!(scenario.channel.outages, [sim_channel::Outage::one_way(NodeId(2), NodeId(1))]);
    assert_eq!(scenario.strangers.len(), 1);
}

#[test]
fn the_scenarios_that_come_with_the_program_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().unwrap().to_string_lossy().starts_with("modems-") {
            Scenario::load(&path).unwrap();
            read += 1;
        }
    }
    assert!(read >= 4, "{read}");
}
