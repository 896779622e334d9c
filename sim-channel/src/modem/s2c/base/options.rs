//! The switches `@Z..` and `@CTRL` of the port; a restart clears them.

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PortOptions {
    extended: bool,
    usbl: bool,
    networking: bool,
    other: bool,
    control: bool,
}

impl PortOptions {
    /// `@ZX`: notifications of each transmission and reception.
    pub(crate) fn extended(&self) -> bool {
        self.extended
    }

    /// `@ZU`: notifications of the USBL head.
    pub(crate) fn usbl(&self) -> bool {
        self.usbl
    }

    /// `@ZF`: extended networking, with a protocol id in every message.
    pub(crate) fn networking(&self) -> bool {
        self.networking
    }

    /// `@CTRL`: the right to change settings.
    pub(crate) fn control(&self) -> bool {
        self.control
    }

    /// Sets the option `key`; returns the reply.
    pub(crate) fn set(&mut self, key: &str, value: &str) -> &'static str {
        if (key, value) == ("CTRL", "") {
            self.control = true;
            return "OK";
        }
        let switch = match key {
            "ZX" => &mut self.extended,
            "ZU" => &mut self.usbl,
            "ZF" => &mut self.networking,
            "ZA" => &mut self.other,
            _ => return "ERROR UNKNOWN COMMAND",
        };
        *switch = match value {
            "0" => false,
            "1" => true,
            _ => return "ERROR OUT OF RANGE",
        };
        "OK"
    }

    /// The value behind `?` of an option.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        let switch = match key {
            "ZX" => self.extended,
            "ZU" => self.usbl,
            "ZF" => self.networking,
            "ZA" => self.other,
            _ => return None,
        };
        Some(u8::from(switch).to_string())
    }
}
